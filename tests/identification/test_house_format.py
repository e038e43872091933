"""The house format: what a laboratory's file holds comes back to the last digit, with its units."""

import json

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.io import savemat

from supple.identification.house_format import UNTOLD, house_format, relative_rig
from supple.identification.marker_file import read_markers
from supple.identification.records import read_record
from supple.studies.cli import main
from tests.identification.test_lab_files import (
    COUNT,
    FORMS,
    HAND,
    HEAD,
    RATE,
    SIDECAR,
    TIMES,
    both,
    dataset,
    write_tdms,
    write_uff,
)
from tests.lab.golfer import c3d_bytes, lose, make_golfer


def converted(path, folder, **more):
    """Writes a file's house format and reads it as a record."""
    found = house_format(path, **more)
    folder.mkdir(exist_ok=True)
    for name, text in found.texts.items():
        (folder / name).write_text(relative_rig(text, folder), encoding="utf-8")
    return found, read_record(folder / f"{found.name}.toml")


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_a_universal_file_comes_back(form, tmp_path):
    sets = [dataset("acc head", HEAD, 12, 3, form), dataset("hand, left", HAND, 1, -1, form)]
    found, record = converted(write_uff(tmp_path / "a.uff", sets), tmp_path / "out")
    assert record.channel("acc_head").unit == "m/s^2" and found.doubts == (UNTOLD,)
    tolerance = 1e-12 if form.get("binary", 1) else 1e-8  # ASCII itself holds no more digits
    for name, values in (("acc_head", HEAD), ("hand_left", HAND)):
        seen = record.channel(name).values / 9.80665
        assert np.allclose(seen, values, rtol=0, atol=tolerance)
    assert {one["unit"] for one in found.channels} == {"g"}
    assert record.sample_rate == pytest.approx(RATE, rel=1e-5)


def test_a_tdms_file_comes_back_with_each_channels_own_clock(tmp_path):
    found, record = converted(write_tdms(tmp_path / "a.tdms", (RATE, RATE / 2)), tmp_path / "out")
    assert set(found.texts) == {"a.csv", "a_2.csv", "a.toml"}
    head, hand = record.channel("acc_head"), record.channel("acc_hand")
    assert (head.sample_rate, hand.sample_rate) == pytest.approx((RATE, RATE / 2), rel=1e-9)
    assert np.allclose(head.values / 9.80665, HEAD, rtol=1e-12, atol=0)
    assert np.allclose(hand.values / 9.80665, HAND, rtol=1e-12, atol=0)
    assert hand.clock_offset == 0.0 and hand.start_time == pytest.approx(0.0, abs=1e-12)


def test_a_mat_file_says_what_it_lacks(tmp_path):
    path = tmp_path / "a.mat"
    whole = np.stack([HEAD, HAND], axis=1)
    savemat(path, {"t": TIMES, "both": whole, "part": {"x": HEAD, "note": "a"}, "word": "b"})
    found, record = converted(path, tmp_path / "out")
    assert [one["channel"] for one in found.channels] == ["both_0", "both_1", "part_x"]
    assert len(found.doubts) == 4 and "states no unit" in found.doubts[0]
    assert np.array_equal(record.channel("both_1").values, HAND)
    assert np.array_equal(record.channel("part_x").values, HEAD)
    assert record.sample_rate == pytest.approx(RATE)
    savemat(path, {"head": HEAD})
    with pytest.raises(ValueError, match=r"expected a clock.*--sample-rate"):
        house_format(path)
    assert converted(path, tmp_path / "out", sample_rate=500.0)[1].sample_rate == 500.0


def test_text_of_another_dialect_comes_back(tmp_path):
    path = tmp_path / "a.txt"
    rows = [f"{t:.6f};{x:.9f}".replace(".", ",") for t, x in zip(1e3 * TIMES, HEAD)]
    path.write_text("\n".join(["Zeit (ms);Kraft (kN)", *rows]), encoding="utf-8")
    found, record = converted(path, tmp_path / "out")
    assert found.channels[0]["unit"] == "kN" and found.channels[0]["quantity"] == "force"
    assert np.allclose(record.channel("kraft").values, 1e3 * np.round(HEAD, 9), rtol=1e-12)
    assert record.sample_rate == pytest.approx(RATE, rel=1e-6)


