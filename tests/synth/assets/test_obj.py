"""OBJ and MTL files, catalogue and class file, as text."""

import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from panoscene.synth.assets import AssetError, ZipFiles
from panoscene.synth.assets._catalogue import (
    default_materials,
    light_sources,
    parse_properties,
    read_catalogue,
)
from panoscene.synth.assets._materials import (
    find_texture,
    glows,
    material_of,
    parse_mtl,
    part_kind,
)
from panoscene.synth.assets._obj import parse_obj


def write_zip(path: Path, entries: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return path


TEXT = b"""
mtllib a b.mtl
o leg
v 0 0 0
v 1 0 0
v 1 1 0 0.5 0.5 0.5
v 0 1 0
vt 0 0
vt 1 1
vn 0 0 1
usemtl oak  wood
f 1/1/1 2/2/1 3/1/1 4/2/1
g sweethome3d_window_pane
f -4//1 -3//1 \\
  -2//1
f 1 2 3
f 1/1 2/1 4/2
l 1 2
"""


def test_polygons_names_and_missing_indices() -> None:
    polygons = parse_obj(TEXT, "x.obj")
    assert polygons.starts.tolist() == [0, 4, 7, 10, 13]
    assert polygons.corners[:, 0].tolist() == [0, 1, 2, 3, 0, 1, 2, 0, 1, 2, 0, 1, 3]
    assert polygons.corners[4].tolist() == [0, -1, 0]
    assert polygons.corners[7].tolist() == [0, -1, -1]
    assert polygons.corners[10].tolist() == [0, 0, -1]
    assert [polygons.part_names[k] for k in polygons.part] == [
        "leg",
        *["sweethome3d_window_pane"] * 3,
    ]
    assert polygons.material_names[polygons.material[0]] == "oak wood"
    assert polygons.material_files == ("a b.mtl",)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (b"v 0 0 0\n", "0 faces"),
        (b"v 0 0 x\nf 1 1 1\n", "no number"),
        (b"v 0 0 nan\nf 1 1 1\n", "not finite"),
        (b"v 0 0 0\nf 1 1 2\n", "does not exist"),
        (b"v 0 0 0\nf 1 1 -2\n", "does not exist"),
        (b"v 0 0 0\nf 1 1 0\n", "does not exist"),
        (b"v 0 0 0\nf 1 1 a\n", "no index"),
    ],
)
def test_broken_files_are_refused(text: bytes, reason: str) -> None:
    with pytest.raises(AssetError, match=reason):
        parse_obj(text, "x.obj")


def test_mtl_lines_and_nonsense() -> None:
    text = (
        "newmtl a  b\n Kd 0.1 0.2 0.3\nillum 2#x\nNs\nd 0.4\nKs x\nnewmtl c\nTr 0.25\nKd 0.5\nd nan"
    )
    entries = parse_mtl("Kd 9 9 9\n" + text + "\nmap_Kd C:\\Users\\me\\oak board.jpg\n")
    assert entries["a b"].diffuse == (0.1, 0.2, 0.3)
    assert entries["a b"].opacity == 0.4
    assert entries["c"].diffuse == (0.5, 0.5, 0.5)
    assert entries["c"].opacity == 0.75
    assert entries["c"].texture == "C:\\Users\\me\\oak board.jpg"


def test_kinds_of_parts() -> None:
    clear, dull, bright = parse_mtl(
        "newmtl a\nd 0.3\nnewmtl b\nKd 0 0 0\nnewmtl c\nKd 1 1 1"
    ).values()
    assert part_kind("sweethome3d_window_pane_1", "x", dull) == "glass"
    assert part_kind("sweethome3d_window_mirror", "x", dull) == "mirror"
    assert part_kind("door", "x", clear) == "glass"
    assert part_kind("door", "Mirror.001", bright) == "mirror"
    assert part_kind("door", "black_mirror", dull) == "opaque"
    assert part_kind("mirrored", "x", bright) == "opaque"
    assert glows("x", "Lamp_shade")
    assert not glows("lampshade", "Brass")


def test_materials_shine_by_their_exponent() -> None:
    text = "newmtl matt\nKs 0 0 0\nNs 500\nnewmtl gloss\nKs 1 1 1\nNs 500\n"
    matt, gloss, chrome = parse_mtl(text + "newmtl chrome\nKs 1 1 1\nNs 90").items()
    assert material_of(*matt, "opaque", None).roughness == pytest.approx(0.9)
    assert material_of(*gloss, "opaque", None).roughness < 0.2
    assert material_of(*chrome, "opaque", None).metallic == 1.0
    assert material_of(*gloss, "opaque", None).metallic == 0.0
    assert 0 < material_of(*gloss, "glass", None).opacity < 0.5
    assert material_of(*gloss, "light", None).emission == 1.0


