"""The demonstration: disturb the sample room, repair it, and show both."""

import json
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float
from torch import Tensor

from panoscene.arrange import Certificate, Violations, arrange
from panoscene.geometry import paired_box_iou
from panoscene.sample import sample_room_path
from panoscene.scene import Scene, read_scene, write_atomically, write_scene
from panoscene.synth import PerturbNoise, perturb_scene
from panoscene.views._birds_eye import draw_birds_eye, draw_comparison
from panoscene.views._default_view import default_view
from panoscene.views._render import render_panorama, render_view
from panoscene.views._report import write_report
from panoscene.views._sheet import draw_sheet
from panoscene.views._sheet_grid import SheetRow

DEMO_NOISE = PerturbNoise()
"""Errors of the size that networks make: 0.02 rad in direction, 8 % in distance, 10 % in each
size, 12 degrees in yaw, and one object in 50 turned by a quarter."""

_PHOTO_HEIGHT = 768


@dataclass(frozen=True, slots=True)
class DemoResult:
    """Files that the demonstration left, and what they show."""

    before: Path
    """Scene with errors."""
    after: Path
    """Scene after the repair."""
    certificate: Path
    """What the repair is worth, as JSON."""
    before_picture: Path
    after_picture: Path
    comparison: Path
    """Both pictures side by side."""
    sheet: Path
    """Before, after and truth: from above, on the panorama, rendered."""
    report: Path
    """The repaired room as a page to look around in; open it in a browser."""
    objects: int
    seed: int
    mean_iou_before: float
    """Mean over the objects of the 3D intersection over union with the true box."""
    mean_iou_after: float
    colliding_pairs_before: int
    """Pairs of objects that overlap by more than 0.1 m."""
    colliding_pairs_after: int
    worst_penetration_before: float
    """Metres."""
    worst_penetration_after: float
    out_of_room_volume_before: float
    """Cubic metres of all boxes outside the room."""
    out_of_room_volume_after: float

    def as_dict(self) -> dict[str, object]:
        """Return the fields as plain values, for JSON."""
        return {
            key: str(value) if isinstance(value, Path) else value
            for key, value in asdict(self).items()
        }


def run_demo(output: Path, seed: int = 0) -> DemoResult:
    """Return what became of the sample room after disturbing and repairing it, with pictures.

    The true boxes of the room get errors (``DEMO_NOISE``), its true relations are kept, as if a
    network had recognised them; the preset ``default`` repairs it. The folder gets
    ``before.json``, ``after.json``, ``certificate.json``, ``before.png``, ``after.png``,
    ``comparison.png``, ``sheet.png`` and ``report.html``; the pictures outline the true boxes in
    grey. The room has no photo: its place takes a picture rendered from the true boxes.

    Args:
        output: folder for the files; it is made if it does not exist.
        seed: of the errors.

    Raises:
        OSError: the folder or a file in it cannot be written.
    """
    truth = read_scene(sample_room_path())
    disturbed = perturb_scene(truth, np.random.default_rng(seed), DEMO_NOISE)
    start = time.perf_counter()
    arrangement = arrange(disturbed, "default")
    seconds = time.perf_counter() - start
    certificate, repaired = arrangement.certificate, arrangement.scene
    result = _result(output, seed, truth, (disturbed, repaired), certificate)
    output.mkdir(parents=True, exist_ok=True)
    write_scene(disturbed, result.before)
    write_scene(repaired, result.after)
    text = json.dumps(certificate.as_dict(), indent=2) + "\n"
    write_atomically(result.certificate, text)
    before, after = describe_violations(certificate.before), describe_violations(certificate.after)
    draw_birds_eye(
        disturbed, result.before_picture, title="Before", caption=before, reference=truth
    )
    draw_birds_eye(repaired, result.after_picture, title="After", caption=after, reference=truth)
    draw_comparison(
        [("Before", disturbed), ("After", repaired)],
        result.comparison,
        captions=[before, after],
        reference=truth,
    )
    photo = render_panorama(truth, height=_PHOTO_HEIGHT)
    _draw_sheet(result.sheet, photo, truth, (disturbed, repaired), (before, after))
    write_report(
        result.report,
        repaired,
        image=photo,
        image_caption="In place of a photo: rendered from the true boxes.",
        before=disturbed,
        certificate=certificate,
        timings={"arrangement": seconds},
        title="Sample room, disturbed and repaired",
    )
    return result


def _draw_sheet(
    path: Path,
    photo: Float[Tensor, "3 height width"],
    truth: Scene,
    scenes: tuple[Scene, Scene],
    captions: tuple[str, str],
) -> None:
    named = zip(("Disturbed", "Repaired"), scenes, captions, strict=True)
    rows = [
        SheetRow(
            name,
            scene,
            image=photo,
            rendering=render_panorama(scene, height=_PHOTO_HEIGHT // 2),
            view=render_view(scene, default_view(truth)),
            caption=caption,
        )
        for name, scene, caption in (*named, ("Truth", truth, ""))
    ]
    draw_sheet(rows, path)


def describe_violations(violations: Violations) -> str:
    """Return collisions and what is outside the room in words, for captions.

    Examples:
        >>> from panoscene.arrange import Violations
        >>> describe_violations(Violations(0.0, {}, 2, 0.123, 0.2, 0.05, 0.314))
        '2 pairs collide · worst overlap 12 cm · 0.31 m³ outside the room'
        >>> describe_violations(Violations(0.0, {}, 0, 0.08, 0.2, 0.05, 0.314))
        'no pair collides by 10 cm · worst overlap 8 cm · 0.31 m³ outside the room'
    """
    count = violations.colliding_pairs
    depth = 100.0 * violations.worst_penetration
    # who reads of an overlap beside it must know from where on the paper counts one
    none = "no pair collides" if depth < 0.05 else "no pair collides by 10 cm"
    pairs = {0: none, 1: "1 pair collides"}.get(count, f"{count} pairs collide")
    worst = f"{depth:.0f} cm" if depth >= 1.0 else f"{10.0 * depth:.0f} mm"
    overlap = "no overlap" if depth < 0.05 else f"worst overlap {worst}"
    volume = violations.out_of_room_volume
    amount = f"{volume:.2f} m³" if volume >= 0.01 else f"{1000.0 * volume:.0f} l"
    outside = "nothing" if volume < 0.0005 else amount
    return f"{pairs} · {overlap} · {outside} outside the room"


def _result(
    output: Path,
    seed: int,
    truth: Scene,
    scenes: tuple[Scene, Scene],
    certificate: Certificate,
) -> DemoResult:
    iou = [
        float(paired_box_iou(scene.objects.boxes, truth.objects.boxes).mean()) for scene in scenes
    ]
    before, after = certificate.before, certificate.after
    return DemoResult(
        before=output / "before.json",
        after=output / "after.json",
        certificate=output / "certificate.json",
        before_picture=output / "before.png",
        after_picture=output / "after.png",
        comparison=output / "comparison.png",
        sheet=output / "sheet.png",
        report=output / "report.html",
        objects=len(truth.objects.boxes),
        seed=seed,
        mean_iou_before=iou[0],
        mean_iou_after=iou[1],
        colliding_pairs_before=before.colliding_pairs,
        colliding_pairs_after=after.colliding_pairs,
        worst_penetration_before=before.worst_penetration,
        worst_penetration_after=after.worst_penetration,
        out_of_room_volume_before=before.out_of_room_volume,
        out_of_room_volume_after=after.out_of_room_volume,
    )
