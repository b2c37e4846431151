"""Define the settings of a robot, and the tables of switches, parameters and number ranges.

The settings are an immutable value that applies to the following motions; a change makes a new value. Program settings
apply to the next motion only, or ALWAYS (V+ Keyword Reference, SPEED).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Generic, TypeVar

from msgspec import Struct, field
from msgspec.structs import replace

from vrs_cli.errors import IllegalValue, UsageError, did_you_mean
from vrs_cli.kinematics.joints import NONE, Configuration, Profile
from vrs_cli.kinematics.transform import IDENTITY, Transform, at_position, compose
from vrs_cli.trajectory.instant import LATEST
from vrs_cli.values import commands
from vrs_cli.values.commands import JointTarget, Mode, NamedTarget, SpeedUnit

V = TypeVar("V")

FULL_SPEED = 100.0  # [%] of nominal speed
SLOWEST_PERCENT = 0.01  # minimum speed and acceleration, in percent of nominal values: a slower motion would take days


class Range(Struct, frozen=True):
    """The range of numbers that an instruction accepts. `word`: the instruction; `what`: how a message calls the
    number.
    """

    word: str
    what: str
    least: float
    most: float
    unit: str = "%"

    def check(self, value: float, given: float | None = None) -> float:
        """Return the value. Raises IllegalValue for a value outside the range, and for NaN. `given`: the number that
        the user wrote, if the value was computed from it.
        """
        if not self.least <= value <= self.most:
            bounds = f"{self.what} from {self.least:g} to {self.most:g} {self.unit}"
            said = f"{self.word} {value if given is None else given:g}"
            raise IllegalValue(said, bounds, value=value, lower=self.least, upper=self.most)
        return value


MONITOR_SPEED = Range("SPEED", "the monitor speed is", SLOWEST_PERCENT, 327.0)  # 327 % is the limit in VAL
PROGRAM_SPEED: Mapping[SpeedUnit, Range] = {
    unit: Range("SPEED", "a speed is", 0.01, 1e5, said)  # a higher speed is reduced to the robot's maximum
    for unit, said in ((SpeedUnit.PERCENT, "%"), (SpeedUnit.MMPS, "mm/s"), (SpeedUnit.IPS, "in/s"))
}
ROTATION_SPEED = Range("SPEED ...,", "a rotation speed is", SLOWEST_PERCENT, 1e5)
JOINT_SPEED = Range("DRIVE ...,", "a speed is", SLOWEST_PERCENT, FULL_SPEED)
ACCELERATION = Range("ACCEL", "an acceleration is", SLOWEST_PERCENT, 1e5)  # values above 100 % count as 100 %
DECELERATION = Range("ACCEL ...,", "a deceleration is", SLOWEST_PERCENT, 1e5)
DELAY = Range("DELAY", "it is a time", 0.0, LATEST, "s")
DURATION = Range("DURATION", "it is a time", 0.0, LATEST, "s")
TIME = Range("AT", "the time of a motion is", 0.0, LATEST, "s")
TIME_FROM_NOW = Range("IN", "the time of a motion is", 0.0, LATEST, "s")


class Switch(Struct, frozen=True):
    """A row of the table of switches."""

    name: str
    default: bool
    summary: str


class Idle(Struct, frozen=True):
    """A switch or a parameter of V+ that has no meaning for a virtual robot. It can be set and read, but has no effect.
    Its name may have an index, for example the number of a robot: `SCALE.ACCEL[1]`.
    """

    name: str
    summary: str


class ParameterRow(Struct, frozen=True):
    """A row of the table of parameters. `words`: the words that are allowed as a value; `numbers`: numbers are allowed
    too.
    """

    name: str
    default: float | str
    summary: str
    unit: str = ""
    least: float = 0.0
    most: float = 1e9
    words: tuple[str, ...] = ()
    numbers: bool = False

    def check(self, value: float | str) -> float | str:
        """Return the value in the form in which it is stored. Raises IllegalValue for a value that the parameter does
        not allow.
        """
        if self.words and (isinstance(value, str) or not self.numbers):
            # the language writes true and false as -1 and 0
            word = value.upper() if isinstance(value, str) else ("ON" if value else "OFF")
            if word in self.words:
                return word
        elif not isinstance(value, str) and self.least <= value <= self.most:
            return value
        right, words = f"a number from {self.least:g} to {self.most:g} {self.unit}".rstrip(), ", ".join(self.words)
        if words:
            right = f"{words} or {right}" if self.numbers else f"one of {words}"
        raise IllegalValue(f"PARAMETER {self.name} = {value}", f"it is {right}")


def _table(*rows: V) -> Mapping[str, V]:
    return {row.name: row for row in rows}  # type: ignore[attr-defined]


SWITCHES: Mapping[str, Switch] = _table(
    Switch("COLLISION", False, "a motion that would touch something is refused; off: it is told"),
    Switch("CP", True, "continuous path: a motion blends into the next when no BREAK stands between them"),
    Switch("DRY.RUN", False, "programs run, the robot does not move"),
    Switch("INTERACTIVE", True, "ask before something is deleted or overwritten"),
    Switch("MESSAGES", True, "TYPE prints"),
    Switch("POWER", True, "arm power; motions are refused without it"),
    Switch("TRACE", False, "print each step of a program as it is executed"),
    Switch("UPPER", True, "strings compare without regard to case"),
    Switch("VPLUS", True, "what V+ alone has can be used; off: it is refused, with what is written instead"),
)

PARAMETERS: Mapping[str, ParameterRow] = _table(
    ParameterRow(
        "CAUSALITY",
        "ABORT",
        "in real time, ABORT: a motion that comes too late is refused; POSTPONE: it begins at the end of the segment",
        words=("ABORT", "POSTPONE"),
    ),
    ParameterRow("CLEARANCE", 0.0, "what comes nearer than that counts as a contact", "mm", 0.0, 1000.0),
    ParameterRow(
        "DIVERGENCE",
        "WARN",
        "if the body is not where the timeline says, OFF: nobody looks; WARN: it is told; HOLD: the body holds, too; "
        "ABORT: the robot stops; RESYNC: the body holds, and is brought back if the cause has passed",
        words=("OFF", "WARN", "HOLD", "ABORT", "RESYNC"),
    ),
    ParameterRow("GRASP.WIDTH", 0.0, "the width of what GRASP finds in the hand; 0: it is empty", "mm", 0.0, 1000.0),
    ParameterRow("HAND.TIME", 0.05, "how long OPENI, CLOSEI and RELAXI wait for the hand", "s", 0.0, 60.0),
    ParameterRow(
        "INSERT",
        "ON",
        "ON: a motion with AT is inserted, later ones stay; OFF: what was scheduled after it is dropped",
        words=("ON", "OFF"),
    ),
    ParameterRow("LATCH.SIGNAL", 0.0, "the signal that LATCH is of; 0: none", "", 0.0, 2512.0),
    ParameterRow(
        "PROFILE",
        "LSPB",
        "velocity profile of motions; " + "; ".join(f"{profile.name}: {profile.summary}" for profile in Profile),
        words=tuple(Profile.__members__),
    ),
    ParameterRow(
        "ROUNDING",
        "DECEL",
        "how near a via point the tool comes before continuous path leaves it; DECEL: until the arm slows down",
        "mm",
        0.0,
        1e4,
        words=("DECEL",),
        numbers=True,
    ),
    ParameterRow(
        "STRETCH",
        20.0,
        "a straight line near a singularity is slowed down at most so many times",
        "",
        1.0,
        1000.0,
    ),
)


# Names: V+ Language Reference Guide, and public programs (val2 section 15). The summaries were written from memory.
IDLE_SWITCHES: Mapping[str, Idle] = _table(
    Idle("AUTO.POWER.OFF", "arm power goes off after every error"),
    Idle("BELT", "conveyor tracking"),
    Idle("DECEL.100", "decelerations are no larger than usual"),
    Idle("DELAY.IN.TOL", "how settling is timed"),
    Idle("FORCE", "a force sensor"),
    Idle("MCP.MESSAGES", "messages on the pendant"),
    Idle("MCS.MESSAGES", "messages of monitor commands in programs"),
    Idle("MONITORS", "windows of the controller"),
    Idle("NETWORK", "the network of the controller"),
    Idle("OBSTACLE", "obstacles around the arm"),
    Idle("RETRY", "the button of the pendant that lets a program go on"),
    Idle("ROBOT", "a robot is connected"),
    Idle("SCALE.ACCEL", "accelerations smaller at small speeds"),
    Idle("SCALE.ACCEL.ROT", "accelerations of turns smaller at small speeds"),
    Idle("SET.SPEED", "PRIME sets the monitor speed"),
    Idle("VISION", "a camera"),
)
IDLE_PARAMETERS: Mapping[str, Idle] = _table(
    Idle("BELT.MODE", "conveyor tracking"),
    Idle("JOG.TIME", "the time of a JOG"),
    Idle("KERMIT.RETRY", "a serial line"),
    Idle("KERMIT.TIMEOUT", "a serial line"),
    Idle("NOT.CALIBRATED", "which robots are not calibrated"),
    Idle("SCREEN.TIMEOUT", "the screen of the controller"),
    Idle("TERMINAL", "the kind of terminal"),
    Idle("VTIMEOUT", "a camera"),
)


SETTINGS: Mapping[str, tuple[Mapping[str, Switch | ParameterRow], Mapping[str, Idle]]] = {
    "switch": (SWITCHES, IDLE_SWITCHES),
    "parameter": (PARAMETERS, IDLE_PARAMETERS),
}  # (settings with effect, settings without effect), by their names in the tables of words


def idle_of(table: Mapping[str, Idle], name: str) -> Idle | None:
    """Return the table row of the setting with this name (with or without an index); None if there is none."""
    return table.get(name.upper().partition("[")[0])


NEW_NAMES = frozenset({"CLEARANCE", "COLLISION"})  # these newer names do not make a prefix of an older name ambiguous


def row_of(table: Mapping[str, V], name: str, what: str) -> V:
    """Return the row with a name, or with a prefix that matches only one name (names in `NEW_NAMES` count only if no
    other name matches). Raises UsageError. `what`: how the message calls the setting.
    """
    upper = name.upper()
    if upper in table:
        return table[upper]
    starting = [known for known in table if known.startswith(upper)]
    older = [known for known in starting if known not in NEW_NAMES] or starting
    if len(older) == 1:
        return table[older[0]]
    raise UsageError(f"there is no {what} {upper}", did_you_mean(upper, table, f"there are {', '.join(table)}"))


def name_in(table: Mapping[str, Switch | ParameterRow], idle: Mapping[str, Idle], name: str, what: str) -> str:
    """Return the full name of a setting, even of a setting without effect. Raises the same UsageError as `row_of`."""
    return row_of(table, name, what).name if idle_of(idle, name) is None else name.upper()


MM = 1e-3  # [m] one millimetre


class Setting(Struct, Generic[V], frozen=True):
    """A program setting: its value `always`, and perhaps a value `once`, for the next motion only."""

    always: V
    once: V | None = None

    @property
    def present(self) -> V:
        return self.always if self.once is None else self.once

    def put(self, value: V, always: bool) -> Setting[V]:
        """Return the setting with a new value, which stays (`always`) or applies to the next motion only."""
        return Setting(value) if always else Setting(self.always, value)

    def after_motion(self) -> Setting[V]:
        """Return the setting without the value that was for one motion only."""
        return self if self.once is None else Setting(self.always)


MODES_AT_START: Mapping[Mode, Setting[bool]] = {
    Mode.CONTINUOUS_PATH: Setting(True),
    Mode.COARSE: Setting(False),
    Mode.NULLING: Setting(True),
    Mode.SINGLE: Setting(False),
    Mode.OVERLAP: Setting(True),
    Mode.INTEGRAL: Setting(False),
}


class Altered(Struct, frozen=True):
    """The state of ALTER: the current `displacement` of targets, and the pose `nominal` to which the motion with this
    `number` would go without the displacement.
    """

    mode: commands.AlterMode
    displacement: Transform = IDENTITY
    number: int = -1
    nominal: Transform = IDENTITY

    def with_more(self, displacement: Transform) -> Altered:
        """Return the state after another displacement."""
        total = displacement
        if self.mode.adds:
            total = self._displace(self.displacement, displacement)
        return replace(self, displacement=total)

    def place(self, T_world_tool: Transform) -> Transform:
        """Return the displaced pose for a tool pose."""
        return self._displace(T_world_tool, self.displacement)

    def _displace(self, T: Transform, by: Transform) -> Transform:
        if not self.mode.world:
            return compose(T, by)
        return at_position(compose(at_position(by, 0.0, 0.0, 0.0), T), T.px + by.px, T.py + by.py, T.pz + by.pz)


class Settings(Struct, frozen=True):
    """All settings of one robot. `acceleration` is a fraction of the nominal acceleration.

    `configuration`: the configuration words given since the last precision point. `hand`: the opening of the hand that
    OPEN or CLOSE requested for the next motion; None if neither did.
    """

    monitor_speed: float = FULL_SPEED
    speed: Setting[commands.SetSpeed] = Setting(commands.SetSpeed(FULL_SPEED, FULL_SPEED))
    duration: Setting[float] = Setting(0.0)
    swivel: Setting[commands.SetSwivel] = Setting(commands.SetSwivel(None))
    acceleration: float = 1.0
    modes: Mapping[Mode, Setting[bool]] = field(default_factory=lambda: MODES_AT_START)
    configuration: Configuration = NONE
    hand: float | None = None
    alter: Altered | None = None
    switches: Mapping[str, bool] = field(default_factory=lambda: {row.name: row.default for row in SWITCHES.values()})
    parameters: Mapping[str, float | str] = field(
        default_factory=lambda: {row.name: row.default for row in PARAMETERS.values()}
    )

    # --- reading ---

    def mode(self, mode: Mode) -> bool:
        return self.modes[mode].present

    def switch(self, name: str) -> bool:
        """Return whether a switch is on. Raises UsageError for an unknown name."""
        on = self.switches.get(name)
        return self.switches.get(name_in(SWITCHES, IDLE_SWITCHES, name, "switch"), False) if on is None else on

    def parameter(self, name: str) -> float | str:
        """Return the value of a parameter. Raises UsageError for an unknown name."""
        return self.parameters.get(name_in(PARAMETERS, IDLE_PARAMETERS, name, "parameter"), 0.0)

    @property
    def moves(self) -> bool:
        """True if motions move the robot: DRY.RUN is off."""
        return not self.switches["DRY.RUN"]

    @property
    def profile(self) -> Profile:
        return Profile[str(self.parameters["PROFILE"])]

    @property
    def rounding(self) -> float | None:
        """The distance [m] from a corner at which the tip may leave its line; None: it may leave where the arm begins
        to slow down.
        """
        value = self.parameters["ROUNDING"]
        return None if isinstance(value, str) else value * MM

    @property
    def inserts(self) -> bool:
        """True if the motions scheduled after a new motion stay."""
        return self.parameters["INSERT"] == "ON"

    @property
    def slowest(self) -> float:
        """The maximum factor by which a straight line near a singularity may be slowed down."""
        return float(self.parameters["STRETCH"])

    # --- changing: a new value ---

    def after(self, change: commands.SettingChange) -> Settings:
        """Return the settings after an instruction. Raises IllegalValue for a value out of range, UsageError for an
        unknown name.
        """
        match change:
            case commands.SetSpeed():
                PROGRAM_SPEED[change.unit].check(change.value)
                if change.rotation is not None:
                    ROTATION_SPEED.check(change.rotation)
                return replace(self, speed=self.speed.put(change, change.always))
            case commands.SetMonitorSpeed():
                return replace(self, monitor_speed=MONITOR_SPEED.check(change.percent))
            case commands.SetDuration():
                return replace(self, duration=self.duration.put(DURATION.check(change.seconds), change.always))
            case commands.SetSwivel():
                return replace(self, swivel=self.swivel.put(change, change.always))
            case commands.SetAcceleration():
                percent = min(ACCELERATION.check(change.acceleration), FULL_SPEED)
                if change.deceleration is not None:  # the robot has a single value for both: the smaller one
                    percent = min(percent, DECELERATION.check(change.deceleration))
                return replace(self, acceleration=percent / FULL_SPEED)
            case commands.SetAlter():
                return replace(self, alter=None if change.mode is None else Altered(change.mode))
            case commands.SetConfiguration():
                return replace(self, configuration=self.configuration.with_flag(change.flag))
            case commands.SetMode():
                mode = self.modes[change.mode].put(change.on, change.always)
                return replace(self, modes={**self.modes, change.mode: mode})
            case commands.SetParameter():
                name, value = name_in(PARAMETERS, IDLE_PARAMETERS, change.name, "parameter"), change.value
                value = PARAMETERS[name].check(value) if name in PARAMETERS else value
                return replace(self, parameters={**self.parameters, name: value})
            case commands.SetSwitch():
                name = name_in(SWITCHES, IDLE_SWITCHES, change.name, "switch")
                return replace(self, switches={**self.switches, name: change.on})

    def after_motion(self, target: commands.Target) -> Settings:
        """Return the settings after a motion, without the values that were for this motion only. A motion to a
        precision point or a named pose also clears the requested configuration words (RIGHTY, ABOVE and so on).
        """
        said = NONE if isinstance(target, JointTarget | NamedTarget) else self.configuration
        settings: tuple[Setting[Any], ...] = (self.speed, self.duration, self.swivel, *self.modes.values())
        if self.hand is None and said is self.configuration and all(setting.once is None for setting in settings):
            return self
        return replace(
            self,
            speed=self.speed.after_motion(),
            duration=self.duration.after_motion(),
            swivel=self.swivel.after_motion(),
            modes={mode: setting.after_motion() for mode, setting in self.modes.items()},
            configuration=said,
            hand=None,
        )
