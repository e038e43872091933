"""Scores of a response: RMS, logarithmic decrement, peak, settling; sampled and in closed form."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .ringdown import FreeResponse, energy, transition

Array = jax.Array
Window = tuple[float, float]

FADED = 0.01
"""Share of the first maximum below which a decay is no longer followed [-]."""

SETTLED = 0.05
"""Share of the peak below which a response has settled [-]."""

EVEN = 1e-6
"""Largest deviation of a sampling interval from their mean that passes for even [-]."""


def rms(samples: Any, times: Any, window: Window | None = None) -> Array:
    """Root mean square of the samples in a window.

    Args:
        samples: shape (..., t), designs leading [any unit]; may be traced.
        times: shape (t,) [s].
        window: first and last time that count [s]; all where None.

    Returns:
        Shape (...) [unit of the samples]. Of nothing but zeros its derivative is 0.

    Raises:
        ValueError: for a window without samples.
    """
    inside, _ = _windowed(samples, times, window)
    return _root(jnp.mean(inside**2, axis=-1))


def peak(samples: Any, times: Any, window: Window | None = None) -> Array:
    """Largest magnitude of the samples in a window; see `rms` for shapes and units."""
    inside, _ = _windowed(samples, times, window)
    return jnp.max(jnp.abs(inside), axis=-1)


def settling(
    samples: Any, times: Any, window: Window | None = None, share: float = SETTLED
) -> Array:
    """Time until the magnitude stays below a share of the peak.

    The instant is read between two samples, on the straight line through their magnitudes.

    Args:
        samples: shape (..., t), designs leading [any unit]; may be traced.
        times: shape (t,) [s].
        window: first and last time that count [s]; all where None.
        share: of the peak [-].

    Returns:
        Shape (...), from the window's first sample on [s]; infinite where the last sample is still
        too large, 0 for a response that is nothing but zeros, NaN for one with a NaN.

    Raises:
        ValueError: for a window without samples.
    """
    inside, when = _windowed(samples, times, window)

    def one(y: Array) -> Array:
        size = jnp.abs(y)
        limit = share * jnp.max(size)
        last = len(when) - 1 - jnp.argmax((size > limit)[::-1])
        after = jnp.minimum(last + 1, len(when) - 1)
        drop = size[last] - size[after]
        part = (size[last] - limit) / jnp.where(drop > 0, drop, 1.0)
        crossed = jnp.asarray(when)[last] + part * (jnp.asarray(when)[after] - when[last])
        found = jnp.where(size[-1] > limit, jnp.inf, crossed - when[0])
        return jnp.where(jnp.any(size > limit), found, 0.0)

    when = jnp.asarray(when)
    return _each(one, inside)


def cycles(samples: Any, times: Any, window: Window | None = None, share: float = SETTLED) -> Array:
    """How many positive maxima stand above a share of the peak.

    Args:
        samples: shape (..., t), designs leading [any unit].
        times: shape (t,) [s].
        window: first and last time that count [s]; all where None.
        share: of the peak [-].

    Returns:
        Shape (...), whole numbers [-]; NaN for samples with a NaN.

    Raises:
        ValueError: for a window without samples.
    """
    inside, _ = _windowed(samples, times, window)

    def one(y: Array) -> Array:
        return jnp.sum(_is_maximum(y) & (y > share * jnp.max(jnp.abs(y))))

    return _each(one, inside)


def log_decrement(
    samples: Any, times: Any, window: Window | None = None, reading: str = "period"
) -> Array:
    """Logarithmic decrement, peak by peak: ``ln(m_0 / m_N) / N`` over N + 1 maxima.

    The maxima are followed down to 1 % of the first; the second one counts even below that, since
    one alone tells nothing.

    Args:
        samples: shape (..., t), designs leading [any unit]; may be traced.
        times: shape (t,), even [s].
        window: first and last time that count [s]; all where None.
        reading: ``period``: the largest bin of the plain spectrum without its constant gives the
            period in whole samples, and m_i is the largest sample of whole period i; ``local``:
            m_i are the successive positive maxima.

    Returns:
        Shape (...) [-]; NaN where fewer than two positive maxima stand, so that there is nothing
        to compare, and for samples with a NaN.

    Raises:
        ValueError: for an unknown reading, uneven times, or a window without samples.

    Source: the thesis's chapter 7.3.1 ("dominant oscillation frequency ... on a peak by peak
    basis") leaves the formula open; `local` over whole maps reproduces its means, see
    tests/model/test_score.py.
    """
    readings = {"period": _by_period, "local": _by_local_maxima}
    if reading not in readings:
        raise ValueError(
            f"reading: expected one of {', '.join(readings)}, found {reading!r}. "
            "Mend: name one of these."
        )
    inside, when = _windowed(samples, times, window)
    steps = np.diff(when)
    if len(steps) and np.max(np.abs(steps - steps.mean())) > EVEN * steps.mean():
        raise ValueError(
            f"times: expected even steps, found some from {steps.min():.6g} to {steps.max():.6g} "
            "s. Mend: resample to even steps."
        )
    return _each(readings[reading], inside)


SCORES: dict[str, Callable[..., Array]] = {
    "rms": rms,
    "log_decrement": log_decrement,
    "log_decrement_local": partial(log_decrement, reading="local"),
    "peak": peak,
    "settling": settling,
    "cycles": cycles,
}
"""Every sampled score by its name; each takes samples [any unit], times [s] and a window [s]."""


def _windowed(samples: Any, times: Any, window: Window | None) -> tuple[Array, np.ndarray]:
    when, samples = np.asarray(times, float), jnp.asarray(samples)
    if samples.shape[-1:] != when.shape:
        raise ValueError(
            f"samples: expected a last axis as long as the {when.size} times, found shape "
            f"{samples.shape}. Mend: put time last."
        )
    if window is None:
        inside = np.ones(len(when), bool)
    else:
        inside = (when >= window[0]) & (when <= window[1])
    if not np.any(inside):
        span = f"from {when[0]:g} to {when[-1]:g} s" if len(when) else "without any"
        raise ValueError(
            f"window: expected one that holds samples, found {window} for times {span}. "
            "Mend: move the window."
        )
    return samples[..., np.flatnonzero(inside)], when[inside]


def _each(one: Callable[[Array], Array], samples: Array) -> Array:
    """A score of one design, for every design of the leading axes; NaN of what holds a NaN."""
    designs = samples.reshape(-1, samples.shape[-1])
    known = ~jnp.any(jnp.isnan(designs), axis=-1)
    found = jax.vmap(one)(designs)
    return jnp.where(known, found, jnp.nan).reshape(samples.shape[:-1])


def _root(square: Array) -> Array:
    """Square root whose derivative at 0 is 0, not infinite times nothing."""
    some = square > 0.0
    return jnp.where(some, jnp.sqrt(jnp.where(some, square, 1.0)), 0.0 * square)


def _is_maximum(y: Array) -> Array:
    """Where a positive sample is larger than the one before and not smaller than the next."""
    padded = jnp.pad(y, 1, constant_values=jnp.inf)  # the ends are no maxima
    return (y > padded[:-2]) & (y >= padded[2:]) & (y > 0)


@jax.jit
def _by_local_maxima(y: Array) -> Array:
    is_maximum = _is_maximum(y)
    first = jnp.argmax(is_maximum)
    faded = jnp.cumsum(is_maximum & (y < FADED * y[first])) > 0
    kept = is_maximum & (~faded | (jnp.cumsum(is_maximum) <= 2))
    last = len(y) - 1 - jnp.argmax(kept[::-1])
    return _decrement(y[first], y[last], jnp.sum(kept) - 1)


@jax.jit
def _by_period(y: Array) -> Array:
    count = len(y)
    if count < 4:
        return jnp.asarray(jnp.nan)
    largest = 1 + jnp.argmax(jnp.abs(jnp.fft.rfft(jax.lax.stop_gradient(y)))[1:])
    period = jnp.round(count / largest).astype(int)
    turn, whole = jnp.arange(count) // period, count // period
    bare = jnp.where(turn < whole, jax.lax.stop_gradient(y), -jnp.inf)
    maxima = jax.ops.segment_max(bare, turn, count // 2 + 1, indices_are_sorted=True)
    faded = jnp.cumsum(maxima < FADED * maxima[0]) > 0
    kept = (jnp.arange(len(maxima)) < whole) & ~faded
    last = jnp.minimum(jnp.maximum(jnp.sum(kept) - 1, 1), whole - 1)

    def top(k: Any) -> Array:  # by its place, which has a derivative
        return y[jnp.argmax(jnp.where(turn == k, bare, -jnp.inf))]

    return _decrement(top(0), top(last), last)


def _decrement(first: Array, last: Array, count: Array) -> Array:
    told = (count > 0) & (first > 0) & (last > 0)
    ratio = jnp.where(told, first, 1.0) / jnp.where(told, last, 1.0)
    return jnp.where(told, jnp.log(ratio) / jnp.maximum(count, 1), jnp.nan)


def closed_rms(response: FreeResponse, window: Window) -> Array:
    """Root mean square of a free response over a window, without sampling.

    Args:
        response: the free response; may be traced.
        window: its beginning, not below 0, and its end [s].

    Returns:
        The root mean square [unit of the sensor]; its derivative is 0 where nothing moves.

    Raises:
        ValueError: for a window that begins before 0 or does not last.

    Source: `energy`.
    """
    begin, end = window
    if not 0.0 <= begin < end < np.inf:
        raise ValueError(
            f"window: expected 0 <= beginning < end < infinity, found {window}. "
            "Mend: write [beginning, end] in s."
        )
    start = response.start if begin == 0 else transition(response.a, begin) @ response.start
    later = FreeResponse(response.a, start, response.row)
    return _root(energy(later, end - begin) / (end - begin))


def modal_decrement(response: FreeResponse) -> Array:
    """Logarithmic decrement of the oscillating mode that carries most of the squared response.

    Args:
        response: the free response; may be traced.

    Returns:
        ``2 pi zeta / sqrt(1 - zeta^2)`` of that mode [-]; infinite where nothing oscillates. Its
        derivative is that of the pole.
    """
    poles = jnp.linalg.eigvals(response.a)
    # which mode it is has no derivative: vectors and shares are taken of the bare numbers
    bare = jax.lax.stop_gradient(response.a)
    own, vectors = jnp.linalg.eig(bare)
    start = jax.lax.stop_gradient(response.start).astype(vectors.dtype)
    shares = (jax.lax.stop_gradient(response.row) @ vectors) * jnp.linalg.solve(vectors, start)
    decay = jnp.maximum(-jnp.real(own), 1e-300)
    carried = jnp.abs(shares) ** 2 / decay - jnp.real(shares**2 / jnp.where(own == 0, 1.0, own))
    oscillates = jnp.imag(own) > 1e-9 * jnp.abs(own)
    largest = jnp.argmax(jnp.where(oscillates, carried, -jnp.inf))
    pole = poles[jnp.argmin(jnp.abs(jax.lax.stop_gradient(poles) - own[largest]))]
    turns = jnp.where(jnp.any(oscillates), jnp.imag(pole), 1.0)
    return jnp.where(jnp.any(oscillates), -2 * jnp.pi * jnp.real(pole) / turns, jnp.inf)
