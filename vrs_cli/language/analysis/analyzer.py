"""Check whether a program, or a line typed at the prompt, can be carried out. All mistakes are returned as diagnostics;
none is raised.

The analyzer decides from the use of a bare name whether the name is a real or a transformation, and checks every
instruction against its row of the word tables. `Surroundings` describes the memory in which a program runs: variables
with a value, other programs, and the variables to which these programs assign. It is made once for all programs of a
file, so that checking one program does not search the others again.

The analyzer warns once about a variable that has the name of an instruction or of a function without arguments. It does
not warn about a variable `dx`, because the function `DX(part)` always has an argument.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Collection, Container, Iterable, Iterator, Mapping
from contextlib import suppress
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, cast

from msgspec.structs import replace

from vrs_cli.engine.settings import SETTINGS, idle_of, row_of
from vrs_cli.errors import (
    ArgumentMismatch,
    CannotInterpret,
    FixedCondition,
    HiddenStatement,
    IllegalAssignment,
    InvalidName,
    LengthUnit,
    NotAvailable,
    OldMeaning,
    PauseOfArm,
    SpeedInPercent,
    TimeUnit,
    TypeMismatch,
    UndefinedName,
    UndefinedValue,
    UnreadStatus,
    UsageError,
    WithoutEffect,
    WordAsName,
    did_you_mean,
)
from vrs_cli.language.analysis.expressions import SHAPES, Expressions, count_mistakes, is_truth, numbers_meant
from vrs_cli.language.analysis.names import (
    ANY_KIND,
    LOOPS,
    PLACE,
    REAL,
    STRING,
    Analysis,
    Block,
    BlockKind,
    NameFindings,
    declares,
    label_of,
    own_variables,
    with_article,
)
from vrs_cli.language.analysis.structure import beyond, structure_of, waits_for_signals
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import (
    FUNCTION_NAMES,
    Expression,
    Program,
    ProgramHeader,
    Statement,
    definitions,
    variables_given_by,
)
from vrs_cli.language.text.parser import parse_step
from vrs_cli.language.text.printer import expression_text
from vrs_cli.language.words.foreign import (
    assignment_hint,
    first_hint,
    form_of,
    meant_by,
    own_word,
    text_meant,
    value_given,
)
from vrs_cli.language.words.instructions import DECLARATIONS, INSTRUCTIONS, LOOP_JUMPS
from vrs_cli.language.words.monitor import COMMANDS, EXPLAINED
from vrs_cli.language.words.values import NAME_LENGTH, SIGIL_KINDS, Kind, kinds_of_name
from vrs_cli.language.words.word import Argument, Route, Shape, State, Word, argument_at
from vrs_cli.values.diagnostics import Diagnostic, LineRefused, Span, in_order, warning
from vrs_cli.values.numbers import count

_PLACES = frozenset({Shape.PLACE, Shape.LOCATION})

# up to this number of names, compare a mistyped name with all of them; if there are more, compare it only with names
# that differ by one typing mistake, because the full comparison would be slow
MAX_COMPARED_NAMES = 200


class Surroundings:
    """The memory in which a program runs. `known`: the kinds (real, string, ...) of the variables that have a value, by
    key; `programs`: the programs in memory, by key; `elsewhere`: the keys of programs in other files of the folder,
    which may be called too.
    """

    def __init__(
        self, known: Mapping[str, Kind], programs: Mapping[str, Program], elsewhere: Container[str] = ()
    ) -> None:
        self.known, self.programs, self.elsewhere = known, programs, elsewhere

    @cached_property
    def program_keys(self) -> tuple[str, ...]:
        return tuple(self.programs)

    @cached_property
    def given_keys(self) -> frozenset[str]:
        """Return the keys of all variables to which the programs in memory assign a value."""
        return frozenset(self._givers)

    @cached_property
    def _givers(self) -> Counter[str]:
        """Count the programs that assign a value to a variable, by the variable's key."""
        return Counter(key for program in self.programs.values() for key in names_given_in(program))

    def given_elsewhere(self, key: str, program: Program) -> bool:
        """Return whether a program other than `program` assigns a value to the variable with this key."""
        here = self.programs.get(program.key)
        return self._givers[key] > (here is not None and key in names_given_in(here))

    def named_elsewhere(self, key: str, program: Program) -> bool:
        """Return whether a program other than `program` uses a variable with this key."""
        return any(key in names_in(other) for other in self.programs.values() if other.key != program.key)

    # --- hints for mistyped names ---

    def name_meant(self, variable: ast.Variable, own: Candidates) -> str:
        """Return `did you mean name?` for a mistyped variable, or "". Candidates are `own` (the names in the program)
        and the variables in memory, if they have the same sigil."""
        near = (*own.of(variable.key), *self._names_alike.of(variable.key))
        return did_you_mean(
            variable.key, (key for key in near if key[0] == variable.key[0] or not (variable.sigil or key[0] in "#$"))
        )

    def program_meant(self, name: str) -> str:
        """Return `did you mean name?` for a mistyped program name, or "" if no program in memory has a similar name."""
        return did_you_mean(
            name, [self.programs[key].name for key in self._programs_alike.of(name.lower()[:NAME_LENGTH])]
        )

    @cached_property
    def _names_alike(self) -> Candidates:
        return Candidates(self.given_keys | self.known.keys())

    @cached_property
    def _programs_alike(self) -> Candidates:
        return Candidates(self.program_keys)


