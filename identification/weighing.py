"""The fit again, each sample weighed by the noise law that its channel bears out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from .errors import BLIND, SHOWN, covariance_of
from .fit import Fit, solve
from .noise import Noise
from .problem import Key
from .uneven import Told, Uneven, choose_law, likeliest_law

ROUNDS = 12
"""Rounds of laws and fits, at most [-]."""

SETTLED = 0.01
"""Change of every unknown in a round, in its standard errors, below which the rounds end [-]."""


def with_laws(fit: Fit) -> Fit:
    """Ask each channel whether its noise grows or has heavy tails, and fit again by what it says.

    Channels whose noise their sidecar states are not asked, and none where one shows misfit: what
    the model lacks grows with the motion too. Where nothing but noise is left, a memory is told by
    all samples, in the innovations' likelihood, and no more by its spectrum away from the motion.

    Args:
        fit: settled, with errors.

    Returns:
        The same fit where all noise is white or not asked; otherwise the one that reweighted least
        squares lead to, with errors [SI] from the laws' Fisher information.

    Source: Carroll and Ruppert 1982, doi:10.1214/aos/1176345784 (weights that follow from the
    fit); Lange, Little and Taylor 1989, doi:10.1080/01621459.1989.10478852;
    tests/identification/test_uneven.py, test_coverage.py.
    """
    laws = _asked(fit)
    if not any(_followed_up(fit, key, law) for key, law in laws.items()):
        return fit
    laws = _followed(fit, laws)
    std = np.sqrt(np.maximum(np.diag(fit.covariance), 1e-300))
    for number in range(ROUNDS):
        before = fit.x
        fit = solve(replace(fit.model, noises=laws), before, 40)
        if np.all(np.abs(fit.x - before) < SETTLED * std):
            break
        # which laws there are may change with the first weights, then no more
        laws = _followed(fit, _asked(fit) if number == 0 else laws)
    expected = {k: n.expected if isinstance(n, Uneven) else n for k, n in laws.items()}
    model = replace(fit.model, noises=expected)
    cost = float(np.sum(model.residual(fit.x) ** 2))
    learned = {k: n for k, n in laws.items() if type(n) is Noise and _followed_up(fit, k, n)}
    problem = replace(fit.problem, floor={**fit.problem.floor, **learned})
    covariance = covariance_of(model, fit.x, cost, fit.misfits)
    return replace(fit, model=replace(fit.model, problem=problem), covariance=covariance)


def _asked(fit: Fit) -> dict[Key, Noise]:
    """The law of every channel: chosen where it answers, as it stands elsewhere."""
    found = {}
    for key, noise in fit.model.noises.items():
        assert isinstance(noise, Noise)
        if _answers(fit, key):
            even = noise.even if isinstance(noise, Uneven) else noise
            noise = choose_law(even, _left(fit, key), fit.predicted[key])
        found[key] = noise
    return found


def _answers(fit: Fit, key: Key) -> bool:
    """Whether nothing but noise is left of the records, and nothing is stated of a channel's."""
    only_noise = all(misfit.p_value > SHOWN for misfit in fit.misfits.values())
    return only_noise and fit.sensor_of(key).channel.noise is None


def _followed_up(fit: Fit, key: Key, law: Noise) -> bool:
    """Whether a channel's law has more numbers than one size, and residuals that tell them."""
    return _answers(fit, key) and (isinstance(law, Uneven) or bool(law.coefficients))


def _followed(fit: Fit, laws: Mapping[Key, Noise]) -> dict[Key, Noise]:
    """The same laws with the numbers and weights that the residuals ask for now."""
    found, told = dict(laws), _told(fit, laws)
    for key, noise in laws.items():
        if _followed_up(fit, key, noise):
            values = fit.sensor_of(key).values
            found[key] = likeliest_law(noise, _left(fit, key), values, told.get(key))
    return found


def _told(fit: Fit, laws: Mapping[Key, Noise]) -> dict[Key, Told]:
    """What each channel tells of the unknowns; of records that leave something open, nothing."""
    bare = replace(fit.model, noises=dict.fromkeys(fit.keys, Noise((), 1.0)))
    raw, blocks, low = bare.jacobian(fit.x), {}, 0
    for key in fit.keys:
        high = low + len(fit.sensor_of(key).values)
        blocks[key] = raw[low:high]
        low = high
    total = raw[low:].T @ raw[low:]
    own = {}
    for key, block in blocks.items():
        law = laws[key]
        white = (law.expected if isinstance(law, Uneven) else law).whiten(block)
        own[key] = white.T @ white
        total = total + own[key]
    total = total + BLIND * np.diag(np.diag(total)) + 1e-300 * np.eye(len(total))
    found = {}
    for key, block in blocks.items():
        if key[0] in fit.model.marginals:
            continue
        moves = np.any(block != 0.0, axis=0)
        rest = total - own[key]
        across = rest[np.ix_(moves, ~moves)]
        others = np.linalg.pinv(rest[np.ix_(~moves, ~moves)], hermitian=True)
        schur = rest[np.ix_(moves, moves)] - across @ others @ across.T
        found[key] = Told(block[:, moves], schur)
    return found


def _left(fit: Fit, key: Key) -> np.ndarray:
    """Residual of a channel, as loud as its noise although some of it was followed [SI]."""
    count = len(fit.sensor_of(key).values)
    return fit.residual_of(key) * np.sqrt(count / max(count - fit.taken.get(key, 0.0), 1.0))
