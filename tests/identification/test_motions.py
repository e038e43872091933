"""Natural sizes of laws at a body: what its own inertia asks for, not what a spring carries."""

import numpy as np
import pytest

from supple.identification.base import fit_base
from supple.identification.motions import inertia_at
from supple.identification.problem import make_problem
from supple.identification.screen import entry_of
from supple.model.law import library
from supple.model.mechanism import mechanism_of
from supple.model.rig import read_rig
from tests.identification.benches import make_bench


def test_a_rider_is_naturally_a_tenth_of_what_carries_it(tmp_path):
    bench = make_bench(tmp_path, [("cubic_stiffness", -200.0)], held=())
    fit = fit_base(make_problem(bench.records, bench.rig))
    entry = entry_of(fit, ("cart", library()["extra_mode"]))
    carried = fit.problem.numbers["masses.cart.mass"]
    main = fit.problem.records[0].frequency * 2 * np.pi * fit.problem.scales["cart"].time
    assert main == pytest.approx(1.0, rel=1e-3)
    assert entry.scale == pytest.approx(0.1 * carried, rel=1e-3)


def test_a_fast_push_on_a_robot_meets_one_body_alone(tmp_path):
    """Head and collet hang on springs: nothing else follows at once."""
    path = tmp_path / "rig.toml"
    said = '[rig]\nkind = "robot"\nmodel = "pinned_wrist"\npreset = "robo_v_sleeve_50"\n'
    path.write_text(said, encoding="utf-8")
    rig = read_rig(path)
    numbers = {name: one.value for name, one in rig.parameters.items()}
    for place, name in (("clubhead", "clubhead_mass"), ("collet", "collet_inertia")):
        met = inertia_at(mechanism_of(rig), place, numbers)
        assert met == pytest.approx(numbers[name])
