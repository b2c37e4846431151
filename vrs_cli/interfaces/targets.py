"""Streams of targets by which users move the arm by hand: joints to steer to, one by one or in chunks; poses to which
the tool is dragged; JOG steps from a held button or from keys.

All ways go through one loop. The first target opens a stream. Each target claims the robot, and the way of the stream
turns the target into a motion, which ends by itself if no more targets arrive. The last target, or releasing the button
or tool, closes the stream. The robot follows one stream at a time, and always its newest target. It ends a stream

- when a user stops the robot (ABORT): the streams of all users end;
- when it refuses a target, for instance because another user drives, or the disk is full;
- when the connection of its user is lost (a stream of chunks continues if the next chunk arrives in time);
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
from contextlib import suppress
from functools import partial
from typing import NamedTuple

from msgspec import structs

from vrs_cli.engine import steering
from vrs_cli.engine.book import Parts
from vrs_cli.engine.clock import WallClock
from vrs_cli.errors import RequestRefused, StreamIsOver, VrsError
from vrs_cli.interfaces import streams
from vrs_cli.interfaces.jog.jogger import Jogger
from vrs_cli.interfaces.station.station import Station
from vrs_cli.interfaces.users import STOPPED, StreamKind, TargetStream, UserState, check_goes_beside
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.words.word import Role
from vrs_cli.trajectory.state import Target
from vrs_cli.values import acts, dragging, hand
from vrs_cli.values.results import FollowReport

RELEASE_AFTER_S = 0.6  # [s] the drag of the tool ends after this real time without a target


class Way(NamedTuple):
    """A way to move the arm by hand. `said`: its name in refusals; `hint`: how its user begins anew after the robot has
    ended the stream; `error`: the error for targets that arrive meanwhile; `beside`: whether it may move the arm beside
    a program that does not have the robot."""

    said: str
    hint: str
    error: type[VrsError] = RequestRefused
    beside: bool = False


WAYS: Mapping[StreamKind, Way] = {
    StreamKind.STEER: Way("MOVE", "begin anew with a first target"),
    StreamKind.CHUNKS: Way("MOVE", "begin anew when the last chunk is over", StreamIsOver),
    StreamKind.DRAG: Way("to drag the tool", "the next call drags it again"),
    StreamKind.BUTTON: Way("JOG", "let the button go, and press it again", beside=True),
    StreamKind.KEYS: Way("JOG", "press space, and then the key again", beside=True),
}


class TargetControl(NamedTuple):
    """The receiver of targets from the current user of `session` (the robot with its programs). Call its methods in the
    robot's own thread."""

    session: Station

    # --- the loop of all ways ---

    def _open(self, kind: StreamKind, ended: str = "") -> TargetStream:
        """Return the current user's stream of a kind. If the user has none, open a new one (`ended`: an ended one)."""
        user_state = self.session.user_state
        return user_state.streams.setdefault(kind, TargetStream(kind, user_state, ended))

    def _claim(self, kind: StreamKind, ended: str = "") -> TargetStream:
        """Accept the next target of a stream, and return the stream: the robot now follows it, and the stream that the
        robot followed before ends. A refused target ends its own stream, so that a button or tool that is still held
        does not move the arm when the reason has gone. Raises RoleWanted, LeaseHeld, UsageError if a program runs,
        RobotNotAttached, the errors of a robot that can store no change, and the error of WAYS if the stream has
        ended. `ended`: as in `_open`."""
        session, stream, way = self.session, self._open(kind, ended), WAYS[kind]
        try:
            session.settle()  # first let the tasks carry out all events up to now
            if stream.ended:
                raise way.error(f"the arm was let go: {stream.ended}", way.hint)
            session.check_may(way.said, Role.DESIGNER)
            session.check_room()
            if not way.beside and (session.running or session.elsewhere):
                check_goes_beside(way.said, Role.DESIGNER, elsewhere=session.elsewhere)
            session.tasks.check_robot_free()
        except VrsError as error:
            self._end(stream, str(error))
            raise
        before, session.stream = session.stream, stream
        if before is not None and before is not stream:
            self._end(before, STOPPED)
        return stream

    def _end(self, stream: TargetStream, why: str) -> None:
        """End a stream for the reason `why`: its user must close it before opening another stream of the same kind."""
        stream.ended = stream.ended or why
        self._leave(stream, stream.ended)

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
        if session.stream is stream:
            session.stream = None
            if stream.dragging is not None:
                stream.dragging, session.pulled = None, dragging.DragState(why=why)
                if not session.engine.realtime:
                    session.settle(session.engine.end)

    def lose(self, user_state: UserState) -> None:
        """End the streams of a user whose connection is lost, except chunks, which are for given times."""
        for kind in user_state.streams.keys() - {StreamKind.CHUNKS}:
            self._end(user_state.streams[kind], "the connection was lost")

    def refuse(self, why: str, *, drag: bool) -> None:
        """End the stream of a dragged tool, or of a pressed button or key, whose target was refused before it came
        here."""
        pressed = StreamKind.KEYS if isinstance(self.session.user_state.on_screen, Jogger) else StreamKind.BUTTON
        self._end(self._open(StreamKind.DRAG if drag else pressed), why)

    # --- joints ---

    def steer(self, act: acts.Steer) -> None:
        """Take a joint target. The first target of a stream has no velocity. Raises RequestRefused if the robot has
        ended the stream, RobotNotAttached, JointOutOfRange, PowerOff."""
        session, engine, speed = self.session, self.session.engine, 1.0 if act.speed is None else act.speed
        if act.velocity is None:
            self._close(StreamKind.STEER)
            self._claim(StreamKind.STEER)
            engine.redirect(act.joints, speed=speed, text=streams.STEERING.text)
        else:
            self._claim(StreamKind.STEER, STOPPED)
            target, tick = Target(act.joints, act.velocity), streams.STEERING.tick(act.lasting)
            engine.steer(target, tick, speed=speed, text=streams.STEERING.text, issued=session.user_state.issued)
        if not engine.realtime:
            session.settle(engine.now + min(max(act.lasting, 0.0), streams.STEERING.longest))

    def follow(self, act: acts.FollowChunk) -> Parts[FollowReport]:
        """Follow a chunk of time-stamped joints. A chunk that begins after the end of the user's previous chunk opens a
        new stream. Raises StreamIsOver if the robot has ended the stream, RobotNotAttached, and the errors of
        `Engine.follow`."""
        engine, user_state = self.session.engine, self.session.user_state
        times = [user_state.times.robot_time(t) for t in act.times]
        chunk = steering.Chunk(engine.model, times, act.joints)
        if self._open(StreamKind.CHUNKS).last < times[0]:
            self._close(StreamKind.CHUNKS)
        self._open(StreamKind.CHUNKS).last = times[-1]
        self._claim(StreamKind.CHUNKS)
        return engine.follow(chunk, speed=1.0 if act.speed is None else act.speed, issued=user_state.issued)

    # --- a button or a key ---

    def jog(self, jogger: Jogger, act: hand.Press | hand.StopJog | hand.Look) -> hand.Seen:
        """Carry out the action of a button or key that moves the arm. Return the resulting state of the robot; for a
        refused key it contains the error. `jogger`: the one for buttons. Releasing a button does not brake motions that
        other users began. Raises RoleWanted, LeaseHeld, and for a button the errors of `_claim`."""
        shown, version = self.session.user_state.on_screen, self.session.engine.timeline.version
        # while JOG fills the user's screen, keys move the arm
        kind, jogger = (StreamKind.KEYS, shown) if isinstance(shown, Jogger) else (StreamKind.BUTTON, jogger)
        try:
            if isinstance(act, hand.Press):
                self._claim(kind)
            elif isinstance(act, hand.StopJog):
                closed = self._close(kind)
                self.session.check_may("JOG", Role.DESIGNER)
                if kind is StreamKind.BUTTON and (closed is None or jogger.version != version):
                    act = hand.Look()
        except VrsError as error:
            if kind is StreamKind.BUTTON:
                raise
            jogger.said, act = str(error), hand.Look()  # the screen shows the error until the next key
        return jogger.do(act)

    # --- a tool ---

    def drag(self, pose: Transform | None) -> dragging.Shortfall:
        """Take a target pose as `pull` does, and return how far the tool is from the pose. If the user has moved the
        robot in another way since the last pose, a new drag begins. An error closes the stream. Raises RequestRefused,
        once, if the robot was stopped since the last pose."""
        session, stream = self.session, self.session.user_state.streams.get(StreamKind.DRAG)
        if stream is not None and not stream.ended and stream.version != session.engine.timeline.version:
            self._close(StreamKind.DRAG)
        try:
            self.pull(pose, session.user_state.issued)
        except VrsError:
            self._close(StreamKind.DRAG)
            raise
        return session.pulled.held

    def pull(self, pose: Transform | None, issued: float | None = None) -> None:
        """Take a target pose of the tool (T_world_tool); None releases the tool. `issued`: when the user sent the pose,
        by the user's clock [s]. Raises the errors of `_claim`, PowerOff."""
        session, engine = self.session, self.session.engine
        try:
            if pose is None:
                self._close(StreamKind.DRAG)
            else:
                stream = self._open(StreamKind.DRAG)
                stream.pose, stream.issued, stream.last = acts.check_rotation(pose), issued, engine.clock.reached
                self._claim(StreamKind.DRAG)
                if stream.dragging is None or not engine.realtime:
                    self._follow_pose(stream)
        finally:
            if session.stream is None or session.stream is not session.user_state.streams.get(StreamKind.DRAG):
                session.pulled = structs.replace(session.pulled, issued=issued)

    def _beat(self, stream: TargetStream) -> float | None:
        """Move the arm one step towards the last pose. Return the time of the next step [s]; None if the drag has
        ended."""
        session, clock = self.session, self.session.engine.clock
        assert isinstance(clock, WallClock)
        due = clock.reached
        if session.stream is stream and -clock.until(stream.last) > RELEASE_AFTER_S:
            self._leave(stream, "nothing was heard any more")
        elif session.stream is stream:
            with suppress(VrsError):  # the user of the drag is told why it has ended
                self._follow_pose(stream)
        return max(due + streams.DRAG_TICK, clock.now) if session.stream is stream else None

    def _follow_pose(self, stream: TargetStream) -> None:
        """Move the arm one step towards the last pose; the first step begins the drag."""
        # imported only here, because this import is slow and many robots are never dragged
        from vrs_cli.interfaces.dragging import Dragging

        session, engine = self.session, self.session.engine
        try:
            session.settle()
            if stream.dragging is None:
                stream.dragging = Dragging(engine)
                if engine.realtime:
                    session.actor.repeat(partial(self._beat, stream))
            elif stream.ended or session.running or stream.version != engine.timeline.version:
                self._end(stream, STOPPED)
                return
            held = stream.dragging.to(stream.pose, stream.user_state.times.issue_time(stream.issued, engine.now))
        except Exception as error:  # after any error the arm does not follow the tool any more
            internal = "the robot cannot follow: an internal error"
            self._end(stream, str(error) if isinstance(error, VrsError) else internal)
            raise
        stream.version = engine.timeline.version
        session.pulled = dragging.DragState(stream.user_state.name, held, issued=stream.issued)
        if not engine.realtime:
            session.settle(engine.now + streams.DRAG_TICK)
