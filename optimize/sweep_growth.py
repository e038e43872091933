"""Exponentials of poles over spans of time, and their powers."""

from __future__ import annotations

from typing import Any

import numpy as np


def growth(poles: np.ndarray, span: float) -> np.ndarray:
    """``exp(poles span)``, much quicker where most poles are real.

    Args:
        poles: any shape [1/s].
        span: a time [s].

    Returns:
        The same shape [1].
    """
    if span == 0:
        return np.ones_like(poles)
    if not poles.flags.c_contiguous:
        return growth(np.ascontiguousarray(poles.T), span).T
    found: Any = np.exp(np.real(poles) * span).astype(complex)
    turning = np.imag(poles) != 0
    turn, size = np.imag(poles)[turning] * span, found.real[turning]
    found.real[turning], found.imag[turning] = size * np.cos(turn), size * np.sin(turn)
    return found


def less_one(poles: np.ndarray, span: float) -> np.ndarray:
    """``exp(poles span) - 1``, sharp where that is small.

    Args:
        poles: any shape [1/s].
        span: a time [s].

    Returns:
        The same shape [1].
    """
    found: Any = np.expm1(np.real(poles) * span).astype(complex)
    turning = np.imag(poles) != 0
    turn, less = np.imag(poles)[turning] * span, found.real[turning]
    found.real[turning] = less * np.cos(turn) - 2.0 * np.sin(0.5 * turn) ** 2
    found.imag[turning] = (less + 1.0) * np.sin(turn)
    return found


def halves(poles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Factors with which real parts alone add up to the response, for starts and for powers.

    Of two conjugates the first carries twice the real part, the second the imaginary one.

    Args:
        poles: any shape [1/s].

    Returns:
        Those of the starts and those of the powers, the same shape [1].
    """
    turn = np.imag(poles)
    starts = np.where(turn > 0, 2.0, np.where(turn < 0, 2j, 1.0))
    return starts, np.where(turn < 0, -1j, 1.0)


def powers(first: np.ndarray, ratio: np.ndarray, count: int) -> np.ndarray:
    """Geometric sequences, by doubling.

    Args:
        first: shape (...,) [any unit].
        ratio: shape (...,) [1].
        count: terms [-].

    Returns:
        ``first ratio^k`` for k < count, shape (count, ...) [unit of `first`].
    """
    found = np.empty((count, *first.shape), np.result_type(first, ratio))
    found[0] = first
    done, jump = 1, ratio
    while done < count:
        more = min(done, count - done)
        np.multiply(found[:more], jump, out=found[done : done + more])
        done, jump = done + more, jump * jump
    return found


def by_design(sequences: np.ndarray) -> np.ndarray:
    """Real parts of (terms, designs, modes) as (designs, terms, modes), side by side [any]."""
    return np.ascontiguousarray(np.real(sequences).transpose(1, 0, 2))
