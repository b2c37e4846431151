"""Suggest words that may come next on a line, from the tables of the language and the names defined by users. The
functions are pure: text in, words out. A suggestion replaces the last `start` characters before the cursor. The tables
give the kind of each argument (`Shape`); `names_of` collects the defined names from memory. A signature shows which
arguments a word takes, and which of them is being typed."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from heapq import nsmallest
from itertools import islice

from msgspec import Struct, field

from vrs_cli.engine.settings import PARAMETERS, SWITCHES
from vrs_cli.errors import FileError
from vrs_cli.files.opening import FREE, Folder
from vrs_cli.kinematics.joints import JointUnits
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.text.ast import Program
from vrs_cli.language.words import monitor, values
from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import CONTROL, INSTRUCTIONS, OPERATOR_WORDS
from vrs_cli.language.words.word import MODIFIERS, SORT_WORDS, Argument, Control, Route, Shape, State, Word, rows_for
from vrs_cli.values import numbers, questions

MAX_NAMES = 500  # show at most this many names of one kind in a menu, so that it stays readable


class DefinedNames(Struct, frozen=True):
    """The names that can be suggested, each with a short note. `variables`: a function that returns the variables of a
    kind."""

    programs: Mapping[str, str] = field(default_factory=dict)
    variables: Callable[[values.Kind], Mapping[str, str] | None] = lambda _kind: None
    switches: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, str] = field(default_factory=dict)
    branches: Mapping[str, str] = field(default_factory=dict)
    parts: Mapping[str, str] = field(default_factory=dict)

    def of(self, *kinds: values.Kind) -> dict[str, str]:
        """Return the variables of the given kinds, with their notes."""
        return {name: note for kind in kinds for name, note in (self.variables(kind) or {}).items()}


def names_of(memory: Memory, branches: Iterable[str], parts: Iterable[str] = (), begun: str = "") -> DefinedNames:
    """Return the names that can be suggested: the first programs, variables (including elements of arrays) and parts of
    the cell that start with `begun`, and all switches, parameters and `branches`. A part's name that is not a word is
    quoted. Variables of a kind are collected only when needed, because most lines need one kind or none."""
    programs, begun = memory.programs, begun.lower()
    first = nsmallest(MAX_NAMES, (key for key in programs if key.startswith(begun)))
    written = (name if _NAME.fullmatch(name) else f'"{name}"' for name in parts)

    def variables(kind: values.Kind) -> dict[str, str]:
        return {name: _note(value, memory.units) for name, value in memory.first_variables(kind, MAX_NAMES, begun)}

    return DefinedNames(
        programs={programs[key].name: numbers.count(len(programs[key].program.steps), "step") for key in first},
        variables=variables,
        switches={row.name: row.summary for row in SWITCHES.values()},
        branches=dict.fromkeys(branches, "branch"),
        parts=dict.fromkeys(islice((name for name in written if name.lower().startswith(begun)), MAX_NAMES), "part"),
        parameters={row.name: row.summary for row in PARAMETERS.values()},
    )


def _note(value: numbers.Value, units: JointUnits) -> str:
    if isinstance(value, float | int):
        return values.plain(value)
    if isinstance(value, str):
        return f'"{value}"'
    return " ".join(numbers.decimal(number, 1) for number in values.numbers_of(value, units))


# --- the text before the cursor ------------------------------------------------------------------------------------

# [characters] suggest nothing for longer lines: the time of some searches grows with the square of the length
MAX_LINE_CHARS = 1000
_PREFIX = re.compile(r"[#$]?[A-Za-z][\w.]*$|[#$.]$|\.[A-Za-z]+$")
_OPERAND_BEFORE = re.compile(r"([\w.]+|[\])\"])\s+$")
_NAME = re.compile(r"[A-Za-z][\w.]*")
_NUMBER_TYPED = re.compile(r"(?<![\w.])[0-9][0-9.]*$")
_LABEL = re.compile(r"^\s*\d+\s+")
_FIRST = re.compile(r"\s*(\.?[A-Za-z][\w.]*)")
_GROUP = re.compile(r"\s*\([^()]*\)(?=\s)")
_TARGET = re.compile(r"\s*(?:[#$]?[A-Za-z][\w.]*)\s*(?:\[[^\]]*\]\s*)?=(?!=)")
_QUOTED = re.compile(r'"[^"]*"')
_BY = re.compile(r"\bBY\b", re.IGNORECASE)
_ASSIGNS = re.compile(r"(?<![=<>])=(?![=<>])")
_NESTED = re.compile(r"[#$]?[A-Za-z][\w.]*$")


def innermost(text: str) -> tuple[str, int] | None:
    """Return the function whose argument list is still open at the end of the text, and the index of the argument
    there. The name is "" in brackets that follow no function name. None outside all brackets."""
    before = _BY.sub(",", text)
    if (at := open_bracket(before, "([")) is None:
        return None
    found = _NESTED.search(before[:at].rstrip())
    name = found.group().upper() if found and before[at] == "(" else ""
    return name, top_level(before[at + 1 :]).count(",")


def open_bracket(text: str, opening: str) -> int | None:
    """Return the index of the last bracket in `opening` that has not been closed; None if all are closed."""
    depth, closing = 0, "".join(")" if one == "(" else "]" for one in opening)
    for at in range(len(text) - 1, -1, -1):
        depth += (text[at] in closing) - (text[at] in opening)
        if depth < 0:
            return at
    return None


def top_level(text: str) -> str:
    """Return the text without the contents of parentheses and brackets."""
    kept, depth = [], 0
    for character in text:
        depth += (character in "([") - (character in ")]")
        if depth == 0:
            kept.append(character)
    return "".join(kept)


# --- suggestions for each kind of argument ----------------------------------------------------------------------------

Candidates = Iterable[tuple[str, str]]  # pairs of a word to suggest and its explanation

PLACE_FUNCTIONS = (values.Kind.LOCATION, values.Kind.PRECISION)


def _of(*kinds: values.Kind) -> Callable[[DefinedNames], Candidates]:
    """Return a function that lists the variables and the language's functions of the given kinds."""
    functions = [
        (row.name if row.constant else f"{row.name}(", row.summary)
        for row in FUNCTIONS.values()
        if row.result in kinds and row.state is State.SUPPORTED
    ]
    return lambda names: (*names.of(*kinds).items(), *functions)


