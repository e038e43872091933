"""Records: every dialect gives the same numbers, in SI units, and real files are understood."""

from pathlib import Path

import numpy as np
import pytest
import scipy.io
from hypothesis import given, strategies as st

from supple.identification.clock import clock_of
from supple.identification.describe import describe
from supple.identification.dialect import decoded, is_number
from supple.identification.records import Record, read_record
from supple.identification.signals import (
    clipping,
    dominant_frequency,
    noise_std,
    quantization_step,
)
from supple.identification.units import UnitError, conversion

N = 300
RATE = 100.0
TIMES = np.arange(N) / RATE
VALUES = np.round(7.0 * np.exp(-0.4 * TIMES) * np.cos(2 * np.pi * 3.0 * TIMES), 4)


def sidecar(
    column: str = '"x"', clock: str = 'column = "t"', more: str = "", head: str = ""
) -> str:
    times = f"[channels.time]\n{clock}\n" if clock else ""
    return (
        f'[record]\nfile = "lab.csv"\ntest = "decay"\n{head}\n{times}[channels.head]\n'
        f'column = {column}\nrole = "response"\nplace = "cart"\n'
        + (more or 'unit = "mm"\nquantity = "position"\n')
    )


def read(folder: Path, content: str | bytes, toml: str) -> Record:
    data = content.encode() if isinstance(content, str) else content
    (folder / "lab.csv").write_bytes(data)
    (folder / "lab.toml").write_text(toml, encoding="utf-8")
    return read_record(folder / "lab.toml")


def table(separator: str, comma: bool = False, header: str | None = "t,x") -> str:
    lines = [] if header is None else [header.replace(",", separator)]
    for t, x in zip(TIMES, VALUES, strict=True):
        line = f"{t:.2f}{separator}{x:.4f}"
        lines.append(line.replace(".", ",") if comma else line)
    return "\n".join(lines) + "\n"


PLAIN = table(",")
QUOTED = "t,x\n" + "".join(
    f'"{t:.2f}","{x:.4f}"\n'.replace(".", ",") for t, x in zip(TIMES, VALUES, strict=True)
)
NOTED = PLAIN.replace("\n", ",ok\n").replace("t,x,ok", "t,x,note")
DIALECTS: dict[str, str | bytes] = {
    "comma": PLAIN,
    "comma and space": table(", "),
    "semicolon": table(";"),
    "tab": table("\t"),
    "space": table(" "),
    "aligned by spaces": "\n".join(f"   {line}" for line in table("    ").splitlines()),
    "semicolon, decimal comma": table(";", comma=True),
    "tab, decimal comma": table("\t", comma=True),
    "space, decimal comma": table("  ", comma=True),
    "decimal commas in quotes": QUOTED,
    "byte-order mark": b"\xef\xbb\xbf" + PLAIN.encode(),
    "UTF-16 with mark": PLAIN.encode("utf-16"),
    "UTF-16 big endian": b"\xfe\xff" + PLAIN.encode("utf-16-be"),
    "UTF-16 without mark": PLAIN.encode("utf-16-le"),
    "Latin-1": PLAIN.replace("t,x", "t,x,Länge °").encode("latin-1"),
    "Windows line ends": PLAIN.replace("\n", "\r\n"),
    "old Mac line ends": PLAIN.replace("\n", "\r"),
    "no line end": PLAIN.rstrip(),
    "blank lines at the end": PLAIN + "\n \n",
    "quoted header": PLAIN.replace("t,x", '"t","x"'),
    "units in the header": PLAIN.replace("t,x", "t [s],x (mm)"),
    "header in capitals": PLAIN.replace("t,x", " T , X "),
    "a row of units": PLAIN.replace("t,x", "t,x\ns,mm"),
    "a row of units in brackets": PLAIN.replace("t,x", "t,x\n[s],(mm)"),
    "said separator": "sep=;\n" + table(";"),
    "header in a comment": "# made by a lab\n# " + table(" "),
    "exponents": "t,x\n"
    + "".join(f"{t:.6e},{x:.6E}\n" for t, x in zip(TIMES, VALUES, strict=True)),
    "trailing separators": PLAIN.replace("\n", ",\n"),
    "a column of text": NOTED,
}  # fmt: skip


