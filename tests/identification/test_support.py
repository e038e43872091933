"""A pivot that gives way, of the independent bench: named, placed, and all numbers right."""

import pytest

from supple.identification.diagnose import diagnose
from supple.identification.records import read_record
from supple.model.rig import read_rig
from tests.lab.sealed import draw_sealed

LAW = "base/support_flexibility"


@pytest.mark.slow
def test_a_support_that_gives_way_is_named_though_it_draws_the_constants_away(tmp_path):
    truth = draw_sealed(tmp_path, "A", 95_002, 1, law="support_flexibility")
    folder = tmp_path / "records"
    train, held = (
        [read_record(path) for path in sorted(folder.glob(f"{split}_*.toml"))]
        for split in ("train", "held_out")
    )
    found = diagnose(train, read_rig(folder / "rig.toml"), held)
    assert found.status == "named"
    assert [trial.candidate.name for trial in found.accepted] == [LAW]

    (cause,) = truth["causes"]
    true = {name: truth["constants"][name] for name in ("shaft_stiffness", "wrist_stiffness")}
    true |= {LAW: 1.0 / cause["size"], f"{LAW}.frequency": cause["hertz"]}
    for name, value in true.items():
        i = found.final.index(name)
        assert found.final.value(i) == pytest.approx(value, abs=3.0 * found.final.std(i)), name
        assert found.final.std(i) < 0.1 * value, name