_CONSTANTS = {name for name, row in FUNCTIONS.items() if row.constant and row.result is values.Kind.REAL}
_reals, _strings, _places = _of(values.Kind.REAL), _of(values.Kind.STRING), _of(*PLACE_FUNCTIONS)


def _items(names: DefinedNames) -> Candidates:
    return (*_strings(names), *_reals(names))


SHAPES: Mapping[Shape, Callable[[DefinedNames], Candidates]] = {
    Shape.REAL: _reals,
    Shape.SIGNALS: _reals,
    Shape.STRING: _strings,
    Shape.LOCATION: _places,
    Shape.PLACE: _places,
    Shape.VARIABLE: lambda names: names.of(*values.Kind).items(),
    Shape.REAL_VARIABLE: lambda names: names.of(values.Kind.REAL).items(),
    Shape.LOCATION_VARIABLE: lambda names: names.of(*PLACE_FUNCTIONS).items(),
    Shape.STRING_VARIABLE: lambda names: names.of(values.Kind.STRING).items(),
    Shape.PROGRAM: lambda names: names.programs.items(),
    Shape.VALUE: _items,
    Shape.ITEM: _items,
    Shape.SWITCH: lambda names: names.switches.items(),
    Shape.PARAMETER_NAME: lambda names: names.parameters.items(),
    Shape.BRANCH: lambda names: names.branches.items(),
    Shape.PART: lambda names: (*names.parts.items(), (monitor.MEASURED, "where a body measured the robot")),
    Shape.INSTRUCTION: lambda _names: _rows(INSTRUCTIONS),
}


@cache
def _all_words() -> tuple[tuple[str, str], ...]:
    # a name in several tables is explained by the last one
    tables = (FUNCTIONS, CONTROL, INSTRUCTIONS, monitor.COMMANDS)
    return tuple({name: row.summary for table in tables for name, row in table.items()}.items())


_CONNECTING = (
    frozenset({"AT", "IN", "BY", *(lead for word in monitor.COMMANDS.values() for lead in word.leads)}) | OPERATOR_WORDS
)

