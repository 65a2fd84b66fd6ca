"""Scenes for other programs: GLB, OBJ, floor plans as SVG and DXF."""
