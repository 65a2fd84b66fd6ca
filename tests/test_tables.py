"""The numbers in the documentation are those of the committed measurements."""

import importlib
import json
import re
import runpy
import sys
from pathlib import Path
from typing import Any, NoReturn

import pytest
import torch

from panoscene.eval import read_scores


def test_tables_are_up_to_date(
    root: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    program = str(root / "benchmarks" / "tables.py")
    monkeypatch.setattr(sys, "argv", [program, "--check"])
    # where Python looks first when the program is run by itself
    monkeypatch.syspath_prepend(root / "benchmarks")
    with pytest.raises(SystemExit) as end:
        runpy.run_path(program, run_name="__main__")
    assert end.value.code == 0, capsys.readouterr().out


@pytest.mark.parametrize("stage", ["detector", "layout", "pose", "shape", "context"])
def test_networks_are_as_large_as_the_pages_say(root: Path, stage: str):
    row = re.compile(r"\| parameters \| ([\d.]+) million \| ([\d.]+) million \|")
    (told,) = row.findall((root / "docs" / f"{stage}.md").read_text())
    module: Any = importlib.import_module(f"panoscene.models.{stage}")
    for edition, text in zip(("paper", "compact"), told, strict=True):
        with torch.device("meta"):
            network = getattr(module, f"build_{stage}")(module.CONFIGS[edition])
        millions = sum(parameter.numel() for parameter in network.parameters()) / 1e6
        assert text == f"{millions:.{len(text.partition('.')[2])}f}"


def test_measurements_are_json(root: Path):
    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"found {constant}, expected null")

    files = sorted((root / "benchmarks").glob("*.json"))
    assert files
    for file in files:
        json.loads(file.read_text(), parse_constant=refuse)


def test_the_second_test_says_what_the_pages_say(root: Path):
    """README.md and docs/context.md tell in words what these numbers are."""
    full = read_scores(root / "results" / "more" / "full.json")
    rule, before = full.differences["pose"], full.differences["without-arrangement"]
    for ending in ("f1", "f1_end_to_end"):
        for kind in ("all", "touching", "on_floor"):
            assert (rule[f"relations.{kind}_{ending}"].low or 0) > 0, (kind, ending)
        for kind in ("touching_wall", "under_ceiling", "inside_room"):
            assert (rule[f"relations.{kind}_{ending}"].value or 0) > 0, (kind, ending)
    assert (rule["relations.inside_room_f1"].low or 0) > 0
    assert (before["plausibility.paper_colliding_pairs"].high or 0) < 0
    for percent in (15, 25, 50):
        for classes in (11, 57):
            for definition in ("", "released_"):
                name = f"detection.{definition}ap_{percent}_mean_{classes}"
                assert (before[name].value or 0) > 0, name
    for percent in (25, 50):
        assert (before[f"detection.ap_{percent}_mean_57"].low or 0) > 0