class Candidates:
    """A set of names, searched for those that are similar to a mistyped name."""

    def __init__(self, names: Collection[str]) -> None:
        self._names = names

    def of(self, name: str) -> Collection[str]:
        """Return the names that should be compared with a mistyped name: all if there are few, otherwise those that
        differ from it by one typing mistake."""
        if len(self._names) <= MAX_COMPARED_NAMES:
            return self._names
        return self.slips(name)

    def slips(self, name: str) -> Collection[str]:
        return dict.fromkeys(near for rest in _rests(name) for near in self._by_rest.get(rest, ()))

    @cached_property
    def _by_rest(self) -> Mapping[str, list[str]]:
        found: dict[str, list[str]] = {}
        for name in sorted(self._names):
            for rest in _rests(name):
                found.setdefault(rest, []).append(name)
        return found


def _rests(name: str) -> list[str]:
    """Return a name, and all forms of it with one letter removed. Two names differ by about one typing mistake (a
    letter added, missing, wrong or swapped with its neighbour) if they have one of these forms in common."""
    return list(dict.fromkeys((name, *(name[:i] + name[i + 1 :] for i in range(len(name))))))


# --- the variables to which a program assigns a value ------------------------------------------------------------


def names_given_in(program: Program) -> frozenset[str]:
    """Return the keys of the global variables to which a program assigns a value, directly or through a CALL."""
    remembered = vars(program)  # the cache is in the program, because a global cache would keep deleted programs alive
    if "names_given" not in remembered:
        own = {own.key for own in own_variables(program)} | {one.key for one in program.parameters}
        doing = (one for one in program.statements if not declares(one))
        remembered["names_given"] = frozenset(key for one in doing for key in variables_given_by(one)) - own
    return cast("frozenset[str]", remembered["names_given"])


def names_in(program: Program) -> frozenset[str]:
    """Return the keys of all variables in the text of a program."""
    remembered = vars(program)  # the cache is in the program, so that it is freed with the program
    if "names" not in remembered:
        remembered["names"] = frozenset(node.key for node in ast.nodes(program.steps) if isinstance(node, ast.Variable))
    return cast("frozenset[str]", remembered["names"])


def find_slips(names: NameFindings) -> dict[str, str]:
    """Return hints, by key, for variables that are assigned but never read and look like mistakes.

    The hint names a similar variable that is read (count for cuont); or it explains how to set a coordinate, if the
    name looks like one (part.z where part is a variable).
    """
    seen = names.first_read.keys() | names.declared | names.parameters | names.passed
    idle = [key for key in names.given - seen if len(key) > 2]
    near = Candidates(names.first_read.keys() & names.given) if idle else Candidates(())
    slips = {key: next((one for one in near.slips(key) if _slip(key, one)), "") for key in idle}
    hints = {key: f"did you mean {meant}?" for key, meant in slips.items() if meant}
    places = names.first_read.keys() | names.given
    return hints | {key: meant_by(key) for key in idle if key[-2:] in (".x", ".y", ".z") and key[:-2] in places}


def used_nowhere(program: Program, hints: Mapping[str, str], surroundings: Surroundings) -> Iterator[Diagnostic]:
    """Warn about the first assignment to each variable in `hints` (from `find_slips`), unless another program uses the
    variable or it already has a value."""
    left = {key: hint for key, hint in hints.items() if not surroundings.named_elsewhere(key, program)}
    for statement in program.statements if left else ():
        for variable in definitions(statement) if not isinstance(statement, ast.For) else ():
            if (hint := left.pop(variable.key, "")) and variable.key not in surroundings.known:
                yield warning(WithoutEffect, variable.span, f"{variable.sigil}{variable.name} is used nowhere", hint)


def _slip(name: str, other: str) -> bool:
    """Return whether one of two similar names is probably a typing mistake. Names that differ in a digit (p1 and p2),
    or in one replaced letter (x.min and y.min), are taken as intended."""
    same = re.findall(r"[\d#$]", name) == re.findall(r"[\d#$]", other)
    return same and (len(name) != len(other) or sorted(name) == sorted(other))


def confusions(program: Program, names: NameFindings, surroundings: Surroundings) -> Iterator[Diagnostic]:
    """Warn about variables that have the name of a function or an instruction. `names`: the analyzed names of the
    program."""
    keys = FUNCTION_NAMES.keys() & {*names.given, *names.first_read, *names.declared, *names.parameters}
    for node in ast.nodes((program.parameters, program.steps)) if keys else ():
        if isinstance(node, ast.Variable) and node.key in keys:
            keys.discard(node.key)
            detail = f"{node.sigil}{node.name.lower()} is a variable in this program"
            yield _warning(node, detail, f"{FUNCTION_NAMES[node.key]}() is the function")
    for key, call in names.functions.items():
        if surroundings.given_elsewhere(key, program):
            detail = f"{call.name} is the function here, and a variable in another program"
            yield _warning(call, detail, f"GLOBAL {key} makes it the variable")
    for key, target in names.assigned.items():
        row = INSTRUCTIONS.get(target.name.upper())
        met = any(key in of for of in (names.first_read, names.declared, names.parameters, names.passed))
        if row is not None and row.arguments and row.state is State.SUPPORTED and (not met or row.value is not None):
            detail = f"{target.name.lower()} is a variable here" + ("" if met else ", and nothing reads it")
            yield _warning(target, detail, f"the form of the instruction is {row.form}")


