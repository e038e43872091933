"""Universal and TDMS files: what their own libraries write is read, and damage is said in words."""

import gc
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

from supple.identification.records import Record, read_record

RATE, COUNT = 2048.0, 300
TIMES = 0.5 + np.arange(COUNT) / RATE
HEAD = 7.0 * np.exp(-4.0 * (TIMES - 0.5)) * np.cos(60.0 * TIMES)
HAND = 0.3 * np.sin(25.0 * TIMES)

SIDECAR = """[record]
file = "{file}"
test = "decay"
{rate}

[channels.head]
column = {head}
unit = "g"
role = "response"
quantity = "acceleration"
place = "clubhead"

[channels.hand]
column = {hand}
unit = "m/s^2"
role = "response"
quantity = "acceleration"
place = "hand"
"""


def dataset(name: str, values: np.ndarray, node: int, direction: int, form: dict) -> dict:
    pyuff = pytest.importorskip("pyuff")
    kinds = {"binary": 1, "ord_data_type": 4, "abscissa_spacing": 1, "func_type": 1} | form
    step = 1.0 / form.get("rate", RATE)
    kinds.pop("rate", None)
    return pyuff.prepare_58(
        id1=name, rsp_node=node, rsp_dir=direction, rsp_ent_name="NONE", ref_ent_name="NONE",
        load_case_id=0, ver_num=0, ref_node=0, ref_dir=0, num_pts=len(values),
        abscissa_min=0.5, abscissa_inc=step, z_axis_value=0.0, abscissa_spec_data_type=17,
        ordinate_spec_data_type=12, orddenom_spec_data_type=0, z_axis_spec_data_type=0,
        ordinate_axis_units_lab="g", byte_ordering=1, fp_format=2,
        data=values, x=0.5 + step * np.arange(len(values)), **kinds,
    )  # fmt: skip


def write_uff(path: Path, sets: list[dict], single: bool = False) -> Path:
    """Appends to a new file: to overwrite, pyuff would leave out the headers of binary sets."""
    pyuff = pytest.importorskip("pyuff")
    path.unlink(missing_ok=True)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)  # it leaves closing to the collector
        pyuff.UFF(str(path)).write_sets(sets, "add", force_double=not single)
        gc.collect()
    return path


def write_tdms(path: Path, rates: tuple[float, float] = (RATE, RATE), more: tuple = ()) -> Path:
    nptdms = pytest.importorskip("nptdms")
    channels = [
        nptdms.ChannelObject(group, name, values, properties={
            "wf_increment": 1.0 / rate, "wf_start_offset": 0.5, "unit_string": "g"})
        for (group, name, values), rate in zip(
            [("swing", "acc head", HEAD), ("swing", "acc hand", HAND)], rates)
    ]  # fmt: skip
    with nptdms.TdmsWriter(str(path)) as writer:
        half = [nptdms.ChannelObject(c.group, c.channel, c.data[:100], properties=c.properties)
                for c in channels]  # fmt: skip
        rest = [nptdms.ChannelObject(c.group, c.channel, c.data[100:]) for c in channels]
        writer.write_segment([*half])
        writer.write_segment([*rest, *more])
    return path


def read(path: Path, head='"acc head"', hand='"acc hand"', rate="", sidecar=SIDECAR) -> Record:
    toml = path.with_suffix(".toml")
    toml.write_text(sidecar.format(file=path.name, head=head, hand=hand, rate=rate))
    return read_record(toml)


def both(form: dict) -> list[dict]:
    return [dataset("acc head", HEAD, 12, 3, form), dataset("acc hand", HAND, 1, -1, form)]


FORMS = {
    "binary, double": {}, "ASCII, double": {"binary": 0}, "binary, uneven": {"abscissa_spacing": 0},
    "ASCII, uneven": {"binary": 0, "abscissa_spacing": 0},
}  # fmt: skip


