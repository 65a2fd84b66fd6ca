"""The GLB container: a header, a chunk of JSON, a chunk of numbers and pictures."""

import json
import os
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from panoscene.scene import Problem, SceneFormatError

MAX_BYTES = 256 * 1024 * 1024
"""Larger files are refused before they are read."""
MAX_JSON_BYTES = 64 * 1024 * 1024
"""A longer JSON chunk is refused before it is parsed, which takes many times its length."""

MAGIC = b"glTF"
VERSION = 2
_HEADER, _CHUNK = struct.Struct("<4sII"), struct.Struct("<I4s")
_JSON, _BIN = b"JSON", b"BIN\0"


@dataclass(frozen=True, slots=True)
class Container:
    """What a GLB file holds."""

    document: object
    """The glTF document, as ``json.loads`` returns it; not yet checked."""
    binary: bytes
    """The binary chunk, which the document calls buffer 0; empty when there is none."""


def pack_glb(document: dict[str, Any], binary: bytes) -> bytes:
    """Return a glTF document and its buffer as the bytes of a GLB file."""
    text = json.dumps(document, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    chunks = [(_JSON, text.encode(), b" "), (_BIN, binary, b"\0")]
    body = b"".join(
        _CHUNK.pack(len(data) + -len(data) % 4, kind) + data + padding * (-len(data) % 4)
        for kind, data, padding in chunks
        if data
    )
    return _HEADER.pack(MAGIC, VERSION, _HEADER.size + len(body)) + body


def read_container(path: str | os.PathLike[str]) -> Container:
    """Return the two parts of a GLB file.

    Raises:
        SceneFormatError: The file cannot be read, or its header, chunks or JSON are damaged.
    """
    file = os.fspath(path)
    data = _bytes(Path(path), file)
    if data[:4] != MAGIC:
        raise _refusal(file, "byte 0", repr(data[:4]), "'glTF', with which every GLB file begins")
    if len(data) < _HEADER.size:
        raise _refusal(file, "the header", f"{len(data)} bytes", f"{_HEADER.size} (truncated?)")
    _, version, length = _HEADER.unpack_from(data)
    if version != VERSION:
        raise _refusal(file, "the version in the header", str(version), str(VERSION))
    if length != len(data):
        hint = " (the file looks truncated)" if length > len(data) else ""
        expected = f"{len(data)}, the length of the file{hint}"
        raise _refusal(file, "the length in the header", str(length), expected)
    text, binary = _chunks(data, file)
    return Container(parsed_json(_text(text, file), file, "the JSON chunk"), binary)


def _bytes(path: Path, file: str) -> bytes:
    try:
        with path.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except IsADirectoryError:
        raise _refusal(file, "the path", "a directory", "a GLB file") from None
    except FileNotFoundError:
        raise _refusal(file, "the path", "nothing", "an existing GLB file") from None
    except OSError as error:
        found = error.strerror or "an error"
        raise _refusal(file, "the path", found, "a readable file") from None
    if len(data) > MAX_BYTES:
        raise _refusal(file, "the file", f"more than {MAX_BYTES // 2**20} MiB", "at most that")
    return data


def _chunks(data: bytes, file: str) -> tuple[bytes, bytes]:
    """Return the JSON chunk and the binary chunk; chunks of other kinds are skipped."""
    found: list[tuple[bytes, bytes]] = []
    start = _HEADER.size
    while start < len(data):
        field = f"chunk {len(found)}"
        if start + _CHUNK.size > len(data):
            raise _refusal(file, field, f"{len(data) - start} bytes", "a chunk (truncated?)")
        length, kind = _CHUNK.unpack_from(data, start)
        start += _CHUNK.size
        if length > len(data) - start:
            expected = f"at most {len(data) - start}, what is left of the file"
            raise _refusal(file, f"the length of {field}", str(length), expected)
        found.append((kind, data[start : start + length]))
        start += length
    if not found or found[0][0] != _JSON:
        kind = repr(found[0][0]) if found else "nothing"
        raise _refusal(file, "the kind of chunk 0", kind, "'JSON'")
    if len(found[0][1]) > MAX_JSON_BYTES:
        size = f"more than {MAX_JSON_BYTES // 2**20} MiB"
        raise _refusal(file, "the JSON chunk", size, "at most that")
    binary = found[1][1] if len(found) > 1 and found[1][0] == _BIN else b""
    return found[0][1], binary


def parsed_json(text: str, file: str, field: str) -> object:
    """Return what a JSON text says.

    Raises:
        SceneFormatError: It is not JSON; the error names ``file`` and ``field``.
    """
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        place = f"{text[error.pos : error.pos + 20]!r} at position {error.pos}"
        problem = Problem(field, place, f"JSON: {error.msg}")
    except RecursionError:
        problem = Problem(field, "JSON nested hundreds of levels deep", "an ordinary document")
    except ValueError as error:  # a whole number of thousands of digits
        problem = Problem(field, "a number that is too long", f"JSON: {error}")
    raise SceneFormatError(file, [problem])


def _text(data: bytes, file: str) -> str:
    try:
        return data.decode()
    except UnicodeDecodeError as error:
        place = f"the byte 0x{data[error.start]:02x} at position {error.start}"
        raise _refusal(file, "the JSON chunk", place, "text in UTF-8") from None


def _refusal(file: str, field: str, found: str, expected: str) -> SceneFormatError:
    return SceneFormatError(file, [Problem(field, found, expected)])
