"""The door for what users write: files read with care, and one line for whatever is wrong."""

from __future__ import annotations

import difflib
import hashlib
import json
import math
import os
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import NoneType, UnionType
from typing import TYPE_CHECKING, Any, TypeVar, Union, get_args, get_origin

if TYPE_CHECKING:
    from pydantic import BaseModel

LARGEST_TOML = 4_000_000
"""Largest TOML file that is read [byte]; rigs and sidecars are a few thousand."""

Model = TypeVar("Model", bound="BaseModel")


def fault(path: Path | str, place: str, expected: str, found: str, mend: str) -> ValueError:
    """What to raise when an input is at fault: one line with file, place and the way out.

    Args:
        path: the file at fault.
        place: where in it, such as ``[channels.head] unit`` or ``line 19``; may be empty.
        expected: what should stand there.
        found: what stands there.
        mend: what the user can do about it.

    Returns:
        A ValueError whose text is one line [-].
    """
    where = f"{path}: {place}: " if place else f"{path}: "
    text = f"{where}expected {expected}, found {found}. Mend: {mend.rstrip('.')}."
    return ValueError(" ".join(text.split()))


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known word most like `word`, or None where nothing is like it [-]."""
    close = difflib.get_close_matches(word, list(known), n=1, cutoff=0.5)
    return close[0] if close else None


def one_of(names: Iterable[str], most: int = 14) -> str:
    """Names as a list in words, cut short after `most` of them [-]."""
    listed = [f"'{name}'" for name in names]
    rest = f" and {len(listed) - most} more" if len(listed) > most else ""
    return ", ".join(listed[:most]) + rest if listed else "none"


def shown(value: object) -> str:
    """A value as it is quoted in a message: short, and on one line [-]."""
    if isinstance(value, Mapping):
        return "a table"
    if isinstance(value, bool):
        return "true" if value else "false"
    text = " ".join(str(value).split()) if isinstance(value, str) else str(value)
    text = text if len(text) <= 60 else text[:57] + "..."
    return f"'{text}'" if isinstance(value, str) else text


def read_bytes(path: Path, largest: int, mend: str) -> bytes:
    """The content of a file that exists, is a file, and is not too large.

    Args:
        path: the file.
        largest: most bytes that are read [byte]; the size is looked at before anything is read.
        mend: what to do about a file that is too large.

    Returns:
        Its bytes.

    Raises:
        ValueError: naming the file, what was expected and what was found.
    """
    if path.is_dir():
        raise fault(path, "", "a file", "a directory", "name a file inside it")
    try:
        size = path.stat().st_size
        if size > largest:
            limit = f"at most {largest / 1e6:g} MB"
            raise fault(path, "", limit, f"{size / 1e6:.0f} MB", mend)
        return path.read_bytes()
    except FileNotFoundError:
        beside = [entry.name for entry in sorted(path.parent.glob("*"))[:500]]
        like = nearest(path.name, beside)
        hint = f"did you mean '{like}'" if like else "check the spelling and the folder"
        raise fault(path, "", "an existing file", "none of that name", hint) from None
    except OSError as error:
        reason = error.strerror or "an error of the system"
        raise fault(path, "", "a readable file", f"'{reason}'", "check its permissions") from None


def sha256_of(content: bytes) -> str:
    """The SHA-256 of some bytes, in hexadecimal [-]."""
    return hashlib.sha256(content).hexdigest()


def read_toml(path: Path) -> tuple[dict[str, Any], str]:
    """Reads a TOML file, with or without a byte-order mark.

    Args:
        path: the file.

    Returns:
        Its tables, and the SHA-256 of its bytes.

    Raises:
        ValueError: where it cannot be read or is no TOML, with line and column.
    """
    content = read_bytes(path, LARGEST_TOML, "name the TOML file that describes the data instead")
    try:
        text = content.decode("utf-8-sig").replace("\r\n", "\n")
        return tomllib.loads(text), sha256_of(content)
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        byte = f"the byte 0x{content[error.start]:02x}"
        raise fault(path, f"line {line}", "text in UTF-8", byte, "save it as UTF-8") from None
    except tomllib.TOMLDecodeError as error:
        message, where = _toml_error(str(error))
        mend = "correct that line; text values need quotes, and a key stands once in a table"
        raise fault(path, where, "valid TOML", f"'{message}'", mend) from None


def _toml_error(text: str) -> tuple[str, str]:
    at = re.search(r"\s*\(at (line \d+, column \d+|end of document)\)", text)
    return (text[: at.start()], at.group(1)) if at else (text, "")


def validated(schema: type[Model], document: Mapping[str, Any], path: Path) -> Model:
    """Checks the tables of a TOML file against a schema.

    Args:
        schema: a pydantic model that forbids unknown keys.
        document: the tables.
        path: where they come from, for the message.

    Returns:
        The filled schema.

    Raises:
        ValueError: the first fault in one line: file, place, expected, found, mend.
    """
    from pydantic import ValidationError

    try:
        return schema.model_validate(document)
    except ValidationError as error:
        faults = error.errors(include_url=False)
        # An unknown key first: it often explains why another one is missing.
        first = min(faults, key=lambda each: each["type"] != "extra_forbidden")
        raise _translated(schema, first, path) from None


def _translated(schema: type[BaseModel], error: Any, path: Path) -> ValueError:
    loc, kind, value = tuple(error["loc"]), error["type"], error["input"]
    context = error.get("ctx", {})
    if kind == "extra_forbidden":
        known = _known_keys(schema, loc[:-1])
        like = nearest(str(loc[-1]), known)
        mend = f"write '{like}'" if like else "remove it"
        place = _place(loc, table=isinstance(value, Mapping))
        return fault(path, place, f"one of {one_of(known)}", f"the unknown key '{loc[-1]}'", mend)
    if kind == "missing":
        place = _place(loc, table=False)
        return fault(path, place, f"the key '{loc[-1]}'", "nothing", f"add '{loc[-1]}'")
    place = _place(loc, table=isinstance(value, Mapping))
    if kind == "literal_error":
        words = re.findall(r"'([^']*)'", context["expected"])
        like = nearest(value, words) if isinstance(value, str) else None
        choice = f"one of {one_of(words)}" if len(words) > 1 else one_of(words)
        mend = f"write '{like}'" if like else f"write {choice}"
        return fault(path, place, choice, shown(value), mend)
    if kind == "rule":
        found = context["found"] or shown(value)
        return fault(path, place, context["expected"], found, context["mend"])
    expected = _expected(kind, str(error["msg"]))
    return fault(path, place, expected, shown(value), f"write {expected}")


_KINDS = {
    "float_type": "a number",
    "int_type": "a whole number",
    "string_type": "a text in quotes",
    "bool_type": "true or false",
    "list_type": "a list",
    "dict_type": "a table",
    "model_type": "a table",
    "finite_number": "a finite number",
}


def _expected(kind: str, message: str) -> str:
    """What pydantic asks for, in words that fit after "expected"."""
    text = message.removeprefix("Input should be ")
    return _KINDS.get(kind, f"a number {text}" if text.startswith(("greater", "less")) else text)


def rule(expected: str, mend: str, found: str = "") -> Exception:
    """What a schema's own check raises; `validated` turns it into the line for the user.

    Args:
        expected: what should stand there.
        mend: what to do about it.
        found: what stands there; the value itself where empty.

    Returns:
        An error that pydantic collects.
    """
    from pydantic_core import PydanticCustomError

    context = {"expected": expected, "mend": mend, "found": found}
    return PydanticCustomError("rule", "expected {expected}", context)


def _place(loc: Sequence[int | str], table: bool) -> str:
    """A path of keys as it is seen in the file: ``[channels.head] unit``."""
    keys: list[str] = []
    for key in loc:
        if isinstance(key, int) and keys:
            keys[-1] += f" item {key}"
        else:
            keys.append(str(key))
    if len(keys) < 2 or table:
        return f"[{'.'.join(keys)}]" if keys else ""
    return f"[{'.'.join(keys[:-1])}] {keys[-1]}"


def _known_keys(schema: type[BaseModel], loc: Sequence[int | str]) -> list[str]:
    """Keys allowed in the table at `loc`, found by walking the schema."""
    here: Any = schema
    for key in loc:
        if _is_schema(here):
            fields = {field.alias or name: field for name, field in here.model_fields.items()}
            here = fields[str(key)].annotation if key in fields else None
        else:
            here = get_args(here)[-1] if get_args(here) else None
        if get_origin(here) in (Union, UnionType):
            here = next((arg for arg in get_args(here) if arg is not NoneType), None)
    if not _is_schema(here):
        return []
    return [field.alias or name for name, field in here.model_fields.items()]


def _is_schema(thing: Any) -> bool:
    return isinstance(thing, type) and hasattr(thing, "model_fields")


def toml_text(document: Mapping[str, Any]) -> str:
    """Tables as TOML text that reads back to the same values.

    Args:
        document: text, numbers, truth values, lists of these, tables, and lists of tables.

    Returns:
        The text.

    Raises:
        TypeError: for a value that TOML cannot hold.
    """
    lines: list[str] = []
    _write_table(document, (), lines)
    return "\n".join(lines).strip() + "\n"


def _write_table(table: Mapping[str, Any], path: tuple[str, ...], lines: list[str]) -> None:
    for key, value in table.items():
        if not _is_section(value, path):
            lines.append(f"{_key(key)} = {_scalar(value)}")
    for key, value in table.items():
        if not _is_section(value, path):
            continue
        here = (*path, key)
        name = ".".join(map(_key, here))
        for part in value if isinstance(value, list) else [value]:
            if isinstance(value, list):
                lines.extend(["", f"[[{name}]]"])
            elif not part or not all(_is_section(inner, here) for inner in part.values()):
                lines.extend(["", f"[{name}]"])
            _write_table(part, here, lines)


def _is_section(value: Any, path: tuple[str, ...]) -> bool:
    """Whether a value has a heading of its own: tables of tables, or tables at the top."""
    if isinstance(value, list):
        return bool(value) and all(isinstance(part, Mapping) for part in value)
    return isinstance(value, Mapping) and (
        not path or any(isinstance(part, Mapping) for part in value.values())
    )


def _key(key: str) -> str:
    return key if re.fullmatch(r"[A-Za-z0-9_-]+", key) else _scalar(key)


def _scalar(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return "nan" if math.isnan(value) else repr(value)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{_key(k)} = {_scalar(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_scalar, value)) + "]"
    raise TypeError(f"TOML cannot hold {type(value).__name__}")


def write_beside(path: Path, text: str) -> None:
    """Writes a file whole or not at all: beside its place first, then renamed.

    Args:
        path: the file; its folder is made where it is missing.
        text: its content, written in UTF-8.

    Raises:
        ValueError: where the folder cannot be made or written to.
    """
    beside = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        beside.write_text(text, encoding="utf-8")
        beside.replace(path)
    except OSError as error:
        reason = error.strerror or "an error of the system"
        mend = "name another folder, or free this one"
        raise fault(path, "", "a place to write to", f"'{reason}'", mend) from None
    finally:
        if beside.exists():  # something failed between writing and renaming
            beside.unlink()
