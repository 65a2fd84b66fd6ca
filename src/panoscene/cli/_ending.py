"""How the process of the program ends: at once."""

import atexit
import os
import sys
from contextlib import suppress


class Ending:
    """Ends the process when all else is done, once it knows the exit code.

    To take down large libraries object by object would take a second more. What was registered with
    ``atexit`` before this module was imported is not called.
    """

    def __init__(self) -> None:
        self.code: int | None = None

    def __call__(self) -> None:
        """End the process, unless nobody has asked for it."""
        if self.code is None:
            return
        for stream in (sys.stdout, sys.stderr):
            with suppress(OSError, ValueError):
                stream.flush()
        os._exit(self.code)


ENDING = Ending()
"""Of this process."""
# what is registered later is done before: libraries tidy up their files and threads
atexit.register(ENDING)
