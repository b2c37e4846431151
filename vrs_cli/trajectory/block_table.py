"""Blocks of the timeline's segments as arrays, to read many times at once.

A table is made when a block of a row is first read this way, and kept with the row. Rows are shared by all versions of
a timeline that have a part of them, so after an edit only what is new in it has to be made into a table.
"""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

from vrs_cli.trajectory.motion import Frames
from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Flags, Floats, Rows


class BlockTable(NamedTuple):
    """m segments of n joints: `starts`, `durations`, `hand` (m,); `coefficients` (k, m, n) by ascending power.

    `straight` and `resting` (m,) say what each segment is; a straight one has coefficients of zero. `frame_number` (m,)
    counts into `frames`. Times are those that the segments were made with.
    """

    segments: list[Segment]
    starts: Floats
    durations: Floats
    hand: Floats
    coefficients: Floats
    straight: Flags
    resting: Flags
    frames: tuple[Frames, ...]
    frame_number: Rows

    @property
    def any_straight(self) -> bool:
        return bool(self.straight.any())

    def locate(self, times: Floats, offset: float, part: slice) -> tuple[Rows, Floats]:
        """The segment of a part in force at each time (N,), and how long it has been so [s], at most its duration; the
        segments are `offset` [s] later than they say.

        Where its start is taken from the time, as here, the result does not depend on what the offset is.
        """
        import numpy as np

        starts = self.starts[part] + offset  # exact: both are on the time grid
        places = starts.searchsorted(times, side="right") - 1
        np.maximum(places, 0, out=places)
        s = times - starts.take(places)
        places += part.start
        np.minimum(s, self.durations.take(places), out=s)
        return places, np.maximum(s, 0.0, out=s)

    def joints(self, places: Rows, s: Floats, out: Floats) -> None:
        """Joints (N, n), s seconds (N,) into the segments at `places` (N,), to `out`."""
        t = s[:, None]
        out[:] = self.coefficients[-1].take(places, axis=0)
        for power in self.coefficients[-2::-1]:  # Horner
            out *= t
            out += power.take(places, axis=0)

    def rates(self, places: Rows, s: Floats) -> tuple[Floats, Floats]:
        """Velocity and acceleration (N, n), s seconds (N,) into the segments at `places` (N,)."""
        import numpy as np

        t = s[:, None]
        qd = np.zeros((len(s), self.coefficients.shape[2]))
        qdd = np.zeros_like(qd)
        for power in range(len(self.coefficients) - 1, 0, -1):  # Horner, of both derivatives at once
            qdd *= t
            qdd += qd
            qd *= t
            qd += power * self.coefficients[power].take(places, axis=0)
        return qd, qdd


def table_of(segments: list[Segment]) -> BlockTable:
    """The table of segments that follow each other."""
    import numpy as np

    paths = [segment.path for segment in segments]
    frames = tuple(dict.fromkeys(segment.motion.frames for segment in segments))
    number = {frame: count for count, frame in enumerate(frames)}
    return BlockTable(
        segments=segments,
        starts=np.array([segment.start for segment in segments]),
        durations=np.array([segment.duration for segment in segments]),
        hand=np.array([segment.motion.hand for segment in segments]),
        coefficients=coefficients(paths),
        straight=np.array([not isinstance(path, JointPath) for path in paths]),
        resting=np.array([segment.phase is Phase.REST for segment in segments]),
        frames=frames,
        frame_number=np.array([number[segment.motion.frames] for segment in segments]),
    )


def coefficients(paths: list[Path]) -> Floats:
    """(k, m, n) by ascending power: the paths in joint space; zero for straight ones."""
    import numpy as np

    by_length: dict[int, list[int]] = {}
    joints = 0
    for place, path in enumerate(paths):
        if isinstance(path, JointPath):
            by_length.setdefault(len(path.coefficients[0]), []).append(place)
            joints = len(path.coefficients)
        else:
            joints = len(path.seeds[0])
    table = np.zeros((max(by_length, default=1), len(paths), joints))
    for length, places in by_length.items():
        rows = chain.from_iterable(path.coefficients for path in map(paths.__getitem__, places))  # type: ignore[union-attr]
        values = np.fromiter(chain.from_iterable(rows), float, len(places) * joints * length)
        table[:length, places] = values.reshape(len(places), joints, length).transpose(2, 0, 1)
    return table
