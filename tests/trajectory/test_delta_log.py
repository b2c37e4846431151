"""A log of deltas: columns of what is old, and the same deltas as from a list."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from vrs_cli.trajectory.delta_log import PART, DeltaLog
from vrs_cli.trajectory.segment import JointPath, Phase, Segment
from vrs_cli.trajectory.timeline import Cause, TimelineDelta
from vrs_cli.values.motion import Motion, MotionKind, Start

MOTIONS = [Motion(number, MotionKind.JOINT, Start.AFTER) for number in range(5)]


def delta(version: int) -> TimelineDelta:
    motion, t = MOTIONS[version % 5], float(version)
    segments = tuple(Segment(t, t + 1.0, JointPath(((t, 0.5),)), Phase.CRUISE, motion) for _ in range(version % 4))
    cause = [Cause.COMMAND, Cause.UNDO][version % 7 == 0]
    return TimelineDelta(
        version, cause, motion, t, t + 0.25, t, version + 1, version % 3, 0.5 * (version % 2), segments
    )


def steered(version: int) -> TimelineDelta:
    t = float(version)
    tick = Segment(t, t + 1.0, JointPath(((t, 0.5),)), Phase.BLEND, MOTIONS[1])
    return TimelineDelta(version, Cause.COMMAND, MOTIONS[1], t, t, t, version, 0, 0.0, (tick,))


@pytest.mark.parametrize("make", [delta, steered])
def test_reads_as_a_list(make: Callable[[int], TimelineDelta]) -> None:
    plain = [make(version) for version in range(5 * PART + 3)]
    log = DeltaLog(plain)
    assert len(log) == len(plain)
    assert repr(list(log)) == repr(plain)
    assert (log[0], log[-1], log[3]) == (plain[0], plain[-1], plain[3])
    assert log[PART - 2 : 2 * PART + 2] == plain[PART - 2 : 2 * PART + 2]
    assert all(a.motion is b.motion for a, b in zip(log, plain, strict=True))
    with pytest.raises(IndexError):
        log[len(plain)]


@pytest.mark.parametrize("count", [2, PART + 1, 3 * PART, 3 * PART + 1])
def test_the_last_two_may_be_replaced(count: int) -> None:
    log = DeltaLog(map(delta, range(count)))
    log[-2], log[-1] = steered(count - 2), steered(count - 1)
    assert list(log) == [*map(delta, range(count - 2)), steered(count - 2), steered(count - 1)]


def test_a_copy_goes_on_apart() -> None:
    count = 3 * PART + 5
    log = DeltaLog(map(delta, range(count)))
    copy = log.copy()
    copy.extend(map(delta, range(count, 6 * PART)))
    log.extend([steered(count)])
    assert list(copy) == [*map(delta, range(6 * PART))]
    assert list(log) == [*map(delta, range(count)), steered(count)]
