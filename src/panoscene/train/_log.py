"""The log of a training: lines of JSON, a table, TensorBoard, pictures."""

import csv
import io
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from panoscene.scene import write_atomically

LINES, TABLE, PICTURES = "metrics.jsonl", "metrics.csv", "pictures"
_KINDS = ("train", "validation")


class RunLog:
    """What a training writes about itself into its folder.

    metrics.jsonl has a line for every step and every validation; metrics.csv a row for every
    validation and for every few steps, with the mean of the losses since the row before.

    Args:
        folder: Of the run.
        step: Steps that are done: what was logged after them is dropped, for it will come again.
        every: Steps between two rows of the table.
    """

    def __init__(self, folder: Path, step: int, every: int) -> None:
        from torch.utils.tensorboard.writer import SummaryWriter  # noqa: PLC0415

        self._folder, self._every = folder, every
        self._rows: list[dict[str, Any]] = []
        self._open: list[dict[str, Any]] = []
        kept = [record for record in _records(folder / LINES) if record["step"] <= step]
        text = "".join(json.dumps(record) + "\n" for record in kept)
        write_atomically(folder / LINES, text)
        for record in kept:
            self._tabulate(record)
        self._lines = (folder / LINES).open("a", encoding="utf-8")
        self._board = SummaryWriter(str(folder / "tensorboard"), purge_step=step + 1)

    def record(self, kind: str, step: int, values: Mapping[str, float]) -> None:
        """Log the values of a step (``train``) or of a validation (``validation``)."""
        finite = {name: value if math.isfinite(value) else None for name, value in values.items()}
        record = {"kind": kind, "step": step, **finite}
        self._lines.write(json.dumps(record) + "\n")
        self._tabulate(record)
        if kind == "validation" or step % self._every == 0:
            for name, value in finite.items():
                if value is None:
                    continue
                self._board.add_scalar(f"{kind}/{name}", value, step)

    def pictures(self, step: int, pictures: Mapping[str, UInt8[np.ndarray, "_ _ 3"]]) -> None:
        """Write pictures as pictures/STEP-NAME.png."""
        folder = self._folder / PICTURES
        folder.mkdir(exist_ok=True)
        for name, pixels in pictures.items():
            stream = io.BytesIO()
            Image.fromarray(pixels).save(stream, "PNG")
            write_atomically(folder / f"{step:07d}-{name}.png", stream.getvalue())
            self._board.add_image(name, pixels, step, dataformats="HWC")

    def save(self) -> None:
        """Bring the files up to date."""
        self._lines.flush()
        rows = sorted(self._rows, key=lambda row: row["kind"] != "train")
        columns = list(dict.fromkeys(name for row in rows for name in row))
        stream = io.StringIO()
        writer = csv.DictWriter(stream, columns, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows(self._rows)
        write_atomically(self._folder / TABLE, stream.getvalue())
        self._board.flush()

    def close(self) -> None:
        """Bring the files up to date and close them."""
        self.save()
        self._lines.close()
        self._board.close()

    def _tabulate(self, record: dict[str, Any]) -> None:
        if record["kind"] == "validation":
            self._rows.append(record)
            return
        self._open.append(record)
        if record["step"] % self._every == 0:
            names = dict.fromkeys(name for entry in self._open for name in entry)
            means = {
                name: float(np.mean([entry[name] for entry in self._open if name in entry]))
                for name in names
                if name not in {"kind", "step"}
            }
            self._rows.append({"kind": "train", "step": record["step"], **means})
            self._open.clear()


def _records(path: Path) -> list[dict[str, Any]]:
    """Return the whole lines of a log, without one that was being written when it stopped."""
    if not path.is_file():
        return []
    records = []
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            record = json.loads(line)
        except json.JSONDecodeError:
            continue
        if isinstance(record, dict) and record.get("kind") in _KINDS:
            records.append(record)
    return records