WORDS: Mapping[str, Callable[[DefinedNames], Candidates]] = {
    "HELP": lambda names: (*_all_words(), *names.switches.items(), *names.parameters.items()),
    "CLOCK": lambda _names: monitor.CLOCK_WORDS.items(),
    "BODY": lambda _names: monitor.BODY_WORDS.items(),
    "RESYNC": lambda _names: {monitor.STOP: "nothing that was scheduled is done"}.items(),
    "JOG": lambda _names: monitor.AXIS_WORDS.items(),
    "PLOT": lambda _names: tuple((name, row.summary) for name, row in monitor.QUANTITIES.items()),
}


def _rows(table: Mapping[str, Word], begun: str = "") -> Candidates:
    """Return those words of a table that are supported and start with `begun`, with their explanations."""
    return (
        (name, explanation(word))
        for name, word in table.items()
        if name.startswith(begun) and word.state is State.SUPPORTED
    )


def explanation(word: Word) -> str:
    """Return the syntax and the meaning of a word, as the note of a suggestion."""
    return f"{word.form}: {word.summary}"


# --- suggestions ---------------------------------------------------------------------------------------------------


def suggestions(
    text: str, names: DefinedNames, folder: Folder = FREE, *, in_program: bool = False, everything: bool = True
) -> list[questions.Suggestion]:
    """Return the words that may continue `text`, best first. `in_program`: the line is a step of a program, not a
    command. `folder`: where files are looked up. If `everything` is false, real functions and constants are suggested
    only after their first letter, because there are so many that they would hide other words."""
    if len(text) > MAX_LINE_CHARS:
        return []
    line = _LABEL.sub("", text, count=1) if in_program else text
    blanked = _QUOTED.sub(lambda quoted: '"' * len(quoted.group()), line)
    if ";" in blanked or blanked.count('"') % 2 or _NUMBER_TYPED.search(blanked):
        return []
    prefix = typed_name(line)
    lower = prefix.lstrip("#$.").islower()  # if the user types in lower case, suggest keywords in lower case
    found: dict[str, questions.Suggestion] = {}
    for word, note in _candidates(blanked, prefix, names, in_program):
        key = word.upper()
        wanted = (everything or prefix or not (word.endswith("(") or key in _CONSTANTS)) and key.startswith(
            prefix.upper()
        )
        if wanted and key != prefix.upper() and key not in found:
            found[key] = questions.Suggestion(word.lower() if lower and word.isupper() else word, len(prefix), note)
    return list(found.values()) or _files(line, folder)


def typed_name(text: str) -> str:
    """Return the beginning of a name that is being typed at the end of a line; "" if there is none."""
    found = _PREFIX.search(text) if len(text) <= MAX_LINE_CHARS else None
    return found.group() if found else ""


def _candidates(line: str, prefix: str, names: DefinedNames, in_program: bool) -> Candidates:
    if _TARGET.match(line):
        return _strings(names) if line.lstrip().startswith("$") else (*_reals(names), *_strings(names))
    if (first := _FIRST.match(line)) is None or first.end() == len(line):
        return _beginnings(names, in_program, prefix.upper())
    rest = line[first.end() :]
    if not rest[0].isspace():
        return _items(names)
    if (word := _row_of(first.group(1).upper(), in_program)) is None:
        return ()
    if word.name == "EXPLAIN":
        return _explain_candidates(rest.lstrip(), prefix, names)
    if word.name == "DO" and not in_program:
        return _candidates(rest.lstrip(), prefix, names, True)
    # the parentheses of the first arguments of words like READ, if already closed
    group = _GROUP.match(rest) if word.group_size else None
    return _inside(word, rest if group is None else rest[group.end() :], prefix, names, word.group_size if group else 0)


def _explain_candidates(text: str, prefix: str, names: DefinedNames) -> Candidates:
    """Return the words that may follow EXPLAIN: topics, motions and locations."""
    first = _FIRST.match(text)
    if first is not None and first.end() < len(text):
        return _places(names) if first[1].upper() in monitor.EXPLAINED else _candidates(text, prefix, names, True)
    topics = ((topic, row.summary) for topic, row in monitor.EXPLAINED.items())
    motions = ((name, note) for name, note in _rows(INSTRUCTIONS) if INSTRUCTIONS[name].route is Route.MOTION)
    return (*topics, *motions, *_places(names))


_COMMON = "MOVE MOVES DRIVE READY APPRO DEPART WHERE HERE SPEED OPENI CLOSEI LOAD EXECUTE HELP"
COMMON = tuple(_COMMON.split())  # the most common words are suggested first


