"""The program: which commands there are, and how a run of one ends."""

import io
import logging
import os
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import tyro

from panoscene import __version__
from panoscene.cli import _synth_commands as synth
from panoscene.cli._commands import (
    arrange,
    bench,
    convert,
    demo,
    experiment,
    relations,
    schema,
)
from panoscene.cli._ending import ENDING
from panoscene.cli._errors import InputError
from panoscene.cli._eval_commands import export, report, score
from panoscene.cli._eval_commands import reconstruct as eval_reconstruct
from panoscene.cli._help import explain, summarised
from panoscene.cli._reconstruct_command import reconstruct
from panoscene.cli._terminal import complain
from panoscene.cli._train_commands import precompute, train
from panoscene.cli._view_commands import draw, view

COMMANDS: dict[str, Callable[..., int]] = {
    "demo": demo,
    "reconstruct": reconstruct,
    "arrange": arrange,
    "relations": relations,
    "convert": convert,
    "draw": draw,
    "view": view,
    "schema": schema,
    "bench": bench,
    "experiment": experiment,
    "train": train,
    "precompute": precompute,
    "eval export": export,
    "eval reconstruct": eval_reconstruct,
    "eval score": score,
    "eval report": report,
    "synth assets": synth.assets,
    "synth render": synth.render,
    "synth stats": synth.stats,
    "synth preview": synth.preview,
    "synth check": synth.check,
    "synth export": synth.export,
}
"""Every command by its name: a function of its options that returns the exit code."""

GROUPS: dict[str, str] = {
    "eval": """\
Write predictions, score them against the truth, and report the scores.

Predictions are written once, as scene.json, and scored from disk, so that anybody can score any
program that writes scene.json. For example:

    panoscene eval export -o runs/rooms --scenes 200
    panoscene eval score runs/rooms -o scores
    panoscene eval report scores -o scores.md
""",
    "synth": """\
Make data sets: furnished homes, path-traced panoramas, exact labels.

Needs pip install 'panoscene[synth]' and, on Linux, LLVM (apt-get install libllvm19). For example:

    panoscene synth assets
    panoscene synth render configs/synth/tiny.yaml tiny
    panoscene synth check tiny
    panoscene synth preview tiny -o tiny-preview
""",
}
"""What the commands of two words have in common, by their first word."""

OVERVIEW = """\
Turn 360-degree photos of rooms into 3D scenes: the room, its objects, and how they relate.
Describe, repair, draw and score such scenes, train the networks, and make data for them. Each
command explains itself, as in panoscene reconstruct --help; panoscene --version prints the version.
For example:

    panoscene reconstruct photo.jpg -o room
    panoscene arrange room.json -o repaired.json
"""

CONFIG = (tyro.conf.FlagCreatePairsOff,)
"""Of tyro: flags without a --no- form."""

USAGE, INTERRUPTED, BROKEN_PIPE = 2, 130, 141
"""Exit codes besides 0: wrong input; Ctrl-C and a reader that went away, as shells count them."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command that the arguments name and return the exit code.

    What is wrong with the user's input becomes one message on stderr and code 2. Errors of this
    program itself keep their traceback.

    Args:
        argv: arguments without the program's name; those of the process when None.

    Raises:
        SystemExit: help was asked for (code 0), or the arguments make no sense (code 2).
    """
    # threads of PyTorch that wait for work must not take it from the threads of this program
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    arguments = list(sys.argv[1:] if argv is None else argv)
    if isinstance(sys.stdout, io.TextIOWrapper):
        # a terminal that cannot show a character must not end the program
        sys.stdout.reconfigure(errors="backslashreplace")
    # remarks at its first use, about fonts and caches, mean nothing to who wants a picture
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    try:
        try:
            return _run(arguments)
        finally:
            # now, not when the interpreter ends, where nobody catches a full disk
            sys.stdout.flush()
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        _discard_output()
        return BROKEN_PIPE
    except OSError as error:
        _discard_output()
        reason = (error.strerror or str(error)).lower()
        complain(f"{error.filename}: {reason}" if error.filename else reason)
    except ValueError as error:
        if not _is_about_input(error):
            raise
        complain(str(error))
    return USAGE


def run() -> None:
    """Run the command that this process was started for; its exit code becomes the process's.

    When everything is written the process ends at once.
    """
    for name in ("stdout", "stderr"):
        # closed by whoever started the process
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115
    # that of an error, until it is known better
    ENDING.code = 1
    try:
        ENDING.code = main()
    except SystemExit as asked:
        ENDING.code = asked.code if isinstance(asked.code, int) else int(asked.code is not None)
        raise


def _run(arguments: list[str]) -> int:
    if arguments[:1] == ["--version"]:
        sys.stdout.write(f"panoscene {__version__}\n")
        return 0
    words = 2 if arguments and arguments[0] in GROUPS else 1
    name = " ".join(arguments[:words])
    if name in COMMANDS:
        command, arguments = COMMANDS[name], arguments[words:]
        explain(command.__doc__ or "", arguments)
        program = f"panoscene {name}"
        return tyro.cli(command, prog=program, description=" ", args=arguments, config=CONFIG)
    # help, or a complaint about the arguments: ends here
    group = arguments[0] if words > 1 else ""
    explain(GROUPS.get(group, OVERVIEW), arguments)
    return tyro.extras.subcommand_cli_from_dict(
        _overview(group),
        prog=f"panoscene {group}".rstrip(),
        args=arguments[words - 1 :],
        config=CONFIG,
    )


def _overview(group: str) -> dict[str, Callable[[], int]]:
    """Return what the commands of a group do in one line each; of all commands for no group."""
    if group:
        first = f"{group} "
        return {
            name.removeprefix(first): summarised(command.__doc__)
            for name, command in COMMANDS.items()
            if name.startswith(first)
        }
    return {
        name.split()[0]: summarised(GROUPS.get(name.split()[0], command.__doc__))
        for name, command in COMMANDS.items()
    }


def _is_about_input(error: ValueError) -> bool:
    """Return whether an error describes a file or an option rather than a fault in the code."""
    if isinstance(error, InputError):
        return True
    from panoscene.models import CheckpointError  # noqa: PLC0415
    from panoscene.scene import PanoramaError, SceneFormatError  # noqa: PLC0415
    from panoscene.synth.assets import AssetError  # noqa: PLC0415
    from panoscene.synth.dataset import DatasetError  # noqa: PLC0415
    from panoscene.train import TrainError  # noqa: PLC0415

    of_files = SceneFormatError | PanoramaError | AssetError | DatasetError
    return isinstance(error, of_files | CheckpointError | TrainError)


def _discard_output() -> None:
    """Send output that cannot be written nowhere, so that the interpreter does not try again."""
    try:
        sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
