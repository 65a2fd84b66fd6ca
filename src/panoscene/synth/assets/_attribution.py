"""Who made the models, said where their pictures go."""

from collections import defaultdict
from collections.abc import Iterable
from typing import Protocol, runtime_checkable

_LICENCES = {
    "CC-BY-3.0-US": "https://creativecommons.org/licenses/by/3.0/us/",
    "CC-BY-3.0": "https://creativecommons.org/licenses/by/3.0/",
    "CC0-1.0": "https://creativecommons.org/publicdomain/zero/1.0/",
    "GNU GPL / CC-BY-3.0": "https://creativecommons.org/licenses/by/3.0/",
}
_HEAD = """\
Attribution
===========

The pictures and meshes here show furniture models made by the people below. Their licences ask
that the makers are named wherever the models are shown. The models were rescaled, simplified, cut
into parts, recoloured and placed in rooms; the makers did not take part in that.
"""


@runtime_checkable
class Credited(Protocol):
    """What has to be said of a model."""

    @property
    def id(self) -> str:
        """Its unique name."""
        ...

    @property
    def licence(self) -> str:
        """Under which it may be used."""
        ...

    @property
    def creator(self) -> str:
        """Who made it."""
        ...

    @property
    def source(self) -> str:
        """Where it is from."""
        ...


def attribution(models: Iterable[Credited]) -> str:
    """Return the text of an ATTRIBUTION file: every model by licence, library and creator.

    Models without licence and creator, such as generated ones, need no mention and get none.

    Args:
        models: The ones in use; the same one may come twice.
    """
    groups: dict[str, dict[str, set[str]]] = defaultdict(lambda: defaultdict(set))
    for model in models:
        if model.licence or model.creator:
            maker = " ".join(model.creator.split()) or "unknown"
            title = model.source.replace(": ", ", ", 1) or model.id
            groups[model.licence or "licence not stated"][maker].add(title)
    if not groups:
        return _HEAD + "\nNo model in use has to be credited.\n"
    lines = [_HEAD]
    for licence in sorted(groups):
        link = f" ({_LICENCES[licence]})" if licence in _LICENCES else ""
        lines += [f"{licence}{link}", "-" * len(licence), ""]
        for maker in sorted(groups[licence], key=str.lower):
            lines.append(f"- {maker}")
            lines += [f"    - {title}" for title in sorted(groups[licence][maker])]
        lines.append("")
    return "\n".join(lines)
