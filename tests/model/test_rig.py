"""Rigs: the contract's forms are understood, and what is written reads back the same."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given, strategies as st

from supple.model.parameters import Parameter
from supple.model.rig import Rig, read_rig, write_rig
from supple.model.robot import PARAMETERS, PRESETS

CHAIN = """\
[rig]
kind = "chain"
[masses.cart]
mass = { value = 0.17, free = true }
[links.spring]
between = ["ground", "cart"]
stiffness = { value = 24, min = 1, max = 100, free = true, per = "record" }
damping = { value = 0.01, std = 0.002 }
"""

ROBOT = """\
[rig]
kind = "robot"
model = "pinned_wrist"
fidelity = "planar"
preset = "robo_v_sleeve_0"
[parameters]
wrist_stiffness = { value = 300.0, min = 10.0, max = 1e5, free = true }
shaft_stiffness = 140
sleeve_damping = { value = 6000.0, free = true, per = "record" }
"""


def read(text: str, folder: Path) -> Rig:
    path = folder / "rig.toml"
    path.write_text(text, encoding="utf-8")
    return read_rig(path)


def test_a_chain(tmp_path: Path) -> None:
    rig = read(CHAIN, tmp_path)
    assert (rig.kind, rig.motion, rig.model, rig.masses) == ("chain", "translation", "", ("cart",))
    assert rig.links == {"spring": ("ground", "cart")}
    mass = rig.parameters["masses.cart.mass"]
    assert (mass.value, mass.unit, mass.low, mass.high, mass.free) == (
        0.17,
        "kg",
        0,
        math.inf,
        True,
    )
    stiffness = rig.parameters["links.spring.stiffness"]
    assert (stiffness.low, stiffness.high, stiffness.per_record) == (1.0, 100.0, True)
    assert isinstance(stiffness.value, float)
    damping = rig.parameters["links.spring.damping"]
    assert (damping.std, damping.free, damping.varies, damping.unit) == (
        0.002,
        False,
        True,
        "N s/m",
    )
    assert set(rig.places) == {"cart", "spring", "ground", "base"}


def test_a_rotating_chain(tmp_path: Path) -> None:
    text = CHAIN.replace('"chain"', '"chain"\nmotion = "rotation"').replace("mass =", "inertia =")
    rig = read(text, tmp_path)
    assert rig.motion == "rotation"
    units = [rig.parameters[name].unit for name in sorted(rig.parameters)]
    assert units == ["N m s/rad", "N m/rad", "kg m^2"]


def test_a_link_without_damping_has_none(tmp_path: Path) -> None:
    rig = read(CHAIN.replace("damping = { value = 0.01, std = 0.002 }\n", ""), tmp_path)
    assert rig.parameters["links.spring.damping"].value == 0.0


def test_a_robot_takes_the_rest_from_its_preset(tmp_path: Path) -> None:
    rig = read(ROBOT, tmp_path)
    assert (rig.kind, rig.model, rig.fidelity) == ("robot", "pinned_wrist", "planar")
    assert rig.parameters["wrist_stiffness"].high == 1e5
    assert rig.parameters["shaft_stiffness"].value == 140.0
    assert rig.parameters["sleeve_damping"].per_record
    preset = PRESETS["robo_v_sleeve_0"]
    assert rig.parameters["sleeve_stiffness"].value == preset["sleeve_stiffness"]
    assert set(preset) == set(rig.parameters)
    assert all(p.unit == PARAMETERS[name].unit for name, p in rig.parameters.items())


def test_upper_and_lower_sleeve_apart(tmp_path: Path) -> None:
    rig = read(ROBOT + "sleeve_stiffness_upper = 5e4\n", tmp_path)
    assert rig.parameters["sleeve_stiffness_upper"].value == 5e4


def test_a_held_value_may_lie_outside_the_usual_bounds(tmp_path: Path) -> None:
    rig = read(ROBOT + "club_length = 9.0\n", tmp_path)
    assert rig.parameters["club_length"].value == 9.0


def test_a_byte_order_mark_is_understood(tmp_path: Path) -> None:
    assert read("\ufeff" + CHAIN, tmp_path).masses == ("cart",)


def test_two_masses_and_a_branch_are_no_loop(tmp_path: Path) -> None:
    link = '[links.to_{0}]\nbetween = ["cart", "{0}"]\ndamping = 1.0\n'
    more = "".join(
        f"[masses.{name}]\nmass = 1.0\n" + link.format(name) for name in ("head", "tail")
    )
    assert read(CHAIN + more, tmp_path).masses == ("cart", "head", "tail")


def test_laws_are_kept(tmp_path: Path) -> None:
    rig = read(CHAIN, tmp_path)
    law = {
        "law": "coulomb_friction",
        "place": "spring",
        "parameters": {"force": {"value": 0.4, "min": 0.0, "free": True}, "width": 1e-3},
    }
    write_rig(rig, tmp_path / "extended.toml", [law])
    extended = read_rig(tmp_path / "extended.toml")
    assert extended.laws == (law,)
    write_rig(extended, tmp_path / "again.toml", [law])
    assert read_rig(tmp_path / "again.toml").laws == (law, law)


def test_writing_leaves_nothing_beside(tmp_path: Path) -> None:
    write_rig(read(CHAIN, tmp_path), tmp_path / "new" / "rig.toml")
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["rig.toml"]
    assert read_rig(tmp_path / "new" / "rig.toml").sha256 != ""


def plain(rig: Rig) -> Rig:
    """A rig without what tells files apart."""
    parameters = {name: replace(p, source="") for name, p in rig.parameters.items()}
    return replace(rig, path=Path(), sha256="", parameters=parameters)


positive = st.floats(1e-9, 1e9)


@st.composite
def numbers(draw: st.DrawFn, default: Parameter) -> Parameter:
    value = draw(positive)
    if draw(st.booleans()):
        default = replace(default, low=value * draw(st.floats(0.0, 0.9)))
    if draw(st.booleans()):
        default = replace(default, high=value * draw(st.floats(1.1, 1e3)))
    std = draw(st.none() | positive)
    free, per = draw(st.booleans()), draw(st.booleans())
    return replace(default, value=value, free=free, std=std, per_record=per)


@st.composite
def chains(draw: st.DrawFn) -> Rig:
    """Trees of masses, each linked to the ground or to an earlier one."""
    rotation = draw(st.booleans())
    kinds = ("kg m^2", "N m/rad", "N m s/rad") if rotation else ("kg", "N/m", "N s/m")
    count = draw(st.integers(1, 4))
    name = st.from_regex(r"[a-zäµ][\w-]{0,6}", fullmatch=True)
    reserved = st.lists(name, min_size=2 * count, max_size=2 * count, unique=True).filter(
        lambda names: not {"ground", "base", "drive"} & set(names)
    )
    names = draw(reserved)
    masses, joints = names[:count], names[count:]
    inertia = "inertia" if rotation else "mass"
    wanted = [(f"masses.{mass}.{inertia}", kinds[0], f"{inertia} of {mass}") for mass in masses]
    links = {}
    for i, joint in enumerate(joints):
        links[joint] = (draw(st.sampled_from(["ground", *masses[:i]])), masses[i])
        wanted.append((f"links.{joint}.stiffness", kinds[1], ""))
        wanted.append((f"links.{joint}.damping", kinds[2], ""))
    parameters = {n: draw(numbers(Parameter(n, 0.0, unit, low=0.0))) for n, unit, _ in wanted}
    motion = "rotation" if rotation else "translation"
    return Rig(Path(), "chain", motion, "", "thesis", "", tuple(masses), links, parameters, "")


def meaningless(rig: Rig) -> Rig:
    bare = plain(rig)
    parameters = {name: replace(p, meaning="") for name, p in bare.parameters.items()}
    return replace(bare, parameters=parameters)


@given(rig=chains())
def test_a_chain_survives_the_round_trip(
    rig: Rig, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("rig") / "rig.toml"
    write_rig(rig, path)
    once = read_rig(path)
    assert meaningless(once) == rig
    write_rig(once, path)
    assert plain(read_rig(path)) == plain(once)


@given(data=st.data())
def test_a_robot_survives_the_round_trip(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("rig") / "rig.toml"
    preset = data.draw(st.sampled_from(sorted(PRESETS)))
    parameters = {
        name: replace(PARAMETERS[name], value=value) for name, value in PRESETS[preset].items()
    }
    for name in data.draw(st.sets(st.sampled_from(sorted(PARAMETERS)), max_size=5)):
        parameters[name] = data.draw(numbers(PARAMETERS[name]))
        low, high = parameters[name].low, parameters[name].high
        if not low <= parameters[name].value <= high:
            parameters[name] = PARAMETERS[name]
    rig = Rig(
        Path(), "robot", "translation", "fixed_collet", "planar", preset, (), {}, parameters, ""
    )
    write_rig(rig, path)
    assert plain(read_rig(path)) == plain(rig)


def test_the_rigs_of_the_real_records(real_records: Path, tmp_path: Path) -> None:
    paths = [p for p in real_records.glob("*/*.toml") if "[rig]" in p.read_text()]
    assert len(paths) == 6
    for path in paths:
        rig = read_rig(path)
        write_rig(rig, tmp_path / "rig.toml")
        assert plain(read_rig(tmp_path / "rig.toml")) == plain(rig)
