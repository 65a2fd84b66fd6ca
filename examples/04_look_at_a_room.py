"""Look at a room: pictures from every side, and models for other programs.

Usage: python examples/04_look_at_a_room.py [FOLDER]
"""

import sys
from pathlib import Path

from panoscene.exports import write_floor_plan_dxf, write_floor_plan_svg, write_glb
from panoscene.sample import sample_room_path
from panoscene.scene import read_scene
from panoscene.views import (
    SheetRow,
    default_view,
    draw_overlay,
    draw_sheet,
    render_panorama,
    render_view,
    write_image,
    write_report,
)

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
folder.mkdir(parents=True, exist_ok=True)
scene = read_scene(sample_room_path())

# The sample room has no photo. What its camera would see of the boxes takes its place; read your
# own with read_panorama.
photo = render_panorama(scene, height=256)
draw_overlay(scene, folder / "overlay.png", image=photo, width_px=1024)

# A free camera: default_view finds a place from which most objects are seen.
view = render_view(scene, default_view(scene, size_px=(480, 360)), size_px=(480, 360))
write_image(view, folder / "view.png")

# Everything side by side, and a page to look around in.
draw_sheet([SheetRow("Sample room", scene, image=photo, view=view)], folder / "sheet.png")
write_report(folder / "report.html", scene, image=photo, image_caption="Rendered from the boxes.")

# The room for other programs: Blender and engines, CAD, paper.
write_glb(scene, folder / "room.glb", image=photo)
write_floor_plan_dxf(scene, folder / "plan.dxf")
write_floor_plan_svg(scene, folder / "plan.svg")

for name in ("overlay.png", "view.png", "sheet.png", "report.html", "room.glb", "plan.svg"):
    print(f"{folder / name}: {(folder / name).stat().st_size // 1000} kB")
