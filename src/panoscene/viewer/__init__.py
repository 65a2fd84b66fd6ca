"""The live editor: move boxes in the browser, see the relations follow, repair."""

from panoscene.viewer._editor import Editor as Editor
from panoscene.viewer._editor import EditState as EditState
from panoscene.viewer._measurement import Measurement as Measurement
from panoscene.viewer._measurement import Overlap as Overlap
from panoscene.viewer._measurement import measure_scene as measure_scene
from panoscene.viewer._server import ViewerHandle as ViewerHandle
from panoscene.viewer._server import serve as serve
from panoscene.viewer._server import view_file as view_file
