"""The course of a world: where each part is at any time, and which signals sensors and rules give.

It follows from a timeline and a scene alone. It is simulated forward as far as somebody asks.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Hashable, Iterator, Mapping
from itertools import starmap
from math import inf, nextafter
from threading import Lock, RLock
from typing import Any

from msgspec import Struct

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.language.run.signals import Cell
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.world import CourseRows, HandGrip, PartSpan, SpanKind, StateChange, WorldNote, WorldState
from vrs_cli.world.history import CHANGES, GRIPS, MOVES, NOTES, SEES
from vrs_cli.world.sensing import GRAVITY
from vrs_cli.world.settings import WorldSettings, part_between, state_at
from vrs_cli.world.simulation import Simulation


class PartState(Struct, frozen=True):
    """A part at one time: T_world_part, whether the hand holds it, what it stands on, whether it is there at all."""

    pose: Transform
    held: bool
    on: str
    exists: bool


class WorldCourse:
    """The course of one timeline, from its start or, if it is the end of a longer one, from `begins` [s]. Any thread
    may ask.
    """

    def __init__(self, settings: WorldSettings, timeline: Timeline) -> None:
        self._settings, self.timeline, self._lock = settings, timeline, RLock()
        self._simulation = Simulation(settings, timeline, settings.at_start.copy())
        self._history = self._simulation.history
        self._standing: tuple[int, dict[str, Transform]] = (0, {})
        if timeline.world is not None and settings.fits(timeline.world):
            self._simulation.resume(timeline.world)
        else:
            self._simulation.begin()
        self.begins = self._history.now

    def edited(self, timeline: Timeline, since: float) -> WorldCourse:
        """The course of another timeline that is the same until `since` [s]."""
        made = WorldCourse.__new__(WorldCourse)
        made._settings, made.timeline, made._lock = self._settings, timeline, RLock()
        made._standing, made.begins = (0, {}), self.begins
        with self._lock:
            made._history = self._history.copy()
        made._history.back_to(since)
        made._simulation = Simulation(self._settings, timeline, made._history)
        made._simulation.follow_arm()
        return made

    # --- reading ---

    def parts(self) -> tuple[str, ...]:
        return tuple(self._settings.parts)

    def spans(self, name: str, until: float | None = None) -> tuple[PartSpan, ...]:
        """All that a part does, up to the end of the timeline or another time [s]. Raises KeyError."""
        self._advance(self.timeline.end if until is None else until)
        found = self._history.rows(("spans", name))
        if not found:
            raise KeyError(name)
        ends = [*(after.begin for after in found[1:]), inf]
        spans = zip(found, ends, strict=True)
        return tuple(PartSpan(one.begin, one.kind, one.T, end, one.on) for one, end in spans)

    def pose(self, name: str, t: float) -> Transform:
        """T_world_part at t [s]. Raises KeyError."""
        return self.state(name, t).pose

    def state(self, name: str, t: float) -> PartState:
        """A part at t [s]. Raises KeyError."""
        t = self._advance(t)
        span = self._simulation.span(name, t)
        kind, pose = span.kind, span.T
        if kind is SpanKind.HELD:
            pose = compose(self._simulation.flange(t), pose)
        elif kind is SpanKind.FALLS:
            seconds = t - span.begin
            pose = pose._replace(pz=pose.pz - 0.5 * GRAVITY * seconds * seconds)
        on = ""
        if kind is SpanKind.RESTS:
            on = span.on[0] if span.on else self._settings.stood_on(name)
        return PartState(pose, kind is SpanKind.HELD, on, kind is not SpanKind.ABSENT)

    def held(self, t: float) -> str | None:
        """The part in the hand at t [s]."""
        return self._grip(t)[0]

    def opening(self, t: float) -> float:
        """Return how far the fingers are open at t [s]: 1 open, 0 closed. They stop at the part that they take; until
        they arrive there, they count as where they were.
        """
        return self._grip(t)[1]

    def _grip(self, t: float) -> tuple[str | None, float]:
        """The part in the hand at t [s], and how far the fingers are open."""
        t = self._advance(t)
        grips = self._history.rows(GRIPS)
        place = bisect_right(grips, t, key=lambda grip: grip[0])
        return grips[place - 1][1:] if place else (None, 0.0)

    def T_tool_part(self, t: float) -> Transform | None:
        """The pose of the part in the hand, as the tool sees it; None where the hand holds none."""
        name = self.held(t)
        if name is None:
            return None
        tool = self.timeline.locate(t)[0].motion.frames.tool
        return compose(inverse(tool), self._simulation.span(name, t).T)

    def tool(self, t: float) -> Transform:
        """T_world_tool."""
        return self._simulation.tool(t)

    def graspable(self, t: float) -> str | None:
        """Return the part that the hand would take if it closed at t [s], as far open as it is."""
        widths = (self.opening(t) * self._settings.opening, 0.0)
        found = part_between(self._settings, self.standing(t).items(), self.tool(t), widths)
        return None if found is None else found[0]

    def standing(self, t: float) -> Mapping[str, Transform]:
        """The parts that stand at t [s], each with T_world_part."""
        t = self._advance(t)
        with self._lock:
            done, found = self._standing
            moves = self._history.rows(MOVES)
            count = bisect_right(moves, t, key=lambda move: move[0])
            if count < done:
                done, found = 0, {}
            changed = dict.fromkeys(name for _, name in moves[done:count]) if found else self.parts()
            if changed:
                found = dict(found)
            for name in changed:
                span = self._simulation.span(name, t)
                found.pop(name, None)
                if span.kind is SpanKind.RESTS:
                    found[name] = span.T
            self._standing = (count, found)
            return found

    def moves(self, begin: float, end: float) -> list[tuple[float, str]]:
        """Return when parts begin to do something else, after `begin` and up to `end` [s], and which."""
        self._advance(end)
        moves = self._history.rows(MOVES)
        first, last = (bisect_right(moves, t, key=lambda move: move[0]) for t in (begin, end))
        return list(moves[first:last])

    def last_move(self, until: float) -> float:
        """Return when a part began to do something else for the last time before `until` [s]."""
        moves = self._history.rows(MOVES)
        place = bisect_left(moves, until, key=lambda move: move[0])
        return float(moves[place - 1][0]) if place else self.begins

    def signal(self, number: int, t: float) -> bool | None:
        """An input at t [s], off before the course begins; None where nothing computes it."""
        if number not in self._settings.computed:
            return None
        self._advance(t)
        found = self._history.rows((CHANGES, number))
        place = bisect_right(found, t, key=lambda change: change[0])
        return bool(found[place - 1][1]) if place else False

    def next_change(self, after: float, until: float = inf) -> tuple[float, int, bool] | None:
        """The first change of an input after one time, and not after another [s]: when, which signal, its state. Others
        may change at the same instant.
        """
        while True:
            changes = self._history.rows(CHANGES)
            place = bisect_right(changes, after, key=lambda change: change[0])
            if place < len(changes):
                found: tuple[float, int, bool] = changes[place]
                return found if found[0] <= until else None
            coming = self._simulation.next_time
            if coming > until or coming == inf:
                return None
            self._advance(coming)

    def changes_at(self, t: float) -> dict[int, bool]:
        """Return the inputs that change at t [s], and what they are then."""
        self._advance(t)
        changes = self._history.rows(CHANGES)
        first = bisect_left(changes, t, key=lambda change: change[0])
        last = bisect_right(changes, t, key=lambda change: change[0])
        return {number: on for _, number, on in changes[first:last]}

    def rows(self, begin: float, end: float) -> CourseRows:
        """Return what begins at `begin` or later, and before `end` [s]; infinity: as far as the course is known, at
        least to the end of the timeline. What the course begins with counts as begun before all times.
        """
        if self._simulation.next_time < end:
            self._advance(nextafter(end, -inf) if end < inf else self.timeline.last)

        def between(key: Hashable) -> Iterator[Any]:
            rows = self._history.rows(key)
            first = bisect_left(rows, begin, key=lambda row: row[0]) if begin > self.begins else 0
            return iter(rows[first : bisect_left(rows, end, key=lambda row: row[0])])

        parts = {name: tuple(between(("spans", name))) for name in self._settings.parts}
        signals = {k: tuple(starmap(StateChange, between((CHANGES, k)))) for k in sorted(self._settings.computed)}
        sensors = {k: tuple(starmap(StateChange, between((SEES, k)))) for k in range(len(self._settings.scene.sensors))}
        return CourseRows(
            {name: rows for name, rows in parts.items() if rows},
            tuple(starmap(HandGrip, between(GRIPS))),
            {number: rows for number, rows in signals.items() if rows},
            {number: rows for number, rows in sensors.items() if rows},
            tuple(starmap(WorldNote, between(NOTES))),
        )

    def known_until(self, wanted: float) -> float:
        """Let what is due at the next instant happen if that is not after `wanted` [s]. Return the time before which
        all is known then; infinity where nothing is due any more.
        """
        with self._lock:
            if self._simulation.next_time <= wanted:
                self._simulation.advance(self._simulation.next_time)
            return self._simulation.next_time

    @property
    def notes(self) -> tuple[tuple[float, str, str], ...]:
        """Return what there is to tell up to the end of the timeline: time [s], kind, text. Kinds: EMPTY (the hand
        closed on nothing), FALL, EDGE, FEEDER, ENDLESS.
        """
        self._advance(self.timeline.end)
        return tuple(self._history.rows(NOTES))

    def state_at(self, t: float) -> WorldState | None:
        """Return all that the world is just before t [s], or what the course begins with; None: as the scene says."""
        if t <= self.begins:
            return self.timeline.world
        self._advance(t)
        with self._lock:
            return state_at(self._history, self._settings, t)

    def _advance(self, until: float) -> float:
        """Let all happen that is due up to a time [s]; return that time, or if that is later when the course begins."""
        simulation = self._simulation
        if self._history.now < until or simulation.next_time <= until:
            with self._lock:
                simulation.advance(until)
        return max(until, self.begins)


MOST_COURSES = 6  # of the versions asked for last


class World:
    """An arm in a cell. Any thread may ask."""

    def __init__(self, arm: RobotArm, cell: Cell) -> None:
        self.cell, self.settings = cell, WorldSettings(arm, cell)
        self._courses: list[WorldCourse] = []  # the one asked for last stands last
        self._lock = Lock()

    def course(self, timeline: Timeline) -> WorldCourse:
        """The course of a timeline."""
        with self._lock:
            found = next((one for one in self._courses if one.timeline is timeline), None)
            if found is None:
                found = self._made(timeline)
            else:
                self._courses.remove(found)
            self._courses = [*self._courses[1 - MOST_COURSES :], found]
            return found

    def poses(self, timeline: Timeline, t: float) -> Iterator[tuple[str, Transform]]:
        """Yield the parts that are there at t [s], each with T_world_part."""
        course = self.course(timeline)
        for name in course.parts():
            state = course.state(name, t)
            if state.exists:
                yield name, state.pose

    def _made(self, timeline: Timeline) -> WorldCourse:
        """Continue from the course that is the same for the longest time."""
        best, since = None, timeline.start
        for course in reversed(self._courses):
            if course.timeline.world is not timeline.world:
                continue
            same = course.timeline.same_until(timeline)
            if same > since:
                best, since = course, same
            if same >= course.timeline.end:  # the timeline goes on from its end
                break
        return WorldCourse(self.settings, timeline) if best is None else best.edited(timeline, since)
