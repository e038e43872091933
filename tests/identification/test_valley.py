"""Bent valleys: coordinates go there and back and keep the density, and a thin one is followed."""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import pytest

from supple.identification.compliances import Compliances
from supple.identification.coordinates import coordinates_of
from supple.identification.likelihood import LogPosterior
from supple.identification.unknowns import Unknown
from supple.identification.valley import effective, find_valley, learned

SOFT, LOSS = 1 / 150.0 + 1 / 400.0, 0.4 / 150.0**2 + 2.0 / 400.0**2
"""Compliance and loss of two springs in a row [SI]."""

ERRORS = 1e-3, 2e-2
"""How well these two are known, as shares [-]."""


def spring(label: str, value: float, std: float, low: float, high: float) -> Unknown:
    return Unknown(label, "", value, std, low, high, value, value, is_constant=True)


UNKNOWNS = (
    spring("upper_stiffness", 150.0, 60.0, 20.0, 900.0),
    spring("upper_damping", 0.4, 0.6, 0.0, 30.0),
    spring("lower_stiffness", 400.0, 400.0, 50.0, 2000.0),
    spring("lower_damping", 2.0, 5.0, 0.0, 200.0),
    Unknown("sensor.gain", "1", 0.0, 0.01, -np.inf, np.inf, 0.01, 0.0, 0.01),
)


@dataclass(frozen=True, eq=False)
class Row:
    """Two springs in a row, of which only sums are told: what a log posterior has to have."""

    unknowns: tuple[Unknown, ...] = UNKNOWNS

    @property
    def mean(self) -> np.ndarray:
        return np.array([float(u.free(u.value)) for u in self.unknowns])

    @property
    def covariance(self) -> np.ndarray:
        rows = []
        for step in 1e-5 * np.eye(len(self.unknowns)):
            ahead, behind = (self.told(self.mean[None] + sign * step)[0] for sign in (1, -1))
            rows.append((ahead - behind) / 2e-5)
        slope = np.array(rows).T
        return np.linalg.inv(slope.T @ slope + np.diag([0.05, 0.05, 0.05, 0.05, 0.0]))

    def natural(self, free: np.ndarray) -> np.ndarray:
        return np.stack([u.natural(free[..., i]) for i, u in enumerate(self.unknowns)], axis=-1)

    def told(self, free: np.ndarray) -> np.ndarray:
        """Departures of what is told, in its errors, and the gain's in its tolerance."""
        k, c, lower, d, gain = self.natural(free).T
        soft = (1 / k + 1 / lower) * (1 + gain) / SOFT - 1
        loss = (c / k**2 + d / lower**2) / LOSS - 1
        return np.stack([soft / ERRORS[0], loss / ERRORS[1], gain / 0.01], axis=1)

    def log_prior(self, free: np.ndarray) -> np.ndarray:
        found = -0.5 * (self.natural(free)[:, 4] / 0.01) ** 2
        return found + sum(u.log_slope(free[:, i]) for i, u in enumerate(self.unknowns))

    def __call__(self, free: np.ndarray) -> np.ndarray:
        slopes = sum(u.log_slope(free[:, i]) for i, u in enumerate(self.unknowns))
        return slopes - 0.5 * np.sum(self.told(free) ** 2, axis=1)


@pytest.fixture(scope="module")
def row() -> LogPosterior:
    return cast(Any, Row())


def test_what_trades_off_leads_and_what_is_felt_of_it_adds_up(row):
    told = Compliances(row)
    labels = [row.unknowns[i].label for i in told.leads]
    assert labels[:2] in (
        ["lower_stiffness", "lower_damping"],
        ["upper_stiffness", "upper_damping"],
    )
    assert told.natural(np.zeros(5)) == pytest.approx(told.best)


def test_coordinates_go_there_and_back_and_keep_the_density(row):
    told = Compliances(row)
    chance = np.random.default_rng(0)
    cloud = 0.05 * chance.standard_normal((400, 5))
    valley = learned(told, cloud)
    straight = 0.7 * chance.standard_normal((6, 5))
    points = valley.point(straight)
    assert valley.straight(points) == pytest.approx(straight, abs=1e-9)

    def free(one: np.ndarray) -> np.ndarray:
        values = told.natural(valley.point(one))
        return np.stack([u.free(values[..., i]) for i, u in enumerate(row.unknowns)], axis=-1)

    here = np.sum(told.parts(points), axis=0)
    wanted = []
    for one in straight:
        steps = 1e-5 * np.eye(5)
        slope = (free(one + steps) - free(one - steps)) / 2e-5
        wanted.append(row(free(one[None]))[0] + np.log(abs(np.linalg.det(slope))))
    assert np.ptp(wanted) > 1.0
    assert here - here[0] == pytest.approx(np.array(wanted) - wanted[0], abs=1e-4)


def test_out_of_bounds_there_is_nothing(row):
    told = Compliances(row)
    away = np.zeros((1, 5))
    for index, other in told.springs:
        for at, value in ((index, 40.0), (other, -2.0)):
            out = away.copy()
            out[0, at] = value
            assert np.sum(told.parts(out)) == -np.inf


def test_a_thin_bent_valley_is_followed(row):
    """Laplace's draws leave it at once, those along the learned one keep to its ground."""
    chance = np.random.default_rng(1)
    draws = chance.standard_normal((2000, 5))
    root = np.linalg.cholesky(row.covariance)
    plain = row(row.mean + draws @ root.T) + 0.5 * np.sum(draws**2, axis=1)
    valley = find_valley(Compliances(row), np.random.default_rng(2))
    assert valley is not None
    told = np.sum(valley.told.parts(valley.point(draws)), axis=0)
    along = told + 0.5 * np.sum(draws**2, axis=1)
    assert np.mean(np.isfinite(along)) > 0.7
    spreads = [np.ptp(np.quantile(w[np.isfinite(w)], [0.1, 0.9])) for w in (plain, along)]
    assert spreads[0] > 100.0 and spreads[1] < 8.0
    values = valley.told.natural(valley.point(draws))
    near = told > np.max(told) - 20.0
    sums = 1 / values[near, 0] + 1 / values[near, 2]
    assert np.std(sums) / SOFT < 0.03 and np.std(np.log(values[near, 2])) > 0.2


def test_the_same_coordinates_whenever_asked(row):
    point = 0.3 * np.ones((1, 5))
    first, again = coordinates_of(row, 3), coordinates_of(row, 3)
    assert np.array_equal(first.natural(point), again.natural(point))
    assert first.log_density(point) == again.log_density(point)


def test_a_normal_posterior_keeps_straight_coordinates(row):
    assert effective(np.zeros(10)) == 1.0 and effective(np.full(3, -np.inf)) == 0.0

    class Normal:
        mean, covariance, natural = row.mean, np.eye(5), row.natural

        def __call__(self, free: np.ndarray) -> np.ndarray:
            return -0.5 * np.sum((free - self.mean) ** 2, axis=1)

    where = coordinates_of(cast(Any, Normal()), 0)
    point = np.array([[0.1, -0.2, 0.3, 0.0, 1.0]])
    assert where.log_density(point)[0] == pytest.approx(-0.5 * np.sum(point**2))
