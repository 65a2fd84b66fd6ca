"""The one look of all pictures: colours, type sizes, line widths. Lengths in pixels."""

from types import MappingProxyType

FONT = "DejaVu Sans"
"""Comes with matplotlib, so pictures are the same on every machine."""

TITLE, BODY, LABEL, SMALL = 22.0, 16.0, 14.5, 14.0
"""Type sizes: titles, legend and captions, names and numbers in the plan, dimensions."""

INK = "#22272e"
"""Text, outlines and fronts."""
FAINT_INK = "#5c6570"
"""Captions and dimensions."""
PAPER = "#ffffff"
FLOOR = "#f6f4ef"
WALL = "#4b525c"
LEADER = "#5c6570"
ALARM = "#d0021b"
"""Collisions and parts outside the room; always with hatching, never by colour alone."""
CONTACT = "#ffffff"
REFERENCE = "#6b7280"
"""Outlines of where the objects truly are."""

WALL_THICKNESS = 0.12
"""Metres."""
MOST_WALL = 15.0
"""Pixels."""
THIN, OUTLINE, FRONT, HEAVY = 1.0, 1.4, 3.4, 2.6
CONTACT_WIDTH, CONTACT_RIM = 3.8, 1.4
MARGIN = 24.0
OPAQUE, SEE_THROUGH = 0.88, 0.45
"""Of fills; overhead pieces and carpets are see-through."""
OVERHEAD = 1.3
"""Metres above the floor from which a piece hangs overhead: dashed and see-through."""

GROUPS = MappingProxyType(
    {
        "seating": ("bench", "chair", "office_chair", "sofa", "sofa_chair", "stool"),
        "beds": ("bed", "crib", "cushion"),
        "tables": ("coffee_table", "console_table", "counter", "pool_table", "table"),
        "storage": (
            "basket", "bottom_cabinet", "bottom_cabinet_no_top", "chest", "shelf", "top_cabinet",
            "trash_can",
        ),
        "kitchen and laundry": (
            "coffee_machine", "cooktop", "dishwasher", "dryer", "fridge", "microwave", "oven",
            "range_hood", "stove", "washer",
        ),
        "bathroom": ("bathtub", "shower", "sink", "toilet", "towel_rack"),
        "lamps and decoration": (
            "carpet", "floor_lamp", "grandfather_clock", "mirror", "picture", "plant",
            "table_lamp", "wall_clock",
        ),
        "devices and leisure": (
            "guitar", "heater", "laptop", "loudspeaker", "monitor", "piano", "speaker_system",
            "standing_tv", "treadmill", "wall_mounted_tv",
        ),
        "doors and windows": ("door", "fence", "window"),
    }
)  # fmt: skip
"""The groups that share a colour, and the categories in them."""

GROUP_COLOURS = MappingProxyType(
    {
        "seating": "#77aadd",
        "beds": "#ffaabb",
        "tables": "#eedd88",
        "storage": "#44bb99",
        "kitchen and laundry": "#bbcc33",
        "bathroom": "#99ddff",
        "lamps and decoration": "#ee8866",
        "devices and leisure": "#9a8aad",
        "doors and windows": "#758587",
    }
)
"""Fills that carry dark text and stay apart for colour-blind readers, which a test simulates.

Seven are from Paul Tol's light scheme; mauve and grey are chosen to stay apart from them and from
floor and walls.
"""

NO_FRONT = ("carpet", *GROUPS["doors and windows"])
"""Categories whose fronts say nothing."""

_GROUP = {category: group for group, members in GROUPS.items() for category in members}


def group_of(category: str) -> str:
    """Return the group whose colour a category wears.

    Examples:
        >>> group_of("sofa")
        'seating'
    """
    return _GROUP[category]


def label_fill(colour: str) -> str:
    """Return a colour, with as much paper mixed in as dark text on it needs to be read.

    Text in ``INK`` on it has the contrast 4.5 that WCAG asks for at level AA.

    Examples:
        >>> label_fill("#eedd88"), label_fill("#303030") > "#303030"
        ('#eedd88', True)
    """
    ink, paper, fill = (_channels(code) for code in (INK, PAPER, colour))
    mixed = fill
    for step in range(21):
        mixed = [round(f + (p - f) * step / 20) for f, p in zip(fill, paper, strict=True)]
        if (_luminance(mixed) + 0.05) / (_luminance(ink) + 0.05) >= _READABLE:
            break
    return "#" + "".join(f"{value:02x}" for value in mixed)


_READABLE = 4.6


def _channels(code: str) -> list[int]:
    return [int(code[k : k + 2], 16) for k in (1, 3, 5)]


def _luminance(channels: list[int]) -> float:
    """Return the relative luminance of an sRGB colour."""
    shares = [value / 255 for value in channels]
    red, green, blue = (v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in shares)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def words(category: str) -> str:
    """Return a category as it is written in pictures.

    Examples:
        >>> words("coffee_table")
        'coffee table'
    """
    return "cabinet, no top" if category == "bottom_cabinet_no_top" else category.replace("_", " ")