def test_markers_of_a_c3d_file_come_back(tmp_path):
    golfer = lose(make_golfer(noise=3e-4), "club_bottom", 0.4, 0.05)
    path = tmp_path / "a.c3d"
    path.write_bytes(c3d_bytes(golfer))
    (tmp_path / "a.toml").write_text('[record]\nfile = "a.c3d"\n[club]\ntop = 0.2\n')
    for asked in (path, tmp_path / "a.toml"):
        found = house_format(asked)
        out = tmp_path / "out"
        out.mkdir(exist_ok=True)
        for name, text in found.texts.items():
            (out / name).write_text(text, encoding="utf-8")
        there, here = read_markers(path, {}), read_markers(out / "a.csv", {}, rate=400.0)
        assert here.names == there.names and there.unit == "mm"
        assert np.array_equal(np.isnan(here.places), np.isnan(there.places))
        assert np.isnan(there.places).sum() == 3 * 20
        assert np.nanmax(np.abs(here.places - there.places)) < 1e-12
        assert "[club]\ntop = 0.2" in found.texts["a.toml"]
        assert 'unit = "mm"' in found.texts["a.toml"] and "[mm]" in found.texts["a.csv"]


def test_a_sidecar_is_kept(tmp_path):
    write_uff(tmp_path / "a.uff", both({}))
    (tmp_path / "rig.toml").write_text('[rig]\nkind = "robot"\nmodel = "fixed_collet"\n')
    rate = 'rig = "rig.toml"\nsamples = [0, 200]'
    text = SIDECAR.format(file="a.uff", head='"12:+Z"', hand="1", rate=rate)
    clock = '[channels.time]\ncolumn = "time"\nunit = "s"\n\n[start]\nat = 0.52\n'
    (tmp_path / "a.toml").write_text(text + clock)
    there = read_record(tmp_path / "a.toml")
    for asked in ("a.toml", "a.uff"):
        _, here = converted(tmp_path / asked, tmp_path / "out")
        for one, other in zip(there.channels, here.channels, strict=True):
            told = ("name", "quantity", "place", "unit", "role", "sample_rate")
            assert [getattr(one, k) for k in told] == [getattr(other, k) for k in told]
            assert np.allclose(one.values, other.values, rtol=1e-12, atol=0)
        assert here.start == there.start and len(here.times) == 200
        assert here.rig_path is not None and here.rig_path.resolve() == tmp_path / "rig.toml"
        assert "../rig.toml" in (tmp_path / "out" / "a.toml").read_text()


@settings(max_examples=15)
@given(st.lists(st.floats(-1e12, 1e12, width=64), min_size=COUNT, max_size=COUNT, unique=True))
def test_every_number_reads_back_to_itself(tmp_path_factory, values):
    folder = tmp_path_factory.mktemp("numbers")
    savemat(folder / "a.mat", {"x": np.array(values)})
    _, record = converted(folder / "a.mat", folder / "out", sample_rate=10.0)
    assert record.channel("x").values.tolist() == values


def test_the_command_writes_and_says_what_is_left_to_do(tmp_path, capsys):
    path = write_tdms(tmp_path / "a.tdms")
    assert main(["convert", str(path), "--out", str(tmp_path / "out")]) == 0
    assert "acc_head" in capsys.readouterr().out
    names = {one.name for one in (tmp_path / "out").iterdir()}
    assert names == {"a.csv", "a.toml", "convert.json"}
    told = json.loads((tmp_path / "out" / "convert.json").read_text())
    assert told["channels"][0]["unit"] == "g" and len(told["provenance"]["inputs"]) == 1
    assert main(["check", str(tmp_path / "out" / "a.toml"), "--quiet"]) == 0
    capsys.readouterr()
    again = tmp_path / "out" / "a.csv"
    assert main(["convert", str(again), "--out", str(tmp_path / "out")]) == 2
    assert "name another folder" in capsys.readouterr().err
    assert main(["convert", str(tmp_path / "none.uff"), "--out", str(tmp_path)]) == 2
