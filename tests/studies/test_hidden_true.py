"""What the true law takes away of a held-out error, as the benchmark asks of an extension."""

import json

import pytest

from supple.identification.base import fit_base
from supple.identification.extend import held_out
from supple.identification.problem import make_problem
from supple.identification.records import split_records
from supple.studies.engine import read_inputs
from supple.studies.hidden_true import foretold_by_the_true_law
from tests.lab.sealed import draw_sealed


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    folder = tmp_path_factory.mktemp("case")
    draw_sealed(
        folder, "A", 3, law="cubic_stiffness", place="shaft", strength=0.5, model="fixed_collet",
        noise="white", train=2, held_out=1, samples=1024,
    )  # fmt: skip
    paths = sorted((folder / "records").glob("*.toml"))
    sidecars = [path for path in paths if path.name != "rig.toml"]
    inputs = read_inputs(sidecars, None)
    train, kept, _ = split_records(inputs.records, ())
    base = fit_base(make_problem(train, inputs.rig))
    truth = json.loads((folder / "truth.json").read_text(encoding="utf-8"))
    return sidecars, base, held_out(base, make_problem(kept, inputs.rig)), truth


def test_the_true_law_foretells_what_was_never_fitted_next_to_its_noise(drawn):
    sidecars, base, before, truth = drawn
    error = foretold_by_the_true_law(sidecars, base, truth["causes"][0])
    noise = 10.0 ** (-truth["noise"]["snr_db"] / 20.0)
    nrmse = before.nrmse
    assert nrmse > 1.8 * noise
    assert error is not None and 0.8 * noise < error < 1.2 * noise


def test_what_the_records_cannot_show_is_not_fitted(drawn):
    sidecars, base, _, _ = drawn
    nowhere = {"law": "cubic_stiffness", "place": "wrist"}
    assert foretold_by_the_true_law(sidecars, base, nowhere) is None
