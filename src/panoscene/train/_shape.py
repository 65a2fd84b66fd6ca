"""Training of the shape network."""

import zlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from jaxtyping import UInt8
from pydantic import BaseModel, ConfigDict
from torch import Tensor, nn

from panoscene.data import seed_of
from panoscene.data._shape_crops import ObjectCrops, read_object_crops
from panoscene.data._shape_data import MODELS, crops_file, prepare_shape_data, shaped_models
from panoscene.data._shape_samples import (
    Picture,
    SeenViews,
    ShapeSample,
    View,
    batch_of,
    collate_shapes,
    crop_picture,
    picture_view,
    read_seen_views,
    read_store,
    render_picture,
    seen_views,
    shape_sample,
    write_seen_views,
)
from panoscene.data._shape_store import ModelShape
from panoscene.models import content_hash, read_weights
from panoscene.models.shape import (
    CONFIGS,
    ISO_LEVEL,
    ShapeNetwork,
    ShapeWeights,
    build_shape,
    extract_meshes,
    fast_field,
    shape_losses,
)
from panoscene.synth.assets import load_library

from ._errors import TrainError
from ._panoramas import training_panoramas
from ._recipe import TrainRecipe
from ._shape_pictures import mesh_sheet
from ._task import SELECTION, Task

_BATCH = 32
_CHECK_POINTS = 2048
_SHOWN = 8
_SEED_OF_VIEW = 31


class ShapeOptions(BaseModel):
    """Options of the stage in a recipe."""

    model_config = ConfigDict(frozen=True, extra="forbid", use_attribute_docstrings=True)

    folder: Path
    """What the network learns from, as ``panoscene.data.prepare_shape_data`` makes it."""
    assets: Path = Path("~/.cache/panoscene/assets")
    """Cache of the models, made by ``panoscene synth assets``."""
    prepare: bool = True
    """Whether to make what is missing in the folder first: half an hour for a thousand
    models."""
    points: int = 1024
    """Uniform ones of each object, and as many near the surface."""
    renders: int = 1
    """Times that each model comes in an epoch as a picture of its own."""
    near_weight: float = 0.1
    """Weight of points near the surface."""
    frozen_views: int = 0
    """Crops of each picture for which a backbone that is not trained is run once, before the
    training; 0 trains the backbone, too."""
    models: int | None = None
    """Learn from so many models only, of all categories in turn; None for all."""