@pytest.mark.parametrize("dialect", DIALECTS)
def test_every_dialect_gives_the_same_record(dialect: str, tmp_path: Path) -> None:
    record = read(tmp_path, DIALECTS[dialect], sidecar())
    head = record.channel("head")
    np.testing.assert_allclose(head.values, VALUES * 1e-3, rtol=1e-12)
    assert (head.unit, head.role, head.start_time, head.clock_unknown) == (
        "m",
        "response",
        0.0,
        False,
    )
    assert record.sample_rate == pytest.approx(RATE, rel=1e-9)
    np.testing.assert_allclose(record.times, TIMES, atol=1e-9)
    assert record.warnings == ()


def test_columns_by_number_and_no_header(tmp_path: Path) -> None:
    for separator, comma in ((",", False), (";", True), ("\t", False), (" ", True)):
        record = read(tmp_path, table(separator, comma, header=None), sidecar("1", "column = 0"))
        np.testing.assert_allclose(record.channels[0].values, VALUES * 1e-3, rtol=1e-12)


def test_one_column_with_decimal_commas(tmp_path: Path) -> None:
    text = "Position (mm) Run #1\n" + "\n".join(f"{x:.4f}".replace(".", ",") for x in VALUES)
    record = read(tmp_path, text, sidecar('"Position (mm) Run #1"', "", head="sample_rate = 100.0"))
    np.testing.assert_allclose(record.channels[0].values, VALUES * 1e-3, rtol=1e-12)
    assert len(record.times) == N


def test_rows_to_pass_over(tmp_path: Path) -> None:
    text = "Machine 7, Tuesday\nrate; 100\n\n" + PLAIN
    record = read(tmp_path, text, sidecar(head="header_rows = 2"))
    np.testing.assert_allclose(record.channels[0].values, VALUES * 1e-3, rtol=1e-12)


def test_two_runs_of_different_length_in_one_file(tmp_path: Path) -> None:
    rows = [
        f"{t:.2f};{x:.4f};{x:.4f}" if i < 200 else f"{t:.2f};;{x:.4f}"
        for i, (t, x) in enumerate(zip(TIMES, VALUES, strict=True))
    ]
    text = "\n".join(["t;one;two", *rows])
    one = read(tmp_path, text, sidecar('"one"'))
    two = read(tmp_path, text, sidecar('"two"'))
    assert (len(one.times), len(two.times)) == (200, 300)
    assert len(one.channels[0].values) == 200
    np.testing.assert_allclose(two.channels[0].values, VALUES * 1e-3, rtol=1e-12)


def test_samples_choose_rows(tmp_path: Path) -> None:
    damaged = PLAIN.splitlines()
    damaged[5] = "0.04,overload"
    text = "\n".join(damaged)
    record = read(tmp_path, text, sidecar(head="samples = [100, 250]"))
    np.testing.assert_allclose(record.channels[0].values, VALUES[100:250] * 1e-3, rtol=1e-12)
    assert record.times[0] == 0.0
    assert len(record.times) == 150


def test_times_in_another_unit_and_rounded(tmp_path: Path) -> None:
    rows = [f"{1e3 * i / 30.3:.0f},{x}" for i, x in enumerate(VALUES)]
    clock = 'column = "t"\nunit = "ms"'
    record = read(tmp_path, "\n".join(["t,x", *rows]), sidecar(clock=clock))
    assert record.sample_rate == pytest.approx(30.3, rel=1e-4)


def test_a_stated_rate_wins_over_its_own_times(tmp_path: Path) -> None:
    record = read(tmp_path, PLAIN, sidecar(head="sample_rate = 100.2"))
    assert record.sample_rate == 100.2


@pytest.mark.parametrize("clock", ['column = "t"', ""])
def test_a_stated_rate_far_from_the_files_own_times_is_refused(clock: str, tmp_path: Path) -> None:
    """Whether or not the sidecar maps the file's column of times."""
    for header, rate in (("t,x", "50.0"), ("t [s],x", "1000.0"), ("Time (s),x", "102.0")):
        own = clock.replace('"t"', '"Time"' if "Time" in header else '"t"')
        text = PLAIN.replace("t,x", header, 1)
        with pytest.raises(
            ValueError, match=r"sample_rate: expected the rate of .*, 100 Hz, found"
        ):
            read(tmp_path, text, sidecar(clock=own, head=f"sample_rate = {rate}"))


