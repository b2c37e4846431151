"""The tool dragged in a browser: a gizmo at the tool is the wish, the arm follows, and what holds it is said there.

While nobody drags, the gizmo stands at the tool, along its axes or those of the world. It is there for who may drive,
and while the robot is shown as it is now. What is dragged may be kept: a place under a name, a way as a program.
"""

from __future__ import annotations

from enum import Enum
from functools import partial
from math import inf, radians

import viser

from vrs_cli.errors import UsageError
from vrs_cli.interfaces.recording import Tolerance, recorded_program
from vrs_cli.kinematics.transform import IDENTITY, Transform, at_position, compose, inverse, position
from vrs_cli.net import messages
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.values.hand import DragState, Limit
from vrs_cli.view3d.panel_front_end import PanelFrontEnd
from vrs_cli.view3d.parts import Hands, OneOf, Shown, boxed, place, put, transform_of
from vrs_cli.view3d.window import RobotWindow

AGAIN = 0.1  # [s] after which a wish that stays is said again: the robot knows that the hand is there
SIZE = 0.28  # of the reach: the gizmo
LIT = 0.09  # of the reach: the ball at a joint that is at its limit
VISIBLE = 5e-4  # [m] that a tool is away from its wish, to be told
RED = (214, 58, 46)
TOLERANCE = Tolerance(0.002, radians(1.0))
TOOL, WORLD = "Tool", "World"
RECORD, END = "Record a program", "End the program"


class Moves(Enum):
    """The motions that the gizmo allows; the value is the name on the screen."""

    BOTH = "Both"
    MOVE = "Move"
    TURN = "Turn"