def _beginnings(names: DefinedNames, in_program: bool, begun: str) -> Candidates:
    usual = INSTRUCTIONS if in_program else {**INSTRUCTIONS, **monitor.COMMANDS}
    common = {name: usual[name] for name in COMMON if name in usual}
    tables = (common, INSTRUCTIONS, CONTROL) if in_program else (common, monitor.COMMANDS, INSTRUCTIONS)
    opens = (".PROGRAM", ".PROGRAM name: type a program, line by line, up to .END")
    heading = (".END", "the program ends here") if in_program else opens
    rows = (row for table in tables for row in _rows(table, begun))
    return (*rows, heading, *names.of(values.Kind.REAL, values.Kind.STRING).items())


def _row_of(word: str, in_program: bool) -> Word | None:
    """Return the table row of a word, which may be abbreviated; None if it is unknown or ambiguous. Commands take
    precedence over instructions."""
    tables = (INSTRUCTIONS, CONTROL) if in_program else (monitor.COMMANDS, INSTRUCTIONS, CONTROL)
    rows = rows_for(word, *tables)
    return rows[0] if len(rows) == 1 else None


def _inside(word: Word, before: str, prefix: str, names: DefinedNames, first: int) -> Candidates:
    """Return the words that may come next among the arguments of `word`. `before`: the text of its arguments up to the
    cursor, with strings blanked out, including the name `prefix` that is being typed. `first`: the number of arguments
    in closed parentheses before that text (after words like READ)."""
    if (nested := innermost(before)) is not None:
        function = FUNCTIONS.get(nested[0])
        inner = _argument(function.arguments, nested[1]) if function else None
        return _of_shape(inner, names) if inner else _reals(names)
    if word.name in WORDS:
        return WORDS[word.name](names)
    settled, level = before[: len(before) - len(prefix)], top_level(before)
    there = settled.upper().split()
    after_connecting = bool(there) and there[-1] in _CONNECTING
    # whether the operand before the cursor is complete
    ended = _OPERAND_BEFORE.search(settled) is not None and not after_connecting
    connecting = [row for row in _link_words(word, ended) if row[0] not in there]
    if ended:
        return connecting
    if after_connecting:
        return _reals(names)
    wanted = word.value if _ASSIGNS.search(level) else _argument(word.arguments, first + level.count(","))
    if wanted is None:
        return _items(names) if word.name in CONTROL else connecting
    offered = _of_shape(wanted, names)
    if settled.strip():
        return offered
    sorts = SORT_WORDS.items() if "SORT" in word.modifiers else ()
    return (*sorts, *connecting, *offered) if wanted.optional else (*sorts, *offered)


def _of_shape(argument: Argument, names: DefinedNames) -> Candidates:
    return SHAPES[argument.shape](names) if argument.shape in SHAPES else ()


def _link_words(word: Word, operand_ended: bool) -> Iterator[tuple[str, str]]:
    """Yield the words that may stand between or after the arguments of `word`. `operand_ended`: whether the last
    argument is complete."""
    yield from ((text, "") for text in (word.links if isinstance(word, Control) else ()))
    yield from ((argument.lead, argument.name) for argument in word.arguments if argument.lead)
    if operand_ended or not word.required_count:
        for modifier in sorted(word.modifiers):
            yield from MODIFIERS.get(modifier, {}).items()


def _argument(arguments: tuple[Argument, ...], index: int) -> Argument | None:
    """Return the argument at an index. The last argument stands for all later indexes if it can be repeated; otherwise
    None."""
    if index < len(arguments):
        return arguments[index]
    return arguments[-1] if arguments and arguments[-1].repeated else None


# --- files ---------------------------------------------------------------------------------------------------------

PROGRAM_EXTENSIONS = (".v2", ".pg", ".lc", ".rv", ".st")
EXTENSIONS: Mapping[str, tuple[str, ...]] = {
    "SAVE": (".vrst",),
    "REPLAY": (".vrst",),
    "LOAD": (*PROGRAM_EXTENSIONS, ".vrst"),
}


