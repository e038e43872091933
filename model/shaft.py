"""The shaft: Euler's elastica of a cantilever that a load across its root bends at its head."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

LARGEST_BEND = 0.6
"""Bend up to which the shaft is good, over its length [-].

Under a load across its root the force is exact to 2e-5 and the head's place to 3e-6 of the length
up to a bend of 0.5, to 0.4 % and 2e-4 at 0.6, and the force is 1 % off at 0.64. A tension along
the root, which the shape does not follow, adds 1.0 to 1.7 % of force and at most 1.1 % of the
length at 4 EI/a^2, and 2.2 to 4.0 % and at most 1.8 % at 8 EI/a^2; tests/model/test_shaft.py.
"""

LARGEST_TILT = 0.6
"""Angle of the grip against the collet up to which the bend is found, see `bend_of`: to 5e-9 of
the length up to a bend of 0.5, to 6e-6 at 0.6. At 0.8 rad it is 3 % off there. A sleeve as soft as
60 kN/m tilts by about as many radians as the shaft bends meters [rad]."""

FORCE = (36 / 35, 1.21834242, 1.05142835, 3.73574929)
"""Force of a bend s, ``k s (1 + ...)``, as a series in (s/a)^2 [-]."""

SHORTENING = (12 / 35, 0.21357772, 0.23379657)
"""Shortening of a bend s, ``0.6 s^2/a (1 + ...)``, likewise [-]."""

SLOPE = (57 / 280, 0.09661026, 0.05882635)
"""Angle of the head, ``1.5 s/a (1 + ...)``, likewise [-].

