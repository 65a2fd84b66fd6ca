"""The machine's review: lint, format, types, import direction, dependencies, documentation."""

import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

CHECKS = {
    "ruff check": ["ruff", "check", "."],
    "ruff format": ["ruff", "format", "--check", "."],
    "types": ["ty", "check", "--python", sys.executable, "--error-on-warning"],
    "import direction": ["lint-imports"],
    "dependencies": ["deptry", "src"],
    "pre-commit configuration": ["pre-commit", "validate-config"],
}


def run_tool(command: list[str], folder: Path) -> None:
    """Run a tool of this environment and show what it says if it is not content."""
    tool = Path(sys.executable).parent / command[0]
    result = subprocess.run(
        [tool, *command[1:]], check=False, cwd=folder, capture_output=True, text=True
    )
    assert result.returncode == 0, f"{' '.join(command)}\n{result.stdout}{result.stderr}"


@pytest.mark.parametrize("check", CHECKS)
def test_check_passes(check: str, root: Path) -> None:
    run_tool(CHECKS[check], root)


@pytest.mark.slow
def test_documentation_builds_without_warnings(root: Path, tmp_path: Path) -> None:
    run_tool(["mkdocs", "build", "--strict", "--site-dir", str(tmp_path)], root)
    inventory = json.loads((root / "tests" / "api_surface.json").read_text())
    for package, names in inventory.items():
        if package == "panoscene":
            continue
        page = (tmp_path / "api" / package.removeprefix("panoscene.") / "index.html").read_text()
        assert [name for name in names if f'id="{package}.{name}"' not in page] == []
        assert not re.search(r'(src|<link[^>]* href)="(https?:)?//', page), "loads from other hosts"


def test_layers_name_every_package(root: Path) -> None:
    contract = tomllib.loads((root / "pyproject.toml").read_text())["tool"]["importlinter"]
    layers = "|".join(contract["contracts"][0]["layers"]).split("|")
    named = {layer.strip().removeprefix("panoscene.") for layer in layers}
    package = root / "src" / "panoscene"
    modules = {path.stem for path in package.glob("*.py") if not path.stem.startswith("_")}
    packages = {path.parent.name for path in package.glob("*/__init__.py")}
    assert modules | packages == named
