"""Score predictions: two folders of scene.json become numbers with intervals.

Usage: python examples/05_score_predictions.py [FOLDER]
"""

import sys
from pathlib import Path

from panoscene.eval import METHODS, export_predictions, sample_targets, score_folder, summary_table

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".") / "runs"

# True rooms, and what simulated networks say of them. With networks of your own, write what they
# predict with write_scene, under the file name of the true room, and start below.
methods = {name: METHODS[name] for name in ("estimates", "default", "mean-box")}
export_predictions(folder, sample_targets(4, seed=3), methods=methods)

scores = [
    score_folder(folder / "predictions" / name, folder / "targets", kind=method.kind, replicates=20)
    for name, method in methods.items()
]
print(summary_table(scores))

# Every number has a name; the intervals come from resampling the scenes.
for score in scores:
    found = score.metrics["detection.ap_15_mean_57"]
    print(
        f"{score.method}: AP {found.value:.3f}, 95 % interval {found.low:.3f} to {found.high:.3f}"
    )
