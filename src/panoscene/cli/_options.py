"""Options that several commands share, with what help calls their values."""

from pathlib import Path
from typing import Annotated, Literal

from tyro.conf import Positional, arg

# no "(default: None)": what happens without the option is part of its description
Output = Annotated[Path, arg(aliases=("-o",), metavar="OUT")]
OptionalOutput = Annotated[Path | None, arg(aliases=("-o",), metavar="OUT", help_behavior_hint="")]
OptionalFile = Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")]
SceneFile = Annotated[Positional[Path], arg(metavar="SCENE")]
Count = Annotated[int, arg(metavar="N")]
OptionalCount = Annotated[int | None, arg(metavar="N", help_behavior_hint="")]
Number = Annotated[float, arg(metavar="X")]
OptionalNumber = Annotated[float | None, arg(metavar="X", help_behavior_hint="")]
Flag = Annotated[bool, arg(help_behavior_hint="")]
Trial = Annotated[Positional[Literal["arrange", "safety"]], arg(metavar="{arrange,safety}")]
Subject = Annotated[Positional[Literal["arrange"]], arg(metavar="{arrange}")]
