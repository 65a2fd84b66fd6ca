"""How long the parts of a reconstruction take."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field


@dataclass(slots=True)
class Clock:
    """Seconds for each part of the work.

    Examples:
        >>> clock = Clock()
        >>> with clock("whole"):
        ...     with clock("part"):
        ...         time.sleep(0.02)
        >>> clock.seconds["part"] >= 0.02 > clock.seconds["whole"]
        True
    """

    seconds: dict[str, float] = field(default_factory=dict[str, float])
    """By the name of the part, in the order in which they ended."""
    _within: float = 0.0
    """Seconds of parts of the part that is at work."""

    @contextmanager
    def __call__(self, part: str) -> Iterator[None]:
        """Measure a part, as often as it is at work; what is measured within it counts once."""
        before, self._within = self._within, 0.0
        start = time.perf_counter()
        try:
            yield
        finally:
            spent = time.perf_counter() - start
            self.seconds[part] = self.seconds.get(part, 0.0) + spent - self._within
            self._within = before + spent
