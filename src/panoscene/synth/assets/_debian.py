"""The Sweet Home 3D libraries, from the Debian packages that carry them."""

import io
import lzma
import os
import shutil
import subprocess
import tarfile
import tempfile
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from ._errors import AssetError

DEBIAN_PACKAGES = ("sweethome3d", "sweethome3d-furniture")
_MEMBER_LIMIT = 512 * 2**20
_TOTAL_LIMIT = 2 * 2**30
"""Bytes of all members of a package, unpacked; the true ones have 150 MB."""


def fetch_libraries(folder: Path) -> tuple[Path, ...]:
    """Return the .jar and .sh3f files of the Debian packages, downloaded into ``folder`` if new.

    Uses ``apt-get download``, which needs no root and installs nothing; the packages are unpacked
    here, without their scripts.

    Args:
        folder: Where the libraries are kept; made if it is not there.

    Raises:
        AssetError: There is no ``apt-get``, or it could not download the packages.
    """
    folder.mkdir(parents=True, exist_ok=True)
    kept = libraries_in(folder)
    if "sweethome3d.jar" in {path.name for path in kept} and len(kept) > 1:
        return kept
    command = shutil.which("apt-get")
    if command is None:
        hint = "no apt-get here; download sweethome3d and sweethome3d-furniture elsewhere"
        raise AssetError(folder, f"{hint} and give their .jar, .sh3f or .deb files")
    with tempfile.TemporaryDirectory(dir=folder) as download:
        call = [command, "download", "-q", *DEBIAN_PACKAGES]
        done = subprocess.run(  # noqa: S603 - fixed command
            call, cwd=download, capture_output=True, text=True, check=False
        )
        packages = sorted(Path(download).glob("*.deb"))
        if done.returncode != 0 or len(packages) < len(DEBIAN_PACKAGES):
            last = (done.stderr.strip() or "no message").splitlines()[-1]
            hint = "run 'apt-get update' or give their files"
            raise AssetError(
                folder, f"apt-get could not download {DEBIAN_PACKAGES}: {last}; {hint}"
            )
        for package in packages:
            unpack_libraries(package, folder)
    return libraries_in(folder)


def libraries_in(folder: Path) -> tuple[Path, ...]:
    """Return the .jar and .sh3f files directly in a folder, by name."""
    found = [path for path in folder.iterdir() if path.suffix.lower() in {".jar", ".sh3f"}]
    return tuple(sorted(found))


def unpack_libraries(package: Path, folder: Path) -> tuple[Path, ...]:
    """Return the furniture libraries of a .deb package, copied into ``folder``.

    Only regular files named ``*.sh3f`` and ``sweethome3d.jar`` below ``usr/share/sweethome3d`` are
    taken, under their last name, so a package cannot write anywhere else.

    Raises:
        AssetError: The file is no Debian package, or holds no library.
    """
    written: list[Path] = []
    total = 0
    try:
        with _data_stream(package) as stream, tarfile.open(fileobj=stream, mode="r|") as data:
            for member in data:
                total += member.size
                if total > _TOTAL_LIMIT:
                    raise AssetError(package, f"unpacks to more than {_TOTAL_LIMIT} bytes")
                path = PurePosixPath(member.name)
                wanted = path.suffix == ".sh3f" or path.name == "sweethome3d.jar"
                if not (wanted and member.isfile() and "sweethome3d" in path.parts[:-1]):
                    continue
                content = data.extractfile(member)
                if not isinstance(content, io.BufferedIOBase) or member.size > _MEMBER_LIMIT:
                    raise AssetError(package, f"{path.name} has {member.size} bytes, too many")
                written.append(_copy(content, folder / path.name))
    except (tarfile.TarError, lzma.LZMAError, EOFError) as error:
        raise AssetError(package, f"expected a Debian package: {error}") from error
    if not written:
        raise AssetError(package, "found no .sh3f or sweethome3d.jar in the package")
    return tuple(written)


def _copy(content: io.BufferedIOBase, target: Path) -> Path:
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        with temporary.open("wb") as stream:
            shutil.copyfileobj(content, stream)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
    return target


def _data_stream(package: Path) -> io.BufferedIOBase:
    """Return the unpacked tar stream in a .deb, which is an ``ar`` archive."""
    for name, content in _ar_members(package):
        if name == "data.tar.xz":
            return lzma.LZMAFile(io.BytesIO(content))
        if name == "data.tar":
            return io.BytesIO(content)
        if name.startswith("data.tar"):
            return io.BytesIO(_unpacked_by_dpkg(package))
    raise AssetError(package, "expected a Debian package with a data.tar member")


def _unpacked_by_dpkg(package: Path) -> bytes:
    command = shutil.which("dpkg-deb")
    if command is None:
        raise AssetError(package, "its compression needs dpkg-deb, which is not here")
    call = [command, "--fsys-tarfile", str(package)]
    with subprocess.Popen(  # noqa: S603 - fixed command
        call, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
    ) as running:
        content = running.stdout.read(_MEMBER_LIMIT + 1) if running.stdout else b""
        if len(content) > _MEMBER_LIMIT:
            running.kill()
            raise AssetError(package, f"unpacks to more than {_MEMBER_LIMIT} bytes")
    if running.returncode != 0:
        raise AssetError(package, "dpkg-deb cannot unpack it")
    return content


def _ar_members(package: Path) -> Iterator[tuple[str, bytes]]:
    content = package.read_bytes()
    if not content.startswith(b"!<arch>\n"):
        raise AssetError(package, "expected a Debian package (an ar archive)")
    at = 8
    while at + 60 <= len(content):
        header = content[at : at + 60]
        size = header[48:58].strip()
        if not size.isdigit() or header[58:60] != b"`\n":
            raise AssetError(package, "damaged member header in the Debian package")
        length = int(size)
        yield header[:16].decode("latin-1").strip().rstrip("/"), content[at + 60 : at + 60 + length]
        at += 60 + length + length % 2
