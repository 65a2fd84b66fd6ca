"""Shapes of objects: a picture to a code, a code to a mesh."""

from ._config import ANALYTIC as ANALYTIC
from ._config import CONFIGS as CONFIGS
from ._config import ISO_LEVEL as ISO_LEVEL
from ._config import ShapeConfig as ShapeConfig
from ._elements import Elements as Elements
from ._elements import analytic_code as analytic_code
from ._elements import blob_centres as blob_centres
from ._elements import elements_from_code as elements_from_code
from ._extract import extract_meshes as extract_meshes
from ._fast_field import FastField as FastField
from ._fast_field import fast_field as fast_field
from ._losses import ShapeTargets as ShapeTargets
from ._losses import ShapeWeights as ShapeWeights
from ._losses import shape_losses as shape_losses
from ._network import ShapeNetwork as ShapeNetwork
from ._network import build_shape as build_shape
from ._network import outside_probability as outside_probability
from ._network import view_hints as view_hints
from ._stage import ShapeStage as ShapeStage
from ._stage import load_shape_stage as load_shape_stage
from ._stage import slab_objects as slab_objects
from ._stage import thin_boxes as thin_boxes
