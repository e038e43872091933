"""From a coupon of silicone to the sleeve in the grip: radial segments that act as springs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, model_validator

from ..model.door import read_toml, rule, validated
from .coupon import Sample

SEGMENTS = 180
"""Radial segments of the part in contact [-]; from 3 on the sum no longer depends on it."""

ELEMENTS = 4
"""Elements of a robot's sleeve, side by side: two sets of two [-]."""


@dataclass(frozen=True)
class SleeveShape:
    """Size of a sleeve and how it is held.

    Attributes:
        inner_diameter: of the relaxed sleeve [m].
        outer_diameter: of the relaxed sleeve [m].
        length: along the club [m].
        compression: by which the clamp thins the wall [-].
        contact: ``half`` where one side alone carries, ``full`` where the other keeps contact.
    """

    inner_diameter: float
    outer_diameter: float
    length: float
    compression: float = 0.0
    contact: str = "half"

    @property
    def wall(self) -> float:
        """Thickness of the compressed wall [m]."""
        return (self.outer_diameter - self.inner_diameter) / 2 * (1 - self.compression)

    @property
    def width_per_height(self) -> float:
        """Effective area over height: a sleeve's stiffness is this times the modulus [m].

        Each segment is a spring of modulus times area over wall, at the mean radius; its part in
        the direction of motion is the square of the cosine of its angle.

        Source: thesis lines 1243-1244 and Figure 66.
        """
        arc = np.pi if self.contact == "half" else 2 * np.pi
        angles = (np.arange(SEGMENTS) + 0.5) / SEGMENTS * arc - arc / 2
        radius = (self.inner_diameter + self.outer_diameter) / 4
        area = arc / SEGMENTS * radius * self.length
        return float(np.sum(area / self.wall * np.cos(angles) ** 2))

    def factor(self, sample: Sample) -> float:
        """Stiffness of the sleeve over that of a coupon of the same silicone [-]."""
        return self.width_per_height * sample.geometry_factor


class _Table(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class _SampleTable(_Table):
    height: float = Field(gt=0.0)
    area: float | None = Field(default=None, gt=0.0)
    diameter: float | None = Field(default=None, gt=0.0)

    @model_validator(mode="after")
    def _across(self) -> _SampleTable:
        if (self.area is None) == (self.diameter is None):
            found = "both" if self.area else "neither"
            raise rule("one of 'area' and 'diameter'", "state the cross section once", found)
        return self


class _SleeveTable(_Table):
    inner_diameter: float = Field(gt=0.0)
    outer_diameter: float = Field(gt=0.0)
    length: float = Field(gt=0.0)
    compression: float = Field(default=0.0, ge=0.0, lt=1.0)
    contact: Literal["half", "full"] = "half"

    @model_validator(mode="after")
    def _thick(self) -> _SleeveTable:
        if self.outer_diameter <= self.inner_diameter:
            found = f"{self.outer_diameter:g}"
            raise rule("an outer_diameter above inner_diameter", "exchange the two", found)
        return self


class _SizesFile(_Table):
    sample: _SampleTable | None = None
    sleeve: _SleeveTable | None = None


def read_sizes(path: Path) -> tuple[Sample | None, SleeveShape | None, str]:
    """Reads the sizes of coupon and sleeve: tables [sample] and [sleeve], in m and m^2.

    Args:
        path: the TOML file.

    Returns:
        Sample and sleeve, None where not stated, and the SHA-256 of the file's bytes.

    Raises:
        ValueError: one line with file, place, expected, found and mend.
    """
    document, sha256 = read_toml(path)
    sizes = validated(_SizesFile, document, path)
    sample = None
    if sizes.sample is not None:
        across = np.pi / 4 * (sizes.sample.diameter or 0.0) ** 2
        sample = Sample(sizes.sample.height, float(sizes.sample.area or across))
    shape = None if sizes.sleeve is None else SleeveShape(**sizes.sleeve.model_dump())
    return sample, shape, sha256
