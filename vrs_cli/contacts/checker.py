"""The first contact of an arm, and of what it holds, with itself and with what stands around it.

The search goes from pose to pose. At each it asks for the distances of all pairs that are near, and goes on to the time
at which the first of them can have touched, or one that is not near (`Sweep`). So it looks often where something is
near, and seldom elsewhere. A touch is deeper than `DEEP`, for a solid is known no better than that.

Some pairs do not count. Neighbours in the arm, and links that touch at READY or at NEST, where the arm may stand. The
hand and the part that it grips. A pair that touches when the search begins, or when its part is taken, put down or
comes into the scene, counts once it has come apart.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from math import ceil, inf

import numpy as np

from vrs_cli.contacts.physics import Ball, Bounds, Physics, Standing, around
from vrs_cli.contacts.solids import LinkSolids, solids_of_robot, solids_of_shape
from vrs_cli.contacts.stages import Course, Stage, changed_stages, stages
from vrs_cli.contacts.sweep import Sweep, levers, sums_of
from vrs_cli.engine.position import finish_after, start_before
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.arrays import Floats
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.model_data import NEEDED_POSES
from vrs_cli.kinematics.transform import Vector, compose, inverse, length, moved_point
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.contacts import Contact
from vrs_cli.values.scene import CellScene
from vrs_cli.world.course import WorldCourse
from vrs_cli.world.support import floor_height

DEEP = 5e-4  # [m] a touch is deeper
APART = 5e-4  # [m] two things that touched have come apart
MARGIN = 0.03  # [m] beyond the distance that counts: pairs that are nearer are compared
NUDGE = 1e-4  # [m] the shortest way after which a pair that touched is looked at again, to see it come apart
SLIDE = 5e-3  # [m] the longest such way: of a pair that slides
EVEN = 1e-4  # [m] a distance changes by no more from look to look where a pair slides
BENT = 1e-4  # [m] a body is no farther from where it is on a straight line between two samples
CLOSE = 6e-4  # [m] pairs so near to what counts are looked at with the exact joints
TICK = 5e-4  # [s] the shortest step
LOOK = 5e-3  # [s] between looks for the deepest touch
MOST_LOOKS = 100
SLOTS = 32  # for parts near the arm

Pair = tuple[int, int]  # two owners, the smaller one first
STANDS = Bounds(0, Ball((0.0, 0.0, 0.0), 0.0))


class Checker:
    """Finds contacts of an arm in a scene. `clearance` [m]: two things that come nearer than that count as well.
    `allow`: the names of pairs that do not count; the last link is also called hand.

    Owners are numbers with `names`: the links, the floor, the fixtures, then the parts, from `first_part` on.
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
        self.limit = clearance if clearance > 0.0 else -DEEP  # [m] a pair that is nearer counts
        self.margin = max(clearance, 0.0) + MARGIN
        self._slots = 0
        self._physics: Physics | None = None

    def physics(self, slots: int = 0) -> Physics:
        """Return the model, with at least so many slots for parts."""
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
        """Return the first contact between two times [s]; None where there is none. `course`: of the parts."""
        return self.first_in(timeline, stages(timeline, course, begin, end))

    def first_changed(self, before: Course, after: Course, since: float, shift: float) -> Contact | None:
        """Return the first contact from `since` [s] on of what is otherwise than before an edit, which shifts motions
        by `shift` [s].
        """
        return self.first_in(after[0], changed_stages(before, after, since, shift))

    def first_in(self, timeline: Timeline, stages: Iterable[Stage]) -> Contact | None:
        """Return the first contact in stages that come one after the other."""
        before: _Search | None = None
        for stage in stages:
            follows = before is not None and before.stage.end == stage.begin
            search = _Search(self, timeline, stage, before.excused if before is not None and follows else None)
            contact = search.run()
            if contact is not None:
                return contact
            before = search
        return None

    def touching(self, timeline: Timeline, begin: float, end: float, course: WorldCourse | None) -> set[int]:
        """Return the owners that touch at looks every `LOOK` seconds between two times [s], whatever they touched
        before. The hand may touch a part where it could take it when its motion begins or ends.
        """
        ends = start_before(timeline, begin), finish_after(timeline, begin)
        taken = frozenset(name for t in ends if course is not None and (name := course.graspable(t)) is not None)
        found = set[int]()
        for stage in stages(timeline, course, begin, end):
            search = _Search(self, timeline, stage._replace(gripped=stage.gripped | taken), set())
            found |= search.touching()
        return found


