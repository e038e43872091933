"""Constants from small motions, where large ones show a cause; laws in place of a spring's part."""

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from supple.identification.base import fit_base
from supple.identification.extend import NO_STEP
from supple.identification.fit import Fit
from supple.identification.problem import make_problem
from supple.identification.screen import Candidate, screen
from supple.identification.sliding import SLIDES
from supple.identification.told import _begun_with, quiet_fit, told_fit
from supple.model.law import library
from tests.identification.benches import STIFFNESS, make_bench
from tests.identification.conftest import CUBIC
from tests.identification.test_told import diagnosed, lumped

SLIPS = ("slip", "sleeve", 92004)
"""Law, place and seed of a case of the independent bench."""

K = "links.spring.stiffness"


def fitted(folder, reaches, effects=(("cubic_stiffness", CUBIC),)) -> Fit:
    bench = make_bench(folder, effects, reaches)
    return fit_base(make_problem(bench.records, bench.rig))


@pytest.fixture(scope="module")
def softened(tmp_path_factory) -> Fit:
    return fitted(tmp_path_factory.mktemp("softened"), (1.0, 0.05))


@pytest.fixture(scope="module")
def quiet(softened) -> Fit:
    found = quiet_fit(softened)
    assert found is not None
    return found


def test_the_quieter_half_of_the_records_tells_the_spring(softened, quiet):
    assert len(quiet.problem.records) == 1 and len(softened.problem.records) == 2
    assert quiet.value(quiet.index(K)) == pytest.approx(STIFFNESS, rel=1e-3)
    sizes = {p.name: float(np.ptp(p.sensors[0].values)) for p in softened.problem.records}
    assert quiet.problem.records[0].name == min(sizes, key=lambda name: sizes[name])


def test_the_screen_begins_with_what_they_tell(softened, quiet):
    told = told_fit(softened)
    for label in (K, "links.spring.damping"):
        assert told.value(told.index(label)) == pytest.approx(quiet.value(quiet.index(label)))
    assert told.problem.scales["spring"].stretch > 0
    assert told.problem.scales != softened.problem.scales
    assert screen(told)[0].name in ("spring/cubic_stiffness", "spring/hysteresis", "spring/slip")


def test_records_of_one_loudness_have_no_quiet_half(tmp_path):
    assert quiet_fit(fitted(tmp_path, (1.0, 0.9))) is None


def test_small_motions_that_are_misfitted_too_tell_nothing(tmp_path):
    assert quiet_fit(fitted(tmp_path, (1.0, 0.6))) is None


def test_beside_a_named_cause_constants_are_no_more_drawn_away(softened):
    (cubic,) = screen(softened, [("spring", library()["cubic_stiffness"])])
    model = replace(softened.model, causes=(cubic.cause,))
    assert quiet_fit(replace(softened, model=model)) is None


def at(fit: Fit, law: str) -> Candidate:
    return screen(fit, [("spring", library()[law])])[0]


@pytest.mark.parametrize("law", ["slip", "hysteresis"])
def test_what_slides_in_large_motions_begins_as_a_part_of_the_spring(softened, law):
    candidate = at(softened, law)
    bare, *others = _begun_with(softened, candidate)
    assert bare[: len(softened.x)] == pytest.approx(softened.x)
    assert len(others) == 3
    index, k = softened.index(K), softened.value(softened.index(K))
    (knee,) = candidate.shapes
    for x in others:
        force, way = x[-2] * candidate.entry.scale, x[-1] * knee.scale
        small = x[index] * softened.model.scale[index] + force / way
        assert small == pytest.approx(k) and force / way == pytest.approx(SLIDES * k)


@pytest.mark.parametrize("law", ["cubic_stiffness", "relaxation", "coulomb_friction"])
def test_no_other_law_takes_a_part_of_the_spring(softened, law):
    candidate = at(softened, law)
    begun = _begun_with(softened, candidate)
    assert len(begun) == 1 + (abs(candidate.step) < NO_STEP)  # strong too where no step asks for it
    for x in begun:
        assert x[: len(softened.x)] == pytest.approx(softened.x)


def test_where_the_rig_has_no_such_number_nothing_is_taken(softened):
    adrift = replace(at(softened, "slip"), place="elsewhere")
    assert len(_begun_with(softened, cast(Any, adrift))) == 1


def test_what_sticks_is_known_by_its_form():
    assert {name for name, law in library().items() if law.sticks} == {"slip", "hysteresis"}


@pytest.mark.slow
def test_a_sleeve_that_slips_is_found_out(tmp_path):
    """Its absence made the sleeve four times too stiff and the shaft half as stiff as it is."""
    names, found = diagnosed(tmp_path, *lumped(*SLIPS))
    assert (found.status, names) == ("named", ["sleeve/slip"])
    assert found.held_before is not None and found.held_after is not None
    assert found.held_after.nrmse < found.held_before.nrmse
