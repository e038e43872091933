"""`supple swing` from task to files: what it writes, its exit codes, and its words."""

import json

import h5netcdf
import numpy as np

from supple.optimize.profile import read_pod
from supple.studies.cli import main
from tests.optimize.swing_tasks import write_task


def test_a_swing_is_written_with_its_check_and_a_page(tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["swing", str(write_task(tmp_path, points=201)), "--out", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told == json.loads((out / "swing.json").read_text())
    assert told["status"] == "solved" and told["check"]["passed"]
    assert abs(told["impact"]["speed_error"]) < 0.01
    assert len(told["residual"]["factor"]) == len(told["residual"]["amplitude"]) == 41
    assert told["limits"]["largest_ratio"] <= 1.001
    assert read_pod(out / "profile.pod").time.shape == (201,)
    page = (out / "report.html").read_text()
    assert (
        "Swing found" in page and "<script" not in page and "http" not in page.split("</style>")[1]
    )


def test_what_limits_forbid_ends_in_3_and_leaves_no_profile(tmp_path):
    out = tmp_path / "out"
    path = write_task(tmp_path, points=201, speed=90.0)
    assert main(["swing", str(path), "--out", str(out), "--quiet"]) == 3
    told = json.loads((out / "swing.json").read_text())
    assert told["status"] == "infeasible" and told["fastest_feasible_speed"] < 90.0
    assert "limit of" in told["sentence"]
    assert not (out / "profile.pod").exists()


def test_prices_and_other_hardware_are_added_where_they_are_asked_for(tmp_path):
    out = tmp_path / "out"
    path = write_task(tmp_path, points=201)
    words = ["swing", str(path), "--prices", "--hardware", "--out", str(out), "--quiet"]
    assert main(words) == 0
    told = json.loads((out / "swing.json").read_text())
    prices, hardware = told["prices"], told["hardware"]
    assert hardware["optimality_missed"] < 1e-3
    slopes = {one["parameter"]: one for one in hardware["slopes"]}
    assert slopes["wrist_stiffness"]["unit"] == "N m/rad" and slopes["wrist_stiffness"]["cost"] < 0
    assert "What other hardware would change" in (out / "report.html").read_text()
    assert len(prices) == 25 and sum(one["feasible"] for one in prices) >= 20
    assert any(one["efficient"] for one in prices)
    assert "What less vibration costs" in (out / "report.html").read_text()


def test_a_posterior_tells_for_which_robots_the_swing_must_do(tmp_path):
    random = np.random.default_rng(3)
    values = {
        "wrist_stiffness": 300.0 * (1.0 + 0.02 * random.standard_normal((4, 50))),
        "shaft_stiffness": 139.0 * (1.0 + 0.05 * random.standard_normal((4, 50))),
    }
    with h5netcdf.File(tmp_path / "posterior.nc", "w") as file:
        group = file.create_group("posterior")
        group.dimensions = {"chain": 4, "draw": 50}
        for name, table in values.items():
            group.create_variable(name, ("chain", "draw"), data=table)
    path = write_task(tmp_path, points=201, scenarios=3)
    old = 'parameter = "shaft_frequency"'
    path.write_text(path.read_text().replace(old, 'parameter = "posterior"\nfile = "posterior.nc"'))
    out = tmp_path / "out"
    assert main(["swing", str(path), "--out", str(out), "--quiet"]) == 0
    told = json.loads((out / "swing.json").read_text())
    assert told["residual"]["parameter"] == "posterior"
    assert len(told["residual"]["amplitude"]) == 41 and told["residual"]["worst"] < 0.003
    assert len(told["solver"]["scenarios"]) >= 4
    assert str(tmp_path / "posterior.nc") in told["provenance"]["inputs"]


def test_a_posterior_of_something_else_is_refused(tmp_path, capsys):
    (tmp_path / "posterior.nc").write_text("no netCDF")
    path = write_task(tmp_path, points=201)
    old = 'parameter = "shaft_frequency"'
    path.write_text(path.read_text().replace(old, 'parameter = "posterior"\nfile = "posterior.nc"'))
    assert main(["swing", str(path)]) == 2
    line = capsys.readouterr().err
    assert "posterior.nc" in line and "Mend:" in line and line.count("\n") == 1
