"""Broken records, sidecars, rigs and drives: one line says where and how to mend it, exit 2."""

import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from supple.studies.cli import main

N = 400
TIMES = np.arange(N) / 100.0
DECAY = np.exp(-0.5 * TIMES) * np.cos(2 * np.pi * 2.0 * TIMES)

SIDECAR = """\
[record]
file = "bench.csv"
test = "decay"
rig = "bench_rig.toml"

[channels.time]
column = "t"
unit = "s"

[channels.cart]
column = "x"
unit = "mm"
role = "response"
quantity = "position"
place = "cart"
"""

RIG = """\
[rig]
kind = "chain"

[masses.cart]
mass = 0.17

[links.spring]
between = ["ground", "cart"]
stiffness = { value = 24.0, min = 1.0, max = 100.0, free = true }
damping = 0.01
"""

ROBOT = """\
[rig]
kind = "robot"
model = "fixed_collet"
preset = "robo_v"

[parameters]
clubhead_mass = 0.203
"""

DRIVE = """\
[drive]
kind = "impact"
place = "clubhead"
force = -1600.0
start = 0.0
duration = 0.005

[times]
duration = 2.0
sample_rate = 2048.0
"""


def csv_text(values: np.ndarray = DECAY, times: np.ndarray = TIMES) -> str:
    rows = [f"{t:.4f},{x:.9f}" for t, x in zip(times, values, strict=True)]
    return "\n".join(["t,x", *rows]) + "\n"


CSV = csv_text()


@dataclass(frozen=True)
class Case:
    """One thing that is wrong: which file is at fault, and words that the line must hold."""

    fault: str
    words: tuple[str, ...]
    csv: str | bytes | None = CSV
    sidecar: str | bytes = SIDECAR
    rig: str | bytes | None = RIG
    prepare: Callable[[Path], None] = lambda folder: None
    argument: str = "bench.toml"


def replaced(text: str, old: str, new: str) -> str:
    assert old in text
    return text.replace(old, new, 1)


def csv(old: str, new: str, *words: str) -> Case:
    return Case("bench.csv", words, csv=replaced(CSV, old, new))


def sidecar(old: str, new: str, *words: str, fault: str = "bench.toml") -> Case:
    return Case(fault, words, sidecar=replaced(SIDECAR, old, new))


def rig(old: str, new: str, *words: str) -> Case:
    return Case("bench_rig.toml", words, rig=replaced(RIG, old, new))


def robot(old: str, new: str, *words: str) -> Case:
    return Case("bench_rig.toml", words, rig=replaced(ROBOT, old, new))


def line_of(row: int) -> str:
    return CSV.splitlines()[row + 1]


def shifted(row: int, by: float) -> str:
    times = TIMES.copy()
    times[row:] += by
    return csv_text(times=times)


def clipped(level: float) -> str:
    return csv_text(np.clip(DECAY, -level, level))


def huge(folder: Path) -> None:
    with open(folder / "bench.csv", "ab") as file:
        file.truncate(200_000_000)


def directory(folder: Path) -> None:
    (folder / "bench.csv").mkdir()


def put(path: Path, content: bytes) -> None:
    path.write_bytes(content)


def mat(**variables: object) -> Callable[[Path], None]:
    return lambda folder: scipy.io.savemat(folder / "bench.mat", variables)


def mat_case(variables: dict[str, object], *words: str) -> Case:
    text = SIDECAR.replace("bench.csv", "bench.mat")
    return Case("bench.mat", words, csv=None, sidecar=text, prepare=mat(**variables))


def raw_mat(content: bytes, *words: str) -> Case:
    text = SIDECAR.replace("bench.csv", "bench.mat")
    return Case(
        "bench.mat", words, csv=None, sidecar=text, prepare=lambda f: put(f / "bench.mat", content)
    )


CUT_MAT = b"MATLAB 5.0 MAT-file".ljust(124) + b"\0\1IM\x0e\0\0\0\xff\xff\0\0"
ODD_MAT = CUT_MAT[:128] + b"\x0e\0\0\0\x08\0\0\0" + b"\t0\0\0\0\0\0\0"
NO_DRIVE = DRIVE[: DRIVE.index("[times]")]
CLOCK = '[channels.time]\ncolumn = "t"\nunit = "s"\n'
LATIN = SIDECAR.replace("bench_rig", "Prüfstand").encode("latin-1")
SECOND_FILE = 'file = "robot.csv"\ntime = "time_s"\n'
LOOP = '\n[masses.head]\nmass = 1.0\n[links.a]\nbetween = ["cart", "head"]\nstiffness = 1.0\n'

