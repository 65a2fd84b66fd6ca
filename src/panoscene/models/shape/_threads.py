"""Pieces of work side by side: threads that help one another on small tensors mostly wait."""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

import torch

Piece = TypeVar("Piece")
Found = TypeVar("Found")


@contextmanager
def alone() -> Iterator[int]:
    """Let PyTorch work with one thread here; gives how many there are otherwise."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield threads
    finally:
        # what new threads begin with is one number for all
        torch.set_num_threads(threads)


def side_by_side(
    work: Callable[[Piece], Found], pieces: Iterable[Piece], threads: int
) -> tuple[Found, ...]:
    """Return what is found for each piece; as many are worked on at once as there are threads.

    To be called while PyTorch works ``alone``. New threads do not know of ``inference_mode``.
    """
    some = tuple(pieces)
    if len(some) < 2 or threads == 1:
        return tuple(map(work, some))
    with ThreadPoolExecutor(threads, initializer=torch.set_num_threads, initargs=(1,)) as pool:
        return tuple(pool.map(work, some))
