"""An optimum in plain words: where it is, how flat or sharp, and whether it can be trusted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from .words import number_words, unit_words

if TYPE_CHECKING:
    from ..optimize.optimum import Optimum


def optimum_words(one: Optimum, units: Mapping[str, str]) -> str:
    """An optimum in a few sentences.

    Args:
        one: the optimum.
        units: of the score and of the numbers, by name, as text.

    Returns:
        The sentences.
    """

    def of(name: str, value: float) -> str:
        unit = unit_words(units.get(name, "1"))
        return number_words(value) + ("" if unit == "1" else f" {unit}")

    place = ", ".join(f"{plain(name)} {of(name, v)}" for name, v in one.design.items())
    which = "lowest" if one.is_lowest else "highest"
    words = [f"The {which} {plain(one.score)} is {of(one.score, one.value)} at {place}."]
    shapes = {name: one.sharpness(name) for name in one.design}
    parts = [
        f"{kind} along {' and '.join(plain(n) for n, s in shapes.items() if s == kind)}"
        for kind in ("flat", "even", "sharp")
        if kind in shapes.values()
    ]
    words.append(f"It is {', '.join(parts)}.")
    for name, (low, high) in one.reach.items():
        below = of(name, low) if low is not None else "the lower end of its axis"
        above = of(name, high) if high is not None else "the upper end"
        words.append(f"For 1 % {plain(name)} may go from {below} to {above}.")
    for name, end in one.bounds.items():
        side = "lower" if end == "low" else "upper"
        words.append(f"It stands at the {side} end of {plain(name)}: widen that axis.")
    if one.status != "certified":
        words.append("A finer grid holds a better design: this score jumps; do not trust its best.")
    return " ".join(words)


def region_words(result: Mapping[str, Any]) -> list[str]:
    """How many designs lie in each region that a map marks, a sentence each.

    Args:
        result: what ``map.json`` holds: ``regions``, and ``grip_limit`` if there is one.
    """
    regions = result["regions"]
    words = [
        f"The mode with most energy is overdamped in {regions['overdamped']} designs.",
        f"It is another one than next door in {regions['mode_changes']} designs.",
    ]
    if "grip_beyond" in regions:
        limit = number_words(result["grip_limit"])
        words.append(f"The grip moves more than {limit} m in {regions['grip_beyond']} designs.")
    return words


def plain(name: str) -> str:
    """A name as it is spoken: ``wrist_stiffness`` becomes "wrist stiffness"."""
    return name.replace("_", " ")
