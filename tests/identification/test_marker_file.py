"""Files of markers: tables and C3D hold the same, and whatever is wrong is said in one line."""

import sys

import numpy as np
import pytest

from supple.identification.marker_file import read_markers
from tests.lab.golfer import c3d_bytes, lose, make_golfer, marker_table

GOLFER = lose(lose(make_golfer(end=0.6), "club_top", 0.1, 0.02), "tee", 0.3, 0.2)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "swing.csv").write_text(marker_table(GOLFER))
    (tmp_path / "swing.c3d").write_bytes(c3d_bytes(GOLFER))
    return tmp_path


@pytest.mark.parametrize("name", ["swing.csv", "swing.c3d"])
def test_a_table_and_a_c3d_file_hold_the_same_markers(folder, name):
    if name.endswith("c3d"):
        pytest.importorskip("ezc3d")
    files: dict[str, str] = {}
    found = read_markers(folder / name, files)
    assert found.names == GOLFER.names and found.rate == pytest.approx(400.0)
    assert np.array_equal(np.isnan(found.places), np.isnan(GOLFER.seen))
    assert np.nanmax(np.abs(found.places - GOLFER.seen)) < 1e-6
    assert list(files) == [str(folder / name)] and len(files[str(folder / name)]) == 64
    part = read_markers(folder / name, {}, samples=(20, 60), rate=401.0)
    assert np.array_equal(part.places, found.places[20:60], equal_nan=True) and part.rate == 401.0


@pytest.mark.parametrize("name", ["swing.csv", "swing.c3d"])
@pytest.mark.parametrize("rate", [40.0, 395.0, 4000.0])
def test_a_stated_rate_does_not_override_the_files_own_clock(folder, name, rate):
    if name.endswith("c3d"):
        pytest.importorskip("ezc3d")
    with pytest.raises(ValueError, match=r"sample_rate: expected the rate of .*400 Hz, found"):
        read_markers(folder / name, {}, rate=rate)


def test_a_stated_rate_is_believed_beside_no_clock_an_uneven_one_or_one_without_a_unit(folder):
    path, text = folder / "swing.csv", (folder / "swing.csv").read_text()
    path.write_text(text.replace("time [s]", "frame"))
    assert read_markers(path, {}, rate=40.0).rate == 40.0
    lines = text.splitlines()
    path.write_text("\n".join([*lines[:100], *lines[103:]]) + "\n")  # frames left out
    assert read_markers(path, {}, rate=400.0).rate == 400.0
    with pytest.raises(ValueError, match="even steps"):
        read_markers(path, {})
    rows = [f"{2.5 * k:.1f},{line.partition(',')[2]}" for k, line in enumerate(lines[1:])]
    path.write_text("\n".join([lines[0].replace("time [s]", "time"), *rows]) + "\n")
    assert read_markers(path, {}, rate=400.0).rate == 400.0  # in ms
    with pytest.raises(ValueError, match="sample_rate"):
        read_markers(path, {}, rate=500.0)


def test_c3d_in_metres_and_a_stated_unit(folder):
    pytest.importorskip("ezc3d")
    (folder / "m.c3d").write_bytes(c3d_bytes(GOLFER, "m"))
    found = read_markers(folder / "m.c3d", {})
    assert np.nanmax(np.abs(found.places - GOLFER.seen)) < 1e-6
    ten = read_markers(folder / "m.c3d", {}, unit="cm")
    assert np.allclose(ten.places, found.places / 100, equal_nan=True)


def test_a_missing_library_says_how_to_get_it(folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "ezc3d", None)
    with pytest.raises(ValueError, match=r"ezc3d.*supple\[c3d\].*CSV"):
        read_markers(folder / "swing.c3d", {})


def test_what_is_no_c3d_file_is_said_in_words(folder):
    pytest.importorskip("ezc3d")
    (folder / "cut.c3d").write_bytes(b"\x02\x50" + b"\0" * 300)
    (folder / "text.c3d").write_text("time,x\n0,1\n")
    for name in ("cut.c3d", "text.c3d"):
        with pytest.raises(ValueError, match=rf"{name}.*expected .* found .* Mend: "):
            read_markers(folder / name, {})


@pytest.mark.parametrize(
    ("change", "word"),
    [
        (lambda text: text.replace("_x [mm]", "_x").replace(" [mm]", ""), "unit of"),
        (lambda text: text.replace("time [s]", "frame"), "sample_rate"),
        (lambda text: "\n".join(text.splitlines()[:6]), "10 frames"),
        (lambda text: text.replace("_x", "").replace("_y", "").replace("_z", ""), "'M1_x'"),
    ],
)
def test_a_table_that_cannot_be_read_is_said_in_words(folder, change, word):
    path = folder / "swing.csv"
    path.write_text(change(path.read_text()))
    with pytest.raises(ValueError, match=word):
        read_markers(path, {})
