"""Hostile archives are refused; harmless ones are read."""

import stat
import zipfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from panoscene.synth.assets import ArchiveLimits, AssetError, FolderFiles, ZipFiles
from panoscene.synth.assets._archives import normalised_name


def write_zip(path: Path, entries: dict[str, bytes]) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    return path


def test_reads_what_is_there(tmp_path: Path) -> None:
    files = ZipFiles(write_zip(tmp_path / "a.sh3f", {"x/Chair.obj": b"v", "b.txt": b"hello"}))
    assert files.read("b.txt") == b"hello"
    assert files.find("X/chair.OBJ") == "x/Chair.obj"
    assert files.find("nothing") is None
    assert set(files.names()) == {"x/Chair.obj", "b.txt"}
    with pytest.raises(AssetError, match="nothing of this name"):
        files.read("nothing")
    files.close()


@pytest.mark.parametrize(
    "name", ["../../etc/passwd", "/etc/passwd", "a/../../b", "..\\..\\b", "C:\\x.obj", "C:/x.obj"]
)
def test_paths_that_lead_out_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(AssetError, match="expected one inside the archive"):
        ZipFiles(write_zip(tmp_path / "slip.sh3f", {"fine.obj": b"", name: b"harm"}))


def test_links_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "link.sh3f"
    link = zipfile.ZipInfo("model.obj")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(link, "/etc/passwd")
    with pytest.raises(AssetError, match="symbolic link"):
        ZipFiles(path)


def test_bombs_are_refused(tmp_path: Path) -> None:
    bomb = write_zip(tmp_path / "bomb.sh3f", {"a.obj": bytes(4 * 2**20)})
    with pytest.raises(AssetError, match="times its size"):
        ZipFiles(bomb)
    with pytest.raises(AssetError, match=r"a\.obj: unpacks to 4194304 bytes"):
        ZipFiles(bomb, ArchiveLimits(entry_bytes=2**20))
    with pytest.raises(AssetError, match=r"bomb\.sh3f: unpacks to 4194304 bytes"):
        ZipFiles(bomb, ArchiveLimits(total_bytes=2**20))
    many = write_zip(tmp_path / "many.sh3f", {f"{k}.obj": b"" for k in range(11)})
    with pytest.raises(AssetError, match="found 11 entries, expected at most 10"):
        ZipFiles(many, ArchiveLimits(entries=10))


def test_one_name_twice_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "twice.sh3f"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.obj", "one")
        with pytest.warns(UserWarning, match="Duplicate"):
            archive.writestr("a.obj", "two")
    with pytest.raises(AssetError, match="two entries"):
        ZipFiles(path)


def test_what_is_no_archive_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "no.sh3f"
    path.write_bytes(b"not a zip")
    with pytest.raises(AssetError, match="expected a zip archive"):
        ZipFiles(path)


def test_damaged_entry_is_refused(tmp_path: Path) -> None:
    path = write_zip(tmp_path / "a.sh3f", {"a.obj": bytes(range(256)) * 40})
    content = bytearray(path.read_bytes())
    content[60:80] = bytes(20)
    path.write_bytes(content)
    with pytest.raises(AssetError, match="cannot be read"):
        ZipFiles(path).read("a.obj")


def test_folder_links_that_lead_out_are_refused(tmp_path: Path) -> None:
    (tmp_path / "secret.obj").write_text("secret")
    folder = tmp_path / "models"
    folder.mkdir()
    (folder / "in.obj").write_text("fine")
    (folder / "out.obj").symlink_to(tmp_path / "secret.obj")
    files = FolderFiles(folder)
    assert files.read("in.obj") == b"fine"
    with pytest.raises(AssetError, match="leads out"):
        files.read("out.obj")
    with pytest.raises(AssetError, match="leads out"):
        files.read("../secret.obj")
    with pytest.raises(AssetError, match="at most 2 bytes"):
        FolderFiles(folder, ArchiveLimits(entry_bytes=2)).read("in.obj")
    with pytest.raises(AssetError, match="expected a folder"):
        FolderFiles(tmp_path / "none")


@given(st.lists(st.sampled_from(["..", ".", "a", "b", ""]), max_size=8))
def test_normalised_names_stay_inside(steps: list[str]) -> None:
    name = normalised_name("/".join(steps))
    assert not name.startswith("/")
    assert ".." not in name.split("/")
    assert normalised_name(name) == name


def test_names_that_differ_in_case_only_stay_apart(tmp_path: Path) -> None:
    (tmp_path / "Chair.obj").write_text("one")
    (tmp_path / "chair.obj").write_text("two")
    if len(list(tmp_path.iterdir())) == 1:
        pytest.skip("the file system does not tell them apart")
    files = FolderFiles(tmp_path)
    for name, content in (("Chair.obj", b"one"), ("chair.obj", b"two")):
        assert files.find(name) == name
        assert files.read(name) == content
    assert files.find("CHAIR.OBJ") in {"Chair.obj", "chair.obj"}
