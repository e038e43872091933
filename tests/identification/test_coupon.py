"""Coupons: known solids recovered from made-up runs, the thesis's numbers, and what is in doubt."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from supple.identification.coupon import Coupon, Sample, read_coupon
from supple.identification.loop import (
    GOOD,
    NO_PHASE,
    OPEN,
    SATURATED,
    STIFFNESS_ONLY,
    equivalent_damping,
    measure_loop,
)
from supple.identification.sleeve import SleeveShape, read_sizes
from supple.identification.viscoelastic import fit_law

# lines 1031-1041, 1056: the sample of 19 x 8 mm, the sleeve of 15/35 x 250 mm, thinned by 33 %
SAMPLE = Sample(0.008, np.pi / 4 * 0.019**2)
SHAPE = SleeveShape(0.015, 0.035, 0.250, 0.33)
TABLE_4 = ((14500.0, 290e3, 300.0, 6e3), (9000.0, 180e3, 400.0, 8e3), (6500.0, 130e3, 600.0, 12e3))
TAN_DELTA = (0.13, 0.17, 0.26)  # line 1241, at 4 Hz
REST, BRANCH, TAU = 6000.0, 3000.0, 0.03


def solid(frequency, rest=REST, branches=((BRANCH, TAU),)):
    turns = 2j * np.pi * frequency
    return rest + sum(k * turns * tau / (1 + turns * tau) for k, tau in branches)


def run(
    frequency, periods=20, noise=(0.0, 0.0), rate=500.0, seed=0, branches=((BRANCH, TAU),), **over
):
    """A ramp to -2 mm, then -4 to 0 mm, on springs and Maxwell branches; midpoint rule, fine steps.

    Only the part after the branches have settled is handed over.
    """
    fine, amplitude = 40, over.pop("amplitude", 2e-3)
    lead = np.ceil(20 * max((tau for _, tau in branches), default=0.0) * frequency + 1) / frequency
    count = int((lead + periods / frequency) * rate)
    t = np.arange(count * fine + 1) / (rate * fine)
    x = -amplitude * (1 - np.cos(2 * np.pi * frequency * t))
    load, half = over.pop("rest", REST) * x, 0.5 / (rate * fine)
    for stiffness, tau in branches:
        force, forces = 0.0, np.zeros_like(x)
        for i, step in enumerate(np.diff(x)):
            force = (force * (1 - half / tau) + stiffness * step) / (1 + half / tau)
            forces[i + 1] = force
        load = load + forces
    rng = np.random.default_rng(seed)
    kept = slice(int(lead * rate) * fine, None, fine)
    load, x = load[kept], x[kept]
    return Coupon(
        over.pop("name", f"at_{frequency:g}"),
        Path("made_up.csv"),
        rate,
        load + rng.normal(0.0, 1.0, len(x)) * noise[0],
        x + rng.normal(0.0, 1.0, len(x)) * noise[1],
        **over,
    )


# recovery


@pytest.mark.parametrize(("frequency", "periods"), [(1.0, 3.3), (4.0, 20), (4.3, 7.7), (20.0, 40)])
def test_stiffness_and_phase_of_a_known_solid_are_recovered(frequency, periods):
    expected = solid(frequency)
    loop = measure_loop(run(frequency, periods))
    assert loop.status == GOOD and loop.warnings == ()
    assert loop.frequency == pytest.approx(frequency, rel=1e-4)
    assert loop.stiffness == pytest.approx(expected.real, rel=1e-4)
    assert loop.loss_stiffness == pytest.approx(expected.imag, rel=2e-3)
    assert loop.phase_by_peaks == pytest.approx(np.angle(expected), abs=1e-3)
    assert loop.tan_delta == pytest.approx(expected.imag / expected.real, rel=2e-3)
    assert loop.damping == pytest.approx(expected.imag / (2 * np.pi * frequency), rel=2e-3)


def test_errors_cover_what_they_say_and_both_roads_agree():
    frequency, expected = 4.0, solid(4.0)
    clean = run(frequency, 20)
    away = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        load = clean.load + rng.normal(0.0, 0.4, len(clean.load))
        moved = clean.displacement + rng.normal(0.0, 2e-5, len(clean.load))
        loop = measure_loop(Coupon("noisy", Path("made_up.csv"), clean.rate, load, moved))
        assert loop.status == GOOD and loop.warnings == ()
        apart = np.hypot(loop.phase_std, loop.phase_by_peaks_std)
        assert abs(loop.phase - loop.phase_by_peaks) < 4 * apart
        away.append(
            (
                (loop.stiffness - expected.real) / loop.stiffness_std,
                (loop.phase - np.angle(expected)) / loop.phase_std,
                (loop.damping - expected.imag / (2 * np.pi * frequency)) / loop.damping_std,
            )
        )
    spread = np.std(away, axis=0)
    assert np.all((spread > 0.6) & (spread < 1.4)), spread
    assert np.all(np.abs(np.mean(away, axis=0)) < 0.5)


@given(st.floats(0.02, 1.2), st.floats(100.0, 1e6), st.floats(2.5, 9.0))
@settings(max_examples=20)
def test_both_roads_find_any_phase(phase, size, periods):
    t = np.arange(int(periods / 4.0 * 800)) / 800
    moved = 1e-3 * np.cos(2 * np.pi * 4.0 * t) - 2e-3
    load = size * (1e-3 * np.cos(2 * np.pi * 4.0 * t + phase) - 2e-3)
    for sign in (1.0, -1.0):
        loop = measure_loop(Coupon("wave", Path("made_up.csv"), 800.0, sign * load, moved))
        assert loop.phase == pytest.approx(phase, abs=1e-3)
        assert loop.phase_by_peaks == pytest.approx(phase, abs=5e-3)
        assert any("opposite signs" in said for said in loop.warnings) == (sign < 0)


def sweep(branches, frequencies, seed=0, rest=REST):
    loops = []
    for i, frequency in enumerate(frequencies):
        noise = (0.01 * rest * 2e-3, 1e-6)
        own = run(frequency, 8, noise, 40 * frequency, seed + i, branches, rest=rest)
        loops.append(measure_loop(own))
    return fit_law(
        np.array([loop.frequency for loop in loops]),
        np.array([complex(loop.stiffness, loop.loss_stiffness) for loop in loops]),
        np.array([[loop.stiffness_std, loop.loss_stiffness_std] for loop in loops]),
    )


def test_a_zener_solid_is_recovered_from_a_sweep_and_named():
    frequencies = np.array([1.0, 2.0, 4.0, 6.0, 8.0, 11.0, 15.0, 20.0])
    law = sweep(((BRANCH, TAU),), frequencies)
    assert law.name == "zener" and law.chi2 < 3.0
    found = np.array([law.rest, *law.branches[0]])
    truth = np.array([REST, BRANCH, TAU])
    assert found == pytest.approx(truth, rel=0.05)
    assert np.all(np.abs(found - truth) < 4 * law.std)
    assert law.modulus(4.0)[0] == pytest.approx(solid(4.0), rel=0.005)
    stds = law.modulus_std(4.0)
    assert 0 < stds[0] < 0.01 * solid(4.0).real and 0 < stds[1] < 0.05 * solid(4.0).imag


def test_the_number_of_branches_is_what_the_data_ask_for():
    frequencies = np.geomspace(1.0, 20.0, 10)
    assert sweep((), frequencies).name == "elastic"
    two = ((2500.0, 0.1), (4000.0, 0.006))
    law = sweep(two, frequencies)
    assert law.name == "prony" and len(law.branches) == 2
    assert [tau for _, tau in law.branches] == pytest.approx([0.1, 0.006], rel=0.25)
    assert law.bic[2] < law.bic[1] < law.bic[0]


def test_a_law_needs_three_frequencies():
    with pytest.raises(ValueError, match="at least 3 different"):
        fit_law(np.array([1.0, 4.0, 4.0]), np.ones(3) + 0.1j, np.ones((3, 2)))


# the thesis


def test_table_4_scales_every_sample_by_twenty():
    """Lines 1246-1248; the segment model of line 1244 gives 20.8, and 19.4 of another reading."""
    for k, k_sleeve, c, c_sleeve in TABLE_4:
        assert k_sleeve / k == pytest.approx(20.0) and c_sleeve / c == pytest.approx(20.0)
    assert SAMPLE.geometry_factor == pytest.approx(28.22, abs=0.01)  # eq. 6, line 1041
    assert SHAPE.wall == pytest.approx(6.7e-3)
    assert SHAPE.factor(SAMPLE) == pytest.approx(20.0, rel=0.04)
    assert SHAPE.factor(SAMPLE) == pytest.approx(20.7, abs=0.1)
    thick_at_the_rim = SleeveShape(0.025, 0.045, 0.250)  # mean radius 17.5 mm, wall 10 mm
    assert thick_at_the_rim.factor(SAMPLE) == pytest.approx(19.4, abs=0.05)
    full = SleeveShape(0.015, 0.035, 0.250, 0.33, "full")
    assert full.factor(SAMPLE) == pytest.approx(2 * SHAPE.factor(SAMPLE))


def test_damping_coefficients_of_the_thesis_by_its_own_equations():
    """Erratum B2: eq. 18-21 with Table 4's k give 75, 61 and 67, not 300, 400 and 600 N s/m."""
    found = [
        equivalent_damping(row[0], tan, 4.0) for row, tan in zip(TABLE_4, TAN_DELTA, strict=True)
    ]
    assert found == pytest.approx([75.0, 61.0, 67.0], abs=0.5)
    ratios = [row[2] / c for row, c in zip(TABLE_4, found, strict=True)]
    assert ratios == pytest.approx([4.0, 6.6, 8.9], abs=0.05)
    first = TABLE_4[0][0]
    guess = [equivalent_damping(first, tan, 1.0) for tan in TAN_DELTA]
    assert guess == pytest.approx([row[2] for row in TABLE_4], rel=0.025)


