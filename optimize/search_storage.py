"""Where trials are kept: whole batches at once, in optuna's own formats, each exactly once."""

from __future__ import annotations

import contextlib
import copy
import json
import os
import time
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

import optuna
import sqlalchemy as sql
from optuna.distributions import BaseDistribution, distribution_to_json
from optuna.storages import JournalStorage, RDBStorage
from optuna.storages._cached_storage import _CachedStorage
from optuna.storages._rdb import models
from optuna.storages.journal import JournalFileBackend, JournalFileSymlinkLock
from optuna.storages.journal._file import BaseJournalFileLock
from optuna.storages.journal._storage import JournalOperation
from optuna.study import Study, StudyDirection
from optuna.trial import FrozenTrial
from sqlalchemy import exc as faults

BATCH = "supple:batch:"
"""Begin of the study attribute that says which trials a batch is made of."""

TASK = "supple:task"
"""Study attribute that tells one search from another."""

WORKER = "supple:"
"""Begin of the name under which a journal's batches are written."""

TRIES = 20
"""How often tables are looked for that another process is making [-]."""

PATIENCE = 120.0
"""How long one process waits for another to write [s]."""


class Archive(Protocol):
    """Batches of finished trials, shared by whoever searches."""

    study: Study

    def batches(self) -> dict[int, list[FrozenTrial]]:
        """Every batch that is not told yet, by its number; their trials in the order drawn."""
        ...

    def append(self, number: int, trials: Sequence[FrozenTrial]) -> bool:
        """Write a batch, whole or not at all; False where another process has written it."""
        ...

    def close(self) -> None:
        """Let go of the storage."""
        ...


def open_archive(storage: str, study: str, directions: Sequence[str], task: str) -> Archive:
    """Open a storage and the search of that name in it, or begin one.

    Args:
        storage: ``sqlite:///FILE``, ``journal:FILE``, ``postgresql://...``, or any that optuna
            and SQLAlchemy know.
        study: name of the search.
        directions: ``minimize`` or ``maximize`` of each objective.
        task: what tells this search from others: a sum of all that it depends on.

    Returns:
        The archive.

    Raises:
        ValueError: for a storage that cannot be opened, a library that is missing, or another
            search of the same name.
    """
    try:
        if storage.startswith("journal:"):
            archive: Archive = _Journal(Path(storage.removeprefix("journal:")), study, directions)
        else:
            archive = _Database(storage, study, directions)
    except (ImportError, OSError, faults.SQLAlchemyError, optuna.exceptions.OptunaError) as error:
        told = f"{type(error).__name__}: {error} {error.__cause__ or ''}"
        missing = isinstance(error, ImportError) or "ModuleNotFound" in told
        mend = "write sqlite:///FILE, journal:FILE or postgresql://USER@HOST/DATABASE"
        if missing and storage.startswith("postgres"):
            mend = "install its driver: pip install 'supple[postgresql]'"
        reason = " ".join(told.split())[:200]
        raise ValueError(
            f"storage: expected one that can be opened, found '{storage}' ({reason}). Mend: {mend}."
        ) from None
    same = [one.name.lower() for one in archive.study.directions] == list(directions)
    is_new = TASK not in archive.study.user_attrs and not archive.study.get_trials(deepcopy=False)
    if is_new and same:
        archive.study.set_user_attr(TASK, task)
    if not same or archive.study.user_attrs.get(TASK) != task:
        archive.close()
        raise ValueError(
            f"storage: expected the search '{study}' to be this one, found another (other axes, "
            f"objectives, inputs, sampler, batch or seed) in '{storage}'. Mend: name another "
            "'study' or 'storage', or remove the old one."
        )
    return archive


def _study_of(storage: Any, name: str, directions: Sequence[str]) -> Study:
    wanted = [StudyDirection[one.upper()] for one in directions]
    with contextlib.suppress(optuna.exceptions.DuplicatedStudyError):
        storage.create_new_study(wanted, study_name=name)
    return optuna.load_study(study_name=name, storage=storage)


