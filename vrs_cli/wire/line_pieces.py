"""Pieces of joints of straight lines, which are computed once for all who ask for them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from vrs_cli.engine.approximation import joint_pieces, known_tolerance
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform
from vrs_cli.trajectory.segment import CartesianPath, Path, Segment
from vrs_cli.wire.records import PieceRecord, Pieces, no_pieces

MAX_REMEMBERED = 4000  # segments: four long snapshots

Key = tuple[Path, float, Transform, float]


class LinePieces:
    """The pieces of the segments of one arm, remembered: the same ones come in deltas, snapshots and windows."""

    def __init__(self, arm: RobotArm) -> None:
        self._arm = arm
        self._remembered: dict[Key, tuple[PieceRecord, ...]] = {}

    def within(self, tolerance: float | None) -> Pieces:
        """Return a function from a segment to its pieces, which g leaves by no more than that [rad, m]; None: to no
        pieces. Raises IllegalValue.
        """
        return no_pieces if tolerance is None else partial(self._of, known_tolerance(tolerance))

    def count_late(self, segments: Sequence[Segment], tolerance: float, most: int) -> int:
        """Return how many of the last segments have together at most so many lines whose pieces are not remembered."""
        for count, segment in enumerate(reversed(segments)):
            most -= isinstance(segment.path, CartesianPath) and _key(segment, tolerance) not in self._remembered
            if most < 0:
                return max(count, 1)
        return len(segments)

    def _of(self, tolerance: float, segment: Segment) -> tuple[PieceRecord, ...]:
        if not isinstance(segment.path, CartesianPath):
            return ()
        key = _key(segment, tolerance)
        found = self._remembered.get(key)
        if found is None:
            found = tuple([PieceRecord(*piece) for piece in joint_pieces(self._arm, segment, tolerance)])
            self._remembered[key] = found
            if len(self._remembered) > MAX_REMEMBERED:
                del self._remembered[next(iter(self._remembered))]
        return found


def _key(segment: Segment, tolerance: float) -> Key:
    return segment.path, segment.duration, segment.motion.frames.tool, tolerance
