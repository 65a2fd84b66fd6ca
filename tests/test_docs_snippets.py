"""README and docs/: every ```python block runs, and every panoscene command in ```bash blocks.

The blocks of one page run in order, in one empty folder that holds the sample scene as
``room.json`` and the folder ``samples``; Python blocks share their variables. A block that only
shows something is marked ```text or ```console and does not run.
"""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from panoscene.cli import main
from panoscene.sample import sample_room_path

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```(python|bash)[^\n]*\n(.*?)^```\s*$", re.MULTILINE | re.DOTALL)


def blocks(page: Path) -> Iterator[tuple[str, str, int]]:
    """Yield language, code and the line it starts on, for each block of a page."""
    text = page.read_text()
    for match in BLOCK.finditer(text):
        yield match.group(1), match.group(2), text.count("\n", 0, match.start(2))


def commands(code: str) -> list[str]:
    """Return the panoscene commands of a shell block, continued lines joined."""
    lines = code.replace("\\\n", " ").splitlines()
    return [line for line in lines if line.startswith("panoscene ")]


def runs(page: Path) -> bool:
    """Return whether a page has anything to run."""
    return any(language == "python" or commands(code) for language, code, _ in blocks(page))


PAGES = [
    str(page.relative_to(ROOT))
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    if runs(page)
]


def run_command(line: str) -> None:
    """Run one line with this environment's panoscene, in this process if it needs no shell."""
    if not re.search(r"[|<>&;$*`\"']", line):
        assert main(line.split()[1:]) == 0, f"$ {line}"
        return
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    result = subprocess.run(
        ["bash", "-e", "-o", "pipefail", "-c", line],
        env={**os.environ, "PATH": path},
        check=False,
        capture_output=True,
        text=True,
    )
    assert result.returncode == 0, f"$ {line}\n{result.stdout}{result.stderr}"


@pytest.mark.parametrize("page", PAGES)
def test_page_runs(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(sample_room_path(), tmp_path / "room.json")
    (tmp_path / "samples").symlink_to(ROOT / "samples")
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "__docs__"}
    for language, code, line in blocks(ROOT / page):
        if language == "python":
            # blank lines in front, so that a traceback shows the line of the page
            exec(compile("\n" * line + code, ROOT / page, "exec"), names)  # noqa: S102
        else:
            for command in commands(code):
                run_command(command)