class _Database:
    """A database: the rows of a batch in one transaction."""

    def __init__(self, url: str, name: str, directions: Sequence[str]) -> None:
        options: dict[str, Any] = {}
        if url.startswith("sqlite"):
            options["connect_args"] = {"timeout": PATIENCE}
            file = sql.make_url(url).database
            if file:
                Path(file).parent.mkdir(parents=True, exist_ok=True)
        self._storage = _made(url, options)
        self.study = _study_of(_CachedStorage(self._storage), name, directions)
        self._id = self.study._study_id
        self._told: set[int] = set()
        self._json: dict[str, tuple[BaseDistribution, str]] = {}

    def batches(self) -> dict[int, list[FrozenTrial]]:
        """As of `Archive`."""
        table = models.StudySystemAttributeModel.__table__.c
        asked = sql.select(table.key, table.value_json).where(
            table.study_id == self._id, table.key.startswith(BATCH)
        )
        with self._storage.engine.connect() as connection:
            marks = {int(k.removeprefix(BATCH)): v for k, v in connection.execute(asked)}
        news = {number: json.loads(v) for number, v in marks.items() if number not in self._told}
        if not news:
            return {}
        self._told |= news.keys()
        trials = _copies(self.study)
        return {number: trials[first : first + n] for number, (first, n) in news.items()}

    def append(self, number: int, trials: Sequence[FrozenTrial]) -> bool:
        """As of `Archive`."""
        owner, study = models.TrialModel.__table__, models.StudyModel.__table__
        mark = models.StudySystemAttributeModel.__table__
        try:
            with self._storage.engine.begin() as connection:
                # first the study's row, then anything that refers to it: no two wait in a circle
                connection.execute(
                    sql.select(study.c.study_id)
                    .where(study.c.study_id == self._id)
                    .with_for_update()
                )
                row = {"study_id": self._id, "key": f"{BATCH}{number}", "value_json": "[]"}
                made = sql.insert(mark).returning(mark.c.study_system_attribute_id)
                place = connection.execute(made, row).scalar_one()
                counted = sql.select(sql.func.count()).where(owner.c.study_id == self._id)
                first = connection.execute(counted).scalar_one()
                self._write(connection, trials, first)
                connection.execute(
                    sql.update(mark)
                    .where(mark.c.study_system_attribute_id == place)
                    .values(value_json=json.dumps([first, len(trials)]))
                )
        except faults.IntegrityError:
            return False
        self._told.add(number)
        return True

    def close(self) -> None:
        """As of `Archive`."""
        self._storage.scoped_session.remove()
        self._storage.engine.dispose()

    def _write(self, connection: Any, trials: Sequence[FrozenTrial], first: int) -> None:
        owner = models.TrialModel.__table__
        rows = [
            {
                "study_id": self._id,
                "number": first + at,
                "state": one.state,
                "datetime_start": one.datetime_start,
                "datetime_complete": one.datetime_complete,
            }
            for at, one in enumerate(trials)
        ]
        asked = sql.insert(owner).returning(owner.c.trial_id, owner.c.number)
        ids = {number - first: at for at, number in connection.execute(asked, rows)}
        tables: list[tuple[Any, list[dict[str, Any]]]] = [
            (models.TrialParamModel, []),
            (models.TrialValueModel, []),
            (models.TrialUserAttributeModel, []),
            (models.TrialSystemAttributeModel, []),
        ]
        for at, one in enumerate(trials):
            for (_, kept), new in zip(tables, self._parts(one, ids[at]), strict=True):
                kept += new
        for model, kept in tables:
            if kept:
                connection.execute(sql.insert(model.__table__), kept)

    def _parts(self, trial: FrozenTrial, at: int) -> Iterator[list[dict[str, Any]]]:
        """Rows of a trial's parameters, values, and attributes of the user and of the system."""
        params = []
        for name, value in trial.params.items():
            inner, text = self._distribution(name, trial.distributions[name])
            value = inner.to_internal_repr(value)
            row = {"trial_id": at, "param_name": name, "param_value": value}
            params.append(row | {"distribution_json": text})
        yield params
        stored = models.TrialValueModel.value_to_stored_repr
        values = []
        for k, value in enumerate(trial.values or []):
            plain, kind = stored(value)
            values.append({"trial_id": at, "objective": k, "value": plain, "value_type": kind})
        yield values
        for told in (trial.user_attrs, trial.system_attrs):
            yield [
                {"trial_id": at, "key": key, "value_json": json.dumps(value)}
                for key, value in told.items()
            ]

    def _distribution(self, name: str, one: BaseDistribution) -> tuple[BaseDistribution, str]:
        if name not in self._json or self._json[name][0] != one:
            self._json[name] = (one, distribution_to_json(one))
        return self._json[name]


def _made(url: str, options: dict[str, Any]) -> RDBStorage:
    """A database with optuna's tables, whoever else is making them at the same time."""
    for _ in range(TRIES - 1):
        try:
            return RDBStorage(url, engine_kwargs=dict(options))
        except faults.DBAPIError as error:
            if "exist" not in str(error) and "UNIQUE" not in str(error):
                raise
            time.sleep(0.2)
    return RDBStorage(url, engine_kwargs=dict(options))


class _Lock(BaseJournalFileLock):
    """A lock that ends with the process that holds it, and that its holder may take again."""

    def __init__(self, path: Path) -> None:
        self._path, self._file, self._depth = path, None, 0
        self._other = None if _has_flock() else JournalFileSymlinkLock(str(path))

    def acquire(self) -> bool:
        """Wait until the lock is held."""
        self._depth += 1
        if self._depth == 1:
            if self._other is not None:
                return self._other.acquire()
            import fcntl

            self._file = self._path.open("ab")
            fcntl.flock(self._file, fcntl.LOCK_EX)
        return True

    def release(self) -> None:
        """Let it go, once for each time that it was taken."""
        self._depth -= 1
        if self._depth == 0:
            if self._other is not None:
                self._other.release()
            elif self._file is not None:
                self._file.close()


