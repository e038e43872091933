"""What a hidden effect changes that no constant can: the benches' detectability."""

import numpy as np
import pytest

from tests.lab.power import residual
from tests.lab.sealed import draw_sealed


def test_what_columns_can_absorb_is_taken_and_no_more():
    rng = np.random.default_rng(3)
    columns = rng.standard_normal((400, 3))
    free, none = np.full(3, np.inf), 1e-12 * np.ones(3)
    change = columns @ [1.0, -2.0, 0.5]
    assert np.linalg.norm(residual(change, columns, free)) < 1e-9
    assert np.linalg.norm(residual(change, columns, none)) == pytest.approx(
        np.linalg.norm(change), rel=1e-6
    )
    held = [np.linalg.norm(residual(change, columns, s * np.ones(3))) for s in (0.01, 0.1, 1.0)]
    assert held[0] > held[1] > held[2] > 0
    rest = residual(rng.standard_normal(400), columns, free)[:400]
    assert np.abs(columns.T @ rest).max() < 1e-9


@pytest.mark.parametrize(
    ("bench", "law", "place"), [("B", "clearance", "sleeve"), ("A", "sensor_delay", "head_acc")]
)
def test_detectability_grows_with_the_strength(bench, law, place, tmp_path):
    norms = []
    for strength in (0.01, 0.1):
        truth = draw_sealed(
            tmp_path / str(strength), bench, 3, law=law, place=place, strength=strength,
            model="fixed_collet", noise="white", train=1, held_out=0, samples=1024,
        )  # fmt: skip
        figures = truth["power"]
        assert figures["projected_norm"] <= figures["norm"] * (1 + 1e-9)
        norms.append(figures["projected_norm"])
    assert norms[1] > 2 * norms[0] > 0


def test_what_another_constant_makes_is_not_detectable_however_large(tmp_path):
    """A spring at the head moves the frequency by many turns of phase, as a stiffer shaft does."""
    truth = draw_sealed(
        tmp_path, "A", 11, law="linear_stiffness", place="clubhead", strength=0.3,
        model="fixed_collet", noise="white", train=2, held_out=0, samples=2048,
    )  # fmt: skip
    figures = truth["power"]
    assert figures["norm"] > 1000 and figures["projected_norm"] < 10
    assert not figures["detectable"]


def test_added_mass_is_invisible_where_nothing_tells_a_force(tmp_path):
    """With free stiffnesses all inertias may grow alike, and no free decay shows it."""
    truth = draw_sealed(
        tmp_path, "A", 4, law="sensor_mass", place="head_acc", strength=0.02,
        model="fixed_collet", noise="white", train=1, held_out=0, samples=2048,
    )  # fmt: skip
    if truth["records"][0]["kind"] == "decay":
        assert truth["power"]["projected_norm"] < 0.2 * truth["power"]["norm"]
    assert not truth["power"]["detectable"]


@pytest.mark.slow
def test_a_blow_shorter_than_two_samples_lets_nothing_be_seen_that_is_not_there(tmp_path):
    """Stiffer constants are a spring at the head, after such a blow too."""
    truth = draw_sealed(tmp_path, "A", 107021)
    assert truth["causes"][0]["law"] == "linear_stiffness"
    assert truth["power"]["norm"] > 5000 and truth["power"]["projected_norm"] < 20
    assert not truth["power"]["detectable"]


@pytest.mark.slow
def test_a_sleeve_that_relaxes_may_be_a_sleeve_of_another_damping(tmp_path):
    """To first order hundreds of units are left; a damping eight times as large leaves none."""
    truth = draw_sealed(
        tmp_path, "A", 89000, law="relaxation", place="sleeve", model="pinned_wrist",
        noise="outliers", train=2, held_out=0,
    )  # fmt: skip
    assert truth["power"]["norm"] > 100 * truth["power"]["projected_norm"]
    assert not truth["power"]["detectable"]


def test_each_of_two_effects_is_asked_for_beside_the_other(tmp_path):
    """The first alone is large; the second is measured against the twin that has the first."""
    truth = draw_sealed(
        tmp_path, "A", 98311, effects=2, law="sensor_offset", place="head_acc", strength=0.3,
        model="fixed_collet", noise="white", train=1, held_out=0, samples=1024,
    )  # fmt: skip
    first, second = (cause["power"] for cause in truth["causes"])
    assert first["detectable"] and truth["power"]["detectable"]
    assert first != truth["power"] != second
    assert second["norm"] < truth["power"]["norm"]