def test_a_column_that_is_no_clock_contradicts_no_rate(tmp_path: Path) -> None:
    head, rows = "sample_rate = 50.0", list(zip(TIMES, VALUES, strict=True))
    falling = "\n".join(["t,x", *(f"{20 - t % 0.5},{x}" for t, x in rows)])
    words = "\n".join(["t,x", *(f"now,{x}" for _, x in rows)])
    in_ms = "\n".join(["t,x", *(f"{2e3 * t:.0f},{x}" for t, x in rows)])  # without a unit
    for text in (falling, words, in_ms):
        assert read(tmp_path, text, sidecar(clock="", head=head)).sample_rate == 50.0


def test_values_are_read_only_and_files_are_known(tmp_path: Path) -> None:
    record = read(tmp_path, PLAIN, sidecar())
    with pytest.raises(ValueError):
        record.channels[0].values[0] = 1.0
    with pytest.raises(ValueError):
        record.times[0] = 1.0
    assert sorted(Path(name).name for name in record.files) == ["lab.csv", "lab.toml"]
    assert all(len(sha256) == 64 for sha256 in record.files.values())


def test_a_data_file_finds_its_sidecar_and_its_stem(tmp_path: Path) -> None:
    (tmp_path / "a.txt").write_text(PLAIN)
    (tmp_path / "a.toml").write_text(sidecar().replace('file = "lab.csv"\n', ""))
    record = read_record(tmp_path / "a.txt")
    assert (record.name, record.path.name, record.split, record.rig_path) == (
        "a", "a.toml", "auto", None,
    )  # fmt: skip


def test_parameters_start_and_tolerance(tmp_path: Path) -> None:
    more = (
        'unit = "mm"\nquantity = "position"\nnoise = 0.2\n'
        "[channels.head.tolerance]\ngain = 0.01\noffset = 3.0\ndelay = 0.002\n"
        "[parameters]\nmasses.cart.mass = 0.2\n[start]\ncart = 0.15\nat = 5.25\n"
    )
    text = "\n".join(["t,x", *(f"{5 + t:.2f},{x}" for t, x in zip(TIMES, VALUES, strict=True))])
    record = read(tmp_path, text, sidecar(more=more))
    head = record.channel("head")
    assert head.noise == pytest.approx(2e-4)
    assert head.tolerance == pytest.approx({"gain": 0.01, "offset": 3e-3, "delay": 0.002})
    assert record.parameters == {"masses.cart.mass": 0.2}
    assert record.start == pytest.approx({"cart": 0.15, "at": 0.25})


def test_a_channel_with_its_own_file_and_clock(tmp_path: Path) -> None:
    robot = ["time_s,wrist [deg]", *(f"{2 + i / 50:.3f},{i % 7}" for i in range(100))]
    (tmp_path / "robot.csv").write_text("\n".join(robot))
    more = (
        'unit = "mm"\nquantity = "position"\n[channels.wrist]\ncolumn = "wrist"\nunit = "deg"\n'
        'role = "input"\nquantity = "angle"\nplace = "wrist"\nheld = true\n'
        'file = "robot.csv"\ntime = "time_s"\n'
    )
    unknown = read(tmp_path, PLAIN, sidecar(more=more)).channel("wrist")
    assert (unknown.sample_rate, len(unknown.values)) == (pytest.approx(50.0), 100)
    assert unknown.clock_unknown
    assert unknown.held
    assert unknown.clock_offset is None
    known = read(tmp_path, PLAIN, sidecar(more=more + "clock_offset = -1.5\n"))
    wrist = known.channel("wrist")
    assert (wrist.clock_offset, wrist.clock_unknown) == (-1.5, False)
    assert wrist.start_time == pytest.approx(0.5)
    assert len(known.times) == N
    assert len(known.files) == 3
    assert [c.name for c in known.inputs] == ["wrist"]
    assert [c.name for c in known.responses] == ["head"]


