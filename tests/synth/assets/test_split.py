"""Whole base models are held out, steadily, and credits name everybody."""

from collections import Counter
from dataclasses import dataclass

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from panoscene.synth.assets import attribution, known_models, split_models


@dataclass(frozen=True)
class Piece:
    base: str
    category: str
    id: str = ""
    licence: str = ""
    creator: str = ""
    source: str = ""


@settings(max_examples=50)
@given(
    st.lists(st.tuples(st.integers(0, 30), st.sampled_from("abcd")), max_size=60),
    st.integers(0, 5),
)
def test_split_depends_on_bases_alone(pairs: list[tuple[int, str]], seed: int) -> None:
    pieces = [Piece(f"m{k}", category) for k, category in pairs]
    split = split_models(pieces, seed)
    assert split == split_models(pieces[::-1] * 2, seed)
    assert set(split) == {piece.base for piece in pieces}
    members = {c: {p.base for p in pieces if p.category == c} for c in "abcd"}
    for bases in members.values():
        unseen = sum(split[base] == "unseen" for base in bases)
        if len(bases) >= 3:
            assert 2 * unseen <= len(bases)


def test_shares_in_simple_categories() -> None:
    pieces = [Piece(f"big{k}", "chair") for k in range(40)]
    pieces += [Piece(f"five{k}", "bed") for k in range(5)]
    pieces += [Piece(f"four{k}", "door") for k in range(4)] + [Piece("curtain", "")]
    split = split_models(pieces, seed=1)
    unseen = Counter(base.rstrip("0123456789") for base, part in split.items() if part == "unseen")
    assert unseen == {"big": 6, "five": 1}
    assert split != split_models(pieces, seed=2)
    assert set(split_models(pieces, 1, 0.0).values()) == {"seen"}
    assert split_models([], 0) == {}
    with pytest.raises(ValueError, match="unseen_share"):
        split_models(pieces, 1, 1.0)


def test_an_earlier_split_is_frozen() -> None:
    old = [Piece(f"m{k}", "chair") for k in range(20)]
    split = split_models(old, 0)
    more = [*old, *(Piece(f"n{k}", "chair") for k in range(40))]
    extended = split_models(more, 0, frozen=split)
    assert {base: extended[base] for base in split} == split
    assert sum(part == "unseen" for part in extended.values()) == 9


def test_the_known_models_are_split() -> None:
    specs = known_models()
    assert len(specs) == 500
    assert len({spec.id for spec in specs}) == 500
    ids = {spec.id for spec in specs}
    assert {spec.base for spec in specs} <= ids
    split = split_models(specs, 0)
    for category in {spec.category for spec in specs} - {""}:
        bases = {spec.base for spec in specs if spec.category == category}
        unseen = sum(split[base] == "unseen" for base in bases)
        assert unseen >= (len(bases) >= 5), category
        assert unseen <= 0.4 * len(bases), category


def test_attribution_names_everybody_once() -> None:
    pieces = [
        Piece("a", "chair", "x/1", "CC-BY-3.0", "Ann  Lee", "Lib.sh3f: Red chair"),
        Piece("a", "chair", "x/1", "CC-BY-3.0", "Ann Lee", "Lib.sh3f: Red chair"),
        Piece("b", "chair", "x/2", "CC-BY-3.0", "Bob", "Lib.sh3f: Sofa"),
        Piece("c", "chair", "x/3", "CC0-1.0", "", ""),
        Piece("d", "chair", "parametric/1", "", "", "parametric"),
    ]
    text = attribution(pieces)
    assert text.count("Ann Lee") == 1
    assert text.count("Lib.sh3f, Red chair") == 1
    assert "https://creativecommons.org/licenses/by/3.0/" in text
    assert "unknown\n    - x/3" in text
    assert "parametric" not in text
    assert "No model in use" in attribution([])
