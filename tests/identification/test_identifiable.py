"""What records can tell, in words, for the cases of the thesis; and profiles of the likelihood."""

from pathlib import Path

import numpy as np
import pytest

from supple.identification.base import fit_base
from supple.identification.fit import Fit
from supple.identification.identifiable import identifiability, words_of
from supple.identification.problem import make_problem
from supple.identification.profile_likelihood import RISE, profile_likelihood
from supple.identification.records import read_record
from supple.model.rig import read_rig
from tests.identification.benches import STIFFNESS
from tests.lab.bodies import ROBO_V
from tests.lab.draw import write_case
from tests.lab.effects import NOTHING
from tests.lab.plants import club, club_sensor
from tests.lab.trials import Trial, decay, impact


def fitted(folder: Path, bench: str, free: tuple[str, ...], kind: str) -> Fit:
    """One short test of the thesis's club with one accelerometer, fitted for some constants."""
    truth = ROBO_V | {"wrist_damping": 15.0}
    sensors = (club_sensor(bench, truth, "head", "m/s^2"),)
    told = {name: 1.1 * truth[name] for name in free}
    plant = club(bench, truth, free, told, sensors, rate=512.0, count=1000)
    made = decay(plant, 0.15) if kind == "decay" else impact(plant, 0.1, 32, told_force=False)
    trial = Trial(**{**vars(made), "name": "train_1"})
    chance = np.random.default_rng(3)
    case = write_case(folder, plant, [trial], NOTHING, "white", 30.0, {}, chance, sealed=False)
    return fit_base(make_problem([read_record(p) for p in case.train], read_rig(case.rig)))


SLEEVE = ("sleeve_stiffness", "sleeve_damping")


def test_grip_mass_and_inertia_are_hardly_visible_in_a_decay(tmp_path):
    free = (*SLEEVE, "grip_mass", "grip_inertia")
    told = identifiability(fitted(tmp_path, "fixed_collet", free, "decay"))
    for name in ("grip_mass", "grip_inertia"):
        assert told[name]["identifiable"] == "flat", told
        assert "hardly visible" in told[name]["note"]


def test_sleeve_stiffness_and_spacing_are_told_as_a_product(tmp_path):
    free = (*SLEEVE, "sleeve_spacing")
    fit = fitted(tmp_path, "fixed_collet", free, "decay")
    told = identifiability(fit)
    assert told["sleeve_stiffness"]["identifiable"] == "coupled"
    assert "sleeve_spacing" in told["sleeve_stiffness"]["partners"]
    assert "sleeve_stiffness" in told["sleeve_spacing"]["partners"]
    at = {name: fit.value(fit.index(name)) for name in free}
    product = ROBO_V["sleeve_stiffness"] * ROBO_V["sleeve_spacing"] ** 2
    found = at["sleeve_stiffness"] * at["sleeve_spacing"] ** 2
    assert found == pytest.approx(product, rel=0.03)


def test_wrist_and_sleeve_damping_trade_off_in_an_impact(tmp_path):
    free = (*SLEEVE, "wrist_damping")
    told = identifiability(fitted(tmp_path, "pinned_wrist", free, "impact"))
    assert told["wrist_damping"]["identifiable"] == "coupled"
    assert told["sleeve_damping"]["identifiable"] == "coupled"
    assert "sleeve_damping" in told["wrist_damping"]["partners"]
    assert "wrist_damping" in told["sleeve_damping"]["partners"]


@pytest.mark.parametrize("seed", range(6))
def test_springs_in_a_row_are_coupled_and_a_third_is_not(seed):
    """Only the sum of two compliances is seen: what each is, no error tells."""
    rng = np.random.default_rng(seed)
    k = np.exp(rng.uniform(2, 6, 3))
    rows = np.array([[1 / k[0] ** 2, 1 / k[1] ** 2, 0.0], [0.0, 0.0, 1 / k[2]]])
    rows *= 1e3 / np.max(np.abs(rows))
    information = rows.T @ rows + 1e-9 * np.diag(1 / k**2)
    alone = 1 / np.sqrt(np.diag(information))
    told = words_of(["a", "b", "c"], k, k, np.linalg.inv(information), (), alone)
    assert told["a"]["partner"] == "b" and told["b"]["partner"] == "a"
    assert told["c"]["identifiable"] == "yes"


def test_the_profile_of_a_well_told_stiffness_is_a_parabola(clean_fit):
    label = "links.spring.stiffness"
    profile = profile_likelihood(clean_fit, label)
    index = clean_fit.index(label)
    value, std = clean_fit.value(index), clean_fit.std(index)
    assert profile.shape == "yes" and profile.low < STIFFNESS < profile.high
    assert value - profile.low == pytest.approx(1.96 * std, rel=0.15)
    assert profile.high - value == pytest.approx(1.96 * std, rel=0.15)
    assert np.max(profile.rises) > RISE and np.all(np.diff(profile.values) > 0)
    with pytest.raises(ValueError, match="name one"):
        profile_likelihood(clean_fit, "links.string.stiffness")


def test_the_profile_of_a_grips_mass_is_open(tmp_path):
    fit = fitted(tmp_path, "fixed_collet", (*SLEEVE, "grip_mass"), "decay")
    profile = profile_likelihood(fit, "grip_mass")
    assert profile.shape in ("one_sided", "flat")
    assert profile.low == -np.inf


def test_a_constant_that_stands_at_nought_is_told_to_stand_on_its_bound():
    """A shaft without mass of its own, from a start without one: it has no size to compare with."""
    values, alone = np.array([0.0, 2.0]), np.array([0.03, 0.01])
    told = words_of(["mass", "k"], values, values, np.diag([0.04, 0.02]) ** 2, {"mass"}, alone)
    assert told["mass"] == {"identifiable": "one_sided", "note": "stands on its bound"}
    free = words_of(["mass", "k"], values, values, np.diag([0.04, 0.02]) ** 2, (), alone)
    assert free["mass"]["identifiable"] == "flat" and "beyond itself" in free["mass"]["note"]