def _has_flock() -> bool:
    return os.name == "posix"


class _Journal:
    """A journal file: the lines of a batch in one piece, its mark last."""

    def __init__(self, path: Path, name: str, directions: Sequence[str]) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path, self._end = path, 0
        self._lock = _Lock(path.with_name(path.name + ".writing"))
        self._marks: dict[int, tuple[int, int]] = {}
        self._told: set[int] = set()
        self._trials, self._id = 0, -1
        path.touch()
        with self._held():
            self._follow()  # mends what a kill has left
            backend = JournalFileBackend(str(path), lock_obj=self._lock)
            self.study = _study_of(JournalStorage(backend), name, directions)
            self._id = self.study._study_id
            self._end, self._trials = 0, 0
            self._marks.clear()
            self._follow()

    @contextlib.contextmanager
    def _held(self) -> Iterator[None]:
        self._lock.acquire()
        try:
            yield
        finally:
            self._lock.release()

    def _follow(self) -> None:
        """Read on to the end; cut off what a writer that was killed has left unfinished."""
        with self._path.open("rb+") as file:
            file.seek(self._end)
            position, end, pending = self._end, self._end, 0
            for line in file:
                position += len(line)
                told = _log(line)
                if told is None:
                    break
                own = told.get("study_id") == self._id
                if told["op_code"] == JournalOperation.CREATE_TRIAL:
                    pending += own
                    if told["worker_id"].startswith(WORKER):
                        continue  # whole only with its mark
                elif told["op_code"] == JournalOperation.SET_STUDY_SYSTEM_ATTR and own:
                    self._mark(told["system_attr"])
                self._trials, pending, end = self._trials + pending, 0, position
            self._end = end
            if file.seek(0, os.SEEK_END) > end:
                file.truncate(end)

    def _mark(self, told: dict[str, Any]) -> None:
        for key, value in told.items():
            if key.startswith(BATCH):
                self._marks[int(key.removeprefix(BATCH))] = (value[0], value[1])

    def batches(self) -> dict[int, list[FrozenTrial]]:
        """As of `Archive`."""
        with self._held():
            self._follow()
            news = {n: place for n, place in self._marks.items() if n not in self._told}
            if not news:
                return {}
            self._told |= news.keys()
            trials = _copies(self.study)
        return {number: trials[first : first + n] for number, (first, n) in news.items()}

    def append(self, number: int, trials: Sequence[FrozenTrial]) -> bool:
        """As of `Archive`."""
        with self._held():
            self._follow()
            if number in self._marks:
                return False
            worker, first = f"{WORKER}{os.getpid()}", self._trials
            told = {"worker_id": worker, "study_id": self._id}
            logs = [told | self._created(one) for one in trials]
            mark = {f"{BATCH}{number}": [first, len(trials)]}
            logs.append(
                told | {"op_code": JournalOperation.SET_STUDY_SYSTEM_ATTR, "system_attr": mark}
            )
            text = "".join(json.dumps(one, separators=(",", ":")) + "\n" for one in logs)
            with self._path.open("ab") as file:
                file.write(text.encode())
                file.flush()
                os.fsync(file.fileno())
            self._end += len(text.encode())
            self._trials += len(trials)
            self._marks[number] = (first, len(trials))
            self._told.add(number)
        return True

    def close(self) -> None:
        """As of `Archive`; nothing is held between two batches."""

    def _created(self, trial: FrozenTrial) -> dict[str, Any]:
        """A trial as optuna's journal writes one that is finished from the start."""
        distributions = trial.distributions
        many = trial.values is not None and len(trial.values) > 1
        inner = {k: distributions[k].to_internal_repr(value) for k, value in trial.params.items()}
        return {
            "op_code": JournalOperation.CREATE_TRIAL,
            "state": trial.state,
            "value": None if many or not trial.values else trial.values[0],
            "values": trial.values if many else None,
            "datetime_start": _utc(trial.datetime_start),
            "datetime_complete": _utc(trial.datetime_complete),
            "distributions": {k: distribution_to_json(one) for k, one in distributions.items()},
            "params": inner,
            "user_attrs": trial.user_attrs,
            "system_attrs": trial.system_attrs,
            "intermediate_values": {},
        }


def _copies(study: Study) -> list[FrozenTrial]:
    """Trials that may be numbered anew without a change of those that the storage remembers."""
    return [copy.copy(trial) for trial in study.get_trials(deepcopy=False)]


def _utc(time: datetime | None) -> str | None:
    return None if time is None else time.astimezone(UTC).isoformat(timespec="microseconds")


def _log(line: bytes) -> dict[str, Any] | None:
    """A line of a journal; None where it is not whole."""
    try:
        return json.loads(line) if line.endswith(b"\n") else None
    except ValueError:
        return None