def _files(line: str, folder: Folder) -> list[questions.Suggestion]:
    """Return the folders and the files with a suitable extension that the first argument may name, if it is a file."""
    first = _FIRST.match(line)
    word = _row_of(first.group(1).upper(), False) if first else None
    if word is None or first is None or not word.arguments or word.arguments[0].shape is not Shape.FILE:
        return []
    typed = line[first.end() :].lstrip()
    if "=" in typed or not line[first.end() :][:1].isspace():
        return []
    return list(_paths(typed, folder, EXTENSIONS.get(word.name, PROGRAM_EXTENSIONS)))


def _paths(typed: str, folder: Folder, extensions: tuple[str, ...]) -> Iterator[questions.Suggestion]:
    above, begun = os.path.split(typed)
    try:
        place = folder.path(above) if above else folder.root
        entries = sorted(os.scandir(place), key=lambda entry: entry.name)
        rows = [(entry.name, entry.is_dir(follow_symlinks=not folder.closed)) for entry in entries]
    except (OSError, FileError):
        return
    for name, is_folder in rows:
        if name.startswith(begun) and (begun or not name.startswith(".")):
            if is_folder:
                yield questions.Suggestion(f"{name}/", len(begun), "folder")
            elif name.lower().endswith(extensions):
                yield questions.Suggestion(name, len(begun))


# --- signatures -------------------------------------------------------------------------------------------------------

_QUOTED_OR_COMMENT = re.compile(r'"[^"]*"?|;.*')
_FIRST_WORD = re.compile(r"\s*(?:\d+\s+)?(?:(?:DO|EXPLAIN)\s+(?=[A-Za-z]))?([A-Za-z][\w.]*)(\s|$)", re.IGNORECASE)
_SEPARATOR = re.compile(r",|\bBY\b", re.IGNORECASE)  # BY separates arguments as a comma does
_BEFORE_PARENTHESIS = re.compile(r"([#$]?[A-Za-z][\w.]*)\s*$")


class Signature(Struct, frozen=True):
    """The syntax of a word or program. `form`: the syntax as text; `summary`: its meaning; `arguments`: the start and
    end index of each argument in `form`; `active`: the index of the argument that is being typed."""

    form: str
    summary: str
    arguments: tuple[tuple[int, int], ...]
    active: int


Programs = Callable[[str], Program | None]  # returns the program with a key, whose heading gives the parameters


def signature(before: str, programs: Programs, *, at_prompt: bool = False) -> Signature | None:
    """Return the signature of the innermost function or program call that is still open at the end of the text
    `before`; if none is open, of the first word. None if that word has no arguments."""
    text = blank_out(before)
    if (at := open_bracket(text, "(")) is not None:
        found = _BEFORE_PARENTHESIS.search(text[:at])
        return _call_signature(found[1], text[at + 1 :], programs) if found else None
    found = _FIRST_WORD.match(text)
    row = _row_of(found[1], not at_prompt) if found else None
    if found is None or row is None or not row.arguments or not (found[2] or row.name == found[1].upper()):
        return None  # no arguments, or an abbreviation that may be only the beginning of another word
    return _signature(row.form, row.summary, (argument.name for argument in row.arguments), text[found.end() :])


def blank_out(line: str) -> str:
    """Return the line with its strings and comments replaced by blanks of the same length."""
    return _QUOTED_OR_COMMENT.sub(lambda found: " " * len(found[0]), line)


def _call_signature(name: str, rest: str, programs: Programs) -> Signature | None:
    if (row := FUNCTIONS.get(name.upper())) is not None:
        return _signature(row.form, row.summary, (argument.name for argument in row.arguments), rest)
    if (program := programs(values.key_of(name))) is None:
        return None
    names = [parameter.sigil + parameter.name for parameter in program.parameters]
    return _signature(f"{program.name}({', '.join(names)})", (program.comment or "").strip(), names, rest)


def _signature(form: str, summary: str, names: Iterable[str], rest: str) -> Signature | None:
    arguments = tuple(_argument_places(form, names))
    if not arguments:
        return None
    complete = len(_SEPARATOR.findall(top_level(rest)))
    return Signature(form, summary, arguments, min(complete, len(arguments) - 1))


def _argument_places(form: str, names: Iterable[str]) -> Iterator[tuple[int, int]]:
    """Yield the start and end index of each argument name in `form`, the syntax of a word. Each name is searched after
    the word itself and after the previous name."""
    found = re.match(r"[#$]?[\w.]+", form)
    at = found.end() if found else 0
    for name in names:
        if (begin := form.find(name, at)) >= 0:
            at = begin + len(name)
            yield begin, at