def test_textures_are_found_however_they_are_called(tmp_path: Path) -> None:
    names = [
        "m/chair/Oak Board.JPG",
        "m/chair/b.png",
        "m/one/only.png",
        "m/one/a.obj",
        "m/two/a.obj",
    ]
    files = ZipFiles(write_zip(tmp_path / "a.sh3f", dict.fromkeys(names, b"")))
    assert find_texture(files, "m/chair", "oak board.jpg") == "m/chair/Oak Board.JPG"
    assert find_texture(files, "m/chair", "/Users/me/oak board.jpg") == "m/chair/Oak Board.JPG"
    assert find_texture(files, "m/chair", "C:\\me\\oak board.jpg") == "m/chair/Oak Board.JPG"
    assert find_texture(files, "m/chair", "-s 1 1 1 b.png") == "m/chair/b.png"
    assert find_texture(files, "m/two", "../chair/b.png") == "m/chair/b.png"
    assert find_texture(files, "m/chair", "lost.png") is None
    assert find_texture(files, "m/one", "/Users/me/lost.png") == "m/one/only.png"
    assert find_texture(files, "m/two", "a.obj") is None


def test_catalogue_of_a_library(tmp_path: Path) -> None:
    text = "id=Lib\nid#7=Lib#chair\nname#7=Ch\\u00e4ir\nwidth#7=40\n! x\nwidth#9=1"
    files = ZipFiles(
        write_zip(tmp_path / "a.sh3f", {"PluginFurnitureCatalog.properties": text.encode()})
    )
    assert read_catalogue(files) == {
        "Lib#chair": {"id": "Lib#chair", "name": "Chäir", "width": "40"}
    }
    assert default_materials(files) == ""
    with pytest.raises(AssetError, match="expected a furniture library"):
        read_catalogue(ZipFiles(write_zip(tmp_path / "b.sh3f", {"x": b""})))
    assert parse_properties("a\\ b : c\nd") == {"a b": "c", "d": ""}


def test_lights_are_turned_into_the_object_frame() -> None:
    entry = {"width": "40", "depth": "20", "height": "100", "lightSourceX": "10 20",
             "lightSourceY": "20 10", "lightSourceZ": "100 50", "lightSourceDiameter": "6",
             "lightSourceColor": "#ffffff #ff0000"}  # fmt: skip
    left, middle = light_sources(entry, (0.8, 0.2, 1.0))
    # seen from the front, a quarter from the left is on the model's own right: +x
    assert left.position == pytest.approx((0.2, 0.1, 0.5))
    assert middle.position == pytest.approx((0.0, 0.0, 0.0))
    assert left.diameter == pytest.approx(0.06)
    assert middle.colour == pytest.approx((1.0, 0.0, 0.0))
    assert light_sources({}, (1.0, 1.0, 1.0)) == ()


def class_file(*texts: str) -> bytes:
    pool = b""
    for text in texts:
        pool += b"\x01" + struct.pack(">H", len(text)) + text.encode()
    pool += b"\x05" + bytes(8) + b"\x07\x00\x01"  # a long takes two numbers; a class
    return b"\xca\xfe\xba\xbe" + bytes(4) + struct.pack(">H", len(texts) + 4) + pool


def test_default_colours_are_read_from_the_class_file(tmp_path: Path) -> None:
    name = "com/eteks/sweethome3d/j3d/OBJLoader.class"
    table = "newmtl white\nKd 1 1 1\nnewmtl amber\nKd 1 0.75 0\n"
    good = class_file("newmtl", table, "Kd")
    files = ZipFiles(write_zip(tmp_path / "a.jar", {name: good}))
    assert default_materials(files) == table
    for k, bad in enumerate((good[:40], b"x" * 40)):
        with pytest.raises(AssetError, match="class file"):
            default_materials(ZipFiles(write_zip(tmp_path / f"{k}.jar", {name: bad})))


def test_numbers_survive_the_reading() -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(50, 3)) * 10.0 ** rng.integers(-6, 6, (50, 3))
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    polygons = parse_obj(("\n".join(lines) + "\nf 1 2 3").encode(), "x")
    assert np.array_equal(polygons.positions, points)


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (b"v 0 0 0\nf 1 1 99999999999999999999999", "no index"),
        (b"v 0 0 0\nf 1 1 " + b"1" * 1000, "1000 characters"),
        (b"v 0 0 " + b"0" * 1000 + b"\nf 1 1 1", "1000 characters"),
    ],
)
def test_numbers_too_long_for_memory_are_refused(text: bytes, reason: str) -> None:
    with pytest.raises(AssetError, match=reason):
        parse_obj(text, "x.obj")


def test_a_material_library_without_a_name_is_passed_over() -> None:
    polygons = parse_obj(b"mtllib\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3", "x.obj")
    assert polygons.material_files == ()


@pytest.mark.parametrize("change", [{"width": "0"}, {"lightSourceX": "one"}, {"lightSourceY": ""}])
def test_lamps_that_make_no_sense_are_an_asset_error(change: dict[str, str]) -> None:
    entry = {"id": "lamp", "width": "40", "depth": "40", "height": "90", "lightSourceX": "20",
             "lightSourceY": "20", "lightSourceZ": "80", "lightSourceDiameter": "5"}  # fmt: skip
    assert len(light_sources(entry, (0.4, 0.4, 0.9))) == 1
    with pytest.raises(AssetError, match="lamp: its lamps cannot be read"):
        light_sources(entry | change, (0.4, 0.4, 0.9))
