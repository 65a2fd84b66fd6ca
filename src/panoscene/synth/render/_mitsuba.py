"""Starts Mitsuba on the right LLVM, once."""

import os
import sys
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

_LLVM = ("libLLVM.so.19*", "libLLVM-19.so*", "libLLVM.so.20*", "libLLVM.so.18*", "libLLVM-18.so*")
"""LLVM 15 and 16 abort the process when they meet Dr.Jit's code, and 14 is refused."""


class MissingRendererError(ImportError):
    """Mitsuba, its denoiser or LLVM is not installed; the message says what to install."""


class Engine(NamedTuple):
    """The modules that draw."""

    mi: ModuleType
    dr: ModuleType
    oidn: ModuleType


def load_engine(threads: int | None = None) -> Engine:
    """Return Mitsuba with the ``llvm_ad_rgb`` variant set, Dr.Jit and the denoiser.

    Args:
        threads: that render; by default as many as before the call.

    Raises:
        MissingRendererError: if a package or LLVM 18 to 20 is not installed.
    """
    if "drjit" not in sys.modules:  # it reads the variable when it is first used
        _find_llvm()
    try:
        import drjit as dr  # noqa: PLC0415
        import mitsuba as mi  # noqa: PLC0415
        import mitsuba_oidn as oidn  # noqa: PLC0415
    except ImportError as error:
        raise MissingRendererError(
            f"rendering needs {error.name}: pip install 'panoscene[synth]'"
        ) from error
    if mi.variant() != "llvm_ad_rgb":
        mi.set_variant("llvm_ad_rgb")
        mi.set_log_level(mi.LogLevel.Error)
    if threads is not None:
        dr.set_thread_count(threads)
    return Engine(mi, dr, oidn)


def _find_llvm() -> None:
    """Set the variable that tells Dr.Jit which LLVM to open, unless the user has set it."""
    if os.environ.get("DRJIT_LIBLLVM_PATH"):
        return
    folders = [Path("/usr/lib/x86_64-linux-gnu"), Path("/usr/lib/aarch64-linux-gnu")]
    folders += [Path("/usr/lib64"), Path("/usr/lib"), *sorted(Path("/usr/lib").glob("llvm-*/lib"))]
    for name in _LLVM:
        for folder in folders:
            for path in sorted(folder.glob(name)):
                os.environ["DRJIT_LIBLLVM_PATH"] = str(path)
                return
    if sys.platform.startswith("linux"):
        raise MissingRendererError(
            "rendering needs LLVM 18 to 20, which was not found: apt-get install libllvm19, or "
            "set DRJIT_LIBLLVM_PATH to libLLVM.so"
        )
