"""What is in a set, in numbers."""

from collections import Counter
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from panoscene.geometry import polygon_area
from panoscene.scene import CATEGORIES, Scene, relative_yaw_angle

from ._format import SPLITS, PanoramaLabels
from ._read import open_dataset

_SPREADS = (
    "room_area", "ceiling_height", "camera_height", "tilt_deg", "object_distance", "occlusion",
)  # fmt: skip
_OCCLUSION_EDGES = (0.0, 0.1, 0.25, 0.5, 0.75, 1.0)


def dataset_statistics(root: Path | str) -> dict[str, Any]:
    """Return the statistics of a rendered set; plain numbers, ready for JSON.

    ``categories`` counts the objects of scene.json in all panoramas, ``models`` the different CAD
    models among them, ``bases`` the models these were made from; ``corner_counts`` and
    ``room_area`` are of the cameras' rooms, a room counting once for each of its panoramas.
    ``relations`` are means for a panorama, or shares where the name says so;
    ``mesh_contact_share`` is the part of the touching pairs whose meshes are within 10 cm.

    Args:
        root: Folder of the set.

    Raises:
        DatasetError: A file of the set is missing or damaged.
    """
    dataset = open_dataset(root)
    tally = Tally()
    for item in dataset:
        tally.add(item.scene(), item.labels(), item.split)
    return {
        "panoramas": len(dataset),
        "planned": dataset.info.planned,
        "homes": len({item.home for item in dataset}),
        **tally.result(),
    }


class Tally:
    """Counts over panoramas, one after the other."""

    def __init__(self) -> None:
        self.categories: Counter[str] = Counter()
        self.splits: Counter[str] = Counter()
        self.homes: dict[str, set[str]] = {split: set() for split in SPLITS}
        self.corners: Counter[int] = Counter()
        self.kinds: Counter[str] = Counter()
        self.lights: Counter[str] = Counter()
        self.models: dict[str, set[str]] = {name: set() for name in CATEGORIES}
        self.bases: dict[str, set[str]] = {split: set() for split in SPLITS}
        self.lists: dict[str, list[float]] = {}
        self.relations: Counter[str] = Counter()
        self.pairs = Counter[str]()

    def add(self, scene: Scene, labels: PanoramaLabels, split: str) -> None:
        """Count a panorama."""
        layout = scene.layout
        self.splits[split] += 1
        self.homes[split].add(labels.home)
        self.corners[len(layout.floor_polygon)] += 1
        self.kinds[labels.camera.room_kind or "unknown"] += 1
        self.lights[str(labels.light.get("kind", "unknown"))] += 1
        kept = [label for label in labels.objects if label.in_scene]
        for label in kept:
            self.categories[label.category] += 1
            self.models[label.category].add(label.model)
            self.bases[split].add(label.base)
            self._note("occlusion", label.occlusion)
            self._note("object_distance", float(np.linalg.norm(_from_eye(label.box.centre, scene))))
        self._note("visible_objects", len(kept))
        self._note("left_out", len(labels.objects) - len(kept))
        self._note("room_area", float(polygon_area(layout.floor_polygon)))
        self._note("ceiling_height", layout.ceiling_height)
        self._note("camera_height", scene.panorama.camera_height)
        self._note("tilt_deg", float(np.degrees(np.arccos(
            np.clip(scene.panorama.upright_from_photo[2][2], -1.0, 1.0)))))  # fmt: skip
        self._add_relations(scene, labels)

    def _add_relations(self, scene: Scene, labels: PanoramaLabels) -> None:
        relations = scene.relations
        if relations is None:
            return
        n = len(scene.objects.category)
        self.relations["touching"] += int(relations.touching.sum()) // 2
        for name in ("touching_wall", "on_floor", "under_ceiling", "inside_room"):
            self.relations[name] += int(getattr(relations, name).sum())
        upper = np.triu_indices(n, 1)
        angle = relative_yaw_angle(relations.relative_yaw).numpy()[upper]
        self.pairs["all"] += len(angle)
        for degrees in np.degrees(angle).round().astype(int):
            self.pairs[f"{degrees}"] += 1
        self.pairs["contacts"] += len(labels.contacts)
        self.pairs["close"] += sum(contact.gap <= 0.1 for contact in labels.contacts)

    def _note(self, name: str, value: float | int) -> None:
        self.lists.setdefault(name, []).append(float(value))

    def result(self) -> dict[str, Any]:
        """Return the statistics of what was counted, as ``dataset_statistics`` has them."""
        total = max(sum(self.splits.values()), 1)
        objects = max(sum(self.categories.values()), 1)
        occlusion = np.array(self.lists.get("occlusion", []))
        counts, _ = np.histogram(occlusion, _OCCLUSION_EDGES)
        shares = counts / max(len(occlusion), 1)
        edges = pairwise(_OCCLUSION_EDGES)
        pairs = max(self.pairs["all"], 1)
        relations: dict[str, Any] = {
            name: round(self.relations[name] / total, 3)
            for name in ("touching", "touching_wall", "on_floor", "under_ceiling", "inside_room")
        }
        relations["on_floor_share"] = round(self.relations["on_floor"] / objects, 3)
        relations["inside_room_share"] = round(self.relations["inside_room"] / objects, 3)
        relations["relative_yaw_deg_share"] = {
            name: round(self.pairs[name] / pairs, 3)
            for name in ("-180", "-135", "-90", "-45", "0", "45", "90", "135")
        }
        relations["mesh_contact_share"] = round(
            self.pairs["close"] / max(self.pairs["contacts"], 1), 3
        )
        shown = self.bases["train"] | self.bases["val"] | self.bases["test-seen"]
        return {
            "objects": sum(self.categories.values()),
            "visible_objects_mean": _summary(self.lists.get("visible_objects", []))["mean"],
            "visible_objects": _summary(self.lists.get("visible_objects", [])),
            "left_out_mean": _summary(self.lists.get("left_out", []))["mean"],
            "categories": {name: self.categories[name] for name in CATEGORIES},
            "models": {name: len(self.models[name]) for name in CATEGORIES},
            "bases_only_in_test_unseen": len(self.bases["test-unseen"] - shown),
            "splits": {split: self.splits[split] for split in SPLITS},
            "homes_in_splits": {split: len(self.homes[split]) for split in SPLITS},
            "corner_counts": {str(k): self.corners[k] for k in sorted(self.corners)},
            "room_kinds": dict(sorted(self.kinds.items())),
            "lights": dict(sorted(self.lights.items())),
            **{name: _summary(self.lists.get(name, [])) for name in _SPREADS},
            "occlusion_shares": {
                f"{low:g} to {high:g}": round(float(share), 3)
                for (low, high), share in zip(edges, shares, strict=True)
            },
            "relations": relations,
        }


def _from_eye(centre: tuple[float, float, float], scene: Scene) -> np.ndarray:
    return np.array(centre) - (0.0, 0.0, scene.panorama.camera_height)


def _summary(values: list[float]) -> dict[str, float]:
    """Return mean, least, quartiles and most; zeros for nothing."""
    array = np.array(values if values else [0.0])
    least, lower, middle, upper, most = np.quantile(array, (0.0, 0.25, 0.5, 0.75, 1.0))
    named = (("mean", array.mean()), ("min", least), ("q25", lower), ("median", middle),
             ("q75", upper), ("max", most))  # fmt: skip
    return {name: round(float(value), 3) for name, value in named}
