"""The synth commands, from nothing to a checked and exported set, killed and resumed on the way."""

import contextlib
import io
import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from panoscene.cli import main
from panoscene.cli._synth_glb import write_scene_glb
from panoscene.exports import read_glb
from panoscene.scene import CATEGORIES
from panoscene.synth.dataset import open_dataset, read_index
from panoscene.synth.production import RenderProgress
from panoscene.synth.production import _run as run_module
from panoscene.synth.render import _mitsuba as engine_module

ROOT = Path(__file__).parents[1]
TINY = ROOT / "configs" / "synth" / "tiny.yaml"
PROGRAM = "import sys; from panoscene.cli import main; sys.exit(main())"
CUBE = """\
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
f 4 3 2 1
f 5 6 7 8
f 1 2 6 5
f 3 4 8 7
f 2 3 7 6
f 1 5 8 4
"""


def run(*arguments: object) -> tuple[int, str, str]:
    """Run a command in this process; gives exit code, stdout and stderr."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main([str(argument) for argument in arguments])
    return code, out.getvalue(), err.getvalue()


@dataclass(frozen=True)
class Chain:
    """What the commands left behind and said."""

    cache: Path
    data: Path
    """Killed after the first panorama, then resumed."""
    again: Path
    """Made in one go."""
    assets: dict[str, Any]
    after_kill: list[str]
    resumed: tuple[int, str, str]


def kill_after_first(command: list[object], panoramas: Path) -> None:
    """Start a program and kill it, as a power cut would, once the first panorama is there."""
    with subprocess.Popen(
        [sys.executable, "-c", PROGRAM, *map(str, command)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as process:
        end = time.monotonic() + 300
        while not list(panoramas.glob("home*/labels.json")):
            assert process.poll() is None, "ended before there was a panorama"
            assert time.monotonic() < end
            time.sleep(0.02)
        os.kill(process.pid, signal.SIGKILL)


@pytest.fixture(scope="module")
def chain(tmp_path_factory: pytest.TempPathFactory) -> Chain:
    for package in ("mitsuba", "mitsuba_oidn", "mujoco"):
        pytest.importorskip(package)
    folder = tmp_path_factory.mktemp("synth")
    mine, cache = folder / "mine", folder / "cache"
    mine.mkdir()
    (mine / "stool.obj").write_text(CUBE)
    (mine / "models.csv").write_text(
        "file,category,width,depth,height,licence,creator\n"
        "stool.obj,stool,0.4,0.4,0.45,CC0-1.0,A. Maker\n"
    )
    code, out, _ = run(
        "synth", "assets", mine, "--cache", cache, "--designs", 1, "--processes", 1, "--json"
    )
    assert code == 0
    data, again = folder / "data", folder / "again"

    def render(target: Path) -> list[object]:
        return ["synth", "render", TINY, target, "--cache", cache, "--processes", 1]

    kill_after_first(render(data), data / "panoramas")
    there = sorted(path.name for path in (data / "panoramas").glob("home*"))
    partial = data / "panoramas" / ".part-home0000-1-0000"
    partial.mkdir()
    (partial / "rgb.jpg").write_bytes(b"half")
    resumed = run(*render(data))
    assert run(*render(again))[0] == 0
    return Chain(cache, data, again, json.loads(out), there, resumed)


def test_assets_tell_what_is_in_the_cache(chain: Chain) -> None:
    rows = chain.assets["categories"]
    assert list(rows) == [*CATEGORIES, ""]
    assert rows["stool"] == {"models": 2, "bases": 2, "unseen": 0}
    assert rows["mirror"]["models"] == 1
    assert chain.assets["failed"] == []
    assert "A. Maker" in (chain.cache / "ATTRIBUTION").read_text()


def test_assets_run_again_do_nothing(chain: Chain) -> None:
    code, out, err = run(
        "synth", "assets", chain.cache.parent / "mine", "--cache", chain.cache, "--designs", 1
    )
    assert code == 0
    assert "0 models converted, 1 were there, 0 designs made" in err
    assert "stool" in out
    assert str(chain.cache / "ATTRIBUTION") in out.replace("\n", "")


def test_a_killed_set_goes_on_and_is_the_same(chain: Chain) -> None:
    assert chain.after_kill == ["home0000-0"]
    code, _, err = chain.resumed
    assert code == 0
    assert "2 of 2 panoramas, 1 of them new" in err
    assert not list((chain.data / "panoramas").glob(".part-*"))
    first, second = read_index(chain.data), read_index(chain.again)
    assert [p.label_hash for p in first.panoramas] == [p.label_hash for p in second.panoramas]
    assert first.set_hash == second.set_hash != ""
    before = {p.name: p.labels_sha256 for p in first.panoramas}
    assert before.keys() == {"home0000-0", "home0000-1"}


def test_every_panorama_has_its_scene_as_glb(chain: Chain) -> None:
    faces = []
    for item in open_dataset(chain.data):
        model, scene = read_glb(item.folder / "scene.glb"), item.scene()
        assert model.objects.id == scene.objects.id
        assert model.panorama.file == "rgb.jpg"
        faces += [len(mesh.faces) for mesh in model.objects.shapes.mesh if mesh]
        assert (item.folder / "scene.glb").stat().st_size < 3e6
    assert 12 < max(faces) <= 4000


def test_no_glb_writes_none(chain: Chain, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked: dict[str, Any] = {}

    def fake(*arguments: Any, **options: Any) -> RenderProgress:
        asked.update(options)
        return RenderProgress(0, 2, 1.0, 0, (("home0000", "no room for 2 cameras"),))

    monkeypatch.setattr("panoscene.cli._synth_make.render_dataset", fake)
    code, _, err = run(
        "synth", "render", TINY, tmp_path / "out", "--cache", chain.cache, "--no-glb", "--limit", 1
    )
    assert code == 1
    assert asked["extra"] is None
    assert asked["limit"] == 1
    assert "error: home0000: no room for 2 cameras" in err


def test_interrupted_rendering_says_how_to_go_on(
    chain: Chain, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def fake(*arguments: Any, told: Callable[[RenderProgress], None], **options: Any) -> None:
        told(RenderProgress(1, 2, 60.0, 1))
        os.kill(os.getpid(), signal.SIGINT)
        time.sleep(5)

    monkeypatch.setattr("panoscene.cli._synth_make.render_dataset", fake)
    before = signal.getsignal(signal.SIGINT)
    code, _, err = run("synth", "render", TINY, tmp_path / "out", "--cache", chain.cache)
    assert code == 130
    assert f"stopped; the same command goes on with {tmp_path / 'out'}" in err
    assert signal.getsignal(signal.SIGINT) is before


def test_ray_gets_the_address(
    chain: Chain, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    addresses = []

    def fake(*arguments: Any, address: str | None, **options: Any) -> RenderProgress:
        addresses.append(address)
        return RenderProgress(2, 2, 1.0, 2)

    monkeypatch.setattr("panoscene.cli._synth_make.render_with_ray", fake)
    start = ["synth", "render", TINY, tmp_path / "out", "--cache", chain.cache]
    assert run(*start, "--ray")[0] == 0
    assert run(*start, "--ray", "ray://head:10001")[0] == 0
    assert addresses == [None, "ray://head:10001"]


def test_stats(chain: Chain) -> None:
    code, out, _ = run("synth", "stats", chain.data, "--json")
    found = json.loads(out)
    assert code == 0
    assert found["panoramas"] == 2
    assert found["homes"] == 1
    assert set(found["categories"]) == set(CATEGORIES)
    assert found["visible_objects_mean"] > 0
    assert sum(found["corner_counts"].values()) == 2
    code, out, _ = run("synth", "stats", chain.data)
    assert code == 0
    assert "2 of 2 panoramas in 1 homes" in out


def test_check(chain: Chain) -> None:
    code, out, _ = run("synth", "check", chain.data, "--cache", chain.cache, "--json")
    found = json.loads(out)
    assert found["panoramas"] == 2
    # two samples a pixel and 128 columns are too few for clean pictures
    labels = {key: found[key] for key in ("files", "hashes", "distance", "masks", "relations")}
    assert labels == dict.fromkeys(labels, 0), found["problems"]
    assert code == (1 if found["failures"] else 0)


def test_check_finds_a_changed_file(chain: Chain) -> None:
    file = chain.again / "panoramas" / "home0000-1" / "distance.png"
    content = file.read_bytes()
    try:
        with Image.open(file) as picture:
            Image.fromarray(np.asarray(picture) // 2).save(file)
        code, out, _ = run("synth", "check", chain.again)
    finally:
        file.write_bytes(content)
    assert code == 1
    assert "home0000-1: hashes: " in out
    assert "failures" in out


def test_export(chain: Chain, tmp_path: Path) -> None:
    for form, name in (
        ("coco", "instances_train.json"),
        ("horizonnet", "train/label_cor/home0000-1.txt"),
        ("crops", "crops_train.jsonl"),
    ):
        code, _, err = run("synth", "export", chain.data, form, tmp_path / form)
        assert code == 0, err
        assert (tmp_path / form / name).stat().st_size > 0


@pytest.mark.parametrize("form", ["coco", "horizonnet", "crops"])
def test_damaged_pictures_are_not_exported(chain: Chain, tmp_path: Path, form: str) -> None:
    file = chain.again / "panoramas" / "home0000-1" / "rgb.jpg"
    content = file.read_bytes()
    try:
        file.write_bytes(content[: len(content) // 2])
        code, _, err = run("synth", "export", chain.again, form, tmp_path / form)
    finally:
        file.write_bytes(content)
    assert code == 2
    assert err == f"error: {file}: expected the file that was written, found another\n"
    assert not (tmp_path / form).exists()


def test_preview(chain: Chain, tmp_path: Path) -> None:
    code, _, err = run("synth", "preview", chain.data, "-o", tmp_path)
    assert code == 0, err
    assert "panoscene-synth-tiny" in (tmp_path / "README.md").read_text()
    assert (tmp_path / "rgb-000.jpg").is_file()
    assert (tmp_path / "objects-000.jpg").is_file()
    assert list(tmp_path.glob("category-*.jpg"))


def test_bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "index.json").touch()

    def quick(
        cache: Path, *, repeats: int, extra: object, progress: Callable[[str], None]
    ) -> dict[str, object]:
        assert cache == tmp_path
        assert extra is write_scene_glb
        progress("rendering")
        seconds = {"panorama_s": 3.5 * repeats, "panorama_cpu_s": 12.0}
        return {**seconds, "peak_gib": [1.5, 1.75], "processes": 2}

    monkeypatch.setattr("panoscene.cli._measure_synth.run_synth_benchmark", quick)
    command = ["bench", "synth", "--cache", tmp_path, "--repeats", 2]
    code, out, err = run(*command, "--json")
    assert (code, err) == (0, "rendering\n")
    found = json.loads(out)
    assert found["panorama_s"] == 7.0
    assert found["machine"]["cores"] > 0
    code, out, _ = run(*command)
    assert code == 0
    assert "| seconds a panorama, 2 processes | 7.00 | 8 |" in out
    assert "1.75" in out
    code, _, err = run("bench", "synth", "--repeats", 0)
    assert (code, err) == (2, "error: --repeats: found 0, expected 1 or more\n")


def test_another_recipe_is_refused(chain: Chain, tmp_path: Path) -> None:
    other = tmp_path / "other.yaml"
    other.write_text(TINY.read_text().replace("seed: 16", "seed: 17"))
    code, _, err = run("synth", "render", other, chain.data, "--cache", chain.cache)
    assert code == 2
    assert err.count("\n") == 1
    assert "another recipe" in err


def test_rendering_without_models_names_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "mine"))
    code, _, err = run("synth", "render", TINY, tmp_path / "out")
    assert code == 2
    expected = "found no furniture models there; get them with: panoscene synth assets\n"
    assert err == f"error: {tmp_path / 'mine' / 'panoscene' / 'assets'}: {expected}"
    code, _, err = run("synth", "render", TINY, tmp_path / "out", "--cache", tmp_path / "models")
    assert code == 2
    assert err.endswith(f"panoscene synth assets --cache {tmp_path / 'models'}\n")


def test_missing_packages_are_named(
    chain: Chain, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    command = ["synth", "render", TINY, tmp_path / "out", "--cache", chain.cache, "--processes", 1]
    run_module._renderer.cache_clear()
    with monkeypatch.context() as patch:
        patch.setitem(sys.modules, "mitsuba", None)
        code, _, err = run(*command)
    assert code == 2
    assert err == "error: rendering needs mitsuba: pip install 'panoscene[synth]'\n"
    with monkeypatch.context() as patch:
        patch.delitem(sys.modules, "drjit", raising=False)
        patch.delenv("DRJIT_LIBLLVM_PATH", raising=False)
        patch.setattr(engine_module, "_LLVM", ())
        patch.setattr(sys, "platform", "linux")
        code, _, err = run(*command)
    assert code == 2
    assert "apt-get install libllvm19" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["assets", "nowhere.sh3f"], "nowhere.sh3f: no such file or folder"),
        (["assets", "--designs", "-1"], "expected at least 0 and 1"),
        (["render", "nowhere.yaml", "out"], "nowhere.yaml: expected a recipe"),
        (["render", str(TINY), "out", "--limit", "0"], "expected at least 1"),
        (["stats", "nowhere"], "expected a dataset.json of a rendered set"),
        (["preview", "nowhere", "-o", "out"], "expected a dataset.json of a rendered set"),
        (["check", "nowhere"], "expected a dataset.json of a rendered set"),
        (["export", "nowhere", "coco", "out"], "expected a dataset.json of a rendered set"),
    ],
)
def test_wrong_input_is_one_line(
    arguments: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "caches"))
    code, out, err = run("synth", *arguments)
    assert (code, out) == (2, "")
    assert words in err
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()
