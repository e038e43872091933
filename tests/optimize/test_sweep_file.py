"""A map's file: read by another program at every stage, taken up only where it is the same."""

import os
import threading

import numpy as np
import pytest
from scipy.io import netcdf_file

from supple.model.chain import Chain
from supple.model.drives import release
from supple.model.linear import Port
from supple.optimize import sweep as sweeping, sweep_file
from supple.optimize.sweep import Axis, SweepTask, sweep
from supple.optimize.sweep_file import open_sheet, publish

CART = Chain(("cart",), (("spring", "ground", "cart"),))
NUMBERS = {
    "masses.cart.mass": 0.5,
    "links.spring.stiffness": 200.0,
    "links.spring.damping": 0.3,
}
TOLD = {"title": "a map – with a dash", "provenance": "{}"}


def task(scores=("rms", "peak"), count=7) -> SweepTask:
    axes = (
        Axis("links.spring.stiffness", np.linspace(50.0, 400.0, count), "N/m"),
        Axis("links.spring.damping", np.linspace(0.1, 40.0, 5), "N s/m"),
        Axis("masses.cart.mass", np.array([0.5]), "kg"),
    )
    times = np.arange(200) / 100.0
    return SweepTask(
        CART, NUMBERS, release("cart", 0.1), times, (0.0, 2.0), Port("cart", "position"),
        scores, axes,
    )  # fmt: skip


def read(path):
    with netcdf_file(path, mmap=False) as file:
        values = {name: np.array(one[:]) for name, one in file.variables.items()}
        units = {name: one.units.decode() for name, one in file.variables.items()}
        dims = {name: one.dimensions for name, one in file.variables.items()}
        return values, units, dims, file._attributes["title"].decode()


def test_another_program_reads_names_units_and_every_number(tmp_path):
    asked = task()
    sheet, unfinished = open_sheet(tmp_path / "new" / "map.nc", asked, "m", TOLD)
    found = sweep(asked, sheet)
    publish(unfinished, tmp_path / "new" / "map.nc")
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["map.nc"]
    values, units, dims, title = read(tmp_path / "new" / "map.nc")
    assert title == TOLD["title"]
    for axis in asked.axes:
        np.testing.assert_array_equal(values[axis.name], axis.values)
        assert (units[axis.name], dims[axis.name]) == (axis.unit, (axis.name,))
    names = tuple(axis.name for axis in asked.axes)
    memory = sweep(asked)
    for name in ("rms", "peak"):
        assert (dims[name], units[name]) == (names, "m")
        np.testing.assert_array_equal(values[name], memory.scores[name])
        np.testing.assert_array_equal(found.scores[name], memory.scores[name])
    np.testing.assert_array_equal(values["overdamped"], memory.overdamped)
    np.testing.assert_array_equal(values["mode_changes"], memory.mode_changes)
    assert values["overdamped"].sum() > 0
    assert units["dominant_frequency"] == "Hz"
    assert values["dominant_shape"].shape == (7, 5, 1, 1, 2)


def test_the_bytes_are_the_same_with_one_worker_and_with_four(tmp_path, monkeypatch):
    monkeypatch.setattr(sweeping, "TILE", 4)
    monkeypatch.setattr(os, "cpu_count", lambda: 4)
    found = {}
    for workers in (1, 4):
        monkeypatch.setattr(sweeping, "WORKERS", workers)
        folder, busy = tmp_path / str(workers), set()
        sheet, unfinished = open_sheet(folder / "map.nc", task(), "m", TOLD)
        work = sweeping.TileWork.__call__

        def noted(own, tile, work=work, busy=busy):
            busy.add(threading.get_ident())
            return work(own, tile)

        monkeypatch.setattr(sweeping.TileWork, "__call__", noted)
        sweep(task(), sheet)
        monkeypatch.setattr(sweeping.TileWork, "__call__", work)
        assert 1 <= len(busy) <= workers
        found[workers] = unfinished.read_bytes()
    assert found[1] == found[4]


def test_an_unfinished_map_is_valid_and_says_what_it_holds(tmp_path, monkeypatch):
    monkeypatch.setattr(sweeping, "TILE", 10)
    asked = task()
    sheet, unfinished = open_sheet(tmp_path / "map.nc", asked, "m", TOLD)

    class Killed(Exception):
        pass

    def stop(done, tiles):
        raise Killed

    with pytest.raises(Killed):
        sweep(asked, sheet, stop)
    values, *_ = read(unfinished)
    assert list(values["tile_done"]) == [1, 0, 0, 0]
    assert np.isfinite(values["rms"].ravel()[:10]).all()
    assert np.isnan(values["rms"].ravel()[10:]).all()
    again, same = open_sheet(tmp_path / "map.nc", asked, "m", TOLD)
    assert same == unfinished and list(again.done) == [1, 0, 0, 0]
    assert sweep(asked, again).resumed == 1


@pytest.mark.parametrize("change", ["told", "scores", "grid", "cut short"])
def test_another_sweep_or_a_torn_file_is_not_taken_up(change, tmp_path):
    asked = task()
    sheet, unfinished = open_sheet(tmp_path / "map.nc", asked, "m", TOLD)
    sweep(asked, sheet)
    told = TOLD | ({"provenance": "{1}"} if change == "told" else {})
    if change == "cut short":
        content = unfinished.read_bytes()
        unfinished.unlink()
        unfinished.write_bytes(content[:-1])
    other = task(
        ("peak", "rms") if change == "scores" else ("rms", "peak"), 8 if change == "grid" else 7
    )
    again, _ = open_sheet(tmp_path / "map.nc", other, "m", told)
    assert not again.done.any()
    assert np.isnan(again.fields["rms"]).all()


def test_what_cannot_be_written_is_refused_in_one_line(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(ValueError, match="expected a place to write to"):
        open_sheet(tmp_path / "file" / "map.nc", task(), "m", TOLD)
    monkeypatch.setattr(sweep_file, "LARGEST_VARIABLE", 100)
    with pytest.raises(ValueError, match="take fewer designs"):
        open_sheet(tmp_path / "map.nc", task(), "m", TOLD)
