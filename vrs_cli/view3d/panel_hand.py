"""The arm moved by hand at a panel: speed, a slider for each joint, and JOG along the axes of the world or the tool.

All of it is JOG and SPEED, as a student would type it, and is shown so. A slider is a JOG once it rests: in real time
a JOG takes the place of what was scheduled, so that the slider may be moved again while the arm is on its way; one JOG
is one step back for UNDO, where a stream of targets would be hundreds.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import viser

from vrs_cli.engine.position import destination_at, position_at
from vrs_cli.interfaces.jog.jogger import STEPS
from vrs_cli.interfaces.session.survey import Surveyed
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.language.words.values import plain
from vrs_cli.view3d.panel_parts import Hands, put
from vrs_cli.view3d.panel_seat import PanelSeat
from vrs_cli.view3d.shown import Shown

RESTS = 0.2  # [s] after which a slider that is moved no more is meant
HELD = 1.0  # [s] after a slider was moved in which it does not follow the arm
LEAST = 0.05  # [mm, deg] that a slider is to move
JOG = "JOG"
WORLD, TOOL, JOINTS = "World", "Tool", "Joints"
MINUS, PLUS = "\N{MINUS SIGN}", "+"
AXES = {WORLD: ("X", "Y", "Z", "RX", "RY", "RZ"), TOOL: ("TX", "TY", "TZ", "TRX", "TRY", "TRZ")}
USUAL_STEP = "10"


class Slider:
    """One joint, or the speed: `wanted` is what its user has set, since the time `at` of the day [s]."""

    def __init__(self, handle: viser.GuiSliderHandle[float]) -> None:
        self.handle = handle
        self.wanted: float | None = None
        self.at = 0.0

    def moved(self, value: float, wall: float) -> None:
        self.wanted, self.at = value, wall

    def taken(self, wall: float) -> float | None:
        """What is meant now, once."""
        if self.wanted is None or wall < self.at + RESTS:
            return None
        wanted, self.wanted = self.wanted, None
        return wanted

    def follow(self, value: float, wall: float) -> None:
        if self.wanted is None and wall > self.at + HELD:
            put(self.handle, value=value)


class HandPanel:
    """`arm`: the robot's, whose joints have names, ranges and units."""

    def __init__(
        self, gui: viser.GuiApi, seat: PanelSeat, hands: Hands, arm: RobotArm, wall: Callable[[], float]
    ) -> None:
        self._seat, self._arm, self._wall = seat, arm, wall
        self._frame = WORLD
        self.leading = gui.add_folder(None)
        with self.leading:
            self.speed = Slider(gui.add_slider("SPEED %", 1.0, 100.0, 1.0, 100.0))
            self.joints = [Slider(self._add_joint(gui, number)) for number in range(1, arm.model.joint_count + 1)]
            self.frame = gui.add_button_group(JOG, (WORLD, TOOL, JOINTS))
            steps = tuple(plain(step) for step in STEPS)
            self.step = gui.add_dropdown("Step mm, deg", steps, initial_value=USUAL_STEP)
            more = ("",) * (arm.model.joint_count - len(AXES[WORLD]))
            self.axes = [gui.add_button_group(name, (MINUS, PLUS)) for name in (*AXES[WORLD], *more)]
        hands.on(self.speed.handle, partial(self._move, self.speed))
        for joint in self.joints:
            hands.on(joint.handle, partial(self._move, joint))
        hands.on(self.frame, self._choose)
        for index, axis in enumerate(self.axes):
            hands.on(axis, partial(self._jog, index))
        self._choose(WORLD)

    def _add_joint(self, gui: viser.GuiApi, number: int) -> viser.GuiSliderHandle[float]:
        model = self._arm.model
        units = model.units
        low, high = (units.one_shown(number, end[number - 1]) for end in (model.lower, model.upper))
        return gui.add_slider(f"Joint {number}", round(low, 1), round(high, 1), 0.1, min(max(0.0, low), high))

    # --- what is done ---

    def _move(self, slider: Slider, value: float) -> None:
        slider.moved(value, self._wall())

    def _choose(self, frame: str) -> None:
        self._frame = frame
        names = self._axes
        for index, axis in enumerate(self.axes):
            put(axis, visible=index < len(names), label=names[index] if index < len(names) else "")

    @property
    def _axes(self) -> tuple[str, ...]:
        numbers = tuple(str(number) for number in range(1, self._arm.model.joint_count + 1))
        return numbers if self._frame == JOINTS else AXES[self._frame]

    def _jog(self, index: int, way: str) -> None:
        self._command(self._axes[index], float(self.step.value) * (1.0 if way == PLUS else -1.0))

    def _command(self, axis: str, amount: float) -> None:
        self._seat.command(f"{JOG} {axis}, {plain(round(amount, 2))}", again=f"{JOG} {axis}")

    # --- what is seen ---

    def refresh(self, shown: Shown, found: Surveyed | None, *, drives: bool) -> None:
        """Do what the sliders mean, and let them follow the arm."""
        put(self.leading, visible=drives)
        wall = self._wall()
        speed = self.speed.taken(wall)
        if speed is not None:
            self._seat.command(f"SPEED {plain(speed)}", again="SPEED")
        elif found is not None:
            self.speed.follow(found.monitor_speed, wall)
        units = self._arm.model.units
        goal = destination_at(self._arm, shown.timeline, shown.timeline.end).joints
        here = position_at(self._arm, shown.timeline, shown.now).joints
        begun = any(text.startswith(JOG) for text in self._seat.waiting.values())  # where that leads is not known yet
        for number, joint in enumerate(self.joints, 1):
            wanted = None if begun else joint.taken(wall)
            change = 0.0 if wanted is None else wanted - units.one_shown(number, goal[number - 1])
            if abs(change) >= LEAST:
                self._command(str(number), change)
            joint.follow(round(units.one_shown(number, here[number - 1]), 1), wall)
