"""Ctrl-C that is not lost, whatever is running when it comes."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def remembered_interrupt() -> Iterator[threading.Event]:
    """Give an event that Ctrl-C sets within the block, besides raising KeyboardInterrupt.

    Python drops an exception that is raised while it tidies up, or in a callback of a library: who
    starts a server must ask before waiting for the next Ctrl-C.
    """
    asked = threading.Event()
    usual = signal.getsignal(signal.SIGINT)
    if usual is not signal.default_int_handler or (
        threading.current_thread() is not threading.main_thread()
    ):
        # somebody else looks after it
        yield asked
        return

    def remember(number: int, frame: FrameType | None) -> None:
        asked.set()
        signal.default_int_handler(number, frame)

    signal.signal(signal.SIGINT, remember)
    try:
        yield asked
    finally:
        signal.signal(signal.SIGINT, usual)
