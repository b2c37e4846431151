"""Random sessions of one robot, from a seed: motions of all kinds, issued everywhere on the timeline, every law checked
after each of them.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import radians
from random import Random

from tests.laws.motion_laws import check_continuous, check_edit, check_limits, check_lines, check_target, edited
from vrs_cli.engine.commands import (
    AlignedTarget,
    Delay,
    JointOffsetTarget,
    JointTarget,
    Mode,
    Move,
    NamedTarget,
    OperateHand,
    PoseTarget,
    Request,
    SetAcceleration,
    SetBase,
    SetDuration,
    SetMode,
    SetMonitorSpeed,
    SetParameter,
    SetSpeed,
    SetTool,
    SpeedUnit,
    Stamp,
    Target,
    ToolOffsetTarget,
)
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at
from vrs_cli.errors import MotionError, UsageError
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.kinematics.transform import compose, from_oat, rotation_z, translation
from vrs_cli.trajectory.delta import TimelineDelta
from vrs_cli.trajectory.timeline import Timeline

MODEL = load_robot("puma560")
LONGEST = 400  # segments; then the timeline begins anew


@dataclass
class Tally:
    """What a session did."""

    commands: int = 0
    refused: int = 0
    undone: int = 0
    edits: int = 0


@dataclass
class Session:
    """One robot at work; `run` gives so many commands."""

    seed: int
    tally: Tally = field(default_factory=Tally)

    def __post_init__(self) -> None:
        self.random = Random(self.seed)
        self._begin()

    def _begin(self) -> None:
        self.engine = Engine(MODEL)
        self.edits: list[tuple[Timeline, TimelineDelta]] = []
        self.engine.listeners.append(self._note)
        self.before = self.engine.timeline
        self.engine.perform(Move(PoseTarget(from_oat(0.0, 0.45, -0.15, radians(90), radians(90), 0.0)), False))

    def _note(self, delta: TimelineDelta, _after: Timeline) -> None:
        self.edits.append((self.before, delta))
        self.before = self.engine.timeline

    def run(self, commands: int) -> Tally:
        for _ in range(commands):
            self.command()
            if len(self.engine.timeline) > LONGEST:
                self._begin()
        return self.tally

    def command(self) -> None:
        """One random command, and every law."""
        self.tally.commands += 1
        if self.random.random() < 0.05 and self.engine.deltas:
            self._undo()
            return
        before, self.edits = self.engine.timeline, []
        try:
            self.engine.perform(self.request(), program=self.random.random() < 0.5)
        except MotionError:
            self.tally.refused += 1
            assert self.engine.timeline is before, "a refused motion leaves the timeline as it was"
        for old, delta in self.edits:
            self.tally.edits += 1
            self._check(old, delta)

    def _undo(self) -> None:
        """UNDO, and what it took back again by what the deltas say."""
        timeline = self.engine.timeline
        try:
            delta = self.engine.undo()
        except UsageError:  # all is undone
            return
        self.tally.undone += 1
        assert timeline.apply(delta) == self.engine.timeline

    def _check(self, before: Timeline, delta: TimelineDelta) -> None:
        engine = self.engine
        after = engine.timeline
        assert before.apply(delta) == after
        assert after.apply(before.inverse(delta)) == before
        check_edit(before, delta, after)
        check_continuous(engine, edited(delta, after))
        check_limits(engine, delta.segments)
        check_lines(engine, edited(delta, after))
        check_target(engine)
        for _ in range(3):
            t = self.random.uniform(0.0, delta.cut)
            if t < delta.cut:
                assert position_at(engine.arm, before, t) == position_at(engine.arm, after, t), "the past is untouched"

    # --- what is asked ---

    def request(self) -> Request:
        r = self.random
        if r.random() < 0.75:
            return self.move()
        return r.choice(
            (
                lambda: Delay(r.choice((0.0, r.uniform(0.0, 2.0)))),
                lambda: OperateHand(r.choice((0.0, 1.0)), r.random() < 0.5),
                lambda: SetSpeed(r.uniform(5.0, 100.0), always=r.random() < 0.5),
                lambda: SetSpeed(r.uniform(20.0, 500.0), unit=SpeedUnit.MMPS, always=r.random() < 0.3),
                lambda: SetMonitorSpeed(r.uniform(10.0, 100.0)),
                lambda: SetAcceleration(r.uniform(20.0, 100.0)),
                lambda: SetDuration(r.uniform(0.1, 3.0), always=r.random() < 0.2),
                lambda: SetMode(Mode.CONTINUOUS_PATH, r.random() < 0.7, always=r.random() < 0.5),
                lambda: SetParameter("INSERT", r.choice(("ON", "ON", "OFF"))),
                lambda: SetParameter("PROFILE", r.choice(("LSPB", "SCURVE", "SCURVE"))),
                lambda: SetParameter("ROUNDING", r.choice(("DECEL", 0.0, r.uniform(0.0, 60.0)))),
                lambda: SetTool(translation(0.0, 0.0, r.choice((0.0, r.uniform(0.0, 0.1))))),
                lambda: SetBase(
                    compose(translation(0.0, 0.0, r.uniform(-0.1, 0.1)), rotation_z(r.choice((0.0, r.uniform(-1, 1)))))
                ),
            )
        )()

    def move(self) -> Move:
        r = self.random
        stamp = Stamp(self.instant()) if r.random() < 0.7 else None
        return Move(self.target(), r.random() < 0.5, hand=r.choice((None, 0.0, 1.0)), stamp=stamp, text="MOVE")

    def target(self) -> Target:
        r = self.random
        kind = r.random()
        if kind < 0.55:
            x, y, z = r.uniform(-0.3, 0.3), r.uniform(0.35, 0.6), r.uniform(-0.4, 0.1)
            return PoseTarget(from_oat(x, y, z, *map(radians, (r.uniform(30, 150), r.uniform(50, 90), r.gauss(0, 30)))))
        if kind < 0.75:
            return JointTarget(tuple(map(r.uniform, MODEL.lower, MODEL.upper)))
        if kind < 0.85:
            return JointOffsetTarget(r.randint(1, 6), r.uniform(-1.0, 1.0))
        if kind < 0.95:
            return ToolOffsetTarget(translation(0.0, 0.0, r.uniform(-0.1, 0.1)))
        return r.choice((AlignedTarget(), NamedTarget("ready"), NamedTarget("nest")))

    def instant(self) -> float:
        """An execution time: inside a segment of any kind, exactly on a boundary, in a gap, at or after the end."""
        r, timeline = self.random, self.engine.timeline
        segment = timeline[r.randrange(len(timeline))]
        return max(
            0.0,
            r.choice(
                (
                    segment.start,
                    segment.finish,
                    r.uniform(segment.start, segment.finish),
                    r.uniform(segment.start, segment.finish),
                    segment.finish + r.uniform(0.0, 0.5),
                    r.uniform(0.0, timeline.end),
                    timeline.end,
                    timeline.end + r.uniform(0.0, 2.0),
                    0.0,
                )
            ),
        )
