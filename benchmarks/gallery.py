"""Makes every picture of docs/gallery.md: python benchmarks/gallery.py [FOLDER].

The pictures go into docs/images/gallery without a FOLDER. The last two are photographs of the
report, for which Chromium or Chrome must be installed; without it they stay as they were.
"""

import shutil
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float
from PIL import Image, ImageSequence
from torch import Tensor

from panoscene.arrange import Arrangement, arrange
from panoscene.exports import write_floor_plan_svg
from panoscene.scene import Scene
from panoscene.synth import perturb_scene, sample_room
from panoscene.views import (
    SheetRow,
    default_view,
    describe_violations,
    draw_animation,
    draw_birds_eye,
    draw_comparison,
    draw_overlay,
    draw_sheet,
    render_panorama,
    render_view,
    write_report,
)

GALLERY = Path(__file__).resolve().parent.parent / "docs" / "images" / "gallery"
LARGEST = 250_000
"""Bytes that one committed file may have."""

# chosen by looking: corners, objects, seed
ROOMS = ((4, 14, 1), (6, 18, 4), (8, 22, 8), (10, 26, 12), (12, 30, 13), (12, 30, 15))
ROOM = (8, 22, 56)
DISTURBANCE = 4
SELECTED = "sofa_10"
"""What the pictures of the page have selected."""


@dataclass(frozen=True, slots=True)
class Story:
    """One room, as most pictures show it."""

    truth: Scene
    disturbed: Scene
    repair: Arrangement
    photo: Float[Tensor, "3 height width"]
    """In place of a photo: rendered from the true boxes."""

    @property
    def captions(self) -> tuple[str, str]:
        """Violations before and after in words."""
        certificate = self.repair.certificate
        return describe_violations(certificate.before), describe_violations(certificate.after)


def room(corners: int, objects: int, seed: int) -> Scene:
    """Return a sampled room."""
    return sample_room(np.random.default_rng(seed), objects=objects, corners=corners)


