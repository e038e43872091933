"""From made-up golfers, built in three dimensions, back to plane, impact and angles."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from supple.optimize.markers import ClubGauge, GolferMarkers, golfer_points
from supple.optimize.plane import fit_plane, plane_swing
from tests.lab.golfer import RADIUS, Golfer, lose, make_golfer

X = np.array([1.0, 0.0, 0.0])


def markers_of(golfer: Golfer) -> GolferMarkers:
    places = {name: golfer.seen[:, i] for i, name in enumerate(golfer.names)}
    tee = np.nanmedian(places.pop("tee"), axis=0)
    return GolferMarkers(1.0 / golfer.times[1], **places, tee=tee)


def read(golfer: Golfer, **options):
    markers = markers_of(golfer)
    return plane_swing(golfer_points(markers), markers.tee, **options)


def errors(golfer: Golfer, swing) -> np.ndarray:
    """Angles found less true ones [degrees]."""
    first = round(swing.times[0] / golfer.times[1])
    return np.degrees(swing.angles - golfer.angles[first : first + len(swing.times)])


@settings(max_examples=25, deadline=None)
@given(
    st.floats(0.5, 1.25), st.floats(-0.25, 0.25), st.floats(0.5, 0.75), st.floats(1.4, 1.6),
    st.booleans(),
)  # fmt: skip
def test_exact_markers_give_the_truth_back(slope, aim, arm, impact, left_handed):
    slope = math.pi - slope if left_handed else slope
    golfer = make_golfer(slope=slope, aim=aim, arm=arm, impact=impact)
    swing = read(golfer)
    assert swing.impact.time == pytest.approx(impact, abs=1e-5)
    assert swing.impact.speed == pytest.approx(golfer.speed, abs=0.1)
    assert swing.impact.distance < 3e-4
    assert swing.plane.about_target == pytest.approx(slope, abs=1e-8)
    assert swing.plane.about_vertical == pytest.approx(aim, abs=1e-8)
    assert swing.plane.inclination == pytest.approx(min(slope, math.pi - slope), abs=1e-8)
    assert swing.arm_length == pytest.approx(arm, abs=1e-9)
    assert np.max(np.abs(errors(golfer, swing)[:, :2])) < 1e-7
    assert np.max(np.abs(errors(golfer, swing)[:, 2])) < 2e-3
    assert swing.plane.axes @ swing.plane.axes.T == pytest.approx(np.eye(3), abs=1e-12)
    assert swing.doubts == () and swing.warnings == ()


def test_impact_is_not_the_lowest_point():
    swing = read(make_golfer())
    assert swing.impact.bottom_time - swing.impact.time > 0.008


@pytest.mark.parametrize("seed", range(6))
def test_noisy_markers_and_a_ball_leave_the_stated_errors(seed):
    golfer = make_golfer(seed, noise=5e-4, blow=5.0)
    swing = read(golfer)
    assert abs(swing.impact.time - golfer.impact) < 1.2e-4
    assert abs(swing.impact.speed - golfer.speed) < 1.5
    assert abs(math.degrees(swing.plane.about_target - golfer.slope)) < 0.5
    assert abs(math.degrees(swing.plane.about_vertical - golfer.aim)) < 0.5
    rms = np.sqrt(np.mean(errors(golfer, swing) ** 2, axis=0))
    assert np.all(rms < [0.25, 0.5, 1.2])


def test_only_the_path_near_impact_makes_the_plane():
    golfer = make_golfer(lay_off=0.3)
    swing = read(golfer)
    assert swing.off_plane[1] > 0.1 > 50 * swing.plane.scatter
    assert abs(math.degrees(swing.plane.about_target - golfer.slope)) < 0.3
    assert swing.impact.time == pytest.approx(golfer.impact, abs=2e-5)
    near = np.abs(swing.times - golfer.impact) < 0.05
    assert np.max(np.abs(errors(golfer, swing)[near])) < 0.5
    assert np.max(np.abs(errors(golfer, swing)[:, :2])) < 1.5  # projected, as the robot plays it


def test_the_tee_and_the_radius_place_the_impact():
    golfer = make_golfer()
    markers = markers_of(golfer)
    later = plane_swing(golfer_points(markers), markers.tee + 0.05 * X)
    assert later.impact.time - golfer.impact == pytest.approx(0.05 / golfer.speed, rel=0.1)
    larger = plane_swing(golfer_points(markers), markers.tee, radius=2 * RADIUS)
    assert golfer.impact - larger.impact.time == pytest.approx(RADIUS / golfer.speed, rel=0.1)


def test_a_tee_of_another_day_is_doubted():
    golfer = make_golfer()
    markers = markers_of(golfer)
    swing = plane_swing(golfer_points(markers), markers.tee + np.array([0.0, 0.4, 0.0]))
    assert "another day" in " ".join(swing.doubts)


def test_signs_are_those_of_a_hanging_arm_that_swings_to_the_target():
    """Built point by point: arm down the slope and 30 degrees to the target, club in line."""
    times = np.arange(800) / 400.0
    golfer = make_golfer()
    swing = read(golfer)
    along, slope, _ = swing.plane.axes
    assert along @ X > 0.9 and slope[2] > 0
    at = np.argmin(np.abs(times - golfer.impact - 0.06))
    toward = (golfer.hand - golfer.hub)[at] @ along
    assert toward > 0 and swing.angles[at, 0] > 0  # after impact the hands are past the hub
    # from above, looking down the shaft, the tee piece goes round like a clock's hand
    pieces = golfer_points(markers_of(golfer)).tee_piece[[at - 8, at]]
    shaft = golfer_points(markers_of(golfer)).shaft[at]
    clockwise = np.cross(pieces[0], pieces[1]) @ shaft  # along the view: right-handed is clockwise
    assert clockwise > 0 and swing.angles[at, 2] > swing.angles[at - 8, 2]


@pytest.mark.parametrize(
    ("marker", "start", "length", "most"),
    [
        ("club_bottom", 1.475, 0.03, 0.2),
        ("club_top", 1.0, 0.03, 0.05),
        ("tee_piece", 1.475, 0.03, 1.5),
        ("left_shoulder", 1.0, 0.2, 0.3),
    ],
)
def test_a_gap_within_the_limit_is_filled_within_the_stated_error(marker, start, length, most):
    whole = make_golfer()
    golfer = lose(whole, marker, start, length)
    swing = read(golfer)
    (filled,) = swing.filled
    assert filled.marker == marker and filled.gaps == 1
    assert filled.longest == pytest.approx(length) and filled.frames == round(400 * length)
    assert np.max(np.abs(errors(golfer, swing))) < most


def test_a_gap_beyond_the_limit_is_refused_with_marker_instant_and_length():
    golfer = lose(make_golfer(), "club_bottom", 1.40, 0.035)
    with pytest.raises(
        ValueError, match=r"club_bottom: expected gaps .* 0\.035 s from 1\.400 s on"
    ):
        golfer_points(markers_of(golfer))
    points = golfer_points(markers_of(golfer), longest={"club": 0.04, "shoulder": 0.2})
    assert points.filled[0].frames == 14
    with pytest.raises(ValueError, match="right_shoulder"):
        golfer_points(markers_of(lose(make_golfer(), "right_shoulder", 1.0, 0.3)))


def test_lost_ends_are_left_out():
    golfer = lose(lose(make_golfer(), "club_top", 0.0, 0.2), "tee_piece", 2.1, 0.3)
    swing = read(golfer)
    assert swing.times[0] == pytest.approx(0.2) and swing.times[-1] == pytest.approx(2.0975)
    assert swing.impact.time == pytest.approx(golfer.impact, abs=1e-5)
    assert np.max(np.abs(errors(golfer, swing))) < 2e-3


def test_a_ghost_on_the_shaft_counts_as_lost():
    golfer = make_golfer()
    seen = golfer.seen.copy()
    seen[590:593, golfer.names.index("club_bottom")] += [0.0, 0.1, 0.2]
    swing = read(replace(golfer, seen=seen))
    assert any("3 frames" in warning for warning in swing.warnings)
    assert np.max(np.abs(errors(golfer, swing))) < 0.05


def test_a_wrong_unit_or_gauge_is_found():
    golfer = make_golfer()
    with pytest.raises(ValueError, match=r"285 mm between them.*unit"):
        read(replace(golfer, seen=1e3 * golfer.seen))
    points = golfer_points(markers_of(golfer), ClubGauge(bottom=0.53))
    assert "265 mm" in points.warnings[0]
    with pytest.raises(ValueError, match="correct the gauge"):
        golfer_points(markers_of(golfer), ClubGauge(top=0.6))


def test_no_downswing_and_no_plane_are_said_in_words():
    golfer = make_golfer()
    with pytest.raises(ValueError, match="downswing"):
        read(replace(golfer, seen=golfer.seen[590:660], times=golfer.times[:70]))
    with pytest.raises(ValueError, match="seen"):
        read(lose(golfer, "tee_piece", 0.0, 9.0))
    with pytest.raises(ValueError, match="straight line"):
        fit_plane(np.outer(np.linspace(0, 1, 20), [1.0, 2.0, 0.5]), X)
    turn = np.linspace(0, 1, 20)
    flat = np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    with pytest.raises(ValueError, match="level plane"):
        fit_plane(flat, X)


def test_the_plane_is_the_best_of_all_nearby_planes():
    rng = np.random.default_rng(8)
    turn = rng.uniform(-0.8, 0.8, 60)
    path = np.stack([np.sin(turn), 0.6 * np.cos(turn), -0.8 * np.cos(turn)], axis=1)
    path += 0.01 * rng.normal(size=path.shape)
    plane = fit_plane(path, X)

    def rms(normal, point):
        return np.sqrt(np.mean(((path - point) @ normal / np.linalg.norm(normal)) ** 2))

    best = rms(plane.axes[2], plane.point)
    assert best == pytest.approx(plane.scatter)
    for _ in range(50):
        tilt, shift = 0.01 * rng.normal(size=3), 0.002 * rng.normal(size=3)
        assert rms(plane.axes[2] + tilt, plane.point + shift) >= best