def test_moduli_of_line_1190_give_the_stiffness_of_table_4():
    """Erratum B1: 480, 265 and 190 kPa over eq. 6 are +17, +4 and +4 % of Table 4."""
    found = [modulus / SAMPLE.geometry_factor for modulus in (480e3, 265e3, 190e3)]
    assert found == pytest.approx([17012.0, 9392.0, 6734.0], rel=1e-3)


def test_a_load_below_the_machines_accuracy_is_named():
    """Line 1190 with line 1186: 480 N/m over 3 mm is 1.4 N, the load cell tells 2 N."""
    t = np.arange(2000) / 100.0
    moved = 1.5e-3 * (1 - np.cos(2 * np.pi * 0.5 * t))
    loop = measure_loop(Coupon("soft", Path("x.csv"), 100.0, 480.0 * moved, moved, (2.0, 1e-6)))
    assert loop.status == NO_PHASE
    assert "below what the machine tells (2 N" in loop.warnings[0]


# doubts


def test_a_phase_within_the_machines_resolution_is_not_told():
    still = run(4.0, 10, branches=())
    assert measure_loop(still).status == NO_PHASE  # a spring alone has none
    slow = run(4.0, 10, branches=((100.0, 0.03),), delay=1e-3)
    loop = measure_loop(slow)
    assert loop.status == NO_PHASE and "cannot be told from none" in loop.warnings[0]
    assert loop.phase_std >= 2 * np.pi * 4.0 * 1e-3


