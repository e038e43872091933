"""Plain words for laws, units and numbers, as the reports write them."""

import math
from typing import Any

_LAWS = {
    "linear_stiffness": "extra stiffness",
    "linear_damping": "viscous damping",
    "cubic_stiffness": "cubic stiffness",
    "asymmetric_stiffness": "asymmetric stiffness",
    "coulomb_friction": "dry (Coulomb) friction",
    "quadratic_damping": "quadratic damping",
    "base_acceleration": "base acceleration",
    "stiffness_drift": "drifting stiffness",
    "hysteresis": "hysteresis (Bouc-Wen)",
    "relaxation": "relaxation (Zener)",
    "mains_hum": "mains hum",
}
_SUPERSCRIPTS = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def law_words(law: str) -> str:
    """A law in plain words: ``coulomb_friction`` becomes "dry (Coulomb) friction".

    Args:
        law: the law's name.

    Returns:
        The words.
    """
    return _LAWS.get(law, law.replace("_", " "))


def cause_words(law: str, place: str) -> str:
    """A cause in plain words: a law and its place.

    Args:
        law: the law's name.
        place: where it acts.

    Returns:
        The words, such as "clearance at the wrist".
    """
    return f"{law_words(law)} at {place}"


def unit_words(unit: str) -> str:
    """A unit with its powers raised: ``m/s^2`` becomes m/s².

    Args:
        unit: an SI unit as text.

    Returns:
        The unit as printed.
    """
    parts = unit.replace("**", "^").split("^")
    raised = parts[0]
    for part in parts[1:]:
        length = 1 if part[:1] == "-" else 0
        while length < len(part) and part[length].isdigit():
            length += 1
        raised += part[:length].translate(_SUPERSCRIPTS) + part[length:]
    return raised


def number_words(value: Any, digits: int = 4) -> str:
    """A number as read by people: four digits, powers of ten raised, a dash for none.

    Args:
        value: the number [any unit], or None.
        digits: significant digits.

    Returns:
        The number as text.
    """
    if not isinstance(value, int | float) or isinstance(value, bool) or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    if value != 0.0 and not 1e-3 <= abs(value) < 1e6:
        mantissa, power = f"{value:.{digits - 1}e}".split("e")
        mantissa = mantissa.rstrip("0").rstrip(".") if "." in mantissa else mantissa
        text = f"{mantissa}·10{str(int(power)).translate(_SUPERSCRIPTS)}"
    else:
        text = f"{value:.{digits}g}"
        text = f"{value:.0f}" if "e" in text else text
    return text.replace("-", "−")


def pair_words(value: Any, std: Any) -> str:
    """A value with its standard deviation, rounded to the latter's second digit.

    Args:
        value: the value [any unit].
        std: its standard deviation [same unit], or None.

    Returns:
        ``0.421 ± 0.031``, or the value alone.
    """
    usable = isinstance(std, int | float) and math.isfinite(std) and std > 0.0
    if not usable or not isinstance(value, int | float) or not math.isfinite(value):
        return number_words(value)
    if not 1e-3 <= max(abs(value), std) < 1e6:
        return f"{number_words(value)} ± {number_words(std, 2)}"
    decimals = max(0, 1 - math.floor(math.log10(std)))
    return f"{value:.{decimals}f} ± {std:.{decimals}f}".replace("-", "−")


def chance_words(value: Any) -> str:
    """A probability in percent that is never rounded to certainty.

    Args:
        value: the probability [1].

    Returns:
        Such as "98 %" or "over 99.9 %".
    """
    if not isinstance(value, int | float) or math.isnan(value):
        return "–"
    percent = 100.0 * value
    if percent > 99.9:
        return "over 99.9 %"
    if percent < 0.1:
        return "under 0.1 %"
    return f"{percent:.3g} %"
