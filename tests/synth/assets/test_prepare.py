"""Small archives go through the whole mill; the real cache is checked where there is one."""

import hashlib
import io
import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from panoscene.scene import CATEGORIES
from panoscene.synth.assets import (
    AssetError,
    add_models,
    known_models,
    load_library,
    prepare_assets,
    prepare_shapes,
)
from panoscene.synth.assets import _debian as debian
from panoscene.synth.assets._debian import unpack_libraries
from panoscene.synth.assets._prepare import _in_parallel

CACHE = Path(os.environ.get("PANOSCENE_ASSETS", "no-cache-here"))

CHAIR = """
mtllib chair.mtl
v 0 0 0
v 40 0 0
v 40 0 40
v 0 0 40
v 0 90 0
v 40 90 0
v 40 45 40
v 0 45 40
vt 0 0
vt 1 0
vt 1 1
vt 0 1
o seat
usemtl oak
f 4/1 3/2 7/3 8/4
f 1/1 4/2 8/3 5/4
f 2/1 6/2 7/3 3/4
f 5 8 7 6
f 1 2 3 4
g sweethome3d_window_pane_back
usemtl clear
f 1 5 6 2
"""
MTL = "newmtl oak\nKd 1 1 1\nmap_Kd C:\\me\\oak.png\nnewmtl clear\nKd 0.5 0.5 1\nd 0.3\n"


def png(colour: tuple[int, int, int], size: int = 8) -> bytes:
    stream = io.BytesIO()
    Image.new("RGB", (size, size), colour).save(stream, "PNG")
    return stream.getvalue()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "mine"
    folder.mkdir()
    (folder / "chair.obj").write_text(CHAIR)
    (folder / "chair.mtl").write_text(MTL)
    (folder / "oak.png").write_bytes(png((10, 200, 30)))
    box = trimesh.creation.box((0.4, 0.6, 0.2))
    box.apply_translation((5, 6, 7))
    red = PBRMaterial(name="red", baseColorFactor=[255, 0, 0, 255])
    box.visual = TextureVisuals(material=red)
    content = trimesh.Scene(box).export(file_type="glb")
    assert isinstance(content, bytes)
    (folder / "box.glb").write_bytes(content)
    rows = [
        "file,category,width,depth,height,front_yaw_deg,licence,creator,support_height",
        "chair.obj,chair,0.5,0.4,0.9,0,CC0-1.0,Ann,0.45",
        "box.glb,chest,,,,90,,,",
    ]
    (folder / "models.csv").write_text("\n".join(rows))
    return folder


def test_a_folder_becomes_a_library(folder: Path, tmp_path: Path) -> None:
    told: list[tuple[int, int, str]] = []
    report = prepare_assets(
        tmp_path / "cache", [folder], processes=1, progress=lambda *step: told.append(step)
    )
    assert (report.converted, report.kept, report.failed) == (2, 0, ())
    assert told == [(1, 2, "mine/chair"), (2, 2, "mine/box")]
    library = load_library(tmp_path / "cache")
    assert list(library) == ["mine/box", "mine/chair"]
    assert library.ids("chair") == ("mine/chair",)
    assert library.ids(placement="wall") == ()
    assert library.categories() == ("chair", "chest")
    chair = library["mine/chair"]
    assert chair is library["mine/chair"]
    assert chair.size == pytest.approx((0.5, 0.4, 0.9))
    assert chair.support_height == 0.45
    assert (chair.licence, chair.creator) == ("CC0-1.0", "Ann")
    # the file's front, +z, is low; it has become +y
    top = chair.vertices[chair.vertices[:, 1] > 0.19, 2].max()
    assert top == pytest.approx(0.0, abs=1e-6)
    oak, clear = sorted(chair.materials, key=lambda material: material.name, reverse=True)
    assert oak.texture is not None
    assert oak.texture[0, 0].tolist() == [10, 200, 30]
    assert (clear.kind, clear.opacity) == ("glass", 0.3)
    # the back pane is at the back
    pane = chair.faces[chair.face_material == chair.materials.index(clear)]
    assert (chair.vertices[pane.ravel(), 1] < -0.19).all()
    with pytest.raises(KeyError):
        library["mine/none"]


def test_right_is_not_mirrored(folder: Path, tmp_path: Path) -> None:
    """Seen from the front, the file's +x is on the right, so on the model's own left: -x."""
    text = CHAIR.replace("v 40 90 0", "v 40 120 0")
    (folder / "chair.obj").write_text(text)
    prepare_assets(tmp_path / "cache", [folder], processes=1)
    model = load_library(tmp_path / "cache")["mine/chair"]
    highest = model.vertices[np.argmax(model.vertices[:, 2])]
    assert highest[0] < 0
    assert highest[1] < 0
    corners = model.vertices[model.faces]
    out = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("nx,nx->n", out, corners.mean(axis=1)) > 0).all()


