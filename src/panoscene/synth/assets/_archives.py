"""Reading archives and folders that strangers made: nothing outside them, nothing endless."""

import stat
import zipfile
import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Protocol, runtime_checkable

from ._errors import AssetError


@dataclass(frozen=True, slots=True)
class ArchiveLimits:
    """How much an archive may unpack to before it is refused as a decompression bomb."""

    entries: int = 50_000
    entry_bytes: int = 256 * 2**20
    total_bytes: int = 2 * 2**30
    ratio: float = 200.0
    """Unpacked over packed size of an entry; not asked of entries below ``ratio_from_bytes``."""
    ratio_from_bytes: int = 2**20


@runtime_checkable
class ModelFiles(Protocol):
    """Files by name, from an archive or a folder. Names use ``/`` and have no leading one."""

    @property
    def name(self) -> str:
        """What to call it in messages."""
        ...

    def names(self) -> Iterable[str]:
        """Return the names of all files."""
        ...

    def find(self, name: str) -> str | None:
        """Return the true name of a file, whatever the case of its letters, or None."""
        ...

    def read(self, name: str) -> bytes:
        """Return the content of a file."""
        ...


def normalised_name(name: str) -> str:
    """Return a relative name without ``.`` and ``..`` steps; ``..`` stops at the top.

    Examples:
        >>> normalised_name("chairs/../textures/./oak.jpg")
        'textures/oak.jpg'
        >>> normalised_name("../../etc/passwd")
        'etc/passwd'
    """
    steps: list[str] = []
    for step in name.replace("\\", "/").split("/"):
        if step == "..":
            steps = steps[:-1]
        elif step not in {"", "."}:
            steps.append(step)
    return "/".join(steps)


class ZipFiles:
    """The files of a .sh3f, .jar or .zip archive, read in memory and never unpacked to disk.

    Raises:
        AssetError: It is no zip archive, or one that tries to harm: entries with absolute paths or
            ``..``, symbolic links, two entries of one name, or more than ``limits`` allow.
    """

    def __init__(self, path: Path, limits: ArchiveLimits | None = None) -> None:
        self.name = path.name
        self._limits = limits or ArchiveLimits()
        try:
            self._zip = zipfile.ZipFile(path)
        except (zipfile.BadZipFile, OSError, NotImplementedError) as error:
            raise AssetError(path, f"expected a zip archive (.sh3f, .jar): {error}") from error
        entries = self._zip.infolist()
        try:
            _check_entries(path.name, entries, self._limits)
        except AssetError:
            self._zip.close()
            raise
        self._entries = {entry.filename: entry for entry in entries if not entry.is_dir()}
        self._folded = {name.lower(): name for name in self._entries}

    def names(self) -> Iterable[str]:
        """Return the names of all files."""
        return self._entries.keys()

    def find(self, name: str) -> str | None:
        """Return the true name of a file, whatever the case of its letters, or None."""
        return name if name in self._entries else self._folded.get(name.lower())

    def read(self, name: str) -> bytes:
        """Return the content of a file; never more than its entry declares."""
        entry = self._entries.get(name)
        if entry is None:
            raise AssetError(f"{self.name}!{name}", "found nothing of this name in the archive")
        try:
            with self._zip.open(entry) as stream:
                content = stream.read(entry.file_size + 1)
        except (zipfile.BadZipFile, zlib.error, OSError, RuntimeError, EOFError) as error:
            raise AssetError(f"{self.name}!{name}", f"the entry cannot be read: {error}") from error
        if len(content) > entry.file_size:
            raise AssetError(f"{self.name}!{name}", "the entry is longer than the archive says")
        return content

    def close(self) -> None:
        """Close the archive."""
        self._zip.close()


def _check_entries(archive: str, entries: list[zipfile.ZipInfo], limits: ArchiveLimits) -> None:
    if len(entries) > limits.entries:
        reason = f"found {len(entries)} entries, expected at most {limits.entries}"
        raise AssetError(archive, reason)
    total = sum(entry.file_size for entry in entries)
    if total > limits.total_bytes:
        reason = f"unpacks to {total} bytes, expected at most {limits.total_bytes}"
        raise AssetError(archive, reason)
    seen: set[str] = set()
    for entry in entries:
        problem = _entry_problem(entry, limits)
        if entry.filename in seen:
            problem = "two entries have this name"
        seen.add(entry.filename)
        if problem:
            raise AssetError(f"{archive}!{entry.filename}", problem)


def _entry_problem(entry: zipfile.ZipInfo, limits: ArchiveLimits) -> str:
    """Return why an entry is refused, or an empty text."""
    name = entry.filename.replace("\\", "/")
    if name.startswith("/") or (len(name) > 1 and name[1] == ":"):
        return "absolute path, expected one inside the archive"
    if ".." in PurePosixPath(name).parts:
        return "path with '..', expected one inside the archive"
    if stat.S_ISLNK(entry.external_attr >> 16):
        return "symbolic link, expected a file"
    if entry.file_size > limits.entry_bytes:
        return f"unpacks to {entry.file_size} bytes, expected at most {limits.entry_bytes}"
    ratio = entry.file_size / max(entry.compress_size, 1)
    if entry.file_size > limits.ratio_from_bytes and ratio > limits.ratio:
        return f"unpacks to {ratio:.0f} times its size, expected at most {limits.ratio:.0f} times"
    return ""


class FolderFiles:
    """The files below a folder. Links that lead out of it are refused."""

    def __init__(self, folder: Path, limits: ArchiveLimits | None = None) -> None:
        self.name = folder.name
        self._limits = limits or ArchiveLimits()
        self._folder = folder.resolve()
        if not self._folder.is_dir():
            raise AssetError(folder, "expected a folder with models")
        found = sorted(path for path in self._folder.rglob("*") if path.is_file())
        self._names = [path.relative_to(self._folder).as_posix() for path in found]
        self._known = frozenset(self._names)
        self._folded = {name.lower(): name for name in self._names}

    def names(self) -> Iterable[str]:
        """Return the names of all files."""
        return self._names

    def find(self, name: str) -> str | None:
        """Return the true name of a file, whatever the case of its letters, or None."""
        return name if name in self._known else self._folded.get(name.lower())

    def path(self, name: str) -> Path:
        """Return where a file is, once it is known to be inside the folder."""
        path = (self._folder / name).resolve()
        if not path.is_relative_to(self._folder):
            raise AssetError(self._folder / name, "leads out of its folder")
        return path

    def read(self, name: str) -> bytes:
        """Return the content of a file."""
        path = self.path(name)
        if path.stat().st_size > self._limits.entry_bytes:
            raise AssetError(path, f"expected at most {self._limits.entry_bytes} bytes")
        return path.read_bytes()

    def close(self) -> None:
        """Do nothing: a folder is not held open."""
