"""Define the rows of the word tables. A row has the printed form of a word (`MOVE location [AT t | IN dt]`), and facts
that the form does not show.

The operands of a word are read from its form on first use, so that parser, checker, help, completion and colours all
depend on one source.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from enum import Enum, Flag
from functools import cached_property
from typing import TypeVar

from msgspec import Struct, structs


class Shape(Enum):
    """The kinds of argument: a number, a location, a program name and so on. The values explain each member."""

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


COMMAS = frozenset({"BY", "="})  # words before an operand that stand in place of a comma
RAW_SHAPES = frozenset({Shape.FILE, Shape.WORD})  # operands read as typed, up to a blank, a comma or an equals sign
GROUPED = frozenset({Shape.GROUP, Shape.UNIT})  # operands that stand in parentheses before the others

# The shape of an operand, by its name in the printed form; a row may override it by its `shapes`. A name that is in
# neither is a GROUP if it stands in parentheses, a STRING if it begins with $, otherwise a REAL.
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

# The words of each modifier with their meanings, by the name of the modifier.
MODIFIERS: Mapping[str, Mapping[str, str]] = {
    "AT": {"AT": "at a time on the timeline, in seconds", "IN": "so many seconds from now"},
    "ALWAYS": {"ALWAYS": "not for the next motion only"},
    "UNIT": {"MMPS": "mm a second", "IPS": "inches a second", "MONITOR": "percent, the monitor speed"},
}
SORT_WORDS: Mapping[str, str] = {  # words after AUTO, LOCAL or GLOBAL that give the kind of the variables
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
    """The type of an instruction or command: what it mainly affects. The analyzer distinguishes these four."""

    MOTION = "motion"
    POSITION = "position"
    PARAMETER = "parameter"
    PROGRAM = "program"


class Role(Flag):
    """The rights of a robot's user: to observe the robot; to move it (a designer of motions); or everything, including
    its programs and settings (a supervisor)."""

    OBSERVER = 1
    DESIGNER = 2
    SUPERVISOR = 7  # includes the rights of all other roles

    @property
    def title(self) -> str:
        """Return the name of the highest role in lower case. A designer who may also observe is called a designer."""
        most = Role.SUPERVISOR if Role.SUPERVISOR in self else self & Role.DESIGNER or self
        return str(most.name).lower()

    @property
    def title_with_article(self) -> str:
        return f"an {self.title}" if self is Role.OBSERVER else f"a {self.title}"


class State(Enum):
    """The availability of a word. Using a REFUSED word is an error, whose message says what to write instead."""

    SUPPORTED = "supported"
    REFUSED = "not available"


class Argument(Struct, frozen=True):
    """An operand of a word, as the printed form of the word shows it (`MOVE location [AT t | IN dt]`). `name`: its name
    there; `shape`: the kind of text that it accepts; `optional`, `repeated`: whether it may be omitted, or given
    several times; `lead`: the word before it in place of a comma (`STEP dt`), or "".

    After the leads BY and =, further arguments may follow with commas.
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
    """The parts of a statement that its printed form shows. `arguments`: the operands; `value`: the operand after `=`,
    or None; `modifiers`: the names of the modifiers."""

    arguments: tuple[Argument, ...]
    value: Argument | None
    modifiers: frozenset[str]


def read_form(text: str, shapes: tuple[Shape, ...] = ()) -> PrintedForm:
    """Read the operands in a printed form, given without its word. `shapes`: the shapes of the first operands, if their
    names do not determine them.

    A single operand after `=` is the `value`. If several operands follow, `=` stands in place of a comma.
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
    if operands and operands[0].shape is Shape.TASK:  # store the task number as the last argument
        operands.append(operands.pop(0))
    return PrintedForm(tuple(operands), value, modifiers)


# --- rows ----------------------------------------------------------------------------------------------------------


class WordRow(Struct, frozen=True, eq=False, dict=True):
    """The row of a word in the tables. `form`: its printed form; `where`: the dialects that have it (1 VAL, 2 VAL-II,
    + V+, blank for words that only vrs has); `summary`, `example`: texts for users; `note`: a remark, or for a refused
    word what to write instead; `shapes`: the shapes of the first operands, if their names do not determine them
    (`SHAPES`).
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
        """Return the operand after `=`, or None. If it repeats (`STORE file = program, ...`), the values are stored
        as the last arguments."""
        return self._read.value

    @property
    def repeats(self) -> bool:
        """Return whether the last argument of the word may be repeated."""
        return bool(self.arguments) and self.arguments[-1].repeated


