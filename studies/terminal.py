"""What all commands share: the options, the exit codes, and how a result leaves the house."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ParamSpec

import typer

DONE, DEFECT, INPUT_AT_FAULT, NOT_TRUSTED = 0, 1, 2, 3
"""Exit codes: done; a defect of ours; the input is at fault; computed, but not to be trusted."""

app = typer.Typer(
    name="supple",
    help="Find, fit and optimize the compliance between a swing robot and its club.",
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

Records = Annotated[
    list[Path], typer.Argument(metavar="RECORD...", help="Sidecars NAME.toml of measured records.")
]
RigFile = Annotated[
    Path | None, typer.Option("--rig", metavar="RIG", help="A rig that overrides the records'.")
]
Sensors = Annotated[
    list[str] | None,
    typer.Option(
        "--sensor",
        metavar="PLACE:QUANTITY:FRAME",
        help="A curve to write besides, named by NAME= before it; repeatable.",
    ),
]
SensorFile = Annotated[
    Path | None,
    typer.Option("--sensors", metavar="FILE", help="Sensors with what they misread, as TOML."),
]
HeldOut = Annotated[
    list[Path] | None,
    typer.Option("--held-out", metavar="RECORD", help="A record never to be fitted; repeatable."),
]
Told = Annotated[
    Path | None,
    typer.Option("--told", metavar="PROFILE", help="What it played, from the second round on."),
]
LimitsFile = Annotated[
    Path | None,
    typer.Option("--limits", metavar="FILE", help="A file with [limits], such as the task."),
]
Corner = Annotated[
    float | None,
    typer.Option("--corner", metavar="HZ", help="Up to where the lag is taken out; by default 25."),
]
Prices = Annotated[
    bool, typer.Option("--prices", help="Add what less vibration costs: 25 other swings.")
]
OtherHardware = Annotated[
    bool, typer.Option("--hardware", help="Add what another wrist or collet would change.")
]
Out = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder for the results; made if new.")
]
Seed = Annotated[int, typer.Option("--seed", help="Seed of everything that is drawn by chance.")]
Json = Annotated[bool, typer.Option("--json", help="Print the result as JSON and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Print nothing but errors.")]

_Arguments = ParamSpec("_Arguments")


@dataclass(frozen=True)
class Session:
    """What the options that all commands share say.

    Attributes:
        out: folder for the results; None where none is wanted.
        seed: seed of everything that is drawn by chance [-].
        json: whether the result goes to standard output as JSON, and nothing else.
        quiet: whether nothing but errors is printed.
    """

    out: Path | None
    seed: int
    json: bool
    quiet: bool

    @property
    def talks(self) -> bool:
        """Whether tables and sentences are printed."""
        return not (self.json or self.quiet)


study_app = typer.Typer()
app.add_typer(study_app, name="study")


def command(function: Callable[_Arguments, None]) -> Callable[_Arguments, None]:
    """Makes a function a command whose input errors end in one line and exit code 2.

    Args:
        function: reads its options, calls into the rooms, and ends with `finish`.

    Returns:
        The guarded function, registered under its name.
    """
    return app.command()(guard(function))


def guard(function: Callable[_Arguments, None]) -> Callable[_Arguments, None]:
    """A function whose ValueErrors end in one line on standard error and exit code 2."""

    @functools.wraps(function)
    def guarded(*args: _Arguments.args, **kwargs: _Arguments.kwargs) -> None:
        try:
            function(*args, **kwargs)
        except ValueError as error:
            typer.echo(" ".join(str(error).split()), err=True)
            raise typer.Exit(INPUT_AT_FAULT) from None

    return guarded


def finish(
    session: Session,
    result: Mapping[str, Any],
    file: str,
    show: Callable[[Mapping[str, Any]], None],
    trusted: bool = True,
) -> None:
    """Writes and prints a result, and ends the command with its exit code.

    Args:
        session: the common options.
        result: tables and numbers that JSON can hold.
        file: its name in the folder for results.
        show: prints it for a reader.
        trusted: whether it converged and can be told from the data; otherwise exit code 3.

    Raises:
        ValueError: where the folder cannot be written to.
        typer.Exit: with code 3 for a result that is not to be trusted.
    """
    text = json.dumps(result, indent=2, allow_nan=False, ensure_ascii=False)
    if session.out is not None:
        from ..model.door import write_beside

        write_beside(session.out / file, text + "\n")
    if session.json:
        typer.echo(text)
    elif session.talks:
        show(result)
    if not trusted:
        raise typer.Exit(NOT_TRUSTED)
