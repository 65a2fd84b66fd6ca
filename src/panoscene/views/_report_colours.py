"""The report's colours, by day and by night, all mixed from the one style."""

from panoscene.style import (
    ALARM,
    FAINT_INK,
    FLOOR,
    GROUP_COLOURS,
    INK,
    PAPER,
    REFERENCE,
    WALL,
    group_of,
)

ACCENT = "#0b62c4"
"""What is selected or under the pointer; set apart from the groups by dark lines and rims too."""
NIGHT = "#14171b"


def mix(first: str, second: str, share: float) -> str:
    """Return a colour between two, with ``share`` of the second.

    Examples:
        >>> mix("#000000", "#ffffff", 0.2)
        '#333333'
    """
    pairs = [(int(first[k : k + 2], 16), int(second[k : k + 2], 16)) for k in (1, 3, 5)]
    return "#" + "".join(f"{round(a + share * (b - a)):02x}" for a, b in pairs)


def _palette(
    *, page: str, card: str, ink: str, faint: str, accent: str, alarm: str, dark: bool
) -> dict[str, str]:
    return {
        "page": page,
        "card": card,
        "ink": ink,
        "faint": faint,
        "accent": accent,
        "accent_photo": ACCENT,
        "on_accent": NIGHT if dark else PAPER,
        "alarm": alarm,
        "good": ink,
        "rule": mix(card, ink, 0.16),
        "head": mix(card, ink, 0.05),
        "hovered": mix(card, accent, 0.1),
        "chosen": mix(card, accent, 0.2),
        "pressed": mix(card, ink, 0.85),
        "on_pressed": card,
        "swatch_rim": mix(card, ink, 0.35),
        "stage": mix(card, ink, 0.05),
        "reference": mix(REFERENCE, PAPER, 0.4 if dark else 0.0),
        "floor": mix(card, PAPER, 0.12) if dark else FLOOR,
        "wall": mix(WALL, PAPER, 0.35) if dark else WALL,
        "line_2d": NIGHT if dark else INK,
        "line_3d": INK,
        "floor_3d": mix(FLOOR, WALL, 0.45 if dark else 0.04),
        "wall_3d": mix(FLOOR, WALL, 0.6 if dark else 0.08),
        "cap_3d": mix(WALL, PAPER, 0.25) if dark else WALL,
    }


PALETTES = {
    "light": _palette(
        page=FLOOR,
        card=PAPER,
        ink=INK,
        faint=FAINT_INK,
        accent=ACCENT,
        alarm=ALARM,
        dark=False,
    ),
    "dark": _palette(
        page=NIGHT,
        card=mix(NIGHT, PAPER, 0.06),
        ink=mix(NIGHT, PAPER, 0.9),
        faint=mix(NIGHT, PAPER, 0.62),
        accent=mix(ACCENT, PAPER, 0.5),
        alarm=mix(ALARM, PAPER, 0.45),
        dark=True,
    ),
}
"""Colours by name: ``light`` and ``dark``."""


def palette_style() -> str:
    """Return the palettes as custom properties of CSS, for both colour schemes."""
    light, dark = (
        "".join(f"--{name.replace('_', '-')}:{colour};" for name, colour in palette.items())
        for palette in PALETTES.values()
    )
    # paper is light
    return f":root{{{light}}}@media screen and (prefers-color-scheme:dark){{:root{{{dark}}}}}"


def category_colour(category: str) -> str:
    """Return the colour of a category's group.

    Examples:
        >>> category_colour("sofa")
        '#77aadd'
    """
    return GROUP_COLOURS[group_of(category)]
