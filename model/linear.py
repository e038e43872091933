"""The linear part of a mechanism: state space, exact discretization, modes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import jax
import jax.numpy as jnp
import numpy as np

from .chain import DERIVATIVES, FORCES, GROUND, Chain
from .energies import Rows, damping_matrix, mass_matrix, stiffness_matrix
from .ground import Driven, driven_grounds, ground_rows
from .kept import keepable

Array = jax.Array


class Mechanism(Protocol):
    """What a chain and a robot have in common; rows and forces carry SI units [m, rad, N]."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of its numbers, each in its SI unit."""
        ...

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of its generalized coordinates [m or rad]."""
        ...

    @property
    def grounds(self) -> tuple[str, ...]:
        """What can be moved from outside [m or rad]: the columns of rows after the coordinates."""
        ...

    @property
    def carried(self) -> tuple[tuple[float, ...], ...]:
        """How far each coordinate starts moved along with each ground [1]."""
        ...

    def turns(self, place: str) -> bool:
        """Whether a place turns [rad] rather than moves [m]."""
        ...

    def law_places(self) -> dict[str, str]:
        """Where a law can act, and of what kind the place is."""
        ...

    def rows(self, p: Mapping[str, Any], xp: Any = ...) -> Rows:
        """Rows of the energies [SI]."""
        ...

    def place_rows(self, place: str, p: Mapping[str, Any], xp: Any = ...) -> tuple[Any, Any, Any]:
        """Stretch rows, stiffness and damping of a place [SI]."""
        ...

    def push_rows(self, place: str, p: Mapping[str, Any], xp: Any = ...) -> Any:
        """Generalized forces of unit forces in the rows of a place [SI]."""
        ...

    def force_row(self, place: str, p: Mapping[str, Any], xp: Any = ...) -> Any:
        """Generalized force of a unit force or torque at a place [1 or m]."""
        ...

    def sensor_row(self, place: str, quantity: str, frame: str, p: Any, xp: Any = ...) -> Any:
        """Row of a sensor over coordinates and ground [SI]."""
        ...


@dataclass(frozen=True)
class Port:
    """Where something acts on a mechanism or is seen of it.

    Attributes:
        place: the contract's place.
        quantity: the contract's quantity.
        frame: ``absolute`` or ``collet``; for sensors.
        held: whether an input stays constant between samples instead of linear.
    """

    place: str
    quantity: str
    frame: str = "absolute"
    held: bool = False


@keepable
@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class StateSpace:
    """``x' = A x + B w``, ``y = C x + D w`` with x = (q, v, grounds), w = (inputs, law forces).

    Attributes:
        a: shape (states, states) [SI unit of the state a second and a unit of the state].
        b: shape (states, inputs + law rows) [SI unit of the state a second and a unit of w].
        c: shape (sensors, states) [SI unit of the sensor a unit of the state].
        d: shape (sensors, inputs + law rows) [SI unit of the sensor a unit of w].
        stretch: shape (law rows, states): stretch of each law row [m or rad].
        rate: shape (law rows, states): its rate [m/s or rad/s].
        rate_input: shape (law rows, inputs): what a moving ground adds to the rate [1].
        stiffness: shape (law rows,) [N/m or N m/rad].
        damping: shape (law rows,) [N s/m or N m s/rad].
    """

    a: Array
    b: Array
    c: Array
    d: Array
    stretch: Array
    rate: Array
    rate_input: Array
    stiffness: Array
    damping: Array


def moved_grounds(inputs: tuple[Port, ...]) -> tuple[Driven, ...]:
    """The grounds that inputs move, in the order of the inputs."""
    return driven_grounds([port.quantity for port in inputs])


def state_space(
    mechanism: Mechanism,
    p: Mapping[str, Any],
    inputs: tuple[Port, ...] = (),
    sensors: tuple[Port, ...] = (),
    law_places: tuple[str, ...] = (),
) -> StateSpace:
    """State space of the linear mechanism, with ports for inputs, sensors and laws.

    A ground moved by position or velocity is a state driven by its rate; one moved by
    acceleration is two states. A robot's joint is moved by its acceleration alone, because an arm
    carries masses; `supple.model.told` makes it of sampled angles.

    Args:
        mechanism: chain or robot.
        p: its numbers by name [SI].
        inputs: forces, torques and at most one motion of each ground.
        sensors: what is measured.
        law_places: places where laws act.

    Returns:
        The matrices, differentiable in `p`.

    Raises:
        ValueError: for a motion given to what cannot be moved, or a sensor that would need a
            derivative of the ground's motion which its drive does not have.

    Source: Lagrange's equations of the energies; tests/model/test_respond.py,
    tests/model/test_robot_motion.py.
    """
    columns = _ground_columns(mechanism, p, inputs, sensors)
    rows = mechanism.rows(p)
    n = len(mechanism.coordinates)
    mass, damping, stiffness = mass_matrix(rows), damping_matrix(rows), stiffness_matrix(rows)
    inverse = jnp.linalg.inv(mass[:n, :n])
    places = [mechanism.place_rows(place, p) for place in law_places]
    law_rows = jnp.concatenate([jnp.zeros((0, mass.shape[1]))] + [place[0] for place in places])
    count = len(inputs)
    width = count + law_rows.shape[0]
    driven = moved_grounds(inputs)
    ground = ground_rows(driven, columns, mass.shape[1] - n, (2 * n, width))
    size = 2 * n + len(ground.change)

    pushed = jnp.zeros((n, size + width))  # generalized forces from outside
    for index, port in enumerate(inputs):
        if port.quantity in FORCES:
            pushed = pushed.at[:, size + index].add(mechanism.force_row(port.place, p))
    pushes = [jnp.zeros((0, n)), *(mechanism.push_rows(place, p) for place in law_places)]
    pushed = pushed.at[:, size + count :].set(-jnp.concatenate(pushes).T)
    q = jnp.eye(n, size + width)
    v = jnp.eye(n, size + width, k=n)
    pulled = stiffness[:n, :n] @ q + damping[:n, :n] @ v
    pulled = pulled + stiffness[:n, n:] @ ground.position + damping[:n, n:] @ ground.velocity
    bend = inverse @ (pushed - pulled - mass[:n, n:] @ ground.acceleration)

    whole = jnp.concatenate([v, bend, ground.change])
    stretch = law_rows[:, :n] @ q + law_rows[:, n:] @ ground.position
    rate = law_rows[:, :n] @ v + law_rows[:, n:] @ ground.velocity
    seen = [jnp.zeros((0, size + width))]
    for port in sensors:
        row = mechanism.sensor_row(port.place, port.quantity, port.frame, p)
        order = DERIVATIVES[port.quantity]
        own = (q, v, bend)[order]
        moved = (ground.position, ground.velocity, ground.acceleration)[order]
        seen.append((row[:n] @ own + row[n:] @ moved)[None])
    outputs, k, c = jnp.concatenate(seen), [jnp.zeros(0)], [jnp.zeros(0)]
    k, c = k + [place[1] for place in places], c + [place[2] for place in places]
    return StateSpace(
        whole[:, :size], whole[:, size:], outputs[:, :size], outputs[:, size:],
        stretch[:, :size], rate[:, :size], rate[:, size : size + count],
        jnp.concatenate(k), jnp.concatenate(c),
    )  # fmt: skip


def _ground_columns(
    mechanism: Mechanism, p: Mapping[str, Any], inputs: tuple[Port, ...], sensors: tuple[Port, ...]
) -> list[int]:
    """Which ground each prescribed motion moves; refuse one that the equations would not see."""
    is_chain, columns = isinstance(mechanism, Chain), []
    for port in inputs:
        if port.quantity in FORCES:
            continue
        name = GROUND if is_chain and port.place == "base" else port.place
        told = is_chain or port.quantity == "angular_acceleration"
        if name not in mechanism.grounds or not told:
            what = "a chain's ground" if is_chain or not mechanism.grounds else "a driven joint"
            known = mechanism.grounds or (GROUND,)
            raise ValueError(
                f"inputs: expected a force or torque, or a motion of {what}, found "
                f"quantity = {port.quantity!r} at place = {port.place!r}. Mend: give that channel "
                f"role = 'response', or name place = {' or '.join(map(repr, known))}"
                f"{_needs_model(name, is_chain)}."
            )
        column = mechanism.grounds.index(name)
        if column in columns:
            raise ValueError(
                f"inputs: expected at most one motion of {name!r}, found 2. "
                "Mend: give one of them role = 'response'."
            )
        columns.append(column)
        for sensor in sensors if is_chain else ():
            row = mechanism.sensor_row(sensor.place, sensor.quantity, sensor.frame, p, np)
            known = max(DERIVATIVES[port.quantity], 1)
            if row[-1] != 0 and DERIVATIVES[sensor.quantity] > known:
                raise ValueError(
                    f"sensor at {sensor.place!r}: expected a quantity that the ground's "
                    f"{port.quantity} tells, found {sensor.quantity!r}. Mend: drive the ground "
                    "by its acceleration, or leave that channel out."
                )
    return columns


def _needs_model(place: str, is_chain: bool) -> str:
    models = {"wrist": "'driven_wrist' or 'driven_arm'", "arm": "'passive_wrist' or 'driven_arm'"}
    known = not is_chain and place in models
    return f", or a robot whose {place} is driven: model = {models[place]}" if known else ""


def discretize(a: Array, b: Array, step: Any, orders: int = 3) -> tuple[Array, list[Array]]:
    """Exact transition over `step` for inputs that are polynomials in time.

    Differentiable forwards alone: how often it squares hangs on the numbers.

    Args:
        a: shape (states, states) [SI unit of the state a second and a unit of the state].
        b: shape (states, inputs) [SI unit of the state a second and a unit of the input].
        step: time step h [s].
        orders: how many powers of time.

    Returns:
        ``exp(A h)`` and, for j < orders, the integrals of ``exp(A (h - s)) s^j / j! B`` over the
        step, each of shape (states, inputs).

    Source: Van Loan 1978, doi:10.1109/TAC.1978.1101743, in scaled states and time, which keeps
    ten digits more in stiff sleeves; tests/model/test_linear.py.
    """
    n, m = b.shape
    size = n + orders * m
    scale = _balance(a)
    own = a / scale[:, None] * scale * step
    push = b / scale[:, None] * step
    largest = jax.lax.stop_gradient(jnp.max(jnp.abs(push), axis=0, initial=0.0))
    unit = jnp.where(largest > 0, largest, 1.0)
    block = jnp.zeros((size, size)).at[:n, :n].set(own).at[:n, n : n + m].set(push / unit)
    for j in range(orders - 1):
        low = n + j * m
        block = block.at[low : low + m, low + m : low + 2 * m].set(jnp.eye(m))
    whole = scale[:, None] * _exponential(block)[:n]
    parts = [whole[:, n + j * m : n + (j + 1) * m] * unit * step**j for j in range(orders)]
    return whole[:, :n] / scale, parts


TAYLOR_TERMS = 18


def _exponential(matrix: Array) -> Array:
    """Matrix exponential by scaling, Taylor's series and squaring.

    A tenth of the compile time of jax.scipy's, whose branches are all compiled; after scaling to
    a norm below one half the series' rest is below 1e-22.

    Source: Moler and Van Loan 2003, doi:10.1137/S00361445024180, method 3.
    """
    norm = jax.lax.stop_gradient(jnp.max(jnp.sum(jnp.abs(matrix), axis=0)))
    halvings = jnp.clip(jnp.ceil(jnp.log2(jnp.maximum(norm, 1e-300))) + 1, 0, 60).astype(int)
    small = matrix / jnp.exp2(halvings.astype(float))
    eye = jnp.eye(matrix.shape[0])

    def horner(k: int, total: Array) -> Array:
        return eye + small @ total / (TAYLOR_TERMS - k)

    series = jax.lax.fori_loop(0, TAYLOR_TERMS, horner, eye)
    return jax.lax.fori_loop(0, halvings, lambda _, whole: whole @ whole, series)


def _balance(matrix: Array) -> Array:
    """Scales of the states that make each row as large as its column: squaring loses no digits.

    Source: Osborne 1960, doi:10.1145/321043.321048, in powers of two and without derivatives.
    """
    size = matrix.shape[0]
    bare = jax.lax.stop_gradient(jnp.abs(matrix)) * (1.0 - jnp.eye(size))

    def sweep(_: int, scale: Array) -> Array:
        now = bare / scale[:, None] * scale
        row, column = now.sum(axis=1), now.sum(axis=0)
        whole = (row > 0) & (column > 0)
        ratio = jnp.where(whole, row, 1.0) / jnp.where(whole, column, 1.0)
        return scale * ratio**0.25

    return jnp.exp2(jnp.round(jnp.log2(jax.lax.fori_loop(0, 12, sweep, jnp.ones(size)))))


@keepable
@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Step:
    """Matrices of one step, from the values at its start to its middle and its end.

    Attributes:
        free: transition of the state to (middle, end), each (states, states) [SI units of the
            states' ratios].
        nodes: effect of w at (start, middle, end) on the state at (middle, end), 2 x 3 matrices
            [SI unit of the state a unit of w].
    """

    free: tuple[Array, Array]
    nodes: tuple[tuple[Array, Array, Array], tuple[Array, Array, Array]]


def make_step(space: StateSpace, step: Any) -> Step:
    """Exact step for inputs that are quadratic in time through start, middle and end.

    Args:
        space: state space of the linear part.
        step: h [s].

    Returns:
        The matrices; exact for piecewise-linear and held inputs, of fourth order in the law
        forces.

    Source: Lobatto quadrature nodes with exponential weights, Hochbruck and Ostermann 2010,
    doi:10.1017/S0962492910000048.
    """
    free, nodes = [], []
    for part in (0.5, 1.0):
        transition, psi = discretize(space.a, space.b, part * step)
        first, second = psi[1] / step, psi[2] / step**2
        free.append(transition)
        nodes.append(
            (
                psi[0] - 3 * first + 4 * second,
                4 * first - 8 * second,
                4 * second - first,
            )
        )
    return Step((free[0], free[1]), (nodes[0], nodes[1]))


@dataclass(frozen=True)
class Modes:
    """Oscillating and creeping modes of a linear mechanism.

    Attributes:
        poles: complex poles, one of each pair, slowest oscillation first [1/s].
        frequencies: ``|pole| / (2 pi)`` [Hz].
        damped_frequencies: ``imag(pole) / (2 pi)``; 0 for overdamped modes [Hz].
        damping_ratios: ``-real(pole) / |pole|`` [-].
        shapes: displacement part of each mode's vector, shape (coordinates, modes) [m or rad, to
            a common factor].
    """

    poles: np.ndarray
    frequencies: np.ndarray
    damped_frequencies: np.ndarray
    damping_ratios: np.ndarray
    shapes: np.ndarray


def modes(mechanism: Mechanism, p: Mapping[str, float]) -> Modes:
    """Modes of the free, linear mechanism.

    Args:
        mechanism: chain or robot.
        p: its numbers by name [SI].

    Returns:
        Frequencies [Hz], damping ratios [-] and shapes.

    Source: eigenvalues of the state matrix; tests/model/test_linear.py.
    """
    n = len(mechanism.coordinates)
    a = np.asarray(state_space(mechanism, p).a)
    poles, vectors = np.linalg.eig(a)
    keep = np.imag(poles) >= 0
    poles, vectors = poles[keep], vectors[:n, keep]
    order = np.lexsort((np.abs(poles), np.imag(poles) == 0))
    poles, vectors = poles[order], vectors[:, order]
    size, decay, turn = np.abs(poles), -np.real(poles), np.imag(poles)
    ratio = np.where(size > 0, decay / np.where(size > 0, size, 1.0), 0.0)
    return Modes(poles, size / (2 * np.pi), turn / (2 * np.pi), ratio, vectors)
