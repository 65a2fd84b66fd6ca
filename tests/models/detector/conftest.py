"""A small detector for tests: the compact one on fewer pixels."""

import pytest
import torch

from panoscene.models.detector import (
    CONFIGS,
    DetectorConfig,
    DetectorNetwork,
    DetectorTargets,
    build_detector,
)


@pytest.fixture(scope="session")
def small() -> DetectorConfig:
    return CONFIGS["compact"].model_copy(
        update={"width": 256, "first_row": 32, "rows": 64, "channels": 16, "head_width": 32}
    )


@pytest.fixture(scope="session")
def network(small: DetectorConfig) -> DetectorNetwork:
    with torch.random.fork_rng(devices=[]):
        torch.default_generator.manual_seed(0)
        made = build_detector(small).eval()
        for layer in (made.rpn.head.cls_logits, made.roi_heads.box_predictor.cls_score):
            torch.nn.init.normal_(layer.weight, std=0.3)
    return made


def rectangle_targets(
    boxes: list[tuple[int, int, int, int]], rows: int = 64, columns: int = 256, seed: int = 0
) -> DetectorTargets:
    """Return targets whose objects fill their boxes; the right edge may be beyond the picture."""
    instances = torch.zeros(rows, columns, dtype=torch.int32)
    for k, (left, top, right, bottom) in enumerate(boxes):
        instances[top:bottom, torch.arange(left, right) % columns] = k + 1
    return DetectorTargets(
        torch.tensor(boxes, dtype=torch.float32).reshape(-1, 4),
        torch.arange(len(boxes)),
        torch.arange(1, len(boxes) + 1, dtype=torch.int32),
        instances,
        torch.zeros(0, 4),
        seed,
    )