def first_assignment(target: ast.Variable) -> Iterator[Diagnostic]:
    """Warn if a variable that gets its first value at the prompt has the name of a function or an instruction."""
    name, word = target.sigil + target.name.lower(), target.name.upper()
    row, function = COMMANDS.get(word) or INSTRUCTIONS.get(word), FUNCTION_NAMES.get(target.key, "")
    form = row.form if row is not None and row.required_count and not target.sigil and target.indexes is None else ""
    hint = first_hint(
        (target.key == "here", "HERE p keeps the place where the arm stands"),
        (function, f"{function}() is the function"),
        (form, f"the form of the command is {form}"),
        (True, meant_by(name)),
    )
    if hint:
        yield _warning(target, f"{name} is a variable from now on", hint)


def _warning(node: ast.Variable | ast.Call, detail: str, hint: str) -> Diagnostic:
    return warning(WordAsName, node.span, detail, hint)


# --- misunderstood instructions (DELAY, BREAK, FOPENR), and endless loops ------------------------------------


# instructions after which time may have passed, because they wait or leave the program
_WAITS = frozenset({"WAIT", "WAIT.EVENT", "CALL", "CALLS", "PAUSE", "RETURN", "STOP", "HALT"})


def delays(program: Program) -> Iterator[Diagnostic]:
    """Warn about the first DELAY that was probably meant to pause the program; DELAY only holds the arm."""
    statements = program.statements
    for number, statement in enumerate(statements, 1):
        if isinstance(statement, ast.Instruction) and statement.word == "DELAY":
            telling = (one for one in statements[number:] if _shows_time(one) or not _at_once(one))
            # warn if the next such step shows output or reads the time, because the user would see that nothing paused
            if (first := next(telling, None)) is not None and _shows_time(first):
                yield warning(
                    PauseOfArm,
                    statement.span,
                    "DELAY holds the arm, and the program goes on at once",
                    "TIMER 1 = 0 and WAIT TIMER(1) > 2 pause a program",
                )
                return


def _shows_time(statement: Statement) -> bool:
    if isinstance(statement, ast.Instruction) and statement.word in ("TYPE", "TYPEI", "PROMPT"):
        return True
    calls = (node.name for node in ast.nodes(statement) if isinstance(node, ast.Call))
    return _at_once(statement) and not {"TIME", "TIMER", "$TIME"}.isdisjoint(calls)


def _at_once(statement: Statement) -> bool:
    """Return whether a step is certain to finish in no time and to continue with the next step: it does not move the
    arm, wait, or jump."""
    if isinstance(statement, ast.Assignment):
        return True
    if not isinstance(statement, ast.Instruction) or statement.word in _WAITS:
        return False
    row = INSTRUCTIONS[statement.word]
    breaks = row.breaks and not statement.modifiers.has_time
    return statement.word == "DELAY" or not (row.route is Route.MOTION or breaks)


def breaks(program: Program, blocks: Collection[Block]) -> Iterator[Diagnostic]:
    """Warn about each BREAK that was probably meant to leave a loop (in VAL-II it waits for the end of a motion): a
    BREAK at the end of an IF in a loop, with no motion in this branch of the IF; or any BREAK in a loop of a program
    without motions."""
    inside = {step for block in blocks if block.kind in LOOPS for step in range(block.opener, block.closer)}
    steps = [step.statement for step in program.steps] if inside else []
    instructions = [(i, it) for i, it in enumerate(steps) if i in inside and isinstance(it, ast.Instruction)]
    at = {index: it.span for index, it in instructions if it.word == "BREAK"}
    detail = "BREAK waits for a motion, and there is none"
    if at and any(map(_may_move, steps)):
        detail = "BREAK waits until the arm stands, and leaves no loop"
        branches = (
            branch
            for block in blocks
            if block.kind is BlockKind.IF
            for branch in pairwise((block.opener, *block.middles, block.closer))
        )
        last = {end - 1 for first, end in branches if not any(map(_may_move, steps[first:end]))}
        at = {index: span for index, span in at.items() if index in last}
    for span in at.values():
        yield warning(WithoutEffect, span, detail, "EXIT leaves a loop")


def _may_move(statement: Statement | None) -> bool:
    """Return whether a step is a motion, or calls a program that may contain a motion."""
    return isinstance(statement, ast.Instruction) and (
        statement.word in _MAY_MOVE
        or (INSTRUCTIONS[statement.word].route is Route.MOTION and statement.word != "BREAK")
    )


def unread_status(program: Program, programs: Iterable[Program]) -> Iterator[Diagnostic]:
    """Warn about the first FOPENR of a program that reads a file but never uses IOSTAT, if no other program uses IOSTAT
    either."""
    steps = [one for one in program.statements if isinstance(one, ast.Instruction) and one.word in ("FOPENR", "READ")]
    first = next((one for one in steps if one.word == "FOPENR"), None)
    if first is None or all(one.word == "FOPENR" for one in steps):
        return
    if not any(
        isinstance(node, ast.Call) and node.name == "IOSTAT"
        for one in (program, *programs)
        for node in ast.nodes(one.steps)
    ):
        yield warning(
            UnreadStatus,
            first.span,
            "without the file the program goes on, and nothing tells",
            "IF IOSTAT(lun) < 0 THEN behind it asks",
        )


