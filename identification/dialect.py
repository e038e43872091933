"""How a laboratory's text file is written: encoding, separator, decimal sign and header."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ..model.door import fault
from .units import is_unit

_NUMBER = re.compile(r"[+-]?(\d+[.,]?\d*|[.,]\d+)([eEdD][+-]?\d+)?|[+-]?(nan|inf|infinity)", re.I)
_COMMA_NUMBER = re.compile(r"[+-]?\d+(,\d+)?([eE][+-]?\d+)?")
_CONTROL = re.compile(r"[\x00-\x08\x0e-\x1a\x1c-\x1f]")
_MARKS = (
    (codecs.BOM_UTF8, "utf-8-sig"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # before UTF-16, whose mark it begins with
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
_LOOK = 60
"""Lines that are looked at to find the separator [-]."""


@dataclass(frozen=True)
class Layout:
    """Where the numbers of a text file are, and how they are written.

    Attributes:
        names: the header's cells, each with the unit of a row of units in brackets; empty
            strings where a column has none.
        first: index of the first line of numbers, from 0.
        delimiter: ``;``, tab, comma, or a space that stands for any run of spaces.
        comma: whether the decimal sign is a comma.
    """

    names: tuple[str, ...]
    first: int
    delimiter: str
    comma: bool

    def cells(self, line: str) -> list[str]:
        """The cells of one line, without quotes and surrounding spaces [-]."""
        return split_cells(line, self.delimiter)


def decoded(content: bytes, path: Path) -> str:
    """The text of a file in UTF-8, UTF-16, UTF-32 or Latin-1, with or without a mark.

    Args:
        content: its bytes.
        path: the file, for the message.

    Returns:
        The text, lines ended by a line feed.

    Raises:
        ValueError: where the bytes are no text.
    """
    encoding = next((name for mark, name in _MARKS if content.startswith(mark)), None)
    if encoding is None and b"\0" in content[:400]:
        sample = content[:400]
        even, odd = sample[0::2].count(0), sample[1::2].count(0)
        encoding = "utf-16-le" if odd > 4 * even else "utf-16-be" if even > 4 * odd else None
    try:
        text = content.decode(encoding or "utf-8")
    except UnicodeDecodeError:
        if encoding is not None:
            raise _no_text(path, f"bytes that are not {encoding}") from None
        text = content.decode("latin-1")
    if (strange := _CONTROL.search(text)) is not None:
        line = text.count("\n", 0, strange.start()) + 1
        raise _no_text(path, f"the control character 0x{ord(strange.group()):02x} in line {line}")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _no_text(path: Path, found: str) -> ValueError:
    mend = "save it as text in UTF-8, or name it .mat if MATLAB wrote it"
    return fault(path, "", "a text file in UTF-8, UTF-16 or Latin-1", found, mend)


def layout_of(lines: Sequence[str], header_rows: int, path: Path) -> Layout:
    """Finds header, separator and decimal sign.

    Args:
        lines: the lines of the file, blank ones at the end already taken away.
        header_rows: lines to pass over before the header or the data.
        path: the file, for messages.

    Returns:
        The layout.

    Raises:
        ValueError: where there are no rows, or where a comma could mean two things.
    """
    first, said, comment = _first_line(lines, header_rows)
    if first >= len(lines):
        mend = "name the right file, or lower 'header_rows'"
        found = f"{len(lines)} lines, of which {first} come before the data"
        raise fault(path, "", "rows of numbers", found, mend)
    body = lines[first : first + _LOOK]
    header = not _is_data(_loose_cells(body[0]))
    delimiter = said or _delimiter(body, header, lines, first, path)
    names: tuple[str, ...] = ()
    if header:
        names = tuple(_header_cells(lines[first], delimiter, body))
        first += 1
        if first < len(lines) and _is_unit_row(cells := split_cells(lines[first], delimiter)):
            names = tuple(_with_unit(name, cells, i) for i, name in enumerate(names))
            first += 1
    elif comment is not None:
        listed = split_cells(comment, delimiter)
        width = len(split_cells(lines[first], delimiter))
        names = tuple(listed) if len(listed) == width else ()
    comma = any("," in line for line in lines[first:]) if delimiter != "," else False
    return Layout(names, first, delimiter, comma)


def _first_line(lines: Sequence[str], header_rows: int) -> tuple[int, str | None, str | None]:
    """The line after rows to pass over, Excel's ``sep=``, blank lines and comments."""
    first, said, comment = header_rows, None, None
    while first < len(lines):
        line = lines[first].strip()
        if line.lower().startswith("sep=") and len(line) == 5:
            said = line[4]
        elif line.startswith(("#", "%")):
            comment = line.lstrip("#% ")
        elif line:
            break
        first += 1
    return first, said, comment


