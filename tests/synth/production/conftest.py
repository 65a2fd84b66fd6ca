"""Sets made without a renderer: copies of a sample under the names of their panoramas."""

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from panoscene.synth.assets import add_models
from panoscene.synth.dataset import Recipe
from panoscene.synth.models import make_model
from panoscene.synth.production import RenderTask

SAMPLES = Path(__file__).parents[3] / "samples" / "synth" / "panoramas"


@pytest.fixture
def recipe() -> Recipe:
    """Four homes with two panoramas each."""
    homes = {"train": 2, "val": 1, "test-seen": 1, "test-unseen": 0}
    return Recipe.model_validate({"name": "fake", "homes": homes, "cameras": 2, "width": 64})


@pytest.fixture
def cache(tmp_path: Path) -> Path:
    """A cache with one model."""
    folder = tmp_path / "cache"
    add_models(folder, [make_model("basket", 0, 0)])
    return folder


@pytest.fixture
def copy_sample() -> Callable[[RenderTask], None]:
    """Stand in for rendering a home; may travel to other processes."""
    sample = min(SAMPLES.iterdir())

    def copy(task: RenderTask) -> None:
        if (task.root / "broken" / task.job.home).exists():
            raise ValueError(f"{task.job.home}: found no room for 2 cameras")
        for camera in task.job.cameras:
            part = task.root / "panoramas" / f".part-{camera.name}"
            part.mkdir(parents=True)
            for file in ("rgb.jpg", "scene.json"):
                shutil.copy(sample / file, part / file)
            labels = json.loads((sample / "labels.json").read_text())
            labels |= {"name": camera.name, "home": task.job.home}
            (part / "labels.json").write_text(json.dumps(labels))
            part.rename(task.root / "panoramas" / camera.name)

    return copy
