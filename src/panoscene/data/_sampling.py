"""Which samples a training step sees: a pure function of seed and step."""

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.utils.data import Sampler

_SEED_OF_ORDER, _SEED_OF_SAMPLE = 1, 2


class SampleKey(NamedTuple):
    """One sample: which, and the seed of its augmentation."""

    sample: int
    seed: int


def seed_of(*numbers: int) -> int:
    """Return a seed that depends on all numbers, each not negative; below 2^63.

    Examples:
        >>> seed_of(1, 2) == seed_of(1, 2), seed_of(1, 2) == seed_of(2, 1)
        (True, False)
    """
    return int(np.random.SeedSequence(numbers).generate_state(1, np.uint64)[0] >> np.uint64(1))


def sample_keys(count: int, seed: int, first: int, number: int) -> list[SampleKey]:
    """Return the samples number ``first``, ``first + 1``, ... of a training.

    Every sample comes once in each epoch, in an order that is new in each epoch. Nothing but the
    arguments matters, so a training that was stopped goes on with the same samples.

    Args:
        count: How many different samples there are.
        seed: Of the training.
        first: Number of the first one since the start of the training.
        number: How many are wanted.

    Raises:
        ValueError: There are no samples.

    Examples:
        >>> keys = sample_keys(5, 0, 0, 10)
        >>> sorted(key.sample for key in keys[:5]), sorted(key.sample for key in keys[5:])
        ([0, 1, 2, 3, 4], [0, 1, 2, 3, 4])
        >>> sample_keys(5, 0, 7, 3) == keys[7:]
        True
    """
    if count < 1:
        raise ValueError(f"count: found {count}, expected at least one sample to train with")
    keys = []
    for k in range(first, first + number):
        epoch, place = divmod(k, count)
        index = int(_order(count, seed, epoch)[place])
        keys.append(SampleKey(index, seed_of(seed, _SEED_OF_SAMPLE, k)))
    return keys


class StepSampler(Sampler[list[SampleKey]]):
    """The batches of all steps that are left, for one of several devices.

    A step's samples are the same however many devices and parts there are; each device takes an
    equal share of them, and gives it in equal parts.

    Args:
        count: How many different samples there are.
        seed: Of the training.
        batch_size: Samples of a step, over all devices and parts.
        parts: In which a device gives its share of a step.
        start: Steps that are done.
        steps: Steps in all.
        rank: Which device this is.
        devices: How many there are.

    Raises:
        ValueError: The batch cannot be shared equally.
    """

    def __init__(
        self,
        count: int,
        seed: int,
        batch_size: int,
        *,
        parts: int = 1,
        start: int = 0,
        steps: int,
        rank: int = 0,
        devices: int = 1,
    ) -> None:
        if batch_size % (parts * devices):
            raise ValueError(
                f"batch_size: found {batch_size}, expected a multiple of {devices} devices times "
                f"{parts} parts"
            )
        self._count, self._seed, self._batch_size = count, seed, batch_size
        self._parts, self._start, self._steps = parts, start, steps
        self._rank, self._devices = rank, devices

    def __iter__(self) -> Iterator[list[SampleKey]]:
        """Yield the keys of each part of each step."""
        for step in range(self._start, self._steps):
            first = step * self._batch_size
            keys = sample_keys(self._count, self._seed, first, self._batch_size)
            share = keys[self._rank :: self._devices]
            for part in range(self._parts):
                yield share[part :: self._parts]

    def __len__(self) -> int:
        """Return how many parts of steps are left."""
        return max(0, self._steps - self._start) * self._parts


def generator_of(key: SampleKey) -> torch.Generator:
    """Return the generator of a sample's augmentation."""
    return torch.Generator().manual_seed(key.seed)


@lru_cache(maxsize=4)
def _order(count: int, seed: int, epoch: int) -> Tensor:
    generator = torch.Generator().manual_seed(seed_of(seed, _SEED_OF_ORDER, epoch))
    return torch.randperm(count, generator=generator)