def split_cells(line: str, delimiter: str) -> list[str]:
    """Cells of a line, quotes and surrounding spaces taken away [-]."""
    if delimiter == " ":
        line = line.strip().replace("\t", " ")
    row = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    return [cell.strip() for cell in row]


def is_number(cell: str) -> bool:
    """Whether a cell is written as a number, not-a-number included [-]."""
    return _NUMBER.fullmatch(cell.strip()) is not None


def _loose_cells(line: str) -> list[str]:
    return [cell.strip().strip('"') for cell in re.split(r"[;,\t ]+", line) if cell.strip()]


def _is_data(cells: Sequence[str]) -> bool:
    """A row is data where at least half of its cells are numbers."""
    return 2 * sum(map(is_number, cells)) >= len(cells)


def _is_unit_row(cells: Sequence[str]) -> bool:
    filled = [cell for cell in cells if cell]
    if not filled or any(is_number(cell) for cell in filled if cell != "1"):
        return False
    return all(map(is_unit, filled))


def _with_unit(name: str, units: Sequence[str], index: int) -> str:
    unit = units[index].strip("[]() ") if index < len(units) else ""
    return f"{name} [{unit}]" if unit else name


def _header_cells(line: str, delimiter: str, body: Sequence[str]) -> list[str]:
    cells = split_cells(line, delimiter)
    width = len(split_cells(body[-1], delimiter))
    if delimiter == " " and len(cells) != width:  # names of several words, set apart by two spaces
        wide = re.split(r"\s{2,}|\t", line.strip())
        cells = wide if len(wide) == width else []
    return cells


def _delimiter(
    body: Sequence[str], header: bool, lines: Sequence[str], first: int, path: Path
) -> str:
    data = body[1:] if header and len(body) > 1 else body
    bare = [re.sub(r'"[^"]*"', "", line) for line in data]
    for delimiter in (";", "\t"):
        if 2 * sum(delimiter in line for line in bare) >= len(bare):
            return delimiter
    tokens = [line.split() for line in bare]
    several = 2 * sum(len(row) > 1 for row in tokens) > len(tokens)
    if not any("," in line for line in bare):
        return " " if several else ","
    if several and all(_COMMA_NUMBER.fullmatch(token) for row in tokens for token in row):
        return " "  # spaces between the columns, decimal commas inside them
    if not several and all(map(_COMMA_NUMBER.fullmatch, (line.strip() for line in bare))):
        head = re.sub(r'"[^"]*"', "", body[0]) if header else None
        if head is not None:
            return "," if "," in head else ";"  # one name: one column with decimal commas
        tails = {len(line.strip().partition(",")[2]) for line in lines[first:]}
        if len(tails) == 1 and min(tails) >= 2 and not all("," not in line for line in bare):
            expected = "a comma that separates columns or decimals"
            mend = "write a header row, or separate columns by ';'"
            found = f"'{body[0].strip()}', which could be either"
            raise fault(path, f"line {first + 1}", expected, found, mend)
    return ","
