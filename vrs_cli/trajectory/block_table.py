"""The segments of a block of the timeline as arrays, to read many times at once.

A table is made when a block is first read this way and kept with it. Blocks are shared by all versions of a timeline
that contain them, so after an edit only the one or two blocks that it touched are new.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from vrs_cli.trajectory.motion import Frames
from vrs_cli.trajectory.segment import JointPath, Phase, Segment

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from vrs_cli.trajectory.timeline import Block

    Floats = NDArray[np.float64]
    Flags = NDArray[np.bool_]
    Rows = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class BlockTable:
    """m segments of n joints: `starts`, `durations`, `hand` (m,); `coefficients` (k, m, n) by ascending power.

    `straight` and `resting` (m,) say what each segment is; a straight one has coefficients of zero. `frame_number` (m,)
    counts into `frames`. Times are the stored ones: those of the timeline less `offset`.
    """

    offset: float
    segments: tuple[Segment, ...]
    starts: Floats
    durations: Floats
    hand: Floats
    coefficients: Floats
    straight: Flags
    resting: Flags
    frames: tuple[Frames, ...]
    frame_number: Rows

    def rates(self, places: Rows, s: Floats) -> tuple[Floats, Floats, Floats]:
        """Joints (N, n) and their first two derivatives, s seconds (N,) into the segments at `places` (N,)."""
        a = [power[places] for power in self.coefficients]
        t = s[:, None]
        q, qd, qdd = a[-1], 0.0 * a[-1], 0.0 * a[-1]
        for coefficient in a[-2::-1]:  # Horner, for the derivatives too
            qdd = qdd * t + 2.0 * qd
            qd = qd * t + q
            q = q * t + coefficient
        return q, qd, qdd


def block_table(block: Block, begin: float) -> BlockTable:
    """The table of a block that begins at `begin` [s]; made once for all blocks that share its segments."""
    if not block.table:
        block.table.append(_tabulated(block.segments))
    made = block.table[0]
    return _moved(made, begin - block.starts[0])


def _moved(table: BlockTable, offset: float) -> BlockTable:
    from dataclasses import replace

    return table if table.offset == offset else replace(table, offset=offset)


def _tabulated(segments: tuple[Segment, ...]) -> BlockTable:
    import numpy as np

    paths = [segment.path for segment in segments]
    degree = max((len(path.coefficients[0]) for path in paths if isinstance(path, JointPath)), default=1)
    joints = next((len(path.coefficients) if isinstance(path, JointPath) else len(path.seeds[0]) for path in paths), 0)
    coefficients = np.zeros((degree, len(segments), joints))
    for place, path in enumerate(paths):
        if isinstance(path, JointPath):
            rows = np.array(path.coefficients).T
            coefficients[: len(rows), place] = rows
    frames = tuple(dict.fromkeys(segment.motion.frames for segment in segments))
    number = {frame: count for count, frame in enumerate(frames)}
    return BlockTable(
        offset=0.0,
        segments=segments,
        starts=np.array([segment.start for segment in segments]),
        durations=np.array([segment.duration for segment in segments]),
        hand=np.array([segment.motion.hand for segment in segments]),
        coefficients=coefficients,
        straight=np.array([not isinstance(path, JointPath) for path in paths]),
        resting=np.array([segment.phase is Phase.REST for segment in segments]),
        frames=frames,
        frame_number=np.array([number[segment.motion.frames] for segment in segments]),
    )
