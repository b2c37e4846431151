"""Streams of targets for a robot: joints to steer to, or poses to which the tool is dragged. One user at a time sends
targets.

The newest target counts. Joint targets have times given by their sender. The arm follows a dragged tool at its own
pace, so requested poses (wishes) may come late, in bursts, or not at all for a moment. After RELEASE_AFTER_S seconds
without a wish the tool is released, and the arm stops; likewise when another user moves the robot, or a program takes
control of it.
"""

from __future__ import annotations

from typing import NamedTuple

from msgspec import structs

from vrs_cli.engine.clock import WallClock
from vrs_cli.errors import RequestRefused, VrsError
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.interfaces.rights import check_goes_beside
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.user_state import TargetStream
from vrs_cli.interfaces.streams import DRAG_TICK, STEERING, Dragging, chase
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.words.word import Role
from vrs_cli.trajectory.state import Target
from vrs_cli.values.acts import Steer, rotating
from vrs_cli.values.hand import DragState, Shortfall

RELEASE_AFTER_S = 0.6  # real time without a wish after which the tool is released [s]
DRAG_TEXT = "to drag the tool"
STOPPED = "something else has moved or stopped the robot"


class DragControl(NamedTuple):
    """Passes targets to the robot of a session. Call everything except `pulled` in the robot's own thread."""

    session: Session

    @property
    def stream(self) -> TargetStream:
        return self.session.stream

    @property
    def drag_state(self) -> DragState:
        """Return who drags the tool, and how the arm follows."""
        return self.session.stream.pulled

    # --- joints ---

    def steer(self, act: Steer) -> None:
        """Take a target of the present user. Raises RequestRefused, once, if the robot was stopped since the last
        target; RobotNotAttached, JointOutOfRange, PowerOff.
        """
        session, stream, engine = self.session, self.stream, self.session.engine
        speed = 1.0 if act.speed is None else act.speed
        session.tasks.check_robot_free()
        if act.velocity is None:
            stream.steered, stream.stops = session.user_state, session.stops
            engine.redirect(act.joints, speed=speed, text=STEERING.text)
        else:
            self._check_not_stopped()
            target = Target(act.joints, act.velocity)
            chase(engine, STEERING, target, act.lasting, speed, session.user_state.issued)
        if not engine.realtime:
            session.settle(engine.now + min(max(act.lasting, 0.0), STEERING.longest))

    def _check_not_stopped(self) -> None:
        session, stream = self.session, self.stream
        if stream.steered is session.user_state and stream.stops != session.stops:
            stream.steered = None
        if stream.steered is not session.user_state:
            raise RequestRefused(f"the robot steers no longer: {STOPPED}", "begin anew with a first target")

    # --- a tool ---

    def drag(self, wish: Transform | None) -> Dialogue[Shortfall]:
        """Take a requested pose (wish) as `pull` does, and return how far the tool is from it. After other motions of
        the user the drag begins again. Raises RequestRefused, once, if the robot was stopped since the last wish.
        """
        session, stream = self.session, self.stream
        same_stream = stream.user_state is session.user_state and stream.stops == session.stops
        if same_stream and not session.running and stream.version != session.engine.timeline.version:
            self._let_go()
        yield from self.pull(wish, session.user_state.issued)
        if stream.spent is session.user_state:
            stream.spent = None
            raise RequestRefused(f"the tool was let go: {stream.pulled.why}", "the next call drags it again")
        return stream.pulled.held

    def pull(self, wish: Transform | None, issued: float | None = None) -> Dialogue[None]:
        """Take a requested pose of the tool (T_world_tool) from the present user; None releases the tool. `issued`:
        when the user gave this wish [s], by the user's clock. Raises RoleWanted, LeaseHeld, RobotNotAttached,
        UsageError, PowerOff.
        """
        stream = self.stream
        try:
            yield from self._take_wish(wish, issued)
        finally:
            if stream.user_state is not self.session.user_state:
                stream.pulled = structs.replace(stream.pulled, issued=issued)

    def _take_wish(self, wish: Transform | None, issued: float | None) -> Dialogue[None]:
        session, stream = self.session, self.stream
        if wish is None:
            stream.spent = None if stream.spent is session.user_state else stream.spent
            if stream.user_state is session.user_state:
                self._let_go()
            return
        if stream.spent is session.user_state:
            return
        try:
            session.check_may(DRAG_TEXT, Role.DESIGNER)
        except VrsError as error:
            if stream.user_state is session.user_state:
                self._break_off(str(error))
            raise
        stream.wish, stream.issued, stream.heard = rotating(wish), issued, session.engine.clock.reached
        if stream.dragging is None or stream.user_state is not session.user_state:
            yield from session.on_branch(Role.DESIGNER, self._take())
        elif not session.engine.realtime:
            self._follow()

    def _take(self) -> Dialogue[None]:
        yield from ()
        session, stream = self.session, self.stream
        session.settle()
        if session.running or session.elsewhere:
            check_goes_beside(DRAG_TEXT, Role.DESIGNER, elsewhere=session.elsewhere)
        session.tasks.check_robot_free()
        stream.dragging, stream.user_state = Dragging(session.engine), session.user_state
        stream.version, stream.stops = session.engine.timeline.version, session.stops
        self._follow()
        if session.engine.realtime:
            session.actor.repeat(self._beat)

    def _beat(self) -> float | None:
        """Carry out the robot's next step towards the requested pose. Return when the next step is due [s]; None: the
        tool is released.
        """
        engine, stream = self.session.engine, self.stream
        clock = engine.clock
        assert isinstance(clock, WallClock)
        if stream.dragging is None:
            return None
        if -clock.until(stream.heard) > RELEASE_AFTER_S:
            self._let_go("nothing was heard any more")
            return None
        due = clock.reached
        try:
            self.session.settle()
            self._follow()
        except VrsError as error:
            self._break_off(str(error))
        except Exception:  # the tool no longer follows, so the drag of the user must end
            self._break_off("the robot cannot follow: an internal error")
            raise
        return None if stream.dragging is None else max(due + DRAG_TICK, engine.now)

    def _follow(self) -> None:
        session, engine, stream = self.session, self.session.engine, self.stream
        assert stream.dragging is not None
        assert stream.wish is not None
        assert stream.user_state is not None
        if (engine.timeline.version, session.stops) != (stream.version, stream.stops) or session.running:
            self._break_off(STOPPED)
            return
        issued = None if stream.issued is None else stream.user_state.times.issue_time(stream.issued, engine.now)
        held = stream.dragging.to(stream.wish, issued)
        stream.version = engine.timeline.version
        stream.pulled = DragState(stream.user_state.name, held, issued=stream.issued)
        if not engine.realtime:
            session.settle(engine.now + DRAG_TICK)

    def _break_off(self, why: str) -> None:
        """Release the tool; the user must end the drag and begin a new one."""
        self.stream.spent = self.stream.user_state
        self._let_go(why)

    def _let_go(self, why: str = "") -> None:
        """Release the tool: the arm comes to rest as planned for the case that no further pose is requested."""
        stream, engine = self.stream, self.session.engine
        stream.dragging, stream.user_state, stream.pulled = None, None, DragState(why=why)
        if not engine.realtime:
            self.session.settle(engine.end)
