"""Divide a time interval into stages in which no part changes its state, and bound how far bodies can move in a stage,
for the search for contacts. Each body has a ball around it (its bounding sphere). Between two samples, a point of the
body moves at most as far as the ball's centre plus the rotation angle times the ball's radius. The change of speed
between samples bounds how much faster the point can be in between. Two links approach each other by at most the sum of
the rotations of the joints between them, each times its lever (the greatest distance from the joint axis). The
accumulated bounds grow with time, so a binary search finds the earliest time at which a body may have moved by a given
distance. Steps of this length reach the first contact and never pass it (conservative advancement; Mirtich,
"Impulse-based dynamic simulation of rigid body systems", 1996)."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import pairwise, zip_longest
from math import ceil, hypot
from typing import NamedTuple

import numpy as np

from vrs_cli.contacts.physics import Ball, Bounds
from vrs_cli.engine.position import joints_over
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.model import RobotModel, link_pose
from vrs_cli.kinematics.transform import Transform, Vector, compose, length, position
from vrs_cli.trajectory.segment import Phase
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import HAND, Event, Frames
from vrs_cli.world.course import WorldCourse

AT_ONCE = 1e-6  # [s] assumed duration of the hand's motion if the hand opens or closes instantly
SAME = 1e-6  # [s] times that differ by less than this are equal
SAME_PLACE = 1e-9  # [m] two poses are equal if their elements differ by less than this

# a timeline, and the states of the parts in the cell over time (None if the cell has no parts)
Course = tuple[Timeline, WorldCourse | None]


class HeldPart(NamedTuple):
    """The name of the part in the hand, and its pose T_flange_part."""

    name: str
    T: Transform


class Stage(NamedTuple):
    """An interval from `begin` to `end` [s] in which no part changes its state. `standing`: T_world_part of the parts
    at rest; `held`: the part in the hand.

    `hand`: times [s], and the opening of the hand at these times (0 closed, 1 open). `changed`: parts that were taken,
    put down or fed at the start. `gripped`: parts whose contacts with the hand are ignored, because the hand takes them
    next. `only`: search only contacts of these parts, and of the hand if `hand_too`; None: search all contacts.
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
    """Yield the stages between two times [s]. `course`: the states of the parts over time; None without parts."""
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
        yield Stage(since, until, frames, course.parts_at_rest(since), in_hand, hand, changed, gripped)


def changed_stages(before: Course, after: Course, since: float, shift: float) -> Iterator[Stage]:
    """Yield the stages, from `since` [s] on, in which parts or the hand differ from their state before an edit. The
    edit shifts the later motions by `shift` [s] and leaves their paths unchanged. A stage never spans two motions."""
    if _same_states_later(before, after, since, shift):
        return
    timeline, course = after
    tail = range(timeline.index_at(since) + 1, len(timeline))
    begins = [timeline[i].start for i in tail if timeline[i].motion.number != timeline[i - 1].motion.number]
    for begin, end in pairwise([since, *begins, timeline.end]):
        for stage in stages(timeline, course, begin, end) if end > begin else ():
            found = list(stages(*before, stage.begin - shift, stage.end - shift))
            # drop stages that exist only by rounding
            was = [one for one in found if one.end - one.begin > SAME] or found
            parts = frozenset(name for one in was for name in _other_parts(one, stage))
            hand = any(
                not _same_rows(zip(*one.hand, strict=True), zip(*stage.hand, strict=True), shift=shift) for one in was
            )
            if parts or hand:
                yield stage._replace(only=parts, hand_too=hand)


def _same_states_later(before: Course, after: Course, since: float, shift: float) -> bool:
    """Return whether, before and after an edit, the hand and the parts have the same states at the start and change at
    the same times. Then all later states are equal too, because they follow from these changes and from the motions."""
    begun = since - shift
    first, other = (next(stages(*of, t, t + SAME)) for of, t in ((before, begun), (after, since)))
    hands = (zip(*_hand(of[0], t, of[0].last), strict=True) for of, t in ((before, begun), (after, since)))
    moves = ([] if of[1] is None else of[1].moves(t, of[0].last) for of, t in ((before, begun), (after, since)))
    return not _other_parts(first, other) and _same_rows(*hands, shift=shift) and _same_rows(*moves, shift=shift)


def _same_rows(rows: Iterable[tuple[float, object]], others: Iterable[tuple[float, object]], *, shift: float) -> bool:
    """Return whether two lists of rows (time [s], value) are equal, except that times in `others` are later by `shift`
    [s]."""
    return all(a and b and a[1] == b[1] and abs(b[0] - a[0] - shift) < 2.0 * SAME for a, b in zip_longest(rows, others))


