"""A fit leaves a shaft's mass and the bend of its grip open, where records can tell them."""

from pathlib import Path

import pytest

from supple.identification.problem import make_problem
from supple.identification.records import read_record
from supple.model.rig import read_rig
from tests.lab.sealed import draw_sealed


def opened(folder: Path, model: str, seed: int = 1) -> dict[str, float | None]:
    """Tolerances of the numbers that the rig's file says nothing of."""
    draw_sealed(folder, "B", seed, 0, model=model, noise="white", train=1, held_out=0, samples=256)
    paths = sorted((folder / "records").glob("train_*.toml"))
    told = read_rig(folder / "records" / "rig.toml")
    problem = make_problem([read_record(path) for path in paths], told)
    numbers = problem.rig.parameters
    return {name: number.std for name, number in numbers.items() if name not in told.parameters}


def test_the_mass_is_open_where_the_collet_moves_and_the_bend_where_a_gauge_sits(tmp_path):
    assert opened(tmp_path / "fixed", "fixed_collet") == {"grip_bending": 0.2}
    seen = {}
    for seed in range(1, 9):
        folder = tmp_path / str(seed)
        found = opened(folder, "driven_wrist", seed)
        gauged = "shaft_gauge" in (folder / "records" / "rig.toml").with_name(
            "train_01_driven.toml"
        ).read_text(encoding="utf-8")
        assert found == {"shaft_mass": 0.04} | ({"grip_bending": 0.2} if gauged else {})
        seen[gauged] = found
    assert set(seen) == {True, False}


@pytest.mark.parametrize("name", ["shaft_mass", "grip_bending"])
def test_a_number_that_the_rig_names_stays_as_it_is_named(tmp_path, name):
    draw_sealed(tmp_path, "B", 1, 0, model="driven_wrist", noise="white", train=1, held_out=0,
                samples=256)  # fmt: skip
    path = tmp_path / "records" / "rig.toml"
    path.write_text(
        path.read_text(encoding="utf-8").replace("[parameters]", f"[parameters]\n{name} = 0.04"),
        encoding="utf-8",
    )
    records = [read_record(one) for one in sorted(path.parent.glob("train_*.toml"))]
    number = make_problem(records, read_rig(path)).rig.parameters[name]
    assert (number.value, number.std, number.varies) == (0.04, None, False)
