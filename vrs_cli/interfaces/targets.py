"""Streams of targets from a user: joints to steer to, poses to which the tool is dragged, or JOG steps from a held
button or from keys.

The first target opens a stream. The last target, or releasing the button or tool, closes it. The robot follows one
stream at a time, and always its newest target. The robot ends a stream

- when a user stops the robot (ABORT): the streams of all users end;
- when another stream begins;
- for a dragged tool also when anything else moves the robot, and when a program begins.

Targets of an ended stream are refused until its user has closed the stream. So a button or tool that is still held
cannot move the arm after a stop. If no more targets arrive, the arm comes to rest: at the end of a JOG step, at the end
of the motion to the last joints, or RELEASE_AFTER_S after the last pose of a dragged tool. The next pose then continues
the drag.

Joint targets have times given by their sender. For a dragged tool the robot moves towards the last pose every
DRAG_TICK, so it does not matter if poses arrive late, in bursts, or not at all for a moment.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import NamedTuple

from msgspec import structs

from vrs_cli.engine.clock import WallClock
from vrs_cli.errors import RequestRefused, UsageError, VrsError
from vrs_cli.interfaces import dialogue, streams
from vrs_cli.interfaces.jog.jogger import Jogger
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.users import STOPPED, StreamKind, TargetStream, check_goes_beside
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.words.word import Role
from vrs_cli.trajectory.state import Target
from vrs_cli.values import acts, hand

RELEASE_AFTER_S = 0.6  # [s] the drag of the tool ends after this real time without a target
DRAG_TEXT = "to drag the tool"
# for each kind of stream: the error for a target that arrives after the robot has ended the stream
REFUSALS: Mapping[StreamKind, tuple[type[RequestRefused | UsageError], str, str]] = {
    StreamKind.STEER: (RequestRefused, "the robot steers no longer: {}", "begin anew with a first target"),
    StreamKind.DRAG: (RequestRefused, "the tool was let go: {}", "the next call drags it again"),
    StreamKind.BUTTON: (UsageError, "the arm was stopped by hand", "let the button go, and press it again"),
    StreamKind.KEYS: (RequestRefused, "the arm was stopped by hand", "press space, and then the key again"),
}


def _refusal(stream: TargetStream) -> VrsError:
    error, what, hint = REFUSALS[stream.kind]
    return error(what.format(stream.ended), hint)


class TargetControl(NamedTuple):
    """The receiver of targets from the current user of `session` (the robot with its programs). Call its methods in the
    robot's own thread."""

    session: Station

    # --- streams ---

    def _stream(self, kind: StreamKind) -> TargetStream | None:
        return self.session.user_state.streams.get(kind)

    def _open(self, kind: StreamKind) -> TargetStream:
        """Return the current user's stream of a kind; open a new stream if the user has none."""
        user_state = self.session.user_state
        return user_state.streams.setdefault(kind, TargetStream(kind, user_state))

    def _accept(self, stream: TargetStream) -> None:
        """Accept the next target of a stream: the robot now follows this stream, and the stream that it followed before
        ends. Raises RobotNotAttached, and the error from REFUSALS if this stream has ended."""
        session, before = self.session, self.session.stream
        session.tasks.check_robot_free()
        if stream.ended:
            raise _refusal(stream)
        if before is not None and before is not stream:
            self._end(before, STOPPED)
        session.stream = stream

    def _end(self, stream: TargetStream, why: str) -> None:
        """End a stream for the reason `why`: its user must close it before opening another stream of the same kind."""
        stream.ended = why
        self._leave(stream, why)

    def _close(self, kind: StreamKind) -> TargetStream | None:
        """Close the current user's stream of a kind, and return it; None if there is none."""
        stream = self.session.user_state.streams.pop(kind, None)
        if stream is not None:
            self._leave(stream)
        return stream

    def _leave(self, stream: TargetStream, why: str = "") -> None:
        """Stop following a stream. The arm carries out the stop that is always planned in advance for the case that no
        more targets arrive. `why`: the reason shown to the user."""
        session = self.session
        if session.stream is not stream:
            return
        session.stream = None
        if stream.dragging is not None:
            stream.dragging, session.pulled = None, hand.DragState(why=why)
            if not session.engine.realtime:
                session.settle(session.engine.end)

    # --- joints ---

    def steer(self, act: acts.Steer) -> None:
        """Take a joint target. The first target of a stream has no velocity. Raises RequestRefused if the robot has
        ended the stream, RobotNotAttached, JointOutOfRange, PowerOff."""
        session, engine, user_state = self.session, self.session.engine, self.session.user_state
        speed = 1.0 if act.speed is None else act.speed
        if act.velocity is None:
            user_state.streams[StreamKind.STEER] = TargetStream(StreamKind.STEER, user_state)
            self._accept(self._open(StreamKind.STEER))
            engine.redirect(act.joints, speed=speed, text=streams.STEERING.text)
        else:
            self._accept(self._stream(StreamKind.STEER) or TargetStream(StreamKind.STEER, user_state, STOPPED))
            streams.chase(
                engine, streams.STEERING, Target(act.joints, act.velocity), act.lasting, speed, user_state.issued
            )
        if not engine.realtime:
            session.settle(engine.now + min(max(act.lasting, 0.0), streams.STEERING.longest))

    # --- a button or a key ---

    def jog(self, jogger: Jogger, act: hand.Press | hand.StopJog | hand.Look, kind: StreamKind) -> hand.Seen:
        """Carry out the action of a button or key that moves the arm. Return the resulting state of the robot; for a
        refused key it contains the error. Releasing a button does not brake motions that other users began. Raises
        RoleWanted, LeaseHeld, UsageError for a button that has been held since a stop, RobotNotAttached. A button opens
        and closes its stream even while its user does not drive, so a button that is held during a stop does not move
        the arm when its user drives later."""
        session, engine = self.session, self.session.engine
        if isinstance(act, hand.Press):
            stream = self._open(kind)
            session.check_may("JOG", Role.DESIGNER)
            try:
                self._accept(stream)
            except VrsError as error:
                if kind is StreamKind.BUTTON:
                    raise
                jogger.said = str(error)  # the screen shows the error until the next key
                return jogger.do(hand.Look())
            seen = jogger.do(act)
            stream.version = engine.timeline.version
            return seen
        if isinstance(act, hand.StopJog):
            closed = self._close(kind)
            session.check_may("JOG", Role.DESIGNER)
            if kind is StreamKind.BUTTON and (closed is None or closed.version != engine.timeline.version):
                return jogger.do(hand.Look())
        return jogger.do(act)

    # --- a tool ---

    def drag(self, pose: Transform | None) -> dialogue.Dialogue[hand.Shortfall]:
        """Take a target pose as `pull` does, and return how far the tool is from the pose. If the user has moved the
        robot in another way since the last pose, a new drag begins. Raises RequestRefused, once, if the robot was
        stopped since the last pose."""
        session, stream = self.session, self._stream(StreamKind.DRAG)
        if (
            stream is not None
            and stream is session.stream
            and not (stream.ended or session.running)
            and stream.version != session.engine.timeline.version
        ):
            self._close(StreamKind.DRAG)
        yield from self.pull(pose, session.user_state.issued)
        if (stream := self._stream(StreamKind.DRAG)) is not None and stream.ended:
            self._close(StreamKind.DRAG)
            raise _refusal(stream)
        return session.pulled.held

    def pull(self, pose: Transform | None, issued: float | None = None) -> dialogue.Dialogue[None]:
        """Take a target pose of the tool (T_world_tool); None releases the tool. A pose is ignored if the robot has
        ended the drag and the user has not released the tool. `issued`: when the user sent the pose, by the user's
        clock [s]. Raises RoleWanted, LeaseHeld, RobotNotAttached, UsageError, PowerOff."""
        session = self.session
        try:
            if pose is None:
                self._close(StreamKind.DRAG)
            elif (stream := self._open(StreamKind.DRAG)).ended:
                self._leave(stream, stream.ended)
            else:
                yield from self._take_pose(stream, pose, issued)
        finally:
            if session.stream is None or session.stream is not self._stream(StreamKind.DRAG):
                session.pulled = structs.replace(session.pulled, issued=issued)

    def _take_pose(self, stream: TargetStream, pose: Transform, issued: float | None) -> dialogue.Dialogue[None]:
        session = self.session
        try:
            session.check_may(DRAG_TEXT, Role.DESIGNER)
        except VrsError as error:
            if session.stream is stream:
                self._end(stream, str(error))
            raise
        stream.pose, stream.issued, stream.heard = acts.check_rotation(pose), issued, session.engine.clock.reached
        if session.stream is not stream:
            yield from session.on_branch(Role.DESIGNER, self._begin_drag(stream))
        elif not session.engine.realtime:
            self._follow_pose(stream)

    def _begin_drag(self, stream: TargetStream) -> dialogue.Dialogue[None]:
        # imported only here, because this import is slow and many robots are never dragged
        from vrs_cli.interfaces.dragging import Dragging

        yield from ()
        session = self.session
        session.settle()
        if session.running or session.elsewhere:
            check_goes_beside(DRAG_TEXT, Role.DESIGNER, elsewhere=session.elsewhere)
        self._accept(stream)
        stream.dragging, stream.version = Dragging(session.engine), session.engine.timeline.version
        try:
            self._follow_pose(stream)
        except VrsError:
            self._leave(stream)
            raise
        if session.engine.realtime:
            session.actor.repeat(partial(self._beat, stream))

    def _beat(self, stream: TargetStream) -> float | None:
        """Move the arm one step towards the last pose. Return the time of the next step [s]; None if the drag has
        ended."""
        engine = self.session.engine
        clock = engine.clock
        assert isinstance(clock, WallClock)
        if self.session.stream is not stream:
            return None
        if -clock.until(stream.heard) > RELEASE_AFTER_S:
            self._leave(stream, "nothing was heard any more")
            return None
        due = clock.reached
        try:
            self.session.settle()
            self._follow_pose(stream)
        except VrsError as error:
            self._end(stream, str(error))
        # the arm would not follow the tool any more, so end the user's drag before the error is reported
        except Exception:
            self._end(stream, "the robot cannot follow: an internal error")
            raise
        return None if self.session.stream is not stream else max(due + streams.DRAG_TICK, engine.now)

    def _follow_pose(self, stream: TargetStream) -> None:
        session, engine = self.session, self.session.engine
        if stream.ended or engine.timeline.version != stream.version or session.running:
            self._end(stream, STOPPED)
            return
        assert stream.dragging is not None
        assert stream.pose is not None
        issued = None if stream.issued is None else stream.user_state.times.issue_time(stream.issued, engine.now)
        held = stream.dragging.to(stream.pose, issued)
        stream.version = engine.timeline.version
        session.pulled = hand.DragState(stream.user_state.name, held, issued=stream.issued)
        if not engine.realtime:
            session.settle(engine.now + streams.DRAG_TICK)
