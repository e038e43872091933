"""What a lumped club leaves of a real one is let pass, no more; chains have no such allowance."""

from dataclasses import replace

import numpy as np
import pytest

from supple.identification import form
from supple.identification.fit import Fit
from supple.identification.form import form_share, form_words, within_form, within_next
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
    robot = Robot("fixed_collet", ())

    def on_robot(fit: Fit) -> Fit:
        problem = replace(fit.problem, mechanism=robot)
        return replace(fit, model=replace(fit.model, problem=problem))

    assert within_form(on_robot(little)) and not within_form(on_robot(much))
    assert not within_form(on_robot(clean_fit))  # where none shows, none is allowed for
    assert "lumped club" in form_words(on_robot(little)) and form_words(on_robot(much)) == ""


def test_beside_a_named_cause_of_a_robot_more_is_let_pass(clean_fit):
    below, above = (with_misfit(clean_fit, share * form.NEXT) for share in (0.7, 1.4))
    assert not within_next(below)  # chains are what they are told to be
    robot = Robot("fixed_collet", ())
    told = [
        replace(fit, model=replace(fit.model, problem=replace(fit.problem, mechanism=robot)))
        for fit in (below, above)
    ]
    assert [within_next(fit) for fit in told] == [True, False]
    assert form.LUMPED < form_share(told[0])
