"""The arm moved by hand at a panel: speed, a slider for each joint, JOG along the axes of world or tool; and the tool
dragged: a gizmo at the tool is the wish, the arm follows, and what holds it is said there.

What is clicked and slid is JOG and SPEED, as a student would type it, and is shown so. A button that is held down moves
the arm until it is let go: the page says ten times a second that it is held, and each time the arm is sent a little
farther, so that it comes to rest by itself where the page, or the connection, is gone. A slider is a JOG once it rests:
in real time a JOG takes the place of what was scheduled, so that the slider may be moved again while the arm is on its
way; one JOG is one step back for UNDO, where a stream of targets would be hundreds.

While nobody drags, the gizmo stands at the tool, along its axes or those of the world. It is there for who may drive,
and while the robot is shown as it is now. What is dragged may be kept: a place under a name, a way as a program.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import degrees, inf

import viser

from vrs_cli.engine.position import destination_at, position_at
from vrs_cli.errors import UsageError
from vrs_cli.interfaces.jog.jogger import SPEEDS, STEPS
from vrs_cli.interfaces.port.far_hand import FarHand
from vrs_cli.interfaces.recording import RECORDED, recorded_program
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import IDENTITY, Transform, at_position, compose, inverse, position
from vrs_cli.language.words.values import plain
from vrs_cli.net import messages
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.render.colours import Ink
from vrs_cli.values.acts import Surveyed
from vrs_cli.values.hand import Axis, DragState, Frame, Limit, Press, Seen, StopJog
from vrs_cli.view3d.panel_front_end import PanelFrontEnd
from vrs_cli.view3d.parts import Act, Hands, Shown, add_choice, boxed, place, put, transform_of
from vrs_cli.view3d.window import RobotWindow

RESTS = 0.2  # [s] after which a slider that is moved no more is meant
HELD = 1.0  # [s] after a slider was moved in which it does not follow the arm
FOLLOWS = 0.15  # [s] at least between two places of a slider that follows it: each wakes two threads, and the page
LEAST = 0.05  # [mm, deg] that a slider is to move
JOG = "JOG"
WORLD, TOOL, JOINTS = "World", "Tool", "Joints"
MINUS, PLUS = "\N{MINUS SIGN}", "+"
HINT = "Click: a step. Hold it down: the arm moves until it is let go"
AXES = {WORLD: ("X", "Y", "Z", "RX", "RY", "RZ"), TOOL: ("TX", "TY", "TZ", "TRX", "TRY", "TRZ")}
FRAMES = {WORLD: Frame.WORLD, TOOL: Frame.TOOL, JOINTS: Frame.JOINT}
USUAL_STEP, USUAL_SPEED = "10", "10"
FASTEST = 50.0  # [%] for a button that is held down: 250 mm/s of a usual arm, the most by hand in ISO 10218-1 (T1)
HOLDING = 10.0  # [1/s] how often the page says that a button is held down
CLICK = 2  # times that it says so of a click, at most
SILENT = 0.35  # [s] without a word of it after which a button is held down no more
FARTHER = 0.5  # [s] at full speed that each word of it leads


class Slider:
    """One joint, or the speed: `wanted` is what its user has set, since the time `at` of the day [s]."""

    def __init__(self, handle: viser.GuiSliderHandle[float]) -> None:
        self.handle = handle
        self.wanted: float | None = None
        self.at, self._followed_at = 0.0, -inf

    def moved(self, value: float, wall: float) -> None:
        self.wanted, self.at = value, wall

    def taken(self, wall: float) -> float | None:
        """The value that the user has set, once, when the slider rests; else None."""
        if self.wanted is None or wall < self.at + RESTS:
            return None
        wanted, self.wanted = self.wanted, None
        return wanted

    def follow(self, value: float, wall: float) -> None:
        if self.wanted is None and wall > self.at + HELD and wall > self._followed_at + FOLLOWS:
            self._followed_at = wall
            put(self.handle, value=value)


def slider_range(model: RobotModel, number: int) -> tuple[float, float, float]:
    """The ends of a joint's slider, and where it begins between them [deg, mm]."""
    low, high = (round(model.units.one_shown(number, end[number - 1]), 1) for end in (model.lower, model.upper))
    return low, high, min(max(0.0, low), high)


