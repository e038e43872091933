"""Gauges of a swing: strain, filters, impact, clocks, the swing plane, and the collet's motion."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from supple.identification.clocks import on_points, shift_of_signals
from supple.identification.instant import impact_instant
from supple.identification.lowpass import both_filters, fft_lowpass, zero_phase_lowpass
from supple.identification.resolve import (
    Carrier,
    relative_acceleration,
    resolve_accelerations,
    resolve_strains,
)
from supple.identification.strain import Calibration, calibrate, deflection
from supple.identification.swing_channels import Gauges, GripTurn, swing_channels
from tests.lab import instrumented

FINAL = 300.0, 15.0  # the thesis's wrist [N m/rad, N m s/rad]; line 1801


@pytest.fixture(scope="module")
def rigid() -> instrumented.Instrumented:
    return instrumented.swing(1, noise=2.0, strain_noise=2e-5)


# strain


def test_0024_of_strain_is_a_metre():  # line 1833
    assert deflection(np.array([0.024, -0.0012])).values == pytest.approx([1.0, -0.05])
    assert (deflection(np.array([0.024])).std == 0.0).all()


def test_a_calibration_finds_gain_and_zero_with_their_errors():
    rng, held, runs = np.random.default_rng(3), np.zeros(2), 1000
    x = np.array([-0.1, -0.05, 0.0, 0.05, 0.1, 0.15])
    at = np.array([0.08])
    for _ in range(runs):
        one = calibrate(x, 0.024 * x + 1e-4 + 3e-5 * rng.standard_normal(6))
        held[0] += abs(one.gain - 0.024) < 2.776 * one.gain_std  # Student, 4 degrees of freedom
        bent = deflection(0.024 * at + 1e-4, one)
        held[1] += abs(bent.values[0] - 0.08) < 2.776 * bent.std[0]
    assert ((held / runs > 0.93) & (held / runs < 0.97)).all(), held / runs


def test_a_gauge_that_is_not_straight_is_told():
    x = np.linspace(-0.2, 0.2, 9)
    rng = np.random.default_rng(4)
    straight = calibrate(x, 0.024 * x + 1e-5 * rng.standard_normal(9))
    curved = calibrate(x, 0.024 * x + 0.01 * x**2 + 1e-5 * rng.standard_normal(9))
    assert straight.curvature_p is not None and curved.curvature_p is not None
    assert straight.curvature_p > 0.01 > 1e-6 > curved.curvature_p
    with pytest.raises(ValueError, match="several deflections"):
        calibrate(np.ones(4), np.ones(4))
    with pytest.raises(ValueError, match="at least 3 pairs"):
        calibrate(np.ones(2), np.ones(2))


# low-passes


@pytest.mark.parametrize("cutoff", [15.0, 30.0])
def test_both_low_passes_keep_slow_waves_in_place_and_take_fast_ones_away(cutoff):
    t = np.arange(4096) / 2048.0
    slow, fast = np.sin(2 * np.pi * 3.0 * t), np.sin(2 * np.pi * 4 * cutoff * t)
    for run in (fft_lowpass, zero_phase_lowpass):
        inner = slice(400, -400)
        assert np.abs(run(slow + fast, 2048.0, cutoff) - slow)[inner].max() < 2e-3
    at = zero_phase_lowpass(np.sin(2 * np.pi * cutoff * t), 2048.0, cutoff)[1000:-1000]
    assert np.abs(at).max() == pytest.approx(np.sqrt(0.5), rel=0.01)  # half power


def test_the_difference_is_ringing_before_the_impact(rigid):
    """The window on the spectrum answers the blow before it comes."""
    told = {one: both_filters(rigid.lead_strain / 0.024, 5120.0, one) for one in (15.0, 30.0)}
    for found in told.values():
        assert found.rms_at_ends > found.rms  # a record that does not end as it began
        assert found.ringing > 0.0
        assert abs(found.at - rigid.times[-1]) < 0.1 or found.at < 0.1
    assert told[30.0].removed < told[15.0].removed
    step = np.where(np.arange(2000) < 1000, 0.0, 1.0)
    both = both_filters(step, 1000.0, 30.0)
    assert both.by_fft[800:960].min() < 5 * both.zero_phase[800:960].min() < 0.0


def test_a_cutoff_that_cannot_be_is_refused():
    with pytest.raises(ValueError, match=r"cutoff: expected between 0 and 45 Hz"):
        fft_lowpass(np.zeros(100), 100.0, 60.0)
    with pytest.raises(ValueError, match="finite"):
        zero_phase_lowpass(np.full(100, np.nan), 100.0, 6.0)


# impact


@pytest.mark.parametrize("rate", [2048.0, 5120.0])
def test_the_impact_is_found_within_a_sample(rate):
    late = []
    for seed in range(6):
        made = instrumented.swing(
            seed, rate=rate, noise=2.0, impact=1.4873 + 0.00011 * seed, end=1.7
        )
        found = impact_instant(made.lead, rate)
        assert found.status == "found" and found.margin > 1.5
        late.append(found.time - made.impact)
    assert np.max(np.abs(late)) < 1.5 / rate
    assert np.sqrt(np.mean(np.square(late))) < 3 / np.sqrt(12) / rate


def test_a_practice_swing_has_no_impact_and_a_lone_spike_is_doubted():
    made = instrumented.swing(2, noise=2.0, blow=False, end=1.7)
    assert impact_instant(made.lead, 5120.0).status == "none"
    made.lead[3000] += 100.0
    found = impact_instant(made.lead, 5120.0)
    assert found.status == "in_doubt" and "a lone spike" in found.sentence


def test_noise_above_the_threshold_is_no_impact():
    values = np.random.default_rng(5).normal(0.0, 30.0, 4000)
    assert impact_instant(values, 2048.0).status == "none"


# clocks


@settings(max_examples=8, deadline=None)
@given(
    offset=st.floats(-0.4, 0.4), drift=st.floats(-2e-4, 2e-4),
    gain=st.sampled_from([-3.0, 0.1, 1.0]), seed=st.integers(0, 99),
)  # fmt: skip
def test_another_clock_is_found_by_what_both_saw(offset, drift, gain, seed):
    rng = np.random.default_rng(seed)
    ours = np.arange(1000) / 400.0
    theirs = np.arange(4500) / 2048.0 + 0.3

    def motion(t):
        return np.tanh(6 * (t - 1.0)) + 0.4 * np.sin(9 * t) + 0.2 * np.sin(31 * t + 1.0)

    x = motion(ours) + 0.01 * rng.standard_normal(1000)
    y = gain * motion(offset + (1 + drift) * theirs) + 2.0
    found = shift_of_signals((ours, x), (theirs, y), drifts=True)
    assert found.status == "aligned" and found.correlation * np.sign(gain) > 0.9
    assert abs(found.offset - offset) < 5 * found.offset_std + 1e-7 < 1e-2
    assert abs(found.drift - drift) < 5 * found.drift_std + 1e-9 < 1e-3
    assert found.ours(theirs) == pytest.approx(offset + (1 + drift) * theirs, abs=2e-3)


def test_unlike_records_are_not_aligned():
    rng = np.random.default_rng(0)
    t = np.arange(600) / 100.0
    found = shift_of_signals((t, rng.standard_normal(600)), (t, rng.standard_normal(600)))
    assert found.status == "in_doubt"


def test_resampling_to_a_thousand_points_keeps_what_they_can_show():
    t = np.arange(10_240) / 5120.0
    points = np.linspace(0.2, 2.2, 1000)
    found = on_points(t, np.sin(2 * np.pi * 20 * t) + np.sin(2 * np.pi * 900 * t), points)
    inside = found.is_known & (points > 0.25) & (points < 1.95)
    assert np.abs(found.values - np.sin(2 * np.pi * 20 * points))[inside].max() < 2e-3
    assert np.isnan(found.values[~found.is_known]).all() and (~found.is_known).sum() == 100
    # a 900 Hz wave taken at every n-th sample would stay as large as it was
    assert np.abs(np.interp(points, t, np.sin(2 * np.pi * 900 * t))).max() > 0.9


# the swing plane


def test_equations_42_and_43_as_printed():
    toe, lead, grip = np.array([3.0]), np.array([5.0]), np.array([np.pi / 6])
    assert resolve_accelerations(toe, lead, grip).in_plane == pytest.approx(1.5 + 5 * np.sqrt(0.75))
    assert resolve_strains(toe, lead, grip).in_plane == pytest.approx(5 * np.sqrt(0.75) - 1.5)


def test_a_square_face_shows_the_lead_gauge_and_a_turned_one_the_toe_gauge():
    square, turned = np.zeros(1), np.full(1, np.pi / 2)
    assert resolve_accelerations(np.ones(1), 2 * np.ones(1), square).in_plane == pytest.approx(2.0)
    assert resolve_accelerations(np.ones(1), 2 * np.ones(1), turned).in_plane == pytest.approx(1.0)
    assert resolve_strains(np.ones(1), 2 * np.ones(1), turned).in_plane == pytest.approx(-1.0)


@given(st.floats(-9, 9), st.floats(-9, 9), st.floats(-4, 4))
def test_resolving_only_turns(toe, lead, grip):
    found = resolve_accelerations(np.array([toe]), np.array([lead]), np.array([grip]))
    assert np.hypot(found.in_plane, found.out_of_plane)[0] == pytest.approx(np.hypot(toe, lead))


def test_the_error_of_the_plane_is_that_of_its_scatter():
    rng = np.random.default_rng(6)
    n, grip = 20_000, 0.7
    toe, lead = 3.0 + 0.2 * rng.standard_normal(n), 5.0 + 0.4 * rng.standard_normal(n)
    turned = grip + 0.05 * rng.standard_normal(n)
    seen = resolve_accelerations(toe, lead, turned).in_plane
    told = resolve_accelerations(
        np.array([3.0]), np.array([5.0]), np.array([grip]), (0.2, 0.4), 0.05
    )
    assert told.std[0] == pytest.approx(seen.std(), rel=0.03)


@pytest.fixture(scope="module")
def chain(rigid):
    points = np.linspace(0.05, 1.95, 1000)
    grip = np.interp(points, rigid.times, rigid.grip)
    cut = 700  # the gauges' clock begins later
    gauges = Gauges(5120.0, rigid.toe[cut:], rigid.lead[cut:], rigid.toe_strain[cut:],
                    rigid.lead_strain[cut:], (2.0, 2.0))  # fmt: skip
    return swing_channels(gauges, GripTurn(points, grip, rigid.impact, 0.0005, 0.01))


def test_gauges_on_a_turning_grip_become_the_motion_in_the_plane(rigid, chain):
    truth = np.interp(chain.points, rigid.times, rigid.felt)
    bent = np.interp(chain.points, rigid.times, rigid.deflection)
    before = chain.is_known & (chain.points < rigid.impact - 0.05) & (chain.points > 0.3)
    off = (chain.acceleration.in_plane - truth)[before]
    assert chain.status == "good" and len(chain.points) == 1000
    assert np.sqrt(np.mean(off**2)) < 1.3 < 0.05 * np.abs(truth[before]).max()
    assert np.mean(np.abs(off) < 1.96 * chain.acceleration.std[before]) > 0.9
    assert np.sqrt(np.mean((chain.deflection.in_plane - bent)[before] ** 2)) < 1e-3
    lone = np.interp(chain.points, rigid.times, rigid.lead)[before]
    assert np.sqrt(np.mean((lone - truth[before]) ** 2)) > 5.0  # the lead gauge alone does not do


def test_the_clock_is_found_by_the_impact_and_what_is_not_known_is_nan(rigid, chain):
    assert chain.shift.offset == pytest.approx(700 / 5120, abs=2e-4)
    assert 5e-4 < chain.shift.offset_std < 6e-4
    lost = chain.points < 700 / 5120 - 2e-4
    assert np.isnan(chain.acceleration.in_plane[lost]).all()
    assert np.isfinite(chain.deflection.in_plane[chain.is_known]).all()
    assert any("points lie beyond the record" in text for text in chain.warnings)


def test_the_calibrations_error_reaches_the_deflection(rigid):
    points = np.linspace(0.2, 1.9, 1000)
    gauges = Gauges(5120.0, rigid.toe, rigid.lead, rigid.toe_strain, rigid.lead_strain)
    turn = GripTurn(points, np.interp(points, rigid.times, rigid.grip), rigid.impact)
    one = Calibration(gain_std=0.024 * 0.02)
    found = swing_channels(gauges, turn, (one, one))
    largest = int(np.nanargmax(np.abs(found.deflection.in_plane)))
    share = found.calibration_std[largest] / abs(found.deflection.in_plane[largest])
    assert 0.02 / np.sqrt(2) < share < 0.021  # two gauges, each calibrated by itself


def test_without_an_impact_nothing_is_aligned():
    still = np.random.default_rng(0).normal(0, 1.0, 4000)
    turn = GripTurn(np.linspace(0, 1, 1000), np.zeros(1000), 0.5)
    with pytest.raises(ValueError, match="expected an impact"):
        swing_channels(Gauges(2048.0, still, still, still, still), turn)


# the collet's motion


def off(made, wrist, slope=instrumented.SLOPE, **over):
    stiffness, damping = wrist or (None, 0.0)
    carrier = Carrier(
        instrumented.REACH, instrumented.ARM, instrumented.COLLET_INERTIA,
        instrumented.COLLET_MOMENT, instrumented.HEAD_MASS, stiffness, damping, slope=slope,
    )  # fmt: skip
    found = relative_acceleration(
        made.times, made.felt, made.arm, made.wrist, carrier, made.deflection
    )
    before = made.times < made.impact - 0.01

    def rms(x):
        return float(np.sqrt(np.mean(x[before] ** 2)))

    return (
        rms(found.values - made.relative), rms(found.by_drive - made.relative),
        rms(found.twist - made.twist), rms(made.relative), rms(made.twist),
    )  # fmt: skip


def test_a_rigid_wrist_needs_no_correction():
    made = instrumented.swing(slow=2.0, slope=instrumented.SLOPE, noise=0.0, end=1.6)
    own, by_drive, _, size, _ = off(made, None)
    assert own == by_drive < 0.01 * size


@pytest.mark.parametrize(("slow", "left"), [(1.0, 0.05), (2.0, 0.01)])
def test_a_yielding_wrist_is_corrected_from_the_record_itself(slow, left):
    """Errata, section C: less the drive's motion is not the head's relative acceleration."""
    made = instrumented.swing(slow=slow, wrist=FINAL, slope=instrumented.SLOPE, end=1.6)
    own, by_drive, twist, size, turned = off(made, FINAL)
    assert by_drive > 0.15 * size  # what the thesis's subtraction leaves
    assert own < left * size and own < 0.25 * by_drive
    assert twist < 0.01 * turned
    assert off(made, FINAL, slope=0.0)[0] > 2 * own  # the sensor leans with the head