def endless(program: Program, blocks: Collection[Block], surroundings: Surroundings) -> Iterator[Diagnostic]:
    """Warn about each WHILE or DO loop that cannot end, because none of its steps changes a variable in the condition,
    waits, or jumps out of the loop. There is no warning if another program sets such a variable, or this program never
    sets it, because the value may then change during the loop."""
    for block in blocks:
        ends = program.steps[block.closer if block.kind is BlockKind.DO else block.opener].statement
        if isinstance(ends, ast.While | ast.Until):
            nodes = tuple(ast.nodes(ends.condition))
            read = {node.key: node for node in nodes if isinstance(node, ast.Variable)}
            inside = [step.statement for step in program.steps[block.opener + 1 : block.closer] if step.statement]
            given = {key for statement in inside for key in variables_given_by(statement)}
            calls = any(isinstance(node, ast.Call) for node in nodes)
            fixed = read.keys() <= names_given_in(program) - given and not any(
                surroundings.given_elsewhere(key, program) for key in read
            )
            if read and fixed and not calls and all(map(_goes_on, inside)):
                name = next(iter(read.values())).name
                yield warning(
                    FixedCondition,
                    ends.span,
                    f"no step of this loop changes {name}",
                    f"{name} = {name} + 1 in the loop counts",
                )


def _goes_on(statement: Statement) -> bool:
    """Return whether a step certainly neither waits nor leaves the loops around it."""
    if isinstance(statement, ast.Goto | ast.IfGoto | ast.BadLine):
        return False
    return not isinstance(statement, ast.Instruction) or not (
        statement.word in _WAITS or statement.word in LOOP_JUMPS or label_of(statement) is not None
    )


_MAY_MOVE = frozenset({"CALL", "CALLS", "DO", "EXECUTE", "REACT", "REACTI", "OPENI", "CLOSEI", "RELAXI"})


# --- programs and lines ----------------------------------------------------------------------------------------------


# search for a hint for at most this many names without a value, because a program without its locations has hundreds
MAX_HINTS = 10


# instructions that DO refuses at the prompt, because they only work in a program
_IN_PROGRAMS = LOOP_JUMPS | DECLARATIONS | {"REACT", "REACTI", "REACTE", "RETURNE", "IGNORE", "LOCK", "RUNSIG"}


def analyze(
    program: Program, known: Mapping[str, Kind] | None = None, programs: Mapping[str, Program] | None = None
) -> Analysis:
    """Analyse a program. `known`: the kinds of the variables that have a value, by key; `programs`: the programs in
    memory, by key."""
    return analyze_among(Surroundings({} if known is None else known, programs or {}), program)


def analyze_among(surroundings: Surroundings, program: Program) -> Analysis:
    """Analyse one of several programs that share the same surroundings. Lines that do not parse are not reported again,
    but make the analysis not executable."""
    structure = structure_of(program)
    steps = _Steps(surroundings.known, program, surroundings)
    steps.header(program)
    for index, step in enumerate(program.steps):
        if step.statement is not None:
            steps.statement(index + 1, step.statement)
            steps.diagnostics += hidden_statement(step.statement, step.comment, step.span.end)
    steps.finish(program, surroundings)
    slips = find_slips(steps)
    found = (
        *structure.diagnostics,
        *steps.diagnostics,
        *used_nowhere(program, slips, surroundings),
        *beyond(program),
        *breaks(program, structure.blocks),
        *endless(program, structure.blocks, surroundings),
        *unread_status(program, surroundings.programs.values()),
    )
    kinds = {key: decided.kind for key, decided in steps.kinds.items()}
    needs = frozenset(one.key for one in steps.without_value())
    called, functions = frozenset(steps.called), frozenset(steps.functions)
    own = own_variables(program)
    alone = frozenset({*slips, *(variable.key for variable, _ in steps.compared if variable.key in steps.truths)})
    return Analysis(
        program, kinds, tuple(structure.blocks), structure.labels, in_order(found), needs, called, functions, alone, own
    )


def check_line(
    line: Statement | ProgramHeader, known: Mapping[str, Kind] | None = None, *, in_program: bool = False
) -> tuple[Diagnostic, ...]:
    """Check a line typed at the prompt or, if `in_program`, one step of a program on its own, without checking blocks
    and labels. `known`: the kinds of the variables that have a value, by key."""
    steps = _Steps({} if known is None else known)
    if isinstance(line, ProgramHeader):
        steps.header(line)
    elif in_program:
        steps.statement(1, line)
    else:
        steps.command(line)
    return tuple(steps.diagnostics)


_ASSIGNMENT = r"[ \t]*[#$]?[A-Za-z][\w.]*[ \t]*(?:\[[^\]]*\][ \t]*)?=[ \t]*[^=\s]"


def hidden_statement(statement: Statement, comment: str | None, end: int) -> Iterator[Diagnostic]:
    """Warn about `x = 3; y = 4` and `MOVE a; MOVE b`: the second statement is only a comment, because `;` begins one.
    `end`: the column after the comment."""
    if isinstance(statement, ast.DoInstruction):
        statement = statement.statement or statement
    word = statement.word if isinstance(statement, ast.Instruction) else ""
    if not comment or not isinstance(statement, ast.Assignment | ast.Instruction):
        return
    if comment.strip().upper().startswith(f"{word} ") if word else re.match(_ASSIGNMENT, comment):
        with suppress(LineRefused):
            hidden = parse_step(comment.strip()).statement
            if isinstance(hidden, type(statement)):
                yield warning(
                    HiddenStatement,
                    Span(statement.span.line, end - len(comment) - 1, end),
                    f"{comment.strip()} is a comment",
                    "a line holds one statement",
                )


