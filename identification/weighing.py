"""The fit again, each sample weighed by the noise law that its channel bears out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .errors import SHOWN, covariance_of
from .fit import Fit, solve
from .noise import Noise
from .problem import Key
from .uneven import Uneven, choose_law, likeliest_uneven

ROUNDS = 12
"""Rounds of laws and fits, at most [-]."""

SETTLED = 0.01
"""Change of every unknown in a round, in its standard errors, below which the rounds end [-]."""


def with_laws(fit: Fit) -> Fit:
    """Ask each channel whether its noise grows or has heavy tails, and fit again where it does.

    Channels whose misfit is no noise are not asked, nor those whose noise their sidecar states:
    what the model lacks grows with the motion too.

    Args:
        fit: settled, with errors.

    Returns:
        The same fit where all noise is even and normal; otherwise the one that reweighted least
        squares lead to, with errors [SI] from the laws' Fisher information.

    Source: Carroll and Ruppert 1982, doi:10.1214/aos/1176345784 (weights that follow from the
    fit); Lange, Little and Taylor 1989, doi:10.1080/01621459.1989.10478852;
    tests/identification/test_uneven.py.
    """
    laws = _asked(fit)
    if all(type(noise) is Noise for noise in laws.values()):
        return fit
    std = np.sqrt(np.maximum(np.diag(fit.covariance), 1e-300))
    for number in range(ROUNDS):
        before = fit.x
        fit = solve(replace(fit.model, noises=laws), before, 40)
        if np.all(np.abs(fit.x - before) < SETTLED * std):
            break
        # which laws there are may change with the first weights, then no more
        laws = _asked(fit) if number == 0 else _followed(fit, laws)
    expected = {k: n.expected if isinstance(n, Uneven) else n for k, n in laws.items()}
    model = replace(fit.model, noises=expected)
    cost = float(np.sum(model.residual(fit.x) ** 2))
    return replace(fit, covariance=covariance_of(model, fit.x, cost, fit.misfits))


def _asked(fit: Fit) -> dict[Key, Noise]:
    """The law of every channel: chosen where only noise is left, as it stands elsewhere."""
    found = {}
    for key, noise in fit.model.noises.items():
        assert isinstance(noise, Noise)
        told = fit.sensor_of(key).channel.noise is not None
        if not told and fit.misfits[key].p_value > SHOWN:
            even = noise.even if isinstance(noise, Uneven) else noise
            noise = choose_law(even, _left(fit, key), fit.predicted[key])
        found[key] = noise
    return found


def _followed(fit: Fit, laws: Mapping[Key, Noise]) -> dict[Key, Noise]:
    """The same laws with the numbers and weights that the residuals ask for now."""
    found = dict(laws)
    for key, noise in laws.items():
        if isinstance(noise, Uneven):
            found[key] = likeliest_uneven(noise, _left(fit, key), fit.sensor_of(key).values)
    return found


def _left(fit: Fit, key: Key) -> np.ndarray:
    """Residual of a channel, as loud as its noise although some of it was followed [SI]."""
    count = len(fit.sensor_of(key).values)
    return fit.residual_of(key) * np.sqrt(count / max(count - fit.taken.get(key, 0.0), 1.0))