class HeldButton:
    """A button of JOG: a click is a step, held down it moves the arm until it is let go. `hold` and `let_go` are called
    for that, `step` for a click.
    """

    def __init__(
        self, handle: viser.GuiButtonHandle, hands: Hands, wall: Callable[[], float], hold: Act, let_go: Act, step: Act
    ) -> None:
        self.handle = handle
        self._hands, self._wall, self._hold, self._let_go, self._step = hands, wall, hold, let_go, step
        self._said, self._at = 0, 0.0  # how often the page has said that it is held, and when last
        self._lost = False  # it was let go because nothing was heard of it
        self._dropped = False  # it is held as it was when the connection to the robot was cut
        handle.on_hold(self._hear, HOLDING)
        handle.on_click(self._clicked)

    @property
    def held(self) -> bool:
        return self._said > 0

    async def _hear(self, _event: object) -> None:
        """The button is held down. It never waits, so events come in the order of the page."""
        self._said, self._at = self._said + 1, self._wall()
        if self._said > CLICK and not self._dropped:
            self._hands.do(self._hold)

    async def _clicked(self, _event: object) -> None:
        """Stop the motion of a button that is let go, or make a step for one that is pressed with the keyboard."""
        dropped, self._dropped = self._dropped, False
        if dropped:
            self._said = 0
        elif self._said > CLICK:
            self._end(self._let_go)
        elif not self._lost:
            self._end(self._step)
        self._lost = False

    def drop(self) -> None:
        """Do nothing any more until the button is let go."""
        self._dropped = self.held

    def look(self, wall: float) -> None:
        """The page is not heard of."""
        if self._said > CLICK and wall > self._at + SILENT:
            self._lost = True
            self._end(self._let_go)

    def _end(self, act: Act) -> None:
        self._said = 0
        self._hands.do(act)


class HandPanel:
    """`arm`: the robot's, whose joints have names, ranges and units."""

    def __init__(
        self, gui: viser.GuiApi, front_end: PanelFrontEnd, hands: Hands, arm: RobotArm, wall: Callable[[], float]
    ) -> None:
        self._front_end, self._arm, self._wall = front_end, arm, wall
        self._frame, self._index = WORLD, 0
        self._hand: FarHand | None = None
        self._told = ""
        self.leading = gui.add_folder(None)
        with self.leading:
            self.speed = Slider(gui.add_slider("SPEED %", 1.0, 100.0, 1.0, 100.0))
            self.joints = []
            for number in range(1, arm.model.joint_count + 1):
                low, high, begin = slider_range(arm.model, number)
                self.joints.append(Slider(gui.add_slider(f"Joint {number}", low, high, 0.1, begin)))
            add_choice(gui, hands, JOG, (WORLD, TOOL, JOINTS), self._choose)
            self.axis = gui.add_button_group("Axis", AXES[WORLD])
            self.buttons = []
            let_go = partial(self._do, StopJog())
            for way, sign in ((MINUS, -1.0), (PLUS, 1.0)):
                button = gui.add_button(f"{way} {AXES[WORLD][0]}", hint=HINT)
                hold, step = partial(self._hold, sign), partial(self._step, sign)
                self.buttons.append(HeldButton(button, hands, wall, hold, let_go, step))
            steps = tuple(plain(step) for step in STEPS)
            self.step = gui.add_dropdown("Click mm, deg", steps, initial_value=USUAL_STEP)
            speeds = tuple(plain(speed) for speed in SPEEDS if speed <= FASTEST)
            self.pace = gui.add_dropdown("Hold %", speeds, initial_value=USUAL_SPEED)
        for slider in (self.speed, *self.joints):
            hands.on(slider.handle, partial(self._move, slider))
        hands.on(self.axis, self._choose_axis)

    # --- what is done ---

    def drop(self) -> None:
        """Forget what is slid and held."""
        for slider in (self.speed, *self.joints):
            slider.wanted = None
        for button in self.buttons:
            button.drop()

    def _move(self, slider: Slider, value: float) -> None:
        slider.moved(value, self._wall())

    def _choose(self, frame: str) -> None:
        self._frame = frame
        put(self.axis, options=self._axes)
        self._choose_axis(self._axes[0])

    def _choose_axis(self, name: str) -> None:
        self._index = self._axes.index(name)
        joint = "Joint " if self._frame == JOINTS else ""
        for button, way in zip(self.buttons, (MINUS, PLUS), strict=True):
            put(button.handle, label=f"{way} {joint}{name}")

    @property
    def _axes(self) -> tuple[str, ...]:
        numbers = tuple(str(number) for number in range(1, self._arm.model.joint_count + 1))
        return numbers if self._frame == JOINTS else AXES[self._frame]

    def _step(self, sign: float) -> None:
        self._command(self._axes[self._index], sign * float(self.step.value))

    def _hold(self, sign: float) -> None:
        """A little farther."""
        axis, speed = Axis(FRAMES[self._frame], self._index), float(self.pace.value)
        self._do(Press(axis, round(sign * FARTHER * speed / 100.0 * full_speed(self._arm.model, axis), 3), speed))

    def _do(self, act: Press | StopJog) -> None:
        """Move or stop the arm; a remark about it is noted once."""
        robot, model = self._front_end.robot, self._arm.model
        if self._hand is None:
            timeline = robot.follow().timeline
            here = position_at(self._arm, timeline, timeline.end)
            self._hand = FarHand(robot.begin, model.joint_count, model.units, Seen(here, here.time))
        said = self._hand.do(act).said
        if said and said != self._told:
            self._front_end.note(said, Ink.WARNING)
        self._told = said if isinstance(act, Press) else ""

    def _command(self, axis: str, amount: float) -> None:
        self._front_end.command(f"{JOG} {axis}, {plain(round(amount, 2))}", again=f"{JOG} {axis}")

    # --- what is seen ---

    def refresh(self, shown: Shown, found: Surveyed | None, *, drives: bool) -> None:
        """Do what the sliders mean, and let them follow the arm."""
        put(self.leading, visible=drives)
        wall = self._wall()
        for button in self.buttons:
            button.look(wall)
        speed = self.speed.taken(wall)
        if speed is not None:
            self._front_end.command(f"SPEED {plain(speed)}", again="SPEED")
        elif found is not None:
            self.speed.follow(found.monitor_speed, wall)
        here = position_at(self._arm, shown.timeline, shown.now).joints
        begun = any(
            text.startswith(JOG) for text in self._front_end.waiting.values()
        )  # where that leads is not known yet
        for number, joint in enumerate(self.joints, 1):
            wanted = None if begun else joint.taken(wall)
            if wanted is not None:  # from where the joint goes, to where it is wanted [deg, mm]
                goal = destination_at(self._arm, shown.timeline, shown.timeline.end).joints
                change = wanted - self._arm.model.units.one_shown(number, goal[number - 1])
                if abs(change) >= LEAST:
                    self._command(str(number), change)
            joint.follow(round(self._arm.model.units.one_shown(number, here[number - 1]), 1), wall)


