"""Columns of a MAT file of version 4 to 7: each variable by its name."""

from __future__ import annotations

import functools
import io
import re
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..model.door import fault, nearest, one_of
from .mat_check import damage_of
from .vectors import rows_of

# What scipy raises for files that are cut short, scrambled or of another kind.
_UNREADABLE = (
    ArithmeticError,
    AssertionError,
    AttributeError,
    EOFError,
    LookupError,
    MemoryError,
    NameError,
    NotImplementedError,
    OSError,
    TypeError,
    ValueError,
    zlib.error,
)
_HDF5 = b"\x89HDF\r\n\x1a\n"


@dataclass(frozen=True)
class MatTable:
    """A MAT file; ``name[2]`` is the third column of a matrix, ``name.part`` a part of a struct.

    Attributes:
        path: the file.
        sha256: of its bytes.
        content: its bytes.
    """

    path: Path
    sha256: str
    content: bytes = field(repr=False)

    @property
    def own_rate(self) -> None:
        """None: a MAT file keeps its clock in a variable, if at all."""

    def rate_of(self, key: str | int, place: str) -> None:
        """None: a MAT file states no rate."""

    def times_of(self, key: str | int, place: str) -> None:
        """None: a MAT file keeps its clock in a variable, if at all."""

    @property
    def columns(self) -> tuple[str | int, ...]:
        """Every vector of real numbers, and every column of a matrix of them, by name [-]."""
        found: list[str] = []
        for name, array in _arrays(self._variables):
            if array.dtype.kind not in "biuf" or array.ndim not in (1, 2) or array.size < 2:
                continue
            wide = array.ndim == 2
            found += [f"{name}[{i}]" for i in range(array.shape[1])] if wide else [name]
        return tuple(found)

    def name(self, key: str | int) -> str:
        """The name of a variable that exists; a MAT file states no units [-]."""
        return str(key)

    def column(self, key: str | int, rows: tuple[int, int] | None, place: str) -> np.ndarray:
        """Numbers of one variable.

        Args:
            key: the variable's name, or its 0-based number in the file.
            rows: the first and one past the last; None for all.
            place: the key of the sidecar that asks, for messages.

        Returns:
            float64, shape (n,), in the file's unit, finite.

        Raises:
            ValueError: where there is no such variable, or it is no vector of finite numbers.
        """
        values = self._vector(key, place)
        return rows_of(values, rows, self.path, f"variable '{key}'")

    @functools.cached_property
    def _variables(self) -> dict[str, Any]:
        from scipy.io import loadmat
        from scipy.io.matlab import MatReadError

        if self.content[512:520] == _HDF5 or self.content.startswith(_HDF5):
            mend = "save it in MATLAB with save(file, '-v7')"
            raise fault(self.path, "", "a MAT file of version 7 or older", "version 7.3", mend)
        if (damage := damage_of(self.content)) is not None:
            raise fault(self.path, "", "a whole MAT file", damage, "copy or save it again")
        try:
            read = loadmat(io.BytesIO(self.content), struct_as_record=False, squeeze_me=True)
        except (
            MatReadError,
            ValueError,
            TypeError,
            OSError,
            NotImplementedError,
            KeyError,
        ) as error:
            mend = "save it again from MATLAB with save(file, '-v7'), or export CSV"
            found = f"'{error}'" if str(error) else "something else"
            raise fault(self.path, "", "a MAT file", found, mend) from None
        return {name: value for name, value in read.items() if not name.startswith("__")}

    def _vector(self, key: str | int, place: str) -> np.ndarray:
        variables = self._variables
        if isinstance(key, int):
            if key >= len(variables):
                found = f"{len(variables)}: {one_of(variables)}"
                expected = f"a variable number {key}"
                raise fault(self.path, place, expected, found, "name the variable instead")
            key = list(variables)[key]
        match = re.fullmatch(r"(.+)\[(\d+)\]", key)
        name, number = (match.group(1), int(match.group(2))) if match else (key, None)
        value = self._found(name, place)
        array = np.atleast_1d(np.asarray(value))
        if array.dtype.kind not in "biuf":
            found = "complex numbers" if array.dtype.kind == "c" else "something else"
            mend = f"name one of {one_of(variables)}"
            raise fault(self.path, f"variable '{name}'", "real numbers", found, mend)
        if number is not None and array.ndim == 2 and number < array.shape[1]:
            array = array[:, number]
        elif number is not None or array.ndim != 1:
            shape = " x ".join(map(str, array.shape))
            mend = f"write column = '{name}[0]' for the first column of a matrix"
            raise fault(self.path, f"variable '{key}'", "a vector", f"{shape} numbers", mend)
        return array.astype(np.float64)

    def _found(self, name: str, place: str) -> Any:
        if name in self._variables:
            return self._variables[name]
        first, *parts = name.split(".")
        value = self._variables.get(first)
        for part in parts:
            value = getattr(value, part, None) if hasattr(value, "_fieldnames") else None
        if parts and value is not None:
            return value
        like = nearest(name, self._variables)
        mend = f"write column = '{like}'" if like else "write one of these names"
        found = f"the variables {one_of(self._variables)}"
        raise fault(self.path, place, f"a variable '{name}'", found, mend)


def _arrays(variables: dict[str, Any]) -> list[tuple[str, np.ndarray]]:
    """Variables and the parts of structs, each by its name."""
    found: list[tuple[str, np.ndarray]] = []
    for name, value in variables.items():
        if hasattr(value, "_fieldnames"):
            parts = {f"{name}.{part}": getattr(value, part) for part in value._fieldnames}
            found += _arrays(parts)
        else:
            found.append((name, np.asarray(value)))
    return found
