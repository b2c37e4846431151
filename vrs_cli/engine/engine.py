"""The engine: holds tau and the settings of one robot, stamps motion commands and applies what f returns.

Nothing runs here between two requests. Readers of a timeline keep the version they have.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from math import isfinite
from typing import Protocol

from msgspec import Struct, structs

from vrs_cli.engine.clock import Clock, VirtualClock
from vrs_cli.engine.commands import (
    Brake,
    Break,
    Delay,
    JointTarget,
    Mode,
    Move,
    OperateHand,
    PoseTarget,
    Request,
    SetBase,
    SetConfiguration,
    SetParameter,
    SetSpeed,
    SetTool,
    SpeedUnit,
    Stamp,
    ToolOffsetTarget,
)
from vrs_cli.engine.history import CommandRecord, History, Step
from vrs_cli.engine.parameters import FULL_SPEED
from vrs_cli.engine.planner import NoRoomToStop, plan, rounding_begins, slowing_down
from vrs_cli.engine.position import Position, destination_at, joints_at, position_at
from vrs_cli.engine.reach import Reach, explained
from vrs_cli.engine.settings import MM, Settings, checked_time
from vrs_cli.engine.steered import plan_steering
from vrs_cli.engine.targets import (
    Situation,
    check_flag,
    check_joint_count,
    check_joint_limits,
    check_near,
    resolve,
    select,
)
from vrs_cli.errors import IllegalValue, PowerOff, TooLate
from vrs_cli.kinematics.arm import RobotArm, arm_for
from vrs_cli.kinematics.joints import Joints
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform, compose, inverse
from vrs_cli.trajectory.delta import TimelineDelta
from vrs_cli.trajectory.instant import LATEST, on_grid, up_to_grid
from vrs_cli.trajectory.motion import Frames, Kind, Motion, RelativeTarget, Start
from vrs_cli.trajectory.segment import rest
from vrs_cli.trajectory.state import Target
from vrs_cli.trajectory.timeline import Timeline

LONGER = 1.0 + 1e-5  # a tick of steering, so that the next target comes before its end
SLOWEST = 1e-4  # fraction of nominal speed: slower is no motion
INCH = 0.0254  # [m]

DeltaListener = Callable[[TimelineDelta, Timeline], None]


class Journal(Protocol):
    """Where every change is written down before it happens."""

    def record(self, deltas: Sequence[TimelineDelta], *, happens: bool = False) -> None:
        """Raises FileError where it cannot be written, and must not happen then; never for what `happens` anyway."""


class Postponement(Struct, frozen=True):
    """A motion that came too late for its execution time, and what that is now [s]."""

    text: str
    asked: float
    executed: float


class Line(Struct, frozen=True):
    """All that an engine has of one course of events: another may be taken up in its place, and this one again."""

    initial: Timeline
    timeline: Timeline
    deltas: tuple[TimelineDelta, ...]
    history: History
    number: int
    clock: float
    settings: Settings


class Engine:
    """One robot: model, timeline, settings, clock. `deltas` are all changes of the timeline so far.

    `heard`: what happens counts: it goes into the `journal` before, and listeners are told of it after; not so what is
    only tried.
    """

    def __init__(self, model: RobotModel, *, start: Joints | None = None, clock: Clock | None = None) -> None:
        self.model = model
        self.arm: RobotArm = arm_for(model)
        self.clock: Clock = clock or VirtualClock()
        self.settings = Settings().changed(SetParameter("PROFILE", model.profile))
        self.journal: Journal | None = None
        self.listeners: list[DeltaListener] = []
        self.postponed: list[Callable[[Postponement], None]] = []  # they are told of every one
        self.heard = True
        self.begin_timeline(model.poses["ready"] if start is None else start)

    def begin_timeline(self, joints: Joints) -> None:
        """A new timeline: s_0 at time 0 with these joints."""
        initial = Motion(0, Kind.REST, Start.AT)
        self.timeline = Timeline([rest(joints, 0.0, 0.0, initial)])
        self.initial = self.timeline
        self.deltas: list[TimelineDelta] = []
        self.history = History()
        self._number = 0
        self._issued: float | None = None
        self._steered: Motion | None = None  # the motion that the next target of `steer` goes on with
        self.clock.set(0.0)

    # --- reading ---

    @property
    def now(self) -> float:
        return self.clock.now

    @property
    def realtime(self) -> bool:
        """Whether what is before `now` has happened, and stays."""
        return self.clock.realtime

    @property
    def end(self) -> float:
        """When the robot comes to rest for good [s]."""
        return self.timeline.end

    def position(self, t: float | None = None) -> Position:
        """g: where the robot is at t [s], or now."""
        return position_at(self.arm, self.timeline, self.now if t is None else t)

    def destination(self, t: float | None = None) -> Position:
        """Where the motion that is under way at t (now) ends, or where the robot stands."""
        return destination_at(self.arm, self.timeline, self.now if t is None else t)

    @property
    def frames(self) -> Frames:
        """BASE and TOOL in force now."""
        return self.timeline.locate(self.now)[0].motion.frames

    def records(self) -> tuple[CommandRecord, ...]:
        """All motion commands that are not undone, in the order in which they were issued."""
        return self.history.records(self.timeline)

    # --- requests ---

    def perform(self, request: Request, *, program: bool = False) -> None:
        """Do what is asked. From a program motions blend into each other and time goes on only as far as it must; at
        the prompt a motion without a time stamp is over when this returns, unless time is real: then it has begun.

        Raises MotionError, IllegalValue, UsageError, FileError for what cannot be written down.
        """
        self.clock.advance(self.begin(request, program=program))

    def ready_at(self, request: Request, *, program: bool) -> float:
        """The instant [s], now or later, at which a request may be performed: until then its program waits, so that
        what happens in between may still change what it does. Raises IllegalValue for a time stamp."""
        if not program and not self.realtime:
            return self.now
        if isinstance(request, Move):
            if not program:
                return self.now
            return self.now if request.stamp is not None else max(self._begin(request, program)[1], self.now)
        if isinstance(request, Break | SetTool | SetBase) or (program and _stands(request)):
            return max(self.end, self.now)
        return self.now

    def begin(self, request: Request, *, program: bool, issued: float | None = None) -> float:
        """Do what is asked as `perform` does, and leave the clock alone: the instant [s] until which the asker waits.

        `issued`: when it was asked, where that was earlier.
        """
        self._issued = issued
        if isinstance(request, Move):
            return self._move(request, program)
        if isinstance(request, Delay):
            return self._stand(checked_time(request.seconds, "DELAY"), program, text=request.text)
        if isinstance(request, OperateHand):
            return self._operate_hand(request, program)
        if isinstance(request, Break):
            self.wait_for_rest()
        elif isinstance(request, Brake):
            self.stop()
        elif isinstance(request, SetTool):
            self._set_tool(request)
        elif isinstance(request, SetBase):
            self._set_base(request)
        else:
            if isinstance(request, SetConfiguration):
                check_flag(self.arm, request.flag)
            self.settings = self.settings.changed(request)
        return self.now

    def _move(self, move: Move, program: bool) -> float:
        self._check_power()
        start, executed = self._begin(move, program)
        executed = self._in_time(move.text, executed)
        motion = self._motion(move, start, executed)
        if self.settings.moves:
            executed = self._edit(motion, executed).executed
        self.settings = self.settings.after_motion(move.target)
        if move.stamp is not None:
            return self.now
        return self._until(executed, program)

    def _until(self, executed: float, program: bool) -> float:
        """When the asker goes on: at the prompt when the robot stands, or at once where time is real."""
        if program:
            return executed
        return self.now if self.realtime else self.end

    def _check_power(self) -> None:
        if not self.settings.switch("POWER"):
            raise PowerOff("the arm has no power", "ENABLE POWER")

    def _begin(self, move: Move, program: bool) -> tuple[Start, float]:
        """How and when a motion begins."""
        now, end = on_grid(self.now), self.end
        if move.stamp is not None:
            return Start.AT, self._stamped(move.stamp)
        if now >= end:
            return Start.AFTER, now
        slowing = slowing_down(self.timeline)
        if program and slowing and self._may_blend(move):
            return Start.BLEND, max(now, rounding_begins(self.arm, slowing, self.settings.rounding))
        return Start.AFTER, end

    def _stamped(self, stamp: Stamp) -> float:
        t = self.now + stamp.seconds if stamp.relative else stamp.seconds
        if not isfinite(t) or not 0.0 <= t <= LATEST:
            word = "IN" if stamp.relative else "AT"
            right = f"the time of a motion is from 0 to {LATEST:g} s"
            raise IllegalValue(f"{word} {stamp.seconds:g}", right, value=t, lower=0.0, upper=LATEST)
        return on_grid(t)

    def _in_time(self, text: str, executed: float) -> float:
        """When a motion may begin. In real time the past stays as it is: what comes too late is refused, or waits for
        the end of the segment under way (PARAMETER CAUSALITY). Raises TooLate.
        """
        now = on_grid(self.now)
        if not self.realtime or executed >= now:
            return executed
        if self.settings.parameters["CAUSALITY"] == "ABORT":
            raise TooLate(
                f"{text or 'the motion'} was to begin at {executed:.3f} s, and it is {now:.3f} s",
                "give a later time, or IN dt; PARAMETER CAUSALITY = POSTPONE puts it off",
                value=executed,
                lower=now,
            )
        later = max(now, self.timeline[self.timeline.index_at(now)].finish)
        for listener in self.postponed:
            listener(Postponement(text, executed, later))
        return later

    def _may_blend(self, move: Move) -> bool:
        if not (self.settings.switch("CP") and self.settings.mode(Mode.CONTINUOUS_PATH)):
            return False
        return not self._changes_configuration(move)

    def _changes_configuration(self, move: Move) -> bool:
        """Whether a configuration word asks for another configuration than the arm will have."""
        if not isinstance(move.target, PoseTarget | ToolOffsetTarget):
            return False
        have = self.arm.configuration(self.destination(self.end).joints)
        return bool(self.settings.configuration.words_beside((have,)))

    # --- motions ---

    def _motion(self, move: Move, start: Start, executed: float) -> Motion:
        settings = self.settings
        under_way = self.timeline.locate(executed)[0].motion
        wanted = move.hand if move.hand is not None else settings.hand
        goal = resolve(self.arm, settings, move, self._situation(move, start, executed, under_way.frames))
        motion = Motion(
            number=self._number + 1,
            kind=Kind.JOINT if goal.pose is None else Kind.STRAIGHT,
            start=start,
            goal=goal.joints,
            pose=goal.pose,
            acceleration=settings.acceleration,
            duration=on_grid(settings.duration.present),
            hand=under_way.hand if wanted is None else wanted,
            frames=under_way.frames,
            text=move.text,
            relative=move.target if isinstance(move.target, RelativeTarget) else None,
            profile=self.settings.profile,
            rounding=self.settings.rounding if start is Start.BLEND else None,
        )
        return self._at_speed(motion, move)

    def _situation(self, move: Move, start: Start, executed: float, frames: Frames) -> Situation:
        """A motion with a time stamp follows the one that is under way then, another the last one: one that rounds the
        corner there goes to the same joints as one that begins in it.
        """
        before = self.destination(executed if move.stamp is not None else self.end).joints
        here = before if start is Start.BLEND else joints_at(self.arm, self.timeline, executed)
        return Situation(here, before, frames)

    def _at_speed(self, motion: Motion, move: Move) -> Motion:
        """With the speeds that are in force: actual = monitor x program."""
        if move.speed is None:
            return self._at_program_speed(motion, self.settings.speed.present)
        return replace(motion, speed=_fraction(self.settings.monitor_speed / FULL_SPEED * move.speed))

    def _at_program_speed(self, motion: Motion, program: SetSpeed) -> Motion:
        monitor = self.settings.monitor_speed / FULL_SPEED
        if program.unit is SpeedUnit.PERCENT:
            rotation = program.rotation
            return replace(
                motion,
                speed=_fraction(monitor * program.value / FULL_SPEED),
                rotation=None if rotation is None else _fraction(monitor * rotation / FULL_SPEED),
            )
        tip = monitor * program.value * (MM if program.unit is SpeedUnit.MMPS else INCH)
        full = self.model.linear_speed
        fraction = _fraction(tip / full)
        rotation = fraction if program.rotation is None else _fraction(monitor * program.rotation / FULL_SPEED)
        return replace(motion, speed=fraction, tip_speed=min(max(tip, SLOWEST * full), full), rotation=rotation)

    # --- standing still ---

    def _operate_hand(self, request: OperateHand, program: bool) -> float:
        opening = 0.0 if request.opening is None else request.opening
        if not request.immediate:
            self.settings = structs.replace(self.settings, hand=opening)
            return self.now
        self._stand(float(self.settings.parameters["HAND.TIME"]), program, hand=opening, text=request.text)
        return self._until(self.end, program)

    def _stand(
        self,
        seconds: float,
        program: bool,
        *,
        hand: float | None = None,
        frames: Frames | None = None,
        text: str = "",
    ) -> float:
        """A motion of kind REST after the last one; until when the asker waits."""
        executed = max(on_grid(self.now), self.end)
        last = self.timeline.locate(executed)[0].motion
        motion = Motion(
            number=self._number + 1,
            kind=Kind.REST,
            start=Start.AFTER,
            duration=on_grid(seconds),
            hand=last.hand if hand is None else hand,
            frames=frames or last.frames,
            text=text,
            profile=self.settings.profile,
        )
        if self.settings.moves:
            self._edit(motion, executed)
        return self._until(executed, program)

    def wait_for_rest(self) -> None:
        """BREAK: time goes on until the robot stands."""
        self.clock.advance(self.end)

    def stop(self) -> None:
        """ABORT, BRAKE: brake now, within limits, and drop what was scheduled; also if that cannot be written down."""
        now, self._issued = on_grid(self.now), None
        if now < self.end:
            self._edit(self._braking(now), now, False, happens=True)

    def stopping_place(self) -> Joints:
        """Where the robot would come to rest if it braked now [rad]."""
        now = on_grid(self.now)
        if now >= self.end:
            return self.position().joints
        stopped = self.timeline.apply(self._planned(self._braking(now), now, now, False))
        return destination_at(self.arm, stopped, stopped.end).joints

    def _braking(self, now: float) -> Motion:
        last = self.timeline.locate(now)[0].motion
        return Motion(
            self._number + 1,
            Kind.REST,
            Start.AT,
            hand=last.hand,
            frames=last.frames,
            text="BRAKE",
            profile=self.settings.profile,
        )

    # --- targets that come one after the other ---

    def redirect(self, goal: Joints | Transform, *, speed: float = 1.0, text: str = "") -> None:
        """From now on to these joints [rad], joint-interpolated, or on a straight line to T_world_tool, at a fraction
        of full speed; what was scheduled is dropped. Raises PowerOff, JointOutOfRange, MotionError for a line.
        """
        self._check_power()
        if not isinstance(goal, Transform):
            check_joint_limits(self.model, goal)
        self._issued = None
        if self.settings.moves:
            self._edit(self._motion_from_now(goal, speed, text), on_grid(self.now), False)

    def steer(self, target: Target, tick: float, *, speed: float = 1.0, text: str = "STEER") -> None:
        """Chase a target from now on, for a tick [s], until the next one comes (`trajectory.laws`); what was
        scheduled is dropped. Without a next one the robot coasts for a while and brakes.

        Targets that follow each other are one motion, which UNDO takes back as a whole. Of each the timeline keeps what
        the robot did, `deltas` too. A target out of a motion that has no room to stop waits for the next one: that
        motion goes on. Raises PowerOff, JointOutOfRange.
        """
        self._check_power()
        check_joint_limits(self.model, target.joints)
        if not self.settings.moves:
            return
        executed, timeline, self._issued = on_grid(self.now), self.timeline, None
        motion = self._steered_motion(target.joints, speed, text)
        try:
            delta = plan_steering(self.arm, timeline, motion, executed, target, up_to_grid(tick * LONGER))
        except NoRoomToStop:
            return
        self._write_down([delta])
        if motion is self._steered:
            self._continue(delta)
            return
        self.commit(delta, self.now, False)
        self._steered = motion

    def _steered_motion(self, goal: Joints, speed: float, text: str) -> Motion:
        """The motion of the targets before, if this is one more of them."""
        motion = replace(self._motion_from_now(goal, speed, text), kind=Kind.STEERED)
        steered = self._steered
        if steered is not None and replace(motion, number=steered.number, goal=steered.goal) == steered:
            return steered
        return motion

    def _continue(self, delta: TimelineDelta) -> None:
        """Of the target before, `deltas` keeps only what the robot did."""
        before = self.deltas.pop()
        self._apply(delta)
        kept = before.segments[: delta.keep - before.keep]
        self.deltas[-1:] = [
            replace(before, segments=kept),
            replace(delta, drop=delta.drop - len(before.segments) + len(kept)),
        ]

    def _end_steering(self) -> None:
        """The motion is known as a whole: what UNDO takes back is one change."""
        if self._steered is not None:
            self._steered = None
            last = self.history.done[-1]
            rest = tuple(self.timeline[index] for index in range(last.delta.keep, len(self.timeline)))
            self.history.done[-1] = last.longer(rest)

    def _motion_from_now(self, goal: Joints | Transform, speed: float, text: str) -> Motion:
        under_way = self.timeline.locate(on_grid(self.now))[0].motion
        monitor = self.settings.monitor_speed / FULL_SPEED
        motion = Motion(
            number=self._number + 1,
            kind=Kind.JOINT,
            start=Start.AT,
            speed=_fraction(monitor * speed),
            acceleration=self.settings.acceleration,
            hand=under_way.hand,
            frames=under_way.frames,
            text=text,
            profile=self.settings.profile,
        )
        if isinstance(goal, Transform):
            return replace(motion, kind=Kind.STRAIGHT, pose=compose(motion.frames.base, goal))
        return replace(motion, goal=goal)

    # --- changing the timeline ---

    def _edit(
        self, motion: Motion, executed: float, insert: bool | None = None, *, happens: bool = False
    ) -> TimelineDelta:
        """Plan, write down, apply."""
        if insert is None:
            insert = self.settings.inserts
        issued = self.now if self._issued is None else self._issued
        delta = self._planned(motion, issued, executed, insert)
        self._check_end(delta)
        self._write_down([delta], happens=happens)
        self.commit(delta, issued, insert)
        return delta

    def _check_end(self, delta: TimelineDelta) -> None:
        """Raises IllegalValue for a change after which motions end later than times are exact."""
        stays = delta.keep + delta.drop < len(self.timeline)
        end = self.timeline.end + delta.shift if stays else delta.segments[-1].finish if delta.segments else 0.0
        if end > 2.0 * LATEST:
            what = f"{delta.motion.text or 'the motion'} would end at {end:g} s"
            raise IllegalValue(what, f"times are up to {2.0 * LATEST:g} s", value=end, upper=2.0 * LATEST)

    def _planned(self, motion: Motion, issued: float, executed: float, insert: bool) -> TimelineDelta:
        slowest = self.settings.slowest
        return plan(self.arm, self.timeline, motion, on_grid(issued), executed, insert=insert, slowest=slowest)

    def _write_down(self, deltas: Sequence[TimelineDelta], *, happens: bool = False) -> None:
        if self.heard:
            self.record(deltas, happens=happens)

    def record(self, deltas: Sequence[TimelineDelta], *, happens: bool = False) -> None:
        """Write down what is about to happen on main: all of it or, where that raises FileError, nothing. What
        `happens` anyway is no error."""
        if self.journal is not None and deltas:
            self.journal.record(deltas, happens=happens)

    def commit(self, delta: TimelineDelta, clock: float, insert: bool) -> None:
        """A command that was planned for the present timeline, and is written down, takes place; `clock` is what UNDO
        goes back to."""
        self._end_steering()
        self.history.add(Step.of(self.timeline, delta, clock, insert))
        self._number = delta.motion.number
        self._apply(delta)

    def follow(self, deltas: Iterable[TimelineDelta]) -> None:
        """Change the timeline as another course of events did from here on, which is written down; listeners hear of
        it."""
        for delta in deltas:
            self._apply(delta)

    def _apply(self, delta: TimelineDelta) -> None:
        self.timeline = self.timeline.apply(delta)
        self.deltas.append(delta)
        for listener in self.listeners if self.heard else ():
            listener(delta, self.timeline)

    def undo(self, count: int = 1) -> None:
        """Take the last motion commands back, and the clock, unless time is real: all of them or none. Raises
        UsageError where there are not so many, TooLate for one that has begun in real time, FileError.
        """
        self._end_steering()
        steps, version = self.history.last_done(count), self.timeline.version
        for step in steps:
            self._check_not_begun(step.delta)
        deltas = [step.taking_back(version + number) for number, step in enumerate(steps)]
        self._write_down(deltas)
        for step, delta in zip(steps, deltas, strict=True):
            self.history.take_back(self.now)
            self._set_clock(step.clock)
            self._apply(delta)

    def redo(self, count: int = 1) -> None:
        """Do again what `undo` took back last; timeline and clock are as before that: all or none. Raises UsageError,
        TooLate for one whose time has passed in real time, FileError.
        """
        self._end_steering()
        undone, version = self.history.last_undone(count), self.timeline.version
        for one in undone:
            self._check_not_begun(one.step.delta)
        deltas = [one.step.doing_again(version + number) for number, one in enumerate(undone)]
        self._write_down(deltas)
        for one, delta in zip(undone, deltas, strict=True):
            self.history.do_again()
            self._set_clock(one.clock)
            self._apply(delta)

    def _set_clock(self, to: float) -> None:
        if not self.realtime:
            self.clock.set(to)

    def _check_not_begun(self, delta: TimelineDelta) -> None:
        """Raises TooLate for a change whose time has come, where time is real."""
        if self.realtime and delta.cut < on_grid(self.now):
            raise TooLate(
                f"{delta.motion.text or 'the last motion'} has begun at {delta.executed:.3f} s, and the past stays",
                "ABORT stops the motion; another one IN 0 takes its place",
            )

    # --- other courses of events ---

    def line(self) -> Line:
        """The present course of events, to be taken up again."""
        self._end_steering()
        return Line(
            self.initial,
            self.timeline,
            tuple(self.deltas),
            self.history.copy(),
            self._number,
            self.now,
            self.settings,
        )

    def take(self, line: Line, *, heard: bool) -> None:
        """Take up a course of events where it was left; the robot is where it was then."""
        self._steered = None
        self.initial, self.timeline, self.deltas = line.initial, line.timeline, list(line.deltas)
        self.history, self._number = line.history.copy(), line.number
        self.settings, self.heard = line.settings, heard
        self.clock.set(line.clock)

    # --- BASE and TOOL ---

    def _set_tool(self, request: SetTool) -> None:
        check_near(request.T_flange_tool, "TOOL")
        self.arm.check_tool(request.T_flange_tool)
        self._set_frames(replace(self._frames_at_rest(), tool=request.T_flange_tool), "TOOL")

    def _set_base(self, request: SetBase) -> None:
        check_near(request.T_robot_world, "BASE")
        self._set_frames(replace(self._frames_at_rest(), base=request.T_robot_world), "BASE")

    def _frames_at_rest(self) -> Frames:
        self.wait_for_rest()
        return self.frames

    def _set_frames(self, frames: Frames, text: str) -> None:
        if frames != self.frames:
            self.clock.advance(self._stand(0.0, True, frames=frames, text=text))

    # --- what is in reach ---

    def world_pose(self, joints: Joints) -> Transform:
        """T_world_tool of joints, with the BASE and TOOL in force."""
        frames = self.frames
        return compose(inverse(frames.base), compose(self.arm.forward(joints), frames.tool))

    def joints_for(self, T_world_tool: Transform, near: Joints | None = None) -> Joints:
        """The joints that a MOVE there from here, or from joints `near`, would end in.

        Raises LocationOutOfRange, JointOutOfRange.
        """
        pose = compose(self.frames.base, T_world_tool)
        near = self.position().joints if near is None else near
        return select(self.arm, self.settings, pose, self.frames, near)

    def explain(self, target: PoseTarget | JointTarget) -> Reach:
        """Why a MOVE or MOVES to a target from here is possible or not.

        Raises IllegalValue for the joints of another robot.
        """
        here = self.position().joints
        if isinstance(target, JointTarget):
            check_joint_count(self.model, target.joints)
        line = Motion(
            self._number + 1,
            Kind.STRAIGHT,
            Start.AT,
            acceleration=self.settings.acceleration,
            frames=self.frames,
            profile=self.settings.profile,
        )
        duration, speed = self.settings.duration, self.settings.speed
        first = self._at_program_speed(replace(line, duration=on_grid(duration.present)), speed.present)
        later = self._at_program_speed(replace(line, duration=on_grid(duration.always)), speed.always)
        return explained(self.arm, self.settings, target, here, (first, later))


def _stands(request: Request) -> bool:
    return isinstance(request, Delay) or (isinstance(request, OperateHand) and request.immediate)


def _fraction(speed: float) -> float:
    """A fraction of nominal speed: never above it, never so slow that it would be none."""
    return min(max(speed, SLOWEST), 1.0)
