"""Stretches of time in which no part changes its state, as a search for contacts goes through them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import NamedTuple

from vrs_cli.kinematics.transform import Transform, compose
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.events import HAND, Event
from vrs_cli.values.motion import Frames
from vrs_cli.world.course import WorldCourse

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
    held_at = [None if course is None else course.held(t) for t in cuts]
    taken = _taken_after(held_at, None if course is None else course.graspable(end))
    for k, (since, until) in enumerate(pairwise(cuts)):
        frames, hand = timeline.locate(since)[0].motion.frames, _hand(timeline, since, until)
        if course is None:
            yield Stage(since, until, frames, {}, None, hand)
            continue
        held, T_tool_part = held_at[k], course.T_tool_part(since)
        in_hand = HeldPart(held, compose(frames.tool, T_tool_part)) if held and T_tool_part is not None else None
        changed = frozenset(name for t, name in moves if t == since)
        gripped = frozenset([name] if held is None and (name := taken[k]) is not None else [])
        yield Stage(since, until, frames, course.standing(since), in_hand, hand, changed, gripped)


def _taken_after(held_at: Sequence[str | None], graspable: str | None) -> list[str | None]:
    """Return the part that is taken next after each time: `graspable` after the last."""
    taken = [graspable]
    for held in reversed(held_at[1:]):
        taken.append(held or taken[-1])
    return taken[:0:-1]


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
    moving, before = list[Event](), None
    for event in _of_hand(timeline, end):
        before = event
        if event.time + event.duration <= begin:
            break
        moving.insert(0, event)
        before = None
    times = [min([begin, *(event.time for event in moving)]) - AT_ONCE]
    values = [0.0 if before is None else before.value]
    for event in moving:
        begun = max(event.time, times[-1] + AT_ONCE)
        times += [begun, begun + max(event.duration, AT_ONCE)]
        values += [values[-1], event.value]
    return times, values


def _of_hand(timeline: Timeline, end: float) -> Iterator[Event]:
    """Yield the events of the hand up to a time [s], the last one first."""
    index = timeline.events_by(end) if HAND in timeline.channels else 0
    while index:
        index -= 1
        event = timeline.event(index)
        if event.channel == HAND and not event.observed:
            yield event
