"""The independent bench: makes measured records with or without a hidden effect."""

from __future__ import annotations

from .draw import BENCHES, Case, draw_case
from .effects import CLUB_CAUSES, LAWS

__all__ = ["BENCHES", "CLUB_CAUSES", "LAWS", "Case", "draw_case"]