def _other_parts(one: Stage, other: Stage) -> set[str]:
    """Return the parts whose poses, at rest or in the hand, differ between two stages, and the parts that the hand
    takes next in only one of them."""
    found = set(one.gripped ^ other.gripped)
    if one.standing != other.standing:
        found |= {
            name
            for name in {*one.standing, *other.standing}
            if not _same_place(one.standing.get(name), other.standing.get(name))
        }
    held = [{} if stage.held is None else {stage.held.name: stage.held.T} for stage in (one, other)]
    return found | {name for name in {*held[0], *held[1]} if not _same_place(held[0].get(name), held[1].get(name))}


def _same_place(T: Transform | None, U: Transform | None) -> bool:
    return T is not None and U is not None and all(abs(x - y) < SAME_PLACE for x, y in zip(T, U, strict=True))


def _taken_after(held_at: Sequence[str | None], graspable: str | None) -> list[str | None]:
    """Return, for each entry of `held_at` except the last, the next part that the hand holds after it. `graspable`: the
    part that it takes after the last entry."""
    taken = [graspable]
    for held in reversed(held_at[1:]):
        taken.append(held or taken[-1])
    return taken[:0:-1]


def _new_frames(timeline: Timeline, begin: float, end: float) -> Iterator[float]:
    """Yield the times between two times [s] at which TOOL or BASE changes."""
    index = timeline.index_at(begin)
    before = timeline[index].motion.frames
    while index + 1 < len(timeline) and (segment := timeline[index + 1]).start < end:
        index += 1
        if segment.motion.frames != before:
            before = segment.motion.frames
            yield segment.start


def _hand(timeline: Timeline, begin: float, end: float) -> tuple[list[float], list[float]]:
    """Return times [s], and the opening of the hand at these times (0 closed, 1 open). Between these times the hand
    opens or closes at constant speed. The first time is before `begin`."""
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
    """Yield the events of the hand up to time `end` [s], the latest event first."""
    index = timeline.events_by(end) if HAND in timeline.channels else 0
    while index:
        index -= 1
        event = timeline.event(index)
        if event.channel == HAND and not event.observed:
            yield event


STEP = 0.006  # [s] maximum time between two samples of a motion
LEAST_STEPS = 3  # minimum number of sample intervals in a segment
SAFE = 1.5  # safety factor: between samples the speed may change up to 1.5 times as much as the samples show


class LinkFrames(NamedTuple):
    """T_base_link of the base and the n links at N samples: rotations (n + 1, N, 3, 3), positions (n + 1, N, 3) [m]."""

    turns: Floats
    places: Floats


def frames_over(model: RobotModel, q: Floats) -> LinkFrames:
    """Return the frames of all links at N samples of the joints, q (N, n) [rad, m]."""
    n, count = model.joint_count, len(q)
    turns, places = np.empty((n + 1, count, 3, 3)), np.empty((n + 1, count, 3))
    base = np.array(model.base).reshape(3, 4)
    turns[0], places[0] = base[:, :3], base[:, 3]
    cosine, sine = np.cos(q.T)[:, :, None], np.sin(q.T)[:, :, None]
    turned = np.empty((count, 3, 3))  # frames of the previous link, rotated by the joint
    for i, link in enumerate(model.links, 1):
        step, before = np.array(link_pose(model, i, 0.0)).reshape(3, 4), turns[i - 1]
        if link.kind is JointKind.PRISMATIC:
            moved = (before.reshape(-1, 3) @ step).reshape(count, 3, 4)
            moved[:, :, 3] += before[:, :, 2] * q[:, i - 1, None]
        else:
            x, y, c, s = before[:, :, 0], before[:, :, 1], cosine[i - 1], sine[i - 1]
            turned[:, :, 0], turned[:, :, 1], turned[:, :, 2] = c * x + s * y, c * y - s * x, before[:, :, 2]
            # one product of a large matrix is faster than `count` small ones
            moved = (turned.reshape(-1, 3) @ step).reshape(count, 3, 4)
        turns[i], places[i] = moved[:, :, :3], moved[:, :, 3] + places[i - 1]
    return LinkFrames(turns, places)


def levers(model: RobotModel, body: Bounds, other: int) -> tuple[float, ...]:
    """Return the lever of each joint: for a revolute joint the maximum distance of the body's points from its axis [m],
    for a prismatic joint 1; 0 for joints that are not between the body's link and the link `other`."""
    (link, ball), steps = body, _steps(model)
    far, found = length(ball.centre) + ball.radius, [0.0] * model.joint_count
    for i in range(link, other, -1):
        x, y, z = steps[i - 1]
        if model.links[i - 1].kind is JointKind.PRISMATIC:
            found[i - 1] = 1.0
            far += hypot(x, y, z) + max(abs(model.lower[i - 1]), abs(model.upper[i - 1]))
        else:
            found[i - 1] = far + hypot(x, y)
            far += hypot(x, y, z)
    return tuple(found)


@lru_cache
def _steps(model: RobotModel) -> tuple[Vector, ...]:
    """Return, for each link, the position of its frame in the frame of the previous link, with the joint at 0."""
    return tuple(position(link_pose(model, i, 0.0)) for i in range(1, model.joint_count + 1))


