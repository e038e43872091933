"""Rigid poses of a club from its markers, frame by frame, with errors, and faults in words."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from .clubhead_rigid import pose_covariance, rigid_fit

FEWEST = 3
"""Markers that a pose takes [-]."""

REJECT = 30.0
"""A residual's square, in its variance, beyond which a marker is left out of a frame [-]."""

VOTE = 5.0
"""Two markers whose distance is off by so many standard deviations do not agree [-]."""

SLIDE = 3.0
"""A marker whose place is off by so many standard deviations of one sighting is told [-]."""

CERTAIN = 6.0
"""Standard errors by which that must be seen [-]."""

MOST_TRIPLES = 120
"""Triples of markers that are tried in a frame whose markers are at odds [-]."""

START_NOISE = 2e-4
"""Largest noise of one coordinate that is supposed before outliers are taken away [m]."""

LEAST_NOISE = 1e-9
"""Noise that is supposed at least, so that rounding is neither outlier nor certainty [m]."""

DRIFT = 2.0
"""Power of the misfit, in that of its changes from frame to frame, from which it drifts [-]."""


@dataclass(frozen=True, eq=False)
class Poses:
    """Where the club was in each frame.

    Attributes:
        rotation: from the cloud's axes to the room's, shape (n, 3, 3) [-]; nan where not found.
        position: of the cloud's origin, shape (n, 3) [m]; nan where not found.
        covariance: of position and of a small turn about the room's axes, with the origin that
            `position` means, shape (n, 6, 6) [m^2, m rad, rad^2].
        used: markers that the pose stands on, shape (n, m) [-].
        found: frames that have a pose, shape (n,) [-].
        noise: standard deviation of one coordinate of a marker [m].
        freedom: degrees of freedom behind `noise` [-].
        drifting: whether the misfit wanders, so that `noise` understates what is wrong.
        warnings: what is wrong with the markers, in sentences.
    """

    rotation: np.ndarray
    position: np.ndarray
    covariance: np.ndarray
    used: np.ndarray
    found: np.ndarray
    noise: float
    freedom: int
    drifting: bool
    warnings: tuple[str, ...]


def fit_poses(cloud: np.ndarray, seen: np.ndarray, names: tuple[str, ...] = ()) -> Poses:
    """Pose and error of every frame, without the markers that contradict the others.

    Noise is taken to be the same for all markers and directions, and is estimated from the misfit.

    Args:
        cloud: places of the markers on the club, shape (m, 3) [m].
        seen: their places in the room, shape (n, m, 3) [m]; nan where a marker was lost.
        names: of the markers, for the sentences; numbers from 1 where empty.

    Returns:
        The poses; frames with fewer than three markers, or markers that contradict each other,
        have none.
    """
    return _Fitting(cloud, seen, names or tuple(str(i + 1) for i in range(len(cloud)))).poses()