_NAME = r"[#$]?[A-Za-z][\w.]*"
_GIVES = rf"(?i)(?:(?:for|set|point|here)[ \t]+({_NAME})|({_NAME})[ \t]*(?:\[[^\]]*\][ \t]*)?:?=(?!=))"


def _meant_to_give(line: str) -> Iterable[str]:
    """Return the names to which a line that does not parse seems to assign a value, as in int x = 5, x := 5 and
    INPUT "how many", x."""
    words = re.findall(_NAME, re.sub(r'"[^"]*"?|;.*', " ", line))
    if words and own_word(words[0]) == "PROMPT":
        return words[1:]
    return (name for found in re.findall(_GIVES, line) for name in found if name)


def other_sigil(variable: ast.Variable, known: Container[str]) -> str:
    """Return a hint if the same name with another sigil has a value (part instead of #part), otherwise ""."""
    bare = variable.key.lstrip("#$")
    other = next((sigil for sigil in ("", *SIGIL_KINDS) if sigil != variable.sigil and sigil + bare in known), None)
    return "" if other is None else f"did you mean {other}{variable.name}?"


class _Steps(Expressions):
    """A checker of the steps of a program, in one pass. `known`: the kinds of the variables that have a value, by key;
    `program` and `surroundings` are None for a line typed at the prompt."""

    def __init__(
        self, known: Mapping[str, Kind], program: Program | None = None, surroundings: Surroundings | None = None
    ) -> None:
        super().__init__(known, () if program is None else program.parameters, at_prompt=program is None)
        self.called: set[str] = set()
        self.compared = []
        self.truths: set[str] = set()  # keys of the variables to which a step assigns a truth value
        self._program = program
        self._surroundings = surroundings
        self._program_keys = () if surroundings is None else surroundings.programs

    # --- lines ---

    def header(self, heading: Program | ProgramHeader) -> None:
        """Check the parameters in the heading of a program."""
        parameters = heading.parameters
        keys = [parameter.key for parameter in parameters]
        for place, parameter in enumerate(parameters):
            self.check(parameter)
            if parameter.indexes:
                self.fault(CannotInterpret, parameter.span, "a parameter has no index", "write name, or name[]")
            if parameter.key in keys[:place]:
                self.fault(ArgumentMismatch, parameter.span, f"{parameter.name} is there twice")

    def statement(self, step: int, statement: Statement) -> None:
        self.step = step
        if declares(statement):
            self._count(statement, INSTRUCTIONS[statement.word])
            self.check_declaration(statement)
            return
        self._declarations_over = True
        if (check := _STATEMENTS.get(type(statement))) is not None:
            check(self, statement)

    def command(self, statement: Statement) -> None:
        inner = statement.statement if isinstance(statement, ast.DoInstruction) else statement
        if isinstance(statement, ast.ExplainCommand):
            self._explain(statement)
        elif isinstance(inner, ast.Instruction) and not (inner is not statement and inner.word in _IN_PROGRAMS):
            table = COMMANDS if inner is statement and inner.word in COMMANDS else INSTRUCTIONS
            if inner.word in ("STOP", "PAUSE", "HALT"):
                self.warn(
                    WithoutEffect,
                    inner.span,
                    f"{inner.word} is for the program that it stands in",
                    "ABORT stops the robot and its program",
                )
            self._instruction(inner, table)
        elif isinstance(inner, ast.Assignment):
            self._assignment(inner)
            if inner.target.key not in self._known:
                self.diagnostics += first_assignment(inner.target)
        elif isinstance(inner, ast.Show):
            self.value(inner.expression, ANY_KIND)
        elif inner is not None:
            self.fault(CannotInterpret, statement.span, "this works in programs only", ".PROGRAM name begins one")
        for variable in self.without_value():
            if hint := other_sigil(variable, self._known):
                self.fault(UndefinedValue, variable.span, variable.sigil + variable.name, hint)

    def _explain(self, it: ast.ExplainCommand) -> None:
        """Check EXPLAIN: without a topic its argument is a motion or a location; some topics need a location, others
        take no argument."""
        asked, row = it.statement, EXPLAINED.get(it.topic)
        end = Span(it.span.line, it.span.end, it.span.end + 1)
        if isinstance(asked, ast.Instruction) and not it.topic:
            if INSTRUCTIONS[asked.word].route is Route.MOTION:
                self._instruction(asked, INSTRUCTIONS)
            else:
                self.fault(
                    CannotInterpret, asked.span, f"{asked.word} is no motion", "EXPLAIN alone lists what there is"
                )
        elif row is not None and not row.of_location and asked is not None:
            self.fault(CannotInterpret, asked.span, f"{it.topic} stands alone", f"EXPLAIN {row.form}")
        elif row is not None and row.of_location and asked is None:
            self.fault(
                CannotInterpret, end, f"EXPLAIN {it.topic}: location is missing", f"the form is EXPLAIN {row.form}"
            )
        elif isinstance(asked, ast.Show):
            self.value(asked.expression, PLACE)
        elif asked is not None:
            self.fault(CannotInterpret, asked.span, "this is no motion", "EXPLAIN alone lists what there is")

    def finish(self, program: Program, around: Surroundings) -> None:
        """Report the mistakes that can only be found after all steps are checked, such as variables without a value."""
        lines = [one.text for one in program.statements if isinstance(one, ast.BadLine)]
        meant = {name.lower()[:NAME_LENGTH] for text in lines for name in _meant_to_give(text)}
        # exclude variables that a line that does not parse may assign, or (if they are global) another program
        nowhere = [
            one
            for one in self.without_value()
            if one.key not in meant and (one.key in self.own or not around.given_elsewhere(one.key, program))
        ]
        own = Candidates({*self.given, *self.parameters})
        for number, variable in enumerate(nowhere):
            name, decided = variable.sigil + variable.name, self._decision(variable)
            hint = around.name_meant(variable, own) if number < MAX_HINTS else ""
            hint = hint or other_sigil(variable, {*self.given, *around.known})
            hint = hint or assignment_hint(name, decided.kind if decided else Kind.REAL)
            usual = text_meant(name) if variable.key in self.typed and not variable.sigil else value_given(name)
            self.warn(UndefinedValue, variable.span, f"{name} is given a value nowhere", hint or usual)
        for variable, relation in self.compared:
            if variable.key in self.truths and not around.given_elsewhere(variable.key, program):
                givers = [one for one in program.statements if variable.key in variables_given_by(one)]
                # the comparison in a = b AND (a == 2) reads the value of a before the assignment, so no warning there
                at = {one.span.line for one in givers}
                truths = all(isinstance(one, ast.Assignment) and is_truth(one.value) for one in givers)
                if truths and relation.span.line not in at:
                    self.truth_compared(variable, relation)
        self.diagnostics += confusions(program, self, around)

    # --- statements ---

    def _assignment(self, statement: ast.Assignment) -> None:
        target, value = statement.target, statement.value
        if target.key == "here" and target.indexes is None and (self._is_new(value) or self.kind_of(value) in PLACE):
            self._here(statement)
            return
        self.reference(target)
        if target.indexes is None and not target.sigil:
            self.assigned.setdefault(target.key, target)
        name = target.sigil + target.name
        if target.many:
            self.fault(IllegalAssignment, target.span, f"{name}[] is an array", "assign its elements")
        if target.sigil == "#" or (not target.sigil and self.kind_of(value) in PLACE):
            self.fault(
                IllegalAssignment, target.span, "a location is assigned by SET", f"SET {expression_text(target)} = ..."
            )
            self.value(value, PLACE)
            self.given.add(target.key)
            return
        wanted = STRING if target.sigil else REAL
        if not target.sigil and self.kind_of(value) is Kind.STRING:
            self.fault(TypeMismatch, value.span, f"{name} holds a number, no string", f"${name} = ... holds a string")
            self.value(value, STRING)
        elif target.sigil and self.kind_of(value) in PLACE:
            self.fault(IllegalAssignment, target.span, f"{name} holds a text", f"SET {target.name} = ... is a place")
        else:
            self.value(value, wanted)
        if is_truth(value):
            self.truths.add(target.key)
        self.define(target, wanted)

    def _here(self, statement: ast.Assignment) -> None:
        """Report HERE = start (the user probably means HERE start), or HERE = TRANS(0, 500)."""
        value, new = statement.value, self._is_new(statement.value)
        hint = f"HERE {expression_text(value) if new else 'p'} keeps the place where the arm stands"
        hint += "" if new else "; SET p = ... gives another place a name"
        self.fault(IllegalAssignment, statement.span, "HERE takes no =", hint)
        if new:
            self._define(value, PLACE)
        else:
            self.value(value, PLACE)

    def _is_new(self, value: Expression) -> bool:
        """Return whether an expression is a variable that has no value and that no earlier step sets or reads."""
        met = (self.given, self.parameters, self._known, self.first_read)
        return isinstance(value, ast.Variable) and not any(value.key in keys for keys in met)

    def _reals(self, *expressions: Expression | None) -> None:
        for expression in expressions:
            if expression is not None:
                self.value(expression, REAL)

    def _for(self, statement: ast.For) -> None:
        self.reference(statement.variable)
        self._reals(statement.first, statement.last, statement.step)
        self.define(statement.variable, REAL)
        first, last = ast.plain_number(statement.first), ast.plain_number(statement.last)
        step = 1.0 if statement.step is None else ast.plain_number(statement.step)
        if first is not None and last is not None and step and (last - first) * step < 0.0:
            self.warn(
                WithoutEffect,
                statement.span,
                "no step of this loop is ever carried out",
                f"STEP {'-1 counts down' if step > 0 else '1 counts up'}",
            )

    def _condition(self, statement: ast.If | ast.IfGoto | ast.While | ast.Until) -> None:
        self._reals(statement.condition)
        self.signal_number(statement.condition)

    def _wait(self, statement: ast.Instruction) -> None:
        """Check WAIT. In a program without words of V+, WAIT 3 waits for a signal, as in VAL; in V+ a constant
        condition is probably a mistake."""
        asked = statement.arguments[0] if statement.arguments else None
        of_val = self._program is None or waits_for_signals(self._program)
        number = None if asked is None or not of_val else ast.channel(asked)
        hint = "TIMER 1 = 0 and WAIT TIMER(1) > 2 let two seconds pass"
        if asked is not None and number is not None:
            self.warn(OldMeaning, asked.span, f"it waits for the signal: WAIT SIG({number})", hint)
        elif isinstance(asked, ast.Number) and asked.value:
            self.warn(FixedCondition, asked.span, f"{asked.text} is always true, and nothing is waited for", hint)
        elif asked is not None:
            self.signal_number(asked)

    def _set(self, statement: ast.Instruction) -> None:
        """Check SET: a precision point (#name) needs joints as its value, any other name a transformation."""
        target = statement.arguments[0] if statement.arguments else None
        kind = self.kind_of(statement.value) if statement.value is not None else None
        plain = isinstance(statement.value, ast.Number | ast.Variable)
        if isinstance(target, ast.Variable) and plain and kind is Kind.REAL and self.diagnostics:
            self.diagnostics[-1] = replace(
                self.diagnostics[-1], hint=meant_by(target.name) or f"{expression_text(target)} = ... gives a number"
            )
        if not isinstance(target, ast.Variable) or kind not in PLACE or target.sigil == "$":
            return
        wanted = SIGIL_KINDS.get(target.sigil, Kind.LOCATION)
        if kind is not wanted:
            self.fault(
                TypeMismatch,
                target.span,
                f"{target.sigil}{target.name} cannot hold {with_article({kind})}",
                f"SET {'#' if kind is Kind.PRECISION else ''}{target.name} = ... holds one",
            )

    # --- instructions and monitor commands ---

    def _instruction(self, statement: ast.Instruction, table: Mapping[str, Word]) -> None:
        row = table[statement.word]
        if row.name == "DRIVE":
            self.angles("DRIVE", statement.arguments[1:2])
        if row.state is State.REFUSED:
            self.fault(NotAvailable, statement.span, f"{row.name}: {row.summary}", row.note)
        else:
            self._count(statement, row)
            # check the value before the arguments, because it is evaluated before a variable among them is defined
            if statement.value is not None and row.value is not None:
                self._check_operand(statement.value, row.value)
            self._reals(statement.modifiers.at, statement.modifiers.within)
            for place, expression in enumerate(statement.arguments):
                argument = argument_at(row, place)
                if expression is not None and argument is not None and row.name not in LOOP_JUMPS:
                    self._check_operand(expression, argument)
                    if self.diagnostics:
                        self._name_form(expression, argument, row)
            if len(statement.arguments) > 1:
                self._format(statement, row)
            if row.name in _CHECKS:
                _CHECKS[row.name](self, statement)

    def _format(self, statement: ast.Instruction, row: Word) -> None:
        """Warn about TYPE x, /F6.2 (a format applies only to the values after it) and about TYPE /F6,2, x (a comma in
        place of the decimal point)."""
        last = statement.arguments[-1]
        if isinstance(last, ast.Format) and last.code in "DEFGHIO":
            self.warn(
                WithoutEffect,
                last.span,
                "no value follows this format",
                f"a format stands before its value: {row.name} /{last.code}..., x",
            )
        for form, value in pairwise(statement.arguments):  # find TYPE /F6,2, x
            if (
                isinstance(form, ast.Format)
                and isinstance(value, ast.Number)
                and form.code in "EFG"
                and form.decimals is None
                and value.span.column == form.span.end + 1
            ):
                detail, hint = f"{value.text} is a value here", f"/{form.code}{form.width}.{value.text} has a point"
                self.warn(WithoutEffect, value.span, detail, hint)

    def _return(self, statement: ast.Instruction) -> None:
        """Warn about RETURN 5, RETURN a * 2 and RETURN with a parameter, which look as if they return a value (RETURN n
        skips n steps after the CALL)."""
        given = statement.arguments[0] if len(statement.arguments) == 1 else None
        if isinstance(given, ast.Number | ast.Binary) or (
            isinstance(given, ast.Variable) and given.key in self.parameters
        ):
            detail, hint = "it leaves out steps after the CALL", "a program gives values back by its parameters"
            self.warn(OldMeaning, statement.span, detail, hint)

    def _name_form(self, expression: Expression, argument: Argument, row: Word) -> None:
        """If an argument has a wrong kind because arguments are swapped or parentheses missing (APPRO 50, part and
        BASE part), change the hint to the form of the instruction."""
        last, given = self.diagnostics[-1], self.kind_of(expression)
        wrong = last.code == TypeMismatch.code and last.span == expression.span
        swapped = argument.shape in _PLACES and given is Kind.REAL and len(row.arguments) > 1
        if wrong and (row.group_size or (argument.shape is Shape.REAL and given in PLACE) or swapped):
            self.diagnostics[-1] = replace(last, hint=f"the form is {row.form}")

    def _count(self, statement: ast.Instruction, row: Word) -> None:
        """Report missing and extra arguments of an instruction."""
        end = Span(statement.span.line, statement.span.end, statement.span.end + 1)
        wrong = list(count_mistakes(row.name, statement.arguments, row, end, end))
        if row.value is not None and not row.value.optional and statement.value is None:
            wrong.append((end, f"{row.name}: = {row.value.name} is missing"))
        if wrong:
            hint = numbers_meant(row, statement.arguments) or form_of(row)
            for span, detail in wrong:
                self.fault(CannotInterpret, span, detail, hint)

    def _check_operand(self, expression: Expression, argument: Argument) -> None:
        shape = argument.shape
        if shape is Shape.PROGRAM:
            self._program_name(expression)
        elif shape is Shape.PROGRAM_TEXT:  # the value of a string names the program, so its parameters are unknown
            called = (
                expression if isinstance(expression, ast.Applied) else ast.Applied(expression, (), span=expression.span)
            )
            self.value(called.text, STRING)
            self._pass(called.arguments)
        elif shape.value in SETTINGS and isinstance(expression, ast.BareWord):
            self._switch_or_parameter(expression, shape)
        else:
            SHAPES[shape](self, expression)
            if isinstance(expression, ast.Call) and expression.name == "TRANS" and shape in _PLACES:
                self._metres(expression)

    def _program_name(self, expression: Expression) -> None:
        if isinstance(expression, ast.ProgramCall):
            self._pass(expression.arguments)
            self._check_call(expression)
        elif not isinstance(expression, ast.BareWord):
            hint = "GOTO 100 goes to a label" if isinstance(expression, ast.Number) else ""
            if isinstance(expression, ast.StringConstant):
                hint = f"it stands without quotes: {expression.value}"
            self.fault(InvalidName, expression.span, "a program name is wanted here", hint)

    def _switch_or_parameter(self, expression: ast.BareWord, shape: Shape) -> None:
        table, idle = SETTINGS[shape.value]
        try:
            if idle_of(idle, expression.text) is None:
                row_of(table, expression.text, shape.value)
        except UsageError as refused:
            self.fault(UsageError, expression.span, refused.detail, refused.hint)

    def _seconds(self, statement: ast.Instruction) -> None:
        """Warn about DELAY 500, which looks like a time in milliseconds."""
        time = next(iter(statement.arguments), None)
        given = ast.plain_number(time)
        if time is not None and given is not None and given >= 100 and given % 50 == 0:
            self.warn(TimeUnit, time.span, "DELAY takes seconds", f"{given:g} ms is {given / 1000:g}")

    def _percent(self, statement: ast.Instruction) -> None:
        """Warn about SPEED 0.5, which looks like a fraction of full speed (50 %)."""
        speed = next(iter(statement.arguments), None)
        given = ast.plain_number(speed)
        if speed is not None and given is not None and 0 < given <= 1 and statement.modifiers.unit in (None, "MONITOR"):
            self.warn(SpeedInPercent, speed.span, "SPEED takes percent", "half speed is SPEED 50")

    def _metres(self, place: ast.Call) -> None:
        """Warn about TRANS(0.3, 0.45, -0.2), which looks like a position in metres: all coordinates are below 2 and at
        least two are not whole numbers."""
        given = [abs(ast.plain_number(one) or 0.0) for one in place.arguments[:3]]
        if (
            all(one is None or ast.plain_number(one) is not None for one in place.arguments[:3])
            and sum(not one.is_integer() for one in given) >= 2
            and 0.1 <= max(given) < 2.0
        ):
            self.warn(LengthUnit, place.span, "TRANS takes millimetres", "0.3 m is 300")

    # --- programs as arguments ---

    def _pass(self, arguments: Iterable[Expression | None]) -> None:
        for argument in arguments:
            if isinstance(argument, ast.Variable) and not argument.grouped:
                self.reference(argument)
                self.given.add(argument.key)
                self.passed.add(argument.key)
            elif argument is not None:
                self.value(argument, ANY_KIND)

    def _check_call(self, call: ast.ProgramCall) -> None:
        """Check the number and the kinds of the arguments of a CALL if the called program is in memory; otherwise warn
        that it is not."""
        if self._program is None or self._surroundings is None:
            return
        self.called.add(call.key)
        target = self._program if call.key == self._program.key else self._surroundings.programs.get(call.key)
        if target is None and call.key in self._surroundings.elsewhere:
            return
        if target is None:
            hint = self._surroundings.program_meant(call.name) if len(self.called) <= MAX_HINTS else ""
            hint = hint or f"LOAD {call.name} reads it from {call.name}.v2"
            self.warn(UndefinedName, call.span, f"{call.name} is not in memory", hint)
            return
        if len(call.arguments) > len(target.parameters):
            self.fault(
                ArgumentMismatch,
                call.span,
                f"{target.name} is given {count(len(call.arguments), 'argument')}",
                f"it has {count(len(target.parameters), 'parameter')}",
            )
        for argument, parameter in zip(call.arguments, target.parameters, strict=False):
            kind = None if argument is None else self.kind_of(argument)
            if argument is not None and kind is not None and kind not in kinds_of_name(parameter.sigil):
                hint, sigil = (
                    f"{with_article(set(kinds_of_name(parameter.sigil)))} is wanted",
                    next((one for one, of in SIGIL_KINDS.items() if of is kind), ""),
                )
                self.fault(
                    ArgumentMismatch,
                    argument.span,
                    f"{with_article({kind})} for the parameter {parameter.sigil}{parameter.name}",
                    f"{hint}; a parameter {sigil}{parameter.name} takes this one" if sigil else hint,
                )


_CHECKS: Mapping[str, Callable[[_Steps, ast.Instruction], None]] = {
    "DELAY": _Steps._seconds,
    "SPEED": _Steps._percent,
    "WAIT": _Steps._wait,
    "SET": _Steps._set,
    "RETURN": _Steps._return,
}
_STATEMENTS: Mapping[type, Callable[[_Steps, Any], None]] = {
    ast.Assignment: _Steps._assignment,
    ast.Instruction: partial(_Steps._instruction, table=INSTRUCTIONS),
    **dict.fromkeys((ast.If, ast.IfGoto, ast.While, ast.Until), _Steps._condition),
    ast.For: _Steps._for,
    ast.Case: lambda steps, case: steps._reals(case.subject),
    ast.Value: lambda steps, value: steps._reals(*value.tests),
}