class _Search:
    """The search in one stage. `excused`: pairs that touched, until they have come apart; None at the first stage."""

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
        self.pairs: dict[int, tuple[Pair, list[float], float]] = {}
        self.held_bounds = STANDS
        self._place(self._room())
        changed = None if excused is None else {checker.number[name] for name in stage.changed}
        self._excuse(changed)

    def _room(self) -> tuple[Floats, Floats]:
        """Sum up how far anything comes at most. Return the corners of the box in which the arm moves, in the robot's
        frame [m].
        """
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
        ways = sweep.ways(bodies)
        if between:
            ways = np.concatenate([ways, sweep.way_between(np.array(between))])
        self.most = sums_of(ways.max(axis=0) + self.opening)
        low = np.min([sweep.centres(*one).min(axis=0) - one.ball.radius for one in bodies], axis=0)
        high = np.max([sweep.centres(*one).max(axis=0) + one.ball.radius for one in bodies], axis=0)
        return low - checker.margin, high + checker.margin

    def _place(self, room: tuple[Floats, Floats]) -> None:
        """Put the arm, the held part, and the parts that stand in a room of the robot into the model."""
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

    # --- looking ---

    def _look(self, t: float, *, exact: bool = True) -> list[tuple[int, float]]:
        """Return the keys of the pairs of solids that are near at t, and their distances [m]."""
        if self.moving_hand:
            self.physics.open_hand(float(np.interp(t, *self.stage.hand)))
        return self.physics.near(self.sweep.exact_joints(t) if exact else self.sweep.joints(t))

    def _known(self, key: int) -> tuple[Pair, list[float], float]:
        """Return the owners of a pair of solids, the sums of the way that they come towards each other, and how near
        they may come [m].
        """
        found = self.pairs.get(key)
        if found is None:
            bodies = sorted((self._bounds(number) for number in self.physics.pair(key)), key=lambda body: -body.link)
            owners = self.physics.owners_of(key)
            found = self.pairs[key] = owners, sums_of(self._way(*bodies)), self._limit(owners)
        return found

    def _limit(self, owners: Pair) -> float:
        """Return how near two owners may come [m]. No clearance is kept by a part that is held, nor by the hand from a
        part: they are there to be taken and put down.
        """
        handled = owners[1] >= self.checker.first_part and (owners[0] == self.n or self.held in owners)
        return -DEEP if handled else self.checker.limit

    def _apart(self, owners: Pair) -> float:
        """Return how far apart two owners are that have come apart [m]."""
        return max(self._limit(owners), 0.0) + APART

    def _way(self, moving: Bounds, other: Bounds) -> Floats:
        if other.link == 0:
            way = self.sweep.ways([moving])[0]
        else:
            way = self.sweep.way_between(np.array(levers(self.checker.arm.model, moving, other.link)))
        return np.asarray(way + self.opening) if moving.link == self.n else way

    def _bounds(self, number: int) -> Bounds:
        """Return the bounds of a solid: of one that stands, in the base."""
        known = self.checker.bounds.get(number)
        if known is None:
            known = self.held_bounds if self.physics.owners[number] == self.held else STANDS
        return known

    def _counts(self, key: int) -> bool:
        owners = self._known(key)[0]
        if self.only is not None and self.only.isdisjoint(owners):
            return False
        return owners not in self.excused and owners not in self.ignored

    def _beyond(self, key: int, distance: float) -> float:
        """Return how much farther apart a pair is than what counts [m]; infinite for one that does not count."""
        return distance - self._known(key)[2] if self._counts(key) else inf

    def _close(self, key: int, distance: float) -> bool:
        """Return whether the exact joints decide if a pair touches, or if it has come apart."""
        owners = self._known(key)[0]
        if owners in self.excused:
            return abs(distance - self._apart(owners)) < BENT
        return self._beyond(key, distance) < CLOSE

    def _deepest(self, near: Iterable[tuple[int, float]]) -> dict[Pair, tuple[float, int]]:
        """Return the distance [m] and the key of the two solids of each excused pair that overlap the most: the pair
        comes apart no sooner than they do.
        """
        found: dict[Pair, tuple[float, int]] = {}
        for key, distance in near if self.excused else ():
            owners = self._known(key)[0]
            if owners in self.excused and owners not in self.ignored:
                found[owners] = min(found.get(owners, (inf, 0)), (distance, key))
        return found

    def _excuse(self, changed: set[int] | None) -> None:
        """Excuse the pairs that touch at the beginning: all of them, or those of the owners that have `changed`."""
        for key, distance in self._look(self.stage.begin):
            owners = self.physics.owners_of(key)
            if distance < self._apart(owners) and (changed is None or changed.intersection(owners)):
                self.excused.add(owners)

    def _release(self, near: Iterable[tuple[int, float]]) -> None:
        """Excuse no longer what has come apart."""
        if self.excused:
            self.excused &= {owners for key, distance in near if distance < self._apart(owners := self._known(key)[0])}

    # --- the search ---

    def run(self) -> Contact | None:
        """Return the first contact of the stage.

        A pair that touched and slides is looked at ever more seldom. When its distance changes after a long way, it may
        have come apart and touched again between two looks: the search goes back to the first of them.
        """
        if self.nothing:
            return None
        t, end = self.stage.begin, self.stage.end
        following, slide, before = t, NUDGE, dict[Pair, float]()
        while True:
            near, bent = self._look(t, exact=False), BENT
            if any(self._close(*one) for one in near):
                near, bent = self._look(t), 0.0
            deepest = self._deepest(near)
            shallow = {owners: d for owners, (d, _) in deepest.items() if self._apart(owners) - d < SLIDE}
            even = all(abs(distance - before.get(owners, distance)) <= EVEN for owners, distance in shallow.items())
            if not even and slide > NUDGE and t > following:
                slide, t = NUDGE, following
                continue
            slide = min(2.0 * slide, SLIDE) if even else NUDGE
            before = shallow
            self._release(near)
            touching = [(beyond, k) for k, one in enumerate(near) if (beyond := self._beyond(*one)) < 0.0]
            if touching:
                key, distance = near[k := min(touching)[1]]
                return self._contact(t, self._known(key)[0], distance, self.physics.place(k))
            if t >= end:
                return None
            keys = {key for _, key in deepest.values()}
            near = [one for one in near if one[0] in keys or self._counts(one[0])]
            following = min(max(self._next(t, near, bent, NUDGE), t + TICK), end)
            t = min(max(self._next(t, near, bent, slide), t + TICK), end)

    def _next(self, t: float, near: Iterable[tuple[int, float]], bent: float, slide: float) -> float:
        """Return the earliest time at which one of these pairs, or one that is not near, can touch. `slide`: the
        shortest way of a pair that touched [m].
        """
        checker, sweep = self.checker, self.sweep
        earliest = sweep.reaches(self.most, t, checker.margin - checker.limit - bent)
        first, last = sweep.place(t), sweep.place(earliest) + 1
        for key, distance in near:
            owners, sums, limit = self._known(key)
            way = distance - limit - bent
            if owners in self.excused:  # it comes apart first, and then it can touch again
                way = max(self._apart(owners) - distance - bent, slide)
            if sums[last] - sums[first] >= way:
                earliest = min(earliest, sweep.reaches(sums, t, way))
                last = sweep.place(earliest) + 1
        return earliest

    def touching(self) -> set[int]:
        """Return the owners that touch at looks every `LOOK` seconds in the stage."""
        begin, end = self.stage.begin, self.stage.end
        times = np.linspace(begin, end, ceil((end - begin) / LOOK) + 1).tolist()
        near = (one for t in times for one in self._look(t, exact=False))
        return {owner for one in near if self._beyond(*one) < 0.0 for owner in self._known(one[0])[0]}

    def _contact(self, t: float, owners: Pair, distance: float, place: Vector) -> Contact:
        """Return the contact that begins at t. It is followed until its pair has come apart, to find how deep it is."""
        checker, end, least, limit = self.checker, self.stage.end, distance, self._limit(owners)
        step = max(LOOK, (end - t) / MOST_LOOKS)
        for k in range(1, min(ceil((end - t) / step), MOST_LOOKS) + 1):
            near = self._look(min(t + k * step, end), exact=False)
            distance = min((distance for key, distance in near if self._known(key)[0] == owners), default=inf)
            if distance >= limit:
                break
            least = min(least, distance)
        moving, other = owners[::-1] if owners[1] == self.held else owners
        first, second = checker.names[moving], checker.names[other]
        return Contact(t, first, second, place, max(0.0 - least, 0.0), max(limit, 0.0) - least)


