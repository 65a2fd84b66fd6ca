"""Total 3D scene understanding from one 360-degree indoor photo."""

__version__ = "0.1.0"
