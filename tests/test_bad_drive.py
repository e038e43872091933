"""Broken drives: one line says where, what was expected, what was found and how to mend it."""

from pathlib import Path

import pytest

from supple.model.drive_file import read_drive
from tests.test_bad_input import DRIVE, NO_DRIVE, RIG, check_line, replaced

DRIVES = {
    "no force": ("force = -1600.0\n", "", "[drive] force"),
    "unknown kind": ('"impact"', '"impakt"', "write 'impact'"),
    "unknown key": ("force =", "forse =", "write 'force'"),
    "key of another kind": ("start = 0.0", "amplitude = 1.0", "kind = 'torque'"),
    "no times": ("[times]\nduration = 2.0\nsample_rate = 2048.0\n", "", "[times]"),
    "rate of zero": ("2048.0", "0.0", "[times] sample_rate"),
    "too many samples": ("2048.0", "2.0e9", "2e+07 samples"),
    "duration as text": ("duration = 2.0", 'duration = "2 s"', "[times] duration"),
    "pulse of no length": ("duration = 0.005", "duration = 0.0", "[drive] duration"),
    "release of nothing": (NO_DRIVE, '[drive]\nkind = "release"\n', "neither"),
    "swing without a file": (
        NO_DRIVE, '[drive]\nkind = "swing"\n', "[drive] file",
    ),
    "profile that is missing": (
        NO_DRIVE,
        '[drive]\nkind = "swing"\nfile = "profile.csv"\n',
        "'profile.csv'",
    ),
    "times unsorted": (
        NO_DRIVE,
        '[drive]\nkind = "torque"\nplace = "wrist"\ntimes = [0.0, 2.0, 1.0]\nvalues = [1, 2, 3]\n',
        "item 2",
    ),
    "values too few": (
        NO_DRIVE,
        '[drive]\nkind = "torque"\nplace = "wrist"\ntimes = [0.0, 2.0]\nvalues = [1.0]\n',
        "2 and 1",
    ),
    "a rig for a drive": (DRIVE, RIG, "[drive]"),
}  # fmt: skip


@pytest.mark.parametrize("name", DRIVES)
def test_broken_drives(name: str, tmp_path: Path) -> None:
    old, new, word = DRIVES[name]
    path = tmp_path / "drive.toml"
    path.write_text(replaced(DRIVE, old, new))
    with pytest.raises(ValueError) as raised:
        read_drive(path)
    check_line(str(raised.value), "drive.toml", (word,))
