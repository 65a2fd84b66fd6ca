"""Small things on furniture and on the floor, chosen by what they are."""

import numpy as np

from ._putting import at_wall, free_standing, headroom, on_board, on_top
from ._space import Piece, Space

ON_SHELF = ("books", "books", "books", "small_box", "vase", "plant", "speaker_system")
ON_CHEST = ("vase", "candles", "books", "plant", "small_box", "table_lamp")
ON_DESK = ("books", "books", "books", "dishes", "plant", "speaker_system", "small_box")
ON_DINING_TABLE = ("dishes", "dishes", "dishes", "bottles", "vase", "candles", "plant", "laptop")
ON_COFFEE_TABLE = ("books", "books", "dishes", "candles", "vase", "plant", "laptop")
ON_WORKTOP = ("dishes", "dishes", "bottles", "bottles", "vase")
IN_BATHROOM = ("towels", "towels", "towels", "bottles", "plant", "basket", "small_box")
"""What things are put where; a kind that is named more often occurs more often."""
_LARGEST: dict[str, tuple[float, float, float]] = {
    "plant": (0.6, 0.5, 0.55), "basket": (0.45, 0.4, 0.4), "table_lamp": (0.45, 0.45, 0.65),
}  # fmt: skip
_ONCE = ("laptop", "table_lamp", "speaker_system", "loudspeaker", "coffee_machine", "basket")
_MOST_IN_SHELF = 12
_TURNED = ("laptop", "books", "dishes", "small_box", "candles", "vase", "bottles")


def things_on(space: Space, lead: Piece, most: float, *names: str) -> None:
    """Put things on a piece: about ``most`` at middle density.

    Args:
        space: the room.
        lead: what they stand on.
        most: mean number.
        names: categories and kinds of decoration to choose from; those that the library does not
            have are passed over.
    """
    known = [name for name in names if space.stock.models(name)]
    if lead.item.boards:
        _fill_boards(space, lead, known)
        return
    count = int(space.rng.poisson(most * 2.0 ** (2.0 * space.density - 1.0)))
    for _ in range(min(count, 5) if known else 0):
        name = known[int(space.rng.integers(len(known)))]
        if name in _ONCE and any(p.support is lead and p.category == name for p in space.pieces):
            continue
        largest = _LARGEST.get(name, (0.6, 0.5, 0.6))
        item = space.stock.take(
            name, width=(0.05, largest[0]), depth=(0.05, largest[1]),
            height=(0.01, min(largest[2], headroom(lead))),
        )  # fmt: skip
        straight = name not in _TURNED or lead.category in ("shelf", "console_table")
        turn = 0.0 if straight else space.rng.uniform(-0.3, 0.3)
        on_top(space, item, lead, back=0.55, spread=0.6, turn=turn)


def _fill_boards(space: Space, lead: Piece, names: list[str]) -> None:
    """Put things on the boards of a shelf: one or two on most of them."""
    boards = lead.item.boards
    count = int(space.rng.poisson(1.2 * len(boards) * 2.0 ** (1.4 * space.density - 0.7)))
    for _ in range(min(max(count, 2), _MOST_IN_SHELF) if names else 0):
        name = names[int(space.rng.integers(len(names)))]
        if name in _ONCE and any(p.support is lead and p.category == name for p in space.pieces):
            continue
        tallest = max(board.headroom for board in boards) - 0.01
        deepest = max(board.front - board.rear for board in boards)
        item = space.stock.take(
            name, width=(0.05, 0.6), depth=(0.05, max(deepest, 0.06)), height=(0.01, tallest)
        )
        on_board(space, item, lead)


def toys_on_floor(space: Space, lead: Piece | None = None) -> None:
    """Put toys on the floor: near a piece if there is one, at a wall, or anywhere."""
    count = int(space.rng.poisson(1.6 * 2.0 ** (2.0 * space.density - 1.0)))
    for _ in range(min(count, 4)):
        item = space.stock.take("toys")
        if item is None:
            return
        mark = space.mark()
        if lead is not None and space.rng.random() < 0.5:
            away = lead.size[1] / 2 + space.rng.uniform(0.3, 0.8, 8)
            right = space.rng.uniform(-0.7, 0.7, 8)
            centre = np.array(
                [
                    [*lead.place(x, y), item.size[2] / 2]
                    for x, y in zip(right.tolist(), away.tolist(), strict=True)
                ]
            )
            turn = space.rng.uniform(-np.pi, np.pi, 8)
            space.put(item, centre, turn, small=True)
        elif space.rng.random() < 0.5:
            at_wall(space, item, corner=0.3, gap=0.05, small=True)
        else:
            free_standing(space, item, turned=True)
        if not space.has_free_ways():
            space.rollback(mark)
