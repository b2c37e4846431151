"""The course of a world (its state over time: where parts are, and which signals sensors and rules set), and the world
that computes it. A course depends only on a timeline and a scene. It is simulated only up to the latest time that was
queried. After an edit of the timeline, only the changed remainder is computed again."""

from __future__ import annotations

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
    """The state of a part at one time: its T_world_part, whether the hand holds it, the body on which it rests, and
    whether it exists."""

    pose: Transform
    held: bool
    on: str
    exists: bool


class WorldCourse:
    """The course of one timeline. It begins at the timeline's start, or at `begins` [s] if the timeline is the end of a
    longer one. Its methods may be called from any thread."""

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

    def for_edit(self, timeline: Timeline, since: float) -> WorldCourse:
        """Return the course of an edited timeline that equals this course's timeline until `since` [s]."""
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
        """Return the successive states of a part up to a time [s], by default up to the end of the timeline. Raises
        KeyError for an unknown part."""
        self._advance(self.timeline.end if until is None else until)
        if not (found := self._history.rows(("spans", name))):
            raise KeyError(name)
        ends = [*(after.begin for after in found[1:]), inf]
        return tuple(PartSpan(one.begin, one.kind, one.T, end, one.on) for one, end in zip(found, ends, strict=True))

    def state(self, name: str, t: float) -> PartState:
        """Return the state of a part at t [s]. Raises KeyError for an unknown part."""
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

    def held_part(self, t: float) -> str | None:
        """Return the name of the part in the hand at t [s], or None."""
        return self._grip(t)[0]

    def opening(self, t: float) -> float:
        """Return how far the fingers are open at t [s]: 1 is fully open, 0 closed. Fingers stop at the part that they
        take. While the fingers move, return the opening from which they started."""
        return self._grip(t)[1]

    def _grip(self, t: float) -> tuple[str | None, float]:
        """Return the name of the part in the hand at t [s], or None, and how far the fingers are open."""
        grip = self._history.last(GRIPS, self._advance(t))
        return grip[1:] if grip else (None, 0.0)

    def T_tool_part(self, t: float) -> Transform | None:
        """Return the pose of the held part in the tool's frame; None if the hand is empty."""
        if (name := self.held_part(t)) is None:
            return None
        return compose(inverse(self.timeline.locate(t)[0].motion.frames.tool), self._simulation.span(name, t).T)

    def tool(self, t: float) -> Transform:
        """Return T_world_tool at t [s]."""
        return self._simulation.tool(t)

    def graspable(self, t: float) -> str | None:
        """Return the part that the hand would take if it closed at t [s] from its current opening."""
        found = part_between(
            self._settings, self.parts_at_rest(t).items(), self.tool(t), (self.opening(t) * self._settings.opening, 0.0)
        )
        return None if found is None else found[0]

    def parts_at_rest(self, t: float) -> Mapping[str, Transform]:
        """Return the parts that are at rest at t [s], outside the hand, each with its T_world_part."""
        t = self._advance(t)
        with self._lock:
            done, found = self._standing
            count = self._history.count(MOVES, t)
            if count < done:
                done, found = 0, {}
            moved = self._history.rows(MOVES)[done:count]
            changed = dict.fromkeys(name for _, name in moved) if found else self.parts()
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
        """Return the times after `begin` and up to `end` [s] at which the state of a part changes, each with the part's
        name."""
        self._advance(end)
        return list(self._history.between(MOVES, begin, end))

    def last_move(self, until: float) -> float:
        """Return the last time before `until` [s] at which the state of a part changed."""
        move = self._history.last(MOVES, nextafter(until, -inf))
        return float(move[0]) if move else self.begins

    def signal(self, number: int, t: float) -> bool | None:
        """Return the state of an input at t [s]: off before the course begins, None if the world does not compute this
        input."""
        if number not in self._settings.computed:
            return None
        self._advance(t)
        change = self._history.last((CHANGES, number), t)
        return bool(change and change[1])

    def next_change(self, after: float, until: float = inf) -> tuple[float, int, bool] | None:
        """Return the first change of an input after `after` and up to `until` [s]: its time, signal and state. Other
        inputs may change at the same instant."""
        while True:
            changes, place = self._history.rows(CHANGES), self._history.count(CHANGES, after)
            if place < len(changes):
                found: tuple[float, int, bool] = changes[place]
                return found if found[0] <= until else None
            coming = self._simulation.next_time
            if coming > until or coming == inf:
                return None
            self._advance(coming)

    def changes_at(self, t: float) -> dict[int, bool]:
        """Return the inputs that change at t [s], and their new states."""
        self._advance(t)
        return {number: on for _, number, on in self._history.between(CHANGES, nextafter(t, -inf), t)}

    def rows(self, begin: float, end: float) -> CourseRows:
        """Return the rows that begin at `begin` or later and before `end` [s]. If `end` is infinite, return all rows
        computed so far, at least up to the end of the timeline. The rows of the initial state count as earlier than any
        time."""
        if self._simulation.next_time < end:
            self._advance(nextafter(end, -inf) if end < inf else self.timeline.last)

        def between(key: Hashable) -> Iterator[Any]:
            since = nextafter(begin, -inf) if begin > self.begins else -inf
            return iter(self._history.between(key, since, nextafter(end, -inf)))

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
        """Simulate the next events, unless they are later than `wanted` [s]. Return the time of the first event that is
        not simulated yet; infinity if no event is left."""
        with self._lock:
            if self._simulation.next_time <= wanted:
                self._simulation.advance(self._simulation.next_time)
            return self._simulation.next_time

    @property
    def notes(self) -> tuple[tuple[float, str, str], ...]:
        """Return the notes up to the end of the timeline: time [s], kind, text. Kinds: EMPTY (the hand closed on
        nothing), FALL (a part falls), EDGE (a part rests on an edge), FEEDER (a feeder cannot bring a part), ENDLESS
        (rules trigger each other without end)."""
        self._advance(self.timeline.end)
        return tuple(self._history.rows(NOTES))

    def state_at(self, t: float) -> WorldState | None:
        """Return the state of the world just before t [s]. If the course begins at t or later, return its initial
        state; None if that is the scene itself."""
        if t <= self.begins:
            return self.timeline.world
        self._advance(t)
        with self._lock:
            return state_at(self._history, self._settings, t)

    def _advance(self, until: float) -> float:
        """Simulate up to a time [s]. Return this time or the start of the course, whichever is later."""
        simulation = self._simulation
        if self._history.now < until or simulation.next_time <= until:
            with self._lock:
                simulation.advance(until)
        return max(until, self.begins)


