"""Modal tables against modes of the independent bench: recovery, coverage, doors, joint fits."""

import json
from pathlib import Path

import numpy as np
import pytest

from supple.identification.base import fit_base
from supple.identification.modal import TOO_MANY, ModalFit, fit_modal, known_from, ringing
from supple.identification.modal_table import is_modal, read_modal
from supple.identification.problem import make_problem
from supple.model.linear import modes
from supple.model.rig import read_rig
from supple.model.robot import PRESETS, Robot
from supple.studies.cli import main
from tests.identification.benches import DAMPING, MASS, STIFFNESS, make_bench
from tests.lab.bodies import ROBO_V, SLEEVES, fixed_collet

RIG = """\
[rig]
kind = "robot"
model = "fixed_collet"
preset = "robo_v"
[parameters]
shaft_damping = { value = 0.2, free = true }
sleeve_stiffness = { value = 200e3, free = true, per = "record" }
sleeve_damping = { value = 400.0, free = true, per = "record" }
"""
SIDECAR = """\
[record]
test = "modal"
rig = "rig.toml"
[conditions.rigid]
sleeve_stiffness = 1e8
sleeve_damping = 0.0
"""
STDS = (0.01, 0.001)


def measured(sleeve: tuple[float, float]) -> tuple[float, float]:
    """Damped frequency and damping ratio of the bench's club in a sleeve."""
    numbers = ROBO_V | {"sleeve_stiffness": sleeve[0], "sleeve_damping": sleeve[1]}
    beats, ratios = fixed_collet(numbers).modes()
    return float(beats[0] * np.sqrt(1 - ratios[0] ** 2)), float(ratios[0])


CONDITIONS = {"rigid": (1e8, 0.0), **SLEEVES}


def table(folder: Path, rng: np.random.Generator | None = None, rig: str = RIG) -> Path:
    lines = ["condition;frequency [Hz];frequency_std;damping_ratio;damping_ratio_std"]
    for name, sleeve in CONDITIONS.items():
        told = np.array(measured(sleeve))
        told += 0 if rng is None else rng.standard_normal(2) * STDS
        frequency, ratio = (f"{value:.9f}".replace(".", ",") for value in told)
        lines.append(f"{name};{frequency};0,01;{ratio};0,001")
    folder.mkdir(exist_ok=True)
    (folder / "rig.toml").write_text(rig)
    (folder / "modes.toml").write_text(SIDECAR)
    (folder / "modes.csv").write_text("\n".join(lines) + "\n")
    return folder / "modes.toml"


def fitted(sidecar: Path) -> ModalFit:
    return fit_modal([read_modal(sidecar)], read_rig(sidecar.parent / "rig.toml"))


def test_modes_of_a_rig_are_those_of_its_state_matrix():
    for model in ("fixed_collet", "pinned_wrist"):
        numbers = PRESETS["robo_v_sleeve_25"]
        mechanism = Robot(model, tuple(numbers))
        frequencies, ratios = ringing(mechanism, numbers)
        own = modes(mechanism, numbers)
        rings = own.damped_frequencies > 0
        np.testing.assert_allclose(frequencies, own.damped_frequencies[rings], rtol=1e-9)
        np.testing.assert_allclose(ratios, own.damping_ratios[rings], rtol=1e-9)


def test_sleeves_are_recovered_from_their_modes(tmp_path):
    fit = fitted(table(tmp_path))
    assert fit.converged and fit.chi2 < 1e-6
    assert fit.of("shaft_damping")[0] == pytest.approx(ROBO_V["shaft_damping"], rel=1e-4)
    for name, (stiffness, damping) in SLEEVES.items():
        assert fit.of(f"sleeve_stiffness[{name}]")[0] == pytest.approx(stiffness, rel=1e-4)
        assert fit.of(f"sleeve_damping[{name}]")[0] == pytest.approx(damping, rel=1e-3)


@pytest.mark.slow
def test_intervals_hold_the_truth(tmp_path):
    rng, inside = np.random.default_rng(5), []
    for _ in range(15):
        fit = fitted(table(tmp_path, rng))
        for name, sleeve in SLEEVES.items():
            for what, truth in zip(("stiffness", "damping"), sleeve, strict=True):
                value, std = fit.of(f"sleeve_{what}[{name}]")
                inside.append(abs(value - truth) < 1.96 * std)
    assert 0.88 < np.mean(inside) < 0.995


def test_what_two_conditions_share_is_overdetermined_and_a_wrong_rig_shows(tmp_path):
    """One stiffness for all sleeves cannot be: the misfit says so and errors grow."""
    wrong = RIG.replace(', per = "record" }', " }", 1)
    fit = fitted(table(tmp_path, rig=wrong))
    assert fit.p_value < 1e-6 and fit.chi2 > 100


