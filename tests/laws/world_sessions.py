"""Random sessions of a robot in a cell, and the law of its world: the course that goes on from an older one is that of
a new world, to the bit; that of a mirror too.

The arm takes parts from a stack and from a feeder, carries them, lets them fall, and pushes fingers and parts through
sensors. Between that come edits, UNDO, REDO, INSERT OFF, BRAKE, JOG, branches, MERGE, and inputs from outside.
"""

from __future__ import annotations

from functools import cache
from math import inf, pi

from msgspec.structs import replace

from tests.laws.event_sessions import EventSession
from vrs_cli.engine.feed import Snapshot
from vrs_cli.files.cell_file import parse_cell
from vrs_cli.kinematics.transform import Transform, from_oat
from vrs_cli.language.run.signals import Cell
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Delay, Move, OperateHand, PoseTarget, SetChannels, SetParameter
from vrs_cli.world.course import World, WorldCourse

CELL = """
floor = -600
[hand]
signal = 1010
size = [20, 80, 40]
[[fixture]]
name = "table"
shape = "box"
size = [1200, 600, 20]
at = [0, 550, -290]
[[fixture]]
name = "stand"
shape = "box"
size = [100, 100, 50]
at = [250, 450, -255]
[[part]]
name = "low"
shape = "box"
size = [60, 60, 40]
at = [0, 550, -260]
[[part]]
name = "high"
shape = "box"
size = [40, 40, 40]
at = [0, 550, -220]
[[part]]
name = "ball"
shape = "sphere"
radius = 20
at = [-150, 500, -260]
[[part]]
name = "first"
shape = "cylinder"
radius = 20
height = 40
at = [150, 600, -200]
[[part]]
name = "second"
shape = "box"
size = [40, 40, 40]
at = [150, 600, -260]
[[sensor]]
name = "barrier"
signal = 1001
kind = "beam"
from = [120, 350, -180]
to = [120, 650, -180]
[[sensor]]
name = "filled"
signal = -1002
kind = "box"
at = [250, 450, -190]
size = [80, 80, 60]
[[feeder]]
when = 1
after = 0.1
parts = ["first", "second"]
again = true
[[sink]]
when = 2
after = 0.05
at = [250, 450, -200]
size = [120, 120, 120]
[[follow]]
when = 1001
set = 1003
after = 0.1
lasting = 0.3
[[follow]]
when = -1003
set = 1004
[[follow]]
when = 3
set = 1004
after = 0.2
"""
COMPUTED = (1001, 1002, 1003, 1004, 1010)
PLACES = [
    *((0.0, 550.0, -220.0), (0.0, 550.0, -260.0), (-150.0, 500.0, -255.0), (150.0, 600.0, -258.0)),
    *((250.0, 450.0, -210.0), (250.0, 450.0, -170.0), (20.0, 560.0, -180.0), (120.0, 500.0, -200.0)),
]  # [mm] of the tool
DOWN = (0.5 * pi, 0.5 * pi)  # [rad] O and A of the tool


@cache
def cell() -> Cell:
    return parse_cell(CELL)


def everything(course: WorldCourse) -> dict[str, object]:
    """All that a course says, up to a while after the end of the timeline."""
    end = course.timeline.last + 1.0
    found: dict[str, object] = {f"spans of {name}": course.spans(name, end) for name in course.parts()}
    changes, t = [], -inf
    while change := course.next_change(t, end):
        t = change[0]
        changes.append(tuple(course.signal(number, t) for number in COMPUTED))
        changes.append(change)
    found["changes"], found["notes"], found["moves"] = changes, course.notes, course.moves(-inf, end)
    found["states"] = [course.state(name, end) for name in course.parts()]
    found["held"] = course.held_part(end)
    return found


