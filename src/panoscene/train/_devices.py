"""Where a training runs, and with what precision."""

import os
from collections.abc import Iterator, Mapping
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
_STARTED_BY = (
    "TORCHELASTIC_RUN_ID", "SLURM_NTASKS", "LSB_JOBID", "OMPI_COMM_WORLD_SIZE", "PMI_SIZE",
    "GROUP_RANK", "NODE_RANK",
)  # fmt: skip
"""Variables by which a machine knows its place among several (the last by hand)."""


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
        TrainError: The packages of the extra ``train`` are missing, or the devices are not there,
            do not share a batch evenly, or are on machines that do not know of each other.
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
    devices = chosen_devices(recipe, gpus)
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


def chosen_devices(
    recipe: TrainRecipe, gpus: int, environment: Mapping[str, str] = os.environ
) -> int:
    """Return how many devices of each machine a training takes.

    With ``auto`` those are as many GPUs as share a batch evenly, or the CPU.

    Args:
        recipe: Of the training.
        gpus: That are there.
        environment: Variables, by which several machines know of each other.

    Raises:
        TrainError: There are not as many, a batch cannot be shared, or nothing has started the
            program on several machines, so that it would wait for them for ever.
    """
    machines, parts = recipe.num_nodes, recipe.accumulate
    if machines > 1 and not any(name in environment for name in _STARTED_BY):
        reason = (
            f"num_nodes: found {machines}, and nothing that started the program on all of them; "
            "expected torchrun or SLURM"
        )
        raise TrainError("recipe", reason)
    most = recipe.batch_size // (parts * machines)
    wanted = min(max(1, gpus), max(1, most)) if recipe.devices == "auto" else recipe.devices
    if gpus and wanted > gpus:
        reason = f"devices: found {wanted}, expected at most the {gpus} GPUs of this machine"
        raise TrainError("recipe", reason)

    def shared(devices: int) -> bool:
        return recipe.batch_size % (devices * machines * parts) == 0

    if recipe.devices == "auto":
        wanted = next((n for n in range(wanted, 0, -1) if shared(n)), wanted)
    if not shared(wanted):
        reason = (
            f"batch_size: found {recipe.batch_size}, expected a multiple of {wanted} devices "
            f"times {machines} machines times {parts} parts"
        )
        raise TrainError("recipe", reason)
    return wanted


@contextmanager
def seeded(device: torch.device, *numbers: int) -> Iterator[None]:
    """Make global random numbers a function of some numbers for a while, and then go on as before.

    Start weights, dropout and the samplers of torchvision take no generator.
    """
    devices: list[Any] = [device] if device.type == "cuda" else []
    with torch.random.fork_rng(devices=devices):
        torch.manual_seed(seed_of(*numbers))  # noqa: TID251 (undone at the end)
        yield
