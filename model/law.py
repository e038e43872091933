"""A law is what a model may lack; it adds to a mechanism at a place, and is nothing at its null."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np


@dataclass(frozen=True)
class Scales:
    """How large motions and forces are at a place, from which natural strengths are made.

    Attributes:
        stretch: root mean square of the stretch or displacement [m or rad].
        rate: root mean square of its rate [m/s or rad/s].
        force: size of the forces that act there [N or N m].
        stiffness: stiffness of the place [N/m or N m/rad].
        time: one radian of the place's main oscillation [s].
    """

    stretch: float
    rate: float
    force: float
    stiffness: float
    time: float


@dataclass(frozen=True)
class Place:
    """What a law's force may ask about the place where it acts; arrays over the place's rows.

    Attributes:
        stiffness: of the place [N/m or N m/rad].
        damping: of the place [N s/m or N m s/rad].
        stretch_width: width over which a corner in the stretch is rounded [m or rad].
        rate_width: width over which a corner in the rate is rounded [m/s or rad/s].
    """

    stiffness: Any
    damping: Any
    stretch_width: Any
    rate_width: Any


@dataclass(frozen=True)
class Shape:
    """A further number of a law, beside its strength; where it is 0 it is taken as 1.

    Attributes:
        symbol: its name in results, such as ``knee``.
        dimension: exponents of force, length and time in its unit [-].
        trials: values [in its unit] that are worth a trial for motions of the given scales.
        of_channel: whether its unit begins with the channel's.
        guess: of a number that every record has of its own, as a phase is: what it is in a
            residual of shape (n,) [channel's unit] at a sampling interval [s], given the law's
            other shapes. None for a number that all records share.
        sought: of a number that all records share, the values worth a trial as they look in these
            residuals by record, each with its interval; then these stand for `trials`.
    """

    symbol: str
    dimension: tuple[int, int, int]
    trials: Callable[[Scales], tuple[float, ...]]
    of_channel: bool = False
    guess: Callable[[np.ndarray, float, tuple[float, ...]], float] | None = None
    sought: Callable[[Mapping[str, tuple[np.ndarray, float]]], tuple[float, ...]] | None = None

    def unit(self, rotation: bool, channel_unit: str = "") -> str:
        """SI unit as text [-]; arguments as for `Law.unit`."""
        return _with_channel(unit_of(self.dimension, rotation), self.of_channel, channel_unit)


@dataclass(frozen=True)
class Memory:
    """How a law that remembers acts; arrays over the place's rows are the last axis.

    Attributes:
        size: numbers that it remembers [-].
        begin: ``begin(shapes, stretch, rate)``: what it remembers where it has been loaded from
            rest to where the motion begins, shape (size, rows).
        advance: ``advance(shapes, memory, (stretch, rate) before, (stretch, rate) after, step)``:
            what it remembers after so long a step [s] between two instants.
        force: ``force(strength, shapes, memory, stretch, rate)``, the force that resists the
            stretch [N or N m].
        struck: ``struck(shapes, stretch, rate)``: what it remembers just after a blow; None where
            `begin` and `advance` say it.
        placed: whether shapes are followed by the strength and by the stiffness and damping of
            the place, on which what it remembers depends.
    """

    size: int
    begin: Callable[..., Any]
    advance: Callable[..., Any]
    force: Callable[..., Any]
    struck: Callable[..., Any] | None = None
    placed: bool = False

    def shapes_at(self, shapes: Sequence[Any], strength: Any, place: Place) -> Sequence[Any]:
        """Shapes [in their units] as its functions want them, at a strength and a place."""
        if not self.placed:
            return shapes
        return [*shapes, strength, place.stiffness, place.damping]


@dataclass(frozen=True)
class Fault:
    """How a channel misreads what is there; arrays over samples are the first axis.

    Attributes:
        read: ``read(strength, shapes, values, step)``: what it says, shape (n,) [unit].
        along: ``along(strength, shapes, values, step, by_strength, by_shapes, by_values)``:
            derivative of that along k directions, of shapes (k,), one (k,) a shape, and (n, k).
        remembers: whether a reading hangs on what was there before the first sample too.
        counts: whether a reading hangs on the time since the channel's record began: both take
            that of the first sample as ``since`` [s], none where the record begins with it.
        gathers: whether it hangs on what was read until then: both take the integral of that over
            time as ``gathered`` [unit s].
    """

    read: Callable[..., Any]
    along: Callable[..., Any]
    remembers: bool = False
    counts: bool = False
    gathers: bool = False


@dataclass(frozen=True)
class Law:
    """One cause that a model may lack.

    Attributes:
        name: the contract's name.
        kind: where it acts: ``link``, ``mass`` (of a chain), ``head`` (a robot's clubhead, in the
            open), ``body`` (what carries other things), ``support`` (what all is clamped in),
            ``swung`` (all that a told motion swings),
            ``arm`` (one that is told to move), ``spun`` (what it pulls outwards), ``reading``
            (a measured channel), ``response`` (the same, where a drive or another channel says
            what it should read), ``channel`` (a measured channel or a drive's), ``axis`` (an
            accelerometer), ``load`` (the place where a sensor sits) or ``drive`` (a told motion).
        also: further kinds of places where it acts.
        symbol: name of its strength in results, such as ``torque`` or ``gap``.
        dimension: exponents of force, length and time in the strength's unit [-].
        force: ``force(strength, stretch, rate, place)``, the force that resists the stretch
            [N or N m]; ``None`` for a law of a sensor.
        slot: for a law of a sensor, which number of the channel it moves: offset, gain or
            delay; ``fault`` where it misreads in its own way; ``axis`` where it looks another
            way; ``ripple`` where it shakes what is told; ``load`` where it weighs on the rig.
        fault: that way.
        swing: for a law of a told motion, ``swing(strength, stretch, told, rows)``: the force that
            resists the stretch of each row of what is swung [N or N m]; see `supple.model.swung`
            for `told` and `rows`. There it stands for `force`.
        felt: ``felt(strength, told, felt)``, what an accelerometer there reads more [m/s^2].
        of_channel: whether the strength's unit begins with the channel's.
        natural: strength [in its unit] that matters for motions of the given scales.
        signed: whether the strength may be negative.
        dissipative: whether it can only take energy away.
        rotation: True or False where it makes sense for angles or for displacements only.
        replaces: the rig's own number that says the same (``stiffness``, ``damping`` or ``mass``):
            the law is not tried where a fit already varies that number.
        memory: how it acts where its force depends on what went before; then ``force`` is None.
        shapes: its further numbers, always above 0.
        limit: the simpler law that it becomes at an end of its shapes: where that one does nearly
            as well, it is the one to name.
        limit_share: share of the stretch's root mean square below which its first shape is at
            that end [-].
        formula: the equation, for the report.
        sentence: what it means, for the report; ``{place}``, ``{value}`` are filled in.
        cure: what an engineer would try.
        source: where the formula comes from.
    """

    name: str
    kind: str
    symbol: str
    dimension: tuple[int, int, int]
    natural: Callable[[Scales], float]
    formula: str
    sentence: str
    cure: str
    source: str
    force: Callable[[Any, Any, Any, Place], Any] | None = None
    slot: str = ""
    signed: bool = True
    dissipative: bool = False
    rotation: bool | None = None
    replaces: str = ""
    memory: Memory | None = None
    shapes: tuple[Shape, ...] = ()
    limit: str = ""
    limit_share: float = 0.0
    fault: Fault | None = None
    also: tuple[str, ...] = ()
    of_channel: bool = False
    swing: Callable[..., Any] | None = None
    felt: Callable[..., Any] | None = None

    def fits(self, kind: str, rotation: bool) -> bool:
        """Whether it acts by a force at places of this kind, which turn or move [-]."""
        there = kind == self.kind or kind in self.also
        return self.acts and there and self.rotation in (None, rotation)

    @property
    def sticks(self) -> bool:
        """Whether it is a spring in small motions that gives way in large ones [-]."""
        return self.memory is not None and [one.dimension for one in self.shapes] == [(0, 1, 0)]

    @property
    def rings(self) -> bool:
        """Whether it brings an oscillation of its own [-]."""
        return self.memory is not None and any(s.dimension == (0, 0, -1) for s in self.shapes)

    @property
    def acts(self) -> bool:
        """Whether it acts by a force, and is no fault of a sensor."""
        return any(way is not None for way in (self.force, self.memory, self.swing))

    def symbol_at(self, rotation: bool) -> str:
        """Name of the strength [-] at a place that turns or moves."""
        return "torque" if rotation and self.symbol == "force" else self.symbol

    def unit(self, rotation: bool, channel_unit: str = "") -> str:
        """SI unit of the strength as text, for displacements or for angles.

        Args:
            rotation: whether the place turns (N m, rad) or moves (N, m).
            channel_unit: unit of the channel, for laws of a sensor.

        Returns:
            The unit, such as ``N m s^2/rad^2`` [-].
        """
        return _with_channel(unit_of(self.dimension, rotation), self.of_channel, channel_unit)


def _with_channel(own: str, of_channel: bool, channel_unit: str) -> str:
    if not of_channel:
        return own
    return channel_unit if own == "1" else channel_unit + own.removeprefix("1")


INERTIA = (1, -1, 2)
"""Exponents of a mass or a moment of inertia [-]."""


def unit_of(dimension: tuple[int, int, int], rotation: bool) -> str:
    """SI unit [-] of exponents of force, length and time, for displacements or for angles."""
    if dimension == INERTIA:
        return "kg m^2" if rotation else "kg"
    force, length, time = dimension
    top, bottom = [], []
    parts = (
        ("N m" if rotation else "N", force),
        ("s", time),
        ("rad" if rotation else "m", length),
    )
    for symbol, power in parts:
        if power:
            text = symbol if abs(power) == 1 else f"{symbol}^{abs(power)}"
            (top if power > 0 else bottom).append(text)
    return " ".join(top or ["1"]) + ("/" + " ".join(bottom) if bottom else "")


@cache
def library() -> dict[str, Law]:
    """Every law of the house by name, found by looking into ``model/laws``; one file, one law."""
    from . import laws

    found: dict[str, Law] = {}
    for module in sorted(pkgutil.iter_modules(laws.__path__), key=lambda item: item.name):
        law = importlib.import_module(f"{laws.__name__}.{module.name}").LAW
        found[law.name] = law
    return found


@cache
def force_laws(kind: str, rotation: bool) -> tuple[Law, ...]:
    """Laws that act by a force at places of this kind, in the order of the parameter vector."""
    return tuple(law for law in library().values() if law.fits(kind, rotation))
