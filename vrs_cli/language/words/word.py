"""The form of a row in the tables of the language: instructions, monitor commands and, in part, functions.

A row says what a word takes, so that parsing, checking, help, completion and colours read one fact in one place.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property


class Shape(Enum):
    """What an argument is."""

    REAL = "real"
    STRING = "string"
    LOCATION = "transformation, a compound of some, or a location function"
    TRANSFORMATION = "transformation"
    PLACE = "transformation or precision point"
    VARIABLE = "variable"
    REAL_VARIABLE = "real variable"
    LOCATION_VARIABLE = "location to define"
    STRING_VARIABLE = "string variable"
    PROGRAM = "program"
    PROGRAM_TEXT = "string that names a program, and its arguments"
    LABEL = "label"
    SIGNALS = "signal number"
    ITEM = "real, string or format code"
    FILE = "file name"
    BRANCH = "branch"
    SWITCH = "switch"
    PARAMETER_NAME = "parameter"
    SETTING = "real or word"
    WORD = "word"
    INSTRUCTION = "instruction"
    GROUP = "number in parentheses"
    UNIT = "logical unit in parentheses, or a variable for its number"
    TASK = "task number, before the others and without a comma"


COMMAS = frozenset({"BY", "="})  # leads that stand for a comma
RAW_SHAPES = frozenset({Shape.FILE, Shape.WORD})  # read as they stand, up to a blank, a comma or an equals sign
GROUPED = frozenset({Shape.GROUP, Shape.UNIT})  # these stand in one pair of parentheses before the others


SORT_WORDS: Mapping[str, str] = {  # between the word of a declaration and its variables
    "REAL": "reals",
    "DOUBLE": "reals, as all are in double precision",
    "LOC": "transformations",
}


class Route(Enum):
    """The four types of command that the analyzer tells apart."""

    MOTION = "motion"
    POSITION = "position"
    PARAMETER = "parameter"
    PROGRAM = "program"


class State(Enum):
    """Whether a word is carried out. REFUSED words are known, and refused by name with the reason."""

    SUPPORTED = "supported"
    REFUSED = "not available"


@dataclass(frozen=True)
class Argument:
    """A place in the form of a word. `lead`: the word before it (`STEP dt`); it then needs no comma.

    The leads BY and = stand where other words have a comma, so that more arguments may follow them.
    """

    name: str
    shape: Shape
    optional: bool = False
    repeated: bool = False
    lead: str = ""


@dataclass(frozen=True)
class Word:
    """A row: `value` is what follows `=`; `breaks`: the robot comes to rest first; `where`: 1 VAL, 2 VAL-II, + V+.

    A `value` that is repeated (`STORE file = program, ...`) is kept as the arguments after the others.
    `after`: what stands behind the arguments (`WHILE condition DO`).
    `note`: how a refused word is said otherwise, or what is worth knowing.
    `drastic`: with nothing behind it, or after a question, it deletes, stops, steps or takes back at once.
    """

    name: str
    arguments: tuple[Argument, ...]
    route: Route
    summary: str
    example: str
    where: str
    value: Argument | None = None
    modifiers: frozenset[str] = frozenset()
    breaks: bool = False
    state: State = State.SUPPORTED
    note: str = ""
    after: str = ""
    drastic: bool = False

    @property
    def form(self) -> str:
        """`APPRO location, distance [AT t | IN dt]`."""
        sort = f"[{' | '.join(SORT_WORDS)}]" if "SORT" in self.modifiers else ""
        parts = (self.name, sort, _arguments_form(self.arguments), *self._tail())
        return " ".join(part for part in parts if part).replace(" :", ":")

    @property
    def ours(self) -> bool:
        """Whether no VAL or V+ has it."""
        return not self.where.strip()

    def _tail(self) -> Iterable[str]:
        if self.value is not None:
            shown = f"= {_argument_form(self.value)}"
            yield f"[{shown}]" if self.value.optional else shown
        yield self.after
        yield from (form for name, form in _MODIFIER_FORMS if name in self.modifiers)

    @cached_property
    def required(self) -> int:
        """How many arguments it cannot do without."""
        return sum(not argument.optional for argument in self.arguments)

    @cached_property
    def programs(self) -> bool:
        """Whether it names programs."""
        return any(one.shape is Shape.PROGRAM for one in (*self.arguments, self.value) if one is not None)

    @cached_property
    def leads(self) -> frozenset[str]:
        return frozenset(argument.lead for argument in self.arguments if argument.lead) - COMMAS

    @cached_property
    def comma(self) -> str:
        """BY or = where that stands for the first comma, or nothing."""
        return next((argument.lead for argument in self.arguments if argument.lead in COMMAS), "")

    @property
    def raw(self) -> bool:
        """Whether its first argument is read as it stands."""
        return bool(self.arguments) and self.arguments[0].shape in RAW_SHAPES

    @cached_property
    def plain(self) -> int | None:
        """How many arguments stand between commas; None where the last is repeated."""
        between = (one for one in self.arguments if one.lead in {"", *COMMAS})
        return None if self.repeats else sum(one.shape not in {*GROUPED, Shape.TASK} for one in between)

    @property
    def values(self) -> int | None:
        """The same of what follows `=`."""
        return None if self.value is not None and self.value.repeated else 1

    @cached_property
    def grouped(self) -> int:
        """How many of its arguments stand in parentheses before the others."""
        return sum(argument.shape in GROUPED for argument in self.arguments)

    @property
    def tasked(self) -> bool:
        """Whether the number of a task may stand before its arguments; among them it is the last."""
        return bool(self.arguments) and self.arguments[-1].shape is Shape.TASK

    @property
    def repeats(self) -> bool:
        return bool(self.arguments) and self.arguments[-1].repeated


_MODIFIER_FORMS = (("UNIT", "[MMPS | IPS | MONITOR]"), ("ALWAYS", "[ALWAYS]"), ("AT", "[AT t | IN dt]"))


def _argument_form(argument: Argument) -> str:
    shown = f"{argument.lead} {argument.name}".strip()
    return f"{shown}, ..." if argument.repeated else shown


def _arguments_form(arguments: tuple[Argument, ...]) -> str:
    task = "".join(f"[{argument.name}] " for argument in arguments if argument.shape is Shape.TASK)
    group = tuple(argument for argument in arguments if argument.shape in GROUPED)
    others = tuple(argument for argument in arguments if argument.shape not in {*GROUPED, Shape.TASK})
    in_front = f"({_list_form(group)})" if group else ""
    if group and group[0].optional:
        in_front = f"[({_list_form((replace(group[0], optional=False), *group[1:]))})]"
    return task + " ".join(part for part in (in_front, _list_form(others)) if part)


def _list_form(arguments: tuple[Argument, ...]) -> str:
    form = ""
    for number, argument in enumerate(arguments):
        shown = _argument_form(argument)
        before = "" if not number else " " if argument.lead else ", "
        if not argument.optional:
            form += before + shown
        elif before == ", ":
            form += f"[, {shown}]"
        else:
            form += f"{before}[{shown}]"
    return form


MODIFIER_WORDS: Mapping[str, tuple[str, ...]] = {
    "AT": ("AT", "IN"),
    "ALWAYS": ("ALWAYS",),
    "UNIT": ("MMPS", "IPS", "MONITOR"),
}


def by_name(words: Iterable[Word]) -> Mapping[str, Word]:
    """A table of rows, each under its name."""
    return {word.name: word for word in words}


def usable(*tables: Mapping[str, Word]) -> Iterable[str]:
    """The names of the rows that are carried out: what a hint may propose."""
    return (name for table in tables for name, row in table.items() if row.state is State.SUPPORTED)


# To how many letters a word may be cut. One letter is the name of a variable: `a` must not abort. Names of two are
# common, too (dx, ab), so a drastic word needs three.
SHORTEST, SHORTEST_IF_DRASTIC = 2, 3


def abbreviated(typed: str, *tables: Mapping[str, Word]) -> tuple[Word, ...]:
    """What a word as typed can mean: the one row it names, or is cut short from; several if it is ambiguous.

    Earlier tables come first, a full name before any abbreviation. Words of VAL and VAL-II may be cut to whatever
    is unambiguous among themselves; the others only to what leaves them alone.
    """
    name = typed.upper()
    for table in tables:
        if name in table:
            return (table[name],)
    if len(name) < SHORTEST:
        return ()
    for table in tables:
        found = tuple(word for key, word in table.items() if key.startswith(name))
        old = tuple(word for word in found if "1" in word.where or "2" in word.where)
        meant = old if len(old) == 1 else found
        if meant:
            too_short = len(meant) == 1 and meant[0].drastic and len(name) < SHORTEST_IF_DRASTIC
            return () if too_short else meant
    return ()


def argument_at(row: Word, place: int) -> Argument | None:
    """The row's argument of that place; those beyond belong to a repeated one, or to a repeated value."""
    if place < len(row.arguments):
        return row.arguments[place]
    if row.repeats:
        return row.arguments[-1]
    return row.value if row.value is not None and row.value.repeated else None
