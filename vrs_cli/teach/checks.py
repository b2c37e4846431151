"""The kinds of checks: one frozen value each, and the table from which they are read and documented."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from msgspec import Struct

from vrs_cli.errors import did_you_mean
from vrs_cli.files.cell_text import FARTHEST, CellEntry
from vrs_cli.kinematics.transform import Vector
from vrs_cli.language.words.functions import FUNCTIONS, LINKS, OPERATORS
from vrs_cli.language.words.instructions import PROGRAM_WORDS
from vrs_cli.teach.check_kind import REQUIRED, BaseCheck, CheckKind, Key
from vrs_cli.teach.exercise_text import ExerciseText
from vrs_cli.teach.places import Place
from vrs_cli.teach.state_checks import STATE_KINDS, StateCheck
from vrs_cli.trajectory.instant import LATEST

MAX_POINTS = 1000.0
NO_OFFSET: Vector = (0.0, 0.0, 0.0)


class ToolAtCheck(BaseCheck, frozen=True, tag="tool_at"):
    """Where the tool's tip is at the end: at `at`, moved by `offset` [m]. `deg` None: any orientation."""

    at: Place
    mm: float
    deg: float | None = None
    offset: Vector = NO_OFFSET


class PartAtCheck(BaseCheck, frozen=True, tag="part_at"):
    """Where a part is at the end: its centre at `at`, moved by `offset` [m]. `deg` None: any orientation."""

    part: str
    at: Place
    mm: float
    deg: float | None = None
    offset: Vector = NO_OFFSET


class NoErrorCheck(BaseCheck, frozen=True, tag="no_error"):
    """The program ends without an error."""


class TypedText(Struct, frozen=True):
    """A line of TYPE that is wanted: the text, or a pattern. It comes between the times `after` and `before` [s]."""

    text: str
    pattern: bool = False
    after: float = 0.0
    before: float = LATEST


class TypedCheck(BaseCheck, frozen=True, tag="typed"):
    """Lines that TYPE writes, in this order. `only`: and no others."""

    lines: tuple[TypedText, ...]
    only: bool = False


class WordsCheck(BaseCheck, frozen=True, tag="words"):
    """WordsCheck that the submission must use, and words that it must not use."""

    use: tuple[str, ...] = ()
    avoid: tuple[str, ...] = ()


AnyCheck = ToolAtCheck | PartAtCheck | NoErrorCheck | TypedCheck | WordsCheck | StateCheck

# --- the table ----------------------------------------------------------------------------------------------------


WORDS = frozenset({*PROGRAM_WORDS, *FUNCTIONS, *OPERATORS, *LINKS})  # of the language


def _millimetres(text: ExerciseText, entry: CellEntry, key: str) -> float:
    return text.number(entry, key, 0.0, FARTHEST, "mm")


def _degrees(text: ExerciseText, entry: CellEntry, key: str) -> float:
    return text.number(entry, key, 0.0, 180.0, "deg")


def _switch(text: ExerciseText, entry: CellEntry, key: str) -> bool:
    return text.switch(entry, key)


def _words(text: ExerciseText, entry: CellEntry, key: str) -> tuple[str, ...]:
    """Read words of the language, or the beginnings of instructions: `ENABLE CP`."""
    found = text.texts(entry, key)
    for one in found:
        word = one.upper().split()[0]
        if word not in WORDS:
            text.fault(entry, key, f"{one[:40]!r} is no word of the language {did_you_mean(word, WORDS)}".rstrip())
    return found


def _typed_lines(text: ExerciseText, entry: CellEntry, key: str) -> tuple[TypedText, ...]:
    found = []
    for one in text.list_of(entry, key, 'a list of lines, such as ["ready", {pattern = "part [0-9]+", before = 5}]'):
        if isinstance(one, str):
            found.append(TypedText(one))
        elif isinstance(one, dict):
            inner = CellEntry(f"{entry.name}{key}: ", text.lines_from(entry, key), one)
            text.check_keys(inner, ("text", "pattern", "after", "before"))
            if ("text" in one) is ("pattern" in one):
                text.fault(inner, "text", "either text, which is exact, or pattern is wanted")
                continue
            word = "pattern" if "pattern" in one else "text"
            after, before = text.seconds(inner, "after"), text.seconds(inner, "before")
            found.append(
                TypedText(text.text(inner, word), word == "pattern", after or 0.0, LATEST if before is None else before)
            )
        else:
            text.fault(entry, key, "each is a text, or {text = ...}, or {pattern = ...}")
    return tuple(found)


_MM = Key("mm", _millimetres, "how far from the place it may be [mm]", REQUIRED)
_DEG = Key("deg", _degrees, "how far its orientation may be off [deg]; without it, any orientation", None)
_AT = Key("at", ExerciseText.exercise_place, "the place", REQUIRED)
_OFFSET = Key("offset", ExerciseText.offset, "from the place to where it is to be, in the world [mm]", NO_OFFSET)
_NEAR = "half the points up to five times as far"

KINDS: Mapping[str, CheckKind] = {
    "tool_at": CheckKind(ToolAtCheck, "where the tool's tip is at the end", _NEAR, (_AT, _MM, _DEG, _OFFSET)),
    "part_at": CheckKind(
        PartAtCheck,
        "where a part is at the end",
        _NEAR,
        (
            Key("part", ExerciseText.part, "the part", REQUIRED),
            _AT,
            _MM,
            _DEG,
            _OFFSET,
        ),
    ),
    "no_error": CheckKind(NoErrorCheck, "that the program ends without an error", "", ()),
    "typed": CheckKind(
        TypedCheck,
        "lines that TYPE writes, in order",
        "as many of the points as lines are found in order",
        (
            Key("lines", _typed_lines, "texts, {text, after, before}, or {pattern, after, before}", REQUIRED),
            Key("only", _switch, "whether no other line may be typed", False),
        ),
    ),
    "words": CheckKind(
        WordsCheck,
        "words of the language that must be used, or must not be",
        "as many of the points as words are right",
        (
            Key("use", _words, "words that must be used", ()),
            Key("avoid", _words, "words that must not be used", ()),
        ),
    ),
    **STATE_KINDS,
}


def _points(text: ExerciseText, entry: CellEntry, key: str) -> float:
    return text.number(entry, key, 0.0, MAX_POINTS)


COMMON_KEYS = (
    Key("name", ExerciseText.text, "what students see; without it, the kind", ""),
    Key("points", _points, "its weight", 1.0),
    Key("hint", ExerciseText.text, "what helps where it fails", ""),
    Key("hidden", _switch, "whether students see neither its name nor its reason", False),
    Key("partial", _switch, "whether a part of the points can be earned", True),
)


def read_check(text: ExerciseText, entry: CellEntry) -> AnyCheck | None:
    """Read one [[check]]; None where it is wrong."""
    wrong = len(text.wrong)
    name = text.one_of(entry, "kind", KINDS)
    if name is None:
        return None
    kind = KINDS[name]
    keys = (*COMMON_KEYS, *kind.keys)
    text.check_keys(entry, ("kind", *(key.name for key in keys)))
    values: dict[str, Any] = {"name": name}
    for key in keys:
        if key.name in entry.given or key.default is REQUIRED:
            values[key.name] = key.read(text, entry, key.name)
        elif key.name != "name":
            values[key.name] = key.default
    return cast(AnyCheck, kind.check(**values)) if len(text.wrong) == wrong else None
