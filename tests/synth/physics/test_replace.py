from dataclasses import replace

import numpy as np
import pytest

from panoscene.synth.physics import replace_models


@pytest.fixture(scope="module")
def library(models):
    def like(name, identifier, factors, **changes):
        size = tuple(float(a * f) for a, f in zip(models[name].size, factors, strict=True))
        return replace(models[name], id=identifier, size=size, **changes)

    others = [
        like("table", "table2", (1.1, 0.95, 0.9), support_height=0.675),
        like("table", "table3", (1.3, 1.0, 1.0)),
        like("table", "bare", (1.0, 1.0, 1.0), support_height=None),
        like("chair", "chair2", (0.9, 0.9, 1.1)),
        like("chair", "chair3", (1.0, 1.1, 1.05)),
        like("picture", "picture2", (1.1, 0.9, 1.0)),
        like("picture", "standing", (1.0, 1.0, 1.0), placement="on_top"),
    ]
    return models | {model.id: model for model in others}


@pytest.fixture(scope="module")
def home(put, home_of):
    return home_of(
        put("table", 2.5, 2.0, group=1), put("chair", 2.2, 1.55, group=1),
        put("chair", 2.8, 1.55, group=1), put("lamp", 2.5, 2.0, 0.75, support=0),
        put("picture", 2.5, 3.985, 1.2, yaw=np.pi), put("book", 2.1, 2.0, 0.75, support=0),
    )  # fmt: skip


@pytest.mark.parametrize("seed", range(5))
def test_boxes_stay_and_what_stands_on_them_follows(library, home, seed):
    new = replace_models(home, library, np.random.default_rng(seed), share=1.0)
    names = [piece.model for piece in new.placed]
    assert names[0] == "table2"  # table3 is too wide, nothing can stand on bare
    assert names[1] == names[2] != "chair"
    assert names[4] == "picture"  # or those that hang side by side would become the same
    assert names[3] == "lamp"  # there is no other
    assert names[5] == "book"  # decoration stays
    for old, piece in zip(home.placed, new.placed, strict=True):
        box = np.array(library[old.model].size) * old.scale
        np.testing.assert_allclose(np.array(library[piece.model].size) * piece.scale, box)
        assert np.abs(np.array(piece.scale) - 1).max() <= 0.15
        assert piece.position[:2] == old.position[:2]
    rise = 0.675 * new.placed[0].scale[2] - 0.75
    for index in (3, 5):
        assert new.placed[index].position[2] - home.placed[index].position[2] == pytest.approx(rise)


def test_share_and_seed(library, home):
    assert replace_models(home, library, np.random.default_rng(0), share=0.0) == home
    one, two = (replace_models(home, library, np.random.default_rng(4)) for _ in range(2))
    assert one.placed == two.placed


def test_errors_name_the_argument(library, home, models):
    with pytest.raises(ValueError, match=r"share: found 1\.5"):
        replace_models(home, library, np.random.default_rng(0), share=1.5)
    known = {name: model for name, model in models.items() if name != "lamp"}
    with pytest.raises(ValueError, match="nothing known of 'lamp'"):
        replace_models(home, known, np.random.default_rng(0))


@pytest.mark.parametrize("seed", range(5))
def test_a_kitchen_sink_is_not_replaced_by_a_basin(models, put, home_of, seed):
    def sink(identifier, depth):
        size = (0.7, depth, 0.95)
        return replace(models["table"], id=identifier, category="sink", size=size)

    kinds = {name: sink(name, d) for name, d in
             (("unit", 0.62), ("unit2", 0.64), ("basin", 0.58), ("basin2", 0.55))}  # fmt: skip
    library = models | kinds
    home = home_of(put("table", 1.0, 2.0), put("table", 3.0, 2.0))
    placed = tuple(replace(p, model=m) for p, m in zip(home.placed, ("unit", "basin"), strict=True))
    home = replace(home, placed=placed)
    new = replace_models(home, library, np.random.default_rng(seed), share=1.0)
    assert [piece.model for piece in new.placed] == ["unit2", "basin2"]