def main() -> int:
    """Make all pictures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else GALLERY
    folder.mkdir(parents=True, exist_ok=True)
    truth = room(*ROOM)
    disturbed = perturb_scene(truth, np.random.default_rng(DISTURBANCE))
    photo = render_panorama(truth, height=1024)
    story = Story(truth, disturbed, arrange(disturbed), photo)
    with tempfile.TemporaryDirectory() as scratch:
        draw_rooms(folder)
        draw_story(story, folder, Path(scratch))
        draw_pages(story, folder, Path(scratch))
    too_large = [path.name for path in folder.iterdir() if path.stat().st_size > LARGEST]
    for path in sorted(folder.iterdir()):
        print(f"{path.stat().st_size / 1000:7.1f} kB  {path.name}")
    print(f"{sum(path.stat().st_size for path in folder.iterdir()) / 1000:7.1f} kB in all")
    if too_large:
        print(f"over {LARGEST / 1000:.0f} kB: {', '.join(too_large)}")
    return int(bool(too_large))


def draw_rooms(folder: Path) -> None:
    """Draw sampled rooms of several shapes, as models."""
    views = [view_of(room(*which), (560, 400)) for which in ROOMS]
    rows = [torch.cat(views[first : first + 3], dim=2) for first in (0, 3)]
    save(torch.cat(rows, dim=1), folder / "rooms.webp")


def draw_story(story: Story, folder: Path, scratch: Path) -> None:
    """Draw one room: the truth, the estimate, the repair."""
    truth, disturbed, repaired = story.truth, story.disturbed, story.repair.scene
    draw_birds_eye(truth, scratch / "a.png", title="Office")
    shrink(scratch / "a.png", folder / "birds-eye.webp", 1200)
    pair = [("Estimated", disturbed), ("Repaired", repaired)]
    draw_comparison(pair, scratch / "a.png", captions=story.captions, reference=truth)
    shrink(scratch / "a.png", folder / "comparison.webp", 1600)
    draw_overlay(repaired, scratch / "a.png", image=story.photo)
    shrink(scratch / "a.png", folder / "overlay.webp", 1600)
    save(story.photo, folder / "render.webp", 1600)
    camera = default_view(truth, size_px=(800, 600))
    sides = [render_view(scene, camera, size_px=(800, 600)) for scene in (disturbed, repaired)]
    save(torch.cat(sides, dim=2), folder / "views.webp")
    names = ("Estimated", "Repaired", "Truth")
    rows = [
        SheetRow(
            name,
            scene,
            image=story.photo,
            rendering=render_panorama(scene, height=384),
            view=render_view(scene, default_view(truth)),
            caption=caption,
        )
        for name, scene, caption in zip(
            names, (disturbed, repaired, truth), (*story.captions, ""), strict=True
        )
    ]
    draw_sheet(rows, scratch / "a.png")
    shrink(scratch / "a.png", folder / "sheet.webp", 1600)
    draw_animation(
        disturbed,
        scratch / "a.webp",
        reference=truth,
        title="Repair",
        frames=20,
        size_px=(720, 400),
    )
    shrink_animation(scratch / "a.webp", folder / "repair.webp")
    write_floor_plan_svg(truth, folder / "plan.svg")


def draw_pages(story: Story, folder: Path, scratch: Path) -> None:
    """Photograph the report in a browser, on a desktop and on a telephone."""
    browser_path = next(
        filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
    )
    if browser_path is None:
        print("no Chromium: the pictures of the pages stay as they were")
        return
    from playwright.sync_api import sync_playwright  # noqa: PLC0415

    page_file = scratch / "report.html"
    write_report(
        page_file,
        story.repair.scene,
        image=story.photo,
        image_caption="In place of a photo: rendered from the true boxes.",
        before=story.disturbed,
        certificate=story.repair.certificate,
        title="Office, estimated and repaired",
    )
    flags = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader"]
    flags += ["--enable-unsafe-swiftshader", "--disable-gpu-compositing"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=browser_path, args=flags)
        for name, width, height, scale, touch in (
            ("report", 1440, 1500, 1.0, False),
            ("report-phone", 390, 844, 1.5, True),
        ):
            page = browser.new_page(
                viewport={"width": width, "height": height},
                device_scale_factor=scale,
                has_touch=touch,
            )
            page.goto(page_file.as_uri())
            page.locator(f"#objects tr[data-name={SELECTED}]").click()
            page.evaluate("window.scrollTo(0, 0)")
            page.wait_for_timeout(4000)
            page.screenshot(path=scratch / "a.png")
            shrink(scratch / "a.png", folder / f"{name}.webp", 1440)
            page.close()
        browser.close()


def view_of(scene: Scene, size_px: tuple[int, int]) -> Float[Tensor, "3 height width"]:
    """Return the room as a model."""
    return render_view(scene, default_view(scene, size_px=size_px), size_px=size_px)


def save(image: Float[Tensor, "3 height width"], file: Path, width: int | None = None) -> None:
    """Write a rendered picture."""
    pixels = (image.clamp(0, 1) * 255).round().to(torch.uint8).permute(1, 2, 0)
    encode(Image.fromarray(pixels.contiguous().numpy()), file, width)


def shrink(picture: Path, file: Path, width: int) -> None:
    """Write a picture again, small enough to be committed."""
    with Image.open(picture) as image:
        encode(image.convert("RGB"), file, width)


def shrink_animation(animation: Path, file: Path) -> None:
    """Write an animation again, as good as fits into a file that may be committed."""
    with Image.open(animation) as moving:
        frames: list[Image.Image] = []
        times: list[int] = []
        for frame in ImageSequence.Iterator(moving):
            frames.append(frame.convert("RGB"))
            times.append(frame.info["duration"])
    first, *rest = frames
    for quality in range(80, 20, -10):
        first.save(
            file,
            quality=quality,
            method=6,
            minimize_size=True,
            save_all=True,
            append_images=rest,
            duration=times,
            loop=0,
        )
        if file.stat().st_size < LARGEST:
            return


def encode(image: Image.Image, file: Path, width: int | None) -> None:
    """Write a picture of at most a width as WebP."""
    if width is not None and image.width > width:
        height = round(image.height * width / image.width)
        image = image.resize((width, height), Image.Resampling.LANCZOS)
    image.save(file, quality=90, method=6)


if __name__ == "__main__":
    sys.exit(main())
