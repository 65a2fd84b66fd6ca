"""Measures how long meshes of 20 objects take: writes benchmarks/shape.json.

    python benchmarks/shape.py

Codes are those of the shipped weights for plain pictures, one of each of 20 categories.
"""

import json
import statistics
import time
from pathlib import Path

import torch

from panoscene.eval import machine_facts
from panoscene.models import CheckpointError
from panoscene.models.shape import (
    CONFIGS,
    ShapeNetwork,
    build_shape,
    extract_meshes,
    load_shape_stage,
)
from panoscene.scene import CATEGORIES, MEAN_SIZE, write_atomically

OBJECTS = 20
REPEATS = 5
RESOLUTIONS = (64, 128)


def main() -> None:
    """Measure and write."""
    torch.set_num_threads(2)
    generator = torch.Generator().manual_seed(0)
    rows = []
    for edition in ("compact", "paper"):
        network, trained = _network(edition)
        codes = _codes(network, generator)
        row = {"edition": edition, "trained": trained, "objects": OBJECTS}
        for resolution in RESOLUTIONS:
            wall, used, faces = _measured(network, codes, resolution)
            row |= {
                f"seconds_{resolution}": wall,
                f"processor_seconds_{resolution}": used,
                f"faces_{resolution}": faces,
            }
        rows.append(row)
        print(row)
    text = json.dumps({"machine": machine_facts(), "rows": rows}, indent=2) + "\n"
    write_atomically(Path(__file__).with_suffix(".json"), text)


def _network(edition: str) -> tuple[ShapeNetwork, bool]:
    """Return the network of an edition, and whether it is trained."""
    try:
        if edition == "compact":
            return load_shape_stage().network, True
    except CheckpointError:
        pass
    return build_shape(CONFIGS[edition]).eval(), False


@torch.inference_mode()
def _codes(network: ShapeNetwork, generator: torch.Generator) -> torch.Tensor:
    """Return codes of 20 shapes; without training, elements spread over a box."""
    config = network.config
    if config.spread:
        category = torch.arange(0, len(CATEGORIES), 2)[:OBJECTS]
        hints = torch.zeros(OBJECTS, 8)
        hints[:, 1] = -1
        hints[:, 2:5] = MEAN_SIZE[category].log()
        crops = torch.rand(OBJECTS, 3, config.crop, config.crop, generator=generator) * 0.2 + 0.4
        return network(crops, category, hints)
    code = torch.randn(OBJECTS, config.elements, config.width, generator=generator) * 0.5
    code[..., 0] = 0.3
    code[..., 1:4] *= 1.2
    code[..., 4:7] += 0.7
    return code.reshape(OBJECTS, -1)


def _measured(
    network: ShapeNetwork, codes: torch.Tensor, resolution: int
) -> tuple[float, float, int]:
    """Return median seconds, seconds of the processor, and faces of all meshes."""
    wall, used, faces = [], [], 0
    for _ in range(REPEATS + 1):
        start, busy = time.perf_counter(), time.process_time()
        meshes = extract_meshes(network, codes, resolution=resolution)
        wall.append(time.perf_counter() - start)
        used.append(time.process_time() - busy)
        faces = sum(len(mesh.faces) for mesh in meshes if mesh is not None)
    return round(statistics.median(wall[1:]), 3), round(statistics.median(used[1:]), 3), faces


if __name__ == "__main__":
    main()