class Gizmo:
    """Part of a window whose robot may be driven, with its controls in the container that is open. Nodes /drag, /held
    and /limit.
    """

    def __init__(self, window: RobotWindow, robot: SocketPort, front_end: PanelFrontEnd, hands: Hands) -> None:
        self._window, self._robot, self._front_end = window, robot, front_end
        scene, reach = window.client.scene, window.watched.arm.length
        self.node = scene.add_transform_controls("/drag", scale=SIZE * reach, depth_test=False, visible=False)
        self.label = scene.add_label("/held", "", visible=False)
        self.ball = scene.add_icosphere("/limit", radius=LIT * reach, color=RED, opacity=0.45, visible=False)
        self.pulled = DragState()
        self._along = TOOL
        self._tool: Transform | None = None  # where it was shown last
        self._drag_control: Transform | None = None  # T_gizmo_tool, while it is dragged
        self._wish: Transform | None = None
        self._said: Transform | None = None
        self._said_at = -inf
        self._began: float | None = None  # [s] when recording began
        self._add_controls(window.client.gui, hands)
        self.node.on_update(self._pull)
        robot.listen(self._hear)

    def _add_controls(self, gui: viser.GuiApi, hands: Hands) -> None:
        self.on = gui.add_checkbox("Gizmo at the tool (G)", initial_value=True)
        OneOf(gui, hands, "Axes", (TOOL, WORLD), partial(setattr, self, "_along"))
        OneOf(gui, hands, "Drag", tuple(moves.value for moves in Moves), self._choose)
        self.why = gui.add_html("")
        self.name = gui.add_text("Name", "part")
        self.here = gui.add_button("HERE", hint="Keep the place under this name")
        self.record = gui.add_button(RECORD, hint="Of what is dragged, under this name", icon=viser.Icon.PLAYER_RECORD)
        hands.on(self.here, lambda _: self._front_end.command(f"HERE {self._named()}"))
        hands.on(self.record, lambda _: self._record())
        toggle = gui.add_command("Drag the tool, or not", hotkey="G")
        toggle.on_trigger(self._window.doing(lambda: put(self.on, value=not self.on.value)))

    def _choose(self, said: str) -> None:
        moves = Moves(said)
        put(self.node, disable_axes=moves is Moves.TURN, disable_sliders=moves is Moves.TURN)
        put(self.node, disable_rotations=moves is Moves.MOVE)

    # --- dragging ---

    async def _pull(self, event: viser.TransformControlsEvent) -> None:
        """Take a position of the gizmo. It never waits, so positions come in the order of the browser."""
        gizmo = transform_of(event.target)
        if event.phase == "start" and self._tool is not None:
            self._wish_at(None)  # what a cut has broken off is let go only now
            self._drag_control = compose(inverse(gizmo), self._tool)
        if self._drag_control is None:
            return
        self._wish = compose(gizmo, self._drag_control)
        self._window.wake()
        if event.phase == "end":
            self._wish_at(self._wish)
            self._wish_at(None)
            self.drop()

    def _wish_at(self, pose: Transform | None) -> None:
        """Tell the robot where the tool is wished; None lets the tool go. Without a connection nothing is sent."""
        if self._robot.open:
            self._robot.tell(messages.Drag(pose))

    def drop(self) -> None:
        """Nothing is wished any more until the gizmo is taken again."""
        self._drag_control = self._wish = self._said = None

    def _tell(self) -> None:
        """The newest wish, once a tick at most."""
        wish, wall = self._wish, self._window.wall()
        if wish is not None:
            self._window.again(wall + AGAIN)
        if wish is not None and (wish != self._said or wall > self._said_at + AGAIN):
            self._said, self._said_at = wish, wall
            self._wish_at(wish)

    def _hear(self, message: messages.ServerMessage) -> None:
        """Hear a message, in the thread of the connection."""
        if isinstance(message, messages.Pulled):
            before, self.pulled = self.pulled, message.state
            if message.state.why and before.by == self._front_end.name:
                self._front_end.note(f"The tool is let go: {message.state.why}")

    # --- showing ---

    def show(self, shown: Shown) -> None:
        self._tell()
        live, dragged = self._window.playback.follows, self._drag_control is not None
        tool = self._tool = shown.position.T_world_tool
        may = self._robot.open and self._front_end.may_drive and self.pulled.by in ("", self._front_end.name)
        put(self.node, visible=bool(self.on.value) and may and (live or dragged))
        if not dragged:
            along_tool = self._along == TOOL
            place(self.node, tool if along_tool else at_position(IDENTITY, *position(tool)))
        pulled = self.pulled if live or dragged else DragState()
        if pulled.held.holds or shown.reads:
            self._show_why(shown, pulled)

    def _show_why(self, shown: Shown, pulled: DragState) -> None:
        model, held = shown.arm.model, pulled.held
        text = "; ".join(hold.said(model) for hold in held.holds)
        if held.away >= VISIBLE:
            text += f" ({1000.0 * held.away:.0f} mm away)"
        put(self.label, text=text, visible=bool(text))
        if text:
            place(self.label, shown.position.T_world_tool)
        joint = next((hold.joint for hold in held.holds if hold.limit is Limit.JOINT), 0)
        if joint:
            frames = shown.arm.frames(shown.position.joints)
            place(self.ball, compose(inverse(shown.frames.base), frames[joint - 1]))
        put(self.ball, visible=bool(joint))
        ours = pulled.by in ("", self._front_end.name)
        follows = "The tool follows the gizmo" if ours else "Somebody else drags the tool"
        put(self.why, content=boxed(text or follows))

    # --- keeping ---

    def _record(self) -> None:
        """Begin to record, or end it."""
        robot, began = self._window.watched, self._began
        if began is None:
            self._named()
            self._began, self.record.label = robot.now, END
            return
        self._began, self.record.label = None, RECORD
        name = self._named()
        text = recorded_program(robot.arm, robot.timeline, began, robot.now, name, TOLERANCE)
        self._front_end.load(name, text.encode())
        motions = text.count("\nMOVE ")
        self._front_end.note(f"{name} has {motions} motions: EXECUTE {name}, LISTP {name}, STORE {name}")

    def _named(self) -> str:
        name = str(self.name.value).strip()
        if not name:
            raise UsageError("a place or a program without a name", "give it a name first")
        return name
