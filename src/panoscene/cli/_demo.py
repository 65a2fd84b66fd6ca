"""The demonstration: run it and tell what came of it."""

from pathlib import Path

from panoscene.cli._errors import InputError
from panoscene.cli._folders import check_folder
from panoscene.cli._tables import say_before_after
from panoscene.cli._terminal import say, say_json
from panoscene.views import DemoResult, run_demo


def run_and_tell(output: Path, seed: int, *, as_json: bool) -> int:
    """Run the demonstration and return the exit code."""
    if seed < 0:
        raise InputError(f"--seed: found {seed}, expected 0 or more")
    check_folder(output)
    result = run_demo(output, seed)
    if as_json:
        say_json(result.as_dict())
    else:
        _tell(result)
    return 0


def _tell(result: DemoResult) -> None:
    say(f"A room with {result.objects} objects, disturbed with seed {result.seed} and repaired:")
    say_before_after(
        [
            ("mean IoU with the true boxes", result.mean_iou_before, result.mean_iou_after, ".3f"),
            (
                "colliding pairs",
                result.colliding_pairs_before,
                result.colliding_pairs_after,
                "d",
            ),
            (
                "worst penetration, cm",
                100 * result.worst_penetration_before,
                100 * result.worst_penetration_after,
                ".1f",
            ),
            (
                "volume out of the room, m³",
                result.out_of_room_volume_before,
                result.out_of_room_volume_after,
                ".3f",
            ),
        ]
    )
    for picture in (
        result.before_picture,
        result.after_picture,
        result.comparison,
        result.sheet,
    ):
        say(f"  {picture}")
    say(f"Open {result.report} in a browser to look around in the room.")
    say(f"The scenes and the certificate are next to them: {result.before.parent}/*.json")
