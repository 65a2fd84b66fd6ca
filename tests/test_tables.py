"""The numbers in the documentation are those of the committed measurements."""

import json
import runpy
import sys
from pathlib import Path
from typing import NoReturn

import pytest


def test_tables_are_up_to_date(
    root: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    program = str(root / "benchmarks" / "tables.py")
    monkeypatch.setattr(sys, "argv", [program, "--check"])
    with pytest.raises(SystemExit) as end:
        runpy.run_path(program, run_name="__main__")
    assert end.value.code == 0, capsys.readouterr().out


def test_measurements_are_json(root: Path):
    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"found {constant}, expected null")

    files = sorted((root / "benchmarks").glob("*.json"))
    assert files
    for file in files:
        json.loads(file.read_text(), parse_constant=refuse)
