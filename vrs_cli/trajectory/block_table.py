"""Blocks of the timeline's segments as arrays, to read many times at once.

A table is made when a block of a row is first read this way, and kept with the row. Rows are shared by all versions of
a timeline that have a part of them, so after an edit only what is new in it has to be made into a table.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

from vrs_cli.trajectory.row import CODES, Row
from vrs_cli.trajectory.segment import JointPath, Path, Phase, Segment
from vrs_cli.values.motion import Frames

if TYPE_CHECKING:
    from vrs_cli.kinematics.arrays import Flags, Floats, Rows


class BlockTable(NamedTuple):
    """m segments of n joints, those of a row from `first` on: `starts`, `finishes`, `durations`, `hand` (m,);
    `coefficients` (k, m, n) by ascending power.

    `straight` and `resting` (m,) say what each segment is; a straight one has coefficients of zero. `frame_number` (m,)
    counts into `frames`. Times are those that the segments were made with.
    """

    row: Row
    first: int
    starts: Floats
    finishes: Floats
    durations: Floats
    hand: Floats
    coefficients: Floats
    straight: Flags
    resting: Flags
    frames: tuple[Frames, ...]
    frame_number: Rows

    def segment(self, place: int) -> Segment:
        return self.row[self.first + place]

    @property
    def any_straight(self) -> bool:
        return bool(self.straight.any())

    def edges(self, part: slice) -> Floats:
        """When the segments of a part start and finish, (m, 2)."""
        import numpy as np

        return np.stack((self.starts[part], self.finishes[part]), axis=1)

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


def table_of(row: Row, first: int, last: int) -> BlockTable:
    """The table of the segments of a row from `first` to before `last`, or to its end."""
    import numpy as np

    last = min(last, len(row))
    starts, motions, paths = np.array(row.starts[first:last]), row.motions[first:last], row.paths[first:last]
    finishes = np.array(row.finishes[first:last])
    frames = tuple(dict.fromkeys(motion.frames for motion in motions))
    number = {frame: count for count, frame in enumerate(frames)}
    return BlockTable(
        row=row,
        first=first,
        starts=starts,
        finishes=finishes,
        durations=finishes - starts,
        hand=np.array([motion.hand for motion in motions]),
        coefficients=coefficients(paths),
        straight=np.array([not isinstance(path, JointPath) for path in paths]),
        resting=np.frombuffer(bytes(row.phases[first:last]), np.uint8) == CODES[Phase.REST],
        frames=frames,
        frame_number=np.array([number[motion.frames] for motion in motions]),
    )


def coefficients(paths: Sequence[Path]) -> Floats:
    """(k, m, n) by ascending power: the paths in joint space; zero for straight ones."""
    import numpy as np

    by_length: dict[int, tuple[list[int], list[bytes]]] = {}
    joints = 0
    for place, path in enumerate(paths):
        if isinstance(path, JointPath):
            length, doubles = path.doubles()
            places, rows = by_length.setdefault(length, ([], []))
            places.append(place)
            rows.append(doubles)
            joints = len(doubles) // (8 * length)
        else:
            joints = len(path.seeds[0])
    table = np.zeros((max(by_length, default=1), len(paths), joints))
    for length, (places, rows) in by_length.items():
        values = np.frombuffer(b"".join(rows)).reshape(len(places), joints, length)
        table[:length, places] = values.transpose(2, 0, 1)
    return table
