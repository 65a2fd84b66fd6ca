"""Connected components: against scipy's, and by hand."""

import numpy as np
import pytest
import scipy.sparse
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import connected_components as scipys

from panoscene.geometry import connected_components


@settings(max_examples=60, deadline=None)
@given(count=st.integers(1, 40), links=st.integers(0, 60), seed=st.integers(0, 2**32 - 1))
def test_they_are_numbered_as_scipy_does(count: int, links: int, seed: int) -> None:
    one, two = np.random.default_rng(seed).integers(0, count, (2, links))
    graph = scipy.sparse.coo_array((np.ones(links), (one, two)), shape=(count, count))
    expected = scipys(graph, directed=False)[1]
    np.testing.assert_array_equal(connected_components(count, one, two), expected)


@pytest.mark.parametrize("seed", range(3))
def test_a_long_chain_is_one_component(seed: int) -> None:
    nodes = np.random.default_rng(seed).permutation(20_000)
    found = connected_components(len(nodes) + 1, nodes[1:], nodes[:-1])
    assert found[-1] == 1
    assert not found[:-1].any()


def test_a_star_around_the_last_node_is_one_component() -> None:
    leaves = np.arange(20_000)
    assert not connected_components(20_001, leaves, np.full(20_000, 20_000)).any()


def test_without_edges_every_node_is_alone() -> None:
    none = np.zeros(0, np.int64)
    assert connected_components(3, none, none).tolist() == [0, 1, 2]
    assert connected_components(0, none, none).tolist() == []