def test_a_loop_that_does_not_close_is_named():
    own = run(4.0, 10)
    creeping = own.load + np.linspace(0.0, 20.0, len(own.load))
    loop = measure_loop(Coupon("creeping", own.path, own.rate, creeping, own.displacement))
    assert loop.status == OPEN and "does not close" in loop.warnings[0]
    assert loop.gap == pytest.approx(20.0 / 10 / (2 * loop.load_amplitude), rel=0.05)
    sinking = own.displacement + np.linspace(0.0, 1e-3, len(own.load))
    spring = measure_loop(Coupon("sinking", own.path, own.rate, 5e3 * sinking, sinking))
    assert spring.gap < 1e-6  # load follows displacement: closed


@pytest.mark.parametrize("which", ["load", "displacement"])
def test_flat_tops_are_named(which):
    own = run(4.0, 10)
    curves = {"load": own.load, "displacement": own.displacement}
    curves[which] = np.maximum(curves[which], 0.8 * curves[which].min())
    loop = measure_loop(Coupon("cut", own.path, own.rate, curves["load"], curves["displacement"]))
    assert loop.status == SATURATED and which in loop.warnings[0]


def test_a_stiffening_sample_is_named_as_no_sine():
    own = run(4.0, 10, branches=())
    x = own.displacement - own.displacement.mean()
    loop = measure_loop(Coupon("stiff", own.path, own.rate, 1e3 * x + 2e9 * x**3, x))
    assert any("no sine" in said for said in loop.warnings)


@pytest.mark.parametrize("rate", [50.0, 100.0])
def test_few_samples_a_period_raise_no_false_alarm(rate):
    loop = measure_loop(run(20.0, 40, rate=rate))
    expected = solid(20.0)
    assert loop.status == GOOD and loop.warnings == ()
    assert loop.tan_delta == pytest.approx(expected.imag / expected.real, rel=0.02)


