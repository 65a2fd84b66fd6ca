"""The context stage: estimates of scenes to boxes and relations that fit together."""

from pathlib import Path

import torch

from panoscene._editions import Edition
from panoscene.models._weights import load_network, weights_file
from panoscene.scene import Objects, Relations

from ._config import CONFIGS
from ._estimates import Estimates
from ._network import ContextNetwork, build_context
from ._relations import ContextOutput
from ._scenes import objects_of, relations_of

STAGE = "context"
"""Name of this stage in files with weights."""


class ContextStage:
    """Refines boxes and says how objects and walls are related.

    Attributes:
        network: In evaluation mode.
    """

    def __init__(self, network: ContextNetwork) -> None:
        self.network = network.eval()

    @torch.inference_mode()
    def __call__(self, estimates: Estimates) -> tuple[tuple[Objects, Relations | None], ...]:
        """Return objects and relations of each scene, without padding, where the estimates are.

        Relations are None for a network without relation heads.

        Args:
            estimates: Of the stages before.

        Convention:
            - objects keep their order, categories, BFoVs and scores; ``distance_score`` and
              ``yaw_score`` are the probabilities of the chosen bins after refinement
            - relations are calibrated probabilities; walls are those of the estimates
            - source: the paper, Sec. 3.2

        Raises:
            ValueError: Appearance or shapes have another width than the network's.
        """
        output = self.network(estimates.to(self.network.scale.device)).to(estimates.bfov.device)
        return tuple(
            (objects_of(output.output, estimates, index), self._relations(output, index))
            for index in range(len(estimates.valid))
        )

    def _relations(self, output: ContextOutput, index: int) -> Relations | None:
        if output.relations is None:
            return None
        return relations_of(output, index, self.network.calibration.to(output.valid.device))


def load_context_stage(
    edition: Edition = "compact", weights: Path | None = None, device: str = "cpu"
) -> ContextStage:
    """Return the context stage with trained weights.

    Args:
        edition: Which network.
        weights: A .safetensors file; None for the compact weights that come with the package.
        device: Where it runs.

    Raises:
        CheckpointError: There are no weights, or they are for another network.
    """
    path = weights_file(STAGE, edition, weights)
    network = load_network(path, build_context, CONFIGS[edition], stage=STAGE, edition=edition)
    return ContextStage(network.to(device))
