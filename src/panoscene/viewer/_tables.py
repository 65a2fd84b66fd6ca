"""What the panels say, as Markdown."""

from collections.abc import Callable, Sequence

import torch

from panoscene.arrange import Certificate, Violations
from panoscene.geometry import wall_boxes, wrap_angle
from panoscene.scene import Relations, Scene

from ._editor import Editor
from ._measurement import SHOWN_FROM, Measurement

MOST_ROWS = 6
"""Collisions and excursions that are listed."""

Row = tuple[str, Callable[[Violations], float], str]

ROWS: tuple[Row, ...] = (
    ("Colliding pairs", lambda v: v.colliding_pairs, ".0f"),
    ("Worst overlap, cm", lambda v: 100 * v.worst_penetration, ".1f"),
    ("Worst out of room, cm", lambda v: 100 * v.worst_out_of_room, ".1f"),
    ("Volume outside, litres", lambda v: 1000 * v.out_of_room_volume, ".1f"),
)
"""What the tables show of violations."""
ENERGY: Row = ("Energy", lambda v: v.energy, ".2f")
"""Only means something before and after a solve: it depends on where boxes were seen."""


def plain(text: str) -> str:
    """Return text that Markdown and HTML show as it is.

    Examples:
        >>> plain("a_b")
        'a&#95;b'
    """
    return "".join(c if c.isalnum() or c in " -.,:" else f"&#{ord(c)};" for c in text)


def violations_table(
    before: Violations, after: Violations, titles: tuple[str, str], rows: Sequence[Row] = ROWS
) -> str:
    """Return a table of two states side by side."""
    lines = [f"| | {titles[0]} | {titles[1]} |", "| :-- | --: | --: |"]
    for title, value, form in rows:
        # adding zero turns what rounds to -0.0 into 0.0
        old, new = (f"{round(value(v), 6) + 0.0:{form}}" for v in (before, after))
        lines.append(f"| {title} | {old} | **{new}** |")
    return "\n".join(lines)


def trouble_list(scene: Scene, found: Measurement) -> str:
    """Return what overlaps and what reaches out of the room, the worst first."""
    names = scene.objects.id
    rows = [
        (o.depth, f"{plain(names[o.first])} and {plain(names[o.second])} overlap")
        for o in found.overlaps
    ]
    rows += [
        (depth, f"{plain(names[k])} is out of the room")
        for k, depth in enumerate(found.outside.tolist())
        if depth >= SHOWN_FROM
    ]
    if not rows:
        return "Nothing overlaps that should not, and nothing is out of the room."
    rows.sort(key=lambda row: -row[0])
    lines = [f"- {words}: {100 * depth:.0f} cm" for depth, words in rows[:MOST_ROWS]]
    if len(rows) > MOST_ROWS:
        lines.append(f"- and {len(rows) - MOST_ROWS} more")
    return "\n".join(lines)


def certificate_text(certificate: Certificate) -> str:
    """Return what a solve is worth."""
    before, after, rows = certificate.before, certificate.after, (*ROWS, ENERGY)
    table = violations_table(before, after, ("Before", "After"), rows)
    words = f"{certificate.outcome.capitalize()}, preset {certificate.preset}"
    words += f", {certificate.steps} steps."
    words += f" Sizes changed by at most {100 * (certificate.largest_size_change - 1):.0f} %."
    if certificate.left_outside:
        words += f" Not meant to be in the room, left there: {certificate.left_outside}."
    return f"{table}\n\n{words}"


def relations_table(editor: Editor, name: str, found: Measurement) -> str:
    """Return what touches an object: which of it holds, and which of it is wanted."""
    holds = _contacts(editor, name, found.relations)
    wanted = _contacts(editor, name, editor.scene.relations)
    rows: list[str] = []
    for words, held in holds.items():
        meant = wanted[words]
        if held or meant:
            shown = words if held == meant else f"**{words}**"
            rows.append(f"| {shown} | {'yes' if held else 'no'} | {'yes' if meant else 'no'} |")
    if not rows:
        return "It touches nothing."
    return "\n".join(["| It | holds | wanted |", "| :-- | :-- | :-- |", *rows])


def turns_table(editor: Editor, name: str, found: Measurement) -> str:
    """Return how walls and other objects are turned as seen from one, and which are farther.

    Turns are in degrees counter-clockwise; a wall faces into the room.
    """
    index, layout = editor.index(name), editor.scene.layout
    yaw = editor.scene.objects.boxes.yaw
    wall_yaw = wall_boxes(layout.floor_polygon.to(yaw), 0.0, 1.0).yaw
    turn = torch.rad2deg(wrap_angle(torch.cat([wall_yaw, yaw]) - yaw[index])).tolist()
    walls = len(wall_yaw)
    lines = ["| Other | turned by | distance |", "| :-- | --: | :-- |"]
    lines += [f"| {wall} | {turn[k]:+.0f}° | |" for k, wall in enumerate(_walls(walls))]
    nearer = found.relations.farther_than[index].tolist()
    for k, other in enumerate(editor.names):
        if k != index:
            place = "nearer" if nearer[k] > 0.5 else "farther"
            lines.append(f"| {plain(other)} | {turn[walls + k]:+.0f}° | {place} |")
    return "\n".join(lines)


def _contacts(editor: Editor, name: str, relations: Relations | None) -> dict[str, bool]:
    """Return for everything an object may touch whether it does."""
    if relations is None:
        return {}
    index = editor.index(name)
    # either direction counts, as in relation_triples
    touching = torch.maximum(relations.touching[index], relations.touching[:, index]).tolist()
    found = {
        "is inside the room": float(relations.inside_room[index]),
        "stands on the floor": float(relations.on_floor[index]),
        "touches the ceiling": float(relations.under_ceiling[index]),
    }
    walls = relations.touching_wall[index].tolist()
    names = _walls(len(walls))
    found |= {f"touches {wall}": score for wall, score in zip(names, walls, strict=True)}
    found |= {
        f"touches {plain(other)}": score
        for k, (other, score) in enumerate(zip(editor.names, touching, strict=True))
        if k != index
    }
    return {words: score >= 0.5 for words, score in found.items()}


def _walls(count: int) -> list[str]:
    return [f"wall-{wall}" for wall in range(count)]
