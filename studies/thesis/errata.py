"""Which of the thesis's equations and numbers slip, and what each slip is worth."""

from __future__ import annotations

import numpy as np

from ..study import Study
from .critical_damping import NAME as CRITICAL
from .draw import Curve, Panel
from .errata_equations import arm_panel, equations
from .errata_numbers import SAMPLE, numbers
from .excess import slip_a6
from .table import Found, answering, show

NAME = "thesis/errata"
QUESTION = "Which of the thesis's equations and numbers slip, and what is each slip worth?"


def find() -> Found:
    """Every slip A1 to A10 and B1 to B17, computed with our models with and without it."""
    rows = (*equations(), slip_a6(), *numbers())
    deadener = np.array([*SAMPLE])
    listed = np.array([c for _, c, _ in SAMPLE.values()])
    own = np.array([k * loss / (8 * np.pi) for k, _, loss in SAMPLE.values()])
    damping = Panel(
        "B2: damping of the coupons", "deadener [%]", "damping [N s/m]",
        (Curve(deadener, listed, "Table 4"), Curve(deadener, own, "by its tan delta")),
    )  # fmt: skip
    notes = (
        "'Published' is here what an independent calculation says of the slip; 'reproduced' "
        "means that we confirm it, 'not' that we disagree.",
        "A slip is put back into rows that come out of our energies; tests show that these are "
        "the printed rows wherever the print is right.",
        f"B17 is drawn in the study {CRITICAL}.",
    )
    return Found(rows, (arm_panel(), damping), "Two slips and what they are worth.", notes)


STUDY = Study(NAME, QUESTION, answering(NAME, QUESTION, find), show)