def test_volts_become_what_the_quantity_demands(tmp_path: Path) -> None:
    more = 'unit = "V"\nscale = 35.0\nquantity = "force"\nnoise = 0.1\n'
    force = read(tmp_path, PLAIN, sidecar(more=more)).channels[0]
    assert (force.unit, force.noise) == ("N", pytest.approx(3.5))
    np.testing.assert_allclose(force.values, 35.0 * VALUES, rtol=1e-12)


def test_mat_files(tmp_path: Path) -> None:
    nested = {"t": TIMES, "x": VALUES}
    both = np.column_stack([TIMES, VALUES])
    scipy.io.savemat(
        tmp_path / "a.mat", {"t": TIMES[None], "x": VALUES[:, None], "s": nested, "m": both}
    )
    for clock, column in (("t", "x"), ("s.t", "s.x"), ("m[0]", "m[1]")):
        text = sidecar(f'"{column}"', f'column = "{clock}"').replace("lab.csv", "a.mat")
        (tmp_path / "a.toml").write_text(text)
        record = read_record(tmp_path / "a.toml")
        np.testing.assert_allclose(record.channels[0].values, VALUES * 1e-3, rtol=1e-12)


def test_a_header_of_another_unit_is_a_warning(tmp_path: Path) -> None:
    more = 'unit = "m"\nquantity = "position"\n'
    record = read(tmp_path, PLAIN.replace("t,x", "t,x [mm]"), sidecar(more=more))
    assert len(record.warnings) == 1
    assert "'mm'" in record.warnings[0]


@pytest.mark.parametrize(
    ("unit", "quantity", "factor"),
    [
        ("m/s^2", "acceleration", 1.0),
        ("g", "acceleration", 9.80665),
        ("mg", "acceleration", 9.80665e-3),
        ("m/s²", "acceleration", 1.0),
        ("m/s2", "acceleration", 1.0),
        ("ft/s^2", "acceleration", 0.3048),
        ("mm", "position", 1e-3),
        ("µm", "deflection", 1e-6),
        ("in", "position", 0.0254),
        ("mph", "velocity", 0.44704),
        ("deg", "angle", np.pi / 180),
        ("°", "angle", np.pi / 180),
        ("deg/s", "angular_velocity", np.pi / 180),
        ("°/s", "angular_velocity", np.pi / 180),
        ("rpm", "angular_velocity", np.pi / 30),
        ("rev/min", "angular_velocity", np.pi / 30),
        ("deg/s^2", "angular_acceleration", np.pi / 180),
        ("lbf", "force", 4.4482216152605),
        ("kN", "force", 1e3),
        ("N m", "torque", 1.0),
        ("Nm", "torque", 1.0),
        ("N·m", "torque", 1.0),
        ("N mm", "torque", 1e-3),
        ("lbf ft", "torque", 1.3558179483314004),
        ("µm/m", "strain", 1e-6),
        ("%", "strain", 0.01),
        ("microstrain", "strain", 1e-6),
        ("mV", "voltage", 1e-3),
        ("1", "torque", 1.0),
        ("ms", "time", 1e-3),
    ],
)
def test_units(unit: str, quantity: str, factor: float) -> None:
    assert conversion(unit, quantity).factor == pytest.approx(factor, rel=1e-12)


@pytest.mark.parametrize(
    ("unit", "quantity"),
    [
        ("kg", "acceleration"), ("g", "force"), ("Hz", "angular_velocity"), ("%", "angle"),
        ("deg", "strain"), ("V", "force"), ("m", "angle"), ("rad", "position"), ("", "force"),
        ("__import__('os')", "force"), ("m**9999999", "position"), ("s", "position"),
        ("2 m", "position"),
    ],
)  # fmt: skip
def test_units_that_do_not_fit(unit: str, quantity: str) -> None:
    with pytest.raises(UnitError):
        conversion(unit, quantity)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_what_python_prints_is_a_number(value: float) -> None:
    assert is_number(repr(value))
    assert not is_number(f"{value} V")


@given(st.text(st.characters(exclude_categories=("C",)), max_size=40))
def test_text_survives_its_encodings(text: str) -> None:
    for encoding in ("utf-8", "utf-8-sig", "utf-16", "utf-32"):
        assert decoded(text.encode(encoding), Path("x")) == text


