"""What all tests share: repeatable hypothesis runs, the real records, and a headless browser."""

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import hypothesis
import pytest

import supple
from supple.studies.engine import forget_programs

if TYPE_CHECKING:
    from playwright.sync_api import Browser

ROOT = Path(__file__).resolve().parent.parent
REAL_RECORDS = ROOT.parent / "shared" / "data"
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
BROWSER_FLAGS = (
    "--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-sync "
    "--disable-background-networking --disable-component-update"
).split()

# Many tests, and the programs that they start, compile the same code: once is enough. Read by jax's
# import; away from the user's own folder.
os.environ["JAX_COMPILATION_CACHE_DIR"] = str(ROOT / "build" / "jax")
os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0.1"
# A test may change what a program is made of: each process traces its own.
os.environ["SUPPLE_PROGRAMS"] = ""

# First calls compile, which would break any deadline; the same examples come up in every run.
hypothesis.settings.register_profile("house", deadline=None, derandomize=True, max_examples=30)
hypothesis.settings.load_profile("house")


def pytest_sessionstart() -> None:
    """Stop at once if another copy of the package than this tree would be tested."""
    found = Path(supple.__file__).resolve().parent
    if found != ROOT:
        pytest.exit(f"supple is imported from {found}, not from {ROOT}: run `make install`", 2)


@pytest.fixture(autouse=True)
def forget_compiled() -> Iterator[None]:
    """After each test, drop compiled programs where they have become too many.

    One module of slow diagnoses alone reaches what a system allows: there the process ends.
    """
    yield
    forget_programs()


@pytest.fixture(scope="session")
def real_records() -> Path:
    """The folder of real measured records, which lies beside the project and is not part of it."""
    if not REAL_RECORDS.is_dir():
        pytest.skip(f"no real records here: {REAL_RECORDS} does not exist")
    return REAL_RECORDS


@pytest.fixture(scope="session")
def browser() -> Iterator["Browser"]:
    """A headless Chromium of this system, driven by playwright; skips where there is none."""
    found = next(filter(None, map(shutil.which, BROWSERS)), None)
    if found is None:
        pytest.skip(f"no browser here: none of {', '.join(BROWSERS)} is on the path")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=found, args=BROWSER_FLAGS)
        yield running
        running.close()
