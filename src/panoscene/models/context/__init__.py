"""Context: what objects and walls say about each other refines boxes and gives relations."""

from ._calibration import RELATIONS as RELATIONS
from ._calibration import Calibration as Calibration
from ._calibration import fit_calibration as fit_calibration
from ._calibration import relation_masks as relation_masks
from ._calibration import relation_probabilities as relation_probabilities
from ._config import CONFIGS as CONFIGS
from ._config import ContextConfig as ContextConfig
from ._estimates import Estimates as Estimates
from ._estimates import boxes_from_output as boxes_from_output
from ._losses import JOINT_WEIGHTS as JOINT_WEIGHTS
from ._losses import RELATION_WEIGHT as RELATION_WEIGHT
from ._losses import context_losses as context_losses
from ._losses import joint_losses as joint_losses
from ._network import ContextNetwork as ContextNetwork
from ._network import build_context as build_context
from ._relations import ContextOutput as ContextOutput
from ._relations import ContextTargets as ContextTargets
from ._relations import RelationBatch as RelationBatch
from ._scenes import objects_of as objects_of
from ._scenes import relations_of as relations_of
from ._stage import ContextStage as ContextStage
from ._stage import load_context_stage as load_context_stage
from ._walls import closed_polygon as closed_polygon
from ._walls import room_distances as room_distances
from ._walls import walls_of as walls_of
