"""Errors where the noise is louder when the motion is larger: as wide as the scatter of fits."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from supple.identification import errors
from supple.identification.base import fit_base
from supple.identification.fit import Fit
from supple.identification.problem import make_problem
from tests.identification.benches import DAMPING, STIFFNESS, make_bench

SETS = 30


def fits(folder: Path, noise: str, law: dict[str, float] | None) -> list[Fit]:
    found = []
    for seed in range(SETS):
        bench = make_bench(folder / str(seed), held=(), noise=noise, noise_law=law, seed=seed)
        found.append(fit_base(make_problem(bench.records, bench.rig)))
    return found


def spread(found: list[Fit], covariances: list[np.ndarray]) -> float:
    """Root mean square of the damping's errors over the stated ones [-]."""
    z = []
    for fit, covariance in zip(found, covariances, strict=True):
        at = fit.index("links.spring.damping")
        gap = (fit.value(at) - DAMPING) / fit.model.scale[at]
        z.append(gap / np.sqrt(covariance[at, at]))
    return float(np.sqrt(np.mean(np.square(z))))


@pytest.fixture
def even(monkeypatch):
    """Covariances of fits as if noise were as loud everywhere."""

    def covariances(found: list[Fit]) -> list[np.ndarray]:
        with monkeypatch.context() as patch:
            patch.setattr(errors, "_grown", lambda covariance, more: covariance)
            return [errors.covariance_at(one.model, one.x, one.misfits) for one in found]

    return covariances


def test_noise_that_grows_with_the_motion_widens_errors(tmp_path, even):
    found = fits(tmp_path, "heteroscedastic", {"growth": 5.0})
    own = [errors.covariance_at(one.model, one.x, one.misfits) for one in found]
    narrow, wide = spread(found, even(found)), spread(found, own)
    assert wide < 1.35 < narrow
    assert wide > 0.75


@pytest.mark.slow
def test_even_noise_hardly_does(tmp_path, even):
    found = fits(tmp_path, "white", None)[:8]
    for fit, bare in zip(found, even(found), strict=True):
        own = errors.covariance_at(fit.model, fit.x, fit.misfits)
        ratio = np.sqrt(np.diag(own) / np.diag(bare))
        assert np.all(ratio >= 1.0 - 1e-12) and np.median(ratio) < 1.1
        assert np.all(np.linalg.eigvalsh(own) > 0)


def test_a_gain_that_an_instrument_keeps_does_not_average_out(tmp_path):
    """Four records of a channel that reads one standard deviation too much: so is the stiffness."""
    reaches = (1.0, 0.8, 0.6, 0.4)
    free = ("masses.cart.mass", "links.spring.stiffness", "links.spring.damping")
    bench = make_bench(tmp_path, (), reaches, (), free=free, driven=True, snr_db=60.0)
    records = []
    for record in bench.records:
        channels = (
            replace(one, values=1.01 * one.values, tolerance={"gain": 0.01})
            if one.name == "see_cart"
            else one
            for one in record.channels
        )
        records.append(replace(record, channels=tuple(channels)))
    fit = fit_base(make_problem(records, bench.rig))
    at = fit.index("links.spring.stiffness")
    assert fit.value(at) == pytest.approx(STIFFNESS / 1.01, rel=2e-3)
    assert fit.std(at) / fit.value(at) == pytest.approx(0.01, rel=0.15)
