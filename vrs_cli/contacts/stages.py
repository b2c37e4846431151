"""Divide a stretch of time into stages in which no part changes its state, for the search for contacts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import pairwise, zip_longest
from typing import NamedTuple

from vrs_cli.kinematics.transform import Transform, compose
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import HAND, Event, Frames
from vrs_cli.world.course import WorldCourse

AT_ONCE = 1e-6  # [s] that fingers take at least
SAME = 1e-6  # [s] two times that differ by no more are one
SAME_PLACE = 1e-9  # [m] two places

Course = tuple[Timeline, WorldCourse | None]  # a timeline, and its parts; None where there are none


class HeldPart(NamedTuple):
    """The part in the hand, and T_flange_part."""

    name: str
    T: Transform


class Stage(NamedTuple):
    """A stretch from `begin` to `end` [s]: T_world_part of the parts that stand, and the part in the hand.

    `hand`: times [s], and how far the hand is open then. `changed`: parts that were taken, put down or brought at the
    beginning. `gripped`: parts that the hand may touch, because it is about to take them. `only`: the parts whose
    contacts are looked for (None: everything), with the hand if `hand_too`.
    """

    begin: float
    end: float
    frames: Frames
    standing: Mapping[str, Transform]
    held: HeldPart | None
    hand: tuple[Sequence[float], Sequence[float]]
    changed: frozenset[str] = frozenset()
    gripped: frozenset[str] = frozenset()
    only: frozenset[str] | None = None
    hand_too: bool = False


def stages(timeline: Timeline, course: WorldCourse | None, begin: float, end: float) -> Iterator[Stage]:
    """Yield the stages between two times [s]. `course`: of the parts, None if there are none."""
    moves = [] if course is None else course.moves(begin, end)
    cuts = sorted({begin, end, *(t for t, _ in moves if t < end), *_new_frames(timeline, begin, end)})
    held_at = [None if course is None else course.held_part(t) for t in cuts]
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


def changed_stages(before: Course, after: Course, since: float, shift: float) -> Iterator[Stage]:
    """Yield the stages from `since` [s] on in which parts or the hand differ from before an edit. The edit shifts the
    motions from then on by `shift` [s], and leaves their paths as they are. No stage is longer than a motion.
    """
    if _go_on_alike(before, after, since, shift):
        return
    timeline, course = after
    tail = range(timeline.index_at(since) + 1, len(timeline))
    begins = [timeline[i].start for i in tail if timeline[i].motion.number != timeline[i - 1].motion.number]
    for begin, end in pairwise([since, *begins, timeline.end]):
        for stage in stages(timeline, course, begin, end) if end > begin else ():
            found = list(stages(*before, stage.begin - shift, stage.end - shift))
            was = [one for one in found if one.end - one.begin > SAME] or found  # one of rounding is none
            parts = frozenset(name for one in was for name in _other_parts(one, stage))
            hand = any(
                not _same_rows(zip(*one.hand, strict=True), zip(*stage.hand, strict=True), shift=shift) for one in was
            )
            if parts or hand:
                yield stage._replace(only=parts, hand_too=hand)


def _go_on_alike(before: Course, after: Course, since: float, shift: float) -> bool:
    """Return whether hand and parts begin alike and change at the same times. Then everything goes on alike, because it
    follows from that and from the motions.
    """
    begun = since - shift
    first, other = (next(stages(*of, t, t + SAME)) for of, t in ((before, begun), (after, since)))
    hands = (zip(*_hand(of[0], t, of[0].last), strict=True) for of, t in ((before, begun), (after, since)))
    moves = ([] if of[1] is None else of[1].moves(t, of[0].last) for of, t in ((before, begun), (after, since)))
    return not _other_parts(first, other) and _same_rows(*hands, shift=shift) and _same_rows(*moves, shift=shift)


def _same_rows(rows: Iterable[tuple[float, object]], others: Iterable[tuple[float, object]], *, shift: float) -> bool:
    """Return whether rows are equal, with times that are `shift` later in the others [s]."""
    pairs = zip_longest(rows, others)
    return all(a and b and a[1] == b[1] and abs(b[0] - a[0] - shift) < 2.0 * SAME for a, b in pairs)


def _other_parts(one: Stage, other: Stage) -> set[str]:
    """Return the parts that stand or are held at different places in two stages, or that the hand may touch in only one
    of them.
    """
    found = set(one.gripped ^ other.gripped)
    if one.standing != other.standing:
        names = {*one.standing, *other.standing}
        found |= {name for name in names if not _same_place(one.standing.get(name), other.standing.get(name))}
    held = [{} if stage.held is None else {stage.held.name: stage.held.T} for stage in (one, other)]
    return found | {name for name in {*held[0], *held[1]} if not _same_place(held[0].get(name), held[1].get(name))}


def _same_place(T: Transform | None, U: Transform | None) -> bool:
    return T is not None and U is not None and all(abs(x - y) < SAME_PLACE for x, y in zip(T, U, strict=True))


def _taken_after(held_at: Sequence[str | None], graspable: str | None) -> list[str | None]:
    """Return the part that is taken next after each time; `graspable` after the last."""
    taken = [graspable]
    for held in reversed(held_at[1:]):
        taken.append(held or taken[-1])
    return taken[:0:-1]


def _new_frames(timeline: Timeline, begin: float, end: float) -> Iterator[float]:
    """Yield the times at which TOOL or BASE change between two times [s]."""
    index = timeline.index_at(begin)
    before = timeline[index].motion.frames
    while index + 1 < len(timeline) and (segment := timeline[index + 1]).start < end:
        index += 1
        if segment.motion.frames != before:
            before = segment.motion.frames
            yield segment.start


def _hand(timeline: Timeline, begin: float, end: float) -> tuple[list[float], list[float]]:
    """Return times, and how far the hand is open then. Between them it moves evenly. The first is not after `begin`."""
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
