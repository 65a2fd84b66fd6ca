"""The house rules that no linter knows: size, names, hosts, shapes, bare installs."""

import importlib.metadata
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import jaxtyping
import pytest
import torch

from panoscene.geometry import direction_from_pixel

LINES_PER_FILE = 400
EMPTY_NOUNS = {"utils", "util", "common", "misc", "helpers", "helper", "base"}

# Written in parts, so that this file does not name what it forbids.
REGISTRY_HOSTS = [
    ".".join(parts)
    for parts in [
        ("pypi", "org"),
        ("pypi", "python", "org"),
        ("pythonhosted", "org"),
        ("download", "pytorch", "org"),
        ("conda", "anaconda", "org"),
        ("npmjs", "org"),
        ("npmjs", "com"),
        ("yarnpkg", "com"),
        ("crates", "io"),
        ("proxy", "golang", "org"),
        ("deb", "debian", "org"),
        ("archive", "ubuntu", "com"),
    ]
]
INDEX_OPTIONS = ["-".join(parts) for parts in [("index", "url"), ("find", "links")]]


@pytest.fixture(scope="module")
def sources(root: Path) -> list[Path]:
    """Return the Python files of the package."""
    return sorted((root / "src").rglob("*.py"))


@pytest.fixture(scope="module")
def project_files(root: Path) -> list[Path]:
    """Return every file that is, or is about to be, under version control."""
    listing = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    try:
        result = subprocess.run(listing, cwd=root, capture_output=True, text=True, check=True)
    except (FileNotFoundError, subprocess.CalledProcessError):
        pytest.skip("needs git and a checkout to know which files belong to the project")
    paths = [root / name for name in result.stdout.split("\0") if name]
    return [path for path in paths if path.is_file()]


def test_files_stay_short(sources: list[Path], root: Path) -> None:
    lengths = {str(path.relative_to(root)): len(path.read_text().splitlines()) for path in sources}
    assert lengths
    assert {name: n for name, n in lengths.items() if n > LINES_PER_FILE} == {}


def test_no_module_without_a_noun(sources: list[Path]) -> None:
    names = {path.stem.strip("_") for path in sources} | {path.parent.name for path in sources}
    assert names & EMPTY_NOUNS == set()


def test_annotations_are_evaluated(project_files: list[Path]) -> None:
    postponed = re.compile(r"^from __future__ import .*\bannotations\b", re.MULTILINE)
    python = [path for path in project_files if path.suffix == ".py"]
    assert [path.name for path in python if postponed.search(path.read_text())] == []


def test_no_registry_is_named(project_files: list[Path]) -> None:
    forbidden = [name.lower().encode() for name in REGISTRY_HOSTS + INDEX_OPTIONS]
    found = {
        f"{path.name}: {name.decode()}"
        for path in project_files
        for text in [path.read_bytes().lower()]
        for name in forbidden
        if name in text
    }
    assert found == set()


def test_a_wrong_shape_is_refused() -> None:
    assert direction_from_pixel(torch.zeros(5, 2), 4, 8).shape == (5, 3)
    with pytest.raises(jaxtyping.TypeCheckError):
        direction_from_pixel(torch.zeros(5, 3), 4, 8)


IMPORT_EVERYTHING = """
import importlib, importlib.abc, pkgutil, sys

class Refuse(importlib.abc.MetaPathFinder):
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in sys.argv[1:]:
            raise ModuleNotFoundError(f"No module named {name!r}", name=name)

sys.meta_path.insert(0, Refuse())
import panoscene
names = [module.name for module in pkgutil.walk_packages(panoscene.__path__, "panoscene.")]
for name in names:
    if not name.endswith(".__main__"):
        importlib.import_module(name)
print(len(names))
"""


def development_modules(root: Path) -> set[str]:
    """Return the import names of everything that only dependency groups and extras ask for."""
    project = tomllib.loads((root / "pyproject.toml").read_text())

    def distribution(requirement: str) -> str:
        return re.split(r"[^\w.-]", requirement, maxsplit=1)[0].lower().replace("_", "-")

    runtime = {distribution(line) for line in project["project"]["dependencies"]}
    extras = project["project"]["optional-dependencies"].values()
    groups = [*project["dependency-groups"].values(), *extras]
    wanted = {distribution(line) for group in groups for line in group if isinstance(line, str)}
    return {
        module
        for module, owners in importlib.metadata.packages_distributions().items()
        if (found := {owner.lower().replace("_", "-") for owner in owners}) & wanted
        and not found & runtime
    }


def test_a_bare_install_imports_every_module(root: Path) -> None:
    absent = development_modules(root)
    assert {"hypothesis", "beartype", "playwright", "jsonschema", "py360convert"} <= absent
    assert {"mitsuba", "drjit", "mujoco"} <= absent
    assert {"lightning_fabric", "tensorboard", "pycocotools"} <= absent
    command = [sys.executable, "-W", "error", "-c", IMPORT_EVERYTHING, *sorted(absent)]
    result = subprocess.run(command, check=False, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert int(result.stdout) >= 10


def test_the_package_is_typed_and_licensed(root: Path) -> None:
    assert (root / "src" / "panoscene" / "py.typed").exists()
    assert "Apache License" in (root / "LICENSE").read_text()


def test_versions_agree(root: Path) -> None:
    version = tomllib.loads((root / "pyproject.toml").read_text())["project"]["version"]
    source = (root / "src" / "panoscene" / "__init__.py").read_text()
    assert f'__version__ = "{version}"' in source
    assert f"\nversion: {version}\n" in (root / "CITATION.cff").read_text()


def test_the_changelog_has_an_unreleased_section(root: Path) -> None:
    text = (root / "CHANGELOG.md").read_text()
    section = text.partition("## [Unreleased]")[2].partition("\n## ")[0]
    assert re.search(r"^- ", section, re.MULTILINE), "no entries under ## [Unreleased]"