@given(
    rate=st.floats(0.5, 5e4), start=st.floats(-10.0, 1e3), decimals=st.integers(4, 12),
    seed=st.integers(0, 9),
)  # fmt: skip
def test_a_rounded_and_jittered_clock_keeps_its_rate(
    rate: float, start: float, decimals: int, seed: int
) -> None:
    n = 400
    times = start + np.arange(n) / rate
    times += np.random.default_rng(seed).uniform(-0.002, 0.002, n) / rate
    if 10.0**-decimals < 0.5 / rate:
        times = np.round(times, decimals)
    assert clock_of(times, Path("x"), "t").rate == pytest.approx(rate, rel=2e-3)


def test_signals() -> None:
    rng = np.random.default_rng(1)
    t = np.arange(4096) / 512.0
    decay = np.exp(-0.5 * t) * np.cos(2 * np.pi * 5.3 * t)
    noisy = decay + rng.normal(0.0, 0.02, len(t))
    assert dominant_frequency(noisy, 512.0) == pytest.approx(5.3, abs=0.02)
    assert noise_std(noisy, 512.0) == pytest.approx(0.02, rel=0.1)
    assert quantization_step(np.round(noisy / 0.01) * 0.01) == pytest.approx(0.01, rel=1e-6)
    assert quantization_step(noisy) is None


def test_clipping_is_told_from_steps_rests_and_leaps() -> None:
    rng = np.random.default_rng(2)
    t = np.arange(4096) / 512.0
    decay = np.exp(-0.5 * t) * np.cos(2 * np.pi * 5.3 * t)
    for clean in (
        decay,
        np.round(decay / 0.01) * 0.01,
        np.round(decay / 0.1) * 0.1,
        np.round(np.sin(2 * np.pi * 0.4 * t), 2),
        np.where(t < 2, 0.0, np.where(t < 4, (t - 2) ** 2 * (5 - t) / 4, 1.0)),
        np.sign(np.sin(9.0 * t)),
        np.maximum(0.0, 1.0 - np.abs(t - 4.0) / 0.05),  # a blow between rests
        np.where(t < 1.0, 0.3, 0.3 - 4.0 * np.sin(6.0 * (t - 1.0)) ** 2),
        -1600.0 * (np.abs(t - 2.0) < 0.05),
        rng.normal(size=len(t)),
    ):
        assert clipping(clean) is None
    both = clipping(np.clip(decay + rng.normal(0.0, 0.01, len(t)), -0.5, 0.5))
    assert both is not None
    assert (both.low, both.high) == (-0.5, 0.5)
    assert both.share > 0.05
    slight = clipping(np.minimum(decay[50:], 0.85))
    assert slight is not None
    assert (slight.low, slight.runs) == (None, 1)


def test_rounded_peaks_that_are_written_in_steps_are_not_clipped() -> None:
    rng, times = np.random.default_rng(0), np.arange(60.0)
    flat = 0
    for _ in range(4000):
        fall, middle = rng.uniform(0.02, 4.0), 30.0 + rng.uniform(-1.0, 1.0)
        size = 2.0 * fall * 12.0**2  # a wave of 75 samples; falls by so many steps in the first
        noise = rng.normal(0.0, rng.uniform(0.0, 2.0), len(times))
        wave = size * np.cos((times - middle) / 12.0) + noise
        flat += clipping(0.01 * np.round(wave)) is not None
    assert flat <= 2  # 27 where three equal samples and 10 steps are enough


def test_a_slight_clip_is_a_warning(tmp_path: Path) -> None:
    t = np.arange(4096) / 512.0
    decay = np.minimum(np.exp(-0.5 * t) * np.sin(2 * np.pi * 5.3 * t), 0.95)
    text = "\n".join(["x", *(f"{x:.9f}" for x in decay)])
    record = read(tmp_path, text, sidecar(clock="", head="sample_rate = 512.0"))
    clipped = record.channels[0].clipped
    assert clipped is not None
    assert clipped.high == pytest.approx(0.95e-3)
    (sentence,) = [s for s in describe(record)["warnings"] if "clipped" in s]
    assert sentence.startswith("head is clipped at 0.00095 m: 0.17 % of its samples")
