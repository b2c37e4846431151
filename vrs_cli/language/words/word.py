"""Define the rows of the language's tables: the printed form of a word, and facts that the form does not show.

The operands of a word are read from its form on first use, so that parser, checker, help, completion and colours share
one source.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from enum import Enum, Flag
from functools import cached_property
from typing import TypeVar

from msgspec import Struct, structs


class Shape(Enum):
    """The kind of syntax of an argument: a number, a location, a program name and so on."""

    REAL = "real"
    STRING = "string"
    LOCATION = "transformation, a compound of some, or a location function"
    PLACE = "transformation or precision point"
    VARIABLE = "variable"
    REAL_VARIABLE = "real variable"
    LOCATION_VARIABLE = "location to define"
    STRING_VARIABLE = "string variable"
    ELEMENTS = "element of an array of reals, from which on they are read"
    PROGRAM = "program"
    PROGRAM_TEXT = "string that names a program, and its arguments"
    LABEL = "label"
    SIGNALS = "signal number"
    VALUE = "value of any kind"
    ITEM = "real, string or format code"
    FILE = "file name"
    BRANCH = "branch"
    PART = "name of a part, or robot number"
    SWITCH = "switch"
    PARAMETER_NAME = "parameter"
    SETTING = "real or word"
    WORD = "word"
    INSTRUCTION = "instruction"
    GROUP = "number in parentheses"
    UNIT = "logical unit in parentheses, or a variable for its number"
    TASK = "task number, before the others and without a comma"


COMMAS = frozenset({"BY", "="})  # leading words that replace a comma
RAW_SHAPES = frozenset({Shape.FILE, Shape.WORD})  # operands read as typed, up to a blank, a comma or an equals sign
GROUPED = frozenset({Shape.GROUP, Shape.UNIT})  # operands in one pair of parentheses before the other operands

# The shape of an operand in the printed form, by its name. If the row gives no shape either, a name in parentheses is a
# GROUP, one that begins with $ a STRING, and any other name a REAL.
SHAPES: Mapping[str, Shape] = {
    "location": Shape.LOCATION,
    "variable": Shape.VARIABLE,
    "array": Shape.VARIABLE,
    "real": Shape.REAL_VARIABLE,
    "element": Shape.REAL_VARIABLE,
    "$element": Shape.STRING_VARIABLE,
    "program": Shape.PROGRAM,
    "$name(arguments)": Shape.PROGRAM_TEXT,
    "label": Shape.LABEL,
    "signal": Shape.SIGNALS,
    "item": Shape.ITEM,
    "items": Shape.ITEM,
    "file": Shape.FILE,
    "folder": Shape.FILE,
    "name": Shape.BRANCH,
    "part": Shape.PART,
    "switch": Shape.SWITCH,
    "ROBOT": Shape.SWITCH,
    "parameter": Shape.PARAMETER_NAME,
    "axis": Shape.SETTING,
    "word": Shape.WORD,
    "names": Shape.WORD,
    "what": Shape.WORD,
    "rate": Shape.WORD,
    "PAUSE | GO | RATE": Shape.WORD,
    "instruction": Shape.INSTRUCTION,
}

# The words of each modifier, with their meanings, and their notation in a form.
MODIFIERS: Mapping[str, Mapping[str, str]] = {
    "AT": {"AT": "at a time on the timeline, in seconds", "IN": "so many seconds from now"},
    "ALWAYS": {"ALWAYS": "not for the next motion only"},
    "UNIT": {"MMPS": "mm a second", "IPS": "inches a second", "MONITOR": "percent, the monitor speed"},
}
SORT_WORDS: Mapping[str, str] = {  # words between the keyword of a declaration and its variables
    "REAL": "reals",
    "DOUBLE": "reals, as all are in double precision",
    "LOC": "transformations",
}
MODIFIER_FORMS: Mapping[str, str] = {
    "AT": "[AT t | IN dt]",
    "SORT": f"[{' | '.join(SORT_WORDS)}]",
    **{sort: f"[{' | '.join(MODIFIERS[sort])}]" for sort in ("ALWAYS", "UNIT")},
}


class Route(Enum):
    """The four types of command that the analyzer distinguishes."""

    MOTION = "motion"
    POSITION = "position"
    PARAMETER = "parameter"
    PROGRAM = "program"


class Role(Flag):
    """The rights of a user of a robot: to observe it, to move it, or to do both and change its programs and
    settings."""

    OBSERVER = 1
    DESIGNER = 2
    SUPERVISOR = 7  # includes the rights of all other roles

    @property
    def title(self) -> str:
        """Return the name of the highest role. A designer may also observe, but is called a designer."""
        most = Role.SUPERVISOR if Role.SUPERVISOR in self else self & Role.DESIGNER or self
        return str(most.name).lower()

    @property
    def title_with_article(self) -> str:
        return f"an {self.title}" if self is Role.OBSERVER else f"a {self.title}"


class State(Enum):
    """Whether a word is carried out. A REFUSED word is known, but using it gives an error with the reason."""

    SUPPORTED = "supported"
    REFUSED = "not available"


class Argument(Struct, frozen=True):
    """An operand in the form of a word. `lead`: the word before the operand (`STEP dt`), which replaces the comma.

    The leads BY and = only replace the first comma, so that more arguments may follow them.
    """

    name: str
    shape: Shape
    optional: bool = False
    repeated: bool = False
    lead: str = ""


# --- reading the printed form --------------------------------------------------------------------------------------

_PIECE = re.compile(
    r"(?P<mark>[\[\]()=]|\.\.\.)|(?P<lead>[A-Z]+) (?=[a-z$])|(?P<name>[A-Z]+(?: \| [A-Z]+)*|\$?\w+(?:\(\w+\))?)"
)


class PrintedForm(Struct, frozen=True):
    """The operands in a printed form, the value after `=`, and the modifiers."""

    arguments: tuple[Argument, ...]
    value: Argument | None
    modifiers: frozenset[str]


def read_form(text: str, shapes: tuple[Shape, ...] = ()) -> PrintedForm:
    """Read a form without its word. `shapes`: the shapes of the first operands, if their names do not determine them.

    A single operand after `=` is a value. If several operands follow, the sign replaces the first comma.
    """
    modifiers = frozenset(sort for sort, shown in MODIFIER_FORMS.items() if shown in text)
    for sort in modifiers:
        text = text.replace(MODIFIER_FORMS[sort], "")
    operands: list[Argument] = []
    depth, grouped, lead, before = 0, False, "", None
    for piece in _PIECE.finditer(text):
        mark = piece["mark"]
        if mark is None and piece["lead"]:
            lead = piece["lead"]
        elif mark is None:
            name, given = piece["name"], shapes[len(operands) : len(operands) + 1]
            usual = Shape.GROUP if grouped else Shape.STRING if name[0] == "$" else Shape.REAL
            shape = given[0] if given else SHAPES.get(name, usual)
            operands.append(Argument(name, shape, depth > 0, False, lead))
            lead = ""
        elif mark == "...":
            operands[-1] = structs.replace(operands[-1], repeated=True)
        elif mark == "=":
            before = len(operands)
        else:
            depth += {"[": 1, "]": -1}.get(mark, 0)
            grouped = mark == "(" or (grouped and mark != ")")
    value = operands.pop() if before == len(operands) - 1 else None
    if before is not None and value is None:
        operands[before] = structs.replace(operands[before], lead="=")
    if operands and operands[0].shape is Shape.TASK:  # the number of a task becomes the last argument
        operands.append(operands.pop(0))
    return PrintedForm(tuple(operands), value, modifiers)


# --- rows ----------------------------------------------------------------------------------------------------------


class WordRow(Struct, frozen=True, eq=False, dict=True):
    """A word: its printed form, its origin (1 VAL, 2 VAL-II, + V+, blank for our own words), a summary, and an example.

    `note`: a remark; for a refused word, what to write instead. `shapes`: the shapes of the first operands, if their
    names do not determine them (`SHAPES`).
    """

    form: str
    where: str
    summary: str
    example: str
    note: str = ""
    shapes: tuple[Shape, ...] = ()
    state: State = State.SUPPORTED

    @cached_property
    def name(self) -> str:
        return self.form.split(" ", 1)[0]

    @cached_property
    def _read(self) -> PrintedForm:
        return read_form(self.form[len(self.name) :], self.shapes)

    @cached_property
    def arguments(self) -> tuple[Argument, ...]:
        return self._read.arguments

    @cached_property
    def value(self) -> Argument | None:
        """Return the operand after `=`. If it repeats (`STORE file = program, ...`), the values are stored as the last
        arguments."""
        return self._read.value

    @property
    def repeats(self) -> bool:
        """Return whether the last argument of the word may be repeated."""
        return bool(self.arguments) and self.arguments[-1].repeated


class Word(WordRow, frozen=True, eq=False, dict=True):
    """An instruction or a monitor command. `breaks`: the robot comes to rest before it. `role`: the role that may use
    it.

    `drastic`: whether the word immediately (perhaps after a question) deletes, stops, steps or undoes something.
    """

    route: Route = Route.PROGRAM
    breaks: bool = False
    drastic: bool = False
    role: Role = Role.SUPERVISOR

    @cached_property
    def modifiers(self) -> frozenset[str]:
        return self._read.modifiers

    @cached_property
    def required_count(self) -> int:
        return sum(not argument.optional for argument in self.arguments)

    @cached_property
    def operand_shapes(self) -> frozenset[Shape]:
        return frozenset(one.shape for one in (*self.arguments, self.value) if one is not None)

    @cached_property
    def leads(self) -> frozenset[str]:
        return frozenset(argument.lead for argument in self.arguments if argument.lead) - COMMAS

    @cached_property
    def before_comma(self) -> int:
        """Return the number of arguments before the sign that replaces the first comma."""
        return next((place for place, argument in enumerate(self.arguments) if argument.lead in COMMAS), 0)

    @cached_property
    def comma(self) -> str:
        """Return BY or = if it replaces the first comma, otherwise ""."""
        return next((argument.lead for argument in self.arguments if argument.lead in COMMAS), "")

    @property
    def raw(self) -> bool:
        """Return whether the first argument is read as typed."""
        return bool(self.arguments) and self.arguments[0].shape in RAW_SHAPES

    @cached_property
    def plain(self) -> int | None:
        """Return the number of arguments that are separated by commas; None if the last one repeats."""
        between = (one for one in self.arguments if one.lead in {"", *COMMAS})
        return None if self.repeats else sum(one.shape not in {*GROUPED, Shape.TASK} for one in between)

    @cached_property
    def group_size(self) -> int:
        """Return the number of arguments in parentheses before the others."""
        return sum(argument.shape in GROUPED for argument in self.arguments)

    @cached_property
    def takes_task(self) -> bool:
        """Return whether the number of a task may be written before the arguments. It is then stored as the last
        argument."""
        return bool(self.arguments) and self.arguments[-1].shape is Shape.TASK


class Control(Word, frozen=True, eq=False, dict=True):
    """A word of blocks and jumps. The grammar defines the words and values after its first operands."""

    @cached_property
    def _read(self) -> PrintedForm:
        return read_form(re.split(r" (?=[A-Z])|:", self.form[len(self.name) :])[0], self.shapes)

    @property
    def links(self) -> tuple[str, ...]:
        """Return the linking words after its operands, such as THEN and GOTO for IF."""
        return tuple(re.findall(r"[A-Z]+", self.form[len(self.name) :]))


AnyRow = TypeVar("AnyRow", bound=WordRow)


def by_name(words: Iterable[AnyRow]) -> Mapping[str, AnyRow]:
    return {word.name: word for word in words}


def usable_names(*tables: Mapping[str, WordRow]) -> Iterable[str]:
    """Return the names of the words that are available, so that a hint may propose them."""
    return (name for table in tables for name, row in table.items() if row.state is State.SUPPORTED)


# Minimum number of letters of an abbreviated word. One letter is usually a variable: `a` must not mean ABORT. Names
# with two letters are also common (dx, ab), so a drastic word needs three.
MIN_LETTERS, MIN_LETTERS_IF_DRASTIC = 2, 3


def rows_for(typed: str, *tables: Mapping[str, Word]) -> tuple[Word, ...]:
    """Return the rows that a typed word can mean: one, or several if it is ambiguous.

    Earlier tables have precedence, and a complete name has precedence over an abbreviation. A word of VAL or VAL-II may
    be abbreviated if no other word of VAL or VAL-II begins with the same letters; any other word only if no other word
    at all does. A word that is not available is returned only if no other word fits.
    """
    name = typed.upper()
    for table in tables:
        if name in table:
            return (table[name],)
    if len(name) < MIN_LETTERS:
        return ()
    for state in State:
        for table in tables:
            meant = _cut_short(name, [word for word in table.values() if word.state is state])
            if meant:
                too_short = len(meant) == 1 and meant[0].drastic and len(name) < MIN_LETTERS_IF_DRASTIC
                return () if too_short else meant
    return ()


def _cut_short(name: str, words: Iterable[Word]) -> tuple[Word, ...]:
    """Return the words that start with `name`. If one of them is a prefix of all others, return that one alone (MOV:
    MOVE, not MOVES), unless it is a destructive command."""
    found = tuple(word for word in words if word.name.startswith(name))
    old = tuple(word for word in found if "1" in word.where or "2" in word.where)
    if len(old) == 1:
        return old
    shortest = min(found, key=lambda word: len(word.name), default=None)
    if shortest is None or shortest.drastic or not all(word.name.startswith(shortest.name) for word in found):
        return found
    return (shortest,)


def argument_at(row: WordRow, place: int) -> Argument | None:
    """Return the argument at an index. Indexes beyond the last argument belong to an argument or value that repeats."""
    if place < len(row.arguments):
        return row.arguments[place]
    if row.repeats:
        return row.arguments[-1]
    return row.value if row.value is not None and row.value.repeated else None
