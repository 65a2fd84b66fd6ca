"""What the paths of light carry with them."""

from dataclasses import dataclass
from typing import Any


@dataclass
class Path:
    """State of the paths between two bounces; a tree that Dr.Jit can walk."""

    ray: Any
    light: Any
    beta: Any
    depth: Any
    passes: Any
    active: Any
    clear: Any
    """All surfaces so far were mirrors or glass, so that what is met is seen sharply."""
    pdf: Any
    room: Any
    """Where the last scattering happened, for the weight of daylight met by chance."""
    guided: Any
    albedo: Any
    normal: Any
    framed: Any
    """A window pane came first: the view through it guides the denoiser, reflected or not."""
    outdoors: Any
    """Ended outside while still clear: the view out of the window is added at the end."""
    chance: Any
    """A plain generator for the decisions that need no even spread."""


@dataclass
class Hit:
    """Where rays meet triangles."""

    t: Any
    prim_uv: Any
    face: Any
    """Among the faces of solids and veils together."""
    valid: Any
