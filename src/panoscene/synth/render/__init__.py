"""Photographs of furnished homes, path-traced, with exact labels.

Mitsuba, its denoiser and LLVM are loaded by :class:`Renderer` only.
"""

from ._assemble import scene_from_home as scene_from_home
from ._assemble import world_from_placed as world_from_placed
from ._camera import home_from_camera as home_from_camera
from ._camera import pixel_rays as pixel_rays
from ._camera_places import free_floor as free_floor
from ._camera_places import sample_cameras as sample_cameras
from ._lamps import colour_of_kelvin as colour_of_kelvin
from ._mitsuba import MissingRendererError as MissingRendererError
from ._records import Camera as Camera
from ._records import Finish as Finish
from ._records import LightKind as LightKind
from ._records import LightSetting as LightSetting
from ._records import PartKind as PartKind
from ._records import PlacedModel as PlacedModel
from ._records import RenderedPanorama as RenderedPanorama
from ._records import RenderScene as RenderScene
from ._records import RoomFinish as RoomFinish
from ._records import ShellPart as ShellPart
from ._records import WindowPane as WindowPane
from ._renderer import LitScene as LitScene
from ._renderer import Renderer as Renderer
from ._settings import LIGHT_SHARES as LIGHT_SHARES
from ._settings import sample_light as sample_light
from ._shell import Shell as Shell
from ._shell import build_shell as build_shell