MAX_COURSES = 6  # maximum number of courses (states of the world over time) that are kept in memory


class World:
    """The world of an arm in a cell. It keeps the courses of the most recently queried timeline versions. All methods
    may be called from any thread."""

    def __init__(self, arm: RobotArm, cell: Cell) -> None:
        self.cell, self.settings = cell, WorldSettings(arm, cell)
        self._courses: list[WorldCourse] = []  # the most recently used course is last
        self._lock = Lock()

    def course(self, timeline: Timeline) -> WorldCourse:
        """Return the course of a timeline; compute a new one if none is kept."""
        with self._lock:
            if (found := next((one for one in self._courses if one.timeline is timeline), None)) is None:
                found = self._continued_course(timeline)
            else:
                self._courses.remove(found)
            self._courses = [*self._courses[1 - MAX_COURSES :], found]
            return found

    def poses(self, timeline: Timeline, t: float) -> Iterator[tuple[str, Transform]]:
        """Yield the name and T_world_part of each part that exists at t [s]."""
        course = self.course(timeline)
        for name in course.parts():
            state = course.state(name, t)
            if state.exists:
                yield name, state.pose

    def _continued_course(self, timeline: Timeline) -> WorldCourse:
        """Return a new course. It reuses the start of the kept course whose timeline equals this one for the longest
        time."""
        best, since = None, timeline.start
        for course in reversed([one for one in self._courses if one.timeline.world is timeline.world]):
            same = course.timeline.same_until(timeline)
            if same > since:
                best, since = course, same
            # no course can have more in common: the new timeline only adds motions at the end
            if same >= course.timeline.end:
                break
        return WorldCourse(self.settings, timeline) if best is None else best.for_edit(timeline, since)
