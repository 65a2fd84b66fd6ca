"""Rooms from above, one or several on a page."""

import os
from collections.abc import Sequence

from panoscene.geometry import polygon_area
from panoscene.scene import Scene
from panoscene.style import BODY, FAINT_INK, MARGIN, TITLE
from panoscene.views._curves import check_finite
from panoscene.views._drawing import (
    dimension_shapes,
    draw_dimensions,
    draw_labels,
    draw_room,
    draw_scale,
)
from panoscene.views._far import Pointer, draw_pointer, place_pointers
from panoscene.views._key import draw_key, key_rows
from panoscene.views._labels import Label, place_names, place_numbers
from panoscene.views._page import Page
from panoscene.views._panels import (
    FOOTER,
    HEADER,
    KEY_WIDTH,
    LARGEST,
    ONE_WIDTH,
    SEVERAL_WIDTH,
    Panel,
    make_panels,
    natural_size,
    number_objects,
)
from panoscene.views._pieces import TOLERANCE


def draw_birds_eye(
    scene: Scene,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    caption: str | None = None,
    reference: Scene | None = None,
    relations: bool = True,
    size_px: tuple[int, int] | None = None,
    tolerance: float = TOLERANCE,
) -> None:
    """Write a PNG of the room from above.

    It shows the floor with its walls and dimensions; the objects as rectangles in the colour of
    their group, with the front marked, dashed where they hang overhead; names where they fit and
    numbers with a key where they do not, an object's number being its place in the scene, from 0
    as in names such as chair_4; arrows at the border with name and distance from the room for
    objects that are far outside; the camera, a scale and the direction of the photo's
    centre. Collisions and parts outside the room, by default from one centimetre, are hatched in
    red; floors and ceilings that are pierced cannot be seen from above.

    Args:
        scene: what to draw.
        path: file to write; it appears complete or not at all.
        title: heading; the scene's name when empty.
        caption: line below the heading; a short description of the room when None.
        reference: a scene whose boxes are outlined in grey, such as the truth.
        relations: whether to draw contacts, white with a dark rim: those of the scene, or those
            that follow from its boxes if it has none.
        size_px: width and height of the picture; by default 1200 pixels wide and as high as the
            room needs, at most 1000.
        tolerance: metres of overlap, or of sticking out of the room, from which they are shown.

    Convention:
        - the view is turned, by at most 45 degrees, so that walls run along the page's edges,
          and by a quarter turn more where that makes the room clearly larger; an arrow shows the
          world's +y

    Raises:
        ValueError: boxes or corners that are not finite, or a page too small to draw on.
    """
    draw_comparison(
        [(title, scene)],
        path,
        captions=None if caption is None else [caption],
        reference=reference,
        relations=relations,
        size_px=size_px,
        tolerance=tolerance,
    )


def draw_comparison(
    scenes: Sequence[tuple[str, Scene]],
    path: str | os.PathLike[str],
    *,
    captions: Sequence[str] | None = None,
    reference: Scene | None = None,
    relations: bool = True,
    size_px: tuple[int, int] | None = None,
    tolerance: float = TOLERANCE,
) -> None:
    """Write a PNG of several rooms from above, side by side at one scale, such as before and after.

    Args:
        scenes: heading and scene of each picture, from left to right; at least one.
        path: file to write; it appears complete or not at all.
        captions: line below each heading; short descriptions of the rooms when None.
        reference: a scene whose boxes are outlined in grey in every picture, such as the truth.
        relations: whether to draw contacts.
        size_px: width and height of the whole picture; by default 1600 pixels wide (1200
            for one scene) and as high as the rooms need, at most 1000.
        tolerance: metres of overlap, or of sticking out of the room, from which they are shown.

    Convention:
        - as in ``draw_birds_eye``; an object has the same number in every picture

    Raises:
        ValueError: no scenes, other than one caption for each, boxes or corners that are not
            finite, or a page too small to draw on.
    """
    _check(scenes, captions, reference)
    if size_px is None:
        width = ONE_WIDTH if len(scenes) == 1 else SEVERAL_WIDTH
        size_px = natural_size([scene for _, scene in scenes], reference, width)
    if min(size_px) < 1 or max(size_px) > LARGEST:
        raise ValueError(f"size_px: found {size_px}, expected numbers from 1 to {LARGEST}")
    page = Page(*size_px)
    panels = make_panels(scenes, reference, relations, size_px, tolerance)
    names = [place_names(panel.near, page.label_size) for panel in panels]
    numbers = number_objects(panels, names)
    pointers = [_place_pointers(page, *parts) for parts in zip(panels, numbers, strict=True)]
    labels = [
        _place_labels(page, *parts) for parts in zip(panels, names, numbers, pointers, strict=True)
    ]
    for k, (panel, (title, scene)) in enumerate(zip(panels, scenes, strict=True)):
        _draw_panel(page, panel, labels[k], pointers[k], reference)
        caption = describe_room(scene) if captions is None else captions[k]
        _write_heading(page, panel, title or scene.name or "Room", caption)
    view = panels[0].view
    draw_scale(page, panels[0].left + MARGIN, MARGIN + 2, view.scale, view.turn)
    plans = [panel.plan for panel in panels]
    with_far = any(panel.far for panel in panels)
    rows = key_rows(plans, numbers, with_reference=reference is not None, with_far=with_far)
    draw_key(page, rows, size_px[0] - KEY_WIDTH, size_px[1] - MARGIN, KEY_WIDTH - MARGIN)
    page.save(path)


