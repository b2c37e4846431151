"""Compute the course of a robot's world (the state of its parts, sensors and contacts over time), for clients that draw
it.

The course is computed once for all clients, and only while a client wants it. A separate thread computes it in short
steps. Between steps the thread rests, longer while the robot has work. So neither the robot nor the connections wait
for it, and after several changes in a short time it computes only the last timeline. The computed part is valid up to
the first change of the timeline that it does not contain. Each client receives the part of the course that it lacks.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from importlib.util import find_spec
from math import inf
from threading import Condition, Lock, Thread
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.engine.position import start_before
from vrs_cli.net import messages
from vrs_cli.trajectory.instant import TICK
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import MotionKind
from vrs_cli.values.world import ContactSpan, CourseRows

if TYPE_CHECKING:
    from vrs_cli.contacts.checker import Checker
    from vrs_cli.world.course import World, WorldCourse

AHEAD = 10.0  # [s] the computation stops when the course reaches this far beyond the end of the timeline and beyond now
LEAST_AHEAD = 5.0  # [s] the computation continues when the course reaches less than this far beyond either of them
BEFORE_NOW = 1.0  # [s] the search for contacts starts this time before now
STRETCH = 0.5  # [s] duration of the part of a motion that one step searches for contacts
STANDING = 5.0  # [s] duration that one step searches for contacts while the arm is at rest
STEP = 0.001  # [s] CPU time of one step
SHARE = 0.25  # maximum fraction of a core used to compute courses
LAG = 0.25  # [s] maximum time that the next step waits while the robot has work
LOOKS_EVERY = 0.01  # [s] how often to check whether the robot still has work to do
NEWS_PERIOD_S = 0.05  # [s] time between two messages to clients while the course is being computed

MAX_ROWS = 400  # maximum number of rows in one message
MAX_LOOKED = 600.0  # [s] maximum length of a saved trajectory searched for contacts; 1 s of motion takes 10 ms of CPU
MAX_TOUCHES = 10_000  # when this number of contacts is known, no earlier contacts are searched

_one_at_a_time = Lock()  # held during a step: of all robots in this process, only one computes at a time


class Cut(NamedTuple):
    """The effect of a change of the timeline: the first time at which it alters the course, and the first at which it
    alters the contacts [s]; infinity: never."""

    course: float = inf
    contacts: float = inf

    @classmethod
    def between(cls, before: Timeline, after: Timeline) -> Cut:
        """Return the times from which a change of one timeline to another alters course and contacts. Contacts may
        change during the whole motion before the timelines diverge, because the hand touches the part that it grasps at
        the end of that motion. A steered motion is not searched again.
        """
        since = before.same_until(after)
        last = since - TICK
        steered = after.locate(last)[0].motion.kind is MotionKind.STEERED
        return cls(since, since if steered else min(since, start_before(after, last)))

    def first(self, other: Cut) -> Cut:
        return Cut(min(self.course, other.course), min(self.contacts, other.contacts))


NEVER, FROM_THE_BEGIN = Cut(), Cut(-inf, -inf)


class Heard(NamedTuple):
    """The part of a course that a client has: the states at all times before `until` [s], and the contacts between
    `low` and `high` [s]."""

    until: float = -inf
    low: float = inf
    high: float = -inf

    def cut(self, cut: Cut) -> Heard:
        """Return the part that is still valid after a change of the timeline."""
        low, high = (self.low, min(self.high, cut.contacts)) if cut.contacts > self.low else (inf, -inf)
        return Heard(min(self.until, cut.course), low, high)


class Known(Struct, frozen=True):
    """The part of a course computed so far: the states at all times before `until` [s], and the contacts between `low`
    and `high` [s]."""

    course: WorldCourse
    until: float
    low: float
    high: float
    touches: tuple[ContactSpan, ...] = ()

    def cut(self, since: float, now: float) -> Known:
        """Return the computed part, keeping only the contacts before `since` [s], the time from which a change replaces
        the timeline. If no contacts are left, the search starts again shortly before `now` [s]."""
        if since > self.low:
            return replace(self, high=min(self.high, since), touches=tuple(clip_contacts(self.touches, -inf, since)))
        first = max(self.course.begins, min(now, self.course.timeline.last) - BEFORE_NOW)
        return replace(self, low=first, high=first, touches=())


class CourseComputer:
    """Computes, step by step, the course of a timeline (the states of the world's parts and sensors over time) and the
    contacts between bodies. Use it in one thread at a time. `now`: a function that returns the robot's clock [s].
    `looks`: whether to search for contacts too; the search needs MuJoCo."""

    def __init__(self, world: World, now: Callable[[], float], *, looks: bool = True) -> None:
        self._world, self._now = world, now
        self.can_look = not world.settings.scene.empty and find_spec("mujoco") is not None
        self.looks = looks and self.can_look
        self._checker: Checker | None = None

    def begin(self, timeline: Timeline, known: Known | None, cut: Cut) -> Known:
        """Start on a new timeline, and return the part of its course that need not be recomputed. `known`: the part
        computed for the previous timeline; it stays valid up to `cut`, the times at which course and contacts of the
        two timelines diverge."""
        course = self._world.course(timeline)
        before = known or Known(course, -inf, inf, -inf)
        until = min(before.until, cut.course, course.known_until(-inf))
        return replace(before, course=course, until=until).cut(cut.contacts, self._now())

    def wants_more(self, known: Known) -> bool:
        """Return whether the course must be computed further."""
        return known.until < max(known.course.timeline.last, self._now()) + LEAST_AHEAD

    def step(self, known: Known) -> Known:
        """Compute one step; return the part known after this step, or the same object if everything is known."""
        course = known.course
        wanted = max(course.timeline.last, self._now()) + AHEAD
        if self.wants_more(known):
            until, done = -inf, time.thread_time() + STEP
            while until <= wanted and time.thread_time() < done:
                until = course.known_until(wanted)
            return replace(known, until=until)
        if not self.looks:
            return known
        return self._look_ahead(known, wanted) or self._look_back(known) or known

    def _look_ahead(self, known: Known, wanted: float) -> Known | None:
        """Search for contacts after the interval searched so far; return the part known then, or None if there is
        nothing to search."""
        course, begin = known.course, known.high
        timeline = course.timeline
        last = max(timeline.last, course.last_move(known.until))
        end = min(known.until, last if known.until == inf else wanted)
        if begin < end:
            end = min(end, begin + (STRETCH if begin < timeline.end else STANDING))
            return replace(known, high=end, touches=join_contacts(known.touches, self.touches(known, begin, end)))
        if known.until == inf and begin < inf:  # nothing moves after that time
            touches = (one for one in self.touches(known, last, last + STRETCH) if one.end == last + STRETCH)
            found = [one._replace(begin=max(one.begin, begin), end=None) for one in touches]
            return replace(known, high=inf, touches=join_contacts(known.touches, found))
        return None

    def _look_back(self, known: Known) -> Known | None:
        """Search for contacts before the interval searched so far; return the part known then, or None if there is
        nothing to search."""
        course, end = known.course, known.low
        if end <= course.begins or len(known.touches) > MAX_TOUCHES:
            return None
        begin = max(course.begins, end - STRETCH)
        return replace(known, low=begin, touches=join_contacts(self.touches(known, begin, end), known.touches))

    def touches(self, known: Known, begin: float, end: float) -> list[ContactSpan]:
        """Return the contacts between two times [s] for which the course is known."""
        if self._checker is None:
            from vrs_cli.contacts.checker import Checker

            self._checker = Checker(self._world.settings.arm, self._world.settings.scene)
        names = self._checker.names
        found = self._checker.touches(known.course.timeline, begin, end, known.course)
        return [ContactSpan(one.begin, one.end, *(names[owner] for owner in one.owners)) for one in found]


def join_contacts(earlier: Iterable[ContactSpan], later: Iterable[ContactSpan]) -> tuple[ContactSpan, ...]:
    """Join the contacts of two successive intervals; a contact across the boundary becomes one contact."""
    found = list(earlier)
    open_ends = {(one.first, one.second, one.end): k for k, one in enumerate(found)}
    for one in later:
        if (place := open_ends.get((one.first, one.second, one.begin))) is None:
            found.append(one)
        else:
            found[place] = found[place]._replace(end=one.end)
    return tuple(found)


def clip_contacts(touches: Iterable[ContactSpan], begin: float, end: float) -> Iterator[ContactSpan]:
    """Yield the parts of contacts between two times [s]."""
    for one in touches:
        last = inf if one.end is None else one.end
        if one.begin < end and last > begin:
            until = min(last, end)
            yield one._replace(begin=max(one.begin, begin), end=None if until == inf else until)


# --- one robot's course, for all its listeners -----------------------------------------------------------------------


class CourseTeller:
    """The source of the course of one robot's world for its listeners. The thread of the connections calls all methods
    except `step`, which another thread calls."""

    def __init__(self, world: World, now: Callable[[], float], *, looks: bool = True) -> None:
        self._computer = CourseComputer(world, now, looks=looks)
        self._changed = Condition()
        self._clients = 0
        self._timeline: Timeline | None = None  # the current timeline; None while there are no listeners
        # effects of changes that `_known` does not contain yet: of waiting changes, and of changes being computed
        self._cut = self._taken = NEVER
        self._known: Known | None = None

    # --- listeners ---

    def begin(self, timeline: Timeline) -> None:
        """Add one listener."""
        self._clients += 1
        if self._clients == 1:
            with self._changed:
                self._timeline, self._known, self._cut = timeline, None, FROM_THE_BEGIN
                self._changed.notify()

    def end(self) -> None:
        """Remove one listener."""
        self._clients -= 1
        if not self._clients:
            with self._changed:
                self._timeline = self._known = None

    def change(self, timeline: Timeline, cut: Cut) -> None:
        """Take a new timeline. `cut`: the times from which its course and its contacts differ from the course and the
        contacts of the previous timeline."""
        if self._clients:
            with self._changed:
                self._timeline, self._cut = timeline, self._cut.first(cut)
                self._changed.notify()

    def tick(self) -> None:
        """Compute more of the course (the states of the parts over time) when the robot's clock nears the end of what
        has been computed. Call this method several times a second."""
        if self._wants_more():
            with self._changed:
                self._changed.notify()

    def close(self) -> None:
        """Stop the computation; it cannot be restarted."""

    def after(self, heard: Heard) -> tuple[list[messages.ServerMessage], Heard]:
        """Return the next messages for a listener (none if it has everything), and the part of the course that it has
        after these messages."""
        with self._changed:
            known, cut = self._known, self._cut.first(self._taken)
        if known is None:
            return [], heard
        news, until = list[messages.ServerMessage](), min(known.until, cut.course)
        if heard.until < until:
            rows, until = course_part(known.course, heard.until, until)
            since = heard.until if heard.until > known.course.begins else None
            news.append(messages.Course(rows, since, None if until == inf else until))
            heard = heard._replace(until=until)
        low, high = (inf, -inf) if heard.low < known.low else heard[1:]
        begin, end = known.low, min(known.high, cut.contacts)
        for since, until in ((begin, end),) if low > high else ((high, end), (begin, low)):
            if since < until:
                touches = tuple(clip_contacts(known.touches, since, until))
                news.append(messages.Contacts(touches, since, None if until == inf else until))
                low, high = min(low, since), max(high, until)
        return news, heard._replace(low=low, high=high)

    # --- computation ---

    def step(self) -> bool:
        """Compute one step; return whether part of the course is still to be computed."""
        with self._changed:
            timeline, before = self._timeline, self._known
            self._taken, self._cut = self._taken.first(self._cut), NEVER
            cut = self._taken
        if timeline is None:
            return False
        known = before
        if known is None or known.course.timeline is not timeline:
            known = self._computer.begin(timeline, known, cut)
        known = self._computer.step(known)
        with self._changed:
            if self._timeline is not None:
                self._known, self._taken = known, NEVER
            return known is not before or self._cut is not NEVER

    def _wants_more(self) -> bool:
        known = self._known
        return known is not None and self._computer.wants_more(known)


class CourseThread(CourseTeller):
    """A course teller with its own thread, which computes while there are listeners. `works`: returns whether the robot
    has work. `woken`: called in this thread when there is more to send. `failed`: called with an unexpected error."""

    def __init__(
        self,
        world: World,
        now: Callable[[], float],
        works: Callable[[], bool],
        woken: Callable[[], None],
        failed: Callable[[Exception], None],
    ) -> None:
        super().__init__(world, now)
        self._works, self._woken, self._failed = works, woken, failed
        self._thread: Thread | None = None
        self._ended = False

    def begin(self, timeline: Timeline) -> None:
        super().begin(timeline)
        if self._thread is None:
            self._thread = Thread(target=self._compute, name="vrs course", daemon=True)
            self._thread.start()

    def close(self) -> None:
        with self._changed:
            self._ended = True
            self._changed.notify()
        if self._thread is not None:
            self._thread.join()

    def _compute(self) -> None:
        woken_at = -inf
        try:
            while not self._ended:
                begun = time.thread_time()
                with _one_at_a_time:
                    goes_on = self.step()
                took = time.thread_time() - begun
                if not goes_on or time.monotonic() - woken_at > NEWS_PERIOD_S:
                    woken_at = time.monotonic()
                    self._woken()
                if not goes_on:
                    with self._changed:  # wait until there is something to compute
                        if not (self._ended or self._cut is not NEVER or self._wants_more()):
                            self._changed.wait()
                time.sleep(max(took * (1.0 / SHARE - 1.0), STEP))
                until = time.monotonic() + LAG
                while self._works() and time.monotonic() < until:  # the robot's own work has priority, up to a limit
                    time.sleep(LOOKS_EVERY)
        except Exception as error:
            self._failed(error)


def course_part(course: WorldCourse, begin: float, end: float) -> tuple[CourseRows, float]:
    """Return the rows of a course between two times [s], and the end of these rows: `end`, or earlier if there are too
    many rows for one message.
    """
    rows = course.rows(begin, end)
    spans = [row.begin for several in rows.parts.values() for row in several]
    changes = [row.begin for several in (*rows.signals.values(), *rows.sensors.values()) for row in several]
    times = sorted([*spans, *changes, *(row.begin for row in rows.grips), *(row.time for row in rows.notes)])
    later = [t for t in times[MAX_ROWS:] if t > max(begin, course.begins)]
    return (course.rows(begin, later[0]), later[0]) if later else (rows, end)


class WholeCourse(Struct, frozen=True):
    """The course of a saved trajectory, as in the messages `course` and `contacts`. `touches`: the contacts; None if
    the timeline is longer than MAX_LOOKED or MuJoCo is missing. `until`: the end of the known course [s]; None: it is
    known without end.
    """

    rows: CourseRows
    touches: tuple[ContactSpan, ...] | None
    until: float | None


def whole_course(world: World, timeline: Timeline, between: tuple[float, float] | None = None) -> WholeCourse:
    """Return the course of a whole timeline, and its contacts. `between`: search for contacts only between these two
    times [s]."""
    looks = between is None and timeline.last - timeline.start <= MAX_LOOKED
    computer = CourseComputer(world, lambda: timeline.start, looks=looks)
    known = computer.begin(timeline, None, NEVER)
    while (following := computer.step(known)) is not known:
        known = following
    touches = known.touches if computer.looks else None
    if between is not None and computer.can_look:
        touches = tuple(computer.touches(known, *between))
    return WholeCourse(known.course.rows(-inf, known.until), touches, None if known.until == inf else known.until)
