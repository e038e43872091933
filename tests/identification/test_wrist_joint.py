"""The passive wrist against made-up swings of an arm with a chain of links."""

import numpy as np
import pytest

from supple.identification.wrist_joint import CONVERGED, UNTOLD, fit_wrist, likelier_wrist
from supple.studies.study import Call, study_named
from tests.lab.wristed import draw_wrist

NOISE = 1e-3  # rad, on both angles

FORM = (0.001, 0.0033)
"""Errors of stiffness and damping [-] without any noise: the bench's shaft is a chain of links, the
model's has one mode."""


@pytest.mark.parametrize(
    ("stiffness", "damping"), [pytest.param(500.0, 5.0, marks=pytest.mark.slow), (350.0, 3.0)]
)
def test_the_wrists_of_the_thesis_are_recovered(stiffness, damping):
    made = draw_wrist(stiffness, damping, seed=3, noise=NOISE)
    found = fit_wrist(made.times, made.arm, made.club)
    assert found.status == CONVERGED and found.misfit.p_value > 1e-3
    assert found.stiffness == pytest.approx(stiffness, rel=0.02)
    assert found.damping == pytest.approx(damping, rel=0.15)
    assert found.rest == pytest.approx(-0.3, abs=2e-3)
    assert abs(found.stiffness - stiffness) < 4 * found.stiffness_std
    assert abs(found.damping - damping) < 4 * found.damping_std


@pytest.mark.slow
def test_weight_counts_where_the_plane_is_steep():
    made = draw_wrist(400.0, 4.0, seed=2, noise=3e-4, inclination=0.9)
    found = fit_wrist(made.times, made.arm, made.club, inclination=0.9)
    flat = fit_wrist(made.times, made.arm, made.club)
    assert found.stiffness == pytest.approx(400.0, rel=0.01)
    assert found.misfit.ratio < flat.misfit.ratio and found.bic < flat.bic - 10


@pytest.mark.slow
def test_a_stiffness_that_varies_is_told_and_a_constant_one_stays_constant():
    made = draw_wrist(lambda t: 300.0 + 250.0 * t, 4.0, seed=4, noise=3e-4)
    constant = fit_wrist(made.times, made.arm, made.club)
    varying = fit_wrist(made.times, made.arm, made.club, knots=4)
    chosen = likelier_wrist(constant, varying)
    assert chosen is varying and len(chosen.knots) == 4
    told = 300.0 + 250.0 * chosen.knots
    assert np.all(np.abs(chosen.knot_stiffness - told) < 4 * chosen.knot_std + 0.02 * told)
    assert np.mean(made.stiffness) == pytest.approx(chosen.stiffness, rel=0.02)


@pytest.mark.slow
def test_an_arm_that_hardly_moves_tells_no_wrist():
    times = np.arange(400) / 400.0
    rng = np.random.default_rng(1)
    arm, club = 1e-3 * rng.standard_normal((2, 400))
    found = fit_wrist(times, arm, club)
    assert found.status != CONVERGED
    assert found.status == UNTOLD or "not converged" in found.status


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda t, a, c: (t, a[:-1], c), "for the same instants"),
        (lambda t, a, c: (t**1.2, a, c), "even clock"),
        (lambda t, a, c: (t[:20], a[:20], c[:20]), "at least 50"),
    ],
)
def test_faulty_series_are_refused(change, words):
    times = np.arange(100) / 100.0
    one, two, three = change(times, np.sin(times), np.sin(times))
    with pytest.raises(ValueError, match=words):
        fit_wrist(one, two, three)
    with pytest.raises(ValueError, match="knots: expected 0, or 3 to 5"):
        fit_wrist(times, times, times, knots=9)


@pytest.mark.slow
def test_intervals_of_the_wrist_hold_the_truth():
    """Of 100 swings: of 30, chance alone takes a median error of damping from 3 to 6 %.

    One swing tells the damping to 6.0 % (3.2 % were the arm known without noise), so that half of
    all errors are below 4.0 %.
    """
    clean, inside, off, errors = draw_wrist(350.0, 3.0), [], [], []
    for seed in range(100):
        chance = np.random.default_rng(seed)
        arm, club = (
            angle + NOISE * chance.standard_normal(len(angle)) for angle in (clean.arm, clean.club)
        )
        found = fit_wrist(clean.times, arm, club)
        apart = np.array([found.stiffness / 350.0 - 1, found.damping / 3.0 - 1])
        std = np.array([found.stiffness_std / 350.0, found.damping_std / 3.0])
        inside.append(np.abs(apart) < 1.96 * std)
        off.append(apart)
        errors.append(std)
    assert np.all(np.mean(inside, axis=0) > 0.88)  # 0.88: a chance of 0.4 %
    stiffness, damping = np.median(np.abs(off), axis=0)
    assert stiffness < 0.02 and damping < 0.05
    typical = np.median(errors, axis=0)
    beyond = np.abs(np.mean(off, axis=0)) - 4 * typical / np.sqrt(100)
    assert np.all(beyond < FORM), "beyond chance"
    assert np.std(off, axis=0) == pytest.approx(typical, rel=0.25)


@pytest.mark.slow
def test_the_study_finds_the_wrists_that_its_swings_were_made_with(tmp_path, capsys):
    study = study_named("wrist")
    result = study.run(Call(tmp_path))
    assert (tmp_path / "wrist.json").is_file() and (tmp_path / "wrist.md").is_file()
    for row in result["rows"]:
        assert not row["varies"] and row["status"] == CONVERGED
        for name, most in (("stiffness", 0.02), ("damping", 0.15)):
            assert row[name]["value"] == pytest.approx(row[name]["made_with"], rel=most)
    study.show(result)
    assert "golfer_2" in capsys.readouterr().out
