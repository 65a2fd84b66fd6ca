"""The report in a browser: quiet, linked, and usable with mouse, fingers and keys."""

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Locator,
    Page,
    expect,
)

from panoscene.arrange import arrange
from panoscene.geometry import OrientedBoxes, box_corners, lonlat_from_direction
from panoscene.sample import sample_room_path
from panoscene.scene import read_scene
from panoscene.synth import perturb_scene, sample_room
from panoscene.views._report import write_report

FLAGS_SAY = "GPU stall due to ReadPixels"
"""What a flag makes the driver remark; the page never reads pixels."""
PATIENCE = 90_000
"""Milliseconds; busy machines draw 3D slowly without a graphics card."""
COARSE = 0.5
"""Device pixels for each pixel: a quarter of the work for a processor that plays graphics card."""
NO_WEBGL = """
const getContext = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return kind.startsWith("webgl") ? null : getContext.call(this, kind, ...rest);
};
"""
HOSTILE = "</script><img src=x onerror=document.title='broken'>"


def wait_until(page: Page, condition: str) -> None:
    """Wait for a condition on the page.

    Playwright's own wait evaluates a string inside the page, which the page forbids.
    """
    end = time.monotonic() + PATIENCE / 1000
    while not page.evaluate(condition):
        assert time.monotonic() < end, f"never true: {condition}"
        page.evaluate("new Promise(requestAnimationFrame)")


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a report of the repaired sample room, and of an empty room."""
    folder = tmp_path_factory.mktemp("reports")
    truth = read_scene(sample_room_path())
    disturbed = perturb_scene(truth, np.random.default_rng(0))
    result = arrange(disturbed, "default")
    write_report(
        folder / "room.html",
        result.scene,
        before=disturbed,
        certificate=result.certificate,
        timings={"arrange": 0.1},
    )
    rng = np.random.default_rng(0)
    write_report(folder / "empty.html", sample_room(rng, objects=0, corners=4))
    write_report(folder / "full.html", sample_room(rng, objects=64, corners=10))
    odd = sample_room(rng, objects=2, corners=4)
    odd = replace(odd, objects=replace(odd.objects, id=(HOSTILE, "a & b")))
    write_report(folder / "odd.html", odd, title=HOSTILE)
    return folder


Opener = Callable[..., Page]


def open_page(context: BrowserContext, file: Path, complaints: list[str]) -> Page:
    """Return the page, which adds what it complains about or loads to a list."""
    context.set_default_timeout(PATIENCE)
    page = context.new_page()

    def note(message: ConsoleMessage) -> None:
        if FLAGS_SAY not in message.text:
            complaints.append(f"{message.type}: {message.text}")

    page.on("console", note)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: complaints.append(request.url[:99]))
    page.goto(file.as_uri())
    assert complaints == [file.as_uri()]
    complaints.clear()
    page.wait_for_selector("html[data-ready]", state="attached")
    return page


@pytest.fixture(scope="module")
def shared(browser: Browser, files: Path) -> Iterator[tuple[Page, list[str]]]:
    context = browser.new_context(
        viewport={"width": 1280, "height": 720},
        reduced_motion="reduce",
        device_scale_factor=COARSE,
    )
    complaints: list[str] = []
    yield open_page(context, files / "room.html", complaints), complaints
    context.close()


@pytest.fixture
def page(shared: tuple[Page, list[str]]) -> Iterator[Page]:
    """Return the sample room's report with nothing selected; it must stay quiet."""
    page, complaints = shared
    page.keyboard.press("Escape")
    page.evaluate("scrollTo(0, 0)")
    yield page
    assert complaints == []


@pytest.fixture
def open_report(browser: Browser, files: Path) -> Iterator[Opener]:
    """Return what opens further reports; they must stay quiet too."""
    complaints: list[str] = []
    contexts: list[BrowserContext] = []

    def open_it(name: str, *, script: str = "", **options: Any) -> Page:
        options = {"reduced_motion": "reduce", "device_scale_factor": COARSE} | options
        context = browser.new_context(**options)
        contexts.append(context)
        if script:
            context.add_init_script(script)
        return open_page(context, files / name, complaints)

    yield open_it
    for context in contexts:
        context.close()
    assert complaints == []


