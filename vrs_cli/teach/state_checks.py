"""Kinds of checks of a robot's state: joints, variables, settings, one motion of its timeline."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum
from functools import partial
from typing import Any

from msgspec import Struct

from vrs_cli.engine.settings import PARAMETERS, SWITCHES
from vrs_cli.files.cell_text import MAX_LENGTH_MM, CellEntry
from vrs_cli.kinematics.joints import Profile
from vrs_cli.language.run.variables import Item
from vrs_cli.language.words.values import key_of
from vrs_cli.teach.exercise_text import REQUIRED, BaseCheck, CheckKind, ExerciseText, Key, Place, item_of_text
from vrs_cli.trajectory.instant import LATEST
from vrs_cli.trajectory.segment import Phase
from vrs_cli.values.commands import MotionKind

MAX_REAL = 1e9
CONFIGURATIONS = ("RIGHTY", "LEFTY", "ABOVE", "BELOW", "FLIP", "NOFLIP")


class When(Enum):
    """The time at which joints are checked: the end of the run, or the end of any motion of the step."""

    END = "end"
    PASSED = "passed"


class ValueRange(Struct, frozen=True):
    """Values from `least` to `most`."""

    least: float
    most: float


class Named(Struct, frozen=True):
    """A variable, or the items of a compound location. `text`: the name as written."""

    text: str
    items: tuple[Item, ...]


class JointsCheck(BaseCheck, frozen=True, tag="joints"):
    """Requires joint values [deg, mm]; None: any value. `time`: check them at this time [s] instead of `when`. `count`:
    the number of motions at whose ends they must hold."""

    at: tuple[float | None, ...]
    deg: float
    when: When = When.END
    time: float | None = None
    count: int = 1


class VariableCheck(BaseCheck, frozen=True, tag="variable"):
    """Requires a value of a real or string variable."""

    of: Named
    value: float | str
    within: float


class LocationCheck(BaseCheck, frozen=True, tag="location"):
    """Requires a value of a location, or of a compound such as `table:corner`. `deg` None: any orientation."""

    of: Named
    at: Place
    mm: float
    deg: float | None = None


class ConfigurationCheck(BaseCheck, frozen=True, tag="configuration"):
    """Requires words that describe the arm's configuration at the end."""

    words: tuple[str, ...]


class SettingCheck(BaseCheck, frozen=True, tag="setting"):
    """Requires a switch to be ON or OFF, or a parameter to have a value."""

    of: str
    value: float | str


class MotionCheck(BaseCheck, frozen=True, tag="motion"):
    """Requires one motion of the step with all given properties. `last`: only the motion commanded last counts.

    `seconds`: its duration. `mm`: the distance between its ends. `joints`: the minimum number of joints that turn.
    `begins` [s]. `lead`: from its command to its start [s]. `displaced`: whether it starts at another time than
    requested.
    """

    last: bool = False
    space: MotionKind | None = None
    profile: Profile | None = None
    seconds: ValueRange | None = None
    mm: ValueRange | None = None
    joints: int = 0
    begins: float | None = None
    lead: float = 0.0
    displaced: bool | None = None


class PhasesCheck(BaseCheck, frozen=True, tag="phases"):
    """Requires phases of consecutive segments of the timeline. `only`: there must be no other phases."""

    order: tuple[Phase, ...]
    only: bool = False


class PassesCheck(BaseCheck, frozen=True, tag="passes"):
    """Requires that the tool passes near a place in the step."""

    at: Place
    mm: ValueRange


class UndoneCheck(BaseCheck, frozen=True, tag="undone"):
    """Requires a number of undone commands, which REDO would repeat."""

    commands: int


class ProgramCheck(BaseCheck, frozen=True, tag="program"):
    """Requires a program in memory."""

    of: str


StateCheck = (
    JointsCheck
    | VariableCheck
    | LocationCheck
    | ConfigurationCheck
    | SettingCheck
    | MotionCheck
    | PhasesCheck
    | PassesCheck
    | UndoneCheck
    | ProgramCheck
)