def full_speed(model: RobotModel, axis: Axis) -> float:
    """Along an axis of JOG, at SPEED 100 [mm/s, deg/s]."""
    if axis.frame is Frame.JOINT:
        return model.units.one_shown(axis.index + 1, model.max_velocity[axis.index])
    return degrees(model.angular_speed) if axis.turns else 1000.0 * model.linear_speed


# --- the tool dragged ------------------------------------------------------------------------------------------------


AGAIN = 0.1  # [s] after which a wish that stays is said again: the robot knows that the hand is there
SIZE = 0.28  # of the reach: the gizmo
LIT = 0.09  # of the reach: the ball at a joint that is at its limit
VISIBLE = 5e-4  # [m] that a tool is away from its wish, to be told
RED = (214, 58, 46)
RECORD, END = "Record a program", "End the program"
BOTH, MOVE, TURN = "Both", "Move", "Turn"  # the motions that the gizmo allows


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
        gui = window.client.gui
        self.on = gui.add_checkbox("Gizmo at the tool (G)", initial_value=True)
        add_choice(gui, hands, "Axes", (TOOL, WORLD), partial(setattr, self, "_along"))
        add_choice(gui, hands, "Drag", (BOTH, MOVE, TURN), self._choose)
        self.why = gui.add_html("")
        self.name = gui.add_text("Name", "part")
        self.here = gui.add_button("HERE", hint="Keep the place under this name")
        self.record = gui.add_button(RECORD, hint="Of what is dragged, under this name", icon=viser.Icon.PLAYER_RECORD)
        hands.on(self.here, lambda _: front_end.command(f"HERE {self._named()}"))
        hands.on(self.record, lambda _: self._record())
        toggle = gui.add_command("Drag the tool, or not", hotkey="G")
        toggle.on_trigger(window.doing(lambda: put(self.on, value=not self.on.value)))
        self.node.on_update(self._pull)
        robot.listen(self._hear)

    def _choose(self, drag: str) -> None:
        put(self.node, disable_axes=drag == TURN, disable_sliders=drag == TURN, disable_rotations=drag == MOVE)

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
        """Forget the wish, until the gizmo is taken again."""
        self._drag_control = self._wish = self._said = None

    def _hear(self, message: messages.ServerMessage) -> None:
        """Hear a message, in the thread of the connection."""
        if isinstance(message, messages.Pulled):
            before, self.pulled = self.pulled, message.state
            if message.state.why and before.by == self._robot.name:
                self._front_end.note(f"The tool is let go: {message.state.why}")

    # --- showing ---

    def show(self, shown: Shown) -> None:
        wish, wall = self._wish, self._window.wall()
        if wish is not None:
            self._window.again(wall + AGAIN)
            if wish != self._said or wall > self._said_at + AGAIN:
                self._said, self._said_at = wish, wall
                self._wish_at(wish)
        live, dragged = self._window.playback.follows, self._drag_control is not None
        tool = self._tool = shown.position.T_world_tool
        may = self._robot.open and self._front_end.may_drive and self.pulled.by in ("", self._robot.name)
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
        ours = pulled.by in ("", self._robot.name)
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
        text = recorded_program(robot.arm, robot.timeline, began, robot.now, name, RECORDED)
        self._front_end.load(name, text.encode())
        motions = text.count("\nMOVE ")
        self._front_end.note(f"{name} has {motions} motions: EXECUTE {name}, LISTP {name}, STORE {name}")

    def _named(self) -> str:
        name = str(self.name.value).strip()
        if not name:
            raise UsageError("a place or a program without a name", "give it a name first")
        return name
