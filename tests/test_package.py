"""What importing the package sets up."""

import subprocess
import sys
from pathlib import Path

import pytest

ALONE = """
import os
{before}
import supple
import numpy, scipy.linalg
matrix = numpy.random.default_rng(0).normal(size=(400, 400))
scipy.linalg.cholesky(matrix @ matrix.T)
threads = open("/proc/self/status").read().split("Threads:")[1].split()[0]
import jax
print(int(threads) == 1, jax.numpy.zeros(1).dtype)
"""
NAMES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")
FREE = f"[os.environ.pop(name, None) for name in {NAMES}]"


@pytest.mark.skipif(not Path("/proc/self/status").is_file(), reason="no list of threads here")
@pytest.mark.parametrize(
    ("before", "told"),
    [
        (FREE, "True float64"),
        (f"{FREE}; os.environ['OPENBLAS_NUM_THREADS'] = '2'", "False float64"),
        (f"{FREE}; os.environ['OMP_NUM_THREADS'] = '2'", "False float64"),
    ],
)
def test_small_matrices_have_one_thread_unless_the_user_says_otherwise(before, told):
    code = [sys.executable, "-c", ALONE.format(before=before)]
    run = subprocess.run(code, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == told


MARCHES = """
import os
os.environ["XLA_FLAGS"] = {flags!r}
import supple
import jax
import jax.numpy as jnp
march = jax.jit(lambda x, pushes: jax.lax.scan(lambda x, u: (jnp.tanh(x) + u, x), x, pushes))
compiled = march.lower(jnp.zeros(4), jnp.zeros((4096, 4))).compile().as_text()
print("xla_cpu_small_call" in compiled, os.environ["XLA_FLAGS"].startswith({flags!r}))
"""


@pytest.mark.parametrize(
    ("flags", "told"),
    [
        ("", "True True"),
        ("--xla_cpu_enable_fast_math=false", "True True"),
        (
            "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=1",
            "False True",
        ),
    ],
)
def test_a_march_is_compiled_as_one_function_unless_the_user_says_otherwise(flags, told):
    code = [sys.executable, "-c", MARCHES.format(flags=flags)]
    run = subprocess.run(code, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == told


EMITTERS = """
import os
from importlib import metadata
os.environ["XLA_FLAGS"] = {flags!r}
known = metadata.version
metadata.version = lambda name: {release!r} or known(name)
import supple
print(*[one for one in os.environ["XLA_FLAGS"].split() if "emitters" in one])
"""


@pytest.mark.parametrize(
    ("flags", "release", "told"),
    [
        ("", "0.10.9", "--xla_cpu_use_fusion_emitters=false"),
        ("", "0.11.0", ""),  # whether it knows the flag is not known
        ("--xla_cpu_use_fusion_emitters=true", "", "--xla_cpu_use_fusion_emitters=true"),
    ],
)
def test_kernels_are_emitted_the_older_way_where_that_was_tried(flags, release, told):
    code = [sys.executable, "-c", EMITTERS.format(flags=flags, release=release)]
    run = subprocess.run(code, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == told
