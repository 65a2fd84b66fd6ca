"""The report is one honest file: whole, loads nothing, cannot be broken by names, not stale."""

import base64
import hashlib
import io
import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
import torch
from PIL import Image

from panoscene.arrange import arrange
from panoscene.geometry import OrientedBoxes
from panoscene.sample import sample_room_path
from panoscene.scene import CATEGORIES, Layout, Mesh, Scene, Shapes, read_scene
from panoscene.synth import perturb_scene, sample_room
from panoscene.views._pieces import View, make_plan
from panoscene.views._report import FOLDER, write_report
from panoscene.views._report_colours import PALETTES
from panoscene.views._report_data import box_faults

VOID = {"meta", "link", "img", "br", "input", "hr"}
HOSTILE = "</script><img src=x onerror=alert(1)>&\u2028\"'"


def room(seed: int, objects: int, corners: int = 4) -> Scene:
    return sample_room(np.random.default_rng(seed), objects=objects, corners=corners)


class Page(HTMLParser):
    """Elements of a page and the text of some of them; unbalanced tags are an error."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, str] = {}
        self.open: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if not self.open:
            return
        key = self.open[-1]
        if key == "script" and self.elements[-1][1].get("type"):
            key = "data"
        self.texts[key] = self.texts.get(key, "") + data

    @property
    def data(self) -> dict:
        """What the page's scripts show."""
        return json.loads(self.texts["data"])

    def named(self, tag: str) -> list[dict[str, str | None]]:
        """Return the attributes of all elements of a kind."""
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(scope="module")
def full_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a report with everything that a report can have."""
    truth = read_scene(sample_room_path())
    disturbed = perturb_scene(truth, np.random.default_rng(0))
    arrangement = arrange(disturbed, "default")
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(
        path,
        arrangement.scene,
        image=torch.rand(3, 64, 128, generator=torch.Generator().manual_seed(0)),
        before=disturbed,
        certificate=arrangement.certificate,
        timings={"read": 0.01, "arrange": 1.25},
        title="Sample room",
        notes=["A <b>note</b>."],
    )
    return path


@pytest.fixture(scope="module")
def page(full_report: Path) -> Page:
    return Page(full_report.read_text(encoding="utf-8"))


def test_the_report_is_one_well_formed_file(full_report: Path, page: Page) -> None:
    assert [file.name for file in full_report.parent.iterdir()] == ["report.html"]
    assert full_report.stat().st_size < 1_000_000
    assert page.named("html") == [{"lang": "en"}]
    assert page.texts["title"] == page.texts["h1"] == "Sample room"
    assert "width=device-width" in str(page.named("meta"))
    ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    labels = {attributes.get("aria-labelledby") for attributes in page.named("section")}
    assert labels <= set(ids)
    assert all(attributes.get("alt") for attributes in page.named("img"))


def test_nothing_is_loaded(page: Page) -> None:
    for tag, attributes in page.elements:
        for name in ("src", "href", "srcset", "action", "poster"):
            assert (attributes.get(name) or "data:").startswith("data:"), (tag, attributes)
    assert not re.search(r"@import|url\((?!#)", page.texts["style"])
    assert "style" not in {name for _, attributes in page.elements for name in attributes}


def test_the_policy_allows_this_script_and_style_alone(page: Page) -> None:
    [policy] = [
        str(meta["content"])
        for meta in page.named("meta")
        if meta.get("http-equiv") == "Content-Security-Policy"
    ]
    assert policy.startswith("default-src 'none';")
    assert not re.search(r"https?:|unsafe|\*", policy)
    for kind in ("script", "style"):
        digest = base64.b64encode(hashlib.sha256(page.texts[kind].encode()).digest()).decode()
        assert f"{kind}-src 'sha256-{digest}'" in policy


def test_the_data_are_the_scene(page: Page) -> None:
    truth = read_scene(sample_room_path())
    data = page.data
    assert [thing["category"] for thing in data["objects"]][:4] == [
        "door", "window", "window", "table",
    ]  # fmt: skip
    assert len(data["objects"]) == len(data["before"]) == len(truth.objects.boxes)
    disturbed = perturb_scene(truth, np.random.default_rng(0))
    for k, thing in enumerate(data["before"]):
        box = thing["box"]
        assert box["centre"] == pytest.approx(disturbed.objects.boxes.centre[k].tolist(), abs=1e-4)
        assert box["yaw"] == pytest.approx(float(disturbed.objects.boxes.yaw[k]), abs=1e-4)
    assert data["timings"] == [["read", 0.01], ["arrange", 1.25]]
    assert data["certificate"]["measures"][1]["before"] == "2"
    assert data["certificate"]["measures"][1]["change"] == "better"
    assert {relation["predicate"] for relation in data["relations"]} <= set(data["predicates"])


def test_faults_are_named(tmp_path: Path) -> None:
    scene = room(3, 2)
    centre = scene.objects.boxes.centre[[0, 0]].clone()
    size = torch.tensor([[1.0, 1.0, 1.0], [1.0, 1.0, 1.0]])
    centre[0] = torch.tensor([0.0, 0.0, 0.5])
    centre[1] = torch.tensor([0.9, 0.0, 0.45])
    square = torch.tensor([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    crowded = replace(
        scene,
        relations=None,
        layout=Layout(square),
        objects=replace(
            scene.objects, boxes=OrientedBoxes(centre, size, torch.zeros(2)), id=("a", "b")
        ),
    )
    write_report(tmp_path / "report.html", crowded)
    first, second = Page((tmp_path / "report.html").read_text()).data["faults"]["after"]
    assert first == "overlaps b by 10 cm"
    assert second == "overlaps a by 10 cm, 5 cm outside the room"
    write_report(tmp_path / "report.html", crowded, tolerance=0.07)
    forgiving = Page((tmp_path / "report.html").read_text()).data["faults"]["after"]
    assert forgiving == [first, "overlaps a by 10 cm"]


@pytest.mark.parametrize("tolerance", [0.01, 0.1])
def test_report_and_plan_agree_on_what_is_outside(tolerance: float) -> None:
    told = 0
    for seed in range(6):
        scene = room(seed, 20, 8)
        boxes, count = scene.objects.boxes, len(scene.objects.boxes)
        aside = torch.from_numpy(np.random.default_rng(seed).normal(0.0, 0.6, (count, 3))).float()
        # heights stay: a plan does not show who is in the floor
        moved = replace(boxes, centre=boxes.centre + aside * torch.tensor([1.0, 1.0, 0.0]))
        scene = replace(scene, objects=replace(scene.objects, boxes=moved))
        assert scene.relations is not None
        # the score says where something belongs, not where it is
        nowhere = replace(scene.relations, inside_room=torch.zeros(count))
        scene = replace(scene, relations=nowhere)
        plan = make_plan(scene, View(0.0, 100.0), relations=False, tolerance=tolerance)
        hatched = {piece.index for piece in plan.pieces if piece.outside.area > 0}
        faults = box_faults(scene, tolerance)
        assert hatched == {k for k, fault in enumerate(faults) if fault and "outside" in fault}
        told += len(hatched)
    assert 20 < told < 100


def test_what_lies_in_a_box_is_no_fault() -> None:
    scene = room(3, 2)
    boxes = scene.objects.boxes
    together = replace(boxes, centre=boxes.centre[[0, 0]])
    places = {name: CATEGORIES.index(name) for name in ("plant", "shelf", "table")}
    for inner, expected in (("plant", 0), ("table", 2)):
        category = torch.tensor([places[inner], places["shelf"]])
        objects = replace(scene.objects, boxes=together, category=category)
        told = box_faults(replace(scene, objects=objects))
        assert sum("overlaps" in (fault or "") for fault in told) == expected


def test_names_cannot_break_out(tmp_path: Path) -> None:
    scene = room(3, 2)
    hostile = replace(scene, objects=replace(scene.objects, id=(HOSTILE, "{{script}}")))
    path = tmp_path / "report.html"
    write_report(path, hostile, title=HOSTILE, notes=[HOSTILE], image_caption=HOSTILE)
    page = Page(path.read_text(encoding="utf-8"))
    assert [thing["name"] for thing in page.data["objects"]] == [HOSTILE, "{{script}}"]
    assert page.texts["title"] == page.texts["h1"] == HOSTILE
    assert len(page.named("script")) == 2
    assert len(page.named("img")) == 1
    assert all("onerror" not in attributes for _, attributes in page.elements)


def test_notes_are_text(full_report: Path) -> None:
    assert '<p class="note">A &lt;b&gt;note&lt;/b&gt;.</p>' in full_report.read_text()


@pytest.mark.parametrize(("objects", "corners"), [(0, 4), (1, 6), (64, 10)])
def test_small_and_large_rooms(tmp_path: Path, objects: int, corners: int) -> None:
    path = tmp_path / "report.html"
    write_report(path, replace(room(1, objects, corners), relations=None))
    page = Page(path.read_text(encoding="utf-8"))
    assert len(page.data["objects"]) == len(page.data["faults"]["after"]) == objects
    assert page.data["before"] is None
    assert page.data["certificate"] is None
    assert "these follow from its boxes" in page.texts["p"]
    assert path.stat().st_size < 2_000_000


def test_shapes_survive(tmp_path: Path) -> None:
    scene = room(2, 2)
    mesh = Mesh(
        torch.tensor([[0.0, 0.0, 0.5], [0.5, 0.0, -0.5], [0.0, 0.5, -0.5]]),
        torch.tensor([[0, 1, 2]]),
    )
    shaped = replace(scene, objects=replace(scene.objects, shapes=Shapes(mesh=(mesh, None))))
    write_report(tmp_path / "report.html", shaped)
    first, second = Page((tmp_path / "report.html").read_text()).data["objects"]
    vertices = np.frombuffer(base64.b64decode(first["shape"]["vertices"]), "<f4").reshape(-1, 3)
    assert vertices.tolist() == mesh.vertices.tolist()
    assert np.frombuffer(base64.b64decode(first["shape"]["faces"]), "<u4").tolist() == [0, 1, 2]
    assert second["shape"] is None


@pytest.mark.parametrize("rows", [60, 1100])
def test_photos_come_along_and_large_ones_are_reduced(tmp_path: Path, rows: int) -> None:
    image = torch.zeros(3, rows, 2 * rows)
    image[0, :, rows:] = 1.0
    if rows == 60:
        source: torch.Tensor | Path = image
    else:
        source = tmp_path / "photo.png"
        pixels = (image.permute(1, 2, 0) * 255).byte().numpy()
        Image.fromarray(pixels).save(source)
    write_report(tmp_path / "report.html", room(1, 1), image=source)
    address = str(Page((tmp_path / "report.html").read_text()).named("img")[0]["src"])
    kind, _, text = address.partition(",")
    assert kind == "data:image/jpeg;base64"
    with Image.open(io.BytesIO(base64.b64decode(text))) as photo:
        assert photo.size == (min(2 * rows, 2048), min(rows, 1024))
        right, left = photo.getpixel((photo.width - 9, 20)), photo.getpixel((9, 20))
    assert isinstance(right, tuple)
    assert isinstance(left, tuple)
    assert (right[0] > 240, left[0] < 15) == (True, True)


def test_bad_input_is_refused_and_leaves_the_old_file(tmp_path: Path) -> None:
    path, scene = tmp_path / "report.html", room(1, 2)
    path.write_text("old")
    broken = scene.objects.boxes.centre.clone()
    broken[0, 0] = torch.nan
    boxes = replace(scene.objects.boxes, centre=broken)
    infinite = replace(scene, objects=replace(scene.objects, boxes=boxes))
    with pytest.raises(ValueError, match="scene: expected finite"):
        write_report(path, infinite)
    with pytest.raises(ValueError, match="before: expected the same 2 objects, found 3"):
        write_report(path, scene, before=room(1, 3))
    with pytest.raises(ValueError, match="timings: expected seconds for 'x'"):
        write_report(path, scene, timings={"x": float("nan")})
    with pytest.raises(ValueError, match="image: found 40 x 40"):
        write_report(path, scene, image=torch.zeros(3, 40, 40))
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["report.html"]


def test_text_is_legible_by_day_and_night() -> None:
    def luminance(colour: str) -> float:
        parts = [int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)]
        linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
        return float(np.dot(linear, [0.2126, 0.7152, 0.0722]))

    pairs = [
        ("ink", "card"), ("ink", "page"), ("faint", "card"), ("faint", "page"), ("faint", "head"),
        ("alarm", "card"), ("ink", "chosen"), ("on_accent", "accent"), ("on_pressed", "pressed"),
    ]  # fmt: skip
    for palette in PALETTES.values():
        for text, ground in pairs:
            low, high = sorted([luminance(palette[text]), luminance(palette[ground])])
            assert (high + 0.05) / (low + 0.05) >= 4.5, (text, ground)


# The bundle that is committed is the one that the sources make. No npm is needed to know.


def test_the_bundle_is_not_stale(root: Path) -> None:
    web = root / "web"
    if not web.is_dir():
        pytest.skip("needs web/, which is not part of installed packages")
    names = [f"src/{path.name}" for path in (web / "src").iterdir()]
    digest = hashlib.sha256()
    for name in sorted([*names, "build.mjs", "package-lock.json", "package.json"]):
        text = (web / name).read_text(encoding="utf-8")
        digest.update(f"{name}\n{text}\n".encode())
    header = (FOLDER / "report.js").read_text(encoding="utf-8")[:200]
    found = re.search(r"sources-sha256: ([0-9a-f]{64})", header)
    assert found, "report.js does not say what it was made from"
    assert found[1] == digest.hexdigest(), 'stale: run "npm ci && npm run build" in web/'


def test_the_bundle_is_small_and_carries_its_licences(page: Page) -> None:
    assert (FOLDER / "report.js").stat().st_size < 650_000
    assert "</script" not in (FOLDER / "report.js").read_text(encoding="utf-8").lower()
    licences = (FOLDER / "LICENCES.txt").read_text(encoding="utf-8")
    assert re.search(
        r"three [\d.]+ \(MIT\)\n\n.*MIT License.*WITHOUT WARRANTY", licences, re.DOTALL
    )
    assert page.texts["pre"].strip() == licences.strip()


def test_the_lock_file_names_no_registry(root: Path) -> None:
    lock = root / "web" / "package-lock.json"
    if not lock.exists():
        pytest.skip("needs web/, which is not part of installed packages")
    packages = json.loads(lock.read_text())["packages"]
    assert "node_modules/three" in packages
    assert all("resolved" not in package for package in packages.values())
    assert "://" not in lock.read_text()
