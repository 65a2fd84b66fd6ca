"""Pose: size, place and yaw of each detected object."""

from ._attention import RelationalAttention as RelationalAttention
from ._attention import pair_embedding as pair_embedding
from ._clues import CLUE_METRES as CLUE_METRES
from ._clues import CLUES as CLUES
from ._clues import GUESSES as GUESSES
from ._clues import pose_clues as pose_clues
from ._config import CONFIGS as CONFIGS
from ._config import PoseConfig as PoseConfig
from ._losses import LOSS_WEIGHTS as LOSS_WEIGHTS
from ._losses import pose_losses as pose_losses
from ._network import PoseNetwork as PoseNetwork
from ._network import PoseOutput as PoseOutput
from ._network import build_pose as build_pose
from ._stage import PoseStage as PoseStage
from ._stage import load_pose_stage as load_pose_stage
from ._stage import pose_crops as pose_crops
