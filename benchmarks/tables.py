"""Writes the measured numbers of benchmarks/*.json into README.md and docs/.

    panoscene bench arrange --json > benchmarks/arrange.json
    panoscene experiment arrange --json > benchmarks/experiment.json
    panoscene experiment safety --json > benchmarks/safety.json
    panoscene bench score --json > benchmarks/score.json
    python benchmarks/tables.py

With --check it writes nothing and exits 1 when a table is stale.
"""

import json
import re
import sys
from pathlib import Path

from panoscene.eval import (
    benchmark_table,
    experiment_table,
    safety_table,
    score_benchmark_table,
)
from panoscene.scene import CATEGORIES, MEAN_SIZE

ROOT = Path(__file__).resolve().parent.parent
PAGES = ("README.md", "docs/arrange.md", "docs/eval.md", "docs/scene.md")


def tables() -> dict[str, str]:
    """Return the text between the markers, by the markers' name."""
    measured = {
        name: json.loads((ROOT / "benchmarks" / f"{name}.json").read_text())
        for name in ("arrange", "experiment", "safety", "score")
    }
    machine = measured["arrange"]["machine"]
    rooms = measured["experiment"]
    scoring = measured["score"]["machine"]
    return {
        "benchmark": benchmark_table(measured["arrange"])
        + f"\n\nMedians on {machine['processor']}, {machine['cores']} cores.",
        "experiment": experiment_table(measured["experiment"])
        + f"\n\n{rooms['scenes']} rooms, {rooms['objects']} objects.",
        "experiment-short": experiment_table(
            {"rows": [row for row in rooms["rows"] if "without" not in row["method"]]}
        ),
        "categories": categories_table(),
        "score": score_benchmark_table(measured["score"])
        + f"\n\nOn {scoring['processor']}, {scoring['cores']} cores.",
        "safety": safety_table(measured["safety"]) + " (`panoscene experiment safety`)",
    }


def categories_table() -> str:
    """Return the names of the categories and their mean sizes, three to a line."""
    cells = [
        f"`{name}` {' x '.join(f'{extent:.2f}' for extent in size)}"
        for name, size in zip(CATEGORIES, MEAN_SIZE.tolist(), strict=True)
    ]
    rows = [cells[first : first + 3] for first in range(0, len(cells), 3)]
    head = "| category, mean width x depth x height in metres | | |\n| --- | --- | --- |\n"
    return head + "\n".join("| " + " | ".join(row) + " |" for row in rows)


def main() -> int:
    """Update or check the pages."""
    check = "--check" in sys.argv
    stale = []
    for page in PAGES:
        path = ROOT / page
        text = old = path.read_text()
        for name, table in tables().items():
            pattern = rf"(<!-- {name}:begin -->).*?(<!-- {name}:end -->)"
            text = re.sub(pattern, lambda m, t=table: f"{m[1]}\n{t}\n{m[2]}", text, flags=re.DOTALL)
        if text != old:
            stale.append(page)
            if not check:
                path.write_text(text)
    if stale:
        print(("stale: " if check else "updated: ") + ", ".join(stale))
    return int(check and bool(stale))


if __name__ == "__main__":
    sys.exit(main())
