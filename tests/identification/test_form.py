"""What a lumped club leaves of a real one is let pass, no more; chains have no such allowance."""

from dataclasses import replace

import numpy as np
import pytest

from supple.identification import form
from supple.identification.fit import Fit
from supple.identification.form import (
    form_share,
    form_words,
    mends_form,
    mends_lumping,
    taken_share,
    within_form,
    within_next,
)
from supple.identification.problem import Cause
from supple.model.law import library
from supple.model.robot import Robot


def with_misfit(fit: Fit, share: float) -> Fit:
    """The fit with a tone of that share of the first channel's motion left in it."""
    key = fit.keys[0]
    sensor = fit.sensor_of(key)
    tone = np.sin(2 * np.pi * np.arange(len(sensor.values)) / 40.0) * np.sqrt(2.0)
    left = fit.predicted[key] + share * np.std(sensor.values) * tone
    return replace(fit, predicted={**fit.predicted, key: left})


@pytest.mark.parametrize("share", [0.04, 0.2])
def test_the_share_left_is_told(clean_fit, share):
    assert form_share(clean_fit) == 0.0
    assert form_share(with_misfit(clean_fit, share)) == pytest.approx(share, rel=0.1)


def test_only_robots_have_an_allowance_and_only_a_small_one(clean_fit, monkeypatch):
    little, much = (with_misfit(clean_fit, share * form.LUMPED) for share in (0.5, 2.0))
    assert not within_form(little) and form_words(little) == ""
    assert within_form(on_robot(little)) and not within_form(on_robot(much))
    assert not within_form(on_robot(clean_fit))  # where none shows, none is allowed for
    assert "lumped club" in form_words(on_robot(little)) and form_words(on_robot(much)) == ""


def test_beside_a_named_cause_of_a_robot_more_is_let_pass(clean_fit):
    below, above = (with_misfit(clean_fit, share * form.NEXT) for share in (0.7, 1.4))
    assert not within_next(below)  # chains are what they are told to be
    told = [on_robot(fit) for fit in (below, above)]
    assert [within_next(fit) for fit in told] == [True, False]
    assert form.LUMPED < form_share(told[0])


def on_robot(fit: Fit) -> Fit:
    """The same fit, told to be a robot's."""
    problem = replace(fit.problem, mechanism=Robot("fixed_collet", ()))
    return replace(fit, model=replace(fit.model, problem=problem))


def test_a_law_that_takes_little_where_no_misfit_shows_mends_only_form(clean_fit):
    key, rng = clean_fit.keys[0], np.random.default_rng(4)
    size = float(np.std(clean_fit.sensor_of(key).values))

    def noisier(share: float) -> Fit:
        """The fit with noise more of that share of the motion, which no misfit test can show."""
        left = clean_fit.predicted[key]
        more = share * size * rng.normal(size=len(left))
        return replace(clean_fit, predicted={**clean_fit.predicted, key: left + more})

    little, much = noisier(0.7 * form.NEXT), noisier(2.0 * form.NEXT)
    assert taken_share(little, clean_fit) == pytest.approx(0.7 * form.NEXT, rel=0.1)
    assert taken_share(clean_fit, much) == 0.0
    drag, hum = ("wrist", library()["quadratic_damping"]), ("head", library()["mains_hum"])
    assert not mends_form(little, clean_fit, drag)  # chains are what they are told to be
    assert mends_form(on_robot(little), on_robot(clean_fit), drag)
    assert not mends_form(on_robot(little), on_robot(clean_fit), hum)  # an instrument's, exact
    assert not mends_form(on_robot(much), on_robot(clean_fit), drag)
    shown = with_misfit(clean_fit, 0.9 * form.NEXT)  # a tone stands above any noise
    assert not mends_form(on_robot(shown), on_robot(clean_fit), drag)


def test_beside_a_law_that_explains_nearly_all_another_one_there_mends_its_lumping(clean_fit):
    """A club's shaft that softens was crowded by what mends a lumped drift's form."""
    laws = library()
    drift, cubic = (("shaft", laws[name]) for name in ("stiffness_drift", "cubic_stiffness"))
    base = on_robot(with_misfit(clean_fit, 0.2))
    much, little = (with_misfit(clean_fit, share) for share in (0.1, 0.05))

    def named(fit: Fit) -> Fit:
        return on_robot(replace(fit, model=replace(fit.model, causes=(drift,))))

    def mended(before: Fit, share: float, cause: Cause = cubic) -> bool:
        after = on_robot(with_misfit(clean_fit, share))
        return mends_lumping(base, before, after, cause)

    nearly = np.sqrt(0.05**2 - 0.9 * form.NEXT**2)
    assert mended(named(little), nearly)
    assert not mended(named(little), 0.01), "it takes more off than lumping leaves"
    assert not mended(named(much), np.sqrt(0.1**2 - 0.9 * form.NEXT**2)), "half is left"
    assert mended(named(little), nearly, ("sleeve", laws["cubic_stiffness"])), "in a row with it"
    assert not mended(named(little), nearly, ("shaft", laws["sensor_gain"]))
    assert not mended(on_robot(little), nearly), "nothing is named there"
    wrist = replace(little.model, causes=(("wrist", laws["stiffness_drift"]),))
    at_wrist = on_robot(replace(little, model=wrist))
    assert not mended(at_wrist, nearly, ("wrist", laws["cubic_stiffness"])), "a joint is a point"
    assert not mended(at_wrist, nearly), "nothing of the club is named"
    chain = replace(little, model=replace(little.model, causes=(drift,)))
    assert not mends_lumping(base, chain, on_robot(with_misfit(clean_fit, nearly)), cubic)
    edge = with_misfit(clean_fit, 0.9 * form.NEXT)
    assert not mended(named(edge), 0.0), "with it no error of the model dominates"
    quiet = named(with_misfit(clean_fit, 0.001))
    assert not mended(quiet, 0.001), "nor does one without it"