def describe_room(scene: Scene) -> str:
    """Return size, height and number of objects of a room in words."""
    area = abs(float(polygon_area(scene.layout.floor_polygon)))
    height = scene.layout.ceiling_height - scene.layout.floor_height
    count = len(scene.objects.boxes)
    things = f"{count} object" + ("" if count == 1 else "s")
    return f"{area:.1f} m², ceiling at {height:.2f} m, {things}"


def _place_pointers(page: Page, panel: Panel, numbers: dict[int, str]) -> list[Pointer]:
    return place_pointers(
        panel.plan,
        panel.far,
        panel.content,
        numbers=numbers,
        scale=panel.view.scale,
        measure=page.label_size,
    )


def _place_labels(
    page: Page,
    panel: Panel,
    names: dict[int, Label],
    numbers: dict[int, str],
    pointers: Sequence[Pointer],
) -> dict[int, Label]:
    """Return the label of every object of a panel; a number wins over a name."""
    kept = {index: label for index, label in names.items() if index not in numbers}
    return kept | place_numbers(
        panel.near,
        kept,
        numbers,
        page.label_size,
        bounds=(panel.left + 2, FOOTER, panel.right - 2, page.height - HEADER),
        reserved=[
            *dimension_shapes(panel.plan, panel.content),
            *(pointer.strip for pointer in pointers),
        ],
    )


def _draw_panel(
    page: Page,
    panel: Panel,
    labels: dict[int, Label],
    pointers: Sequence[Pointer],
    reference: Scene | None,
) -> None:
    left, low, right, high = panel.content
    # what leaves the content leaves space for dimensions and pointers
    page.clip((left - 4.0, low - 4.0, right + 4.0, high + 4.0))
    draw_room(page, panel.plan, reference, panel.view)
    page.clip((panel.left, 0.0, panel.right, float(page.height)))
    draw_dimensions(page, panel.plan, panel.content, panel.view.scale)
    for pointer in pointers:
        draw_pointer(page, pointer)
    draw_labels(page, labels)
    page.clip(None)


def _write_heading(page: Page, panel: Panel, title: str, caption: str) -> None:
    x, top = panel.left + MARGIN, page.height - MARGIN
    width = panel.right - x
    title = page.fitted(title, TITLE, width, bold=True)
    page.text(x, top - 8, title, size=TITLE, bold=True)
    caption = page.fitted(caption, BODY, width)
    page.text(x, top - 34, caption, size=BODY, colour=FAINT_INK)


def _check(
    scenes: Sequence[tuple[str, Scene]],
    captions: Sequence[str] | None,
    reference: Scene | None,
) -> None:
    if not scenes:
        raise ValueError("scenes: found none, expected at least one")
    if captions is not None and len(captions) != len(scenes):
        raise ValueError(f"captions: found {len(captions)}, expected {len(scenes)}")
    for scene in [scene for _, scene in scenes] + ([] if reference is None else [reference]):
        check_finite(scene)