def row(page: Page, name: str) -> Locator:
    return page.locator(f"#objects tr[data-name={json.dumps(name)}]")


def names_of(page: Page) -> list[str]:
    return page.evaluate("panoscene.report.objects.map(({name}) => name)")


def expect_selected(page: Page, *names: str) -> None:
    """Check that exactly these names are selected, in every view."""
    for view in ("panorama", "model", "plan"):
        expect(page.locator(f"#{view} .stage")).to_have_attribute("data-selected", " ".join(names))
    objects = [name for name in names if name in names_of(page)]
    for marks in (
        "#objects tr[data-selected]",
        "#panorama .object[data-selected]",
        "#plan .piece[data-selected]",
    ):
        expect(page.locator(marks)).to_have_count(len(objects))
        for name in objects:
            expect(page.locator(f"{marks}[data-name={json.dumps(name)}]")).to_have_count(1)
    rims = "panoscene.model.furniture.pieces.filter(p => p.rim.visible).map(p => p.thing.name)"
    assert sorted(page.evaluate(rims)) == sorted(objects)


def test_a_row_selects_in_all_views(page: Page) -> None:
    expect_selected(page)
    name = names_of(page)[4]
    row(page, name).click()
    expect_selected(page, name)
    expect(row(page, name)).to_have_attribute("aria-selected", "true")
    expect(page.locator("#selection")).to_contain_text(name)
    expect(page.locator("#relations .count")).to_contain_text(f"about {name}")
    row(page, name).click()
    expect_selected(page)


def test_the_plan_selects_in_all_views(page: Page) -> None:
    page.locator("#plan .piece[data-name='plant_14'] .area").click()
    expect_selected(page, "plant_14")
    page.locator("#plan .plan-wall[data-name='wall-1']").click()
    expect_selected(page, "wall-1")
    assert page.evaluate("panoscene.model.shell.parts.get('wall-1').material.emissive.b") > 0


@pytest.mark.parametrize("view", ["panorama", "model"])
def test_a_click_in_a_picture_selects_in_all_views(page: Page, view: str) -> None:
    page.locator(f"#{view} .stage").scroll_into_view_if_needed()
    page.get_by_role("button", name="Names").click()
    found = """(view) => {
      const one = panoscene[view], {width, height} = one.stage.getBoundingClientRect();
      return panoscene.report.objects.flatMap(({name}, k) => {
        const at = one.pixelOf(k);
        if (!at || at.x < 9 || at.y < 9 || at.x > width - 9 || at.y > height - 9) return [];
        return one.nameAt(at.x, at.y) === name ? [{name, x: at.x, y: at.y}] : [];
      });
    }"""
    seen = page.evaluate(found, view)
    assert len(seen) >= 2
    for thing in seen[:2]:
        page.locator(f"#{view} .stage").click(position={"x": thing["x"], "y": thing["y"]})
        expect_selected(page, thing["name"])
    page.get_by_role("button", name="Names").click()


def test_a_relation_marks_both_partners(page: Page) -> None:
    wall = page.evaluate("panoscene.report.relations.findIndex(({object}) => object === 'wall-3')")
    subject = page.evaluate(f"panoscene.report.relations[{wall}].subject")
    page.locator(f"#relations tr[data-relation='{wall}']").click()
    expect_selected(page, subject, "wall-3")
    expect(page.locator("#plan .plan-wall[data-selected]")).to_have_count(1)
    assert page.evaluate("panoscene.plan.link.getAttribute('d')").startswith("M")
    expect(page.locator("#relations tr[data-selected]")).to_have_count(1)


def test_relations_are_filtered(page: Page) -> None:
    count = page.locator("#relations tbody tr").count()
    page.locator("#relations .chip", has_text="touches").click()
    assert page.locator("#relations tbody tr").count() < count
    page.locator("#relations .chip", has_text="touches").click()
    assert page.locator("#relations tbody tr").count() == count