@pytest.mark.parametrize("form", FORMS.values(), ids=FORMS)
def test_a_universal_file_holds_what_was_written(form, tmp_path):
    rate = f"sample_rate = {RATE}" if form.get("abscissa_spacing") == 0 else ""
    record = read(write_uff(tmp_path / "a.uff", both(form)), rate=rate)
    assert record.sample_rate == pytest.approx(RATE, rel=1e-5)
    assert np.allclose(record.channel("head").values, 9.80665 * HEAD, rtol=0, atol=1e-8)
    assert np.allclose(record.channel("hand").values, HAND, rtol=0, atol=1e-9)
    assert len(record.files[str(tmp_path / "a.uff")]) == 64
    assert any("the header 'acc hand [g]' states 'g'" in text for text in record.warnings)


@pytest.mark.parametrize("binary", [0, 1])
def test_single_precision_is_read_as_such(binary, tmp_path):
    path = tmp_path / "a.uff"
    if binary:  # pyuff announces single and writes double: the bytes are put in by hand
        content = write_uff(path, both({})).read_bytes().replace(b"\n         4 ", b"\n         2 ")
        for values in (HEAD, HAND):
            content = content.replace(values.tobytes(), values.astype("<f4").tobytes())
        path.write_bytes(content)
    else:
        write_uff(path, both({"binary": 0, "ord_data_type": 2}), single=True)
    assert np.allclose(read(path).channel("hand").values, HAND, rtol=0, atol=1e-5)


def test_channels_go_by_number_and_by_node_and_direction(tmp_path):
    path = write_uff(tmp_path / "a.uff", both({}))
    for head, hand in (("0", "1"), ('"12:+Z"', '"1:-X"'), ('"Acc Head"', '"acc  hand"')):
        record = read(path, head, hand)
        assert np.allclose(record.channel("hand").values, HAND, rtol=0, atol=1e-9)


def test_a_tdms_file_holds_what_was_written(tmp_path):
    path = write_tdms(tmp_path / "a.tdms")
    for head, hand in (('"acc head"', '"swing/acc hand"'), ("0", "1")):
        record = read(path, head, hand)
        assert record.sample_rate == pytest.approx(RATE) and len(record.times) == COUNT
        assert np.allclose(record.channel("head").values, 9.80665 * HEAD, rtol=0, atol=1e-12)
        assert np.array_equal(record.channel("hand").values, HAND)
    assert any("swing/acc hand [g]" in text for text in record.warnings)


@pytest.mark.parametrize("name", ["a.uff", "a.tdms"])
def test_the_files_own_clock_is_a_column(name, tmp_path):
    path = tmp_path / name
    write_uff(path, both({})) if name == "a.uff" else write_tdms(path)
    clock = '[channels.time]\ncolumn = "time:acc hand"\nunit = "s"\n\n[start]\nat = 0.52\n'
    record = read(path, sidecar=SIDECAR + clock)
    assert record.sample_rate == pytest.approx(RATE, rel=1e-5)
    assert record.start["at"] == pytest.approx(0.02, abs=1e-6)
    assert len(read(path, rate="samples = [10, 60]").times) == 50


@pytest.mark.parametrize("name", ["a.uff", "a.tdms"])
def test_a_channel_at_another_rate_is_refused_and_read_with_its_own_clock(name, tmp_path):
    path = tmp_path / name
    sets = [dataset("acc head", HEAD, 12, 3, {}), dataset("acc hand", HAND, 1, 1, {"rate": 512.0})]
    write_uff(path, sets) if name == "a.uff" else write_tdms(path, (RATE, 512.0))
    with pytest.raises(ValueError, match=r"expected 2048 Hz.*found 512.* Hz.*time:acc hand"):
        read(path)
    own = SIDECAR + f'file = "{name}"\ntime = "time:acc hand"\nclock_offset = 0.0\n'
    record = read(path, sidecar=own)
    assert record.channel("hand").sample_rate == pytest.approx(512.0, rel=1e-5)


def test_a_missing_library_says_how_to_get_it(tmp_path, monkeypatch):
    uff, tdms = write_uff(tmp_path / "a.uff", both({})), write_tdms(tmp_path / "b.tdms")
    monkeypatch.setitem(sys.modules, "pyuff", None)
    monkeypatch.setitem(sys.modules, "nptdms", None)
    with pytest.raises(ValueError, match=r"pyuff.*supple\[uff\].*CSV"):
        read(uff)
    with pytest.raises(ValueError, match=r"npTDMS.*supple\[tdms\].*CSV"):
        read(tdms)