CASES: dict[str, Case] = {
    # the data file
    "missing column": sidecar('"x"', '"y"', "'y'", "'t', 'x'", fault="bench.csv"),
    "column number too high": sidecar('"x"', "7", "number 7", "2 columns", fault="bench.csv"),
    "column twice": Case(
        "bench.csv", ("2 times", "columns 1, 2"), csv=CSV.replace("t,x", "t,x,x", 1)
    ),
    "no header but a name": Case(
        "bench.csv", ("without names",), csv=CSV.removeprefix("t,x\n")
    ),
    "text in numbers": csv(line_of(5), "0.0500,abc", "row 5 (line 7)", "column 'x'", "'abc'"),
    "text with underscores": csv(line_of(5), "0.0500,1_000", "line 7", "'1_000'"),
    "thousands": csv(line_of(5), '0.0500,"1,234.5"', "line 7", "1,234.5"),
    "a word for a gap": csv(line_of(9), "0.0900,n/a", "row 9 (line 11)", "'n/a'"),
    "NaN": csv(line_of(7), "0.0700,NaN", "row 7 (line 9)", "a finite number"),
    "infinity": csv(line_of(7), "0.0700,-inf", "row 7 (line 9)", "-inf"),
    "an absurd number": csv(line_of(7), "0.0700,-1e300", "sample 7", "-1e+300"),
    "gap: an empty cell": csv(line_of(3), "0.0300,", "row 3 (line 5)", "an empty cell"),
    "gap: an empty line": csv(line_of(3), "", "row 3 (line 5)", "an empty cell"),
    "gap in time": Case("bench.csv", ("row 200", "a gap of 0.05 s"), csv=shifted(200, 0.04)),
    "time backwards": Case("bench.csv", ("row 50", "backwards"), csv=shifted(50, -0.3)),
    "time stands still": csv(line_of(4), "0.0300,0.9", "row 4", "standing still"),
    "uneven steps": Case(
        "bench.csv",
        ("even steps", "resample"),
        csv=csv_text(times=TIMES + 0.002 * np.sin(np.arange(N) ** 2)),
    ),
    "a cell too many": csv(line_of(5), "0,0500,0,1", "line 7", "2 cells", "found 4"),
    "no rows": Case("bench.csv", ("0 rows",), csv="t,x\n"),
    "one row": Case("bench.csv", ("1 row",), csv="t,x\n0.0,1.0\n"),
    "three rows": Case("bench.csv", ("3 rows",), csv="t,x\n0.0,1.0\n0.1,0.9\n0.2,0.8\n"),
    "empty file": Case("bench.csv", ("an empty file",), csv=""),
    "blank lines only": Case("bench.csv", ("an empty file",), csv="\n \n\n"),
    "constant channel": Case("bench.csv", ("all the same",), csv=csv_text(0 * DECAY + 1.5)),
    "clipped channel": Case("bench.csv", ("clipped at -0.3 and 0.3",), csv=clipped(0.3)),
    "clipped at one side": Case(
        "bench.csv", ("clipped at 0.4",), csv=csv_text(np.minimum(DECAY, 0.4))
    ),
    "binary data": Case("bench.csv", ("a text file",), csv=bytes(range(256)) * 40),
    "an image": Case("bench.csv", ("a text file",), csv=b"\x89PNG\r\n\x1a\n" + b"\0\1\2\3" * 99),
    "broken UTF-16": Case(
        "bench.csv", ("utf-16",), csv=CSV.encode("utf-16")[:-1]
    ),
    "a directory": Case("bench.csv", ("a directory",), csv=None, prepare=directory),
    "200 MB": Case("bench.csv", ("at most 100 MB", "200 MB"), prepare=huge),
    "no such file": Case("bench.toml", ("'bench.csv'", "none of that name"), csv=None),
    "a comma of two meanings": Case(
        "bench.csv",
        ("line 1", "could be either"),
        csv="\n".join(f"{t:.4f}".replace(".", ",") for t in TIMES),
        sidecar=SIDECAR.replace('"x"', "0").replace('column = "t"', "column = 0"),
    ),
    "mixed decimal signs": Case(
        "bench.csv",
        ("'0,5'",),
        csv=replaced(CSV.replace(",", ";"), line_of(6).replace(",", ";"), "0.0600;0,5"),
    ),
    "a spreadsheet": Case(
        "bench.xlsx",
        ("an Excel file", "export it as CSV"),
        sidecar=SIDECAR.replace("bench.csv", "bench.xlsx"),
        prepare=lambda folder: put(folder / "bench.xlsx", b"PK\3\4"),
    ),
    # MAT files
    "MAT: missing variable": mat_case({"t": TIMES, "y": DECAY}, "'x'", "'t', 'y'"),
    "MAT: a matrix": mat_case({"t": TIMES, "x": np.ones((N, 3))}, "'x'", "400 x 3", "x[0]"),
    "MAT: a text": mat_case({"t": TIMES, "x": "hello"}, "real numbers"),
    "MAT: complex": mat_case({"t": TIMES, "x": DECAY * 1j}, "complex numbers"),
    "MAT: NaN": mat_case(
        {"t": TIMES, "x": np.where(TIMES == 0.5, np.nan, DECAY)}, "row 50", "a finite number"
    ),
    "MAT: unequal lengths": mat_case({"t": TIMES[:300], "x": DECAY}, "400 samples for 300 times"),
    "MAT: version 7.3": raw_mat(
        b"MATLAB 7.3 MAT-file".ljust(512) + b"\x89HDF\r\n\x1a\n" + b"\0" * 99, "7.3", "-v7"
    ),
    "MAT: no MAT": raw_mat(b"t,x\n0,1\n" * 50, "a MAT file"),
    "MAT: damaged": raw_mat(ODD_MAT, "a whole MAT file", "kind 12297"),
    "MAT: cut short": raw_mat(CUT_MAT, "a whole MAT file", "cut short"),
    # the sidecar
    "unknown unit": sidecar('"mm"', '"mmm"', "[channels.cart] unit", "'mmm'"),
    "unit of another quantity": sidecar('"mm"', '"kg"', "a unit of position", "'kg'"),
    "volts without a scale": sidecar('"mm"', '"V"', "[channels.cart] unit", "'scale'"),
    "degrees for a length": sidecar('"mm"', '"deg"', "a unit of position", "'deg'"),
    "time in metres": sidecar('"s"', '"m"', "[channels.time] unit", "a unit of time"),
    "unknown key": sidecar("role =", "rolle =", "[channels.cart]", "'rolle'", "write 'role'"),
    "unknown table": sidecar("[record]", "[recrod]", "[recrod]", "write 'record'"),
    "unknown key of the record": sidecar("rig =", "rigg =", "[record] rigg", "write 'rig'"),
    "unknown key of the clock": sidecar('unit = "s"', 'units = "s"', "[channels.time] units"),
    "no unit": sidecar('unit = "mm"\n', "", "[channels.cart] unit", "add 'unit'"),
    "no place": sidecar('place = "cart"\n', "", "[channels.cart] place", "add 'place'"),
    "unknown role": sidecar('"response"', '"output"', "'response', 'input'", "'output'"),
    "unknown quantity": sidecar('"position"', '"postion"', "write 'position'"),
    "unknown test": sidecar('"decay"', '"dekay"', "write 'decay'"),
    "a table of modes with channels": sidecar('"decay"', '"modal"', "unknown key 'channels'"),
    "rate as text": sidecar("[channels.time]", 'sample_rate = "100"\n[channels.time]', "'100'"),
    "rate below zero": sidecar("[channels.time]", "sample_rate = -1.0\n[channels.time]", "than 0"),
    "rate unlike the times": sidecar(
        "[channels.time]", "sample_rate = 1000.0\n[channels.time]", "100 Hz", "1000 Hz"
    ),
    "no clock": sidecar(CLOCK, "", "neither rate nor times"),
    "samples too many": sidecar(
        "[channels.time]", "samples = [0, 900]\n[channels.time]", "900", "400", fault="bench.csv"
    ),
    "samples backwards": sidecar(
        "[channels.time]", "samples = [90, 10]\n[channels.time]", "[record] samples"
    ),
    "samples of one": sidecar(
        "[channels.time]", "samples = [5, 6]\n[channels.time]", "1 row", fault="bench.csv"
    ),
    "too many header rows": sidecar(
        "[channels.time]", "header_rows = 900\n[channels.time]", "900", fault="bench.csv"
    ),
    "negative column": sidecar('"x"', "-1", "[channels.cart] column", "-1"),
    "noise of zero": sidecar('place = "cart"', 'place = "cart"\nnoise = 0.0', "than 0"),
    "scale of zero": sidecar('place = "cart"', 'place = "cart"\nscale = 0.0', "other than 0"),
    "unknown tolerance": sidecar(
        'place = "cart"', 'place = "cart"\ntolerance = { gian = 0.1 }', "write 'gain'"
    ),
    "held response": sidecar('place = "cart"', 'place = "cart"\nheld = true', "at an input only"),
    "place that does not exist": sidecar('"cart"', '"card"', "'card'", "write 'cart'"),
    "frame of a robot": sidecar(
        'place = "cart"', 'place = "cart"\nframe = "collet"', "no collet"
    ),
    "angle on a straight chain": sidecar(
        '"mm"\nrole = "response"\nquantity = "position"',
        '"deg"\nrole = "response"\nquantity = "angle"',
        "a quantity of a translation",
    ),
    "parameter that does not exist": Case(
        "bench.toml",
        ("masses.cart.mas", "write 'masses.cart.mass'"),
        sidecar=SIDECAR + '[parameters]\n"masses.cart.mas" = 0.2\n',
    ),
    "a day with a mass of zero": Case(
        "bench.toml",
        ("[parameters] masses.cart.mass", "above 0 kg"),
        sidecar=SIDECAR + '[parameters]\n"masses.cart.mass" = 0.0\n',
    ),
    "a day with negative damping": Case(
        "bench.toml",
        ("of at least 0 N s/m",),
        sidecar=SIDECAR + "[parameters]\nlinks.spring.damping = -1.0\n",
    ),
    "inputs only": sidecar('"response"', '"input"', "at least one response"),
    "parameter as text": Case(
        "bench.toml", ("[parameters]", "'0.2'"), sidecar=SIDECAR + '[parameters]\na = "0.2"\n'
    ),
    "release after the end": Case(
        "bench.toml", ("[start] at", "9"), sidecar=SIDECAR + "[start]\nat = 9.0\n"
    ),
    "missing rig": Case("bench.toml", ("[record] rig", "'bench_rig.toml'"), rig=None),
    "own file without its times": sidecar(
        'place = "cart"', 'place = "cart"\nfile = "robot.csv"', "'time' beside 'file'"
    ),
    "own file that is missing": sidecar(
        'place = "cart"', 'place = "cart"\n' + SECOND_FILE, "'robot.csv'", "none of that name"
    ),
    "no channels": Case("bench.toml", ("[channels]",), sidecar='[record]\nfile = "bench.csv"\n'),
    "empty sidecar": Case("bench.toml", ("an empty file",), sidecar=""),
    "a rig for a record": Case("bench.toml", ("a rig",), sidecar=RIG),
    "no TOML": sidecar('"x"', "x y", "line 11", "valid TOML"),
    "key twice": sidecar('place = "cart"', 'place = "cart"\nplace = "cart"', "valid TOML"),
    "sidecar in Latin-1": Case(
        "bench.toml", ("UTF-8", "line 4"), sidecar=LATIN
    ),
    "no sidecar": Case("absent.toml", ("an existing file",), argument="absent.toml"),
    "data without a sidecar": Case(
        "other.csv", ("a sidecar other.toml",), argument="other.csv"
    ),
    "a directory for a sidecar": Case("folder", ("a directory",), argument="folder"),
    # the rig
    "mass of zero": rig("0.17", "0.0", "[masses.cart] mass", "above 0 kg"),
    "negative mass": rig("0.17", "-0.17", "[masses.cart] mass"),
    "mass as text": rig("0.17", '"0.17"', "[masses.cart] mass", "'0.17'"),
    "no mass": rig("mass = 0.17", "", "[masses.cart] mass"),
    "negative stiffness": rig("value = 24.0, min = 1.0,", "value = -24.0,", "stiffness", "-24"),
    "negative damping": rig("damping = 0.01", "damping = -0.01", "[links.spring] damping"),
    "value outside its bounds": rig("max = 100.0", "max = 20.0", "from 1 to 20", "24"),
    "bounds exchanged": rig("min = 1.0", "min = 200.0", "'min' below 'max'"),
    "bounds below zero": rig("min = 1.0", "min = -1.0", "at least 0"),
    "unknown key of a number": rig("free = true", "fre = true", "[links.spring.stiffness] fre"),
    "standard deviation of zero": rig("free = true", "std = 0.0", "std", "than 0"),
    "per day": rig("free = true", 'per = "day"', "per", "'day'"),
    "unknown kind": rig('"chain"', '"chian"', "write 'chain'"),
    "unknown mass in a link": rig('"cart"]', '"card"]', "'card'", "write 'cart'"),
    "link to itself": rig('"ground", "cart"', '"cart", "cart"', "a loop"),
    "link of one end": rig('["ground", "cart"]', '["cart"]', "two bodies"),
    "link without numbers": rig(
        RIG[RIG.index("stiffness") :], "", "a stiffness or a damping"
    ),
    "parallel links": Case(
        "bench_rig.toml",
        ("a loop",),
        rig=RIG + '[links.other]\nbetween = ["cart", "ground"]\nstiffness = 1.0\n',
    ),
    "loop through the ground": Case(
        "bench_rig.toml",
        ("a loop", "links.b"),
        rig=RIG + LOOP + '[links.b]\nbetween = ["head", "ground"]\nstiffness = 1.0\n',
    ),
    "a mass called ground": rig("[masses.cart]", "[masses.ground]", "'ground'"),
    "mass and link of one name": rig("[links.spring]", "[links.cart]", "'cart'"),
    "mass twice": rig("[links.spring]", "[masses.cart]\nmass = 1.0\n[links.spring]", "TOML"),
    "inertia in a translation": rig("mass = 0.17", "inertia = 0.17", "translation"),
    "no masses": rig("[masses.cart]\nmass = 0.17", "", "at least one mass"),
    "robot's parameters in a chain": rig("[masses", "[parameters]\na = 1.0\n[masses", "parameters"),
    "a record for a rig": Case("bench_rig.toml", ("[rig]", "'record'"), rig=SIDECAR),
    "rig is a directory": Case(
        "bench.toml", ("a directory",), rig=None,
        prepare=lambda folder: (folder / "bench_rig.toml").mkdir(),
    ),
    "unknown model": robot('"fixed_collet"', '"fixed"', "write 'fixed_collet'"),
    "no model": robot('model = "fixed_collet"\n', "", "[rig] model"),
    "unknown preset": robot('"robo_v"', '"robo_x"', "robo_v"),
    "unknown robot parameter": robot("clubhead_mass", "clubhed_mass", "write 'clubhead_mass'"),
    "robot's mass of zero": robot("0.203", "0.0", "above 0 kg"),
    "masses in a robot": robot("[parameters]", "[masses.a]\nmass = 1.0\n[parameters]", "[masses]"),
    "place of a chain on a robot": Case("bench.toml", ("'cart'", "clubhead"), rig=ROBOT),
}  # fmt: skip