def test_glb_keeps_units_and_turns(folder: Path, tmp_path: Path) -> None:
    prepare_assets(tmp_path / "cache", [folder], processes=1)
    box = load_library(tmp_path / "cache")["mine/box"]
    # y up: 0.4 wide, 0.2 deep, 0.6 high, then turned by a quarter
    assert box.size == pytest.approx((0.2, 0.4, 0.6))
    assert box.materials[0].name == "red"
    assert box.materials[0].colour == pytest.approx((1, 0, 0))
    assert np.abs(box.vertices.mean(axis=0)).max() < 1e-6


def test_again_only_what_changed(folder: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    prepare_assets(cache, [folder], processes=1)
    assert prepare_assets(cache, [folder], processes=1).kept == 2
    victim = cache / load_library(cache).entries["mine/box"].file
    victim.write_bytes(victim.read_bytes()[:100])
    with pytest.raises(AssetError, match="damaged"):
        load_library(cache)["mine/box"]
    report = prepare_assets(cache, [folder], processes=1)
    assert (report.kept, report.converted) == (1, 1)
    next((cache / "textures").iterdir()).unlink()
    assert prepare_assets(cache, [folder], processes=1).converted == 1
    assert load_library(cache)["mine/chair"].materials
    assert not list(cache.rglob("*.part"))


@pytest.mark.slow
def test_same_files_same_bytes_in_another_process(folder: Path, tmp_path: Path) -> None:
    prepare_assets(tmp_path / "one", [folder], processes=1)
    program = "import sys\nfrom panoscene.synth.assets import prepare_assets\n"
    program += "prepare_assets(sys.argv[1], sys.argv[2:], processes=1)"
    # what depends on the order of a set would now be another
    environment = os.environ | {"PYTHONHASHSEED": "1", "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-c", program, str(tmp_path / "two"), str(folder)]
    subprocess.run(command, check=True, env=environment)
    digests = []
    for name in ("one", "two"):
        files = sorted(path for path in (tmp_path / name).rglob("*") if path.is_file())
        digests.append([(p.name, hashlib.sha256(p.read_bytes()).hexdigest()) for p in files])
    assert digests[0] == digests[1]


def test_results_of_several_processes_come_in_order() -> None:
    told: list[tuple[int, int, str]] = []
    results = _in_parallel(abs, [-3, 2, -1], 2, lambda *step: told.append(step), str)
    assert list(results) == [3, 2, 1]
    assert told == [(1, 3, "-3"), (2, 3, "2"), (3, 3, "-1")]


def test_a_library_that_was_replaced_is_read_anew(folder: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    prepare_assets(cache, [folder], processes=1)
    (folder / "stool.obj").write_text(CHAIR)
    with (folder / "models.csv").open("a") as table:
        table.write("\nstool.obj,stool,,,,,,,")
    report = prepare_assets(cache, [folder], processes=1)
    assert report.failed == ()
    assert "mine/stool" in load_library(cache)


def test_two_sources_of_one_name_are_refused(folder: Path, tmp_path: Path) -> None:
    other = tmp_path / "other" / folder.name
    shutil.copytree(folder, other)
    with pytest.raises(AssetError, match="found 2 sources of this name"):
        prepare_assets(tmp_path / "cache", [folder, other], processes=1)
    assert prepare_assets(tmp_path / "cache", [folder, folder], processes=1).converted == 2


@pytest.mark.parametrize("corner", ["0 0 0", "1 0 0"])
def test_models_without_an_area_are_left_out(folder: Path, tmp_path: Path, corner: str) -> None:
    """All in one point, or all on a line."""
    (folder / "chair.obj").write_text(f"v 0 0 0\nv {corner}\nv {corner}\nf 1 2 3\n")
    for size in ("0.5,0.4,0.9", ",,"):
        table = f"file,category,width,depth,height\nchair.obj,chair,{size}\nbox.glb,chest,,,\n"
        (folder / "models.csv").write_text(table)
        report = prepare_assets(tmp_path / "cache", [folder], processes=1)
        assert report.failed[0][0] == "mine/chair"
        assert "no triangle with an area" in report.failed[0][1]
        assert list(load_library(tmp_path / "cache")) == ["mine/box"]


def test_materials_without_a_name_keep_their_colours(folder: Path, tmp_path: Path) -> None:
    scene = trimesh.Scene()
    for k, colour in enumerate(([255, 0, 0, 255], [0, 0, 255, 255])):
        part = trimesh.creation.box((0.2, 0.2, 0.2))
        part.apply_translation((0.5 * k, 0.0, 0.0))
        part.visual = TextureVisuals(material=PBRMaterial(baseColorFactor=colour))
        scene.add_geometry(part)
    content = scene.export(file_type="glb")
    assert isinstance(content, bytes)
    (folder / "box.glb").write_bytes(content)
    prepare_assets(tmp_path / "cache", [folder], processes=1)
    model = load_library(tmp_path / "cache")["mine/box"]
    assert {m.colour for m in model.materials} == {(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)}
    assert np.bincount(model.face_material).tolist() == [12, 12]


def test_one_bad_model_does_not_stop_the_rest(folder: Path, tmp_path: Path) -> None:
    (folder / "box.glb").write_bytes(b"glTF nonsense")
    report = prepare_assets(tmp_path / "cache", [folder], processes=1)
    assert report.converted == 1
    assert report.failed[0][0] == "mine/box"
    assert "binary glTF" in report.failed[0][1]


@pytest.mark.parametrize(
    ("row", "reason"),
    [
        ("chair.obj,sofaa,,,", "one of the 57"),
        ("chair.obj,sofa,1,,", "all three or none"),
        ("chair.obj,sofa,1,x,1", "number that is none"),
        ("chair.obj,sofa,1,-1,1", "all three or none"),
        ("chair.obj,sofa,,,\nchair.obj,sofa,,,", "twice"),
    ],
)
def test_tables_are_checked(folder: Path, tmp_path: Path, row: str, reason: str) -> None:
    (folder / "models.csv").write_text(f"file,category,width,depth,height\n{row}\n")
    with pytest.raises(AssetError, match=reason):
        prepare_assets(tmp_path / "cache", [folder], processes=1)


def library_file(path: Path) -> Path:
    """Write a small BlendSwap-CC-0 library with the one model its table knows as chair 1."""
    spec = next(spec for spec in known_models() if spec.library == "BlendSwap-CC-0.sh3f")
    place = spec.file.rpartition("/")[0]
    catalogue = f"id#1={spec.catalogue_id}\nwidth#1=1\ndepth#1=1\nheight#1=1\n"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("PluginFurnitureCatalog.properties", catalogue)
        archive.writestr(spec.file, CHAIR)
        archive.writestr(f"{place}/chair.mtl", MTL)
        archive.writestr(f"{place}/wood.png", png((200, 10, 30)))
    return path


def test_a_library_file_and_a_debian_package(tmp_path: Path) -> None:
    path = library_file(tmp_path / "BlendSwap-CC-0.sh3f")
    report = prepare_assets(tmp_path / "cache", [path], processes=1)
    known = [spec for spec in known_models() if spec.library == "BlendSwap-CC-0.sh3f"]
    assert report.converted == 1
    assert len(report.failed) == len(known) - 1
    model = load_library(tmp_path / "cache")[known[0].id]
    assert model.size == pytest.approx(known[0].size)
    assert model.licence == "CC0-1.0"
    textures = [m.texture for m in model.materials if m.texture is not None]
    assert textures[0][0, 0].tolist() == [200, 10, 30]

    place = "./usr/share/sweethome3d/furniture"
    inside = {f"{place}/{path.name}": path.read_bytes(), "./etc/passwd": b"harm"}
    package = debian_package(tmp_path / "x.deb", inside | {"./../../escape.sh3f": b"harm"})
    out = tmp_path / "out"
    out.mkdir()
    assert [p.name for p in unpack_libraries(package, out)] == ["BlendSwap-CC-0.sh3f"]
    assert [p.name for p in out.iterdir()] == ["BlendSwap-CC-0.sh3f"]
    for content in (b"no", b"!<arch>\n" + b"x" * 80, b"!<arch>\n"):
        package.write_bytes(content)
        with pytest.raises(AssetError):
            unpack_libraries(package, out)


def test_packages_that_unpack_to_too_much_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = "./usr/share/sweethome3d"
    content = {f"{place}/a.sh3f": bytes(4000), f"{place}/b.sh3f": bytes(4000)}
    package = debian_package(tmp_path / "x.deb", content)
    for limit in ("_TOTAL_LIMIT", "_MEMBER_LIMIT"):
        with monkeypatch.context() as patch:
            patch.setattr(debian, limit, 3000)
            with pytest.raises(AssetError, match=r"unpacks to more than 3000 bytes|too many"):
                unpack_libraries(package, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["x.deb"]
    # by dpkg-deb, where Python cannot unpack
    program = tmp_path / "dpkg-deb"
    program.write_text("#!/bin/sh\nexec head -c 10000 /dev/zero\n")
    program.chmod(0o755)
    strange = debian_package(tmp_path / "x.deb", content, suffix="zst")
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setattr(debian, "_MEMBER_LIMIT", 3000)
    with pytest.raises(AssetError, match="unpacks to more than 3000 bytes"):
        unpack_libraries(strange, tmp_path)


def debian_package(path: Path, files: dict[str, bytes], suffix: str = "xz") -> Path:
    stream = io.BytesIO()
    with tarfile.open(fileobj=stream, mode="w:xz") as data:
        for name, content in files.items():
            member = tarfile.TarInfo(name)
            member.size = len(content)
            data.addfile(member, io.BytesIO(content))
    body = b"!<arch>\n"
    for name, content in (("debian-binary", b"2.0\n"), (f"data.tar.{suffix}", stream.getvalue())):
        head = f"{name:<16}{0:<12}{0:<6}{0:<6}{100644:<8}{len(content):<10}`\n".encode()
        body += head + content + b"\n" * (len(content) % 2)
    path.write_bytes(body)
    return path


def test_sources_that_are_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(AssetError, match="no such file"):
        prepare_assets(tmp_path / "c", [tmp_path / "none.sh3f"])
    (tmp_path / "empty").mkdir()
    with pytest.raises(AssetError, match=r"models\.csv"):
        prepare_assets(tmp_path / "c", [tmp_path / "empty"])
    monkeypatch.setenv("PATH", str(tmp_path / "empty"))
    with pytest.raises(AssetError, match="apt-get"):
        prepare_assets(tmp_path / "c")
    with pytest.raises(AssetError, match="panoscene synth assets"):
        load_library(tmp_path / "c")


def test_models_made_elsewhere_join(folder: Path, tmp_path: Path) -> None:
    cache = tmp_path / "cache"
    prepare_assets(cache, [folder], processes=1)
    old = load_library(cache)["mine/chair"]
    names = [f"parametric/chair/{k}" for k in range(6)]
    many = [replace(old, id=name, base=name) for name in names]
    library = add_models(cache, many)
    assert len(library) == 8
    assert library.split["mine/chair"] == "seen"
    assert Counter(library.split.values())["unseen"] == 1
    found = library["parametric/chair/3"]
    assert np.array_equal(found.vertices, old.vertices)
    for one, other in zip(found.materials, old.materials, strict=True):
        assert (one.texture is None) == (other.texture is None)
        if one.texture is not None and other.texture is not None:
            assert np.array_equal(one.texture, other.texture)
    assert load_library(cache).split == library.split
    (cache / "index.json").write_text('{"format": "panoscene assets", "version": 9}')
    with pytest.raises(AssetError, match="version"):
        load_library(cache)
    assert prepare_assets(cache, [folder], processes=1).kept == 2
    assert len(load_library(cache)) == 2


def test_shapes_of_a_cache(folder: Path, tmp_path: Path) -> None:
    for package in ("skimage", "fast_simplification"):
        pytest.importorskip(package)
    cache = tmp_path / "cache"
    prepare_assets(cache, [folder], processes=1)
    assert prepare_shapes(cache, ["mine/box"], processes=1, samples=200, resolution=24) == ()
    library = load_library(cache)
    assert library.has_shape("mine/box")
    assert not library.has_shape("mine/chair")
    shape = library.shape("mine/box")
    assert shape.scale == pytest.approx(0.6, abs=1e-5)
    assert shape.near.shape == (200, 4)
    with pytest.raises(KeyError):
        library.shape("mine/none")


@pytest.mark.skipif(not (CACHE / "index.json").exists(), reason="no converted libraries here")
def test_the_real_libraries() -> None:
    library = load_library(CACHE)
    specs = known_models()
    assert {spec.id for spec in specs} <= set(library.entries)
    for spec in specs:
        entry = library.entries[spec.id]
        assert entry.size == pytest.approx(spec.size, abs=0.012), spec.id
        assert 0 < entry.faces <= 20_000
        assert entry.category == "" or entry.category in CATEGORIES
        assert entry.licence
        assert entry.creator
    for name in ("sweethome3d/Scopia/80/mirror", "sweethome3d/eTeks/12", "sweethome3d/Scopia/87"):
        model = library[name]
        assert model.vertices.shape == model.normals.shape
        assert np.linalg.norm(model.normals, axis=1) == pytest.approx(1.0, abs=1e-4)
        assert model.faces.max() < len(model.vertices)
        assert model.face_material.max() < len(model.materials)
    kinds = {name: {m.kind for m in library[f"sweethome3d/{name}"].materials} for name in
             ("Scopia/80/mirror", "eTeks/12", "Scopia/87")}  # fmt: skip
    assert "mirror" in kinds["Scopia/80/mirror"]
    assert "glass" in kinds["eTeks/12"]
    assert "light" in kinds["Scopia/87"]
    # a chair's back is behind its seat
    chair = library["sweethome3d/eTeks/5"]
    assert chair.vertices[chair.vertices[:, 2] > 0.4 * chair.size[2], 1].mean() < 0
