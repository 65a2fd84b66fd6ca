"""How a command that takes long to start imports its libraries."""

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def importing() -> Iterator[None]:
    """Import libraries without looking for garbage, which takes a sixth of the time and finds none.

    What has come is left alone afterwards, too: it stays until the process ends, and memory that
    nobody touches is shared with processes that are forked.
    """
    wanted, known = gc.isenabled(), len(sys.modules)
    gc.disable()
    try:
        yield
        if len(sys.modules) > known:
            gc.freeze()
    finally:
        if wanted:
            gc.enable()
