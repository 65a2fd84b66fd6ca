"""Options that several commands share, with what help calls their values."""

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal

from tyro.conf import Positional, arg
from tyro.constructors import PrimitiveConstructorSpec


def _number(kind: Callable[[str], Any], metavar: str, expected: str) -> PrimitiveConstructorSpec:
    """Return how tyro reads a number; its own errors list types of Python."""

    def read(words: list[str]) -> Any:
        try:
            return kind(words[0])
        except ValueError:
            raise ValueError(f"found {words[0]!r}, expected {expected}") from None

    return PrimitiveConstructorSpec(
        nargs=1,
        metavar=metavar,
        instance_from_str=read,
        is_instance=lambda value: value is None or isinstance(value, int | float),
        str_from_instance=lambda value: [str(value)],
    )


_WHOLE = _number(int, "N", "a whole number")
_REAL = _number(float, "X", "a number")


def _named(word: str) -> Path:
    # an empty name, as of a variable of the shell that is not set, would be the current folder
    if not word:
        raise ValueError("found an empty name, expected that of a file or a folder")
    return Path(word)


_PLACE = PrimitiveConstructorSpec(
    nargs=1,
    metavar="OUT",
    instance_from_str=lambda words: _named(words[0]),
    is_instance=lambda value: value is None or isinstance(value, Path),
    str_from_instance=lambda value: [str(value)],
)

# no "(default: None)": what happens without the option is part of its description
Output = Annotated[Path, arg(aliases=("-o",), metavar="OUT"), _PLACE]
OptionalOutput = Annotated[
    Path | None, arg(aliases=("-o",), metavar="OUT", help_behavior_hint=""), _PLACE
]
OptionalFile = Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")]
OptionalFolder = Annotated[Path | None, arg(metavar="FOLDER", help_behavior_hint="")]
SceneFile = Annotated[Positional[Path], arg(metavar="SCENE")]
Count = Annotated[int, arg(metavar="N"), _WHOLE]
OptionalCount = Annotated[int | None, arg(metavar="N", help_behavior_hint=""), _WHOLE]
Number = Annotated[float, arg(metavar="X"), _REAL]
OptionalNumber = Annotated[float | None, arg(metavar="X", help_behavior_hint=""), _REAL]
Flag = Annotated[bool, arg(help_behavior_hint="")]
Trial = Annotated[Positional[Literal["arrange", "safety"]], arg(metavar="{arrange,safety}")]
Subject = Annotated[
    Positional[Literal["arrange", "score", "synth", "stages", "pipeline"]],
    arg(metavar="{arrange,score,synth,stages,pipeline}"),
]
Cache = Annotated[Path | None, arg(metavar="FOLDER", help_behavior_hint="")]
