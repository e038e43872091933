"""Real records are read as they were measured, and large files in few calls a row."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from supple.identification.describe import describe
from supple.identification.records import Record, check_record_against_rig, read_record
from supple.model.rig import read_rig
from tests.identification.test_records import read, sidecar

# The real records: rate [Hz], samples, first SI value of each channel, its unit.
REAL = {
    "emps/train": (
        1000.0, 24841, {"drive": (2.53862809 * 35.150651, "N"), "position": (7.45e-6, "m")},
    ),
    "emps/pulses": (1000.0, 24841, {"drive": (2.55322418 * 35.150651, "N")}),
    "pendulum/swing_01": (1000.0, 5000, {"angle": (np.deg2rad(-90.36), "rad")}),
    "pendulum/swing_02": (1000.0, 5000, {"angle": (np.deg2rad(-135.27), "rad")}),
    "pendulum/swing_03": (1000.0, 5000, {"angle": (np.deg2rad(-45.27), "rad")}),
    "silverbox/train": (
        610.3515625, 20600, {"drive": (-0.01450433, "1"), "response": (0.03645085, "1")},
    ),
    "silverbox/test_arrow": (610.3515625, 40475, {"response": (0.00085876, "1")}),
    "silverbox/test_multisine": (610.3515625, 21688, {"response": (0.02876026, "1")}),
    "sloshing/decay_01": (30.3030, 2404, {"centre": (-4.2818007, "1")}),
    "sloshing/decay_02": (30.3038, 2389, {"centre": (-4.5839532, "1")}),
    "sloshing/decay_03": (30.3041, 2390, {"centre": (4.3404115, "1")}),
    "spring_mass/soft_disc_run1": (100.0, 3058, {"height": (60.3847e-3, "m")}),
    "spring_mass/soft_disc_run2": (100.0, 2558, {"height": (33.0240e-3, "m")}),
    "spring_mass/soft_mesh_run1": (100.0, 3457, {"height": (4.0107e-3, "m")}),
    "spring_mass/soft_mesh_run2": (100.0, 2084, {"height": (19.2e-3, "m")}),
    "spring_mass/stiff_disc_run1": (100.0, 1875, {"height": (-19.6620e-3, "m")}),
    "spring_mass/stiff_disc_run2": (100.0, 2384, {"height": (-14.9504e-3, "m")}),
    "spring_mass/stiff_mesh_run1": (100.0, 1993, {"height": (-14.6673e-3, "m")}),
    "spring_mass/stiff_mesh_run2": (100.0, 2053, {"height": (-18.8809e-3, "m")}),
}  # fmt: skip


@pytest.mark.parametrize("name", REAL)
def test_real_records(name: str, real_records: Path) -> None:
    rate, count, channels = REAL[name]
    record = read_record(real_records / f"{name}.toml")
    assert record.sample_rate == pytest.approx(rate, rel=3e-6)
    assert len(record.times) == count
    for channel, (first, unit) in channels.items():
        found = record.channel(channel)
        assert found.values[0] == pytest.approx(first, rel=1e-5)
        assert (found.unit, len(found.values)) == (unit, count)
    assert record.rig_path is not None
    check_record_against_rig(record, read_rig(record.rig_path))
    said = describe(record)
    assert said["warnings"] == []
    assert said["n_samples"] == count


def test_every_real_record_is_in_the_list(real_records: Path) -> None:
    found = [p for p in real_records.glob("*/*.toml") if "[record]" in p.read_text()]
    assert sorted(f"{p.parent.name}/{p.stem}" for p in found) == sorted(REAL)


def test_a_large_mat_file_is_read_as_arrays(real_records: Path) -> None:
    path = real_records / "silverbox" / "train.toml"
    read_record(path)  # imports scipy.io once
    record, calls = _counted(lambda: read_record(path))
    assert calls < len(record.times)


def _counted(work: Callable[[], Record]) -> tuple[Record, int]:
    """A record, and how many functions, Python's or C's, were called while it was read."""
    calls = 0

    def count(_frame: object, event: str, _argument: object) -> None:
        nonlocal calls
        calls += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        record = work()
    finally:
        sys.setprofile(before)
    return record, calls


def test_a_large_text_file_is_read_in_few_calls_a_row(tmp_path: Path) -> None:
    n = 200_000
    values = np.sin(np.arange(n) / 50.0)
    text = "t;x\n" + "\n".join(f"{i / 1000:.3f};{x:.6f}" for i, x in enumerate(values))
    record, calls = _counted(lambda: read(tmp_path, text.replace(".", ","), sidecar()))
    assert len(record.times) == n
    assert calls < 10 * n
