"""The layout stage: HorizonNet, and the room that its signals describe."""

from ._config import COLUMNS as COLUMNS
from ._config import CONFIGS as CONFIGS
from ._config import LayoutConfig as LayoutConfig
from ._losses import layout_losses as layout_losses
from ._network import LayoutNetwork as LayoutNetwork
from ._network import LayoutSignals as LayoutSignals
from ._network import build_layout as build_layout
from ._published import read_published_layout as read_published_layout
from ._room import RoomReading as RoomReading
from ._room import room_from_signals as room_from_signals
from ._stage import LayoutPrediction as LayoutPrediction
from ._stage import LayoutStage as LayoutStage
from ._stage import load_layout_stage as load_layout_stage