class WorldSession(EventSession):
    """One random session of a robot in a cell."""

    def __init__(self, seed: int, *, walks: bool = False) -> None:
        super().__init__(seed, walks=walks)
        self.world = World(self.engine.arm, cell())
        self.mirrored = [World(self.engine.arm, cell()) for _ in self.mirrors]
        for mirror, world in zip(self.mirrors, self.mirrored, strict=True):
            mirror.world = world
        self.courses, self.grips, self.crossings, self.windows = 0, 0, 0, 0

    def part(self, whole: Snapshot, begin: float) -> Snapshot:
        """The window of a snapshot with the state of the world when it begins, as a server makes it."""
        part = super().part(whole, begin)
        if not part.first:
            return part
        course = World(self.engine.arm, cell()).course(whole.timeline())
        return replace(part, world=course.state_at(part.known_from))

    # --- what is asked ---

    def command(self) -> None:
        r, engine = self.random, self.engine
        kind = r.random()
        if kind < 0.22:
            self.move(self.place(), r.random() < 0.3)
        elif kind < 0.42:
            self.pick_or_put()
        elif kind < 0.50:
            engine.perform(OperateHand(r.choice((0.0, 1.0, 0.4)), False, "HAND", None, self.stamp(1.0)), program=True)
        elif kind < 0.62:
            self.set_channels()
        elif kind < 0.65:
            engine.perform(Delay(r.choice((0.0, r.uniform(0.0, 0.4)))), program=True)
        elif kind < 0.69:
            engine.perform(SetParameter("INSERT", r.choice(("ON", "ON", "OFF"))))
        elif kind < 0.71:
            engine.stop()
        elif kind < 0.74:
            engine.redirect(self.joints(), text="JOG")
        elif kind < 0.86:
            engine.undo(r.randint(1, min(4, engine.book.history.commands or 1)))
        elif kind < 0.93:
            engine.redo(r.randint(1, 3))
        elif not self.walks:
            self.branch()

    def set_channels(self) -> None:
        """Set signals, or let a feeder bring a part and a sink take some."""
        signal = self.random.choice((0, 0, 1, 1, 2))
        if not signal:
            super().set_channels()
        for state in (1.0, 0.0) if signal else ():
            self.engine.perform(SetChannels(((signal, state),), text="SIGNAL"), program=True)

    def place(self) -> Transform:
        x, y, z = self.random.choice(PLACES)
        return from_oat(1e-3 * x, 1e-3 * y, 1e-3 * z, *DOWN, self.random.choice((0.0, 0.0, 0.5)))

    def joints(self) -> tuple[float, ...]:
        here = self.engine.position().joints
        return tuple(angle + self.random.uniform(-0.1, 0.1) for angle in here)

    def move(self, place: Transform, straight: bool, stamp: bool = True) -> None:
        at = self.stamp(0.4) if stamp else None
        self.engine.perform(
            Move(PoseTarget(place), straight, stamp=at, text="MOVE"), program=self.random.random() < 0.6
        )

    def pick_or_put(self) -> None:
        """Take a part that stands, and go away with it; or go somewhere and open the hand."""
        r, engine = self.random, self.engine
        course, end = self.world.course(engine.timeline), engine.timeline.end
        standing = sorted(course.parts_at_rest(end).items())
        if course.held_part(end) is None and standing:
            _, T = r.choice(standing)
            self.hand(1.0)
            self.move(
                from_oat(T.px, T.py, T.pz + r.choice((0.0, 0.01)), *DOWN, r.choice((0.0, 0.0, 0.5))), False, stamp=False
            )
            self.hand(0.0)
        else:
            self.move(self.place(), r.random() < 0.3, stamp=False)
            self.hand(1.0)
        if r.random() < 0.7:
            self.move(self.place(), r.random() < 0.3, stamp=False)

    def hand(self, opening: float) -> None:
        self.engine.perform(OperateHand(opening, True, "HAND"), program=True)

    # --- laws ---

    def check(self) -> None:
        super().check()
        r, timeline = self.random, self.engine.timeline
        if r.random() < 0.4:  # somebody looks at a moment, and no further
            self.world.course(timeline).state(r.choice(("low", "high", "ball")), self.instant())
        if r.random() < 0.4:
            self.check_world(timeline)

    def check_world(self, timeline: Timeline) -> None:
        r = self.random
        wanted = everything(self.new_course(timeline))
        course = self.world.course(timeline)
        same(everything(course), wanted)
        self.courses += 1
        self.grips += len(course.moves(-inf, inf))
        self.crossings += len(wanted["changes"])  # type: ignore[arg-type]
        if r.random() < 0.3:
            same(everything(self.mirrored[0].course(self.mirrors[0].timeline)), wanted)
        if r.random() < 0.5:
            self.check_window(course)

    def check_window(self, whole: WorldCourse) -> None:
        """A mirror of the end of the timeline sees the same from there on."""
        part = self.mirrored[1].course(self.mirrors[1].timeline)
        begins, end = part.begins, whole.timeline.last + 1.0
        self.windows += begins > whole.begins
        for name in whole.parts():
            spans = part.spans(name, end)
            assert spans == whole.spans(name, end)[-len(spans) :], name
            assert len(spans) == 1 or spans[1].begin >= begins
            t = self.random.uniform(begins, end)
            assert part.state(name, t) == whole.state(name, t)
            assert part.T_tool_part(t) == whole.T_tool_part(t)
        for t in [begins, *(self.random.uniform(begins, end) for _ in range(8))]:
            assert part.held_part(t) == whole.held_part(t)
            assert [part.signal(number, t) for number in COMPUTED] == [whole.signal(number, t) for number in COMPUTED]
            assert part.next_change(t, end) == whole.next_change(t, end)
            assert part.parts_at_rest(t) == whole.parts_at_rest(t)
        assert list(part.notes) == [note for note in whole.notes if note[0] >= begins]

    def new_course(self, timeline: Timeline) -> WorldCourse:
        """A course that goes on from no other; one in four knows no search of before, either."""
        if self.random.random() < 0.25:
            return World(self.engine.arm, cell()).course(timeline)
        return WorldCourse(self.world.settings, timeline)


def same(found: dict[str, object], wanted: dict[str, object]) -> None:
    for what, value in wanted.items():
        assert found[what] == value, what


def session(seed: int, length: int) -> WorldSession:
    """Run one session, every fourth of them in real time."""
    it = WorldSession(seed, walks=seed % 4 == 3)
    it.run(length)
    it.end()
    it.check_world(it.engine.timeline)
    return it