def spectrum(path: Path) -> Path:
    return write_uff(path, [dataset("acc head", HEAD, 1, 1, {"func_type": 4})])


def complex_numbers(path: Path) -> Path:
    return write_uff(path, [dataset("acc head", HEAD + 0j, 1, 1, {"ord_data_type": 6})])


def cut(path: Path, write, keep: float) -> Path:
    write(path)
    content = path.read_bytes()
    path.write_bytes(content[: int(keep * len(content))])
    return path


def nan_inside(path: Path) -> Path:
    write_uff(path, both({"binary": 0}))
    path.write_text(path.read_text().replace(f"{HEAD[17]:20.11e}", " " * 17 + "nan", 1))
    return path


def short_set(path: Path) -> Path:
    sets = both({"binary": 0})
    write_uff(path, sets)
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:20] + lines[23:]))
    return path


def text_channel(path: Path) -> Path:
    nptdms = pytest.importorskip("nptdms")
    words = nptdms.ChannelObject("notes", "acc words", ["a", "b", "c"])
    return write_tdms(path, more=(words,))


BAD = {
    "no universal file": ("a.uff", lambda p: p.write_text("t,x\n0,1\n"), "", "no dataset"),
    "empty": ("a.uff", lambda p: p.write_bytes(b""), "", "no dataset"),
    "spectra only": ("a.uff", spectrum, "", "function types '4'"),
    "complex": ("a.uff", complex_numbers, "", "real numbers"),
    "cut": ("a.uff", lambda p: cut(p, lambda q: write_uff(q, both({})), 0.3), "", "expected"),
    "rows lost": ("a.uff", short_set, "", "the 300 samples that it announces, found 288"),
    "not a number": ("a.uff", nan_inside, "", "row 17: expected a finite number, found nan"),
    "no such channel": ("a.uff", lambda p: write_uff(p, both({})), '"acc hed"', "acc head"),
    "no such number": ("a.tdms", write_tdms, "7", r"a channel number 7, found 2"),
    "no TDMS file": ("a.tdms", lambda p: p.write_text("t,x\n0,1\n"), "", "begins with b't,x"),
    "cut TDMS": ("a.tdms", lambda p: cut(p, write_tdms, 0.02), "", "expected"),
    "words": ("a.tdms", text_channel, '"acc words"', "real numbers, found text"),
    "two alike": ("a.uff", lambda p: write_uff(p, [both({})[0]] * 2), "", "it 2 times"),
}  # fmt: skip


@pytest.mark.parametrize(("name", "write", "head", "said"), BAD.values(), ids=BAD)
def test_what_is_wrong_is_said_in_one_line(name, write, head, said, tmp_path):
    write(tmp_path / name)
    with pytest.raises(ValueError, match=said) as told:
        read(tmp_path / name, head or '"acc head"')
    assert "Mend: " in str(told.value) and "\n" not in str(told.value)


def test_a_pickle_is_never_opened(tmp_path):
    import pickle

    trap = tmp_path / "trap"

    class Trap:
        def __reduce__(self):
            return (Path.touch, (trap,))

    for name in ("a.pkl", "a.uff", "a.tdms", "a.mat", "a.npy"):
        (tmp_path / name).write_bytes(pickle.dumps(Trap()))
        with pytest.raises(ValueError, match="expected"):
            read(tmp_path / name)
    assert not trap.exists()


@settings(
    max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    name=st.sampled_from(["a.uff", "a.tdms"]),
    at=st.lists(st.tuples(st.floats(0, 0.999), st.binary(min_size=1, max_size=9)), max_size=4),
    keep=st.floats(0.05, 1.0),
)
def test_damaged_files_are_refused_in_words_or_read_as_numbers(name, at, keep, tmp_path):
    path = tmp_path / name
    write_uff(path, both({"binary": 0})) if name == "a.uff" else write_tdms(path)
    content = bytearray(path.read_bytes())
    for where, junk in at:
        start = int(where * len(content))
        content[start : start + len(junk)] = junk
    path.write_bytes(bytes(content[: int(keep * len(content))]))
    try:
        record = read(path, "0", "1")
    except ValueError as error:
        assert "Mend: " in str(error)
    else:
        assert np.isfinite(record.channel("head").values).all()
