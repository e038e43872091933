"""Finds, fits and optimizes the compliance between a swing robot and the club that it swings.

Everything inside is in SI units and in double precision. The switch for the latter stands here,
without importing jax, so that ``supple --help`` stays quick.
"""

import os
import sys
from importlib.metadata import PackageNotFoundError, version

__version__ = "0.1.0"

os.environ["JAX_ENABLE_X64"] = "1"  # read by jax when it is first imported
# Our matrices are small: threads of BLAS cost more than they bring, and where other programs run
# beside, each waits for the others (a swing that needs 6 s took 265 s). Read by numpy's import.
if not {"OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"} & os.environ.keys():
    os.environ |= {"OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
# A march is a loop of thousands of short steps. As one compiled function each step takes a third of
# the time that it takes as a list of calls, which is what larger loops are made of by default.
if "xla_backend_extra_options" not in os.environ.get("XLA_FLAGS", ""):
    os.environ["XLA_FLAGS"] = (
        os.environ.get("XLA_FLAGS", "")
        + " --xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=1000000000"
    ).strip()
# A law's program falls into hundreds of small kernels: XLA's older emitters compile them in 0.6 of
# the time, into 0.6 of the pieces of memory, which run as fast but for one program (`FUSED` in
# model/respond.py). A flag that a release does not know ends the process: it is set where tried.
if "xla_cpu_use_fusion_emitters" not in os.environ["XLA_FLAGS"]:
    try:
        if version("jaxlib").startswith("0.10."):
            os.environ["XLA_FLAGS"] += " --xla_cpu_use_fusion_emitters=false"
    except PackageNotFoundError:  # jax itself will say so
        pass
if "jax" in sys.modules:  # imported before us: too late for the environment
    sys.modules["jax"].config.update("jax_enable_x64", True)