class _Fitting:
    """One swing while its poses are found."""

    def __init__(self, cloud: np.ndarray, seen: np.ndarray, names: tuple[str, ...]) -> None:
        self.cloud, self.seen, self.names = cloud, seen.copy(), names
        self.there: np.ndarray = np.asarray(np.isfinite(seen).all(axis=2))
        self.seen[~self.there] = 0.0
        self.used: np.ndarray = self.there.copy()
        self.repeated = np.zeros(len(seen), dtype=bool)
        self.words: list[str] = []
        self.noise = LEAST_NOISE

    def poses(self) -> Poses:
        self._repeats()
        self._fit_all()
        _, score = self._scores(slice(None))
        typical = np.sqrt(np.median(score[self.used]) / 2.37) if self.used.any() else 0.0
        self.noise = float(np.clip(typical, LEAST_NOISE, START_NOISE))
        self._reject()
        if self._exchange():
            self._reject()
        self._settle()
        self._leave_out_strays()
        self._estimate_noise()
        doubtful = self._doubtful()
        self._tell_rejected(doubtful)
        drifting = self._drifts()
        covariance, _ = pose_covariance(self.cloud, self.rotation, self.used)
        found = self._enough() & ~doubtful & np.isfinite(covariance[:, 0, 0])
        gone = ~found
        self.rotation[gone], self.position[gone], covariance[gone] = np.nan, np.nan, np.nan
        freedom = int(np.sum(3 * self.used[found].sum(axis=1) - 6))
        return Poses(
            self.rotation,
            self.position,
            covariance * self.noise**2,
            self.used & found[:, None],
            found,
            self.noise,
            freedom,
            drifting,
            tuple(self.words),
        )

    def _enough(self) -> np.ndarray:
        return self.used.sum(axis=1) >= FEWEST

    def _fit_all(self) -> None:
        self.rotation, self.position = rigid_fit(self.cloud, self.seen, self.used)

    def _refit(self, rows: np.ndarray) -> None:
        if len(rows):
            fitted = rigid_fit(self.cloud, self.seen[rows], self.used[rows])
            self.rotation[rows], self.position[rows] = fitted

    def _scores(self, rows: np.ndarray | slice) -> tuple[np.ndarray, np.ndarray]:
        """Length of each residual [m], and its square in its own variance for unit noise."""
        there = self.cloud @ np.swapaxes(self.rotation[rows], 1, 2) + self.position[rows][:, None]
        length = np.linalg.norm(self.seen[rows] - there, axis=2)
        _, leverage = pose_covariance(self.cloud, self.rotation[rows], self.used[rows])
        room = np.where(self.used[rows], 1 - leverage, 1 + leverage)
        return length, length**2 / np.maximum(room, 0.02)

    def _settle(self) -> None:
        """Rejects again where what was kept is noisier than what was supposed."""
        for _ in range(3):
            before = self.noise
            self._estimate_noise()
            if self.noise < 1.15 * before:
                return
            self._reject()

    def _estimate_noise(self) -> None:
        good = self.used.sum(axis=1) > FEWEST
        good = good if good.any() else self._enough()
        length, _ = self._scores(slice(None))
        free = np.sum(3 * self.used[good].sum(axis=1) - 6)
        total = np.sum(np.where(self.used[good], length[good] ** 2, 0.0))
        self.noise = max(float(np.sqrt(total / free)) if free else self.noise, LEAST_NOISE)

    def _local(self) -> np.ndarray:
        """Misfits in the cloud's axes, shape (n, m, 3) [m]."""
        away = self.seen - self.position[:, None]
        return np.einsum("nmi,nij->nmj", away, self.rotation, optimize=True) - self.cloud

    def _drifts(self) -> bool:
        """Whether misfits stay alike from frame to frame, as no noise does; tells it."""
        rest, both = self._local(), self.used[1:] & self.used[:-1]
        both &= (self._enough()[1:] & self._enough()[:-1])[:, None]
        if both.sum() < 30:
            return False
        power = np.sum(rest[1:] ** 2, axis=2)[both].mean()
        change = np.sum(np.diff(rest, axis=0) ** 2, axis=2)[both].mean() / 2
        if power < DRIFT * change or power < 9 * LEAST_NOISE**2:
            return False
        self.words.append(
            f"The markers miss the cloud by {1e3 * np.sqrt(power / 3):.2g} mm a coordinate, but "
            f"change by {1e3 * np.sqrt(change / 3):.2g} mm from frame to frame: a marker slides, "
            "or the cloud is not that of this club, and too few markers tell which."
        )
        return True

    def _doubtful(self) -> np.ndarray:
        """Frames whose markers contradict each other, and cannot be told apart."""
        from scipy.special import chdtri

        length, _ = self._scores(slice(None))
        total = np.sum(np.where(self.used, length**2, 0.0), axis=1)
        free = np.maximum(3 * self.used.sum(axis=1) - 6, 1)
        limit = chdtri(free, 1e-9) * max(self.noise, LEAST_NOISE) ** 2
        return self._enough() & (total > limit)

    def _repeats(self) -> None:
        """Frames that are copies of the one before them count for nothing."""
        both = self.there[1:] & self.there[:-1]
        same = np.all((self.seen[1:] == self.seen[:-1]) | ~both[..., None], axis=(1, 2))
        same &= np.all(self.there[1:] == self.there[:-1], axis=1) & both.any(axis=1)
        rows = np.flatnonzero(same) + 1
        self.repeated[rows] = True
        if len(rows):
            self.used[rows] = False
            self.there[rows] = False
            plural = "s repeat" if len(rows) > 1 else " repeats"
            self.words.append(
                f"Frame{plural} the one before, digit for digit, and "
                f"{'were' if len(rows) > 1 else 'was'} left out: {_runs(rows)}."
            )

    def _reject(self) -> None:
        """Takes contradicting markers out of each frame: by votes first, then the worst one."""
        self.used = self.there.copy()
        self._fit_all()
        limit = REJECT * max(self.noise, LEAST_NOISE) ** 2
        _, score = self._scores(slice(None))
        rows = np.flatnonzero(np.any(self.used & (score > limit), axis=1))
        for chunk in np.array_split(rows, max(1, len(rows) // 500)):
            if len(chunk):
                self.used[chunk] = self._votes(chunk)
        lost = rows[self.used[rows].sum(axis=1) < FEWEST]
        for row in lost[self.there[lost].sum(axis=1) > FEWEST]:
            self.used[row] = self._consensus(int(row), np.sqrt(limit))
        self._refit(rows)
        for _ in range(len(self.cloud) - FEWEST):
            _, score = self._scores(rows)
            score = np.where(self.used[rows], score, 0.0)
            worst = score.argmax(axis=1)
            bad = (score.max(axis=1) > limit) & (self.used[rows].sum(axis=1) > FEWEST)
            rows, worst = rows[bad], worst[bad]
            if not len(rows):
                break
            self.used[rows, worst] = False
            self._refit(rows)

    def _votes(self, rows: np.ndarray) -> np.ndarray:
        """Markers whose distances to at least half of the others are those of the cloud."""
        seen, there = self.seen[rows], self.there[rows]
        apart = np.linalg.norm(seen[:, :, None] - seen[:, None], axis=3)
        known = np.linalg.norm(self.cloud[:, None] - self.cloud[None], axis=2)
        both = there[:, :, None] & there[:, None]
        agree = (np.abs(apart - known) < VOTE * np.sqrt(2.0) * self.noise) & both
        votes = agree.sum(axis=2) - there
        return there & (2 * votes >= there.sum(axis=1, keepdims=True) - 1)

    def _consensus(self, row: int, limit: float) -> np.ndarray:
        """The most markers of a frame that lie where three of them say; none where too few do."""
        members = np.flatnonzero(self.there[row])
        triples = list(combinations(members.tolist(), FEWEST))
        chosen = triples[:: -(-len(triples) // MOST_TRIPLES)]
        used = np.zeros((len(chosen), len(self.cloud)), dtype=bool)
        used[np.arange(len(chosen))[:, None], np.array(chosen)] = True
        seen = np.broadcast_to(self.seen[row], (len(chosen), *self.cloud.shape))
        rotation, position = rigid_fit(self.cloud, seen, used)
        rest = seen - self.cloud @ np.swapaxes(rotation, 1, 2) - position[:, None]
        near = (np.linalg.norm(rest, axis=2) < limit) & self.there[row]
        best = near[near.sum(axis=1).argmax()]
        return best if best.sum() > FEWEST else np.zeros(len(best), dtype=bool)

    def _exchange(self) -> bool:
        """Finds swapped pairs, swaps them back, and tells them."""
        pairs: dict[tuple[int, int], list[int]] = {}
        out = self.there & ~self.used
        for row in np.flatnonzero(out.sum(axis=1) >= 2):
            found = self._swap_in(int(row), np.flatnonzero(out[row]))
            for pair in found:
                pairs.setdefault(pair, []).append(int(row))
        for (a, b), rows in pairs.items():
            self.seen[np.ix_(rows, [a, b])] = self.seen[np.ix_(rows, [b, a])]
            self.words.append(
                f"Markers {self.names[a]} and {self.names[b]} are swapped in "
                f"{_runs(np.array(rows))}; they were swapped back."
            )
        return bool(pairs)

    def _swap_in(self, row: int, out: np.ndarray) -> list[tuple[int, int]]:
        """Pairs that explain one frame's contradiction."""
        limit = np.sqrt(REJECT) * self.noise * 2
        if self.used[row].sum() >= FEWEST:
            place = self.cloud @ self.rotation[row].T + self.position[row]
            gap = np.linalg.norm(self.seen[row][:, None] - place[None], axis=2)
            near = (gap < limit) & (gap.T < limit)
            fits = [(int(a), int(b)) for a, b in combinations(out, 2) if near[a, b]]
            if fits:
                return fits
        members = np.flatnonzero(self.there[row])
        if not FEWEST < len(members) <= 5:
            return []
        trials = list(combinations(members.tolist(), 2))
        seen = np.repeat(self.seen[row][None], len(trials), axis=0)
        for k, (a, b) in enumerate(trials):
            seen[k, [a, b]] = seen[k, [b, a]]
        used = np.repeat(self.there[row][None], len(trials), axis=0)
        rotation, position = rigid_fit(self.cloud, seen, used)
        rest = seen - self.cloud @ np.swapaxes(rotation, 1, 2) - position[:, None]
        total = np.sqrt(np.sum(np.where(used[..., None], rest**2, 0.0), axis=(1, 2)))
        fits = np.flatnonzero(total < limit)
        return [trials[fits[0]]] if len(fits) == 1 else []

    def _leave_out_strays(self) -> None:
        """Markers that slide, or do not sit where the cloud has them, are left out for good."""
        for _ in range(max(0, (len(self.cloud) - FEWEST) // 2)):
            self._estimate_noise()
            found = self._worst_stray()
            if found is None:
                return
            marker, moved, start = found
            name = self.names[marker]
            if moved > start:
                # from the first third's middle to the last one's is two thirds of the way
                text = f"Marker {name} slides by some {1.5e3 * moved:.2g} mm over the swing"
            else:
                text = f"Marker {name} sits {1e3 * start:.2g} mm from its place in the cloud"
            self.words.append(f"{text}; it was left out.")
            self.there[:, marker] = False
            self._reject()

    def _worst_stray(self) -> tuple[int, float, float] | None:
        local = self._local()
        worst, chosen = SLIDE * max(self.noise, LEAST_NOISE), None
        good = self._enough()
        for marker in range(len(self.cloud)):
            rows = np.flatnonzero(self.there[:, marker] & good)
            if len(rows) < 9 or self.there[rows].sum(axis=1).max() <= FEWEST:
                continue
            third = len(rows) // 3
            ends = [local[part, marker] for part in (rows[:third], rows[-third:])]
            first, last = (np.median(part, axis=0) for part in ends)
            moved = float(np.linalg.norm(last - first))
            start = float(np.linalg.norm(np.median(local[rows, marker], axis=0)))
            floor = CERTAIN * self.noise * np.sqrt(3.0 / third)
            size = max(moved if moved > floor else 0.0, start if start > floor else 0.0)
            if size > worst:
                worst, chosen = size, (marker, moved if moved > floor else 0.0, start)
        return chosen

    def _tell_rejected(self, doubtful: np.ndarray) -> None:
        out = self.there & ~self.used
        for marker in np.flatnonzero(out.sum(axis=0)):
            rows = np.flatnonzero(out[:, marker])
            self.words.append(
                f"Marker {self.names[marker]} contradicts the others and was left out in "
                f"{_runs(rows)}."
            )
        if doubtful.any():
            self.words.append(
                f"The markers contradict each other, and none can be blamed, in "
                f"{_runs(np.flatnonzero(doubtful))}; there is no pose."
            )
        few = ~self._enough() & ~self.repeated
        if few.any():
            self.words.append(
                f"Fewer than {FEWEST} markers can be used in {_runs(np.flatnonzero(few))}; "
                "there is no pose."
            )


def _runs(rows: np.ndarray, most: int = 4) -> str:
    """Frames in words, counted from 0, with runs joined."""
    parts = np.split(rows, np.flatnonzero(np.diff(rows) != 1) + 1)
    texts = [f"{p[0]}" if len(p) == 1 else f"{p[0]} to {p[-1]}" for p in parts[:most]]
    rest = f" and {len(rows) - sum(map(len, parts[:most]))} more" if len(parts) > most else ""
    many = "frame " if len(rows) == 1 else "frames "
    return many + ", ".join(texts) + rest
