"""A posterior: draws of a fit's unknowns, with the gate's verdict on them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .convergence import Convergence
from .fit import Fit
from .unknowns import Unknown


@dataclass(frozen=True, eq=False)
class Posterior:
    """Draws of all unknowns of a fit but those that were integrated.

    Attributes:
        fit: what was sampled around.
        unknowns: what was sampled.
        draws: shape (steps, ensembles, walkers, unknowns) [SI], after the warm-up.
        log_density: shape (steps, ensembles, walkers) [-], up to a constant.
        acceptance: share of proposals that were accepted, shape (ensembles,) [-].
        dropped: steps before those that count [-].
        convergence: the gate's numbers.
        status: one sentence.
    """

    fit: Fit
    unknowns: tuple[Unknown, ...]
    draws: np.ndarray
    log_density: np.ndarray
    acceptance: np.ndarray
    dropped: int
    convergence: Convergence
    status: str

    @property
    def converged(self) -> bool:
        """Whether the gate was passed."""
        return self.convergence.passed

    def index(self, label: str) -> int:
        """Where the unknown with this label stands [-]."""
        return [unknown.label for unknown in self.unknowns].index(label)

    def of(self, label: str) -> np.ndarray:
        """All draws of one unknown, flat [SI]."""
        return self.draws[..., self.index(label)].ravel()
