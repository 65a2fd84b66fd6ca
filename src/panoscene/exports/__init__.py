"""Scenes for other programs: GLB, OBJ, floor plans as SVG and DXF."""

from panoscene.exports._floor_plan import FloorPlan as FloorPlan
from panoscene.exports._floor_plan import Footprint as Footprint
from panoscene.exports._floor_plan import floor_plan as floor_plan
from panoscene.exports._floor_plan_dxf import write_floor_plan_dxf as write_floor_plan_dxf
from panoscene.exports._floor_plan_svg import write_floor_plan_svg as write_floor_plan_svg
from panoscene.exports._glb import write_glb as write_glb
from panoscene.exports._glb_read import read_glb as read_glb
from panoscene.exports._obj import write_obj as write_obj
from panoscene.exports._plan_dimensions import Dimension as Dimension
from panoscene.exports._plan_labels import Label as Label
from panoscene.exports._plan_openings import Leaf as Leaf
from panoscene.exports._plan_openings import Opening as Opening
