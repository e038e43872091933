"""Records that nothing drives where they are seen: closed sums against a march."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from supple.identification import likelihood
from supple.identification.coast import Coast
from supple.identification.density import Kind
from supple.identification.fit import Fit, allowances_of, solve
from supple.identification.likelihood import LogPosterior, log_posterior
from supple.identification.noise import Noise
from supple.identification.problem import Model, base_entries, make_problem, rough_noise
from supple.identification.records import read_record
from supple.model.rig import read_rig
from tests.lab.bodies import ROBO_V
from tests.lab.draw import write_case
from tests.lab.effects import NOTHING
from tests.lab.plants import club, club_sensor
from tests.lab.trials import Trial, decay, impact

FREE = ("shaft_stiffness", "shaft_damping", "wrist_stiffness", "wrist_damping")
TOLERANCE = "\n[channels.see_head.tolerance]\ngain = 0.01\n"


@pytest.fixture(scope="module")
def fit(tmp_path_factory: pytest.TempPathFactory) -> Fit:
    """A blow and a decay of a club on a wrist, with a late and a wrong-sized accelerometer."""
    folder: Path = tmp_path_factory.mktemp("coast")
    truth = ROBO_V | {"wrist_damping": 15.0}
    sensors = (
        club_sensor("pinned_wrist", truth, "head", "m/s^2"),
        club_sensor("pinned_wrist", truth, "wrist", "rad"),
    )
    told = {name: 1.02 * truth[name] for name in FREE}
    plant = club("pinned_wrist", truth, FREE, told, sensors, rate=512.0, count=500)
    made = (impact(plant, 0.1, 32, told_force=True), decay(plant, 0.15))
    trials = [Trial(**{**vars(one), "name": f"train_{n}"}) for n, one in enumerate(made)]
    chance = np.random.default_rng(3)
    case = write_case(folder, plant, trials, NOTHING, "white", 30.0, {}, chance, sealed=False)
    for path, late in zip(case.train, ("delay = 0.001\n", "")):
        path.write_text(path.read_text() + TOLERANCE + late)
    problem = make_problem([read_record(path) for path in case.train], read_rig(case.rig))
    entries = base_entries(problem)
    x = np.array([truth.get(entry.name, entry.value) / entry.scale for entry in entries])
    model = Model(problem, entries, (), rough_noise(problem))
    found = solve(model, x, 3)
    model = replace(model, allowances=allowances_of(model, found))
    found = solve(model, found.x, 2)
    return replace(found, covariance=1e-4 * np.eye(len(x)))


def both(fit: Fit, monkeypatch: pytest.MonkeyPatch) -> tuple[LogPosterior, LogPosterior]:
    coasting = log_posterior(fit, 4)
    monkeypatch.setattr(likelihood, "coasts", lambda *_: False)
    return coasting, log_posterior(fit, 4)


LAWS = [(0.5, -0.3), (), (0.6,)]


@pytest.mark.slow
@pytest.mark.parametrize("law", LAWS)
def test_closed_sums_are_those_of_a_march(fit, law, monkeypatch):
    assert fit.model.allowances, "something is left open by these records"
    noises = {key: Noise(law, noise.std) for key, noise in fit.model.noises.items()}
    coasting, marched = both(replace(fit, model=replace(fit.model, noises=noises)), monkeypatch)
    assert all(isinstance(kind, Coast) for kind in coasting.kinds)
    assert all(isinstance(kind, Kind) for kind in marched.kinds)
    assert any("delay" in u.label for u in coasting.unknowns)
    assert any("gain" in u.label for u in coasting.unknowns)
    root = np.sqrt(np.diag(coasting.covariance))
    chance = np.random.default_rng(1)
    points = coasting.mean + 0.3 * chance.standard_normal((4, len(root))) * root
    told, wanted = coasting(points), marched(points)
    assert np.ptp(wanted) > 1.0
    # late by part of a sample: exactly here, there by a polynomial between samples
    assert told - told[0] == pytest.approx(wanted - wanted[0], rel=2e-4, abs=2e-3)


@pytest.mark.slow
def test_records_with_all_constants_in_common_share_their_way(fit):
    density = log_posterior(fit, 4)
    assert all(isinstance(kind, Coast) and kind.alike for kind in density.kinds)
    apart = replace(density, kinds=tuple(replace(kind, alike=False) for kind in density.kinds))
    points = density.mean + 1e-3 * np.arange(4)[:, None]
    assert density(points) == pytest.approx(apart(points), rel=1e-9, abs=1e-6)


def test_a_record_that_is_driven_where_it_is_seen_is_marched(fit):
    first = fit.problem.records[0]
    pushed = first.inputs.copy()
    pushed[-20:] = 1.0
    records = (replace(first, inputs=pushed), *fit.problem.records[1:])
    model = replace(fit.model, problem=replace(fit.problem, records=records))
    kinds = log_posterior(replace(fit, model=model), 4).kinds
    assert [isinstance(kind, Coast) for kind in kinds] == [False, True]