def test_more_constants_than_numbers_are_not_trusted(tmp_path):
    more = RIG + 'shaft_stiffness = { value = 139.0, free = true, per = "record" }\n'
    sidecar = table(tmp_path, rig=more)
    assert fitted(sidecar).status == TOO_MANY
    assert main(["identify", str(sidecar), "--quiet"]) == 3


def test_stiffness_and_spacing_are_told_only_as_a_product(tmp_path, capsys):
    rig = RIG + 'sleeve_spacing = { value = 0.05, free = true, std = 0.02, per = "record" }\n'
    sidecar = table(tmp_path, rig=rig)
    assert main(["identify", str(sidecar), "--json", "--out", str(tmp_path / "out")]) == 0
    told = json.loads(capsys.readouterr().out)["parameters"]
    for name in SLEEVES:
        one = told[f"sleeve_stiffness[{name}]"]
        assert one["identifiable"] == "coupled"
        assert f"sleeve_spacing[{name}]" in one["partners"] and one["partner"] in one["partners"]
    assert "sleeve_stiffness[0 %]" in (tmp_path / "out" / "report.html").read_text()
    assert main(["identify", str(sidecar), "--posterior"]) == 2
    assert "modal table" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("damping_ratio;", "ratio;", "add 'damping_ratio'"),
        (";0,001\n", ";0\n", "a number above 0"),
        (";0,01;0", ";0,01;2", "from 0 to 1"),
        (";0,001\n", "\n", "fill that line"),
    ],
)
def test_a_faulty_table_is_refused_in_words(old, new, words, tmp_path):
    sidecar = table(tmp_path)
    data = tmp_path / "modes.csv"
    data.write_text(data.read_text().replace(old, new, 1))
    with pytest.raises(ValueError, match="Mend") as caught:
        read_modal(sidecar)
    assert words in str(caught.value)


def test_unknown_conditions_and_numbers_are_refused(tmp_path, capsys):
    sidecar = table(tmp_path)
    assert is_modal(sidecar) and not is_modal(tmp_path / "rig.toml")
    assert main(["check", str(sidecar)]) == 0
    assert "25 %: 3.5" in capsys.readouterr().out
    sidecar.write_text(SIDECAR.replace("conditions.rigid", "conditions.rigit"))
    assert main(["identify", str(sidecar)]) == 2
    assert "write 'rigid'" in capsys.readouterr().err
    sidecar.write_text(SIDECAR.replace("sleeve_damping = 0.0", "sleeve_dampin = 0.0"))
    assert main(["identify", str(sidecar)]) == 2
    assert "write 'sleeve_damping'" in capsys.readouterr().err


def test_a_table_joins_records_against_time(tmp_path, capsys):
    """A decay tells k / m and c / m; the modes of the cart with a known mass on top tell m too."""
    bench = make_bench(tmp_path, reaches=(1.0,), held=())
    rig = tmp_path / "rig.toml"
    text = rig.read_text()
    assert "mass = 0.5" in text
    rig.write_text(text.replace("mass = 0.5", "mass = { value = 0.55, free = true }"))
    beat = float(np.sqrt(STIFFNESS / MASS) / (2 * np.pi))
    ratio = DAMPING / (2 * np.sqrt(STIFFNESS * MASS))
    heavy = {"masses.cart.mass": MASS, "links.spring.stiffness": 81.0}
    stiff = float(np.sqrt(81.0 / MASS) / (2 * np.pi))
    rows = [("bare", beat, ratio), ("known spring", stiff, ratio * beat / stiff)]
    lines = [f"{n},{f * np.sqrt(1 - z * z):.9f},0.001,{z:.9f},0.0005" for n, f, z in rows]
    (tmp_path / "modes.csv").write_text(
        "condition,frequency,frequency_std,damping_ratio,damping_ratio_std\n" + "\n".join(lines)
    )
    sidecar = tmp_path / "modes.toml"
    known = f'"links.spring.stiffness" = {heavy["links.spring.stiffness"]}\n'
    sidecar.write_text(
        '[record]\ntest = "modal"\nrig = "rig.toml"\n[conditions."known spring"]\n' + known
    )
    paths = [str(path) for path in bench.paths]
    assert main(["identify", *paths, str(sidecar), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert set(told) > {"modes", "modal_misfit", "preflight"}
    for name, truth in (
        ("masses.cart.mass", MASS),
        ("links.spring.stiffness", STIFFNESS),
        ("links.spring.damping", DAMPING),
    ):
        one = told["parameters"][name]
        assert abs(one["value"] - truth) < 4 * one["std"] and one["std"] < 0.01 * truth
        assert one["identifiable"] == "yes"
    fit = fit_base(make_problem(bench.records, read_rig(rig)))
    sizes = np.linalg.svd(known_from(fit).root * known_from(fit).values, compute_uv=False)
    assert sizes[-1] < 1e-3 * sizes[0]  # a decay alone leaves the common scale open