Source of the three: the first terms are those of the elastica's own series, the others its values
for bends up to 0.5 by Remez's criterion, from elliptic integrals; Frisch-Fay 1962, Flexible Bars,
section 2.2; tests/model/test_shaft.py integrates the elastica anew.
"""

NEWTON_STEPS = 3
"""Newton steps from the grip's angle and the head's place to the bend; at 0.5 rad and a bend of
half the length they leave 1e-11 of it, at 0.3 of both nothing [-]."""


Loop = Callable[[int, int, Callable[[int, Any], Any], Any], Any]
"""Repeats a step, as ``jax.lax.fori_loop(first, last, step, start)`` does."""


def _repeated(first: int, last: int, step: Callable[[int, Any], Any], start: Any) -> Any:
    for number in range(first, last):
        start = step(number, start)
    return start


class Head(NamedTuple):
    """Where the bent shaft holds the clubhead, seen from the grip's centre in the collet's axes.

    Attributes:
        bend: of the shaft at the head, across the grip's own axis [m].
        along: how far the head is along the collet's axis [m].
        across: and across it [m].
        bend_by: slopes of the bend by `across` [-] and by the grip's angle [m/rad].
        along_by: slopes of `along` by the same [-, m/rad].
        lean: slope of the shortening by the bend [-].
        curve: slope of that by the bend [1/m].
    """

    bend: Any
    along: Any
    across: Any
    bend_by: tuple[Any, Any]
    along_by: tuple[Any, Any]
    lean: Any
    curve: Any


def force(lever: Any, stiffness: Any, bend: Any) -> Any:
    """Force that holds the head at a bend [N].

    Args:
        lever: length of the shaft, grip centre to clubhead [m].
        stiffness: at the head, for small bends [N/m].
        bend: across the shaft's root [m].
    """
    square = (bend / lever) * (bend / lever)
    return stiffness * bend * (1.0 + square * _series(FORCE, square))


def energy(lever: Any, stiffness: Any, bend: Any) -> Any:
    """Elastic energy of a bend, the integral of `force` [J]; arguments as for `force`."""
    square = (bend / lever) * (bend / lever)
    parts = tuple(one / (k + 2) for k, one in enumerate(FORCE))
    return 0.5 * stiffness * bend * bend * (1.0 + square * _series(parts, square))


def shortening(lever: Any, bend: Any) -> tuple[Any, Any, Any]:
    """How much nearer a bend brings the head along the root [m], and its two slopes by the bend.

    Args:
        lever: length of the shaft [m].
        bend: across its root [m].

    Returns:
        The shortening [m], its slope [-] and the slope of that [1/m].
    """
    share = bend / lever
    square = share * share
    first = tuple((k + 2) * one for k, one in enumerate(SHORTENING))
    second = tuple((2 * k + 3) * one for k, one in enumerate(first))
    return (
        0.6 * bend * share * (1.0 + square * _series(SHORTENING, square)),
        1.2 * share * (1.0 + square * _series(first, square)),
        1.2 / lever * (1.0 + square * _series(second, square)),
    )


def slope_at_head(lever: Any, bend: Any) -> Any:
    """Angle of the shaft at its head against its root [rad]; arguments as for `shortening`."""
    share = bend / lever
    square = share * share
    return 1.5 * share * (1.0 + square * _series(SLOPE, square))


def bend_of(lever: Any, across: Any, tilt: Any, loop: Loop = _repeated) -> Any:
    """Bend of a shaft whose root is tilted, of its head's place across the collet [m].

    The bend s solves ``(a - f(s)) sin th + s cos th = across`` for the shortening f, by Newton
    steps of a fixed number: differentiable as often as one likes, of complex numbers too.

    Args:
        lever: length of the shaft a [m].
        across: head against the grip's centre, across the collet's axis [m].
        tilt: angle of the grip against the collet th, its cosine and sine by their series:
            exact to 1e-11 up to half a radian, see `LARGEST_TILT` [rad].
        loop: what repeats a Newton step; ``jax.lax.fori_loop`` keeps a compiler from working the
            bend out anew for each of its users.
    """
    cosine, sine = _axes(tilt)

    def improve(_: int, bend: Any) -> Any:
        short, lean, _ = shortening(lever, bend)
        left = (lever - short) * sine + bend * cosine - across
        return bend - left / (cosine - lean * sine)

    begun = (across - lever * sine) * (1.0 + 0.5 * tilt * tilt)
    return loop(0, NEWTON_STEPS, improve, begun + 0.6 / lever * begun * begun * sine)


def head_at(lever: Any, across: Any, tilt: Any, bend: Any) -> Head:
    """The head of a bent shaft whose root is tilted; arguments as for `bend_of`, and the bend."""
    cosine, sine = _axes(tilt)
    short, lean, curve = shortening(lever, bend)
    along = (lever - short) * cosine - bend * sine
    by_across = 1.0 / (cosine - lean * sine)
    drop = -(lean * cosine + sine) * by_across
    return Head(
        bend, along, across, (by_across, -along * by_across),
        (drop, -across - along * drop), lean, curve,
    )  # fmt: skip


def near_head(lever: Any, across: Any, tilt: Any) -> Head:
    """The head to second order in bend and tilt, for coordinates that are small ones by their law.

    Of the linear robot, whose coordinates may be any numbers; arguments as for `bend_of`.
    """
    bend = across - lever * tilt
    lean = 1.2 * bend / lever
    along = lever - 0.5 * (lever * tilt * tilt + 2.0 * tilt * bend + lean * bend)
    by = 1.0 + 0.0 * bend
    return Head(
        bend, along, across, (by, -lever * by), (-(tilt + lean), 0.2 * bend), lean, 1.2 / lever
    )


def head_moved(lever: Any, head: Head, tilt: Any, moves: tuple[Any, Any, Any]) -> Head:
    """By how much every number of a `Head` changes, to first order; arguments as for `bend_of`.

    Args:
        lever: length of the shaft [m].
        head: of that shaft [SI].
        tilt: angle of the grip [rad].
        moves: small changes of the length, of `Head.across` and of the tilt [m, m, rad].

    Source: the equation of `bend_of`; a shaft all of whose lengths grow alike keeps its angles.
    """
    cosine, sine = _axes(tilt)
    grown, turned = moves[0] / lever, moves[2]
    across = moves[1] - head.across * grown
    bend = head.bend_by[0] * across + head.bend_by[1] * turned
    sharper = _curve_slope(lever, head.bend) * bend - head.curve * grown
    steeper = head.curve * bend
    below = -steeper * sine - (head.lean * cosine + sine) * turned
    above = -steeper * cosine - (cosine - head.lean * sine) * turned
    drop = head.bend_by[0] * (above - head.along_by[0] * below)
    by_across = -head.bend_by[0] * head.bend_by[0] * below
    along = head.along_by[0] * across + head.along_by[1] * turned + head.along * grown
    return Head(
        bend + head.bend * grown, along, moves[1],
        (by_across, -along * head.bend_by[0] - head.along * by_across),
        (drop, -moves[1] - along * head.along_by[0] - head.along * drop), steeper, sharper,
    )  # fmt: skip


def rates(head: Head, across_rate: Any, tilt_rate: Any) -> tuple[Any, Any]:
    """Rates of the bend and of `Head.along` [m/s].

    Args:
        head: where it is.
        across_rate: of `Head.across` [m/s].
        tilt_rate: of the grip's angle [rad/s].
    """
    return (
        head.bend_by[0] * across_rate + head.bend_by[1] * tilt_rate,
        head.along_by[0] * across_rate + head.along_by[1] * tilt_rate,
    )


def acceleration(
    head: Head, bend_rate: Any, tilt_rate: Any, across_bend: Any, tilt_bend: Any
) -> Any:
    """Rate of the rate of `Head.along` [m/s^2].

    Args:
        head: where it is.
        bend_rate: of the bend [m/s].
        tilt_rate: of the grip's angle [rad/s].
        across_bend: rate of the rate of `Head.across` [m/s^2].
        tilt_bend: that of the grip's angle [rad/s^2].

    Source: the equation of `bend_of`, differentiated twice.
    """
    both = 2.0 * (1.0 + head.lean * head.lean) * tilt_rate
    inward = head.bend_by[0] * bend_rate * (head.curve * bend_rate + both)
    inward = inward + (head.along - head.along_by[0] * head.across) * tilt_rate * tilt_rate
    return head.along_by[0] * across_bend + head.along_by[1] * tilt_bend - inward


_COSINE = (-1 / 2, 1 / 24, -1 / 720, 1 / 40320, -1 / 3628800)
_SINE = (-1 / 6, 1 / 120, -1 / 5040, 1 / 362880)


def _curve_slope(lever: Any, bend: Any) -> Any:
    """Third slope of the shortening by the bend [1/m^2]."""
    share = bend / lever
    parts = tuple((2 * k + 2) * (2 * k + 3) * (k + 2) * one for k, one in enumerate(SHORTENING))
    return 1.2 / lever / lever * share * _series(parts, share * share)


def _axes(tilt: Any) -> tuple[Any, Any]:
    """Cosine and sine of the grip's angle."""
    square = tilt * tilt
    return 1.0 + square * _series(_COSINE, square), tilt * (1.0 + square * _series(_SINE, square))


def _series(parts: tuple[float, ...], x: Any) -> Any:
    """A polynomial by Horner's rule, its constant first [-]."""
    total = parts[-1]
    for part in reversed(parts[:-1]):
        total = part + x * total
    return total
