"""Find the first contact of an arm and its held part with each other and with the things around them. The search steps
through the motion. At each step it computes the distances of all nearby pairs of solids, and then goes to the earliest
time at which any pair, nearby or not, can touch (`Sweep`). So the steps are short where solids are near, and long
elsewhere. Only an overlap deeper than `DEEP` counts as a contact, because shapes are not known more exactly. Some pairs
are ignored: neighbouring links, links that touch at READY or at NEST, and the hand with the part that it holds. A pair
that already touches when the search begins, or when its part is taken, put down or fed, is checked only after it has
separated."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import lru_cache
from math import ceil, inf
from typing import NamedTuple

import numpy as np

from vrs_cli.contacts.physics import Ball, Bounds, Physics, Standing, around
from vrs_cli.contacts.solids import LinkSolids, solids_of_robot, solids_of_shape
from vrs_cli.contacts.sweep import Course, Stage, Sweep, changed_stages, levers, stages, sums_of
from vrs_cli.engine.position import finish_after, joints_at, start_before
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.model_data import NEEDED_POSES
from vrs_cli.kinematics.transform import Vector, compose, inverse, length, moved_point
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.scene import CellScene
from vrs_cli.values.world import Contact
from vrs_cli.world.course import WorldCourse
from vrs_cli.world.history import floor_height

DEEP = 5e-4  # [m] two solids are in contact if they overlap by more than this
APART = 5e-4  # [m] a pair has separated when its distance exceeds the contact distance (at least 0) by this much
MARGIN = 0.02  # [m] pairs that are at most this much farther apart than the contact distance are examined
NUDGE = 1e-4  # [m] minimum relative motion between two samples of a pair that touches from the start
SLIDE = 5e-3  # [m] maximum relative motion, between two samples, of a pair that touches and slides
EVEN = 1e-4  # [m] if a sliding pair's distance changes by at most this, the next samples are farther apart
BENT = 1e-4  # [m] maximum error of positions that are computed from linearly interpolated joints
CLOSE = 6e-4  # [m] a pair that is closer to contact than this is examined again, with the exact joints
TICK = 5e-4  # [s] minimum step of the search
LOOK = 5e-3  # [s] time between two samples while the deepest overlap is searched
MAX_LOOKS = 50  # maximum number of samples for the deepest overlap
SLOTS = 32  # minimum number of slots in the MuJoCo model for the solids of parts near the arm

Pair = tuple[int, int]  # the numbers of two owners of solids (links or objects), the smaller number first
STANDS = Bounds(0, Ball((0.0, 0.0, 0.0), 0.0))  # the bounds of a solid that does not move


class Checker:
    """A search for contacts of an arm in a scene. `clearance`: solids closer than this also count as touching [m].
    `allow`: pairs of names whose contacts are ignored; "hand" also names the last link.

    Each owner of solids (a link or an object) has a number, its index in `names`: first the base and the links, then
    the floor, the fixtures and the parts, which begin at `first_part`.
    """

    def __init__(
        self, arm: RobotArm, scene: CellScene, clearance: float = 0.0, allow: Iterable[tuple[str, str]] = ()
    ) -> None:
        self.arm, self.scene, self.clearance = arm, scene, clearance
        self.links = solids_of_robot(arm.model)
        self.floor = arm.model.joint_count + 1
        self.first_part = self.floor + 1 + len(scene.fixtures)
        fixtures, parts = ([one.name for one in things] for things in (scene.fixtures, scene.parts))
        self.names = (*link_names(arm.model, self.links), "floor", *fixtures, *parts)
        self.number = {one.name: self.first_part + k for k, one in enumerate(scene.parts)}
        self.solids = {one.name: solids_of_shape(one.shape) for one in scene.parts}
        numbers = {name: number for number, name in enumerate(self.names)}
        numbers |= dict.fromkeys(("hand", f"link {arm.model.joint_count}"), arm.model.joint_count)
        self.allowed = {(min(pair), max(pair)) for a, b in allow for pair in ((numbers[a], numbers[b]),)}
        self.limit = clearance if clearance > 0.0 else -DEEP  # [m] maximum distance of solids in contact
        self.margin = max(clearance, 0.0) + MARGIN
        self._slots = 0
        self._physics: Physics | None = None

    def physics(self, slots: int = 0) -> Physics:
        """Return the MuJoCo model of the scene, with slots for at least this number of solids of parts. Build it if
        there is none, or it has too few slots."""
        if self._physics is None or slots > self._slots:
            counts = [len(solids) for solids in self.solids.values()]
            self._slots = min(max(slots, 2 * self._slots, SLOTS), sum(counts))
            model = self.arm.model
            self._physics = Physics(
                model,
                self.links,
                fixed=[
                    (self.floor + 1 + k, solid._replace(pose=compose(one.T_world_fixture, solid.pose)))
                    for k, one in enumerate(self.scene.fixtures)
                    for solid in solids_of_shape(one.shape)
                ],
                floor=(self.floor, floor_height(self.scene, model)),
                kinds=[solid for solids in self.solids.values() for solid in solids],
                slots=self._slots,
                grips=max(counts, default=0),
                apart=touching_at_rest(model),
            )
            self._physics.margin(self.margin)
            self.bounds = {number: self._physics.bounds(number) for number in self._physics.arm_solids()}
            self.balls = ball_of_each(model, self.bounds.values())[1:]
            self.between = levers_of_each(model, self.balls)
            self.stroke = stroke(self.links)
            self.part_balls = {name: self._physics.ball_of(solids) for name, solids in self.solids.items()}
        return self._physics

    def first_contact(self, timeline: Timeline, begin: float, end: float, course: WorldCourse | None) -> Contact | None:
        """Return the first contact between two times [s], or None. `course`: the states of the parts over time (None:
        no parts)."""
        return self.first_in(timeline, stages(timeline, course, begin, end))

    def first_changed(self, before: Course, after: Course, since: float, shift: float) -> Contact | None:
        """Return the first contact, at or after `since` [s], of a part or a hand whose state an edit has changed.
        `before`, `after`: the timeline and the states of the parts, before and after the edit. The edit shifts later
        motions by `shift` [s]."""
        return self.first_in(after[0], changed_stages(before, after, since, shift))

    def first_in(self, timeline: Timeline, stages: Iterable[Stage]) -> Contact | None:
        """Return the first contact in a sequence of stages (intervals in which no part changes its state), or None."""
        before: _Search | None = None
        for stage in stages:
            follows = before is not None and before.stage.end == stage.begin
            search = _Search(self, timeline, stage, before.excused if before is not None and follows else None)
            if (contact := search.run()) is not None:
                return contact
            before = search
        return None

    def touches(self, timeline: Timeline, begin: float, end: float, course: WorldCourse | None) -> list[OwnersTouch]:
        """Return the touches between two times [s], sampled every `LOOK` seconds; include owners that touch from the
        start. Contacts between the hand and a part are ignored during a motion in which the hand holds or takes the
        part, or could take it at the start or end."""
        found: dict[Pair, list[OwnersTouch]] = {}
        while begin < end:
            since, finish = under_way(timeline, begin)
            until = min(finish, end)
            taken = frozenset[str]() if course is None else _held_parts(course, since, min(finish, timeline.last))
            for stage in stages(timeline, course, begin, until):
                search = _Search(self, timeline, stage._replace(gripped=taken), set())
                search.excused.clear()
                for one in search.touches():
                    before = found.setdefault(one.owners, [])
                    goes_on = before and before[-1].end == one.begin
                    before.append(one._replace(begin=before.pop().begin) if goes_on else one)
            begin = until
        return sorted(one for several in found.values() for one in several)


def _held_parts(course: WorldCourse, begin: float, end: float) -> frozenset[str]:
    """Return the parts that the hand holds between two times [s], or could take at one of these times."""
    held = {course.held_part(t) for t in (begin, end, *(t for t, _ in course.moves(begin, end)))}
    return frozenset(name for name in (*held, course.graspable(begin), course.graspable(end)) if name is not None)


def under_way(timeline: Timeline, t: float) -> tuple[float, float]:
    """Return the start and the end of the motion, or of the rest, at time t [s]. A rest without a later motion ends at
    infinity."""
    finish = finish_after(timeline, t)
    if t < finish:
        return start_before(timeline, t), finish
    after = timeline.index_at(t) + 1
    return finish, timeline[after].start if after < len(timeline) else inf


class OwnersTouch(NamedTuple):
    """A contact that lasts: two owners touch from `begin` to `end` [s]."""

    begin: float
    end: float
    owners: Pair


class _SolidPair(NamedTuple):
    """A pair of solids. `owners`: their owners; `sums`: for each sample, an upper bound on how far the solids have
    approached each other since the start [m]; `limit`, `apart`: the distances below which they touch, and above which
    they have separated [m]; `counts`: False if their contacts are ignored."""

    owners: Pair
    sums: list[float]
    limit: float
    apart: float
    counts: bool


class _Seen(NamedTuple):
    """A pair of solids at one pose of the arm. `distance`: between the solids [m]; `number`: the pair's index in the
    result of `Physics.near`."""

    distance: float
    number: int
    pair: _SolidPair


class _Search:
    """The search in one stage (an interval in which no part changes its state). `excused`: the pairs that touched from
    the start and have not separated yet, so their contacts are ignored; None in the first stage."""

    def __init__(self, checker: Checker, timeline: Timeline, stage: Stage, excused: set[Pair] | None) -> None:
        self.checker, self.stage, self.n = checker, stage, checker.arm.model.joint_count
        self.sweep = Sweep(checker.arm, timeline, stage.begin, stage.end)
        self.physics = checker.physics()
        self.held = None if stage.held is None else checker.number[stage.held.name]
        in_hand = frozenset[str]() if stage.held is None else {stage.held.name}
        self.ignored = {(self.n, checker.number[name]) for name in stage.gripped | in_hand} | checker.allowed
        self.only = None if stage.only is None else {checker.number[name] for name in stage.only}
        if self.only is not None and stage.hand_too:
            self.only.add(self.n)
        self.excused = set(excused or ())
        self.pairs: dict[int, _SolidPair] = {}  # pairs of solids by the key of `Physics.near`
        # bounds on a solid's approach to a link since the start [m]
        self.sums: dict[tuple[Bounds, int], list[float]] = {}
        self.held_bounds = STANDS
        self._place(self._room())
        changed = None if excused is None else {checker.number[name] for name in stage.changed}
        for distance, _, pair in self._look(self.stage.begin):
            if distance < pair.apart and (changed is None or changed.intersection(pair.owners)):
                self.excused.add(pair.owners)

    def _room(self) -> tuple[Floats, Floats]:
        """Compute the bounds on the arm's motion. Return two opposite corners of a box that contains the moving arm, in
        the robot's frame [m]."""
        checker, sweep, n, stage = self.checker, self.sweep, self.n, self.stage
        bodies, between = checker.balls, checker.between
        if stage.held is not None:
            ball = checker.part_balls[stage.held.name]
            self.held_bounds = Bounds(n, Ball(moved_point(stage.held.T, ball.centre), ball.radius))
            bodies = [*bodies, self.held_bounds]
            between = [*between, *levers_of_each(checker.arm.model, [self.held_bounds])]
        opening = np.interp(sweep.times, *stage.hand)
        self.opening = checker.stroke * np.abs(opening[1:] - opening[:-1])
        self.moving_hand = bool(self.opening.any())
        centres = np.array([sweep.centres(*one) for one in bodies])
        ways = sweep.ways_of(bodies, centres)
        if between:
            ways = np.concatenate([ways, sweep.way_between(np.array(between))])
        self.most = sums_of(ways.max(axis=0) + self.opening)
        radii = checker.margin + np.array([one.ball.radius for one in bodies])[:, None]
        return (centres.min(axis=1) - radii).min(axis=0), (centres.max(axis=1) + radii).max(axis=0)

    def _place(self, room: tuple[Floats, Floats]) -> None:
        """Set the poses of the arm, of the held part, and of the parts in the box `room` in the MuJoCo model."""
        checker, stage = self.checker, self.stage
        near, (low, high) = [], (corner.tolist() for corner in room)
        only = self.only
        wanted = None if only is None or self.n in only or self.held in only else only
        for name, T in stage.standing.items():
            if wanted is not None and checker.number[name] not in wanted:
                continue
            ball = checker.part_balls[name]
            x, y, z = moved_point(compose(stage.frames.base, T), ball.centre)
            r = ball.radius
            inside = low[0] < x + r and x - r < high[0] and low[1] < y + r and y - r < high[1]
            if inside and low[2] < z + r and z - r < high[2]:
                near.append(Standing(checker.number[name], checker.solids[name], T))
        self.nothing = wanted is not None and not near
        self.physics = checker.physics(sum(len(one.solids) for one in near))
        held = stage.held and Standing(checker.number[stage.held.name], checker.solids[stage.held.name], stage.held.T)
        self.physics.place_base(inverse(stage.frames.base))
        self.physics.fill(near, held)
        self.physics.open_hand(stage.hand[1][0])

    # --- samples ---

    def _look(self, t: float, *, exact: bool = True) -> list[_Seen]:
        """Return the nearby pairs of solids at time t [s], except pairs whose contacts are ignored. `exact`: use the
        exact joints, otherwise joints interpolated between samples."""
        if self.moving_hand:
            self.physics.open_hand(float(np.interp(t, *self.stage.hand)))
        sweep = self.sweep
        near = self.physics.near(joints_at(sweep.arm, sweep.timeline, t) if exact else sweep.joints(t))
        pairs = self.pairs
        return [
            _Seen(distance, number, pair)
            for number, (key, distance) in enumerate(near)
            if (pair := pairs.get(key) or self._pair(key)).counts
        ]

    def _pair(self, key: int) -> _SolidPair:
        """Compute and return the properties of a pair of solids, and keep them for later samples."""
        moving, other = sorted((self._bounds(number) for number in self.physics.pair(key)), key=lambda body: -body.link)
        owners, of = self.physics.owners_of(key), (moving, other.link)
        counts = owners not in self.ignored and (self.only is None or not self.only.isdisjoint(owners))
        if of not in self.sums:
            self.sums[of] = sums_of(self._approach_bounds(*of))
        # for a held part, and between the hand and a part, the clearance does not apply: the hand must approach parts
        handled = owners[1] >= self.checker.first_part and (owners[0] == self.n or self.held in owners)
        limit = -DEEP if handled else self.checker.limit
        found = self.pairs[key] = _SolidPair(owners, self.sums[of], limit, max(limit, 0.0) + APART, counts)
        return found

    def _approach_bounds(self, moving: Bounds, other: int) -> Floats:
        """Return bounds on how far a solid approaches the solids of the link `other` between successive samples [m]."""
        way = (
            self.sweep.way_between(np.array(levers(self.checker.arm.model, moving, other)))
            if other
            else self.sweep.ways([moving])[0]
        )
        return np.asarray(way + self.opening) if moving.link == self.n else way

    def _bounds(self, number: int) -> Bounds:
        """Return the ball around a solid of the arm or the held part; `STANDS` for a solid that does not move."""
        held = self.physics.owners[number] == self.held
        return self.checker.bounds.get(number, self.held_bounds if held else STANDS)

    # --- the search ---

    def run(self) -> Contact | None:
        """Return the first contact in the stage.

        A pair that touched from the start and slides is sampled at growing intervals. If its distance has changed after
        a long interval, it may have separated and touched again meanwhile, so the search returns to the previous
        sample.
        """
        if self.nothing:
            return None
        t, end = self.stage.begin, self.stage.end
        following, slide, before = t, NUDGE, dict[Pair, float]()
        while True:
            near, bent = self._look(t, exact=False), BENT
            if self._needs_exact_joints(near):
                near, bent = self._look(t), 0.0
            deepest = self._deepest(near)
            shallow = {owners: one.distance for owners, one in deepest.items() if one.pair.apart - one.distance < SLIDE}
            even = all(abs(distance - before.get(owners, distance)) <= EVEN for owners, distance in shallow.items())
            if not even and slide > NUDGE and t > following:
                slide, t = NUDGE, following
                continue
            slide = min(2.0 * slide, SLIDE) if even else NUDGE
            before = shallow
            if self.excused:
                self.excused = {owners for owners, one in deepest.items() if one.distance < one.pair.apart}
                near = [one for one in near if one.pair.owners not in self.excused]
            first = min(near, key=lambda one: one.distance - one.pair.limit, default=None)
            if first is not None and first.distance < first.pair.limit:
                return self._contact(t, first.pair, first.distance, self.physics.place(first.number))
            if t >= end:
                return None
            reached = self.sweep.reaches(self.most, t, self.checker.margin - self.checker.limit - bent)
            reached = self._next(t, [(pair.sums, distance - pair.limit - bent) for distance, _, pair in near], reached)
            following, t = (
                min(max(self._next(t, self._separations(deepest, bent, least), reached), t + TICK), end)
                for least in (NUDGE, slide)
            )

    def _needs_exact_joints(self, near: Iterable[_Seen]) -> bool:
        """Return whether exact (not interpolated) joints are needed to decide if a pair touches or has separated."""
        excused = self.excused
        return any(
            abs(distance - pair.apart) < BENT if pair.owners in excused else distance - pair.limit < CLOSE
            for distance, _, pair in near
        )

    def _deepest(self, near: Iterable[_Seen]) -> dict[Pair, _Seen]:
        """Return, for each excused pair of owners (touching since the start), the two solids with the deepest overlap.
        The owners cannot separate before these two solids separate."""
        found: dict[Pair, _Seen] = {}
        for one in near if self.excused else ():
            owners = one.pair.owners
            if owners in self.excused and (owners not in found or one.distance < found[owners].distance):
                found[owners] = one
        return found

    def _separations(self, deepest: Mapping[Pair, _Seen], bent: float, least: float) -> list[tuple[list[float], float]]:
        """For each excused pair (in contact since the start), return the accumulated bounds on its relative motion, and
        how far [m] it must move before it separates; this distance is never less than `least`."""
        return [
            (pair.sums, max(pair.apart - distance - bent, least))
            for owners, (distance, _, pair) in deepest.items()
            if owners in self.excused
        ]

    def _next(self, t: float, ways: Iterable[tuple[list[float], float]], earliest: float) -> float:
        """Return the first time after t at which one of several pairs may have moved by a given distance, at most
        `earliest` [s]. `ways`: for each pair, the accumulated bounds on its relative motion, and the given distance
        [m]."""
        sweep = self.sweep
        first, last = sweep.place(t), sweep.place(earliest) + 1
        for sums, way in ways:
            if sums[last] - sums[first] >= way:
                earliest = min(earliest, sweep.reaches(sums, t, way))
                last = sweep.place(earliest) + 1
        return earliest

    def touches(self) -> list[OwnersTouch]:
        """Return the touches in the stage. Samples are `LOOK` seconds apart, or farther if no touch can begin or end in
        between."""
        t, end = self.stage.begin, self.stage.end
        since, found = dict[Pair, float](), list[OwnersTouch]()
        while True:
            near = self._look(t, exact=False)
            touch = {one.pair.owners for one in near if one.distance < one.pair.limit}
            found += [OwnersTouch(since.pop(owners), t, owners) for owners in since.keys() - touch]
            since |= dict.fromkeys(touch - since.keys(), t)
            if t >= end:
                return found + [OwnersTouch(begin, end, owners) for owners, begin in since.items()]
            ways = [(pair.sums, abs(distance - pair.limit)) for distance, _, pair in near]
            reached = self.sweep.reaches(self.most, t, self.checker.margin - self.checker.limit)
            t = min(max(self._next(t, ways, reached), t + LOOK), end)

    def _contact(self, t: float, pair: _SolidPair, distance: float, place: Vector) -> Contact:
        """Return the contact that begins at time t [s]. To find its maximum depth, sample the motion until the pair has
        separated."""
        checker, end, least, (owners, limit) = self.checker, self.stage.end, distance, (pair.owners, pair.limit)
        step = max(LOOK, (end - t) / MAX_LOOKS)
        self.physics.margin(max(limit, 0.0))
        for k in range(1, min(ceil((end - t) / step), MAX_LOOKS) + 1):
            near = self._look(min(t + k * step, end), exact=False)
            distance = min((one.distance for one in near if one.pair.owners == owners), default=inf)
            if distance >= limit:
                break
            least = min(least, distance)
        self.physics.margin(checker.margin)
        moving, other = owners[::-1] if owners[1] == self.held else owners
        first, second = checker.names[moving], checker.names[other]
        return Contact(t, first, second, place, max(0.0 - least, 0.0), max(limit, 0.0) - least)