def levers_of_each(model: RobotModel, bodies: Iterable[Bounds]) -> list[tuple[float, ...]]:
    """Return the levers of bodies, towards each link that is no neighbour."""
    return [levers(model, body, other) for body in bodies for other in range(1, body.link - 1)]


def ball_of_each(model: RobotModel, bounds: Iterable[Bounds]) -> list[Bounds]:
    """Return for each link the ball around all solids that move with it."""
    balls: list[list[Ball]] = [[] for _ in range(model.joint_count + 1)]
    for link, ball in bounds:
        balls[link].append(ball)
    return [Bounds(link, around(found)) for link, found in enumerate(balls)]


def link_names(model: RobotModel, links: Iterable[LinkSolids]) -> tuple[str, ...]:
    """Return the names of the base and of the links: the last is the hand, where it has fingers."""
    n = model.joint_count
    hand = any(one.opens for one in links)
    return ("base", *(f"link {i}" for i in range(1, n)), "hand" if hand else f"link {n}")


@lru_cache
def touching_at_rest(model: RobotModel) -> frozenset[Pair]:
    """Return the pairs of links that touch at READY or at NEST: they are not compared."""
    alone = Physics(model, solids_of_robot(model))
    alone.margin(0.0)
    poses = [model.poses[name] for name in NEEDED_POSES]
    near = (one for q in poses for one in alone.near(q))
    return frozenset(alone.owners_of(key) for key, distance in near if distance < -DEEP)


def stroke(links: Iterable[LinkSolids]) -> float:
    """Return how far a finger moves at most as the hand opens [m]."""
    return max((sum(length(one.slide) + 0.2 * length(one.turn) for one in group.opens) for group in links), default=0.0)
