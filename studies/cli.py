"""The command line: one short function a command, each of which calls into the rooms."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, cast

import typer

from .terminal import (
    DONE,
    INPUT_AT_FAULT,
    Corner,
    HeldOut,
    Json,
    LimitsFile,
    OtherHardware,
    Out,
    Prices,
    Quiet,
    Records,
    RigFile,
    Seed,
    SensorFile,
    Sensors,
    Session,
    Told,
    app,
    command,
    finish,
    guard,
    study_app,
)


def _version(wanted: bool) -> None:
    if wanted:
        from .. import __version__

        typer.echo(__version__)
        raise typer.Exit


@app.callback(invoke_without_command=True)
def supple(
    context: typer.Context,
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    """Find, fit and optimize the compliance between a swing robot and its club."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


@command
def check(
    records: Records,
    rig: RigFile = None,
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Read, check and describe records; fit nothing."""
    from .check import check_records, show_check

    result = check_records(records, rig, seed)
    finish(Session(out, seed, as_json, quiet), result, "check.json", show_check)


@command
def convert(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A UFF58, TDMS, MAT, C3D or text file, or a sidecar."),
    ],
    sample_rate: Annotated[
        float | None,
        typer.Option("--sample-rate", metavar="HZ", help="Where the file does not tell."),
    ] = None,
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Turn a laboratory's own file into a table of text with its sidecar; rates in [Hz]."""
    from .convert import convert_file, show_convert

    result = convert_file(file, out, sample_rate, seed)
    finish(Session(out, seed, as_json, quiet), result, "convert.json", show_convert)


@command
def simulate(
    rig: Annotated[Path, typer.Option("--rig", metavar="RIG", help="The rig that moves.")],
    drive: Annotated[Path, typer.Option("--drive", metavar="DRIVE", help="What moves it.")],
    sensor: Sensors = None,
    sensors: SensorFile = None,
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Simulate one motion of a rig under a drive."""
    from .simulate import show_motion, simulate_rig

    result, trusted = simulate_rig(rig, drive, sensor or [], out, seed, sensors)
    finish(Session(None, seed, as_json, quiet), result, "motion.json", show_motion, trusted)


@command
def identify(
    records: Records,
    rig: RigFile = None,
    posterior: Annotated[
        bool, typer.Option("--posterior", help="Sample the constants' posterior too.")
    ] = False,
    steps: Annotated[
        int | None,
        typer.Option("--steps", min=200, help="The most steps that the posterior may take."),
    ] = None,
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Fit the rig's constants to records, with error bars; sampling takes up a killed run."""
    from .engine import progress_of
    from .identify import identify_records, show_fit

    session = Session(out, seed, as_json, quiet)
    result, trusted = identify_records(
        records, rig, out, seed, progress_of(session.talks), posterior, steps
    )
    finish(replace(session, out=None), result, "fit.json", show_fit, trusted)


@command
def diagnose(
    records: Records,
    rig: RigFile = None,
    held_out: HeldOut = None,
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find what the simulation gets wrong, why, and what mending it gains."""
    from .diagnosis import diagnose_records, show_diagnosis
    from .engine import progress_of

    session = Session(out, seed, as_json, quiet)
    result, trusted = diagnose_records(
        records, rig, held_out or [], out, seed, progress_of(session.talks)
    )
    finish(replace(session, out=None), result, "diagnosis.json", show_diagnosis, trusted)


@command
def experiment(
    diagnosis: Annotated[
        Path, typer.Argument(metavar="DIAGNOSIS", help="A diagnosis.json; its records still lie.")
    ],
    most: Annotated[
        float, typer.Option("--most", metavar="FACTOR", help="What amplitudes the rig may bear.")
    ] = 2.0,
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Say which test to make next to tell the causes that are left apart; factor in [-]."""
    from .engine import progress_of
    from .experiment import propose_experiment, show_experiment

    session = Session(out, seed, as_json, quiet)
    result = propose_experiment(diagnosis, most, seed, progress_of(session.talks))
    finish(session, result, "experiment.json", show_experiment)


@command
def coupon(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE...", help="Runs of a testing machine, or their sidecars."),
    ],
    sizes: Annotated[
        Path | None,
        typer.Option("--sizes", metavar="SIZES", help="Sizes of sample and sleeve, a TOML file."),
    ] = None,
    frequency: Annotated[
        float, typer.Option("--frequency", metavar="HZ", help="What the sleeve is made for.")
    ] = 4.0,
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Turn a material test of silicone into a sleeve for a frequency [Hz]."""
    from .coupon import coupon_files, show_coupon

    result, trusted = coupon_files(files, sizes, frequency, seed)
    finish(Session(out, seed, as_json, quiet), result, "sleeve.json", show_coupon, trusted)


@command
def sweep(
    spec: Annotated[Path, typer.Argument(metavar="SPEC", help="What to sweep, a TOML file.")],
    cluster: Annotated[
        str | None,
        typer.Option("--cluster", metavar="ADDRESS", help="A scheduler of dask, whose workers do."),
    ] = None,
    posterior: Annotated[
        Path | None,
        typer.Option(
            "--posterior", metavar="FILE", help="Spread the optima over what is not known."
        ),
    ] = None,
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Simulate and score every design of a grid; take up a run that was killed."""
    from .engine import progress_of
    from .sweep import show_map, sweep_spec

    session = Session(out, seed, as_json, quiet)
    progress = progress_of(session.talks)
    result, trusted = sweep_spec(
        spec, out, seed, lambda done, tiles: progress(f"tile {done} of {tiles}"), cluster, posterior
    )
    progress("")
    finish(replace(session, out=None), result, "map.json", show_map, trusted)


@command
def search(
    spec: Annotated[Path, typer.Argument(metavar="SPEC", help="What to search, a TOML file.")],
    storage: Annotated[
        str | None,
        typer.Option("--storage", metavar="URL", help="Where trials are kept, not as in SPEC."),
    ] = None,
    trials: Annotated[
        int | None, typer.Option("--trials", min=1, help="How many designs, not as in SPEC.")
    ] = None,
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Search for the best designs; go on where an earlier run stopped."""
    from .engine import progress_of
    from .search import search_spec, show_search

    session = Session(out, seed, as_json, quiet)
    progress = progress_of(session.talks)
    result, trusted = search_spec(
        spec, out, seed, storage, trials, lambda done, of: progress(f"design {done} of {of}")
    )
    progress("")
    finish(replace(session, out=None), result, "search.json", show_search, trusted)


@command
def clubhead(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE...", help="Sidecars of swings of markers, or their tables."),
    ],
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Turn markers on a club into its angles, path, speed and point of impact."""
    from .clubhead import clubhead_files, show_clubhead

    result, trusted = clubhead_files(files, out, seed)
    finish(Session(out, seed, as_json, quiet), result, "clubhead.json", show_clubhead, trusted)


@command
def profile(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="Markers of a golfer: a sidecar, CSV or C3D file."),
    ],
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Turn a golfer's markers into a profile that the robot can play."""
    from .profile import profile_file, show_profile

    result, trusted = profile_file(file, out, seed)
    finish(Session(out, seed, as_json, quiet), result, "profile.json", show_profile, trusted)


@command
def swing(
    task: Annotated[Path, typer.Argument(metavar="TASK", help="What to swing, a TOML file.")],
    prices: Prices = False,
    hardware: OtherHardware = False,
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find the smoothest quiet swing that is at the ball with pose and speed."""
    from .engine import progress_of
    from .swing import show_swing, swing_task

    session = Session(out, seed, as_json, quiet)
    progress = progress_of(session.talks)
    result, trusted = swing_task(task, out, seed, progress, prices, hardware)
    progress("")
    finish(replace(session, out=None), result, "swing.json", show_swing, trusted)


@command
def lag(
    wanted: Annotated[
        Path, typer.Argument(metavar="WANTED", help="The profile.pod that the robot should follow.")
    ],
    feedback: Annotated[
        Path, typer.Argument(metavar="FEEDBACK", help="What its axes did: a table, or a record.")
    ],
    told: Told = None,
    limits: LimitsFile = None,
    corner: Corner = None,
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Take a robot's own lag out of a swing, by its feedback: what to play next; corner in [Hz]."""
    from .lag import lag_files, show_lag

    result, trusted = lag_files(wanted, feedback, told, limits, corner, out, seed)
    finish(Session(None, seed, as_json, quiet), result, "lag.json", show_lag, trusted)


@study_app.callback(invoke_without_command=True)
def study(context: typer.Context) -> None:
    """List and run studies: one question, one answer each."""
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


@study_app.command("list")
@guard
def study_list(as_json: Json = False, quiet: Quiet = False) -> None:
    """Name every study, with its question."""
    from .study import show_studies, studies

    listed = [{"name": name, "question": one.question} for name, one in studies().items()]
    finish(Session(None, 0, as_json, quiet), {"studies": listed}, "studies.json", show_studies)


@study_app.command("run")
@guard
def study_run(
    name: Annotated[str, typer.Argument(metavar="NAME", help="See `supple study list`.")],
    data: Annotated[
        Path | None, typer.Option("--data", metavar="DIR", help="Folder of measured records.")
    ] = None,
    cases: Annotated[
        int | None, typer.Option("--cases", min=1, help="How many cases a study draws.")
    ] = None,
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run one study."""
    from .engine import progress_of
    from .study import Call, study_named

    session, chosen = Session(out, seed, as_json, quiet), study_named(name)
    result = chosen.run(Call(out, data, seed, progress_of(session.talks), cases))
    finish(replace(session, out=None), result, f"{name}.json", chosen.show)


@command
def demo(
    out: Out = None,
    seed: Seed = 0,
    as_json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Do the main job on bundled records; without --out, write to demo-report."""
    from .demo import FOLDER, diagnose_demo
    from .diagnosis import show_diagnosis
    from .engine import progress_of

    session = Session(out or FOLDER, seed, as_json, quiet)
    result, trusted = diagnose_demo(session.out, seed, progress_of(session.talks))
    finish(replace(session, out=None), result, "diagnosis.json", show_diagnosis, trusted)


# The family of "no such option" and "missing argument", whose own name typer keeps to itself.
_USAGE: type[Exception] = cast("type[Exception]", typer.BadParameter.__mro__[2])


def _text(error: Exception) -> str:
    """The words of a usage error, which names the option or argument in question."""
    words: Callable[[], str] = getattr(error, "format_message", lambda: str(error))
    return words()


def main(arguments: Sequence[str] | None = None) -> int:
    """Runs the command line.

    Args:
        arguments: what follows the program's name; the process's own where None.

    Returns:
        The exit code: 0 done, 2 the input is at fault, 3 not to be trusted. A defect of ours is
        raised, and ends the process with 1 and a trace.
    """
    from .engine import start_engine

    start_engine()  # jax looks at its environment once, when it is imported: hence here
    try:
        code = app(
            None if arguments is None else list(arguments),
            prog_name="supple",
            standalone_mode=False,
        )
    except _USAGE as error:
        text = " ".join(_text(error).split()).rstrip(".")
        typer.echo(f"supple: {text}. Mend: see `supple --help`.", err=True)
        return INPUT_AT_FAULT
    return code if isinstance(code, int) else DONE


if __name__ == "__main__":
    sys.exit(main())
