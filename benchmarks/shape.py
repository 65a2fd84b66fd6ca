"""Measures how long meshes of 20 objects take: writes benchmarks/shape.json.

    python benchmarks/shape.py
    python benchmarks/shape.py --output shape.json --repeats 3

``seconds_64`` is what the stage does after the codes: meshes, and fewer triangles. Extraction and
joining triangles are told apart, too, one after the other. Codes of the shipped weights are those
of the objects in the sample photo, again and again, as in ``panoscene bench stages``.
"""

import argparse
import json
import statistics
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import torch

from panoscene.eval import machine_facts
from panoscene.models import CheckpointError, Edition
from panoscene.models.shape import (
    CONFIGS,
    ShapeNetwork,
    build_shape,
    extract_meshes,
    load_shape_stage,
    slab_objects,
)
from panoscene.models.shape._fewer import FACES_PER_CELL, fewer_faces
from panoscene.pipeline import Pipeline, load_stages
from panoscene.sample import sample_photo_path
from panoscene.scene import read_panorama, select_objects, write_atomically

OBJECTS = 20
THREADS = 2
RESOLUTIONS = (64, 128)


def main() -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--output", type=Path, default=Path(__file__).with_suffix(".json"))
    parser.add_argument("--repeats", type=int, default=5)
    chosen = parser.parse_args()
    torch.set_num_threads(THREADS)
    rows = []
    editions: tuple[Edition, ...] = ("compact", "paper")
    for edition in editions:
        network, trained = _network(edition)
        codes = _codes(network, trained=trained)
        row = {"edition": edition, "trained": trained, "objects": OBJECTS}
        for resolution in RESOLUTIONS:
            row |= _measured(network, codes, resolution, chosen.repeats)
        rows.append(row)
        print(row)
    text = json.dumps({"machine": machine_facts(), "rows": rows}, indent=2) + "\n"
    write_atomically(chosen.output, text)


def _network(edition: Edition) -> tuple[ShapeNetwork, bool]:
    """Return the network of an edition, and whether it is trained."""
    try:
        if edition == "compact":
            return load_shape_stage().network, True
    except CheckpointError:
        pass
    return build_shape(CONFIGS[edition]).eval(), False


@torch.inference_mode()
def _codes(network: ShapeNetwork, *, trained: bool) -> torch.Tensor:
    """Return codes of 20 shapes; without training, elements spread over a box."""
    if trained:
        image, _ = read_panorama(sample_photo_path())
        stages = load_stages()
        found = Pipeline(replace(stages, shape=None), settings=None)(image).scene.objects
        thick = (~slab_objects(found)).nonzero()[:, 0]
        objects = select_objects(found, thick[torch.arange(OBJECTS) % len(thick)])
        return load_shape_stage().codes(image, objects)
    config = network.config
    generator = torch.Generator().manual_seed(0)
    code = torch.randn(OBJECTS, config.elements, config.width, generator=generator) * 0.5
    code[..., 0] = 0.3
    code[..., 1:4] *= 1.2
    code[..., 4:7] += 0.7
    return code.reshape(OBJECTS, -1)


def _measured(
    network: ShapeNetwork, codes: torch.Tensor, resolution: int, repeats: int
) -> dict[str, float | int]:
    """Return median seconds, those of the processor, and triangles of all meshes."""
    most = FACES_PER_CELL * resolution
    meshes = [mesh for mesh in extract_meshes(network, codes, resolution=resolution) if mesh]
    few = [fewer_faces(mesh, most) for mesh in meshes]
    parts: dict[str, Callable[[], object]] = {
        "": lambda: extract_meshes(network, codes, resolution=resolution, most=most),
        "extraction_": lambda: extract_meshes(network, codes, resolution=resolution),
        "decimation_": lambda: [fewer_faces(mesh, most) for mesh in meshes],
    }
    found: dict[str, float | int] = {}
    for name, part in parts.items():
        wall, used = zip(*(_timed(part) for _ in range(repeats)), strict=True)
        found[f"{name}seconds_{resolution}"] = round(statistics.median(wall), 3)
        found[f"{name}processor_seconds_{resolution}"] = round(statistics.median(used), 3)
    found[f"faces_{resolution}"] = sum(len(mesh.faces) for mesh in meshes)
    found[f"faces_left_{resolution}"] = sum(len(mesh.faces) for mesh in few)
    return found


def _timed(part: Callable[[], object]) -> tuple[float, float]:
    """Return how long something takes, and how long processors work on it."""
    start, busy = time.perf_counter(), time.process_time()
    part()
    return time.perf_counter() - start, time.process_time() - busy


if __name__ == "__main__":
    main()
