"""What a data set will be: homes, splits, cameras and their seeds, all fixed beforehand."""

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, ValidationError, model_validator

from ._errors import DatasetError
from ._format import SPLITS, Format, Split

_SEED_OF_HOME, _SEED_OF_CAMERA = 1, 2


class HomesOfSplits(Format):
    """How many homes each part has."""

    train: Annotated[int, Field(ge=0)] = 200
    val: Annotated[int, Field(ge=0)] = 20
    test_seen: Annotated[int, Field(ge=0, alias="test-seen")] = 40
    test_unseen: Annotated[int, Field(ge=0, alias="test-unseen")] = 40
    """Furnished with base models that no training home has."""

    def count(self, split: Split) -> int:
        """Return the number of homes of a part."""
        return {
            "train": self.train, "val": self.val, "test-seen": self.test_seen,
            "test-unseen": self.test_unseen,
        }[split]  # fmt: skip


class Recipe(Format):
    """A data set to be rendered; a file in configs/synth."""

    name: str = "panoscene-synth"
    seed: Annotated[int, Field(ge=0)] = 0
    homes: HomesOfSplits = HomesOfSplits.model_validate({})
    cameras: Annotated[int, Field(ge=1, le=100)] = 5
    """In each home."""
    width: Annotated[int, Field(ge=64, le=8192, multiple_of=2)] = 1024
    """Columns of a panorama; it has half as many rows."""
    samples: Annotated[int, Field(ge=1)] = 8
    """Light paths through each pixel; half as many near the poles."""
    depth: Annotated[int, Field(ge=1)] = 6
    """Surfaces that a path meets at most."""
    furniture_texture: Literal[64, 128, 256, 512, 1024, 2048, 4096] = 256
    """Edge of the textures of furniture in pixels; larger ones are sharper, and take more time and
    memory. Labels do not depend on it."""
    varied_cameras: Annotated[float, Field(ge=0.0, le=1.0)] = 0.5
    """Share of the training homes with camera heights of 1.2 to 1.9 m and tilts up to 5 degrees;
    all others have 1.6 m and none."""
    jpeg_quality: Annotated[int, Field(ge=50, le=100)] | None = 92
    """None writes PNG."""
    normals: bool = False
    albedo: bool = False

    @model_validator(mode="after")
    def _has_homes(self) -> "Recipe":
        if sum(self.homes.count(split) for split in SPLITS) == 0:
            raise ValueError("homes: found none, expected at least 1 in one of the splits")
        return self


class CameraJob(Format):
    """One panorama to be rendered."""

    name: str
    seed: int
    """Of the camera's place and direction, and of the noise."""


class HomeJob(Format):
    """One home and the panoramas that are taken in it."""

    home: str
    index: int
    """Place in the order of rendering."""
    seed: int
    split: Split
    varied: bool
    """Whether its cameras vary in height and tilt."""
    cameras: tuple[CameraJob, ...]


def read_recipe(path: Path | str) -> Recipe:
    """Return the recipe in a YAML file.

    Raises:
        DatasetError: The file cannot be read or is not a recipe; the message names every field.
    """
    import yaml  # noqa: PLC0415

    file = Path(path)
    try:
        document: Any = yaml.safe_load(file.read_text(encoding="utf-8"))
        return Recipe.model_validate({} if document is None else document)
    except OSError as error:
        raise DatasetError(file, f"expected a recipe, found: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise DatasetError(file, f"expected YAML, found: {' '.join(str(error).split())}") from None
    except ValidationError as error:
        raise DatasetError(file, problems_of(error)) from None


def problems_of(error: ValidationError) -> str:
    """Return what pydantic found, on one line."""
    return "; ".join(
        f"{'.'.join(map(str, problem['loc'])) or 'the file'}: {problem['msg']}"
        for problem in error.errors()[:10]
    )


def plan_homes(recipe: Recipe) -> tuple[HomeJob, ...]:
    """Return all homes of a recipe in the order in which they are rendered.

    Every beginning of the order has the splits in about their final proportions, so that a set
    that was stopped early is a small version of the whole. Seeds depend on the recipe's seed and
    the number of home and camera only: more homes or cameras leave those that are there alone, as
    long as the proportions stay.

    Examples:
        >>> jobs = plan_homes(Recipe())
        >>> len(jobs), sum(len(job.cameras) for job in jobs), jobs[0].cameras[0].name
        (300, 1500, 'home0000-0')
        >>> [sum(job.split == split for job in jobs[:30]) for split in SPLITS]
        [20, 2, 4, 4]
    """
    counts = {split: recipe.homes.count(split) for split in SPLITS}
    total = sum(counts.values())
    taken = dict.fromkeys(SPLITS, 0)
    jobs = []
    for index in range(total):
        split = max(SPLITS, key=lambda s: counts[s] * (index + 1) - taken[s] * total)
        # every other training home has varied cameras, when half of them shall
        share = recipe.varied_cameras if split == "train" else 0.0
        varied = int((taken[split] + 1) * share) > int(taken[split] * share)
        taken[split] += 1
        home = f"home{index:04d}"
        cameras = tuple(
            CameraJob(name=f"{home}-{k}", seed=_seed(recipe.seed, _SEED_OF_CAMERA, index, k))
            for k in range(recipe.cameras)
        )
        seed = _seed(recipe.seed, _SEED_OF_HOME, index)
        jobs.append(
            HomeJob(home=home, index=index, seed=seed, split=split, varied=varied, cameras=cameras)
        )
    return tuple(jobs)


def panoramas_to_homes(jobs: tuple[HomeJob, ...], limit: int | None) -> tuple[HomeJob, ...]:
    """Return the first jobs that make at most ``limit`` panoramas; the last home may be cut.

    Examples:
        >>> jobs = panoramas_to_homes(plan_homes(Recipe()), 7)
        >>> [len(job.cameras) for job in jobs]
        [5, 2]
    """
    if limit is None:
        return jobs
    kept, left = [], limit
    for job in jobs:
        if left <= 0:
            break
        kept.append(job.model_copy(update={"cameras": job.cameras[:left]}))
        left -= len(job.cameras)
    return tuple(kept)


def _seed(*numbers: int) -> int:
    return int(np.random.SeedSequence(numbers).generate_state(1, np.uint32)[0])