def test_keys_do_everything(page: Page) -> None:
    first, second = names_of(page)[:2]
    row(page, first).focus()
    assert page.evaluate("panoscene.store.hovered.names") == [first]
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Enter")
    expect_selected(page, second)
    page.keyboard.press("Escape")
    expect_selected(page)
    page.keyboard.press("Tab")
    assert page.evaluate("document.activeElement.dataset.name") == names_of(page)[2]
    for view, state in (
        ("panorama", "[panoscene.panorama.view.lon, panoscene.panorama.view.fov]"),
        ("model", "panoscene.model.camera.position.toArray()"),
    ):
        page.locator(f"#{view} .stage").focus()
        seen = [page.evaluate(state)]
        for key in ("ArrowLeft", "+", "ArrowRight", "-"):
            page.keyboard.press(key)
            seen.append(page.evaluate(state))
            assert seen[-1] != seen[-2], (view, key)
        assert seen[-1] == pytest.approx(seen[0], abs=1e-6)
        page.keyboard.press("n")
        expect_selected(page, first)
        page.keyboard.press("p")
        expect_selected(page, names_of(page)[-1])
        page.keyboard.press("Escape")


def test_dragging_and_the_wheel(page: Page) -> None:
    reset = page.locator("#panorama").get_by_role("button", name="Reset")
    reset.click()
    page.evaluate("document.activeElement.blur()")
    box = page.locator("#panorama .stage").bounding_box()
    assert box
    page.mouse.move(box["x"] + 200, box["y"] + 150)
    fov = "panoscene.panorama.view.fov"
    start = page.evaluate(f"[panoscene.panorama.view.lon, {fov}]")
    page.mouse.wheel(0, 1)
    page.evaluate("new Promise(requestAnimationFrame)")
    assert page.evaluate(fov) == start[1], "the wheel belongs to the page until the view is used"
    page.mouse.down()
    page.mouse.move(box["x"] + 260, box["y"] + 150, steps=3)
    page.mouse.up()
    assert page.evaluate("panoscene.panorama.view.lon") < start[0]
    expect_selected(page)
    page.mouse.wheel(0, -100)
    wait_until(page, f"{fov} < {start[1]}")
    reset.click()
    assert page.evaluate(f"[panoscene.panorama.view.lon, {fov}]") == pytest.approx(start)


def test_before_and_after(page: Page) -> None:
    size = page.locator("#objects tbody tr").first.locator("td").nth(1)
    after = size.inner_text()
    before_faults = page.evaluate("panoscene.report.faults.before.filter(Boolean).length")
    page.get_by_role("button", name="Before").click()
    expect(size).not_to_have_text(after)
    expect(page.locator("#plan .piece[data-fault]")).to_have_count(before_faults)
    assert before_faults > 3
    expect(page.locator("#plan .ghost")).to_have_count(17)
    page.get_by_role("button", name="Outlines").click()
    expect(page.locator("#plan .ghost")).to_have_count(0)
    assert not page.evaluate("panoscene.model.furniture.ghosts.visible")
    page.get_by_role("button", name="Outlines").click()
    page.get_by_role("button", name="After").click()
    expect(size).to_have_text(after)


def test_walls_fade_and_the_ceiling_is_a_choice(page: Page) -> None:
    opacity = "panoscene.model.shell.walls.map(wall => wall.opacity)"
    walls = page.evaluate(opacity)
    assert min(walls) < 0.1
    assert max(walls) == 1
    page.locator("#model").get_by_role("button", name="Top").click()
    assert min(page.evaluate(opacity)) >= 0
    page.locator("#model").get_by_role("button", name="Reset").click()
    wait_until(page, f"{opacity}.some(value => value < 0.1)")
    ceiling = page.locator("#model").get_by_role("button", name="Ceiling")
    expect(ceiling).to_have_attribute("aria-pressed", "false")
    ceiling.click()
    assert page.evaluate("panoscene.model.shell.ceiling.visible")
    ceiling.click()
    assert not page.evaluate("panoscene.model.shell.ceiling.visible")


