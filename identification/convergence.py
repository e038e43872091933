"""Whether sampling has gone on long enough: ranks, effective samples, memory, as a gate."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from arviz_stats.base.array import array_stats

MOST_R_HAT = 1.01
"""Largest rank-normalized split R-hat with which a posterior is handed out [-]."""

FEWEST_EFFECTIVE = 400.0
"""Fewest effective samples, in the bulk and in the tails, for the same [-]."""

FEWEST_MEMORIES = 50.0
"""Fewest steps in units of the autocorrelation time for the same [-]: with fewer, that time
itself is not known."""

TAIL = 0.05
"""The tails begin at this quantile and at one less it [-]."""

FARTHEST = 100.0
"""Beyond this factor an estimate of the steps that are still needed means nothing [-]."""

MARGIN = 1.2
"""What an estimate of the steps that are needed is raised by, for its own chance [-]."""

DROPPED = 0.2
"""Share of a chain's beginning that never counts [-]."""

CONVERGED = "The posterior has converged."


@dataclass(frozen=True, eq=False)
class Convergence:
    """What the gate looks at, one number an unknown.

    Attributes:
        r_hat: rank-normalized split R-hat, the larger of that between all walkers and that
            between whole ensembles, shape (d,) [-].
        ess_bulk: effective samples of the middle, shape (d,) [-].
        ess_tail: effective samples of the tails, shape (d,) [-].
        memory: autocorrelation time, shape (d,) [steps].
        steps: steps that count, of each walker [-].
        dropped: steps before those [-].
    """

    r_hat: np.ndarray
    ess_bulk: np.ndarray
    ess_tail: np.ndarray
    memory: np.ndarray
    steps: int
    dropped: int = 0

    @property
    def lack(self) -> float:
        """How many times as many steps are needed [-]; at most 1 where the gate is passed."""
        worst = [
            np.max((self.r_hat**2 - 1.0) / (MOST_R_HAT**2 - 1.0)),
            np.max(FEWEST_EFFECTIVE / self.ess_bulk),
            np.max(FEWEST_EFFECTIVE / self.ess_tail),
            np.max(FEWEST_MEMORIES * self.memory / self.steps),
        ]
        return FARTHEST if not np.all(np.isfinite(worst)) else float(max(worst))

    @property
    def passed(self) -> bool:
        """Whether the posterior may be handed out."""
        return self.lack <= 1.0

    @property
    def wanted_steps(self) -> int:
        """Steps in all that would be enough, from how the gate's numbers change with length [-]."""
        counting = self.steps * min(MARGIN * max(self.lack, 1.0), FARTHEST)
        return math.ceil(max(counting + self.dropped, counting / (1.0 - DROPPED)) / 100.0) * 100

    @property
    def status(self) -> str:
        """One sentence."""
        if self.passed:
            return CONVERGED
        return f"not converged: run longer (estimated {self.wanted_steps} steps)"


def judge(draws: np.ndarray, memory: np.ndarray, dropped: int = 0) -> Convergence:
    """Numbers of the gate for walkers of several independent ensembles.

    Walkers of one ensemble lean on each other, ensembles do not. So R-hat is asked twice: of every
    walker as a chain, as a reader of the file would, and of every ensemble as one chain.

    Args:
        draws: shape (steps, ensembles, walkers, d) [any units].
        memory: autocorrelation time, shape (d,) [steps].
        dropped: steps before these draws, which do not count [-].

    Returns:
        The numbers of each unknown.

    Source: Vehtari et al. 2021, doi:10.1214/20-BA1221, by arviz-stats.
    """
    steps, ensembles, walkers, size = draws.shape
    found = np.full((3, size), np.nan)
    for index in range(size):
        one = draws[..., index]
        chains = one.reshape(steps, ensembles * walkers).T
        whole = one.transpose(1, 0, 2).reshape(ensembles, steps * walkers)
        if np.ptp(one) > 0:
            found[0, index] = max(array_stats.rhat(chains), array_stats.rhat(whole))
            found[1, index] = array_stats.ess(chains, method="bulk")
            found[2, index] = array_stats.ess(chains, method="tail", prob=(TAIL, 1 - TAIL))
    return Convergence(found[0], found[1], found[2], memory, steps, dropped)