def lay_out(case: Case, folder: Path) -> None:
    (folder / "folder").mkdir()
    for name, content in (
        ("bench.csv", case.csv),
        ("bench.toml", case.sidecar),
        ("bench_rig.toml", case.rig),
    ):
        if content is not None:
            data = content.encode() if isinstance(content, str) else content
            (folder / name).write_bytes(data)
    if case.argument.endswith(".csv"):
        (folder / case.argument).write_text(CSV)
    case.prepare(folder)


def check_line(text: str, file: str, words: tuple[str, ...]) -> None:
    lines = text.splitlines()
    assert len(lines) == 1, text
    for word in (file, "expected ", "found ", "Mend: ", *words):
        assert word in lines[0], (word, lines[0])
    assert "Traceback" not in lines[0]
    assert lines[0].endswith(".")


@pytest.mark.parametrize("name", CASES)
def test_says_in_one_line_what_is_wrong(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case, out = CASES[name], tmp_path / "out"
    lay_out(case, tmp_path)
    code = main(["check", str(tmp_path / case.argument), "--out", str(out), "--json"])
    said = capsys.readouterr()
    assert code == 2
    assert said.out == ""
    check_line(said.err, case.fault, case.words)
    assert not out.exists()


FITTED = (
    "text in numbers",
    "one row",
    "clipped channel",
    "unknown unit",
    "inputs only",
    "place that does not exist",
    "missing rig",
    "mass of zero",
    "loop through the ground",
    "no sidecar",
)


@pytest.mark.parametrize("command", ["identify", "diagnose"])
@pytest.mark.parametrize("name", FITTED)
def test_commands_that_fit_say_the_same(
    command: str, name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case, out = CASES[name], tmp_path / "out"
    lay_out(case, tmp_path)
    code = main([command, str(tmp_path / case.argument), "--out", str(out), "--json"])
    said = capsys.readouterr()
    assert (code, said.out) == (2, "")
    check_line(said.err, case.fault, case.words)
    assert not out.exists()


@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_two_records_of_one_name_and_two_rigs_are_refused(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for folder in (tmp_path / "a", tmp_path / "b"):
        folder.mkdir()
        lay_out(Case("", ()), folder)
    both = [str(tmp_path / folder / "bench.toml") for folder in "ab"]
    assert main([command, *both]) == 2
    check_line(capsys.readouterr().err, "bench.toml", ("twice", "rename"))
    (tmp_path / "b" / "bench.toml").rename(tmp_path / "b" / "other.toml")
    assert main([command, both[0], str(tmp_path / "b" / "other.toml")]) == 2
    check_line(capsys.readouterr().err, "bench.toml", ("one rig", "2 different"))


def test_a_record_that_is_only_held_out_cannot_be_diagnosed(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = SIDECAR.replace("[channels.time]", 'split = "held_out"\n[channels.time]', 1)
    lay_out(Case("", (), sidecar=text), tmp_path)
    assert main(["diagnose", str(tmp_path / "bench.toml"), "--json"]) == 2
    check_line(capsys.readouterr().err, "records", ("only held-out ones",))


def test_the_unbroken_one_passes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lay_out(Case("", ()), tmp_path)
    assert main(["check", str(tmp_path / "bench.toml"), "--out", str(tmp_path / "out")]) == 0
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["check.json"]
    assert capsys.readouterr().err == ""


def test_the_mended_one_passes(tmp_path: Path) -> None:
    """What a line says about the clipped channel is true: `clipped = true` lets it through."""
    text = replaced(SIDECAR, 'place = "cart"', 'place = "cart"\nclipped = true')
    lay_out(Case("", (), csv=clipped(0.3), sidecar=text), tmp_path)
    assert main(["check", str(tmp_path / "bench.toml"), "--quiet"]) == 0


@pytest.mark.parametrize("name", ["NaN", "unknown unit", "loop through the ground", "200 MB"])
def test_as_a_process_of_its_own(name: str, tmp_path: Path) -> None:
    case = CASES[name]
    lay_out(case, tmp_path)
    command = [sys.executable, "-m", "supple.studies.cli", "check", case.argument, "--out", "out"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=60)
    assert done.returncode == 2
    assert done.stdout == ""
    check_line(done.stderr, case.fault, case.words)
    assert not (tmp_path / "out").exists()


def test_an_earlier_result_outlives_a_fault(tmp_path: Path) -> None:
    lay_out(Case("", ()), tmp_path)
    arguments = ["check", str(tmp_path / "bench.toml"), "--out", str(tmp_path / "out"), "--quiet"]
    assert main(arguments) == 0
    before = (tmp_path / "out" / "check.json").read_bytes()
    (tmp_path / "bench.csv").write_text("t,x\n")
    assert main(arguments) == 2
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["check.json"]
    assert (tmp_path / "out" / "check.json").read_bytes() == before


def test_out_that_is_a_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lay_out(Case("", ()), tmp_path)
    (tmp_path / "out").write_text("kept")
    arguments = ["check", str(tmp_path / "bench.toml"), "--out", str(tmp_path / "out"), "--json"]
    assert main(arguments) == 2
    check_line(capsys.readouterr().err, "out", ())
    assert (tmp_path / "out").read_text() == "kept"


def test_there_are_enough_cases() -> None:
    assert len(CASES) >= 65
