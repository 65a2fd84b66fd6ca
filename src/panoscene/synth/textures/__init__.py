"""Procedural textures: floors, walls, wood, cloth, stone, pictures; seeded and seamless."""

from ._colours import nudge as nudge
from ._colours import palette as palette
from ._colours import shade as shade
from ._colours import wall_colour as wall_colour
from ._records import Texture as Texture
from ._texture import FLOOR_KINDS as FLOOR_KINDS
from ._texture import TEXTURE_KINDS as TEXTURE_KINDS
from ._texture import TILEABLE_KINDS as TILEABLE_KINDS
from ._texture import WALL_KINDS as WALL_KINDS
from ._texture import make_texture as make_texture
