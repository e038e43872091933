"""Finds, fits and optimizes the compliance between a swing robot and the club that it swings.

Everything inside is in SI units and in double precision. The switch for the latter stands here,
without importing jax, so that ``supple --help`` stays quick.
"""

import os
import sys

__version__ = "0.1.0"

os.environ["JAX_ENABLE_X64"] = "1"  # read by jax when it is first imported
if "jax" in sys.modules:  # imported before us: too late for the environment
    sys.modules["jax"].config.update("jax_enable_x64", True)