def test_lines_lie_where_geometry_says(page: Page) -> None:
    """Corners of boxes, drawn through both lenses, against this package's own projection."""
    boxes = json.loads(page.evaluate("JSON.stringify(panoscene.report.objects.map(o => o.box))"))
    centre, size = (torch.tensor([box[key] for box in boxes]) for key in ("centre", "size"))
    yaw = torch.tensor([box["yaw"] for box in boxes])
    points = box_corners(OrientedBoxes(centre, size, yaw)).flatten(0, 1).double()
    ray = points - torch.tensor([0, 0, page.evaluate("panoscene.report.camera_height")])
    lonlat = lonlat_from_direction(ray / ray.norm(dim=-1, keepdim=True))
    assert page.evaluate("panoscene.panorama.flat.fit(1000, 500)") is None
    flat = page.evaluate("p => p.map(x => panoscene.panorama.flat.pixel(x))", points.tolist())
    u, v = 1000 * (lonlat[:, 0] / (2 * torch.pi) + 0.5), 500 * (0.5 - lonlat[:, 1] / torch.pi)
    assert [pixel["x"] for pixel in flat] == pytest.approx(u.tolist(), abs=0.01)
    assert [pixel["y"] for pixel in flat] == pytest.approx(v.tolist(), abs=0.01)
    seen = page.evaluate(
        """(points) => points.flatMap((point, k) => {
          const at = panoscene.panorama.perspective.pixel(point);
          return at === null ? [] : [[k, panoscene.panorama.perspective.direction(at.x, at.y)]];
        })""",
        points.tolist(),
    )
    assert len(seen) > 20
    for k, direction in seen:
        assert direction == pytest.approx((ray[k] / ray[k].norm()).tolist(), abs=1e-5)


def test_a_phone(open_report: Opener) -> None:
    page = open_report(
        "room.html", viewport={"width": 375, "height": 667}, has_touch=True, is_mobile=True
    )
    assert page.evaluate("document.documentElement.scrollWidth") <= 375
    page.locator("#plan .piece[data-name='bed_7'] .area").tap()
    expect_selected(page, "bed_7")
    stage = page.locator("#panorama .stage")
    stage.scroll_into_view_if_needed()
    box = stage.bounding_box()
    assert box
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    fov = page.evaluate("panoscene.panorama.view.fov")
    touch = page.context.new_cdp_session(page)
    for kind, spread in (("touchStart", 30), ("touchMove", 50), ("touchMove", 70), ("touchEnd", 0)):
        fingers = [{"x": x - spread, "y": y, "id": 0}, {"x": x + spread, "y": y, "id": 1}]
        points = fingers if spread else []
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})
    wait_until(page, f"panoscene.panorama.view.fov < {0.7 * fov}")
    expect_selected(page, "bed_7")


def test_without_webgl_the_rest_works(open_report: Opener) -> None:
    page = open_report("room.html", script=NO_WEBGL, viewport={"width": 1280, "height": 720})
    expect(page.locator(".no-3d")).to_be_visible()
    page.locator("#plan .piece[data-name='bed_7'] .area").click()
    expect(row(page, "bed_7")).to_have_attribute("aria-selected", "true")
    expect(page.locator("#panorama .stage.flat .object[data-selected]")).to_have_count(1)
    assert page.locator("#panorama .object[data-selected] .box-near").get_attribute("d")


def test_rooms_with_nothing_and_with_much(open_report: Opener) -> None:
    page = open_report("empty.html", viewport={"width": 700, "height": 500})
    expect(page.locator("#objects")).to_contain_text("No objects")
    expect(page.locator("#certificate, #timings")).to_have_count(0)
    page.locator("#plan .plan-floor").click()
    expect_selected(page, "floor")
    page = open_report("full.html", script=NO_WEBGL, viewport={"width": 1400, "height": 800})
    expect(page.locator("#objects tbody tr")).to_have_count(64)
    assert page.evaluate("document.documentElement.scrollWidth") <= 1400


def test_names_stay_text(open_report: Opener) -> None:
    page = open_report("odd.html", script=NO_WEBGL)
    expect(page.locator("h1")).to_have_text(HOSTILE)
    expect(page.locator("#objects tbody th").first).to_have_text(HOSTILE)
    page.locator("#objects tbody tr").first.click()
    expect(page.locator("#selection")).to_contain_text(HOSTILE)
    expect(page.locator("img")).to_have_count(1)
    assert page.title() == HOSTILE
