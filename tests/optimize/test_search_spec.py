"""What a spec of a search may say, and how its faults are told."""

from pathlib import Path

import numpy as np
import pytest

from supple.model.rig import read_rig
from supple.optimize.search_spec import dimensions_of, read_search

RIG = '[rig]\nkind = "robot"\nmodel = "pinned_wrist"\npreset = "robo_v_sleeve_50"\n'
SWEEP = '[sweep]\nrig = "rig.toml"\ndrive = "impact.toml"\n'
AXES = '[axes]\nwrist_stiffness = { low = 20.0, high = 2000.0, scale = "log" }\n'
SEARCH = '[search]\nsampler = "nsga2"\ntrials = 10\nbatch = 4\n'


def dimensions(folder: Path, text: str, **files: str):
    (folder / "rig.toml").write_text(RIG)
    for name, content in files.items():
        (folder / f"{name}.csv").write_text(content)
    (folder / "spec.toml").write_text(text)
    spec = read_search(folder / "spec.toml")
    return spec, *dimensions_of(spec, read_rig(folder / "rig.toml"))


def test_every_form_of_an_axis_has_its_meaning(tmp_path):
    axes = (
        AXES
        + "wrist_damping = { start = 2.0, step = 2.0, count = 75 }\n"
        + "collet_inertia = { values = [0.02, 0.01] }\n"
        + "clubhead_mass = { low = 0.19, high = 0.21, count = 5 }\n"
    )
    _, ranges, choices = dimensions(tmp_path, SWEEP + axes + SEARCH)
    told = [(one.name, one.low, one.high, one.is_log, one.unit) for one in ranges]
    assert told == [
        ("wrist_stiffness", 20.0, 2000.0, True, "N m/rad"),
        ("wrist_damping", 2.0, 150.0, False, "N m s/rad"),
        ("clubhead_mass", 0.19, 0.21, False, "kg"),
    ]
    assert [one.name for one in choices] == ["collet_inertia"]
    np.testing.assert_array_equal(choices[0].numbers["collet_inertia"], [0.02, 0.01])


def test_catalogues_are_choices_of_named_parts(tmp_path):
    springs = "part,wrist_stiffness\nLee 12,60\nLee 14,110.5\n"
    dashpots = "wrist_damping\n5\n8\n13\n"
    search = SEARCH + 'catalogue = ["springs.csv", "dashpots.csv"]\n'
    spec, ranges, choices = dimensions(tmp_path, SWEEP + search, springs=springs, dashpots=dashpots)
    assert ranges == () and [path.name for path in spec.catalogues] == [
        "springs.csv",
        "dashpots.csv",
    ]
    assert choices[0].name == "springs" and choices[0].parts == ("Lee 12", "Lee 14")
    assert choices[1].parts == ("row 2", "row 3", "row 4")
    np.testing.assert_array_equal(choices[0].numbers["wrist_stiffness"], [60.0, 110.5])
    np.testing.assert_array_equal(choices[1].numbers["wrist_damping"], [5.0, 8.0, 13.0])


def test_scores_are_objectives_then_limits(tmp_path):
    search = SEARCH + 'objectives = { peak = "maximize", rms = "minimize" }\n'
    search += "constraints = { grip_displacement_peak = { max = 0.002 }, rms = { min = 1.0 } }\n"
    spec, *_ = dimensions(tmp_path, SWEEP + AXES + search)
    assert spec.scores == ("peak", "rms", "grip_displacement_peak")
    assert [(one.score, one.low, one.high) for one in spec.limits] == [
        ("grip_displacement_peak", None, 0.002),
        ("rms", 1.0, None),
    ]
    assert (spec.study, spec.storage) == ("spec", "sqlite:///search.db")


PARTS = 'catalogue = "parts.csv"\n'
BAD = {
    "no [search]": ("", "", "[search]"),
    "no objective": (SEARCH + "objectives = {}\n", "", "[search] objectives"),
    "an unknown score": (SEARCH + 'objectives = { rsm = "minimize" }\n', "", "write 'rms'"),
    "an unknown limit": (SEARCH + "constraints = { grip = { max = 1.0 } }\n", "", "constraints"),
    "no direction": (SEARCH + 'objectives = { rms = "least" }\n', "", "minimize"),
    "an empty limit": (SEARCH + "constraints = { rms = {} }\n", "", "'max', 'min'"),
    "a limit upside down": (SEARCH + "constraints.rms = { min = 2.0, max = 1.0 }\n", "", "'max'"),
    "an unknown sampler": ('[search]\nsampler = "cma"\n', "", "'cma'"),
    "an unknown key": ("[search]\ntrial = 5\n", "", "trials"),
    "no trials": ("[search]\ntrials = 0\n", "", "trials"),
    "cmaes with a list": (
        '[search]\nsampler = "cmaes"\n' + PARTS,
        "wrist_damping\n1\n2\n",
        "from low to high",
    ),
    "cmaes with two objectives": (
        '[search]\nsampler = "cmaes"\nobjectives = { rms = "minimize", peak = "minimize" }\n',
        "",
        "one objective",
    ),
    "a slow Gaussian process": ('[search]\nsampler = "gp"\ntrials = 900\n', "", "at most 500"),
    "no catalogue": (SEARCH + 'catalogue = "part.csv"\n', "wrist_damping\n1\n", "parts.csv"),
    "an empty catalogue": (SEARCH + PARTS, "wrist_damping\n", "at least one part"),
    "a column of nothing": (SEARCH + PARTS, "wrist_dumping\n1\n", "write 'wrist_damping'"),
    "no number": (SEARCH + PARTS, "part,wrist_damping\na,1\nb,x\n", "line 3, wrist_damping"),
    "a missing cell": (SEARCH + PARTS, "part,wrist_damping\na,1\nb\n", "line 3, wrist_damping"),
    "a damping below 0": (SEARCH + PARTS, "wrist_damping\n1\n-2\n", "at least 0 N m s/rad"),
    "a part twice": (SEARCH + PARTS, "part,wrist_damping\na,1\na,2\n", "'a' twice"),
    "a column twice": (SEARCH + PARTS, "wrist_damping,wrist_damping\n1,2\n", "each once"),
    "names alone": (SEARCH + PARTS, "part\na\n", "parameters"),
    "an axis in a catalogue": (SEARCH + PARTS, "wrist_stiffness\n1\n", "twice"),
}


@pytest.mark.parametrize("case", list(BAD))
def test_a_bad_spec_is_refused_in_one_line(case, tmp_path):
    search, parts, told = BAD[case]
    files = {"parts": parts} if parts else {}
    with pytest.raises(ValueError, match="Mend:") as fault:
        dimensions(tmp_path, SWEEP + AXES + search, **files)
    assert told in str(fault.value) and "\n" not in str(fault.value)


def test_a_search_for_nothing_is_refused(tmp_path):
    with pytest.raises(ValueError, match="at least one axis"):
        dimensions(tmp_path, SWEEP + SEARCH)
    with pytest.raises(ValueError, match="something that can vary"):
        dimensions(tmp_path, SWEEP + "[axes]\nwrist_damping = { values = [5.0] }\n" + SEARCH)