class ShapeTask(Task):
    """Seen models in panoramas and in pictures of their own; scores on others."""

    model: ShapeNetwork  # ty: ignore[incompatible-mutable-override]

    def __init__(self, recipe: TrainRecipe) -> None:
        self.options = recipe.stage_options(ShapeOptions)
        self.network_config = CONFIGS[recipe.edition]
        folder, assets = self.options.folder, self.options.assets.expanduser()
        if self.options.prepare:
            if recipe.data is None:
                raise TrainError("recipe", "data: found none, expected the folder of a data set")
            training_panoramas(recipe.data, recipe)  # refuses more than there are
            prepare_shape_data(recipe.data, assets, folder, panoramas=recipe.panoramas)
        self.shapes = read_store(folder / MODELS, assets)
        if not self.shapes:
            raise TrainError(folder / MODELS, "found no models, expected some .npz files")
        entries = load_library(assets).entries
        self.metres = {name: max(entries[name].size) for name in self.shapes}
        self.bases = {name: entries[name].base for name in self.shapes}
        seen = [name for name, shape in self.shapes.items() if shape.split == "seen"]
        if self.options.models is not None:
            known = frozenset(seen)
            seen = [name for name in shaped_models(assets) if name in known]
        self.seen = seen[: self.options.models]
        self.unseen = [name for name in self.shapes if self.shapes[name].split == "unseen"]
        self.crops = _crops(folder, "train", recipe.panoramas)
        self.validation_crops = _crops(folder, "val")
        self.entries = self._entries()
        self.weights = ShapeWeights(near=self.options.near_weight)
        self.model = build_shape(
            self.network_config, imagenet=recipe.imagenet and recipe.start is None
        )
        if recipe.start is not None:
            read_weights(recipe.start, self.model, stage="shape", edition=recipe.edition)
        self.views: SeenViews | None = None
        if self.options.frozen_views:
            self.views = self._seen_views()

    def _entries(self) -> list[tuple[int, str]]:
        """Return what each sample shows: the number of a crop, or -1, -2, ... for a render."""
        known = set(self.seen)
        found = [
            (-1 - k, name)
            for name in self.seen
            for k in range(min(self.options.renders, len(self.shapes[name].image)))
        ]
        if self.crops is not None:
            found += [(k, str(name)) for k, name in enumerate(self.crops.model) if name in known]
        return found

    def sample_count(self) -> int:
        return len(self.entries)

    def sample(self, index: int, generator: torch.Generator) -> ShapeSample:
        shape = self.shapes[self.entries[index][1]]
        picture = self._picture(index, generator)
        view = None
        if self.views is not None:
            number = int(torch.randint(self.options.frozen_views, (), generator=generator))
            view = self.views.view(index, number)
        return self._sampled(picture, shape, generator, self.options.points, view)

    def _picture(self, index: int, generator: torch.Generator) -> Picture:
        crop, name = self.entries[index]
        if crop >= 0 and self.crops is not None:
            return crop_picture(self.crops, crop)
        return self._render(self.shapes[name], -1 - crop, generator)

    def _seen_views(self) -> SeenViews:
        """Return what the backbone sees in all pictures; what a file has is not made again."""
        count, rows = self.options.frozen_views, self.network_config.crop
        keys = [f"{name} {crop} of {count}" for crop, name in self.entries]
        backbone = content_hash(self.model.encoder.backbone.state_dict())[:12]
        file = self.options.folder / f"seen-{backbone}-{rows}-{count}.safetensors"
        known = read_seen_views(file) if file.is_file() else None
        there = frozenset() if known is None else frozenset(known.names)
        missing = [k for k, key in enumerate(keys) if key not in there]
        self.model.eval()
        for start in range(0, len(missing), _BATCH):
            views: list[View] = []
            for index in missing[start : start + _BATCH]:
                for number in range(count):
                    seed = seed_of(_SEED_OF_VIEW, zlib.crc32(keys[index].encode()), number)
                    generator = torch.Generator().manual_seed(seed)
                    picture = self._picture(index, generator)
                    views.append(picture_view(picture, generator, rows=rows))
            with torch.no_grad():
                seen = self.model.encoder.seen(torch.stack([view.crop for view in views]))
            names = [keys[index] for index in missing[start : start + _BATCH]]
            fresh = seen_views(names, seen, views)
            known = fresh if known is None else known.with_more(fresh)
        if known is None:
            raise TrainError(self.options.folder, "found no pictures to learn from")
        if missing:
            write_seen_views(file, known)
        return known.chosen(keys)

    def _render(self, shape: ModelShape, view: int, generator: torch.Generator | None) -> Picture:
        """Return a picture of a model in front of a piece of a room, or of grey."""
        rows = round(shape.image.shape[1] * 1.2)
        background = np.full((rows, rows, 3), 128, np.uint8)
        if generator is not None and self.crops is not None:
            k = int(torch.randint(len(self.crops.image), (), generator=generator))
            part = self.crops.image[k][::-1]
            background[:] = np.resize(np.pad(part, ((0, 8), (0, 8), (0, 0)), "edge")[:rows, :rows],
                                      background.shape)  # fmt: skip
        elif generator is not None:
            background[:] = torch.randint(256, (3,), generator=generator).numpy()
        return render_picture(shape, view, self.metres[shape.id], background)

    def _sampled(
        self,
        picture: Picture,
        shape: ModelShape,
        generator: torch.Generator | None,
        points: int,
        view: View | None = None,
    ) -> ShapeSample:
        return shape_sample(
            picture,
            shape,
            generator,
            rows=self.network_config.crop,
            points=points,
            frame=self.network_config.frame,
            view=view,
        )

    def collate(self, samples: Sequence[Any]) -> dict[str, Tensor]:
        return collate_shapes(samples)

    def losses(self, model: nn.Module, batch: Mapping[str, Tensor]) -> dict[str, Tensor]:
        if self.views is not None:
            self.model.encoder.backbone.eval()
        code = model(batch["crop"], batch["category"], batch["hints"])
        return shape_losses(self.model, code, batch_of(batch).targets(), self.weights)

    def validate(self, model: nn.Module, limit: int | None) -> dict[str, float]:
        """Return the mean volumetric IoU over points in the enlarged box, of three kinds.

        ``crops`` are objects of the validation panoramas, ``unseen`` pictures of models that are
        never trained on, ``seen`` those of training models; ``box_`` is the IoU of the box itself.
        """
        del model
        result: dict[str, float] = {}
        for kind, chosen in self.validation(limit).items():
            if chosen:
                found, box = self._overlaps(chosen)
                result[f"{kind}_iou"], result[f"{kind}_box_iou"] = found, box
        values = [result[f"{kind}_iou"] for kind in ("crops", "unseen") if f"{kind}_iou" in result]
        result[SELECTION] = float(np.mean(values)) if values else result["seen_iou"]
        return result

    def validation(self, limit: int | None = None) -> dict[str, list[tuple[Picture, ModelShape]]]:
        """Return what is validated on: pictures and the models they show, by kind."""
        crops: list[tuple[Picture, ModelShape]] = []
        if self.validation_crops is not None:
            crops = [
                (crop_picture(self.validation_crops, k), self.shapes[str(name)])
                for k, name in enumerate(self.validation_crops.model)
                if name in self.shapes
            ]
        unseen, seen = (
            [(self._render(self.shapes[name], 0, None), self.shapes[name]) for name in names]
            for names in (self.unseen, self.seen[:: max(1, len(self.seen) // 100)])
        )
        return {"crops": crops[:limit], "unseen": unseen[:limit], "seen": seen[:limit]}

    @torch.inference_mode()
    def codes(self, chosen: Sequence[tuple[Picture, ModelShape]]) -> Tensor:
        """Return the shape codes of pictures."""
        samples = [self._sampled(picture, shape, None, 8) for picture, shape in chosen]
        batch = collate_shapes(samples)
        parts = zip(*(batch[k].split(_BATCH) for k in ("crop", "category", "hints")), strict=True)
        return torch.cat([self.model(*part) for part in parts])

    @torch.inference_mode()
    def _overlaps(self, chosen: Sequence[tuple[Picture, ModelShape]]) -> tuple[float, float]:
        """Return the mean IoU of predictions, and of the box."""
        codes = self.codes(chosen)
        field = fast_field(self.model, self.model.elements(codes))
        found: list[float] = []
        box: list[float] = []
        for index, (_, shape) in enumerate(chosen):
            stored = torch.from_numpy(shape.uniform[:_CHECK_POINTS].astype(np.float32))
            canonical = stored[:, :3] / torch.from_numpy(shape.extent)
            truth, in_box = stored[:, 3] < 0, (canonical.abs() <= 0.5).all(-1)
            if self.network_config.frame == "box":
                inside = (field(index, canonical) < ISO_LEVEL) & in_box
            else:
                inside = field(index, stored[:, :3]) < ISO_LEVEL
            found.append(_iou(inside, truth))
            box.append(_iou(in_box, truth))
        return float(np.mean(found)), float(np.mean(box))

    @torch.inference_mode()
    def pictures(self, model: nn.Module) -> dict[str, UInt8[np.ndarray, "height width 3"]]:
        """Return crops, predicted meshes and true ones."""
        del model
        sheets: dict[str, UInt8[np.ndarray, "height width 3"]] = {}
        for kind, chosen in self.validation().items():
            shown = chosen[:: max(1, len(chosen) // _SHOWN)][:_SHOWN]
            if shown:
                meshes = extract_meshes(self.model, self.codes(shown), resolution=64)
                sheets[kind] = mesh_sheet(shown, meshes)
        return sheets

    def rate(self, parameter: str) -> float:
        """Return 0 for a backbone that is not trained."""
        frozen = self.views is not None and parameter.startswith("encoder.backbone.")
        return 0.0 if frozen else 1.0

    def config(self) -> dict[str, Any]:
        """Return what the network was built from."""
        return self.network_config.model_dump(mode="json")


def shape_task(recipe: TrainRecipe) -> Task:
    """Return the task of the shape stage."""
    return ShapeTask(recipe)


def _crops(folder: Path, split: str, panoramas: int | None = None) -> ObjectCrops | None:
    path = crops_file(folder, split, panoramas)
    if path.is_file():
        return read_object_crops(path)
    if panoramas is not None:
        raise TrainError(path, "found no such file, expected the crops that prepare: true makes")
    return None


def _iou(found: Tensor, truth: Tensor) -> float:
    union = (found | truth).sum()
    return float((found & truth).sum() / union) if union else 1.0
