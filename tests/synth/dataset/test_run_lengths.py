"""COCO's run lengths: round trips, and strings that pycocotools 2.0.11 gave."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from panoscene.synth.dataset import decode_mask, encode_mask


@given(arrays.arrays(bool, st.tuples(st.integers(1, 40), st.integers(1, 40))))
def test_round_trip(mask):
    coded = encode_mask(mask)
    assert coded["size"] == list(mask.shape)
    np.testing.assert_array_equal(decode_mask(coded["size"], coded["counts"]), mask)


def test_the_string_is_that_of_pycocotools():
    mask = np.zeros((30, 50), bool)
    mask[3:20, 5:40] = True
    mask[10, 10] = False
    assert encode_mask(mask)["counts"] == (
        "i4a0=00000000FD2<800000000000000000000000000000000000000000000000000000000Y9"
    )


def test_empty_and_full_masks():
    assert encode_mask(np.zeros((2, 3), bool))["counts"] == "6"
    assert encode_mask(np.ones((2, 3), bool))["counts"] == "06"


def test_runs_of_another_size_are_refused():
    with pytest.raises(ValueError, match="expected 3 x 3"):
        decode_mask([3, 3], "6")
