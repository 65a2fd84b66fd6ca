"""Work that is spread over the computers of a Ray cluster."""

import logging
import os
import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import ModuleType
from typing import Any, TypeVar

_AGAIN = 3
"""Times that a task is tried again when its computer goes away."""
_PATIENCE = 10.0
"""Seconds in which a cluster must answer."""
_Task = TypeVar("_Task")


def ray_package() -> ModuleType:
    """Return the optional package.

    Raises:
        ModuleNotFoundError: It is missing.
    """
    # it reports how it is used to its makers unless told otherwise
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray  # noqa: PLC0415 - optional
    except ModuleNotFoundError as error:
        hint = "working on several computers needs ray: pip install 'panoscene[ray]'"
        raise ModuleNotFoundError(hint, name="ray") from error
    return ray


@contextmanager
def ray_cluster(ray: ModuleType, address: str | None) -> Iterator[None]:
    """Connect the package to a cluster; one that it is connected to already stays.

    Args:
        ray: the package.
        address: such as ``auto`` or ``ray://head:10001``; None takes the one that is running here,
            or else the cores of this computer.

    Raises:
        ConnectionError: There is no cluster at the address.
    """
    started = not ray.is_initialized()
    if started:
        try:
            _knock(address)
            ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
        except OSError as error:
            raise ConnectionError(f"{address}: found no Ray cluster there") from error
    try:
        yield
    finally:
        if started:
            ray.shutdown()


def _knock(address: str | None) -> None:
    """Try whether anybody answers at an address, as the package would wait for minutes.

    Raises:
        OSError: Nobody does, or it is no address.
    """
    host, colon, port = (address or "").removeprefix("ray://").rpartition(":")
    if colon and not port.isdecimal():
        raise ConnectionError(f"found port {port}, expected a number")
    if colon:
        socket.create_connection((host.strip("[]"), int(port)), timeout=_PATIENCE).close()


def spread(
    ray: ModuleType, work: Callable[..., Any], given: Sequence[Any], tasks: Sequence[_Task]
) -> Iterator[tuple[_Task, Any]]:
    """Return tasks as they finish, with where ``ray_result`` finds what came of them.

    Args:
        ray: the package, connected to a cluster.
        work: a function of what is given and a task; it gets one core.
        given: the same for all tasks.
        tasks: what is to be done, each different.
    """
    remote: Any = ray.remote(work).options(
        num_cpus=1, max_retries=_AGAIN, scheduling_strategy="SPREAD"
    )
    running = {remote.remote(*given, task): task for task in tasks}
    try:
        while running:
            done, _ = ray.wait(list(running), num_returns=1)
            yield running.pop(done[0]), done[0]
    finally:
        for reference in running:
            ray.cancel(reference, force=True)


def ray_result(ray: ModuleType, reference: Any) -> Any:
    """Return what came of a task.

    Whatever its function raised on another computer is raised here, too.

    Raises:
        RayError: Its computer went away, too many times.
    """
    try:
        return ray.get(reference)
    except ray.exceptions.RayTaskError as error:
        if error.cause is None:
            raise
        raise error.cause from None
