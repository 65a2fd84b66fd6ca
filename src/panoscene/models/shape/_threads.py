"""Pieces of work side by side: threads that help one another on small tensors mostly wait."""

import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

import torch

Piece = TypeVar("Piece")
Found = TypeVar("Found")


_TURN = 0.0005
"""Seconds after which a thread lets another have its turn in Python: most pieces between two
operations are shorter, and the other thread has nothing else to do."""


class _Alone:
    """How many blocks PyTorch works alone in, and how it is otherwise."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.blocks = 0
        self.threads = 1
        self.turn = _TURN


_ALONE = _Alone()


@contextmanager
def alone() -> Iterator[int]:
    """Let PyTorch work with one thread here; gives how many there are otherwise.

    Threads may be in such blocks at the same time. A new one begins with the number that was set
    last, so it is the first of them that sees how many there are.
    """
    with _ALONE.lock:
        if _ALONE.blocks == 0:
            _ALONE.threads = torch.get_num_threads()
            _ALONE.turn = sys.getswitchinterval()
            sys.setswitchinterval(min(_TURN, _ALONE.turn))
        _ALONE.blocks += 1
        threads = _ALONE.threads
    torch.set_num_threads(1)
    try:
        yield threads
    finally:
        with _ALONE.lock:
            _ALONE.blocks -= 1
            if _ALONE.blocks == 0:
                sys.setswitchinterval(_ALONE.turn)
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
