"""Random sessions of any robot, from a seed: motions of all kinds, issued everywhere on the timeline, every law checked
after each of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import radians
from random import Random

from tests.laws.explained_laws import check_foretold, check_plan, check_refusal, check_splice, foretold
from tests.laws.motion_laws import (
    check_continuous,
    check_edit,
    check_limits,
    check_lines,
    check_rounding,
    check_target,
    edited,
)
from tests.laws.reach_laws import check_reach
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.position import position_at
from vrs_cli.errors import IllegalValue, MotionError, UsageError
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform, compose, from_oat, rotation_x, rotation_z, translation
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import (
    AlignedTarget,
    Brake,
    Break,
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
    SetConfiguration,
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

LONGEST = 400  # segments; then the timeline begins anew
NEAR = (0.02, 0.1, 0.1, 0.3)  # of the ranges: how far straight lines go
INSIDE = 0.2  # of a range, at both ends, that the robot begins away from
TILT = 0.2  # [rad]
TOLD = 4  # of so many commands of the prompt, one is told before it is done


@dataclass
class Tally:
    """What a session did."""

    commands: int = 0
    refused: int = 0
    undone: int = 0
    edits: int = 0
    explained: int = 0
    told: int = 0


@dataclass
class Session:
    """One robot at work; `run` gives so many commands."""

    seed: int
    model: RobotModel
    tally: Tally = field(default_factory=Tally)

    def __post_init__(self) -> None:
        self.random = Random(self.seed)
        self._begin()

    def _begin(self) -> None:
        self.engine = Engine(self.model)
        self.edits: list[tuple[Timeline, TimelineDelta]] = []
        self.engine.book.notify = self._note
        self.before = self.engine.timeline
        self.engine.perform(self.profile())
        self.engine.perform(self.rounding())
        self.engine.perform(Move(JointTarget(self._joints(INSIDE)), False))

    def _note(self, deltas: Sequence[TimelineDelta]) -> None:
        (delta,) = deltas
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
        chance = self.random.random()
        if chance < 0.05 and self.engine.book.deltas:
            self._undo()
            return
        if chance < 0.1:
            self.explain()
            return
        before, self.edits = self.engine.timeline, []
        request, program = self.request(), self.random.random() < 0.5
        asked = not program and not self.tally.commands % TOLD
        told = foretold(self.engine, request) if asked else None
        try:
            self.engine.perform(request, program=program)
        except (MotionError, IllegalValue) as error:
            self.tally.refused += 1
            check_refusal(told, error)
            assert self.engine.timeline is before, "a refused motion leaves the timeline as it was"
            return
        if told is not None:
            assert isinstance(told, Engine)
            check_foretold(told, self.engine)
        for old, delta in self.edits:
            self.tally.edits += 1
            self._check(old, delta)
            if len(self.edits) == 1:
                check_splice(self.engine, old, delta)
            if told is not None:
                self.tally.told += 1
                check_plan(self.engine, old, delta)

    def _undo(self) -> None:
        """UNDO, and what it took back again by what the deltas say; REDO as it was, now and then."""
        timeline = self.engine.timeline
        try:
            self.engine.undo()
        except UsageError:  # all is undone
            return
        self.tally.undone += 1
        assert timeline.apply(self.engine.book.deltas[-1]) == self.engine.timeline
        if self.random.random() < 0.3:
            self.engine.redo()
            assert self.engine.timeline == timeline

    def explain(self) -> None:
        """WHY, for a place near by or anywhere."""
        target = self.joints_target() if self.random.random() < 0.2 else self.pose_target(self.random.random() < 0.7)
        before = self.engine.timeline
        check_reach(self.engine, target)
        assert self.engine.timeline is before
        self.tally.explained += 1

    def _check(self, before: Timeline, delta: TimelineDelta) -> None:
        engine = self.engine
        after = engine.timeline
        assert before.apply(delta) == after
        assert after.apply(before.inverse(delta)) == before
        check_edit(before, delta, after)
        check_continuous(engine, edited(delta, after))
        check_limits(engine, delta.segments)
        check_lines(engine, edited(delta, after))
        check_rounding(engine, edited(delta, after))
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
                lambda: SetMode(r.choice((Mode.OVERLAP, Mode.SINGLE)), r.random() < 0.7, always=r.random() < 0.5),
                lambda: SetParameter("INSERT", r.choice(("ON", "ON", "OFF"))),
                self.profile,
                self.rounding,
                lambda: SetParameter("STRETCH", r.uniform(1.0, 50.0)),
                lambda: SetTool(self.tool()),
                lambda: SetBase(
                    compose(translation(0.0, 0.0, r.uniform(-0.1, 0.1)), rotation_z(r.choice((0.0, r.uniform(-1, 1)))))
                ),
                self.configuration,
                lambda: r.choice((Break(), Break(), Brake())),
            )
        )()

    def profile(self) -> Request:
        return SetParameter("PROFILE", self.random.choice(("LSPB", "SCURVE", "SCURVE", "QUINTIC")))

    def rounding(self) -> Request:
        return SetParameter("ROUNDING", self.random.choice(("DECEL", 0.0, self.random.uniform(0.0, 60.0))))

    def configuration(self) -> Request:
        words = self.engine.arm.words
        return SetConfiguration(self.random.choice(words)) if words else Break()

    def tool(self) -> Transform:
        """Along the flange's axis; sometimes beside it, which an arm that does not choose its turn refuses."""
        r = self.random
        beside = r.choice((0.0, 0.0, r.uniform(-0.05, 0.05)))
        return compose(translation(beside, 0.0, r.choice((0.0, r.uniform(0.0, 0.1)))), rotation_z(r.uniform(-1, 1)))

    def move(self) -> Move:
        r = self.random
        stamp = Stamp(self.instant()) if r.random() < 0.6 else None
        straight = r.random() < 0.5
        return Move(self.target(straight), straight, hand=r.choice((None, 0.0, 1.0)), stamp=stamp, text="MOVE")

    def target(self, straight: bool) -> Target:
        r = self.random
        kind = r.random()
        if kind < 0.55:
            return self.pose_target(straight)
        if kind < 0.75:
            return self.joints_target()
        if kind < 0.85:
            return JointOffsetTarget(r.randint(1, self.model.joint_count), r.uniform(-1.0, 1.0))
        if kind < 0.95:
            return ToolOffsetTarget(translation(0.0, 0.0, r.uniform(-0.1, 0.1)))
        return r.choice((AlignedTarget(), NamedTarget("ready"), NamedTarget("nest")))

    def joints_target(self) -> JointTarget:
        return JointTarget(self._joints(0.0))

    def pose_target(self, near: bool) -> PoseTarget:
        """A place that some joints reach, near where the robot ends or anywhere; a few are tilted or somewhere else."""
        r = self.random
        joints = self._joints_near(r.choice(NEAR)) if near else self._joints(0.0)
        pose = self.engine.world_pose(joints)
        other = r.random()
        if other < 0.05:
            pose = compose(pose, rotation_x(r.uniform(-TILT, TILT)))
        elif other < 0.1:
            pose = compose(translation(*(r.uniform(-1.0, 1.0) for _ in range(3))), pose)
        elif other < 0.12:
            pose = from_oat(*(r.uniform(-0.5, 0.5) for _ in range(3)), *(radians(r.uniform(-180, 180)) for _ in "OAT"))
        return PoseTarget(pose)

    def _joints(self, inside: float) -> Joints:
        """Joints in their ranges, so far from both ends."""
        parts = [self.random.uniform(inside, 1.0 - inside) for _ in self.model.lower]
        return tuple(
            low + p * (high - low) for p, low, high in zip(parts, self.model.lower, self.model.upper, strict=True)
        )

    def _joints_near(self, part: float) -> Joints:
        """Joints no farther than a part of their ranges from where the last motion ends."""
        rows = zip(self.engine.destination(self.engine.end).joints, self.model.lower, self.model.upper, strict=True)
        return tuple(min(max(x + self.random.uniform(-part, part) * (high - low), low), high) for x, low, high in rows)

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
