"""Write executed steps in the languages of robot makers and as a Python program. Each language has one class, listed in
`TARGETS`. The facts about the languages come from their makers' publications: the script manual of Universal Robots
(motion module, blends, digital inputs and outputs), the RAPID reference manuals of ABB (confdata, speeddata, zonedata,
tooldata, wobjdata, MoveAbsJ, MoveL), KUKA's KRL reference (PTP, LIN, $APO, TRIGGER; C_DIS after PTP from KSS 8.2
on)."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from math import atan2, degrees, floor, hypot, inf
from typing import ClassVar

from msgspec import Struct

from vrs_cli.convert.steps import (
    SAME_TIME,
    ExecutedRun,
    FramesStep,
    HandStep,
    InputStep,
    MoveStep,
    RunStep,
    SignalStep,
    WaitStep,
)
from vrs_cli.engine.engine import Engine
from vrs_cli.engine.settings import PARAMETERS
from vrs_cli.engine.single_motion import rounding_begins, slowing_segments
from vrs_cli.errors import UsageError
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.joints import Arm, Elbow, Joints, Wrist
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.transform import IDENTITY, Transform, Vector, axis_angle, scaled_vector, to_oat, unit_quaternion
from vrs_cli.kinematics.transform import position as tip
from vrs_cli.language.run.operations import trans
from vrs_cli.values import commands

SLOW = 0.2  # speed of the motion to the start of the run, as a fraction of the maximum joint velocity
UNNAMED = re.compile(r"\W+", re.ASCII)


class Written(Struct, frozen=True):
    """A program in another language. `notes`: constructs that the language cannot express, and facts that a reader must
    know.
    """

    text: str
    notes: tuple[str, ...]


def number(value: float, decimals: int = 4) -> str:
    """Return a number as text without zeros at its end, and never as -0."""
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".")
    return "0" if text in {"-0", ""} else text


def numbers(values: Sequence[float], decimals: int = 4) -> str:
    return ", ".join([number(value, decimals) for value in values])


def mm(T: Transform) -> Vector:
    """Return the position of a pose in millimetres."""
    return scaled_vector(tip(T), 1000.0)


class StepWriter:
    """A writer of the steps of a run, with a method for each kind of step. `axes`: the joint sequences that the
    language can move (R for a joint that turns, P for one that slides); empty: all robots. `signal_count`: the number
    of outputs and of inputs; None: as many as VAL-II has.

    `words`: templates of lines in the target language, by their meaning. In the lines for signals, {0} is one of
    `states`, {1} is NOT for an input that is off, and the `address` follows.
    """

    title: ClassVar[str]
    remark: ClassVar[str]  # characters that begin a comment
    words: ClassVar[Mapping[str, str]] = {}
    states: ClassVar[tuple[str, str]] = ("False", "True")
    hints: ClassVar[tuple[str, ...]] = ()  # facts that a reader must know, added to the notes
    indent: ClassVar[str] = "  "
    axes: ClassVar[tuple[str, ...]] = ()
    max_name_chars: ClassVar[int] = 32
    signal_count: ClassVar[int | None] = None
    says_times: ClassVar[bool] = False

    def __init__(self, run: ExecutedRun, name: str, source: str) -> None:
        self.run, self.arm, self.units = run, run.arm, run.arm.model.units
        self.name, self.source = identifier(name, self.max_name_chars), source
        self.lines, self.notes = list[str](), dict[str, None]()
        self.frames = run.frames
        self.before: MoveStep | None = None  # the last move written
        self.settings = dict[str, str]()  # maps the name of a setting to the last line written to set it
        self.data = dict[tuple[str, str], str]()  # by type and value: the name with which the value was declared

    @classmethod
    def check(cls, model: RobotModel) -> None:
        """Raise UsageError if the language cannot move the joints of a robot."""
        kind = "".join("P" if model.units.slides(joint) else "R" for joint in range(1, model.joint_count + 1))
        if cls.axes and kind not in cls.axes:
            what = f"{cls.title} moves robots with the joints {' or '.join(cls.axes)} (R turns, P slides)"
            raise UsageError(f"{what}, and {model.name} has {kind}", "--to python takes every robot")

    def write(self, stopped: str = "") -> Written:
        """Write all steps. `stopped`: the error that stopped the program; a comment on it follows the steps."""
        if not self.says_times:
            self.note(f"the joints are those of {self.arm.model.name}, axis by axis; places are in its frame")
        steps = self.run.steps
        for place, step in enumerate(steps):
            following = next((one for one in steps[place + 1 :] if isinstance(one, MoveStep | WaitStep)), None)
            self.step(step, following if isinstance(following, MoveStep) else None)
        if stopped:
            self.say(f"{self.remark} here the program stopped: {stopped}")
        self.notes |= dict.fromkeys(self.hints)
        head, foot = self.around()
        return Written(
            "\n".join([*head, *(f"{self.indent}{line}" for line in self.lines), *foot, ""]), tuple(self.notes)
        )

    def step(self, step: RunStep, following: MoveStep | None) -> None:
        """Write a step. `following`: the move after the step, or None if the robot waits first or the run ends."""
        match step:
            case MoveStep():
                self._tell_of(step)
                self.move(step)
                self.before = step
            case FramesStep():
                before, self.frames = self.frames, step.frames
                self.set_frames(before)
            case WaitStep():
                self.wait(step)
            case InputStep():
                waiting = (
                    f": the program waited {step.waited:.3f} s for it"
                    if step.waited > SAME_TIME
                    else " when it is read"
                )
                self.say(f"{self.remark} signal {step.number} is {'on' if step.on else 'off'}{waiting}")
                self._tell_late(step, f"signal {step.number} is read")
                self.input(step)
            case SignalStep() if self.signal_count is not None and step.number > self.signal_count:
                self.cannot(f"{self.title} has no output {step.number}")
            case SignalStep():
                self._tell_late(step, f"signal {step.number}")
                self.signal(step, following)
            case HandStep():
                self._tell_late(step, "the hand")
                if step.opening not in (0.0, 1.0) and not self.says_times:
                    self.cannot(f"the hand {'opens' if step.opens else 'closes'} to {100.0 * step.opening:.0f} %")
                self.hand(step, following)

    def _tell_of(self, move: MoveStep) -> None:
        """Write a comment with the command that caused a move, and notes on what the language cannot express: a start
        time, an interruption, a stream of targets."""
        motion = move.motion
        if motion.text:
            self.say(f"{self.remark} {motion.text}")
        limitations = {
            "follows a stream of targets: written as one motion to its end": motion.kind is commands.MotionKind.STEERED,
            f"begins at {move.time:.3f} s: written without the time": motion.start is commands.Start.AT,
            f"is cut short at {move.end:.3f} s: written up to there, with a stop": move.cut,
        }
        for what, holds in limitations.items():
            if holds and not self.says_times:
                self.cannot(f"{motion.text or 'a motion'} {what}")

    def _tell_late(self, step: RunStep, what: str) -> None:
        if abs(step.late) > SAME_TIME and not self.says_times:
            where = "after the begin" if step.late > 0.0 else "before the end"
            self.cannot(f"{what} at {step.time:.3f} s, {abs(step.late):.3f} s {where} of the motion")

    def note(self, text: str) -> None:
        self.notes[text] = None

    def cannot(self, text: str) -> None:
        """Write a comment, and keep a note, about something that the language cannot express."""
        self.note(text)
        self.say(f"{self.remark} NOT SAID: {text}")

    def say(self, line: str) -> None:
        self.lines.append(line.replace("\n", " "))

    def setting(self, name: str, line: str, request: commands.Request | None = None) -> None:
        """Write a setting, unless it equals the last one written under this name."""
        if self.settings.get(name) != line:
            self.settings[name] = line
            self.do(line, request)

    def do(self, line: str, request: commands.Request | None = None) -> None:  # noqa: ARG002 (PythonWriter uses it)
        self.say(line)

    # --- methods that differ between the languages ---

    def around(self) -> tuple[list[str], list[str]]:
        """Return the lines before and the lines after the steps."""
        raise NotImplementedError

    def move(self, step: MoveStep) -> None:
        raise NotImplementedError

    def frame(self, T: Transform) -> str:
        raise NotImplementedError

    def address(self, place: int) -> tuple[object, ...]:
        """Return the address of an output or input. `place`: its index from 0."""
        return (place + 1,)

    def set_frames(self, before: commands.Frames) -> None:
        for word, old, new in (("tool", before.tool, self.frames.tool), ("base", before.base, self.frames.base)):
            if word in self.words and old != new:
                self.say(self.words[word].format(self.frame(new)))

    def wait(self, step: WaitStep) -> None:
        self.say(self.words["wait"].format(number(step.seconds)))

    def input(self, step: InputStep) -> None:
        place = step.number - commands.FIRST_INPUT
        if self.signal_count is not None and place >= self.signal_count:
            self.cannot(f"{self.title} has no input {step.number}")
            return
        for line in self.words["in"].split("\n"):
            self.say(line.format(self.states[step.on], "" if step.on else "NOT ", *self.address(place)))

    def signal(self, step: SignalStep, following: MoveStep | None) -> None:
        self.switch(self.words["out"].format(self.states[step.on], "", *self.address(step.number - 1)), step, following)

    def hand(self, step: HandStep, following: MoveStep | None) -> None:
        self.switch(self.words["hand"].format(self.states[step.opens]), step, following)

    def switch(self, line: str, step: RunStep, following: MoveStep | None) -> None:  # noqa: ARG002 (KRL uses them)
        """Write a line that changes an output."""
        self.say(line)

    def joint_texts(self, joints: Joints) -> list[str]:
        """Return joints as text in degrees (mm if a joint slides)."""
        return [number(value, 6) for value in self.units.to_display(joints)]

    def heading(self) -> list[str]:
        model = self.arm.model
        return [
            f"{self.remark} {self.source}, as executed in virtual time by vrs, for the joints of {model.title}",
            f"{self.remark} Tried in no simulator of the maker: look at every line before a robot moves.",
        ]


def identifier(name: str, longest: int) -> str:
    """Return a name that every language accepts: letters, digits and underscores, a letter first."""
    plain = UNNAMED.sub("_", name).strip("_")[: longest - 2] or "program"
    return plain if plain[0].isalpha() else f"p_{plain}"


# --- URScript ---------------------------------------------------------------------------------------------------------


class URScriptWriter(StepWriter):
    """A writer of URScript in metres and radians; a pose is p[x, y, z, rotation vector] in the frame of the robot's
    base."""

    title, remark, axes = "URScript", "#", ("RRRRRR",)
    BANK = 8  # number of standard inputs (and outputs); configurable ones follow them
    signal_count = 2 * BANK
    hints = (
        "URScript: signals 1 to 8 are the standard outputs 0 to 7, 9 to 16 the configurable ones, inputs likewise",
        "URScript: the hand is the tool output 0; a pose has no configuration, the joints before it decide",
    )
    words: ClassVar[Mapping[str, str]] = {
        "tool": "set_tcp({})",
        "base": "base = {}",
        "wait": "sleep({})",
        "in": "while get_{2}_digital_in({3}) != {0}:\n  sync()\nend",
        "out": "set_{2}_digital_out({3}, {0})",
        "hand": "hand({0})",
    }

    def around(self) -> tuple[list[str], list[str]]:
        rate = SLOW * min(self.arm.model.max_velocity)
        head = [
            *(f"# {line[2:]}" for line in self.heading()),
            f"def {self.name}():",
            "  def hand(opens):",
            "    set_tool_digital_out(0, opens)",
            "  end",
            f"  set_tcp({self.frame(self.run.frames.tool)})",
            f"  base = {self.frame(self.run.frames.base)}",
            f"  movej([{numbers(self.run.start, 9)}], a={number(rate)}, v={number(rate)})",
        ]
        return head, ["end"]

    def move(self, step: MoveStep) -> None:
        blend = f", r={number(step.blend, 5)}" if step.blend else ""
        rates, target = (step.axis_acceleration, step.axis_speed), f"movej([{numbers(step.joints, 9)}]"
        if step.straight:
            rates = step.tip_acceleration, step.tip_speed
            target = f"movel(pose_trans(base, {self.frame(step.T_world_tool)})"
        self.say(f"{target}, a={number(max(rates[0], 0.01))}, v={number(max(rates[1], 0.001))}{blend})")

    def address(self, place: int) -> tuple[object, ...]:
        return "standard" if place < self.BANK else "configurable", place % self.BANK

    def frame(self, T: Transform) -> str:
        axis, angle = axis_angle(T)
        return f"p[{numbers((*tip(T), *scaled_vector(axis, angle)), 9)}]"


# --- KRL --------------------------------------------------------------------------------------------------------------


class KRLWriter(StepWriter):
    """A writer of KRL in millimetres and degrees; a frame is {X, Y, Z, A, B, C}, with rotations about z, the new y and
    the new x."""

    title, remark, indent, axes, max_name_chars = "KRL", ";", "", ("RRRRRR", "RRRRRRR", "RRPR"), 24
    NAMES = ("A1", "A2", "A3", "A4", "A5", "A6", "E1")
    HAND = 1000  # number of the output that moves the hand
    hints = (f"KRL: signal n is $OUT[n], input 1000+n is $IN[n], the hand is $OUT[{HAND}] (see the first lines)",)
    states = ("FALSE", "TRUE")
    words: ClassVar[Mapping[str, str]] = {
        "tool": "$TOOL = {}",
        "base": "$BASE = {}",
        "wait": "WAIT SEC {}",
        "in": "WAIT FOR {1}$IN[{2}]",
        "out": "$OUT[{2}] = {0}",
        "hand": "HAND = {0}",
    }

    def around(self) -> tuple[list[str], list[str]]:
        head = [
            f"DEF {self.name}()",
            *self.heading(),
            f"SIGNAL HAND $OUT[{self.HAND}]",
            "BAS(#INITMOV, 0)",
            f"$TOOL = {self.frame(self.run.frames.tool)}",
            f"$BASE = {self.frame(self.run.frames.base)}",
            f"BAS(#VEL_PTP, {round(100 * SLOW)})",
            f"PTP {self._axes(self.run.start)}",
        ]
        return head, ["END"]

    def move(self, step: MoveStep) -> None:
        if step.blend:
            self.setting("CDIS", f"$APO.CDIS = {number(1000.0 * step.blend, 2)}")
        if step.straight:
            self.setting("CP", f"$VEL.CP = {number(max(step.tip_speed, 0.001))}")
            self.setting("ORI1", f"$VEL.ORI1 = {number(max(degrees(step.turn_speed), 1.0), 2)}")
            line = f"LIN {self.frame(step.T_world_tool, step.joints[6:])}"
        else:
            self.setting("PTP", f"BAS(#VEL_PTP, {min(max(round(100.0 * step.joint_rate), 1), 100)})")
            line = f"PTP {self._axes(step.joints)}"
        self.say(f"{line}{' C_DIS' if step.blend else ''}")

    def switch(self, line: str, step: RunStep, following: MoveStep | None) -> None:
        """Write a change of an output. An assignment would stop KRL's advance run and prevent blending, so between
        blended motions a TRIGGER is written."""
        if following is not None and (step.late > 0.0 or (self.before is not None and self.before.blend)):
            line = f"TRIGGER WHEN DISTANCE=0 DELAY={round(1000.0 * max(step.late, 0.0))} DO {line}"
        self.say(line)

    def _tell_late(self, step: RunStep, what: str) -> None:
        if step.late < 0.0 or isinstance(step, InputStep):  # TRIGGER can only act later than the start of a motion
            super()._tell_late(step, what)

    def _axes(self, joints: Joints) -> str:
        return (
            "{" + ", ".join(f"{name} {q}" for name, q in zip(self.NAMES, self.joint_texts(joints), strict=False)) + "}"
        )

    def frame(self, T: Transform, more: Joints = ()) -> str:
        pairs = list(zip("XYZ", mm(T), strict=True)) + list(zip("ABC", map(degrees, zyx(T)), strict=True))
        pairs += [("E1", degrees(q)) for q in more]
        return "{" + ", ".join(f"{name} {number(value, 6)}" for name, value in pairs) + "}"


def zyx(T: Transform) -> tuple[float, float, float]:
    """Return the angles of T's rotation about z, the new y and the new x [rad]. If the angle about y is 90 degrees, the
    angle about x is 0."""
    nx, sx, _, _, ny, sy, _, _, nz, sz, az, _ = T
    level = hypot(nx, ny)
    if level < 1e-9:
        return atan2(-sx, sy), atan2(-nz, level), 0.0
    return atan2(ny + 0.0, nx), atan2(-nz, level), atan2(sz + 0.0, az)


# --- RAPID ------------------------------------------------------------------------------------------------------------


class RapidWriter(StepWriter):
    """A writer of RAPID in millimetres, degrees and quaternions (w, x, y, z). Each datum is declared once, before the
    procedure."""

    title, remark, axes, indent = "RAPID", "!", ("RRRRRR", "RRRRRRR", "RRPR"), "    "

    hints = (
        "RAPID: signal n is do<n>, input 1000+n is di<n>, the hand is doHand: these are to be configured",
        "RAPID: the mass of each tool is written as 1 kg at its flange: give its own",
    )
    states = ("0", "1")
    # has no lines for TOOL and BASE, because each motion in RAPID names its tool and frame
    words: ClassVar[Mapping[str, str]] = {
        "wait": "WaitTime {};",
        "in": "WaitDI di{2}, {0};",
        "out": "SetDO do{2}, {0};",
        "hand": "SetDO doHand, {0};",
    }

    def around(self) -> tuple[list[str], list[str]]:
        speed = self._datum("speeddata", speeddata(SLOW, SLOW))
        target = self._datum("jointtarget", jointtarget(self.arm, self.run.start))
        start = f"    MoveAbsJ {target}, {speed}, fine, {self._tool(self.run.frames)};"
        head = [f"MODULE {self.name}", *(f"  {line}" for line in self.heading())]
        for (kind, value), name in sorted(self.data.items(), key=lambda item: [*SHORT].index(item[0][0])):
            head.append(f"  {'PERS' if kind in ('tooldata', 'wobjdata') else 'CONST'} {kind} {name} := {value};")
        return [*head, "  PROC main()", "    ConfL \\Off;", start], ["  ENDPROC", "ENDMODULE"]

    def move(self, step: MoveStep) -> None:
        speed = self._datum("speeddata", speeddata(step.tip_speed, step.turn_speed))
        zone = self._datum("zonedata", zonedata(step.blend)) if step.blend else "fine"
        word, kind, value = "MoveAbsJ", "jointtarget", jointtarget(self.arm, step.joints)
        if step.straight:
            word, kind, value = "MoveL", "robtarget", robtarget(self.arm, step.T_world_tool, step.joints)
        self.say(f"{word} {self._datum(kind, value)}, {speed}, {zone}, {self._tool(self.frames)};")

    def _tool(self, frames: commands.Frames) -> str:
        return (
            f"{self._datum('tooldata', tooldata(frames.tool))}\\WObj:={self._datum('wobjdata', wobjdata(frames.base))}"
        )

    def _datum(self, kind: str, value: str) -> str:
        """Return the name of a value of a type; declare the value at the head of the module if it is new."""
        return self.data.setdefault((kind, value), f"{SHORT[kind]}{1 + sum(known == kind for known, _ in self.data)}")


SHORT = {  # start of the names of data, by type, in the order in which the types are declared
    "tooldata": "tool",
    "wobjdata": "frame",
    "speeddata": "speed",
    "zonedata": "zone",
    "jointtarget": "j",
    "robtarget": "p",
}


def external(axes: Sequence[str] = ()) -> str:
    """Return the text for the external axes of a target, where 9E9 means no axis. The robot's seventh joint, if any, is
    the first of them."""
    return f"[{', '.join([*axes, *['9E9'] * (6 - len(axes))])}]"


def pose(T: Transform) -> str:
    return f"[[{numbers(mm(T), 5)}], [{numbers(unit_quaternion(T), 9)}]]"


def jointtarget(arm: RobotArm, joints: Joints) -> str:
    shown = [number(q, 6) for q in arm.model.units.to_display(joints)]
    return f"[[{', '.join([*shown[:6], *['0'] * (6 - len(shown))])}], {external(shown[6:])}]"


def robtarget(arm: RobotArm, T: Transform, joints: Joints) -> str:
    """Return the robtarget of a pose that the arm reaches with these joints."""
    shown = [number(q, 6) for q in arm.model.units.to_display(joints)]
    return f"{pose(T)[:-1]}, [{', '.join(map(str, confdata(arm, joints)))}], {external(shown[6:])}]"


def confdata(arm: RobotArm, joints: Joints) -> tuple[int, int, int, int]:
    """Return cf1, cf4, cf6, cfx: the quarter turns of axes 1, 4 and 6, and the number of the configuration. cfx is a
    sum: 4 if the wrist is behind axis 1 (RIGHTY), 2 if it is behind the lower arm, 1 if axis 5 is negative. ABOVE is
    defined relative to the side to which the arm reaches, so the second term depends on the first."""
    quarters = [floor(q / 90.0 + 1e-9) for q in map(degrees, joints)]
    cf1, cf4, cf6 = (quarters[k] if k < len(quarters) and not arm.model.units.slides(k + 1) else 0 for k in (0, 3, 5))
    configuration = arm.configuration(joints)
    behind = configuration.arm is Arm.RIGHTY
    folded = (configuration.elbow is Elbow.BELOW) is not behind
    cfx = 4 * behind + 2 * (folded and configuration.elbow is not None) + (configuration.wrist is Wrist.FLIP)
    return cf1, cf4, cf6, cfx


def speeddata(tip_speed: float, turn_speed: float) -> str:
    """Return a speeddata with the tip's speed [m/s] and the tool's angular speed [rad/s]; RAPID has no other speeds for
    a joint motion."""
    return f"[{number(max(1000.0 * tip_speed, 1.0), 1)}, {number(max(degrees(turn_speed), 1.0), 1)}, 5000, 1000]"


def zonedata(blend: float) -> str:
    """Return a zonedata with a radius [m]. Its other values have the same ratios to the radius as in z1 to z200."""
    r = 1000.0 * blend
    return f"[FALSE, {numbers((r, 1.5 * r, 1.5 * r, 0.15 * r, 1.5 * r, 0.15 * r), 2)}]"


def tooldata(T: Transform) -> str:
    return f"[TRUE, {pose(T)}, [1, [0, 0, 1], [1, 0, 0, 0], 0, 0, 0]]"


def wobjdata(T: Transform) -> str:
    return f'[FALSE, TRUE, "", {pose(T)}, {pose(IDENTITY)}]'


# --- Python -----------------------------------------------------------------------------------------------------------


class PythonWriter(StepWriter):
    """A writer of a Python program for the robot of `vrs_cli`. The Python interface has no continuous path, but it has
    start times: a motion that rounds a corner begins when the previous motion slows down. `engine` executes the written
    motions to find these times."""

    title, remark, indent, says_times = "Python", "#", "", True

    def __init__(self, run: ExecutedRun, name: str, source: str) -> None:
        super().__init__(run, name, source)
        self.engine = Engine(self.arm.model, start=run.start)
        self.later = 0.0  # [s] time of an action in the written program minus its time in the run
        self.inputs = list(run.inputs)
        self.taken = 0.0  # [s] part of the next wait that has already passed while the hand moved
        self.settings |= {
            "ACCEL": "ACCEL 100",
            "PROFILE": f"PARAMETER PROFILE = {self.arm.model.profile}",
            "HAND.TIME": f"PARAMETER HAND.TIME = {PARAMETERS['HAND.TIME'].default}",
        }
        self.signals = list[str]()  # changes of inputs, as text for the argument `signals` of Robot
        for request in (commands.SetTool(run.frames.tool), commands.SetBase(run.frames.base)):
            self.engine.perform(request)

    def around(self) -> tuple[list[str], list[str]]:
        self._tell_inputs(inf)
        start = f", start=[{', '.join(self.joint_texts(self.run.start))}]"
        given = f", signals=[{', '.join(self.signals)}]" if self.signals else ""
        head = [
            *self.heading(),
            "from vrs_cli import Robot, trans",
            "",
            f'robot = Robot("{self.arm.model.name}"{start}{given})',
        ]
        head += [f"robot.do({line!r})" for line in frames_lines(commands.Frames(), self.run.frames)]
        return head, []

    def move(self, step: MoveStep) -> None:
        motion, engine = step.motion, self.engine
        profile, rising = motion.profile.name, 100.0 * motion.acceleration
        self.setting("PROFILE", f"PARAMETER PROFILE = {profile}", commands.SetParameter("PROFILE", profile))
        self.setting("ACCEL", f"ACCEL {number(rising)}", commands.SetAcceleration(rising))
        if motion.duration:
            self.do(f"DURATION {number(motion.duration, 9)}", commands.SetDuration(motion.duration))
        target, percent = self.joint_texts(motion.goal or step.joints), number(min(100.0 * motion.speed, 100.0), 6)
        goal: commands.Target = commands.JointTarget(self.units.read(map(float, target)))
        how, fraction = [f"speed={percent}"], float(percent) / 100.0
        if step.straight:
            six = oat_numbers(step.T_world_tool)
            target, goal = [f"trans({', '.join(six)})"], commands.PoseTarget(trans(*map(float, six)))
        if step.straight and motion.tip_speed is not None:
            mmps = number(1000.0 * motion.tip_speed, 6)
            turning = None if motion.rotation is None else number(100.0 * motion.rotation, 6)
            speed = commands.SetSpeed(float(mmps), None if turning is None else float(turning), commands.SpeedUnit.MMPS)
            self.do(f"DO SPEED {mmps}{'' if turning is None else f', {turning}'} MMPS", speed)
            how = []
        stamp = self._stamp(step)
        begins = max(engine.now, engine.end) if stamp is None else stamp
        at = None if stamp is None else commands.Stamp(stamp)
        engine.perform(commands.Move(goal, step.straight, None, fraction if how else None, at))
        self._tell_inputs(step.time)
        self.later = begins - step.time
        how += [] if stamp is None else [f"at={stamp!r}"]
        self.say(f"robot.{'moves' if step.straight else 'move'}({', '.join([*target, *how])})")

    def _stamp(self, step: MoveStep) -> float | None:
        """Return the start time of a motion that interrupts the previous motion [s]; None if it does not interrupt
        it."""
        before, slowing = self.before, slowing_segments(self.engine.timeline)
        if before is None or not (before.rounded or before.cut):
            return None
        rounds = before.rounded and slowing
        return rounding_begins(self.arm, slowing, step.motion.rounding) if rounds else step.time + self.later

    def _tell_inputs(self, until: float) -> None:
        """Add the changes of inputs up to a time of the run [s] to the arguments of Robot."""
        while self.inputs and self.inputs[0][0] <= until:
            t, signal, on = self.inputs.pop(0)
            self.signals.append(f"({number(t + self.later, 9)}, {signal}, {on})")

    def do(self, line: str, request: commands.Request | None = None) -> None:
        self.say(f"robot.do({line!r})")
        if request is not None:
            self.engine.perform(request)

    def set_frames(self, before: commands.Frames) -> None:
        for line in frames_lines(before, self.frames):
            self.do(line)
        for request in (commands.SetTool(self.frames.tool), commands.SetBase(self.frames.base)):
            self.engine.perform(request)

    def wait(self, step: WaitStep) -> None:
        """Write a wait. It is shorter than in the run by the time that the hand takes, and by the time since the end of
        an interrupted motion."""
        left = step.seconds - self.taken - max(self.engine.now - self.engine.end, 0.0)
        self.taken = 0.0
        if left > SAME_TIME:
            self.do(f"DELAY {number(left, 9)}", commands.Delay(left))

    def input(self, step: InputStep) -> None:
        if step.late:
            return
        self._tell_inputs(step.time)
        self._time(step, None)
        self.do(f"WAIT SIG({'' if step.on else '-'}{step.number})")
        self.engine.clock.advance(max(self.engine.now, self.engine.end) + step.waited)

    def signal(self, step: SignalStep, following: MoveStep | None) -> None:
        time = self._time(step, following)
        at = "" if time is None else f" AT {number(time, 9)}"
        self.do(f"SIGNAL {'' if step.on else '-'}{step.number}{at}")

    def hand(self, step: HandStep, following: MoveStep | None) -> None:
        """Write a change of the hand. OPENI waits for the fingers, OPEN acts during the next motion, and a change with
        AT does not wait."""
        word, width, time = "OPEN" if step.opens else "CLOSE", self.arm.model.hand_width, self._time(step, following)
        how_far = f" {number(1000.0 * width * step.opening, 6)}" if width else ""
        if step.duration:
            self.setting("HAND.TIME", f"PARAMETER HAND.TIME = {number(step.duration, 9)}")
        if time is None and following is None and step.duration:
            self.do(f"{word}I{how_far}", commands.Delay(step.duration))
            self.taken = step.duration
        elif time is None and following is not None and not step.duration:
            self.do(f"{word}{how_far}")
        else:
            self.do(f"{word}I{how_far} AT {number(self._begins(following) + step.late, 9)}")

    def _time(self, step: RunStep, following: MoveStep | None) -> float | None:
        """Return the time of an event in the written program, with the same offset from its motion as in the run; None
        (now) if the robot is at rest."""
        if step.late or (following is not None and self._stamp(following) is not None):
            return max(self._begins(following) + step.late, 0.0)
        if self.engine.now < self.engine.end:
            self.say("robot.wait()")
            self.engine.perform(commands.Break())
        return None

    def _begins(self, following: MoveStep | None) -> float:
        """Return the time at which the next motion of the written program begins [s]."""
        stamp = None if following is None else self._stamp(following)
        return max(self.engine.now, self.engine.end) if stamp is None else stamp


def frames_lines(before: commands.Frames, frames: commands.Frames) -> Iterator[str]:
    """Yield the prompt lines that set TOOL and BASE, if these have changed."""
    if frames.tool != before.tool:
        yield f"TOOL TRANS({', '.join(oat_numbers(frames.tool))})"
    if frames.base != before.base:
        turn = degrees(atan2(frames.base.ny, frames.base.nx))  # [deg] rotation of BASE, which can only turn about Z
        yield f"BASE {numbers((*mm(frames.base), turn), 7)}"


def oat_numbers(T: Transform) -> list[str]:
    """Return X, Y, Z [mm] and O, A, T [deg] of a pose."""
    return [number(value, 7) for value in (*mm(T), *map(degrees, to_oat(T)))]


TARGETS: Mapping[str, type[StepWriter]] = {
    "urscript": URScriptWriter,
    "rapid": RapidWriter,
    "krl": KRLWriter,
    "python": PythonWriter,
}
