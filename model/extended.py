"""The laws of an extended rig at work: read, set at rest, and marched from jump to jump."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from .door import nearest, one_of
from .drives import ON_SAMPLE, Drive
from .law import Law, library
from .linear import Mechanism, state_space
from .plant import Plant
from .prescribed import AT_REST
from .respond import state_history

WIDTH = 0.01
"""Share of the root mean square motion over which corners are rounded, where not stated [-]."""

WIDTHS = ("stretch_width", "rate_width")
"""What a law's table may say about the rounding of its corners [m or rad, m/s or rad/s]."""

CHUNK = 512
"""Steps that are marched at once, so that one compiled length serves every motion [-]."""

REST = 32
"""The same for what is left of a motion whose laws remember [-]."""

POINTS_PER_WAVE = 200


@dataclass(frozen=True)
class Acting:
    """A law at its place, with its strength.

    Attributes:
        place: where it acts.
        law: one of the library's laws that act by a force.
        strength: in the law's unit at that place [SI].
        shapes: its further numbers, in the law's order [SI].
        stretch_width: rounding of corners in the stretch; None: from the motion [m or rad].
        rate_width: rounding of corners in the rate; None: from the motion [m/s or rad/s].
    """

    place: str
    law: Law
    strength: float
    stretch_width: float | None = None
    rate_width: float | None = None
    shapes: tuple[float, ...] = ()


def acting_laws(tables: Iterable[Mapping[str, Any]], mechanism: Mechanism) -> tuple[Acting, ...]:
    """The laws that act by a force, out of the tables of an extended rig.

    Laws of a sensor are passed over: they fault what is measured, not the motion.

    Args:
        tables: ``law``, ``place`` and ``parameters``: the strength by its symbol, as a number or a
            table with ``value`` [SI], and optionally `WIDTHS`.
        mechanism: what they act on.

    Returns:
        The laws in the order of the tables.

    Raises:
        ValueError: for an unknown law, place or parameter, or a strength that is missing.
    """
    return tuple(
        _acting(table, index, mechanism)
        for index, table in enumerate(tables)
        if not (table["law"] in library() and not library()[table["law"]].acts)
    )


def _acting(table: Mapping[str, Any], index: int, mechanism: Mechanism) -> Acting:
    refuse = refusal(index)
    name, place = str(table["law"]), str(table["place"])
    if name not in library():
        mend = f"write '{nearest(name, library()) or 'coulomb_friction'}'"
        raise refuse("law", one_of(library()), f"'{name}'", mend)
    law, kinds = library()[name], mechanism.law_places()
    turns = mechanism.turns(place) if place in kinds else False
    fitting = [at for at, kind in kinds.items() if law.fits(kind, mechanism.turns(at))]
    if place not in fitting:
        expected = f"a place where '{name}' can act: {one_of(fitting)}"
        mend = "write one of them" if fitting else "remove this law"
        raise refuse("place", expected, f"'{place}'", mend)
    units = [law.unit(turns), *(shape.unit(turns) for shape in law.shapes)]
    given = stated(table, law.symbol_at(turns), law, units, refuse, WIDTHS)
    shapes = tuple(given[shape.symbol] for shape in law.shapes)
    wide, fast = (given.get(key) for key in WIDTHS)
    return Acting(place, law, given[law.symbol_at(turns)], wide, fast, shapes)


def refusal(index: int) -> Callable[[str, str, str, str], ValueError]:
    """What makes the error of one table of ``[[laws]]`` of key, expected, found and mend [-]."""

    def refuse(key: str, expected: str, found: str, mend: str) -> ValueError:
        at = f"[[laws]] item {index} {key}"
        return ValueError(f"{at}: expected {expected}, found {found}. Mend: {mend}.")

    return refuse


def stated(
    table: Mapping[str, Any],
    symbol: str,
    law: Law,
    units: Sequence[str],
    refuse: Callable[[str, str, str, str], ValueError],
    more: tuple[str, ...] = (),
) -> dict[str, float]:
    """The numbers that a law's table states, by their symbols [SI].

    Args:
        table: ``parameters``, of numbers or tables with ``value``.
        symbol: of the strength.
        law: tells its shapes.
        units: of the strength and of each shape, for messages.
        refuse: makes the error of key, expected, found and mend.
        more: widths that may be stated too.

    Raises:
        ValueError: for a number that is missing, unknown or not above 0.
    """
    shapes = [shape.symbol for shape in law.shapes]
    given = {key: _value(entry) for key, entry in table.get("parameters", {}).items()}
    for key in given:
        if key not in (symbol, *shapes, *more):
            raise refuse("parameters", one_of((symbol, *shapes, *more)), f"'{key}'", "remove it")
    for wanted, unit in zip((symbol, *shapes), units, strict=True):
        if wanted not in given:
            raise refuse("parameters", f"'{wanted}' [{unit}]", "nothing", f"add {wanted} = ...")
    for key in shapes:
        if not given[key] > 0:
            raise refuse(key, "a number above 0", f"{given[key]:g}", "correct it")
    for key in more:
        if key in given and not given[key] > 0:
            raise refuse(key, "a width above 0", f"{given[key]:g}", "remove it, or widen it")
    return given


