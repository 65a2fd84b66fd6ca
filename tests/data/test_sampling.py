"""The order of samples: a pure function of seed and step."""

from itertools import chain

import pytest
from hypothesis import given
from hypothesis import strategies as st

from panoscene.data import StepSampler, generator_of, sample_keys


@given(st.integers(1, 20), st.integers(0, 5), st.integers(0, 60))
def test_a_stopped_training_goes_on_with_the_same_samples(
    count: int, seed: int, first: int
) -> None:
    whole = sample_keys(count, seed, 0, 80)
    assert sample_keys(count, seed, first, 80 - first) == whole[first:]
    assert [
        sorted(k.sample for k in whole[i : i + count]) for i in range(0, 80 - count, count)
    ] == [list(range(count)) for _ in range(0, 80 - count, count)]


def test_epochs_and_seeds_differ() -> None:
    keys = sample_keys(50, 0, 0, 100)
    assert [k.sample for k in keys[:50]] != [k.sample for k in keys[50:]]
    assert keys != sample_keys(50, 1, 0, 100)
    assert len({key.seed for key in keys}) == 100


@pytest.mark.parametrize(("devices", "parts"), [(1, 1), (2, 1), (1, 3), (2, 3)])
def test_a_step_has_the_same_samples_on_any_number_of_devices(devices: int, parts: int) -> None:
    def steps(rank: int, devices: int, parts: int) -> list[list]:
        sampler = StepSampler(10, 4, 12, parts=parts, start=2, steps=5, rank=rank, devices=devices)
        batches = list(sampler)
        assert len(batches) == len(sampler) == 3 * parts
        return [list(chain(*batches[k : k + parts])) for k in range(0, len(batches), parts)]

    alone = steps(0, 1, 1)
    shared = [steps(rank, devices, parts) for rank in range(devices)]
    for step, keys in enumerate(alone):
        together = list(chain(*(device[step] for device in shared)))
        assert sorted(together) == sorted(keys)


def test_batches_that_cannot_be_shared() -> None:
    with pytest.raises(ValueError, match="expected a multiple of 2 devices times 3 parts"):
        StepSampler(10, 0, 8, parts=3, steps=1, devices=2)
    with pytest.raises(ValueError, match="count: found 0"):
        sample_keys(0, 0, 0, 1)


def test_a_key_is_a_generator() -> None:
    (key,) = sample_keys(3, 0, 7, 1)
    assert generator_of(key).initial_seed() == key.seed
