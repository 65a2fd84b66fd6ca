"""Where a training runs, and with what precision."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import torch

from panoscene.data import seed_of

from ._errors import TrainError
from ._recipe import Precision, TrainRecipe

if TYPE_CHECKING:
    from lightning_fabric import Fabric

_CPU_INFO = Path("/proc/cpuinfo")


def fast_bfloat16(cpu_info: Path = _CPU_INFO) -> bool:
    """Return whether matrices of 16-bit numbers are fast here: on a newer GPU, or with AMX.

    Other CPUs compute with bfloat16 too, but several times slower than with 32 bits.
    """
    if torch.cuda.is_available():
        return torch.cuda.is_bf16_supported(including_emulation=False)
    return cpu_info.is_file() and "amx_bf16" in cpu_info.read_text(errors="ignore").split()


def chosen_precision(wanted: Precision) -> Precision:
    """Return the precision of a training: the wanted one, or what is fast here for ``auto``."""
    if wanted != "auto":
        return wanted
    return "bf16-mixed" if fast_bfloat16() else "32-true"


def start_fabric(recipe: TrainRecipe, run: Path) -> "Fabric":
    """Return the launched devices of a training: GPUs where there are some, else the CPU.

    With several devices the program is started once more for each of them, unless torchrun or
    SLURM did so already.

    Raises:
        TrainError: The packages of the extra ``train`` are missing.
        ValueError: There are not as many GPUs.
    """
    try:
        from lightning_fabric import Fabric  # noqa: PLC0415
        from lightning_fabric.strategies.ddp import DDPStrategy  # noqa: PLC0415
    except ModuleNotFoundError as error:
        reason = f"{error.name} is missing: training needs pip install 'panoscene[train]'"
        raise TrainError(run, reason) from None
    if recipe.threads is not None:
        torch.set_num_threads(recipe.threads)
    gpus = torch.cuda.device_count() if torch.cuda.is_available() else 0
    devices = max(1, gpus) if recipe.devices == "auto" else recipe.devices
    if gpus and devices > gpus:
        raise ValueError(f"devices: found {devices}, expected at most the {gpus} GPUs of {run}")
    several = devices * recipe.num_nodes > 1
    fabric = Fabric(
        accelerator="gpu" if gpus else "cpu",
        devices=devices,
        num_nodes=recipe.num_nodes,
        # a part of the network may have no loss in a batch, such as masks without objects
        strategy=DDPStrategy(find_unused_parameters=True) if several else "auto",
        precision=chosen_precision(recipe.precision),  # ty: ignore[invalid-argument-type]
    )
    fabric.launch()
    if recipe.threads is not None:
        torch.set_num_threads(recipe.threads)  # launching may have changed it
    return fabric


@contextmanager
def seeded(device: torch.device, *numbers: int) -> Iterator[None]:
    """Make global random numbers a function of some numbers for a while, and then go on as before.

    Start weights, dropout and the samplers of torchvision take no generator.
    """
    devices: list[Any] = [device] if device.type == "cuda" else []
    with torch.random.fork_rng(devices=devices):
        torch.manual_seed(seed_of(*numbers))  # noqa: TID251 (undone at the end)
        yield
