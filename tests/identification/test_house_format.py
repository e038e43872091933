"""The house format: what a laboratory's file holds comes back to the last digit, with its units."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy.io import savemat

from supple.identification.clubhead_file import read_swing
from supple.identification.house_format import UNTOLD, house_format, relative_files
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
from tests.lab.markers import make_swing
from tests.studies.test_cli_clubhead import SIDECAR as CLUB_SIDECAR, write_swing


def converted(path, folder, **more):
    """Writes a file's house format and reads it as a record."""
    found = house_format(path, **more)
    folder.mkdir(exist_ok=True)
    for name, text in found.texts.items():
        (folder / name).write_text(relative_files(text, folder), encoding="utf-8")
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


def analog_file(folder, cut=0.6):
    """A C3D file with markers at 400 Hz and two analog channels at 2000 Hz, and what they hold."""
    golfer = lose(make_golfer(end=cut), "tee", 0.1, 0.1)
    times = np.arange(5 * len(golfer.times)) / 2000.0
    volts, force = (
        one.astype(np.float32) for one in (np.sin(40.0 * times), 200.0 * np.cos(9.0 * times))
    )
    analog = {"acc head": ("V", volts), "grip force": ("N", force)}
    folder.mkdir(exist_ok=True)
    (folder / "a.c3d").write_bytes(c3d_bytes(golfer, analog=analog))
    return golfer, volts, force


def test_analog_channels_of_a_c3d_file_become_a_record_at_their_own_rate(tmp_path, capsys):
    golfer, volts, force = analog_file(tmp_path / "lab")
    out = tmp_path / "out"
    assert main(["convert", str(tmp_path / "lab" / "a.c3d"), "--out", str(out)]) == 0
    capsys.readouterr()
    names = {one.name for one in out.iterdir()}
    assert names == {"a.csv", "a.toml", "a_analog.csv", "a_analog.toml", "convert.json"}
    record = read_record(out / "a_analog.toml")
    assert record.sample_rate == 2000.0 and len(record.times) == len(volts)
    head, grip = record.channel("acc_head"), record.channel("grip_force")
    assert (head.quantity, head.unit, grip.unit) == ("voltage", "V", "N")
    assert np.array_equal(head.values, volts) and np.array_equal(grip.values, force)
    assert read_markers(out / "a.csv", {}, rate=400.0).names == golfer.names
    told = json.loads((out / "convert.json").read_text())
    assert [one["file"] for one in told["channels"]][-2:] == ["a_analog.csv", "a_analog.csv"]
    assert told["doubts"] == [UNTOLD]


C3D_SIDECAR = """[record]
file = "a.c3d"
test = "driven"
rig = "rig.toml"
[channels.head]
column = "acc head"
unit = "V"
scale = 9.80665
role = "response"
quantity = "acceleration"
place = "clubhead"
[channels.grip]
column = "grip force"
unit = "N"
role = "input"
quantity = "force"
place = "clubhead"
[channels.hand]
column = "club_top_x"
unit = "mm"
role = "response"
quantity = "position"
place = "hand"
file = "a.c3d"
time = "time:club_top_x"
clock_offset = 0.0
"""


def test_a_record_is_read_from_a_c3d_file_and_converted(tmp_path, capsys):
    golfer, volts, force = analog_file(tmp_path)
    (tmp_path / "rig.toml").write_text('[rig]\nkind = "robot"\nmodel = "fixed_collet"\n')
    (tmp_path / "a.toml").write_text(C3D_SIDECAR)
    assert main(["check", str(tmp_path / "a.toml")]) == 0
    assert "2000" in capsys.readouterr().out
    record = read_record(tmp_path / "a.toml")
    assert np.allclose(record.channel("head").values, 9.80665 * volts, rtol=1e-6, atol=0)
    assert np.array_equal(record.channel("grip").values, force)
    hand = record.channel("hand")
    assert hand.sample_rate == pytest.approx(400.0) and len(hand.values) == len(golfer.times)
    place = golfer.names.index("club_top")
    assert np.allclose(hand.values, golfer.seen[:, place, 0], rtol=0, atol=1e-6)
    for asked in ("a.toml", "a.c3d"):
        found, again = converted(tmp_path / asked, tmp_path / "out")
        assert set(found.texts) == {"a.csv", "a_2.csv", "a.toml"}
        for one, other in zip(record.channels, again.channels, strict=True):
            assert np.allclose(one.values, other.values, rtol=1e-12, atol=0)
            assert one.sample_rate == pytest.approx(other.sample_rate)


def test_what_a_record_cannot_take_from_a_c3d_file_is_said(tmp_path):
    analog_file(tmp_path)
    (tmp_path / "a.toml").write_text(C3D_SIDECAR.replace('rig = "rig.toml"\n', ""))
    text = (tmp_path / "a.toml").read_text()
    cases = {
        'column = "club_top_x"': ('column = "tee_x"', "row 40: expected a finite number"),
        'file = "a.c3d"\ntime = "time:club_top_x"\nclock_offset = 0.0\n': (
            "", r"expected 2000 Hz, as its clock, found 400 Hz"),
        '"acc head"': ('"acc hed"', "a channel 'acc hed'"),
        'test = "driven"': ('test = "driven"\nsample_rate = 1000.0', "expected 1000 Hz"),
    }  # fmt: skip
    for old, (new, said) in cases.items():
        (tmp_path / "a.toml").write_text(text.replace(old, new))
        with pytest.raises(ValueError, match=said):
            read_record(tmp_path / "a.toml")


def test_every_file_that_a_sidecar_of_markers_names_is_found_from_the_new_folder(tmp_path):
    made, lab, out = make_swing(1, markers=8), tmp_path / "lab", tmp_path / "out" / "deep"
    lab.mkdir()
    names = tuple(f"M{i}" for i in range(8))
    times = np.arange(len(made.seen)) / 5000.0
    seen = replace(make_golfer(end=0.1), seen=made.seen, times=times, names=names)
    path = write_swing(lab, made)
    (lab / "drive.c3d").write_bytes(c3d_bytes(seen))
    path.write_text(CLUB_SIDECAR.replace("[record]\n", '[record]\nfile = "drive.c3d"\n'))
    (lab / "drive.csv").unlink()
    _, club, ball = read_swing(path)
    assert main(["convert", str(path), "--out", str(out), "--quiet"]) == 0
    text = (out / "drive.toml").read_text()
    for name in ("cloud.csv", "ball.csv"):
        assert f'file = "../../lab/{name}"' in text
    again, its_club, its_ball = read_swing(out / "drive.toml")
    assert again.path == out / "drive.csv"
    assert np.array_equal(its_club.cloud, club.cloud)
    assert ball is not None and its_ball is not None
    assert np.array_equal(its_ball.center, ball.center)


def test_a_stated_rate_that_the_files_times_contradict_is_refused(tmp_path):
    rows = [f"{t:.6f},{x:.9f}" for t, x in zip(TIMES, HEAD)]
    (tmp_path / "a.csv").write_text("\n".join(["time [s],head [g]", *rows]))
    with pytest.raises(ValueError, match="sample_rate: expected the rate of the time column"):
        house_format(tmp_path / "a.csv", 0.5 * RATE)


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
