"""The public names, as an inventory: a name that appears or goes is a decision, not an accident.

After such a decision run ``python tests/test_api_surface.py --update``.
"""

import importlib
import json
import sys
from pathlib import Path
from types import ModuleType

PACKAGES = [
    "panoscene",
    "panoscene.geometry",
    "panoscene.scene",
    "panoscene.arrange",
    "panoscene.synth",
    "panoscene.synth.assets",
    "panoscene.synth.textures",
    "panoscene.synth.models",
    "panoscene.synth.homes",
    "panoscene.synth.physics",
    "panoscene.synth.render",
    "panoscene.synth.dataset",
    "panoscene.synth.production",
    "panoscene.models",
    "panoscene.models.detector",
    "panoscene.models.layout",
    "panoscene.models.pose",
    "panoscene.models.shape",
    "panoscene.models.upright",
    "panoscene.data",
    "panoscene.pipeline",
    "panoscene.train",
    "panoscene.eval",
    "panoscene.views",
    "panoscene.sample",
]
INVENTORY = Path(__file__).with_name("api_surface.json")


def public_names(package: str) -> list[str]:
    """Return the names that a package offers, without its submodules."""
    module = importlib.import_module(package)
    return sorted(
        name
        for name, value in vars(module).items()
        if not name.startswith("_") and not isinstance(value, ModuleType)
    )


def surface() -> dict[str, list[str]]:
    """Return the public names of every package."""
    return {package: public_names(package) for package in PACKAGES}


def test_public_names_are_the_agreed_ones() -> None:
    advice = "if this is meant: python tests/test_api_surface.py --update, and a changelog entry"
    assert surface() == json.loads(INVENTORY.read_text()), advice


if __name__ == "__main__":
    if sys.argv[1:] != ["--update"]:
        sys.exit(f"usage: python {sys.argv[0]} --update")
    INVENTORY.write_text(json.dumps(surface(), indent=2) + "\n")