class Word(WordRow, frozen=True, eq=False, dict=True):
    """The row of an instruction or a monitor command. `route`: its type; `breaks`: whether the program waits until the
    robot is at rest before it; `role`: the role that a user needs for it.

    `drastic`: whether the word deletes, stops, steps or undoes something, so that it needs a longer abbreviation.
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
        """Return the number of arguments before the BY or = that stands in place of a comma; 0 if there is none."""
        return next((place for place, argument in enumerate(self.arguments) if argument.lead in COMMAS), 0)

    @cached_property
    def comma(self) -> str:
        """Return the BY or = that stands in place of a comma, or ""."""
        return next((argument.lead for argument in self.arguments if argument.lead in COMMAS), "")

    @property
    def raw(self) -> bool:
        """Return whether the first argument is read as typed, not as an expression."""
        return bool(self.arguments) and self.arguments[0].shape in RAW_SHAPES

    @cached_property
    def plain(self) -> int | None:
        """Return the number of arguments that are separated by commas; None if the last one repeats."""
        between = (one for one in self.arguments if one.lead in {"", *COMMAS})
        return None if self.repeats else sum(one.shape not in {*GROUPED, Shape.TASK} for one in between)

    @cached_property
    def group_size(self) -> int:
        """Return the number of arguments that stand in parentheses before the others."""
        return sum(argument.shape in GROUPED for argument in self.arguments)

    @cached_property
    def takes_task(self) -> bool:
        """Return whether a task number may be written before the arguments (EXECUTE 2 pick). It is stored as the last
        argument."""
        return bool(self.arguments) and self.arguments[-1].shape is Shape.TASK


class Control(Word, frozen=True, eq=False, dict=True):
    """The table row of a word for a block or a jump, such as FOR. Only the first operand is read from the form; the
    grammar defines the words and values after that operand."""

    @cached_property
    def _read(self) -> PrintedForm:
        return read_form(re.split(r" (?=[A-Z])|:", self.form[len(self.name) :])[0], self.shapes)

    @property
    def links(self) -> tuple[str, ...]:
        """Return the linking words in the form, such as THEN and GOTO for IF."""
        return tuple(re.findall(r"[A-Z]+", self.form[len(self.name) :]))


AnyRow = TypeVar("AnyRow", bound=WordRow)


def by_name(words: Iterable[AnyRow]) -> Mapping[str, AnyRow]:
    return {word.name: word for word in words}


def usable_names(*tables: Mapping[str, WordRow]) -> Iterable[str]:
    """Return the names of the words that are available; hints propose only these."""
    return (name for table in tables for name, row in table.items() if row.state is State.SUPPORTED)


# Minimum number of letters in an abbreviated word: two, because a single letter is usually a variable (`a` must not
# mean ABORT); for a drastic word three, because variables with two letters are also common (dx, ab).
MIN_LETTERS, MIN_LETTERS_IF_DRASTIC = 2, 3


def rows_for(typed: str, *tables: Mapping[str, Word]) -> tuple[Word, ...]:
    """Return the rows that a typed word can mean: one, or several if it is ambiguous; () if none.

    A complete name has precedence over an abbreviation, and earlier tables over later ones. An abbreviation means a
    word of VAL or VAL-II if it fits only one of these, even if it also fits words of V+ or vrs. A refused word is
    returned only if no other word fits.
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
    """Return the words that begin with `name`. Return only one if it is the only one of VAL and VAL-II, or if all
    others begin with it (for MOV: MOVE, not MOVES) and it is not drastic."""
    found = tuple(word for word in words if word.name.startswith(name))
    old = tuple(word for word in found if "1" in word.where or "2" in word.where)
    if len(old) == 1:
        return old
    shortest = min(found, key=lambda word: len(word.name), default=None)
    if shortest is None or shortest.drastic or not all(word.name.startswith(shortest.name) for word in found):
        return found
    return (shortest,)


def argument_at(row: WordRow, place: int) -> Argument | None:
    """Return the argument of a word at an index, or None. For an index beyond the last argument, return the argument or
    value that repeats."""
    if place < len(row.arguments):
        return row.arguments[place]
    if row.repeats:
        return row.arguments[-1]
    return row.value if row.value is not None and row.value.repeated else None
