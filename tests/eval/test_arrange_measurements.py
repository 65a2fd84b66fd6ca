"""The experiment, the benchmark and the safety trial, small."""

import dataclasses
import math

import pytest
import torch

from panoscene.arrange import PRESETS, arrange
from panoscene.eval import _arrange_benchmark as benchmark
from panoscene.eval import (
    benchmark_table,
    broken_promises,
    experiment_table,
    machine_facts,
    run_arrange_experiment,
    run_arrange_safety,
    safety_table,
)


@pytest.fixture(scope="module")
def experiment() -> dict[str, object]:
    return run_arrange_experiment(scenes=6, seed=3, presets=("released", "default"))


def row(experiment: dict[str, object], method: str, relations: str) -> dict[str, float]:
    rows = experiment["rows"]
    assert isinstance(rows, list)
    (found,) = [r for r in rows if (r["method"], r["relations"]) == (method, relations)]
    return found


def test_experiment_has_every_method_and_ablation(experiment: dict[str, object]):
    rows = experiment["rows"]
    assert isinstance(rows, list)
    methods = {r["method"] for r in rows}
    assert methods == {
        *("before", "released", "default"),
        *("default without E^c", "default without E^r", "default without E^o"),
    }
    assert len(rows) == 1 + 2 * 5


def test_default_is_better_than_before_and_ablations_hurt(experiment: dict[str, object]):
    before, default = row(experiment, "before", "-"), row(experiment, "default", "true")
    assert default["iou"] > before["iou"] + 0.2
    assert default["colliding_pairs"] == 0 < before["colliding_pairs"]
    assert default["yaw_error_deg"] < 0.5 * before["yaw_error_deg"]
    for part in ("E^c", "E^r", "E^o"):
        assert row(experiment, f"default without {part}", "true")["iou"] < default["iou"]
    assert row(experiment, "default without E^c", "true")["out_of_room_m3"] > 0.1


def test_experiment_repeats_itself(experiment: dict[str, object]):
    again = run_arrange_experiment(scenes=6, seed=3, presets=("released",))
    assert row(again, "released", "true") == row(experiment, "released", "true")


def test_experiment_table_has_a_line_for_each_row(experiment: dict[str, object]):
    rows = experiment["rows"]
    assert isinstance(rows, list)
    lines = experiment_table(experiment).splitlines()
    assert len(lines) == 2 + len(rows)
    assert lines[0].startswith("| method | relations | iou |")


def test_experiment_table_refuses_nothing():
    with pytest.raises(ValueError, match="no rows"):
        experiment_table({"rows": []})


def test_time_to_quality_is_reached():
    room = benchmark._room(8, 0)
    milliseconds, share = benchmark._time_to_quality([room], PRESETS["paper"], 1)
    assert share == 1
    assert 0 < milliseconds < 60_000


def test_time_to_quality_tells_when_it_is_not_reached():
    never = PRESETS["paper"].model_copy(
        update={
            "weights": PRESETS["paper"].weights.model_copy(
                update=dict.fromkeys(type(PRESETS["paper"].weights).model_fields, 0.0)
            )
        }
    )
    milliseconds, share = benchmark._time_to_quality([benchmark._room(3, 0)], never, 1)
    assert share == 0
    assert math.isinf(milliseconds)


def test_benchmark_table_names_what_was_measured():
    table = benchmark_table({"scene_20_ms": 12.3456, "growth_s": {"10": 0.5}, "machine": {}})
    assert "one scene of 20 objects, 100 steps, ms | 12.3 |" in table
    assert "10: 0.50" in table


@pytest.mark.usefixtures("unchecked")
def test_safety_counts_and_words():
    result = run_arrange_safety(scenes=12, seed=4)
    assert result["worse"] == 0
    outcomes = result["outcomes"]
    assert isinstance(outcomes, dict)
    assert sum(outcomes.values()) == 12
    assert safety_table(result).startswith("Of 12 scenes without any sense, 0 came out worse")


def test_a_worse_result_is_a_broken_promise():
    """The judge must be able to find against the optimiser."""
    noisy = benchmark._room(6, 1)
    repaired = arrange(noisy).scene
    assert broken_promises(noisy, repaired) == []
    away = dataclasses.replace(
        noisy.objects.boxes, centre=noisy.objects.boxes.centre + torch.tensor([9.0, 0, 0])
    )
    worse = dataclasses.replace(noisy, objects=dataclasses.replace(noisy.objects, boxes=away))
    assert {"energy", "outside", "volume"} <= set(broken_promises(noisy, worse))
    lost = dataclasses.replace(away, centre=away.centre * math.nan)
    worst = dataclasses.replace(noisy, objects=dataclasses.replace(noisy.objects, boxes=lost))
    assert broken_promises(noisy, worst) == ["not finite"]


def test_machine_facts_name_the_machine():
    facts = machine_facts()
    assert facts["processor"]
    assert int(facts["cores"]) >= 1