# --- the table --------------------------------------------------------------------------------------------------------


def _whole(text: ExerciseText, entry: CellEntry, key: str) -> int:
    found = text.number(entry, key, 1, 1000)
    if found != int(found):
        text.fault(entry, key, f"{found:g} is no whole number")
    return int(found)


def _joints(text: ExerciseText, entry: CellEntry, key: str) -> tuple[float | None, ...]:
    wanted = 'the joints in degrees, such as [0, -90, 90, 0, 0, 0]; "any" for one that does not count'
    found = text.list_of(entry, key, wanted)
    if len(found) > 32 or not all(one == "any" or _is_number(one) for one in found):
        text.fault(entry, key, wanted)
        return ()
    return tuple(None if one == "any" else float(one) for one in found)


def _range(text: ExerciseText, entry: CellEntry, key: str) -> ValueRange:
    given = entry.given.get(key)
    if isinstance(given, list) and len(given) == 2 and all(map(_is_number, given)) and given[0] <= given[1]:
        return ValueRange(float(given[0]), float(given[1]))
    text.fault(entry, key, f"{text.prefix(given)}the least and the most, such as [0.5, 2]")
    return ValueRange(0.0, 0.0)


def _is_number(given: Any) -> bool:
    return type(given) in (int, float) and abs(given) <= MAX_REAL


def _value(text: ExerciseText, entry: CellEntry, key: str) -> float | str:
    given = entry.given.get(key)
    if isinstance(given, str):
        return text.text(entry, key)
    if _is_number(given):
        return float(given)  # type: ignore[arg-type]
    text.fault(entry, key, f"{text.prefix(given)}a number, or a text in quotes")
    return 0.0


def _variable(text: ExerciseText, entry: CellEntry, key: str) -> Named:
    given = text.text(entry, key)
    found = item_of_text(given.removeprefix("$"))
    if found is None:
        text.fault(entry, key, f"{text.prefix(given)}the name of a variable, such as height, part[2] or $name")
        return Named(given, ())
    name, index = found
    return Named(given, ((f"${name}" if given.startswith("$") else name, index),))


def _location(text: ExerciseText, entry: CellEntry, key: str) -> Named:
    given = text.text(entry, key)
    found = tuple(item_of_text(one) for one in given.split(":"))
    if not all(found):
        text.fault(entry, key, f"{text.prefix(given)}the name of a location, such as part, or table:corner")
    return Named(given, tuple(one for one in found if one is not None))


def _setting(text: ExerciseText, entry: CellEntry, key: str) -> str:
    given = text.text(entry, key).upper()
    if given not in SWITCHES and given not in PARAMETERS:
        text.fault(
            entry, key, f"{text.prefix(given)}a switch ({', '.join(SWITCHES)}) or parameter ({', '.join(PARAMETERS)})"
        )
    return given


def _configuration(text: ExerciseText, entry: CellEntry, key: str) -> tuple[str, ...]:
    found = tuple(one.upper() for one in text.texts(entry, key))
    if unknown := [one for one in found if one not in CONFIGURATIONS]:
        text.fault(entry, key, f"{unknown[0]} is none of {', '.join(CONFIGURATIONS)}")
    return found


def _phases(text: ExerciseText, entry: CellEntry, key: str) -> tuple[Phase, ...]:
    words = {one.value: one for one in Phase}
    found = text.texts(entry, key)
    if unknown := [one for one in found if one not in words]:
        text.fault(entry, key, f"{unknown[0]!r} is none of {', '.join(words)}")
        return ()
    return tuple(words[one] for one in found)


def _space(text: ExerciseText, entry: CellEntry, key: str) -> MotionKind:
    spaces = {"joint": MotionKind.JOINT, "straight": MotionKind.STRAIGHT}
    return spaces.get(text.one_of(entry, key, spaces) or "", MotionKind.JOINT)


