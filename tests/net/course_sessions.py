"""The course of a world as a client draws it that knows the timeline, the robot and what it was told, and the law: it
is at every time what the world itself says, and what was said of contacts is what the robot's own check finds.

`python -m tests.net.course_sessions 300 [first seed]` tries many random sessions.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from math import inf
from typing import Any

from tests.by_hand import command
from tests.laws.world_sessions import WorldSession
from vrs_cli.engine.position import joints_at, world_pose
from vrs_cli.errors import VrsError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import IDENTITY, Transform, compose
from vrs_cli.net.course_teller import CourseTeller, Cut, Heard, clip_contacts
from vrs_cli.net.messages import Contacts, Course, FromServer, ServerMessage
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.commands import Frames
from vrs_cli.values.world import ContactSpan, SpanKind, WorldNote
from vrs_cli.wire.codec import Encoding, Reader, encode
from vrs_cli.world.course import World
from vrs_cli.world.sensing import GRAVITY

READER: Reader[ServerMessage] = Reader(FromServer)


def begin_of(row: Any) -> float:
    """The time with which a row of a track begins [s]."""
    return float(row.time if isinstance(row, WorldNote) else row.begin)


class DrawnWorld:
    """What a client knows of a world; each track has rows that begin with their times."""

    def __init__(self) -> None:
        self.tracks: dict[tuple[str, Any], list[Any]] = {}
        self.touches: list[ContactSpan] = []
        self.until, self.looked = -inf, (inf, -inf)

    def hear(self, message: ServerMessage) -> None:
        if isinstance(message, Course):
            since = -inf if message.since is None else message.since
            for rows in self.tracks.values():
                del rows[bisect_left(rows, since, key=begin_of) :]
            told = message.rows
            several: dict[str, Any] = {"part": told.parts, "signal": told.signals, "sensor": told.sensors}
            for kind, tracks in several.items():
                for name, rows in tracks.items():
                    self.tracks.setdefault((kind, name), []).extend(rows)
            self.tracks.setdefault(("grips", ""), []).extend(told.grips)
            self.tracks.setdefault(("notes", ""), []).extend(told.notes)
            self.until = inf if message.until is None else message.until
        elif isinstance(message, Contacts):
            since, until = message.since, inf if message.until is None else message.until
            kept = [*clip_contacts(self.touches, -inf, since), *clip_contacts(self.touches, until, inf)]
            self.touches = sorted([*kept, *message.touches], key=lambda one: one.begin)
            self.looked = min(self.looked[0], since), max(self.looked[1], until)

    def row(self, kind: str, name: Any, t: float) -> Any:
        rows = self.tracks.get((kind, name), [])
        place = bisect_right(rows, t, key=begin_of)
        return rows[place - 1] if place else None

    def pose(self, arm: RobotArm, timeline: Timeline, name: str, t: float) -> Transform | None:
        """T_world_part; None of one that is not there."""
        row = self.row("part", name, t)
        T: Transform = row.T
        match row.kind:
            case SpanKind.ABSENT:
                return None
            case SpanKind.HELD:
                base = timeline.locate(t)[0].motion.frames.base
                return compose(world_pose(arm, Frames(base, IDENTITY), joints_at(arm, timeline, t)), T)
            case SpanKind.FALLS:
                return T._replace(pz=T.pz - 0.5 * GRAVITY * (t - row.begin) ** 2)
        return T


class ToldSession(WorldSession):
    """A random session that a client draws, which hears of it now and then; another one comes late, or listens anew."""

    def __init__(self, seed: int, *, walks: bool = False) -> None:
        super().__init__(seed, walks=walks)
        self.teller = CourseTeller(self.world, lambda: self.engine.now)
        self.followed = self.engine.timeline
        self.teller.begin(self.followed)
        self.drawn, self.heard = DrawnWorld(), Heard()
        self.compared, self.bytes = 0, 0

    def check(self) -> None:
        super().check()
        timeline = self.engine.timeline
        if timeline is not self.followed:
            cut = Cut.between(self.followed, timeline)
            self.followed, self.heard = timeline, self.heard.cut(cut)
            self.teller.change(timeline, cut)
        for _ in range(self.random.choice((0, 0, 1, 3, 10))):
            self.teller.step()
        if self.random.random() < 0.5:
            self.listen()
            self.compare()
        if self.random.random() < 0.05:
            self.drawn, self.heard = DrawnWorld(), Heard()

    def listen(self) -> None:
        """Hear all that is known so far, through a connection."""
        while True:
            told, self.heard = self.teller.after(self.heard)
            for message in told:
                frame = encode(message, self.random.choice((Encoding.JSON, Encoding.MSGPACK)))
                self.bytes += len(frame)
                self.drawn.hear(READER.read(frame))
            if not told:
                return

    def compare(self) -> None:
        drawn, timeline = self.drawn, self.followed
        arm, course = self.engine.arm, self.world.course(timeline)
        known = min(self.heard.until, max(timeline.last, self.engine.now) + 2.0)
        if known <= course.begins:
            return
        assert drawn.until >= self.heard.until  # a change that was not told so far may be in it
        moves = [t for t, _ in course.moves(-inf, known) if t < known]
        for t in [*(self.random.uniform(course.begins, known) for _ in range(6)), *moves[-4:]]:
            self.compared += 1
            for name in course.parts():
                state, pose = course.state(name, t), drawn.pose(arm, timeline, name, t)
                assert (pose is not None) == state.exists, (name, t)
                if pose is not None:
                    assert max(abs(a - b) for a, b in zip(pose, state.pose, strict=True)) < 1e-12, (name, t)
            grip = drawn.row("grips", "", t)
            assert (grip.part if grip else None) == course.held_part(t)
            assert (grip.opening if grip else 0.0) == course.opening(t)
            for number in self.world.settings.computed:
                change = drawn.row("signal", number, t)
                assert bool(change and change.on) == course.signal(number, t), (number, t)
            for number, sensor in enumerate(self.world.settings.scene.sensors):
                change = drawn.row("sensor", number, t)
                assert bool(change and change.on) is (bool(course.signal(abs(sensor.signal), t)) is (sensor.signal > 0))

    def finish(self) -> None:
        """Compute and hear all; compare it with what a new client hears, and with what nobody has cut."""
        while self.teller.step():
            pass
        self.listen()
        assert self.drawn.until >= self.followed.last + 1.0
        self.compare()
        late, self.drawn, self.heard = self.drawn, DrawnWorld(), Heard()
        self.listen()
        for key in self.drawn.tracks | late.tracks:
            assert self.drawn.tracks.get(key, []) == late.tracks.get(key, []), key
        assert self.drawn.until == late.until


def contacts_of(world: World, timeline: Timeline, now: float) -> DrawnWorld:
    """What a client draws that hears a whole timeline at once."""
    teller, heard, drawn = CourseTeller(world, lambda: now), Heard(), DrawnWorld()
    teller.begin(timeline)
    while teller.step():
        pass
    while True:
        told, heard = teller.after(heard)
        for message in told:
            drawn.hear(message)
        if not told:
            return drawn


def red(drawn: DrawnWorld, begin: float, end: float) -> set[tuple[str, str]]:
    """The pairs that touch at some time between two [s]."""
    return {
        (one.first, one.second) for one in drawn.touches if one.begin <= end and (one.end is None or one.end >= begin)
    }


def told_session(seed: int, length: int) -> ToldSession:
    """Run one session, every fourth of them in real time. Raises AssertionError where the law is broken."""
    it = ToldSession(seed, walks=seed % 4 == 3)
    it.run(length)
    it.finish()
    return it


def main(count: int, first: int = 0) -> None:
    compared, sent = 0, 0
    for seed in range(first, first + count):
        try:
            it = told_session(seed, 25)
        except (AssertionError, VrsError):
            print(f"seed {seed}", flush=True)
            raise
        compared, sent = compared + it.compared, sent + it.bytes
    print(f"{count} sessions, {compared} times compared, {sent} bytes")


if __name__ == "__main__":
    command(main)