def levers_of_each(model: RobotModel, bodies: Iterable[Bounds]) -> list[tuple[float, ...]]:
    """Return the levers of each ball (`sweep.levers`), relative to each earlier link that is not a neighbour of the
    ball's own link."""
    return [levers(model, body, other) for body in bodies for other in range(1, body.link - 1)]


def ball_of_each(model: RobotModel, bounds: Iterable[Bounds]) -> list[Bounds]:
    """Return, for each link, a ball around the balls of all solids that move with the link."""
    balls: list[list[Ball]] = [[] for _ in range(model.joint_count + 1)]
    for link, ball in bounds:
        balls[link].append(ball)
    return [Bounds(link, around(found)) for link, found in enumerate(balls)]


def link_names(model: RobotModel, links: Iterable[LinkSolids]) -> tuple[str, ...]:
    """Return the names of the base and of the links. The last link is named "hand" if it has fingers."""
    n = model.joint_count
    return ("base", *(f"link {i}" for i in range(1, n)), "hand" if any(one.opens for one in links) else f"link {n}")


@lru_cache
def touching_at_rest(model: RobotModel) -> frozenset[Pair]:
    """Return the pairs of links that touch at READY or at NEST. Their contacts are ignored."""
    alone = Physics(model, solids_of_robot(model))
    alone.margin(0.0)
    near = (one for name in NEEDED_POSES for one in alone.near(model.poses[name]))
    return frozenset(alone.owners_of(key) for key, distance in near if distance < -DEEP)


def stroke(links: Iterable[LinkSolids]) -> float:
    """Return the maximum distance that a finger moves as the hand opens [m]."""
    return max((sum(length(one.slide) + 0.2 * length(one.turn) for one in group.opens) for group in links), default=0.0)
