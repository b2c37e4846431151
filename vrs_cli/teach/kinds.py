"""Define the kinds of checks in a table: their classes, their judges, and their keys in checks.toml."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import partial
from importlib.util import find_spec
from typing import Any, NamedTuple, cast

from vrs_cli.engine.settings import PARAMETERS, SWITCHES
from vrs_cli.errors import did_you_mean
from vrs_cli.extras import how_to_install
from vrs_cli.files.cell_text import MAX_LENGTH_MM, CellEntry
from vrs_cli.kinematics.joints import Profile
from vrs_cli.language.words.functions import FUNCTIONS, LINKS, OPERATORS
from vrs_cli.language.words.instructions import PROGRAM_WORDS
from vrs_cli.language.words.values import INPUTS, OUTPUTS, key_of
from vrs_cli.teach import checks
from vrs_cli.teach.exercise_text import MODEL, BaseCheck, ExerciseText, ModelPlace, Place, item_of_text
from vrs_cli.teach.judging import outcomes, state, ways
from vrs_cli.teach.judging.basis import JudgedRun, Verdict
from vrs_cli.trajectory.instant import LATEST
from vrs_cli.trajectory.segment import Phase
from vrs_cli.values.commands import MotionKind
from vrs_cli.values.diagnostics import DIALECTS

MAX_REAL = 1e9
CONFIGURATIONS = ("RIGHTY", "LEFTY", "ABOVE", "BELOW", "FLIP", "NOFLIP")
REQUIRED = "required"
WORDS = frozenset({*PROGRAM_WORDS, *FUNCTIONS, *OPERATORS, *LINKS})  # all words that a check of words may name


class Key(NamedTuple):
    """A key that checks of a kind have in checks.toml: its name, the function that reads its value, and its meaning.

    `default`: the value if the key is missing; REQUIRED: the key must not be missing. `field`: the field of the check,
    if its name differs from the key.
    """

    name: str
    read: Callable[[ExerciseText, CellEntry, str], Any]
    what: str
    default: Any
    field: str = ""


class CheckKind(NamedTuple):
    """A kind of check: the class of its data, and the function that judges a run. `what`: the subject of the check, as
    the documentation shows it. `partial`: which runs earn some of the points; "": a run earns either all points or
    none."""

    check: type[BaseCheck]
    judge: Callable[[Any, JudgedRun], Verdict]
    what: str
    partial: str
    keys: tuple[Key, ...]


# --- reading values --------------------------------------------------------------------------------------------------


_millimetres = partial(ExerciseText.number, least=0.0, most=MAX_LENGTH_MM, unit="mm")
_degrees = partial(ExerciseText.number, least=0.0, most=180.0, unit="deg")
_seconds = partial(ExerciseText.number, least=0.0, most=LATEST, unit="s")
_per_second = partial(ExerciseText.number, least=0.0, most=1e6)  # reads a speed [mm/s] or an acceleration [mm/s2]


def _known_place(text: ExerciseText, entry: CellEntry, key: str) -> Place:
    """Read a place that does not depend on the model solution."""
    return _not_of_model(text, entry, key, text.exercise_place(entry, key))


def _not_of_model(text: ExerciseText, entry: CellEntry, key: str, place: Place) -> Place:
    if isinstance(place, ModelPlace):
        text.fault(entry, key, '"model" is a place for tool_at and part_at: give numbers or a given location')
    return place


def _places(text: ExerciseText, entry: CellEntry, key: str) -> tuple[Place, ...]:
    found = text.list_of(entry, key, 'a list of places, such as ["part", [300, 450, -200]]')
    return tuple(_not_of_model(text, entry, key, text.place_of(entry, key, one)) for one in found)


def _pairs(text: ExerciseText, entry: CellEntry, key: str) -> tuple[checks.Pair, ...]:
    """Read pairs of names of objects that may touch each other."""
    found = list[checks.Pair]()
    for one in text.list_of(entry, key, 'a list of pairs, such as [["hand", "box"]]'):
        if not (isinstance(one, list) and len(one) == 2 and all(isinstance(name, str) for name in one)):
            text.fault(entry, key, 'each is a pair of names, such as ["hand", "box"]')
            continue
        first, second = (text.name(entry, key, name, text.bodies, "body") for name in one)
        found.append((first, second))
    return tuple(found)


def _words(text: ExerciseText, entry: CellEntry, key: str) -> tuple[str, ...]:
    """Read words of the language, or the first words of instructions, such as `ENABLE CP`."""
    found = text.texts(entry, key)
    for one in found:
        word = one.upper().split()[0] if one.split() else ""
        if word not in WORDS:
            hint = did_you_mean(word, WORDS, "HELP lists them")
            text.fault(entry, key, f"{one[:40]!r} is no word of the language; {hint}")
    return found


def _span(text: ExerciseText, entry: CellEntry) -> tuple[float, float]:
    """Read the times `after` and `before` of a list item [s]."""
    after, before = (text.seconds(entry, key) for key in ("after", "before"))
    after, before = after or 0.0, LATEST if before is None else before
    if before < after:
        text.fault(entry, "before", f"it is earlier than after, {after:g} s")
    return after, before


def _typed_lines(text: ExerciseText, entry: CellEntry, key: str) -> tuple[checks.TypedText | ModelPlace, ...]:
    if entry.given.get(key) == MODEL:
        return (ModelPlace(),)
    found = []
    for one in text.list_of(entry, key, 'a list of lines, such as ["ready", {pattern = "part [0-9]+", before = 5}]'):
        if isinstance(one, str):
            found.append(checks.TypedText(one))
            continue
        if not isinstance(one, dict) or ("text" in one) is ("pattern" in one):
            text.fault(entry, key, "each is a text, {text = ...} or {pattern = ...}, with after and before if need be")
            continue
        inner = CellEntry(f"{entry.name}{key}: ", text.lines_from(entry, key), one)
        text.check_keys(inner, ("text", "pattern", "after", "before"))
        word = "pattern" if "pattern" in one else "text"
        wanted = text.text(inner, word)
        if word == "pattern":
            try:
                re.compile(wanted)
            except (re.error, OverflowError) as error:
                text.fault(inner, "pattern", f"it is no regular expression: {error}")
        found.append(checks.TypedText(wanted, word == "pattern", *_span(text, inner)))
    return tuple(found)


def _changes(text: ExerciseText, entry: CellEntry, key: str) -> tuple[checks.SignalChange, ...]:
    found = []
    for one in text.list_of(entry, key, "a list of signals, such as [1, {signal = -1, before = 5}]"):
        row = one if isinstance(one, dict) else {"signal": one}
        inner = CellEntry(f"{entry.name}{key}: ", text.lines_from(entry, key), row)
        text.check_keys(inner, ("signal", "after", "before", "since", "near", "mm"))
        signal = text.signal(inner, "signal") or 1
        if abs(signal) not in OUTPUTS:
            text.fault(inner, "signal", f"{signal} is no output: checks look at 1 to 512, which programs set")
        if ("near" in row) is not ("mm" in row):
            text.fault(inner, "near", "near and mm belong together")
        since = text.signal(inner, "since") if "since" in row else None
        if since is not None and since not in INPUTS:
            text.fault(inner, "since", f"{since} is no input: those are 1001 to 1512")
        near = _known_place(text, inner, "near") if "near" in row else None
        mm = _millimetres(text, inner, "mm") if "mm" in row else 0.0
        found.append(checks.SignalChange(signal, *_span(text, inner), since, near, mm))
    return tuple(found)


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


def _range(text: ExerciseText, entry: CellEntry, key: str) -> checks.ValueRange:
    given = entry.given.get(key)
    if isinstance(given, list) and len(given) == 2 and all(map(_is_number, given)) and given[0] <= given[1]:
        return checks.ValueRange(float(given[0]), float(given[1]))
    text.fault(entry, key, f"{text.prefix(given)}the least and the most, such as [0.5, 2]")
    return checks.ValueRange(0.0, 0.0)


def _is_number(given: Any) -> bool:
    return type(given) in (int, float) and abs(given) <= MAX_REAL


def _value(text: ExerciseText, entry: CellEntry, key: str) -> float | str:
    given = entry.given.get(key)
    if isinstance(given, str):
        return text.text(entry, key)
    if _is_number(given):
        return float(given)  # type: ignore[arg-type]  # `_is_number` has checked it
    text.fault(entry, key, f"{text.prefix(given)}a number, or a text in quotes")
    return 0.0


def _variable(text: ExerciseText, entry: CellEntry, key: str) -> checks.Named:
    given = text.text(entry, key)
    found = item_of_text(given.removeprefix("$"))
    if found is None:
        text.fault(entry, key, f"{text.prefix(given)}the name of a variable, such as height, part[2] or $name")
        return checks.Named(given, ())
    name, index = found
    return checks.Named(given, ((f"${name}" if given.startswith("$") else name, index),))


def _location(text: ExerciseText, entry: CellEntry, key: str) -> checks.Named:
    given = text.text(entry, key)
    found = tuple(item_of_text(one) for one in given.split(":"))
    if not all(found):
        text.fault(entry, key, f"{text.prefix(given)}the name of a location, such as part, or table:corner")
    return checks.Named(given, tuple(one for one in found if one is not None))


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


def _when(text: ExerciseText, entry: CellEntry, key: str) -> checks.When:
    return checks.When(text.one_of(entry, key, (one.value for one in checks.When)) or checks.When.END)


def _space(text: ExerciseText, entry: CellEntry, key: str) -> MotionKind:
    spaces = {"joint": MotionKind.JOINT, "straight": MotionKind.STRAIGHT}
    return spaces.get(text.one_of(entry, key, spaces) or "", MotionKind.JOINT)


# --- the table -------------------------------------------------------------------------------------------------------

_AT = Key("at", ExerciseText.exercise_place, "the place", REQUIRED)
_MM = Key("mm", _millimetres, "the greatest distance from the place [mm]", REQUIRED)
_DEG = Key("deg", _degrees, "the greatest error of orientation [deg]; without it, any orientation", None)
_OFFSET = Key(
    "offset", ExerciseText.place, "the offset of the target from the place, in the world [mm]", checks.NO_OFFSET
)
_FROM = Key("from", _known_place, "the place where the path begins", REQUIRED, "begin")
_TO = Key("to", _known_place, "the place where the path ends", REQUIRED, "end")
_ALLOW = Key("allow", _pairs, "pairs that may touch: parts, fixtures, floor, base, link 1, ..., hand", ())
_ONLY_WHERE = (
    Key("around", _known_place, "only near this place", None),
    Key("radius", _millimetres, "the greatest distance from that place [mm]; with around", 0.0),
    Key("from", _known_place, "only on the path from this place; with to", None, "begin"),
    Key("to", _known_place, "the end of that path; the tip passes both places within 1 mm", None, "end"),
    Key("holding", ExerciseText.part, "only while the hand holds this part", ""),
)
_NEAR = "half of the points for up to five times the allowed distance"
_MORE = "half of the points for up to a tenth above the limit"
_EACH = "points in proportion to the correct items, in order"

KINDS: Mapping[str, CheckKind] = {
    "tool_at": CheckKind(
        checks.ToolAtCheck,
        outcomes.judge_tool_at,
        "where the tool's tip is at the end",
        _NEAR,
        (_AT, _MM, _DEG, _OFFSET),
    ),
    "part_at": CheckKind(
        checks.PartAtCheck,
        outcomes.judge_part_at,
        "where a part is at the end",
        _NEAR,
        (Key("part", ExerciseText.part, "the part", REQUIRED), _AT, _MM, _DEG, _OFFSET),
    ),
    "held": CheckKind(
        checks.HeldCheck,
        outcomes.judge_held,
        "what the hand holds at the end",
        "",
        (Key("part", ExerciseText.part, "the part that the hand must hold; without it, the hand must be empty", ""),),
    ),
    "places": CheckKind(
        checks.PlacesCheck,
        ways.judge_places,
        "that the tool's tip passes these places in order",
        _EACH,
        (
            Key("places", _places, "the places", REQUIRED),
            Key("mm", _millimetres, "the greatest distance of the tip from each place [mm]", REQUIRED),
        ),
    ),
    "path": CheckKind(
        checks.PathCheck,
        ways.judge_path,
        "that the tip goes along a straight line, or along an arc",
        _NEAR,
        (
            _FROM,
            _TO,
            Key("via", _known_place, "a place on the arc; without it, the way is a straight line", None),
            Key("mm", _millimetres, "how far from the line or arc, and from its ends, the tip may be [mm]", REQUIRED),
            Key("deg", _degrees, "how far the tool may be turned from the orientation of `from` [deg]", None),
        ),
    ),
    "no_stop": CheckKind(
        checks.NoStopCheck,
        ways.judge_no_stop,
        "that the arm goes from one place to another without a stop",
        "",
        (_FROM, _TO, Key("mm", _millimetres, "the greatest distance of the tip from both places [mm]", REQUIRED)),
    ),
    "keep_out": CheckKind(
        checks.KeepOutCheck,
        ways.judge_keep_out,
        "that the tip does not enter a box",
        "",
        (
            Key("at", _known_place, "the middle of the box; with O, A, T it is turned", REQUIRED),
            Key("size", ExerciseText.size, "its full sizes along X, Y and Z [mm]", REQUIRED),
        ),
    ),
    "contact": CheckKind(
        checks.ContactCheck, outcomes.judge_contact, "that no bodies touch except the allowed pairs", "", (_ALLOW,)
    ),
    "clearance": CheckKind(
        checks.ClearanceCheck,
        outcomes.judge_clearance,
        "that nothing comes too close to the arm",
        "half of the points for at least half the distance",
        (Key("mm", _millimetres, "the smallest allowed distance [mm]", REQUIRED), _ALLOW),
    ),
    "speed": CheckKind(
        checks.SpeedCheck,
        ways.judge_speed,
        "that the tip is not too fast",
        _MORE,
        (Key("mm_s", _per_second, "the greatest speed [mm/s]", REQUIRED), *_ONLY_WHERE),
    ),
    "acceleration": CheckKind(
        checks.AccelerationCheck,
        ways.judge_acceleration,
        "that the tip does not accelerate too much",
        _MORE,
        (Key("mm_s2", _per_second, "the greatest acceleration [mm/s2]", REQUIRED), *_ONLY_WHERE),
    ),
    "cycle_time": CheckKind(
        checks.CycleTimeCheck,
        outcomes.judge_cycle_time,
        "the time of the run until the arm stands, or the time of the path from one place to another",
        _MORE,
        (
            Key("most", _seconds, "the longest time [s]", REQUIRED),
            Key("least", _seconds, "the shortest time [s]", 0.0),
            Key("from", _known_place, "the place where the path begins", None, "begin"),
            Key(
                "to", _known_place, "the place where the path ends; the tip passes both places within 1 mm", None, "end"
            ),
        ),
    ),
    "signals": CheckKind(
        checks.SignalsCheck,
        outcomes.judge_signals,
        "that outputs change in this order and in time",
        _EACH,
        (
            Key(
                "changes",
                _changes,
                "a list of outputs (-1: output 1 goes off), or of {signal, after, before, since, near, mm}: "
                "times [s] after the start or after an input first came on, and a place of the tip",
                REQUIRED,
            ),
            Key("only", ExerciseText.switch, "whether these outputs may have no other changes", False),
        ),
    ),
    "typed": CheckKind(
        checks.TypedCheck,
        outcomes.judge_typed,
        "that TYPE writes these lines in order and in time",
        _EACH,
        (
            Key(
                "lines",
                _typed_lines,
                'a list of texts, {text, after, before} or {pattern, after, before}; or "model", the lines of its run',
                REQUIRED,
            ),
            Key("only", ExerciseText.switch, "whether TYPE may write no other lines", False),
        ),
    ),
    "words": CheckKind(
        checks.WordsCheck,
        outcomes.judge_words,
        "that the program uses some words of the language, or does not use them",
        "points in proportion to the correct words",
        (
            Key("use", _words, "words, or beginnings of instructions, that the program must use", ()),
            Key("avoid", _words, "words, or beginnings of instructions, that the program must not use", ()),
        ),
    ),
    "dialect": CheckKind(
        checks.DialectCheck,
        outcomes.judge_dialect,
        "that all words belong to a dialect",
        "",
        (Key("dialect", ExerciseText.dialect, f"one of {', '.join(DIALECTS)}", REQUIRED),),
    ),
    "like_model": CheckKind(
        checks.LikeModelCheck,
        ways.judge_like_model,
        "that the tip follows the same path as in the model's run",
        _NEAR,
        (
            Key("mm", _millimetres, "the greatest distance from the model's path [mm]", REQUIRED),
            Key("times", ExerciseText.switch, "whether the tip must be there at the same times", False),
            Key("deg", _degrees, "the greatest difference of orientation [deg]; with times", None),
        ),
    ),
    "no_error": CheckKind(
        checks.NoErrorCheck, outcomes.judge_no_error, "that the program ends without an error", "", ()
    ),
    "joints": CheckKind(
        checks.JointsCheck,
        state.judge_joints,
        "the values of the joints",
        "",
        (
            Key(
                "at",
                _joints,
                'a value for each joint [deg; mm if it slides], or "any" for a joint that does not count',
                REQUIRED,
            ),
            Key("deg", _degrees, "the greatest error of each joint [deg]", REQUIRED),
            Key("when", _when, '"end" of the step, or "passed": at the end of any of its motions', checks.When.END),
            Key("time", _seconds, "the time at which they are checked, in place of when [s]", None),
            Key("count", _whole, "the least number of motions that end with these values", 1),
        ),
    ),
    "variable": CheckKind(
        checks.VariableCheck,
        state.judge_variable,
        "the value of a variable",
        "",
        (
            Key("of", _variable, "the name of the variable", REQUIRED),
            Key("value", _value, "a number, or a text", REQUIRED),
            Key(
                "within", partial(ExerciseText.number, least=0.0, most=MAX_REAL), "the greatest error of a number", 0.0
            ),
        ),
    ),
    "location": CheckKind(
        checks.LocationCheck,
        state.judge_location,
        "the value of a location",
        "",
        (
            Key("of", _location, "the name of the location, or a compound: table:corner", REQUIRED),
            _AT,
            Key("mm", _millimetres, "the greatest distance from the place [mm]", REQUIRED),
            Key("deg", _degrees, "the greatest error of orientation [deg]", None),
        ),
    ),
    "configuration": CheckKind(
        checks.ConfigurationCheck,
        state.judge_configuration,
        "the configuration of the arm",
        "",
        (Key("words", _configuration, "words that must be true, such as RIGHTY", REQUIRED),),
    ),
    "setting": CheckKind(
        checks.SettingCheck,
        state.judge_setting,
        "the value of a switch or a parameter",
        "",
        (
            Key("of", _setting, "the name of the switch or parameter", REQUIRED),
            Key("value", _value, '"ON" or "OFF", or the value of the parameter', REQUIRED),
        ),
    ),
    "motion": CheckKind(
        checks.MotionCheck,
        state.judge_motion,
        "that one motion of the step has all these properties",
        "",
        (
            Key("last", ExerciseText.switch, "whether only the motion that was commanded last counts", False),
            Key("space", _space, '"joint" or "straight"', None),
            Key(
                "profile",
                lambda text, entry, key: Profile[text.one_of(entry, key, Profile.__members__) or "LSPB"],
                "LSPB, SCURVE or QUINTIC",
                None,
            ),
            Key("seconds", _range, "its least and greatest duration [s], such as [0.5, 2]", None),
            Key("mm", _range, "the least and greatest distance between its ends [mm]", None),
            Key("joints", _whole, "the least number of joints that turn", 0),
            Key("begins", _seconds, "the time at which it begins [s]", None),
            Key("lead", _seconds, "the least time from its command to its beginning [s]", 0.0),
            Key("displaced", ExerciseText.switch, "whether it begins at another time than its AT asks for", None),
        ),
    ),
    "phases": CheckKind(
        checks.PhasesCheck,
        state.judge_phases,
        "that consecutive segments of the timeline have these phases",
        "",
        (
            Key("order", _phases, "the phases in order: accelerate, cruise, blend, decelerate, rest", REQUIRED),
            Key("only", ExerciseText.switch, "whether the timeline may have no other phases", False),
        ),
    ),
    "passes": CheckKind(
        checks.PassesCheck,
        state.judge_passes,
        "how close the tool comes to a place during the step",
        "",
        (_AT, Key("mm", _range, "the least and greatest value of the smallest distance [mm]", REQUIRED)),
    ),
    "undone": CheckKind(
        checks.UndoneCheck,
        state.judge_undone,
        "that commands are undone",
        "",
        (Key("commands", _whole, "the least number of undone commands", REQUIRED),),
    ),
    "program": CheckKind(
        checks.ProgramCheck,
        state.judge_program,
        "that a program is in memory",
        "",
        (Key("of", lambda text, entry, key: key_of(text.text(entry, key)), "the name of the program", REQUIRED),),
    ),
}
COMMON_KEYS = (
    Key("name", ExerciseText.text, "the name that students see; without it, the kind", ""),
    Key("points", partial(ExerciseText.number, least=0.0, most=1000.0), "the weight of the check", 1.0),
    Key("hint", ExerciseText.text, "advice for students whose program fails the check", ""),
    Key("hidden", ExerciseText.switch, "whether name and reason are hidden from students", False),
    Key("partial", ExerciseText.switch, "whether a nearly right result earns a part of the points", True),
    Key("needs", ExerciseText.texts, "names of checks; if one of them earns nothing, this check earns nothing", ()),
)

# --- reading checks --------------------------------------------------------------------------------------------------


def read_checks(text: ExerciseText) -> tuple[checks.AnyCheck, ...]:
    """Read each [[check]] of a file; record mistakes in `text`. The names of checks must be unique."""
    found, entries = dict[str, checks.AnyCheck](), dict[str, CellEntry]()
    given = text.table.get("check", [])
    for entry in text.entries("check", given, None):
        check = read_check(text, entry)
        if check is None:
            continue
        key = check.name.lower()
        if key in found:
            text.fault(entry, "name", f"{check.name} is the name of another check: give each a name of its own")
        found[key], entries[key] = check, entry
    for key, check in found.items():
        for name in check.needs:
            if name.lower() not in found or name.lower() == key:
                others = ", ".join(other.name for other in found.values() if other is not check)
                text.fault(entries[key], "needs", f"{name[:80]!r} is the name of no other check; there are {others}")
    contacts = [
        entries[key] for key, check in found.items() if isinstance(check, checks.ContactCheck | checks.ClearanceCheck)
    ]
    if contacts and find_spec("mujoco") is None:
        text.fault(contacts[0], "kind", f"checks of contacts need mujoco-core ({how_to_install('mujoco-core')})")
    if not given:
        text.fault(text.whole, "check", "there is none: write [[check]], and below it kind = ...")
    return tuple(found.values())


def read_check(text: ExerciseText, entry: CellEntry) -> checks.AnyCheck | None:
    """Read one [[check]]; return None if it has mistakes."""
    wrong = len(text.wrong)
    name = text.one_of(entry, "kind", KINDS)
    if name is None:
        return None
    kind = KINDS[name]
    keys = (*COMMON_KEYS, *kind.keys)
    text.check_keys(entry, ("kind", *(key.name for key in keys)))
    values = {
        key.field or key.name: key.read(text, entry, key.name)
        if key.name in entry.given or key.default is REQUIRED
        else key.default
        for key in keys
    }
    values["name"] = values["name"] or name
    if len(text.wrong) > wrong:
        return None
    check = cast(checks.AnyCheck, kind.check(**values))
    # report values that contradict each other
    given = entry.given
    match check:
        case checks.StretchCheck() if ("around" in given) is not ("radius" in given):
            text.fault(entry, "around", "around and radius belong together")
        case checks.StretchCheck() | checks.CycleTimeCheck() if ("from" in given) is not ("to" in given):
            text.fault(entry, "from", "from and to belong together")
        case checks.CycleTimeCheck() if check.least > check.most:
            text.fault(entry, "least", f"it is more than most, {check.most:g} s")
        case checks.WordsCheck() if not (check.use or check.avoid):
            text.fault(entry, "use", "nothing is looked for: it needs use or avoid")
        case checks.LikeModelCheck() if check.deg is not None and not check.times:
            text.fault(entry, "deg", "it compares orientations at the same times: write times = true")
    return check if len(text.wrong) == wrong else None