def _value(entry: Any) -> float:
    return float(entry["value"] if isinstance(entry, Mapping) else entry)


def law_places(laws: Iterable[Acting]) -> tuple[str, ...]:
    """The places where laws act, each once [-]."""
    return tuple(dict.fromkeys(acting.place for acting in laws))


def strengths(plant: Plant, laws: Iterable[Acting]) -> np.ndarray:
    """Strength and shapes of each law of a plant, in the order of its vector [SI].

    Raises:
        ValueError: where a law with shapes acts twice at a place.
    """
    found = np.zeros(len(plant.law_numbers))
    slots = {
        (place, law.name, symbol): index
        for index, (place, law, symbol) in enumerate(plant.law_numbers)
    }
    for acting in laws:
        at = slots[acting.place, acting.law.name, ""]
        if acting.shapes and found[at]:
            raise ValueError(
                f"[[laws]] {acting.law.name} at '{acting.place}': expected once, found twice. "
                "Mend: remove one."
            )
        found[at] += acting.strength
        found[at + 1 : at + 1 + len(acting.shapes)] = acting.shapes
    return found


def widths(
    plant: Plant, laws: Iterable[Acting], stretch: np.ndarray, rate: np.ndarray
) -> np.ndarray:
    """Rounding widths of the plant's law places: as stated, or a share of the motion.

    Args:
        plant: tells the places.
        laws: what the rig says.
        stretch: root mean square at each place, shape (places,) [m or rad].
        rate: root mean square at each place, shape (places,) [m/s or rad/s].

    Returns:
        Shape (places, 2) [SI].
    """
    found = np.maximum(WIDTH * np.stack([stretch, rate], axis=1), 1e-12)
    for acting in laws:
        row = plant.law_places.index(acting.place)
        for column, stated in enumerate((acting.stretch_width, acting.rate_width)):
            if stated is not None:
                found[row, column] = stated
    return found


def march(
    plant: Plant,
    z: np.ndarray,
    drive: Drive,
    times: np.ndarray,
    rounding: np.ndarray,
    refinement: int,
) -> tuple[np.ndarray, np.ndarray]:
    """States and law forces at the samples; the motion is cut where the drive jumps.

    Constant forces and joints through a profile are exact up to the integrator. A sine is marched
    as a broken line whose fundamental is that sine, at least `POINTS_PER_WAVE` points a wave.

    Args:
        plant: mechanism with its law places and the drive's ports.
        z: numbers, strengths and start state, see `Plant` [SI].
        drive: what drives it.
        times: uniform samples [s].
        rounding: widths of the law places, shape (places, 2) [SI].
        refinement: steps a sample.

    Returns:
        states (t, states) and law forces (t, law rows) [SI].
    """
    step = float(times[1] - times[0])
    last = len(times) - 1
    fastest = max([drive.frequency, *(joint.frequency for joint in drive.joints)])
    per_wave = POINTS_PER_WAVE * fastest * step / (2 * np.pi)
    runner = _Runner(plant, z, drive, rounding, step)
    fine = max(refinement, int(np.ceil(per_wave)) * refinement)
    x = carried_start(plant, z, drive)
    states = np.zeros((last + 1, len(x)))
    forces: np.ndarray | None = None
    for begin, end in pairwise([0.0, *_cuts(drive, step, last), last * step]):
        first, final = int(np.ceil(begin / step - ON_SAMPLE)), int(end / step + ON_SAMPLE)
        x, middle = runner.jump(x, begin), 0.5 * (begin + end)
        if first > final:
            x = runner.across(x, begin, end - begin, middle)
            continue
        x = runner.across(x, begin, first * step - begin, middle)
        run, pull = runner.run(x, first * step, step / fine, (final - first) * fine, middle)
        states[first : final + 1] = run[::fine]
        forces = np.zeros((last + 1, pull.shape[1])) if forces is None else forces
        forces[first : final + 1] = pull[::fine]
        x = runner.across(run[-1], final * step, end - final * step, middle)
    assert forces is not None
    return states, forces


def carried_start(plant: Plant, z: np.ndarray, drive: Drive) -> np.ndarray:
    """Start state (states,) with the prescribed joints at their beginning, the collet along [SI].

    Args:
        plant: mechanism with the drive's ports.
        z: its start state is meant relative to the joints [SI].
        drive: tells the joints.
    """
    x = z[plant.slots["start"]].copy()
    n, mechanism = len(plant.mechanism.coordinates), plant.mechanism
    for index, joint in enumerate(drive.joints):
        along = np.asarray(mechanism.carried[mechanism.grounds.index(joint.joint)])
        for order, value in enumerate(joint.begin):  # angle, velocity
            x[order * n : (order + 1) * n] += value * along
            x[2 * n + 2 * index + order] += value
    return x


