"""The engine: one robot with its book (recorded history), settings and clock. The engine gives motion commands their
times and commits the changes that the planner f returns. Nothing runs between two requests. Readers of a timeline keep
their version.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import cached_property
from math import ceil
from operator import is_not
from typing import TYPE_CHECKING

from msgspec import Struct, structs

from vrs_cli.engine import targets
from vrs_cli.engine.book import Book, Parts, silent, whole
from vrs_cli.engine.clock import RobotClock, VirtualClock
from vrs_cli.engine.feed import Feed, TimelineReplaced
from vrs_cli.engine.history import History, HistoryStep, begins
from vrs_cli.engine.planner import RESYNC, plan, plan_resync
from vrs_cli.engine.position import destination_at, finish_after, joints_at, position_at, positions_at, world_pose
from vrs_cli.engine.problem import NoRoomToStop
from vrs_cli.engine.settings import DELAY, TIME, TIME_FROM_NOW, Altered, Settings
from vrs_cli.engine.single_motion import rounding_begins, slowing_segments
from vrs_cli.errors import AlterNotOn, IllegalValue, LocationOutOfRange, LocationTooFar, MotionError, PowerOff, TooLate
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.kinematics.joints import Configuration, Joints, Profile
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import Transform, angle_between, at_position, compose, length, position, scaled_vector
from vrs_cli.trajectory.instant import LATEST, on_grid, up_to_grid
from vrs_cli.trajectory.laws.law import LAWS
from vrs_cli.trajectory.state import Target
from vrs_cli.trajectory.timeline import Cause, Timeline, TimelineDelta
from vrs_cli.values import commands
from vrs_cli.values.commands import (
    HAND,
    Event,
    EventEdit,
    Motion,
    MotionKind,
    Move,
    OperateHand,
    PoseTarget,
    SetBase,
    SetTool,
    Start,
)
from vrs_cli.values.results import FollowReport, Position, ResyncReport

if TYPE_CHECKING:
    from vrs_cli.engine.reach import Standpoint
    from vrs_cli.engine.steering import Chunk
    from vrs_cli.trajectory.measured import MeasuredRecord
    from vrs_cli.values.reports import Reach

MIN_REPORTED_TURN = 0.01  # [rad] a larger difference from the requested turn of the tool is reported
HAND_WIDTH_ROUNDING = 1e-6  # [m] tolerance for rounding in the width of a hand
TICK_MARGIN = 1.0 + 1e-5  # factor that lengthens a steering tick, so that the next target arrives before the tick ends

TimelineChange = TimelineDelta | TimelineReplaced  # a change of the timeline, or its replacement by another


class Postponement(Struct, frozen=True):
    """A motion that came too late for the time `asked` [s], and its new execution time `executed` [s]."""

    text: str
    asked: float
    executed: float

    @property
    def sentence(self) -> str:
        return f"{self.text or 'the motion'} is postponed from {self.asked:.3f} to {self.executed:.3f} s"


class ToolTurning(Struct, frozen=True):
    """The `angle` [rad] by which the orientation of the tool differs from the requested one, after a motion of an arm
    that cannot reach every orientation. `text`: the command as a string.
    """

    text: str
    angle: float


class Bookmark(Struct, frozen=True):
    """A saved state of an engine: its book, settings and clock [s]."""

    book: Book
    settings: Settings
    clock: float


class Engine:
    """One robot. `events`: the feed of all changes of the timeline, and of timelines that replace another. `measured`:
    the reports of the body (the real or simulated arm that executes the motions), which UNDO and branches do not
    change.
    """

    def __init__(self, model: RobotModel, *, start: Joints | None = None, clock: RobotClock | None = None) -> None:
        self.model = model
        self.arm: RobotArm = arm_for(model)
        self.clock: RobotClock = clock or VirtualClock()
        self.clock.set(0.0)
        self.settings = Settings().after(commands.SetParameter("PROFILE", model.profile))
        self.events: Feed[TimelineChange] = Feed(lambda: TimelineReplaced(self.timeline, self.settings))
        self.postponed: list[Callable[[Postponement], None]] = []  # functions called for each postponed motion
        self.checks: list[Callable[[Timeline, TimelineDelta, Settings], None]] = []  # functions that may refuse changes
        # functions called if the tool cannot have the requested orientation
        self.turned: list[Callable[[ToolTurning], None]] = []
        self.book = Book.at(model.poses["ready"] if start is None else start)
        self.book.notify = self.events.publish
        self._rounding: tuple[Move, Timeline, Settings, float | None] | None = None

    def __repr__(self) -> str:
        return f"<Engine of {self.model.name} at {self.now:.3f} s: {self.timeline!r}>"

    # --- reading ---

    @cached_property
    def measured(self) -> MeasuredRecord:
        from vrs_cli.trajectory.measured import MeasuredRecord

        return MeasuredRecord(self.model.joint_count)

    @property
    def now(self) -> float:
        return self.clock.now

    @property
    def realtime(self) -> bool:
        """Return whether times before `now` are past and cannot be changed."""
        return self.clock.realtime

    @property
    def timeline(self) -> Timeline:
        return self.book.timeline

    @property
    def end(self) -> float:
        """Return when the last motion ends [s]."""
        return self.book.timeline.end

    def position(self, t: float | None = None) -> Position:
        """Return the position of the robot at t [s], by default now: the function g."""
        return position_at(self.arm, self.timeline, self.now if t is None else t)

    def destination(self, t: float | None = None) -> Position:
        """Return the position at the end of the motion in progress at t [s] (default: now), or the current position of
        a robot at rest.
        """
        return destination_at(self.arm, self.timeline, self.now if t is None else t)

    @property
    def frames(self) -> commands.Frames:
        """The current BASE and TOOL."""
        return self._motion_at(self.now).frames

    def _motion_at(self, t: float) -> Motion:
        return self.timeline.locate(t)[0].motion

    # --- requests ---

    def perform(self, request: commands.Request, *, program: bool = False) -> None:
        """Perform a request. From a program motions blend into each other, and the clock advances only as far as
        necessary. A motion without a time stamp that is given at the prompt has ended when this method returns; in real
        time, it has begun.

        Raises MotionError, IllegalValue, UsageError, and FileError if the change cannot be written to the journal.
        """
        self.clock.advance(self.begin(request, program=program))

    def ready_at(self, request: commands.Request, *, program: bool) -> float:
        """Return the instant [s], now or later, at which a request may be performed. A program waits until then, so
        that events before that instant can still change the effect of the request.
        """
        if not program and not self.realtime:
            return self.now
        if isinstance(request, Move):
            waits = program and request.stamp is None
            return max(self._start_of(request, program)[1], self.now) if waits else self.now
        needs_rest = isinstance(request, commands.Delay) or (isinstance(request, OperateHand) and request.immediate)
        if isinstance(request, commands.Break | SetTool | SetBase) or (program and needs_rest):
            return max(self.end, self.now)
        return self.now

    def begin(self, request: commands.Request, *, program: bool, issued: float | None = None) -> float:
        """Perform a request like `perform`, but do not advance the clock. Return the instant [s] until which the caller
        must wait.

        `issued`: when the request was made [s], if that was earlier than now.
        """
        match request:
            case Move(target=PoseTarget(T_world_tool=place)):
                try:
                    return self._move(request, program, issued)
                except LocationOutOfRange as refusal:
                    raise targets.naming_null(refusal, compose(self.frames.base, place)) from None
            case Move(target=commands.ToolOffsetTarget(T_destination_target=offset)):
                try:
                    return self._move(request, program, issued)
                except LocationTooFar as refusal:
                    raise self._naming_farthest(refusal, request, offset) from None
            case Move():
                return self._move(request, program, issued)
            case commands.Alter():
                self._alter(request, issued)
            case commands.Delay():
                return self._until(self._stand(issued, request.text, DELAY.check(request.seconds)), program)
            case OperateHand(stamp=commands.Stamp()):
                opening = self._opening(request.opening, request.width)
                if self.settings.moves:
                    changes, seconds = ((HAND, opening),), self._hand_time
                    self._set_channels(
                        commands.SetChannels(changes, request.stamp, request.text, duration=seconds), issued
                    )
            case OperateHand(immediate=True):
                seconds = self._hand_time
                event = self._hand_event(self._opening(request.opening, request.width), seconds)
                self._stand(issued, request.text, seconds, event=event)
                return self._until(self.end, program)
            case OperateHand():
                hand = self._opening(request.opening, request.width)
                self.settings = structs.replace(self.settings, hand=hand)
            case commands.SetChannels():
                self._set_channels(request, issued)
            case SetTool() | SetBase():
                self._set_frames(request, issued)
            case commands.Break():
                self.clock.advance(self.end)
            case commands.Brake():
                self.stop()
            case _:
                if isinstance(request, commands.SetConfiguration):
                    targets.check_flag(self.arm, request.flag)
                elif isinstance(request, commands.SetSwivel):
                    targets.check_swivel(self.arm, request.swivel)
                self.settings = self.settings.after(request)
        return self.now

    def _move(self, move: Move, program: bool, issued: float | None) -> float:
        """Plan and commit a motion; return the instant [s] until which the caller must wait."""
        self._check_power()
        start, executed = self._start_of(move, program)
        now = on_grid(self.now)
        if self.realtime and executed < now:  # times before now cannot be changed
            later = max(now, self.timeline[self.timeline.index_at(now)].finish)
            executed = self._postpone(move.text or "the motion", executed, later)
        altered = self.settings.alter
        if altered is not None and isinstance(move.target, PoseTarget):
            nominal = move.target.T_world_tool
            move = structs.replace(move, target=PoseTarget(altered.place(nominal)))
            altered = structs.replace(altered, number=self.book.number + 1, nominal=nominal)
        motion = self._motion(move, start, executed)
        if altered is not None:
            self.settings = structs.replace(self.settings, alter=altered)
        if self.settings.moves:
            hand = self.settings.hand if move.hand is None else self._opening(move.hand)
            event = None if hand is None else self._hand_event(hand)
            executed = self._edit(motion, executed, self.settings.inserts, issued, event=event).executed
            if self.arm.steady is not None and isinstance(move.target, PoseTarget):
                angle = angle_between(self.destination(executed).T_world_tool, move.target.T_world_tool)
                for notify in tuple(self.turned) if angle > MIN_REPORTED_TURN else ():
                    notify(ToolTurning(move.text, angle))
        self.settings = self.settings.after_motion(move.target)
        if move.stamp is not None:
            return self.now
        return self._until(executed, program)

    def _postpone(self, text: str, executed: float, later: float) -> float:
        """Postpone a motion or event that came too late for its time `executed` [s], call the listeners, and return the
        new time `later`. Raises TooLate if CAUSALITY forbids postponing.
        """
        now = on_grid(self.now)
        if self.settings.parameters["CAUSALITY"] == "ABORT":
            raise TooLate(
                f"{text} was to begin at {executed:.3f} s, and it is {now:.3f} s",
                "give a later time, {AT t} or {IN dt}; {PARAMETER CAUSALITY = POSTPONE} puts it off",
                value=executed,
                lower=now,
            )
        for listener in self.postponed:
            listener(Postponement(text, executed, later))
        return later

    def _alter(self, alter: commands.Alter, issued: float | None) -> None:
        """Re-plan the current motion (at rest: a straight line) to the displaced target, starting now, as an inserted
        motion. Raises AlterNotOn, PowerOff, and the errors of a motion.
        """
        altered = self.settings.alter
        if altered is None:
            raise AlterNotOn(alter.text, "ALTON comes first")
        self._check_power()
        altered, now = altered.with_more(alter.displacement), on_grid(self.now)
        before, at_rest = self._motion_at(now), now >= self.end
        if altered.number != before.number:
            place = self.position(now) if at_rest else self.destination(now)
            altered = structs.replace(altered, nominal=place.T_world_tool)
        target = altered.place(altered.nominal)
        goal: Joints | Transform = compose(self.frames.base, target)
        if before.kind is MotionKind.JOINT and not at_rest:
            goal = self.joints_for(target, self.destination(now).joints)
        speed = targets.program_speed(self.settings.speed.always, self.settings, self.model)
        if not at_rest:
            speed = targets.Speed(before.speed, before.tip_speed, before.rotation)
        targets.check_near(target, "{} from the robot", LocationTooFar)
        motion = self._after(now).motion(Start.AT, goal, speed, text=alter.text)
        self.settings = structs.replace(self.settings, alter=structs.replace(altered, number=motion.number))
        if self.settings.moves:
            self._edit(motion, now, self.settings.inserts, issued)

    def _until(self, executed: float, program: bool) -> float:
        """Return the time [s] until which the caller waits: for a program the start of the motion, at the prompt the
        time at which the robot has stopped. In real time the caller does not wait.
        """
        if program:
            return executed
        return self.now if self.realtime else self.end

    def _check_power(self) -> None:
        if not self.settings.switch("POWER"):
            raise PowerOff("the arm has no power", "{ENABLE POWER}")

    def _start_of(self, move: Move, program: bool) -> tuple[Start, float]:
        """Return how a motion begins (`Start`), and when [s]."""
        now, end = on_grid(self.now), self.end
        if move.stamp is not None:
            return Start.AT, self._time_of(move.stamp)
        if now >= end:
            return Start.AFTER, now
        rounds = self._rounding_begins(move) if program else None
        return (Start.AFTER, end) if rounds is None else (Start.BLEND, max(now, rounds))

    def _rounding_begins(self, move: Move) -> float | None:
        """Return when a motion may begin to round the corner between the last motion and itself [s]. None if it begins
        at rest: the last motion does not slow down, continuous path is off, or configuration words ask for another
        configuration. The result is cached, since a program needs it while it waits for the motion and again when the
        motion begins.
        """
        timeline, settings = self.timeline, self.settings
        if self._rounding is None or any(map(is_not, self._rounding, (move, timeline, settings))):
            slowing, asked = slowing_segments(timeline), settings.configuration
            blends = slowing and settings.switch("CP") and settings.mode(commands.Mode.CONTINUOUS_PATH)
            if blends and any(asked.flags) and isinstance(move.target, PoseTarget | commands.ToolOffsetTarget):
                blends = not asked.words_beside((self.arm.configuration(joints_at(self.arm, timeline, self.end)),))
            begins = rounding_begins(self.arm, slowing, settings.rounding) if blends else None
            self._rounding = move, timeline, settings, begins
        return self._rounding[3]

    def _time_of(self, stamp: commands.Stamp) -> float:
        """Return the time that a stamp names [s]. Raises IllegalValue."""
        seconds, known = stamp.seconds, TIME
        if stamp.relative:
            seconds, known = self.now + seconds, TIME_FROM_NOW
        return on_grid(known.check(seconds, given=stamp.seconds))

    def _motion(self, move: Move, start: Start, executed: float) -> Motion:
        """Make the motion for a request.

        A motion with a time stamp follows the motion in progress at that time; any other motion follows the last
        motion. A motion that rounds a corner has the same goal joints as a motion that starts from rest in the corner.
        """
        settings, arm, timeline = self.settings, self.arm, self.timeline
        before = joints_at(arm, timeline, finish_after(timeline, executed if move.stamp is not None else self.end))
        here = before if start is Start.BLEND else joints_at(arm, timeline, executed)
        if move.speed is None:
            speed = targets.program_speed(settings.speed.present, settings, self.model)
        else:
            speed = targets.fraction_of_full(move.speed, settings)
        after = self._after(executed)
        return after.motion(
            start,
            targets.resolve(arm, settings, move, after.before.frames, here, before),
            speed,
            duration=settings.duration.present,
            text=move.text,
            relative=move.target if isinstance(move.target, commands.RelativeTarget) else None,
        )

    def _naming_farthest(self, refusal: LocationTooFar, move: Move, offset: Transform) -> LocationTooFar:
        """Return the error for a DEPART that is out of reach. Its hint names the greatest distance within reach, in
        whole millimetres.
        """
        asked = 1000.0 * length(position(offset))
        near, far = 0, ceil(asked)
        while far - near > 1:
            middle = (near + far) // 2
            shorter = at_position(offset, *scaled_vector(position(offset), middle / asked))
            try:
                self.trial(structs.replace(move, target=commands.ToolOffsetTarget(shorter)))
                near = middle
            except MotionError:
                far = middle
        return refusal.reworded(hint=f"at most {near} mm in this direction") if near else refusal

    def _after(self, t: float) -> targets.After:
        """Return what the planning of a new motion at t [s] needs: the motion before it, its number, and the
        settings.
        """
        return targets.After(self._motion_at(t), self.book.number + 1, self.settings)

    def _opening(self, opening: float | None, width: float | None = None) -> float:
        """Return the opening of the hand for a request: 1 open, 0 closed. A closing hand stops at the width of the part
        that it grasps, which the parameter GRASP.WIDTH gives. Raises IllegalValue for a width [m] beyond the range of
        the fingers.
        """
        widest = self.model.hand_width
        if not widest:
            return opening or 0.0
        if width is not None and not 0.0 <= width <= widest + HAND_WIDTH_ROUNDING:
            raise IllegalValue(f"a hand {1000.0 * width:g} mm wide", f"it opens from 0 to {1000.0 * widest:g} mm")
        wanted = (opening or 0.0) if width is None else min(width / widest, 1.0)
        held = min(float(self.settings.parameters["GRASP.WIDTH"]) / 1000.0 / widest, 1.0)
        return wanted if opening else max(wanted, held)

    @property
    def _hand_time(self) -> float:
        """Return how long a motion of the fingers takes [s]."""
        return on_grid(float(self.settings.parameters["HAND.TIME"]))

    def _hand_event(self, opening: float, duration: float = 0.0) -> Event:
        """Make the event of the hand that takes place at the start of the next command."""
        return Event(0.0, HAND, opening, self.book.number + 1, tied=True, duration=duration)

    # --- dated events ---

    def _set_channels(self, it: commands.SetChannels, issued: float | None) -> None:
        """Put events on the timeline: now, tied to its motions, or at the time of a stamp. Events without the text of a
        command, and observations, are recorded but do not count as commands. Raises TooLate, as for a motion.
        """
        now, number = on_grid(self.now), self.book.number + 1
        tied = it.stamp is None
        t = now if it.stamp is None else self._time_of(it.stamp)
        if self.realtime and t < now:
            t = self._postpone(it.text or "an event", t, now)
        timeline, duration = self.timeline, it.duration
        events = [Event(t, *change, number, tied, duration, it.observed) for change in it.changes]
        kind = MotionKind.RECORDED if it.observed or not it.text else MotionKind.EVENT
        delta = TimelineDelta(
            version=timeline.version,
            cause=Cause.COMMAND,
            motion=Motion(number, kind, Start.AFTER if tied else Start.AT, text=it.text),
            issued=now if issued is None else on_grid(issued),
            executed=t,
            cut=timeline.end,
            keep=len(timeline),
            drop=0,
            shift=0.0,
            segments=(),
            events=EventEdit(timeline.events_by(t), events=tuple(events)),
        )
        if kind is MotionKind.EVENT:
            self.check(self.timeline, delta)
        self.book.commit([HistoryStep.of(timeline, delta, self.now, insert=True, altered=self.settings.alter)])

    def check(self, timeline: Timeline, delta: TimelineDelta, settings: Settings | None = None) -> None:
        """Run all `checks` on a change of a timeline before the change is made, with the current settings or the given
        ones. Raises the errors of the checks.
        """
        for check in self.checks:
            check(timeline, delta, settings or self.settings)

    # --- the robot at rest ---

    def _stand(
        self,
        issued: float | None,
        text: str,
        seconds: float = 0.0,
        event: Event | None = None,
        frames: commands.Frames | None = None,
    ) -> float:
        """Add a stop after the last motion; return its start time [s]."""
        executed = max(on_grid(self.now), self.end)
        motion = self._after(executed).motion(Start.AFTER, duration=seconds, frames=frames, text=text)
        if self.settings.moves:
            self._edit(motion, executed, self.settings.inserts, issued, event=event)
        return executed

    def _set_frames(self, request: SetTool | SetBase, issued: float | None) -> None:
        """Change TOOL or BASE as soon as the robot has stopped."""
        text, T = ("TOOL", request.T_flange_tool) if isinstance(request, SetTool) else ("BASE", request.T_robot_world)
        targets.check_near(T, text + " {} away")
        if text == "TOOL":
            self.arm.check_tool(T)
        self.clock.advance(self.end)
        frames = structs.replace(self.frames, **{text.lower(): T})
        if frames != self.frames:
            self.clock.advance(self._stand(issued, text, frames=frames))

    def stop(self) -> None:
        """Brake now (ABORT, BRAKE), within limits, and drop all scheduled motions, even if the change cannot be written
        to the journal.
        """
        now = on_grid(self.now)
        if now < self.end:
            self._edit(self._after(now).motion(Start.AT, text="BRAKE"), now, insert=False, happens=True)

    def stopping_place(self) -> Joints:
        """Return the joints [rad] at which the robot would come to rest if it braked now."""
        now = on_grid(self.now)
        if now >= self.end:
            return self.position().joints
        braking = self._after(now).motion(Start.AT, text="BRAKE")
        stopped = self.timeline.apply(self._plan_change(braking, now, now, insert=False))
        return destination_at(self.arm, stopped, stopped.end).joints

    def resync(
        self, measured: Joints, *, stops: bool = False, leaves: float = 0.0, issued: float | None = None
    ) -> ResyncReport:
        """Move to the measured joints [rad, m], starting now (RESYNC), and from there to the previous goal; with
        `stops`, stay at the measured joints.

        RESYNC is a single command, also in the journal. In virtual time the clock advances to its end. `leaves`: the
        earliest time [s] at which the robot leaves the measured joints. Raises PowerOff, MotionError, and the errors of
        the `checks`; with `stops` the checks are skipped, since the real arm does not move.
        """
        if not stops:
            self._check_power()
        now = on_grid(self.now)
        sent = now if issued is None else on_grid(issued)
        resting = self._after(now).motion(
            Start.AT,
            measured,
            targets.program_speed(self.settings.speed.always, self.settings, self.model),
            text=RESYNC,
        )
        delta, report = plan_resync(
            self.arm,
            self.timeline,
            measured,
            resting,
            (sent, now),
            leaves,
            stops=stops,
            slowest=self.settings.slowest,
        )
        if not stops:
            self.check(self.timeline, delta)
        self.book.commit([HistoryStep.of(self.timeline, delta, sent, not stops, self.settings.alter)])
        if not self.realtime:
            self.clock.advance(self.end)
        return report

    # --- streams of targets ---

    def redirect(self, goal: Joints | Transform, *, speed: float = 1.0, text: str = "") -> None:
        """Move to these joints [rad], joint-interpolated, or on a straight line to the pose T_world_tool, starting now,
        at a fraction of full speed. Scheduled motions are dropped. Raises PowerOff, JointOutOfRange, or MotionError for
        a straight line.
        """
        self._check_power()
        if not isinstance(goal, Transform):
            targets.check_joint_limits(self.model, goal)
        if self.settings.moves:
            self._edit(self._motion_from_now(goal, speed, text), on_grid(self.now), insert=False)

    def steer(
        self, target: Target, tick: float, *, speed: float = 1.0, text: str = "STEER", issued: float | None = None
    ) -> None:
        """Move towards a target for a tick [s], starting now, until the next target arrives (`Law.steer`). Scheduled
        motions are dropped. If no other target comes, the robot coasts for a while and brakes.

        Successive targets are one motion, which UNDO takes back as a whole. `issued`: when the first target was given
        [s], if that was earlier than now. The timeline and `deltas` keep only what the robot did for each target. If
        the motion in progress has no room to stop, it continues, and the target is dropped. Raises PowerOff,
        JointOutOfRange.
        """
        from vrs_cli.engine.steering import plan_steering

        self._check_power()
        targets.check_joint_limits(self.model, target.joints)
        if not self.settings.moves:
            return
        motion, stream = (
            structs.replace(self._motion_from_now(target.joints, speed, text), kind=MotionKind.STEERED),
            self.book.stream,
        )
        if stream is not None and structs.replace(motion, number=stream.number, goal=stream.goal) == stream:
            motion = stream  # the target continues the current stream
        executed, lasting = on_grid(self.now), up_to_grid(tick * TICK_MARGIN)
        try:
            delta = plan_steering(self.arm, self.timeline, motion, executed, target, lasting)
        except NoRoomToStop:
            return
        self.check(self.timeline, delta)
        if motion is stream:
            self.book.prolong(delta)
        else:
            delta = structs.replace(delta, issued=executed if issued is None else on_grid(issued))
            self.book.commit([HistoryStep.of(self.timeline, delta, self.now, insert=False)])

    def follow(
        self, chunk: Chunk, *, speed: float = 1.0, text: str = "FOLLOW", issued: float | None = None
    ) -> Parts[FollowReport]:
        """Follow a chunk (time-stamped joint samples) within the limits of velocity, acceleration and jerk, and come to
        rest at its last sample. Everything after the first sample's time is replaced. In real time samples before now
        are skipped. In virtual time the clock advances to the end.

        Each chunk is one command, which UNDO takes back. A chunk is planned and started part by part, as long as
        nothing else changes the timeline; if COLLISION may refuse the chunk, it is planned as a whole. Raises PowerOff,
        TooLate, MotionError.
        """
        from vrs_cli.engine.steering import SAMPLES_AT_ONCE

        self._check_power()
        begin, late = chunk.since(self.now if self.realtime else self.timeline.start)
        begin = up_to_grid(begin)
        motion = self._after(begin).motion(
            Start.AT, tuple(chunk.joints[-1].tolist()), targets.fraction_of_full(speed, self.settings), text=text
        )
        profile = motion.profile if LAWS[motion.profile].smooth else Profile.SCURVE
        motion = structs.replace(motion, kind=MotionKind.STEERED, profile=profile)
        if self.settings.moves:
            yield from self._chase(chunk, motion, begin, on_grid(self.now if issued is None else issued))
        if not self.realtime:
            self.clock.advance(self.end)
        # measure how far the timeline differs from the chunk since `begin`, part by part
        timeline, end, errors = self.timeline, self.end, list[list[float]]()
        for first in range(late, len(chunk.times), SAMPLES_AT_ONCE):
            yield
            part = slice(first, first + SAMPLES_AT_ONCE)
            errors += abs(positions_at(self.arm, timeline, chunk.times[part]).joints - chunk.joints[part]).tolist()
        columns = list(zip(*errors, strict=True))
        mean, worst = tuple(sum(column) / len(column) for column in columns), tuple(map(max, columns))
        return FollowReport(begin, end, late, chunk.held, mean, worst)

    def _chase(self, chunk: Chunk, motion: Motion, begin: float, issued: float) -> Parts[None]:
        """Plan and commit a chunk part by part: the first part is a new command, the others prolong it."""
        from vrs_cli.engine.steering import TICK, TICKS_AT_ONCE, plan_chunk, tick_count

        count, begun, next = tick_count(chunk, begin), False, 0
        while next < count:
            ticks = range(next, count if self.settings.switch("COLLISION") else min(next + TICKS_AT_ONCE, count))
            timeline, next = self.timeline, ticks.stop
            with suppress(NoRoomToStop):
                delta = plan_chunk(self.arm, timeline, motion, issued, begin, chunk, ticks)
                self.check(timeline, delta)
                if begun:
                    self.book.prolong(delta)
                else:
                    self.book.commit([HistoryStep.of(timeline, delta, self.now, insert=False)])
                begun = True
            if next < count:
                version = self.timeline.version
                yield
                if self.timeline.version != version:
                    raise MotionError("the motion was changed while the chunk was planned", "send another chunk")
                if self.realtime:  # in real time the past cannot be changed
                    next = max(next, min(ceil((self.now - begin) / TICK), count - 1))
        if not begun:
            raise MotionError("the motion under way has no room to give way", "send samples for later")

    def _motion_from_now(self, goal: Joints | Transform, speed: float, text: str) -> Motion:
        """Make a motion that begins now and goes to joints [rad] or to the pose T_world_tool."""
        now = on_grid(self.now)
        where = compose(self._motion_at(now).frames.base, goal) if isinstance(goal, Transform) else goal
        return self._after(now).motion(Start.AT, where, targets.fraction_of_full(speed, self.settings), text=text)

    # --- changing the timeline ---

    def _edit(
        self,
        motion: Motion,
        executed: float,
        insert: bool,
        issued: float | None = None,
        *,
        happens: bool = False,
        event: Event | None = None,
    ) -> TimelineDelta:
        """Plan a motion with its event, and commit the change. Raises IllegalValue if a motion would end after the
        latest exact time, and the errors of the `checks` unless the change `happens` in any case.
        """
        issued = self.now if issued is None else issued
        delta = self._plan_change(motion, issued, executed, insert=insert, event=event)
        stays = delta.keep + delta.drop < len(self.timeline)
        end = self.end + delta.shift if stays else delta.segments[-1].finish if delta.segments else 0.0
        if end > 2.0 * LATEST:
            what = f"{delta.motion.text or 'the motion'} would end at {end:g} s"
            raise IllegalValue(what, f"times are up to {2.0 * LATEST:g} s", value=end, upper=2.0 * LATEST)
        if not happens:
            self.check(self.timeline, delta)
        self.book.commit([HistoryStep.of(self.timeline, delta, issued, insert, self.settings.alter)], happens=happens)
        return delta

    def _plan_change(
        self, motion: Motion, issued: float, executed: float, *, insert: bool, event: Event | None = None
    ) -> TimelineDelta:
        arm, timeline, slowest = self.arm, self.timeline, self.settings.slowest
        return plan(arm, timeline, motion, on_grid(issued), executed, insert=insert, slowest=slowest, event=event)

    def undo(self, count: int = 1) -> tuple[str, ...]:
        """Undo the last `count` motion commands, all of them or none, and set the clock back unless time is real.
        Return the commands as strings, the last command first. Raises UsageError if there are fewer commands, TooLate
        for a command that has begun in real time, FileError.
        """
        return whole(self.undo_in_parts(count))

    def undo_in_parts(self, count: int) -> Parts[tuple[str, ...]]:
        """Do `undo` in parts. Also raises RequestRefused, if the robot was stopped between two parts."""
        stay = self.realtime
        steps = self.book.history.last_done(count, leaves_recorded=stay)
        return self._through_history(steps, self.book.undo(count, lambda: self.now, leaves_recorded=stay))

    def redo(self, count: int = 1) -> tuple[str, ...]:
        """Repeat the last `count` commands that `undo` took back, all of them or none. Timeline and clock are then as
        before the undo. Return the commands as strings. Raises UsageError, TooLate for a command whose time has passed
        in real time, FileError, and the errors of the `checks`.
        """
        return whole(self.redo_in_parts(count))

    def redo_in_parts(self, count: int) -> Parts[tuple[str, ...]]:
        """Do `redo` in parts. Also raises RequestRefused, if the robot was stopped between two parts."""
        steps = [one.step for one in self.book.history.last_undone(count)]
        return self._through_history(steps, self.book.redo(count, self.check if self.checks else None))

    def _through_history(self, steps: Iterable[HistoryStep], change: Parts[float]) -> Parts[tuple[str, ...]]:
        """Make the change of an UNDO or REDO part by part, then set the clock and ALTER to match. Return the commands
        as strings.
        """
        deltas = [step.delta for step in steps]
        while True:
            for delta in deltas:
                if self.realtime and begins(delta) < on_grid(self.now):
                    text = delta.motion.text or "the last motion"
                    raise TooLate(
                        f"{text} has begun at {delta.executed:.3f} s, and the past stays",
                        "{ABORT} stops the motion; another one {IN 0} takes its place",
                    )
            try:
                next(change)
            except StopIteration as over:
                clock: float = over.value
                break
            yield
        if not self.realtime:
            self.clock.set(clock)
        altered, done = self.settings.alter, self.book.history.done
        # use the displacement of the last command that is not undone; none if ALTON came after it
        if altered is not None:
            then = done[-1].altered if done else None
            same = then is not None and then.mode is altered.mode
            self.settings = structs.replace(self.settings, alter=then if same else Altered(altered.mode))
        return tuple(delta.motion.text for delta in deltas if delta.motion.kind is not MotionKind.RECORDED)

    # --- bookmarks ---

    def bookmark(self) -> Bookmark:
        """Return a bookmark of the current state, to which `take_up` can return."""
        return Bookmark(self.book, self.settings, self.now)

    def take_up(self, mark: Bookmark) -> None:
        """Continue from a bookmark: book, settings and clock are again those of the bookmark."""
        before, self.book, self.settings = self.book, mark.book, mark.settings
        self.clock.set(mark.clock)
        if self.book is not before:
            before.end_stream()
            before.notify, self.book.notify = silent, self.events.publish
            self.events.publish([TimelineReplaced(self.timeline, self.settings)])

    # --- reach ---

    def world_pose(self, joints: Joints) -> Transform:
        """Return T_world_tool at these joints, with the current BASE and TOOL."""
        return world_pose(self.arm, self.frames, joints)

    def joints_for(
        self, T_world_tool: Transform, near: Joints | None = None, asked: Configuration | None = None
    ) -> Joints:
        """Return the joints in which a MOVE would end that starts from here, or from the joints `near`. `asked`: the
        requested configuration. Raises LocationOutOfRange, JointOutOfRange.
        """
        pose = compose(self.frames.base, T_world_tool)
        near = self.position().joints if near is None else near
        settings = self.settings if asked is None else structs.replace(self.settings, configuration=asked)
        return targets.select(self.arm, settings, pose, self.frames, near)

    def trial(self, move: Move) -> TimelineDelta:
        """Plan a motion in the same way as `perform`, without changing the timeline. Raises MotionError,
        IllegalValue.
        """
        start, executed = self._start_of(move, False)
        motion = self._motion(move, start, executed)
        return self._plan_change(motion, self.now, executed, insert=self.settings.inserts)

    def aside(self) -> Engine:
        """Return a separate engine that continues from the current state. Its requests do not change this engine, and
        listeners get no event.

        Its book contains only the changes that it makes itself.
        """
        clock, book = VirtualClock(), self.book
        clock.realtime = self.realtime
        other = Engine(self.model, clock=clock)
        copy = Book(book.timeline, book.timeline, (), History(book.history.done), book.number)
        copy.marks_events = book.marks_events
        other.take_up(Bookmark(copy, self.settings, self.now))
        return other

    def explain(self, target: PoseTarget | commands.JointTarget) -> Reach:
        """Explain why a MOVE or MOVES from here to a target is possible or not.

        Raises IllegalValue for the joints of another robot.
        """
        from vrs_cli.engine.reach import reach_of

        return reach_of(self.standpoint, target)

    @property
    def standpoint(self) -> Standpoint:
        """The current state of the robot, from which the motions examined by WHY and EXPLAIN start."""
        from vrs_cli.engine import reach

        return reach.Standpoint(self.arm, self.settings, self.position().joints, self._motion_at(self.now))
