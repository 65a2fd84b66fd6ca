"""The part of the page of results that says how long everything takes."""

from collections.abc import Mapping
from typing import Any

from panoscene.eval._published import PAPER_SECONDS, PAPER_TOTAL_SECONDS
from panoscene.eval._score_tables import markdown_table

_PARTS: tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...] = (
    ("photo made upright", ("upright_s",), ()),
    (
        "detector, layout, boxes and relations",
        ("detector_s", "layout_s", "pose_s", "codes_s", "context_s"),
        ("initial estimation", "RGCN"),
    ),
    ("arrangement", ("arrangement_s",), ("RO",)),
    ("shapes, as meshes", ("shape_s",), ("LIEN+LDIF",)),
)
"""Each with its keys in ``panoscene bench pipeline`` and its names in the paper's table."""


def seconds_part(measured: Mapping[str, Any] | None) -> list[str]:
    """Return the paragraphs on speed; none when it was not measured.

    Args:
        measured: what ``panoscene bench pipeline --json`` printed.

    Raises:
        ValueError: it is something else.
    """
    if measured is None:
        return []
    missing = [key for key in ("total_s", "cold_start_s", "peak_rss_mib") if key not in measured]
    if missing:
        expected = "what panoscene bench pipeline --json prints"
        raise ValueError(f"timings: found no {', '.join(missing)}, expected {expected}")
    rows: list[list[str]] = []
    for name, keys, published in _PARTS:
        found = [measured[key] for key in keys if key in measured]
        if found:
            paper = sum(PAPER_SECONDS[key] for key in published)
            rows.append([name, f"{sum(found):.2f}", f"{paper:.2f}" if published else "-"])
    whole = PAPER_TOTAL_SECONDS["Ours"]
    rows.append(["everything, weights loaded", f"{measured['total_s']:.2f}", f"{whole:.2f}"])
    cold = f"{measured['cold_start_s']:.2f}"
    rows.append(["the command, from its start to its report", cold, "-"])
    machine = measured["machine"]
    return [
        "## Time",
        f"Seconds for one panorama of 1024 x 512 with {measured['objects']} objects, on "
        f"{machine['processor']}, {machine['cores']} cores, without a GPU (`panoscene bench "
        "pipeline`). The paper's are for scenes of its own, on a GTX 1080 Ti. Peak memory: "
        f"{measured['peak_rss_mib']:.0f} MiB.",
        markdown_table(["part", "here", "paper"], rows),
    ]
