"""What a program finds in memory (variables with a value, other programs, the names that these assign), and names that
a reader could take for something else: a variable that is called as a function or an instruction is.

`Surroundings` is made once for all programs of a file: to ask it about one program costs no walk through the others. A
name is warned of once. A function that needs arguments is not: `dx` and `DX(part)` are told apart at a glance.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from functools import cached_property

from vrs_cli.errors import PauseOfArm, WordAsName
from vrs_cli.language.analysis.names import NameFindings, declares, own_variables
from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import Program, Statement
from vrs_cli.language.text.meaning import FUNCTION_NAMES, variables_given_by
from vrs_cli.language.words.instructions import INSTRUCTIONS
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.values import NAME_LENGTH, Kind
from vrs_cli.language.words.word import Route, State
from vrs_cli.values.diagnostics import Diagnostic, did_you_mean, warning

FEW = 200  # names: a word is compared with each of them; of more, with those one slip of the fingers away


class Surroundings:
    """`known`: the kinds of the variables that have a value. `programs`: those in memory, by key."""

    def __init__(self, known: Mapping[str, Kind], programs: Mapping[str, Program]) -> None:
        self.known, self.programs = known, programs

    @cached_property
    def program_keys(self) -> tuple[str, ...]:
        return tuple(self.programs)

    @cached_property
    def given(self) -> frozenset[str]:
        """The keys of all names that programs give a value."""
        return frozenset(self._givers)

    @cached_property
    def _givers(self) -> Counter[str]:
        """How many programs give each name a value."""
        return Counter(key for program in self.programs.values() for key in names_given_in(program))

    def given_elsewhere(self, key: str, program: Program) -> bool:
        """Whether another program gives a name a value."""
        here = self.programs.get(program.key)
        return self._givers[key] > (here is not None and key in names_given_in(here))

    # --- what a word may have been meant for ---

    def name_meant(self, variable: ast.Variable, own: Candidates) -> str:
        """Return `did you mean name?` with a name of the program or of memory that has the same sigil, or ""."""
        near = (*own.of(variable.key), *self._names_alike.of(variable.key))
        alike = (key for key in near if key[0] == variable.key[0] or not (variable.sigil or key[0] in "#$"))
        return did_you_mean(variable.key, alike)

    def program_meant(self, name: str) -> str:
        """`did you mean name?`, or ""."""
        near = self._programs_alike.of(name.lower()[:NAME_LENGTH])
        return did_you_mean(name, [self.programs[key].name for key in near])

    @cached_property
    def _names_alike(self) -> Candidates:
        return Candidates(self.given | self.known.keys())

    @cached_property
    def _programs_alike(self) -> Candidates:
        return Candidates(self.program_keys)


class Candidates:
    """Names that a mistyped one may have meant."""

    def __init__(self, names: Collection[str]) -> None:
        self._names = names

    def of(self, name: str) -> Collection[str]:
        """Return the names to compare with: all where they are few, otherwise those one slip of the fingers away."""
        if len(self._names) <= FEW:
            return self._names
        return dict.fromkeys(near for rest in _rests(name) for near in self._by_rest.get(rest, ()))

    @cached_property
    def _by_rest(self) -> Mapping[str, list[str]]:
        found: dict[str, list[str]] = {}
        for name in sorted(self._names):
            for rest in _rests(name):
                found.setdefault(rest, []).append(name)
        return found


def _rests(name: str) -> list[str]:
    """A name, and what is left of it without one letter: names that share one are a slip of the fingers apart."""
    return list(dict.fromkeys((name, *(name[:i] + name[i + 1 :] for i in range(len(name))))))


# --- the names that a program gives a value to -------------------------------------------------------------------


def names_given_in(program: Program) -> frozenset[str]:
    """Return the keys of all variables that a program gives a value, by itself or through a CALL."""
    remembered = vars(program)  # of the program itself: a cache of this module would keep deleted programs in memory
    if "names_given" not in remembered:
        own = {own.key for own in own_variables(program)} | {one.key for one in program.parameters}
        doing = (one for one in program.statements if not declares(one))
        remembered["names_given"] = frozenset(key for one in doing for key in variables_given_by(one)) - own
    found: frozenset[str] = remembered["names_given"]
    return found


def confusions(program: Program, names: NameFindings, surroundings: Surroundings) -> Iterator[Diagnostic]:
    """Yield the confusions of a program whose names are all known."""
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
        if row is not None and not met and row.arguments and row.state is State.SUPPORTED:
            detail = f"{target.name.lower()} is a variable here, and nothing reads it"
            yield _warning(target, detail, f"the form of the instruction is {row.form}")


def first_assignment(target: ast.Variable) -> Iterator[Diagnostic]:
    """Warn of a variable that gets its first value at the prompt and has the name of a function or an instruction."""
    name, word = target.sigil + target.name.lower(), target.name.upper()
    row = COMMANDS.get(word) or INSTRUCTIONS.get(word)
    if target.key in FUNCTION_NAMES:
        yield _warning(target, f"{name} is a variable from now on", f"{FUNCTION_NAMES[target.key]}() is the function")
    elif row is not None and not target.sigil and target.indexes is None and row.required:
        yield _warning(target, f"{name} is a variable from now on", f"the form of the command is {row.form}")


def _warning(node: ast.Variable | ast.Call, detail: str, hint: str) -> Diagnostic:
    return warning(WordAsName, node.span, detail, hint)


# --- DELAY, which holds the arm ------------------------------------------------------------------------------


_TYPES = frozenset({"TYPE", "TYPEI", "PROMPT"})
_CLOCKS = frozenset({"TIME", "TIMER", "$TIME"})
_WAITS = frozenset({"WAIT", "WAIT.EVENT", "CALL", "CALLS", "PAUSE", "RETURN", "STOP", "HALT"})  # or nobody can tell


def delays(program: Program) -> Iterator[Diagnostic]:
    """Warn of the first such DELAY of a program."""
    statements = program.statements
    for number, statement in enumerate(statements, 1):
        if isinstance(statement, ast.Instruction) and statement.word == "DELAY":
            telling = (one for one in statements[number:] if _shows_time(one) or not _at_once(one))
            if (first := next(telling, None)) is not None and _shows_time(first):  # that no time has passed
                detail = "DELAY holds the arm, and the program goes on at once"
                yield warning(PauseOfArm, statement.span, detail, "TIMER 1 = 0 and WAIT TIMER(1) > 2 pause a program")
                return


def _shows_time(statement: Statement) -> bool:
    if isinstance(statement, ast.Instruction) and statement.word in _TYPES:
        return True
    calls = (node.name for node in ast.nodes(statement) if isinstance(node, ast.Call))
    return _at_once(statement) and not _CLOCKS.isdisjoint(calls)


def _at_once(statement: Statement) -> bool:
    """Whether a step surely neither moves the arm, nor waits, nor leads elsewhere."""
    if isinstance(statement, ast.Assignment):
        return True
    if not isinstance(statement, ast.Instruction) or statement.word in _WAITS:
        return False
    row = INSTRUCTIONS[statement.word]
    return statement.word == "DELAY" or not (row.route is Route.MOTION or row.breaks)
