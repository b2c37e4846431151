"""Dragging the tool of a robot that is served: one user at a time drags, and the robot follows.

The user sends wishes for the pose of the tool; the newest one counts. The robot follows at its own pace, so wishes may
come late, in bursts, or not at all for a moment. After SILENCE seconds without a wish the tool is released, and the arm
comes to rest; likewise when another user moves the robot, or a program takes it.
"""

from __future__ import annotations

from collections.abc import Callable

from msgspec import structs

from vrs_cli.errors import VrsError
from vrs_cli.interfaces.dialogue import Dialogue
from vrs_cli.interfaces.dragging import TICK, Dragging
from vrs_cli.interfaces.rights import check_goes_beside
from vrs_cli.interfaces.session.session import Session
from vrs_cli.interfaces.station.user_state import UserState
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.words.word import Role
from vrs_cli.values.acts import rotating
from vrs_cli.values.hand import DragState

SILENCE = 0.6  # [s] of real time without a wish
SAID = "to drag the tool"


class DragControl:
    """Keeps which user drags, and the last wish. All but `pulled` is for the robot's own thread."""

    def __init__(self, session: Session, wall: Callable[[], float]) -> None:
        self.pulled = DragState()
        self._session, self._wall = session, wall
        self._dragging: Dragging | None = None
        self._user_state: UserState | None = None
        self._wish: Transform | None = None
        self._issued: float | None = None  # when the wish was given, by the user's clock
        self._heard = 0.0
        self._spent: UserState | None = None  # whose drag was broken off
        self._version = self._stops = 0  # of the timeline, and how often the robot was stopped, as the drag knows

    def pull(self, wish: Transform | None, issued: float | None = None) -> Dialogue[None]:
        """Take a wish of the present user for the tool (T_world_tool); None releases the tool. `issued`: when the wish
        was given [s], by the user's clock. Raises RoleWanted, LeaseHeld, RobotNotAttached, UsageError, PowerOff.
        """
        try:
            yield from self._taken(wish, issued)
        finally:
            if self._user_state is not self._session.user_state:
                self.pulled = structs.replace(self.pulled, issued=issued)

    def _taken(self, wish: Transform | None, issued: float | None) -> Dialogue[None]:
        session = self._session
        if wish is None:
            self._spent = None if self._spent is session.user_state else self._spent
            if self._user_state is session.user_state:
                self._let_go()
            return
        if self._spent is session.user_state:
            return
        try:
            session.check_may(SAID, Role.DESIGNER)
        except VrsError as error:
            if self._user_state is session.user_state:
                self._break_off(str(error))
            raise
        self._wish, self._issued, self._heard = rotating(wish), issued, self._wall()
        if self._dragging is None or self._user_state is not session.user_state:
            yield from session.on_branch(Role.DESIGNER, self._take())
        elif not session.engine.realtime:
            self._follow()

    def _take(self) -> Dialogue[None]:
        yield from ()
        session = self._session
        session.settle()
        if session.running or session.elsewhere:
            check_goes_beside(SAID, Role.DESIGNER, elsewhere=session.elsewhere)
        session.tasks.check_robot_free()
        self._dragging, self._user_state = Dragging(session.engine), session.user_state
        self._version, self._stops = session.engine.timeline.version, session.stops
        self._follow()
        if session.engine.realtime:
            session.actor.repeat(self._beat)

    def _beat(self) -> float | None:
        """Take the robot's next step towards the wish. Return when the next one is due [s]; None: the tool
        is released.
        """
        engine = self._session.engine
        if self._dragging is None:
            return None
        if self._wall() - self._heard > SILENCE:
            self._let_go("nothing was heard any more")
            return None
        due = engine.clock.reached
        try:
            self._session.settle()
            self._follow()
        except VrsError as error:
            self._break_off(str(error))
        except Exception:  # the tool no longer follows, so the user must not go on holding it
            self._break_off("the robot cannot follow: an internal error")
            raise
        return None if self._dragging is None else max(due + TICK, engine.now)

    def _follow(self) -> None:
        session, engine, dragging = self._session, self._session.engine, self._dragging
        assert dragging is not None
        assert self._wish is not None
        assert self._user_state is not None
        if (engine.timeline.version, session.stops) != (self._version, self._stops) or session.running:
            self._break_off("something else has moved or stopped the robot")
            return
        issued = None if self._issued is None else self._user_state.times.issued(self._issued, engine.now)
        held = dragging.to(self._wish, issued)
        self._version = engine.timeline.version
        self.pulled = DragState(self._user_state.name, held, issued=self._issued)
        if not engine.realtime:
            session.settle(engine.now + TICK)

    def _break_off(self, why: str) -> None:
        """Release the tool; the user has to let it go and to take it again."""
        self._spent = self._user_state
        self._let_go(why)

    def _let_go(self, why: str = "") -> None:
        """Release the tool: the arm comes to rest as planned for the case of no further wish."""
        self._dragging, self._user_state, self.pulled = None, None, DragState(why=why)
        engine = self._session.engine
        if not engine.realtime:
            self._session.settle(engine.end)