def _cuts(drive: Drive, step: float, last: int) -> list[float]:
    """Instants that the march must not step over: those between samples, and all real jumps."""
    marked = dict.fromkeys(drive.edges, drive.frequency > 0)
    for joint in drive.joints:
        size = np.max(np.abs([(*joint.begin, 0.0, 0.0), *joint.pieces]), axis=0)
        for edge, jump in zip(joint.edges, joint.jumps, strict=True):
            is_jump = bool(np.any(np.abs(jump[:3]) > AT_REST * size[:3])) or joint.frequency > 0
            marked[edge] = marked.get(edge, False) or is_jump
    found = []
    for edge in sorted(marked):
        on_sample = abs(edge / step - round(edge / step)) <= ON_SAMPLE
        if 0.0 < edge < (last - ON_SAMPLE) * step and (marked[edge] or not on_sample):
            found.append(round(edge / step) * step if on_sample else edge)
    return found


class _Runner:
    """Marches piece after piece; between them it keeps what laws remember."""

    def __init__(
        self, plant: Plant, z: np.ndarray, drive: Drive, rounding: np.ndarray, step: float
    ) -> None:
        self.plant, self.z, self.drive = plant, z, drive
        self.rounding, self.step = rounding, step
        self.memory: np.ndarray | None = None
        strength = z[plant.slots["strengths"]]
        self.remembers = any(
            law.memory is not None and not symbol and value != 0
            for (_, law, symbol), value in zip(plant.law_numbers, strength, strict=True)
        )

    def jump(self, x: np.ndarray, time: float) -> np.ndarray:
        """State after the velocities of the joints jump at a time [s]; x itself where none does."""
        drive, tolerance = self.drive, ON_SAMPLE * self.step
        count, n = len(self.plant.inputs), len(self.plant.mechanism.coordinates)
        for index, joint in enumerate(drive.joints):
            for edge, change in zip(joint.edges, joint.jumps[:, 1], strict=True):
                if abs(edge - time) <= tolerance and change:
                    port = count - len(drive.joints) + index
                    x = x.copy()
                    x[2 * n + 2 * index + 1] += change
                    x[n : 2 * n] += change * self._pushes[n : 2 * n, port]
        return x

    @cached_property
    def _pushes(self) -> np.ndarray:
        numbers = {
            name: float(value) for name, value in self.plant.numbers(jnp.asarray(self.z)).items()
        }
        return np.asarray(state_space(self.plant.mechanism, numbers, self.plant.inputs).b)

    def across(self, x: np.ndarray, begin: float, length: float, inside: float) -> np.ndarray:
        """State after a part of a sampling interval, `length` [s]; see `run`."""
        if length <= ON_SAMPLE * self.step:
            return x
        return self.run(x, begin, length / CHUNK, CHUNK, inside)[0][-1]

    def run(
        self, x: np.ndarray, begin: float, node: float, count: int, inside: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """States and law forces at `count` + 1 nodes from `begin` on, `node` apart [s].

        `inside` is a time [s] between the two jumps that enclose the run.
        """
        states, forces, low = [], [], 0
        while not states or low < count:
            long = self._length(count - low)
            at = begin + node * (low + np.arange(long + 1))
            z = self.z.copy()
            z[self.plant.slots["start"]] = x
            run, pull, memory = state_history(
                self.plant, 1, jnp.asarray(z), self._inputs(at, begin, node, inside), node,
                jnp.asarray(self.rounding), self.memory,
            )  # fmt: skip
            if self.remembers and long <= count - low:
                self.memory = memory
            kept = slice(0 if low == 0 else 1, min(long, count - low) + 1)
            states.append(run[kept])
            forces.append(pull[kept])
            x, low = run[kept][-1], low + long
        return np.concatenate(states), np.concatenate(forces)

    def _length(self, left: int) -> int:
        """Steps to march at once: one compiled length, or few that end where memory is wanted."""
        if not self.remembers or left >= CHUNK:
            return CHUNK
        return REST if left >= REST else 1

    def _inputs(self, at: np.ndarray, begin: float, node: float, inside: float) -> jax.Array:
        columns = [] if self.drive.port is None else [self._force(at, begin, node)]
        tolerance = ON_SAMPLE * self.step
        for joint in self.drive.joints:
            if joint.frequency:
                fundamental = np.sinc(joint.frequency * node / (2 * np.pi)) ** 2
                bend = joint.at(at, np.full(len(at), inside))[:, 2] / fundamental
            else:
                # at an edge that ends the run the old piece, inside the run each its own
                near = at + np.where(at < inside, tolerance, -tolerance)
                bend = joint.at(at, near)[:, 2]
            columns.append(bend)
        return jnp.asarray(np.stack(columns, axis=1) if columns else np.zeros((len(at), 0)))

    def _force(self, at: np.ndarray, begin: float, node: float) -> np.ndarray:
        drive, tolerance = self.drive, ON_SAMPLE * self.step
        if not drive.frequency:
            return drive.level(at, tolerance)
        level = drive.level(np.array([begin]), tolerance)[0]
        fundamental = np.sinc(drive.frequency * node / (2 * np.pi)) ** 2
        return level / fundamental * np.sin(drive.frequency * (at - drive.edges[0]))