def test_a_single_loading_tells_a_stiffness_and_no_phase():
    t = np.linspace(0.0, 2.0, 400)
    moved = -3e-3 * (1 - np.abs(t - 1.0))
    rng = np.random.default_rng(2)
    load = 14500.0 * moved + 3.0 * (t > 1.0) * (2.0 - t) + rng.normal(0.0, 0.05, len(t))
    loop = measure_loop(Coupon("once", Path("x.csv"), 200.0, load, moved))
    assert loop.status == STIFFNESS_ONLY and np.isnan(loop.phase)
    assert loop.stiffness == pytest.approx(14500.0, abs=4 * loop.stiffness_std)
    assert loop.stiffness_std < 50.0


# the door


def table(path, header="Time (s);Extension (mm);Load (N)", frequency=4.0, columns=(0, 1, 2)):
    own = run(frequency, 6, rate=200.0)
    t = np.arange(len(own.load)) / own.rate
    numbers = (t, own.displacement * 1e3, own.load)
    rows = [
        ";".join(f"{numbers[c][i]:.6f}".replace(".", ",") for c in columns) for i in range(len(t))
    ]
    path.write_text("\n".join([header, *rows]) + "\n")
    return own


SIDECAR = """\
[record]
test = "coupon"
[channels.time]
column = 0
unit = "s"
[channels.travel]
column = 1
unit = "mm"
role = "input"
quantity = "position"
place = "crosshead"
[channels.load]
column = 2
unit = "N"
role = "response"
quantity = "force"
place = "crosshead"
noise = 0.5
tolerance = { delay = 0.0001 }
[parameters]
sample_height = 0.008
sample_diameter = 0.019
"""


def test_a_machines_own_file_explains_itself(tmp_path):
    own = table(tmp_path / "run.csv")
    read = read_coupon(tmp_path / "run.csv")
    assert read.rate == pytest.approx(200.0) and read.sample is None
    assert read.displacement == pytest.approx(own.displacement, abs=1e-9)
    assert read.load == pytest.approx(own.load, abs=1e-5)


def test_a_sidecar_states_sizes_noise_and_delay(tmp_path):
    table(tmp_path / "run.csv", header="a;b;c")
    (tmp_path / "run.toml").write_text(SIDECAR)
    for name in ("run.toml", "run.csv"):
        read = read_coupon(tmp_path / name)
        assert read.sample == SAMPLE and read.delay == 1e-4
        assert read.steps[0] == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("sample_height", "sample_heigth"), "write 'sample_height'"),
        (("sample_height = 0.008\n", ""), "'sample_height' with one of"),
        (("0.019", "-0.019"), "a size above 0"),
        (('test = "coupon"', 'test = "swing"'), "test = 'coupon'"),
        (('quantity = "position"\n', 'quantity = "voltage"\n'), "unit"),
        (('unit = "mm"', 'unit = "1"'), "a unit such as 'm'"),
        (('quantity = "force"', 'quantity = "torque"'), "unit of torque"),
    ],
)
def test_a_sidecar_at_fault_is_one_line(tmp_path, change, said):
    table(tmp_path / "run.csv", header="a;b;c")
    assert change[0] in SIDECAR
    (tmp_path / "run.toml").write_text(SIDECAR.replace(*change))
    with pytest.raises(ValueError, match="Mend: ") as raised:
        read_coupon(tmp_path / "run.toml")
    assert said in str(raised.value) and "\n" not in str(raised.value)


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("Time (s);Extension;Load (N)", "the unit of displacement"),
        ("Time (s);Temperature (K);Load (N)", "one column of displacement"),
        ("Time (s);Load (kN);Load (N)", "one column of load"),
    ],
)
def test_a_table_that_does_not_explain_itself_is_one_line(tmp_path, header, said):
    table(tmp_path / "run.csv", header)
    with pytest.raises(ValueError, match="Mend: ") as raised:
        read_coupon(tmp_path / "run.csv")
    assert said in str(raised.value) and "run.toml" in str(raised.value)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[sleeve]\ninner_diameter = 0.03\nouter_diameter = 0.02\nlength = 0.2\n", "exchange"),
        ("[sample]\nheight = 0.008\n", "one of 'area' and 'diameter'"),
        ("[sample]\nheight = 0.0\narea = 1e-4\n", "greater than 0"),
        ("[sleve]\nlength = 1.0\n", "write 'sleeve'"),
    ],
)
def test_sizes_at_fault_are_one_line(tmp_path, text, said):
    (tmp_path / "sizes.toml").write_text(text)
    with pytest.raises(ValueError, match="Mend: ") as raised:
        read_sizes(tmp_path / "sizes.toml")
    assert said in str(raised.value)
