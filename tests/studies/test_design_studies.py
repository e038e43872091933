"""Studies of designs: each, made small, against designs that are scored one by one."""

import json
from itertools import product

import numpy as np
import pytest

from supple.model.motion import respond
from supple.model.robot import PRESETS, Robot
from supple.optimize.sweep import score_designs
from supple.studies import advice, catalogue, golfers, sleeve_and_wrist
from supple.studies.designs import PRESET, listed, percent, struck_task
from supple.studies.study import Call, studies

NAMES = ("advice", "catalogue", "golfers", "sleeve_and_wrist")
CALL = Call()


def test_they_are_studies_of_the_house():
    known = studies()
    assert set(NAMES) <= set(known)
    assert all(known[name].question.endswith("?") for name in NAMES)


def test_words():
    assert listed(["a"]) == "a" and listed(["a", "b", "c"]) == "a, b and c" and listed([]) == ""
    assert percent(0.01234) == "1.23" and percent(1e-7) == "0"


@pytest.fixture(scope="module")
def bought(tmp_path_factory):
    folder = tmp_path_factory.mktemp("catalogue")
    parts = catalogue.parts_of(3)
    found = catalogue.searched(3, folder, seed=1)
    return parts, found


def test_the_search_finds_the_best_pair_of_a_list(bought):
    """Every pair of the list, scored."""
    (springs, dashpots), found = bought
    assert len(springs.parts) == len(dashpots.parts) == 7
    pairs = np.array(
        list(product(springs.numbers["wrist_stiffness"], dashpots.numbers["wrist_damping"]))
    )
    numbers = {"wrist_stiffness": pairs[:, 0], "wrist_damping": pairs[:, 1]}
    scores = score_designs(found.task.sweep, numbers)
    kept = scores["grip_displacement_peak"] <= catalogue.LIMIT
    assert 0 < kept.sum() < len(pairs)
    best = int(np.argmin(np.where(kept, scores["rms"], np.inf)))
    at = found.front[0]
    assert {name: v[at] for name, v in found.numbers.items()} == {
        name: v[best] for name, v in numbers.items()
    }


def test_a_finer_list_costs_less_and_the_study_writes_it_down(tmp_path, capsys):
    study = studies()["catalogue"]
    result = study.run(Call(tmp_path))
    assert json.loads((tmp_path / "catalogue.json").read_text(encoding="utf-8")) == result
    costs = [row["cost"] for row in result["rows"]]
    assert costs[0] == 0 and costs[1] > costs[2] > costs[3] > 0
    assert (tmp_path / "catalogue.svg").read_text(encoding="utf-8").startswith("<?xml")
    text = (tmp_path / "catalogue.md").read_text(encoding="utf-8")
    assert text.count("\n| ") == len(result["rows"]) + 2 and result["sentences"][0] in text
    study.show(result)
    assert "three sizes a decade" in " ".join(capsys.readouterr().out.split())


@pytest.mark.slow
def test_sleeve_and_wrist_together_are_at_least_as_good_as_apart():
    found = sleeve_and_wrist.find(CALL, side=4)
    rms = {row["chosen"]: row["rms"] for row in found.rows}
    assert rms["both together"] <= rms["wrist, then sleeve"] <= rms["wrist"]
    assert rms["wrist"] < rms["nothing: the preset"] and rms["sleeve"] < rms["nothing: the preset"]
    for row in found.rows:
        own = {name: np.array([row[name]]) for name in sleeve_and_wrist.ENDS}
        scored = score_designs(struck_task(sleeve_and_wrist.axes_of(tuple(own), 2)), own)["rms"][0]
        assert row["rms"] == pytest.approx(scored, rel=1e-6)


@pytest.mark.slow
def test_a_law_without_strength_changes_nothing_and_a_strong_one_the_advice():
    laws = (
        ("linear_damping", {"damping": 1e-9}),
        ("linear_damping", {"damping": 40.0}),
    )
    asked = advice.Asked(laws, side=5, span=0.3)
    found = advice.find(CALL, asked)
    none, weak, strong = found.rows
    assert weak["loss_if_ignored"] == pytest.approx(0.0, abs=1e-6) and not weak["changes"]
    assert strong["changes"] and strong["wrist_damping"] < none["wrist_damping"]
    # damping of the joint and damping of the wrist are one
    numbers = {"wrist_stiffness": strong["wrist_stiffness"]}
    numbers["wrist_damping"] = strong["wrist_damping"] + 40.0
    task = advice.maps_of(advice.Asked((), side=3, span=0.3), CALL)[0].task
    mechanism = Robot("pinned_wrist", tuple(PRESETS[PRESET]))
    moved = respond(mechanism, PRESETS[PRESET] | numbers, task.drive, task.times, (task.sensor,))
    inside = (task.times >= task.window[0]) & (task.times <= task.window[1])
    expected = float(np.sqrt(np.mean(moved.samples[inside, 0] ** 2)))
    assert strong["rms"] == pytest.approx(expected, rel=2e-2)  # of steps of half a millisecond


@pytest.fixture(scope="module")
def swung():
    return golfers.find(CALL, golfers.GOLFERS[:2], side=4)


def test_a_swing_meets_the_ball_with_pose_and_speed():
    for golfer in golfers.GOLFERS:
        drive, times, (low, high) = golfers.swing_of(golfer)
        ball = 0.2 + golfer.tempo
        assert low == pytest.approx(ball + 0.005) and high == pytest.approx(times[-1] + 0.002)
        assert {one.joint for one in drive.joints} == {"arm", "wrist"}
        assert drive.edges[0] == pytest.approx(ball)
        for joint, speed in zip(drive.joints, (golfer.arm_speed, golfer.wrist_speed)):
            angle, rate = joint.at(np.array([ball]))[0, :2]
            assert angle == pytest.approx(0.0, abs=2e-3)
            assert rate == pytest.approx(speed, rel=2e-2)


def test_the_best_for_all_swings_costs_less_over_them_than_the_best_for_the_blow(swung):
    blow, *each, whole = swung.rows
    assert whole["of_all"] <= whole["of_blow"]
    assert blow["of_blow"] == 0.0 and blow["of_all"] >= 0.0
    assert whole["of_all"] == pytest.approx(np.mean([row["of_all"] for row in each]))
    assert all(row["of_all"] >= 0.0 and row["of_blow"] >= 0.0 for row in each)


def test_a_swings_score_is_that_of_its_own_motion(swung):
    row, golfer = swung.rows[1], golfers.GOLFERS[0]
    drive, times, (low, high) = golfers.swing_of(golfer)
    numbers = PRESETS[PRESET] | {key: row[key] for key in ("wrist_stiffness", "wrist_damping")}
    moved = respond(
        Robot("driven_arm", tuple(PRESETS[PRESET])), numbers, drive, times,
        (struck_task(()).sensor,),
    )  # fmt: skip
    inside = (times >= low) & (times <= high)
    expected = float(np.sqrt(np.mean(moved.samples[inside, 0] ** 2)))
    assert row["rms"] == pytest.approx(expected, rel=1e-8)
