"""The studies of swings: one scorer for all methods, and feed-forward beside the subtraction."""

import pytest

from supple.studies import swing_goals
from supple.studies.study import Call, study_named


@pytest.mark.slow
def test_the_optimal_swing_leaves_less_than_any_classic_that_keeps_the_limits(tmp_path):
    study = study_named("swing_methods")
    found = study.run(Call(tmp_path))
    assert len(found["rows"]) == 20
    for force in (0.0, -1000.0):
        rows = [one for one in found["rows"] if one["force"] == force]
        assert len({one["method"] for one in rows}) == 10
        fair = [one["worst"] for one in rows[:-1] if one["scored"] and not one["verdict"]]
        assert rows[-1]["verdict"] == "" and rows[-1]["worst"] < 0.01 * min(fair)
    assert "No shaper knows the ball" in (tmp_path / "swing_methods.md").read_text()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*encountered.*:RuntimeWarning")
def test_feed_forward_follows_where_subtraction_does_not(tmp_path):
    found = study_named("feed_forward").run(Call(tmp_path))
    ways = {one["way"] for one in found["rows"]}
    assert {"the golfer's own drive", "1 subtracted", "feed-forward"} <= ways
    for one in found["rows"]:
        if one["way"] == "feed-forward":
            assert one["status"] == "follows" and one["impact_degrees"] <= 0.0501
        else:
            assert one["impact_degrees"] is None or one["window_degrees"] > 1.0
    assert "exact following is impossible" in (tmp_path / "feed_forward.md").read_text()


KEPT = {
    "fidelity": "thesis", "shaft": "free", "in_all": False, "speed_error": 0.001,
    "pose_error": 0.001, "limit_ratio": 1.0, "pose_spread": [-2.0, 3.0], "share": 0.004,
}  # fmt: skip


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({}, []),
        ({"speed_error": -0.02}, ["speed"]),
        ({"pose_error": 0.006}, ["pose"]),
        ({"limit_ratio": 1.002}, ["limits"]),
        ({"in_all": True}, ["pose in all"]),
        ({"share": 0.02}, ["ring"]),
        ({"share": 0.02, "shaft": "0.30 / 0.45 m"}, []),
        ({"share": None, "speed_error": float("nan")}, ["speed"]),
    ],
)
def test_a_goal_that_is_missed_is_named(changed, words):
    assert swing_goals.missed({**KEPT, **changed}) == words


@pytest.mark.slow
@pytest.mark.parametrize("fidelity", ["thesis", "planar"])
@pytest.mark.filterwarnings("ignore:.*encountered.*:RuntimeWarning")
def test_the_optimal_swing_keeps_its_goals(fidelity):
    own = tuple(case for case in swing_goals.CASES if case.fidelity == fidelity)
    found = swing_goals.find(Call(), own)
    assert [row["missed"] for row in found.rows] == [[] for _ in own]
    assert found.sentences[0].startswith(f"{len(own)} of {len(own)} ")