_MM = Key(
    "mm", partial(ExerciseText.number, least=0.0, most=MAX_LENGTH_MM, unit="mm"), "how far off it may be [mm]", REQUIRED
)
_DEG = Key("deg", partial(ExerciseText.number, least=0.0, most=180.0, unit="deg"), "how far off it may be [deg]", None)
_SECONDS = partial(ExerciseText.number, least=0.0, most=LATEST, unit="s")
_AT = Key("at", ExerciseText.exercise_place, "the place", REQUIRED)

STATE_KINDS: Mapping[str, CheckKind] = {
    "joints": CheckKind(
        JointsCheck,
        "where the joints are",
        "",
        (
            Key("at", _joints, 'an angle for each joint [deg]; "any": it does not count', REQUIRED),
            _DEG._replace(default=REQUIRED),
            Key(
                "when",
                lambda text, entry, key: When(text.one_of(entry, key, (one.value for one in When)) or When.END),
                '"end", or "passed": at the end of any motion of the step',
                When.END,
            ),
            Key("time", _SECONDS, "when they are looked at [s]", None),
            Key("count", _whole, "at the ends of so many motions", 1),
        ),
    ),
    "variable": CheckKind(
        VariableCheck,
        "the value of a variable",
        "",
        (
            Key("of", _variable, "its name", REQUIRED),
            Key("value", _value, "a number, or a text", REQUIRED),
            Key("within", partial(ExerciseText.number, least=0.0, most=MAX_REAL), "how far off a number may be", 0.0),
        ),
    ),
    "location": CheckKind(
        LocationCheck,
        "the value of a location",
        "",
        (Key("of", _location, "its name, or a compound: table:corner", REQUIRED), _AT, _MM, _DEG),
    ),
    "configuration": CheckKind(
        ConfigurationCheck, "the configuration of the arm", "", (Key("words", _configuration, "its words", REQUIRED),)
    ),
    "setting": CheckKind(
        SettingCheck,
        "a switch or a parameter",
        "",
        (Key("of", _setting, "its name", REQUIRED), Key("value", _value, '"ON" or "OFF", or its value', REQUIRED)),
    ),
    "motion": CheckKind(
        MotionCheck,
        "a motion of the step",
        "",
        (
            Key("last", ExerciseText.switch, "whether it is the one that was commanded last", False),
            Key("space", _space, '"joint" or "straight"', None),
            Key(
                "profile",
                lambda text, entry, key: Profile[text.one_of(entry, key, Profile.__members__) or "LSPB"],
                "LSPB, SCURVE or QUINTIC",
                None,
            ),
            Key("seconds", _range, "how long it takes [s]", None),
            Key("mm", _range, "how far apart its ends are [mm]", None),
            Key("joints", _whole, "how many joints turn at least", 0),
            Key("begins", _SECONDS, "when it begins [s]", None),
            Key("lead", _SECONDS, "how long after its command it begins at least [s]", 0.0),
            Key("displaced", ExerciseText.switch, "whether it begins at another time than asked", None),
        ),
    ),
    "phases": CheckKind(
        PhasesCheck,
        "the phases of the timeline",
        "",
        (
            Key("order", _phases, "accelerate, cruise, blend, decelerate, rest: they follow each other", REQUIRED),
            Key("only", ExerciseText.switch, "whether there are no others", False),
        ),
    ),
    "passes": CheckKind(
        PassesCheck,
        "how near the tool comes to a place in the step",
        "",
        (_AT, Key("mm", _range, "how near [mm]", REQUIRED)),
    ),
    "undone": CheckKind(
        UndoneCheck,
        "commands that are taken back",
        "",
        (Key("commands", _whole, "how many, at least", REQUIRED),),
    ),
    "program": CheckKind(
        ProgramCheck,
        "a program in memory",
        "",
        (Key("of", lambda text, entry, key: key_of(text.text(entry, key)), "its name", REQUIRED),),
    ),
}
