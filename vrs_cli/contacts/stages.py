"""Stretches of time in which no part changes its state, as a search for contacts goes through them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from vrs_cli.kinematics.transform import Transform, compose
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.events import HAND
from vrs_cli.values.motion import Frames
from vrs_cli.world.course import WorldCourse

SLOWEST_HAND = 60.0  # [s] that fingers take at most (PARAMETER HAND.TIME)
AT_ONCE = 1e-6  # [s] that fingers take at least


class HeldPart(NamedTuple):
    """The part in the hand, and T_flange_part."""

    name: str
    T: Transform


class Stage(NamedTuple):
    """From `begin` to `end` [s]: T_world_part of the parts that stand, and the one in the hand.

    `hand`: times [s], and how far the hand is open then. `changed`: parts that were taken, put down or brought when
    the stage begins. `gripped`: parts that the hand may touch, because it is about to take them.
    """

    begin: float
    end: float
    frames: Frames
    standing: Mapping[str, Transform]
    held: HeldPart | None
    hand: tuple[Sequence[float], Sequence[float]]
    changed: frozenset[str] = frozenset()
    gripped: frozenset[str] = frozenset()


def stages(timeline: Timeline, course: WorldCourse | None, begin: float, end: float) -> Iterator[Stage]:
    """Yield the stages between two times [s]. `course`: of the parts; None where there are none."""
    moves = [] if course is None else course.moves(begin, end)
    cuts = sorted({begin, end, *(t for t, _ in moves if t < end), *_new_frames(timeline, begin, end)})
    for since, until in pairwise(cuts):
        frames, hand = timeline.locate(since)[0].motion.frames, _hand(timeline, since, until)
        if course is None:
            yield Stage(since, until, frames, {}, None, hand)
            continue
        held, T_tool_part = course.held(since), course.T_tool_part(since)
        in_hand = HeldPart(held, compose(frames.tool, T_tool_part)) if held and T_tool_part is not None else None
        changed = frozenset(name for t, name in moves if t == since)
        taken = course.held(until) or (course.graspable(until) if until == end else None)
        gripped = frozenset([taken] if taken is not None and taken != held else [])
        yield Stage(since, until, frames, course.standing(since), in_hand, hand, changed, gripped)


def _new_frames(timeline: Timeline, begin: float, end: float) -> Iterator[float]:
    """Yield when TOOL or BASE become other ones between two times [s]."""
    index = timeline.index_at(begin)
    before = timeline[index].motion.frames
    while index + 1 < len(timeline) and (segment := timeline[index + 1]).start < end:
        index += 1
        if segment.motion.frames != before:
            before = segment.motion.frames
            yield segment.start


def _hand(timeline: Timeline, begin: float, end: float) -> tuple[list[float], list[float]]:
    """Return how far the hand is open at times between which it moves evenly; the first is not after `begin`."""
    events = [e for e in timeline.events_between(begin - SLOWEST_HAND, end) if e.channel == HAND and not e.observed]
    moving = [e for e in events if e.time + e.duration > begin]
    first = moving[0].time if moving else begin
    before = [e.value for e in events if e.time < first]
    times = [min(first, begin) - AT_ONCE]
    values = [before[-1] if before else timeline.value_at(HAND, times[0])]
    for event in moving:
        times += [
            max(event.time, times[-1] + AT_ONCE),
            max(event.time, times[-1] + AT_ONCE) + max(event.duration, AT_ONCE),
        ]
        values += [values[-1], event.value]
    return times, values
