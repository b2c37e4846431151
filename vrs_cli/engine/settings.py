"""The settings of a robot: one value that holds for the motions to come, and is replaced when one of them changes.

Program settings hold for the next motion only, or ALWAYS (V+ Keyword Reference, SPEED).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Generic, TypeVar

from msgspec import Struct, field
from msgspec.structs import replace

from vrs_cli.engine.parameters import (
    ACCELERATION,
    DECELERATION,
    DURATION,
    FULL_SPEED,
    IDLE_PARAMETERS,
    IDLE_SWITCHES,
    MONITOR_SPEED,
    PARAMETERS,
    PROGRAM_SPEED,
    ROTATION_SPEED,
    SWITCHES,
    name_in,
)
from vrs_cli.kinematics.joints import NONE, Configuration
from vrs_cli.kinematics.profile import Profile
from vrs_cli.kinematics.transform import IDENTITY, Transform, at_position, compose
from vrs_cli.values.commands import (
    AlterMode,
    JointTarget,
    Mode,
    NamedTarget,
    SetAcceleration,
    SetAlter,
    SetConfiguration,
    SetDuration,
    SetMode,
    SetMonitorSpeed,
    SetParameter,
    SetSpeed,
    SetSwitch,
    SetSwivel,
    SettingChange,
    Target,
)

V = TypeVar("V")

MM = 1e-3  # [m]


class Setting(Struct, Generic[V], frozen=True):
    """A program setting: the value for always, and one for the next motion only."""

    always: V
    once: V | None = None

    @property
    def present(self) -> V:
        return self.always if self.once is None else self.once

    def put(self, value: V, always: bool) -> Setting[V]:
        return Setting(value) if always else Setting(self.always, value)

    def after_motion(self) -> Setting[V]:
        """Return the setting without the value for one motion."""
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
    """The state of ALTER: the present `displacement`, and where the motion of that `number` would go without it
    (`nominal`).
    """

    mode: AlterMode
    displacement: Transform = IDENTITY
    number: int = -1
    nominal: Transform = IDENTITY

    def with_more(self, displacement: Transform) -> Altered:
        """The same with another displacement."""
        total = displacement
        if self.mode.adds:
            total = self._moved(self.displacement, displacement)
        return replace(self, displacement=total)

    def place(self, T_world_tool: Transform) -> Transform:
        """Return the displaced pose of a tool pose."""
        return self._moved(T_world_tool, self.displacement)

    def _moved(self, T: Transform, by: Transform) -> Transform:
        if not self.mode.world:
            return compose(T, by)
        return at_position(compose(at_position(by, 0.0, 0.0, 0.0), T), T.px + by.px, T.py + by.py, T.pz + by.pz)


class Settings(Struct, frozen=True):
    """All settings of one robot. `acceleration` is a fraction of the nominal one.

    `configuration`: the configuration words said since the last precision point. `hand`: the opening that OPEN or CLOSE
    asked for the next motion.
    """

    monitor_speed: float = FULL_SPEED
    speed: Setting[SetSpeed] = Setting(SetSpeed(FULL_SPEED, FULL_SPEED))
    duration: Setting[float] = Setting(0.0)
    swivel: Setting[SetSwivel] = Setting(SetSwivel(None))
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
        """Return the state of a switch. Raises UsageError for an unknown name, as `parameter` does."""
        return self.switches.get(name_in(SWITCHES, IDLE_SWITCHES, name, "switch"), False)

    def parameter(self, name: str) -> float | str:
        return self.parameters.get(name_in(PARAMETERS, IDLE_PARAMETERS, name, "parameter"), 0.0)

    @property
    def moves(self) -> bool:
        """Whether motions are carried out."""
        return not self.switches["DRY.RUN"]

    @property
    def profile(self) -> Profile:
        return Profile[str(self.parameters["PROFILE"])]

    @property
    def rounding(self) -> float | None:
        """How near a corner the tip comes before it is rounded [m]; None: as near as it is when the arm slows down."""
        value = self.parameters["ROUNDING"]
        return None if isinstance(value, str) else value * MM

    @property
    def inserts(self) -> bool:
        """Whether what is scheduled after a new motion stays."""
        return self.parameters["INSERT"] == "ON"

    @property
    def slowest(self) -> float:
        """How many times a straight line near a singularity is slowed down at most."""
        return float(self.parameters["STRETCH"])

    # --- changing: a new value ---

    def after(self, change: SettingChange) -> Settings:
        """Return the settings after an instruction. Raises IllegalValue for a value out of range, UsageError for an
        unknown name.
        """
        match change:
            case SetSpeed():
                PROGRAM_SPEED[change.unit].checked(change.value)
                if change.rotation is not None:
                    ROTATION_SPEED.checked(change.rotation)
                return replace(self, speed=self.speed.put(change, change.always))
            case SetMonitorSpeed():
                return replace(self, monitor_speed=MONITOR_SPEED.checked(change.percent))
            case SetDuration():
                return replace(self, duration=self.duration.put(DURATION.checked(change.seconds), change.always))
            case SetSwivel():
                return replace(self, swivel=self.swivel.put(change, change.always))
            case SetAcceleration():
                percent = min(ACCELERATION.checked(change.acceleration), FULL_SPEED)
                if change.deceleration is not None:  # the smaller one serves both
                    percent = min(percent, DECELERATION.checked(change.deceleration))
                return replace(self, acceleration=percent / FULL_SPEED)
            case SetAlter():
                return replace(self, alter=None if change.mode is None else Altered(change.mode))
            case SetConfiguration():
                return replace(self, configuration=self.configuration.with_flag(change.flag))
            case SetMode():
                mode = self.modes[change.mode].put(change.on, change.always)
                return replace(self, modes={**self.modes, change.mode: mode})
            case SetParameter():
                name, value = name_in(PARAMETERS, IDLE_PARAMETERS, change.name, "parameter"), change.value
                value = PARAMETERS[name].checked(value) if name in PARAMETERS else value
                return replace(self, parameters={**self.parameters, name: value})
            case SetSwitch():
                name = name_in(SWITCHES, IDLE_SWITCHES, change.name, "switch")
                return replace(self, switches={**self.switches, name: change.on})

    def after_motion(self, target: Target) -> Settings:
        """Return the settings without those of one motion, which it has used. A motion to joints also ends the
        configuration words.
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
