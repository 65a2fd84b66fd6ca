"""Pictures of scenes: from above, on the panorama, rendered, side by side, moving, in a page."""

from panoscene.views._animation import draw_animation as draw_animation
from panoscene.views._birds_eye import describe_room as describe_room
from panoscene.views._birds_eye import draw_birds_eye as draw_birds_eye
from panoscene.views._birds_eye import draw_comparison as draw_comparison
from panoscene.views._cameras import FreeCamera as FreeCamera
from panoscene.views._curves import Curve as Curve
from panoscene.views._curves import overlay_curves as overlay_curves
from panoscene.views._default_view import default_view as default_view
from panoscene.views._demo import DEMO_NOISE as DEMO_NOISE
from panoscene.views._demo import DemoResult as DemoResult
from panoscene.views._demo import describe_violations as describe_violations
from panoscene.views._demo import run_demo as run_demo
from panoscene.views._image_files import write_image as write_image
from panoscene.views._overlay import draw_overlay as draw_overlay
from panoscene.views._rays import RayHits as RayHits
from panoscene.views._rays import cast_rays as cast_rays
from panoscene.views._render import render_panorama as render_panorama
from panoscene.views._render import render_view as render_view
from panoscene.views._report import write_report as write_report
from panoscene.views._sheet import draw_sheet as draw_sheet
from panoscene.views._sheet_grid import SheetRow as SheetRow