class Sweep:
    """A time interval of a timeline, sampled at `times` [s]: joints `q` (N, n) [rad, m], and bounds on how far bodies
    move.

    A `way` is a row (N - 1,): the maximum distance that a body moves from each sample to the next [m].
    """

    def __init__(self, arm: RobotArm, timeline: Timeline, begin: float, end: float) -> None:
        self.arm, self.timeline = arm, timeline
        self.times = _samples(timeline, begin, end)
        at = np.array(self.times)
        self.q = joints_over(arm, timeline, at)
        self.frames = frames_over(arm.model, self.q)
        self._spans = np.diff(at)
        self._joint_ways = self._inflate(np.abs(self.q[1:] - self.q[:-1]).T)
        # twice the sine of half the rotation angle; `_inflate` enlarges it to a bound on the angle [rad]
        self._turned = np.sqrt(0.5 * np.square(np.diff(self.frames.turns, axis=1)).sum(axis=(2, 3)))

    def _inflate(self, ways: Floats) -> Floats:
        """Return the distances `ways` (k, N - 1), enlarged to allow for changes of speed between two samples."""
        if ways.shape[1] < 2:
            return ways
        change = np.abs(np.diff(ways / self._spans, axis=1))
        most = np.zeros_like(ways)
        most[:, :-1] = change
        np.maximum(most[:, 1:], change, out=most[:, 1:])
        most[ways == 0.0] = 0.0  # a body at rest needs no allowance
        return np.asarray(ways + 0.5 * SAFE * self._spans * most)

    def centres(self, link: int, ball: Ball) -> Floats:
        """Return the centre of a link's bounding sphere at each sample, in the robot's frame (N, 3) [m]."""
        return np.asarray(self.frames.turns[link] @ np.array(ball.centre) + self.frames.places[link])

    def ways(self, bodies: Sequence[Bounds]) -> Floats:
        """Return the maximum distances that k bodies move from each sample to the next, (k, N - 1) [m]."""
        return self.ways_of(bodies, np.array([self.centres(*one) for one in bodies]))

    def ways_of(self, bodies: Sequence[Bounds], centres: Floats) -> Floats:
        """Return the maximum distances that k bodies move from each sample to the next, (k, N - 1) [m]. `centres`: the
        centres of their bounding spheres (k, N, 3) [m]."""
        moved = np.diff(centres, axis=1)
        far = np.sqrt(np.einsum("kni,kni->kn", moved, moved))
        radii = np.array([one.ball.radius for one in bodies])
        return self._inflate(far + radii[:, None] * self._turned[[one.link for one in bodies]])

    def way_between(self, levers: Floats) -> Floats:
        """Return the maximum distance by which two bodies approach each other from each sample to the next [m].
        `levers`: the levers of the joints between them, a row (n,), or rows (k, n) for k pairs."""
        return np.asarray(levers @ self._joint_ways)

    def joints(self, t: float) -> Floats:
        """Return the joints at time t [s], interpolated linearly between two samples [rad, m]."""
        k = self.place(t)
        part = (t - self.times[k]) / (self.times[k + 1] - self.times[k])
        return np.asarray(self.q[k] + part * (self.q[k + 1] - self.q[k]))

    def reaches(self, sums: Sequence[float], t: float, way: float) -> float:
        """Return the earliest time at which a body may have moved by the distance `way` [m] since t, at most the end of
        the interval [s]. `sums`: the accumulated bounds on the body's motion, beginning with 0 [m]."""
        times, k = self.times, self.place(t)
        begun = sums[k] + (t - times[k]) / (times[k + 1] - times[k]) * (sums[k + 1] - sums[k])
        k = bisect_right(sums, begun + way, k) - 1
        if k + 1 >= len(times):
            return times[-1]
        return times[k] + (begun + way - sums[k]) / (sums[k + 1] - sums[k]) * (times[k + 1] - times[k])

    def place(self, t: float) -> int:
        """Return the index of the last sample at or before time t [s]; at most the index of the second last sample."""
        return min(bisect_right(self.times, t), len(self.times) - 1) - 1


def sums_of(way: Floats) -> list[float]:
    """Return the cumulative sums of a row of distances, beginning with 0."""
    return [0.0, *np.cumsum(way).tolist()]


def _samples(timeline: Timeline, begin: float, end: float) -> list[float]:
    """Return sample times from `begin` to `end` [s]: the ends of all segments, and times between them while the arm
    moves."""
    times, index = [begin], timeline.index_at(begin)
    while times[-1] < end:
        segment = timeline[index]
        index += 1
        until = min(segment.finish, end)
        if until > times[-1]:
            count = 1 if segment.phase is Phase.REST else max(ceil((until - times[-1]) / STEP), LEAST_STEPS)
            times += np.linspace(times[-1], until, count + 1)[1:].tolist()
        begins = timeline[index].start if index < len(timeline) else end
        if times[-1] < min(begins, end):  # the arm is at rest until the next segment
            times.append(min(begins, end))
    return times
