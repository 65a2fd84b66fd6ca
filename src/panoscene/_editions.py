"""The two sizes in which every network comes, for who does not wait for PyTorch, too."""

from typing import Literal, get_args

Edition = Literal["paper", "compact"]
"""``paper``: the networks of the paper, for a GPU. ``compact``: small ones, for two cores."""
EDITIONS: tuple[Edition, ...] = get_args(Edition)
"""All editions."""
