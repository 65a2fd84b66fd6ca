"""The numbers in the documentation are those of the committed measurements."""

import json
import subprocess
import sys
from pathlib import Path
from typing import NoReturn


def test_tables_are_up_to_date(root: Path):
    command = [sys.executable, "benchmarks/tables.py", "--check"]
    done = subprocess.run(command, cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_measurements_are_json(root: Path):
    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"found {constant}, expected null")

    files = sorted((root / "benchmarks").glob("*.json"))
    assert files
    for file in files:
        json.loads(file.read_text(), parse_constant=refuse)
