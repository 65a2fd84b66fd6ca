"""The detector: Mask R-CNN whose picture is a cylinder."""

from ._boxes import box_overlaps as box_overlaps
from ._coco import load_coco_weights as load_coco_weights
from ._config import CONFIGS as CONFIGS
from ._config import DetectorConfig as DetectorConfig
from ._config import Seam as Seam
from ._network import DetectorNetwork as DetectorNetwork
from ._network import build_detector as build_detector
from ._stage import DetectorStage as DetectorStage
from ._stage import detections_of as detections_of
from ._stage import load_detector_stage as load_detector_stage
from ._targets import DetectorTargets as DetectorTargets
from ._targets import RegionPredictions as RegionPredictions
from ._window import extended as extended
from ._window import network_picture as network_picture
from ._window import window_directions as window_directions
