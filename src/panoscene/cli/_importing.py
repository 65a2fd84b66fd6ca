"""How a command that takes long to start imports its libraries."""

import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def importing() -> Iterator[None]:
    """Import libraries without looking for garbage, which takes a sixth of the time and finds none.

    What is there at the end is left alone afterwards, too: it stays until the process ends, and
    memory that nobody touches is shared with processes that are forked.
    """
    wanted = gc.isenabled()
    gc.disable()
    try:
        yield
        gc.freeze()
    finally:
        if wanted:
            gc.enable()
