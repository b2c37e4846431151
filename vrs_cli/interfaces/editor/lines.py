"""EDIT, the line editor of VAL-II (val2 section 3.6): lines in, replies out. It knows no terminal.

A `Draft` is a program while it is edited and the step where the editor stands. A sub-command is a function from a draft
to the next one (`SUBCOMMANDS`); every other line is an instruction, which takes the place of the present step. Nothing
in memory changes before the editor is left by `E` or `C`: then the program is stored and its structure checked.

A letter before `=` or `[` is a variable: `d = 4` is an assignment, `D 4` deletes four steps.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, TypeVar

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.errors import IllegalValue, NotAvailable, ProgramNotExecutable, UsageError
from vrs_cli.interfaces.dialogue import Dialogue, beside_if
from vrs_cli.interfaces.station.loaded_file import LONG_PROGRAM
from vrs_cli.language.analysis.analyzer import analyze, check_line
from vrs_cli.language.analysis.names import Analysis
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.text.ast import BadLine, Expression, Program, ProgramCall, ProgramHeader, Step, Variable
from vrs_cli.language.text.meaning import resolve_line, resolve_program, variables_named_like_functions
from vrs_cli.language.text.parser import parse_prompt, parse_step
from vrs_cli.language.text.printer import print_program, program_header, step_texts
from vrs_cli.language.words.values import Kind, key_of
from vrs_cli.values.diagnostics import Diagnostic, Dialect, LineRefused, Span, errors, first_error
from vrs_cli.values.numbers import count
from vrs_cli.values.replies import Diagnosed, DiagnosticsReport, ListedStep, Message, ProgramPart, Reply

if TYPE_CHECKING:
    from vrs_cli.interfaces.station.station import Station

W = TypeVar("W")
HEADER_LINE = 1  # of a program's text; its steps follow
_SUBCOMMAND = re.compile(r"\s*(?P<word>[A-Za-z]{1,2})(?:\s+(?P<argument>(?![=\[]).*))?$")
_STEP_NUMBER = re.compile(r"\d{1,9}$")


# --- the draft -----------------------------------------------------------------------------------------------------


class Draft(Struct, frozen=True):
    """A program in the editor. `at`: the present step from 0; behind the last one where `at == len(steps)`.

    `inserting`: lines go in before the present step, until an empty line. `analysed` finds what is wrong with it.
    """

    program: Program
    at: int = 0
    inserting: bool = False
    analysed: Callable[[Program], Analysis] = analyze

    @property
    def steps(self) -> tuple[Step, ...]:
        return self.program.steps

    @property
    def prompt(self) -> str:
        """`    1.? `, as wide as what stands before a step in a listing."""
        return f"{self.at + 1:5d}.? "

    def moved(self, at: int) -> Draft:
        """At another step, or as near to it as there is one; no longer inserting."""
        return replace(self, at=max(0, min(at, len(self.steps))), inserting=False)

    def entered(self, step: Step) -> Draft:
        """With a step in the place of the present one (before it while inserting), and on to the next."""
        behind = self.at if self.inserting else self.at + 1
        steps = (*self.steps[: self.at], step, *self.steps[behind:])
        return replace(self, program=resolve_program(replace(self.program, steps=steps)), at=self.at + 1)

    def shown(self, first: int, count: int = 1) -> tuple[ListedStep, ...]:
        """Steps from `first` (from 0) on, as they are listed."""
        if first >= len(self.steps):
            return ()
        return list_steps(self.analysed(rebuilt(self.program)[0]))[first : first + count]

    def present(self) -> tuple[Reply, ...]:
        """The step where the editor stands; nothing behind the last one, and nothing while lines are inserted."""
        steps = () if self.inserting else self.shown(self.at)
        return (ProgramPart("", steps),) if steps else ()

    def screen(self) -> tuple[Reply, ...]:
        """Return the reply on entry: the heading and the present step."""
        return (ProgramPart(program_header(self.program), self.shown(self.at)),)


def list_steps(analysis: Analysis) -> tuple[ListedStep, ...]:
    """The steps of a program in canonical form, numbered, those marked that have a mistake."""
    program, wrong = analysis.program, {one.span.line for one in errors(analysis.diagnostics)}
    return tuple(
        ListedStep(number, text, bad=isinstance(step.statement, BadLine) or step.span.line in wrong)
        for number, (step, text) in enumerate(zip(program.steps, step_texts(program), strict=True), 1)
    )


class Change(NamedTuple):
    """The result of a line: the next draft, and the replies before the present step."""

    draft: Draft
    replies: tuple[Reply, ...] = ()


# --- sub-commands --------------------------------------------------------------------------------------------------


def _number(argument: str, form: str) -> int:
    """Read the number of steps, or of a step; 1 where none is given. Raises IllegalValue."""
    if not argument:
        return 1
    if _STEP_NUMBER.match(argument) is None or int(argument) == 0:
        raise IllegalValue(argument, f"{form}: a number from 1 on")
    return int(argument)


def _nothing_after(argument: str, letter: str) -> None:
    if argument:
        raise UsageError(f"{letter} {argument}", f"{letter} stands alone")


def _delete(draft: Draft, argument: str, _line: str) -> Change:
    wanted = _number(argument, "D n, n steps")
    steps = (*draft.steps[: draft.at], *draft.steps[draft.at + wanted :])
    gone = len(draft.steps) - len(steps)
    if not gone:
        raise IllegalValue("D", "there is no step here to delete")
    changed = replace(draft, program=replace(draft.program, steps=steps)).moved(draft.at)
    return Change(changed, (Message(f"{count(gone, 'step')} deleted"),))


def _find(draft: Draft, argument: str, _line: str) -> Change:
    """The next step that holds the text, in either case; behind the last step it goes on at the first."""
    if not argument:
        raise UsageError("F without a text", "F text")
    texts = [text.lower() for text in step_texts(draft.program)]
    order = [*range(draft.at + 1, len(texts)), *range(min(draft.at + 1, len(texts)))]
    found = next((at for at in order if argument.strip().lower() in texts[at]), None)
    if found is None:
        raise UsageError(f"no step holds {argument.strip()}", "F looks for text as it is listed")
    return Change(draft.moved(found))


def _insert(draft: Draft, argument: str, _line: str) -> Change:
    _nothing_after(argument, "I")
    return Change(replace(draft, inserting=True))


def _print(draft: Draft, argument: str, _line: str) -> Change:
    count = _number(argument, "P n, n steps")
    steps = draft.shown(draft.at, count)
    return Change(draft.moved(draft.at + count), (ProgramPart("", steps),) if steps else ())


def _overlay(draft: Draft, _argument: str, line: str) -> Change:
    """Replace the characters of the present step by those typed below them; a blank keeps one."""
    if draft.at == len(draft.steps):
        raise IllegalValue("R", "there is no step here to change")
    above, first = step_texts(draft.program)[draft.at], len(line) - len(line.lstrip())
    below = f"{line[:first]} {line[first + 1 :]}"  # without the letter, every other character in its column
    width = max(len(above), len(below.rstrip()))
    pairs = zip(above.ljust(width), below.ljust(width)[:width], strict=True)
    text = "".join(old if new.isspace() else new for old, new in pairs)
    return Change(replace(draft, inserting=False).entered(parse_step(text, 1, draft.program.dialect)).moved(draft.at))


def _teach(_draft: Draft, _argument: str, _line: str) -> Change:
    hint = "leave by E, define places by HERE, and write MOVE or MOVES"
    raise NotAvailable("T and TS record places with the pendant, and there is none", hint)


class Subcommand(NamedTuple):
    """A row: `act` gets the draft, what follows the letter, and the whole line."""

    form: str
    summary: str
    act: Callable[[Draft, str, str], Change]


SUBCOMMANDS: Mapping[str, Subcommand] = {
    "D": Subcommand("D [n]", "delete n steps from here", _delete),
    "F": Subcommand("F text", "go to the next step that holds the text", _find),
    "I": Subcommand("I", "insert lines before this step, until an empty line", _insert),
    "L": Subcommand(
        "L [n]",
        "go back one step, or n",
        lambda draft, argument, _line: Change(draft.moved(draft.at - _number(argument, "L n, n steps"))),
    ),
    "P": Subcommand("P [n]", "print n steps and stand behind them", _print),
    "R": Subcommand("R text", "replace the characters above the text; a blank keeps one", _overlay),
    "S": Subcommand(
        "S [step]",
        "go to a step, the first where none is named",
        lambda draft, argument, _line: Change(draft.moved(_number(argument, "S step") - 1)),
    ),
    "T": Subcommand("T", "record MOVEs with the pendant (there is none)", _teach),
    "TS": Subcommand("TS", "record MOVESs with the pendant (there is none)", _teach),
}
LEAVING: Mapping[str, str] = {"E": "store the program, check it, and leave", "C": "C program [,step]: edit another"}


def subcommand(line: str) -> tuple[str, str] | None:
    """The letter, in upper case, and what follows it; None for an instruction."""
    found = _SUBCOMMAND.match(line.rstrip())
    if found is None or found["word"].upper() not in {*SUBCOMMANDS, *LEAVING}:
        return None
    return found["word"].upper(), found["argument"] or ""


# --- lines ---------------------------------------------------------------------------------------------------------


def taken(draft: Draft, line: str, known: Mapping[str, Kind]) -> Change:
    """Carry out a line other than E and C. `known`: the kinds of the variables that have a value.

    Raises LineRefused for an instruction that cannot be read, and VrsError for a wrong sub-command: the draft stays.
    """
    if not line.strip():
        return Change(draft.moved(draft.at if draft.inserting else draft.at + 1))
    asked = subcommand(line)
    if asked is not None:
        letter, argument = asked
        return SUBCOMMANDS[letter].act(draft, argument, line)
    step, warnings = checked_step(draft.program, line, known)
    return Change(draft.entered(step), warnings)


def checked_step(program: Program, line: str, known: Mapping[str, Kind]) -> tuple[Step, tuple[Reply, ...]]:
    """A step of a program, and the warnings about it. Raises LineRefused."""
    step = parse_step(line, 1, program.dialect)
    if step.statement is None:
        return step, ()
    names = variables_named_like_functions(program.parameters, (step.statement for step in program.steps))
    found = check_line(resolve_line(step.statement, names), outside(program.parameters, known), in_program=True)
    wrong = first_error(found)
    if wrong is not None:
        raise LineRefused(wrong)
    return step, (DiagnosticsReport(tuple(Diagnosed(one, line) for one in found)),) if found else ()


def outside(parameters: Iterable[Variable], known: Mapping[str, Kind]) -> dict[str, Kind]:
    """The kinds of variables in a program; a name that a parameter bears too means something else there."""
    own = {parameter.key for parameter in parameters}
    return {key: kind for key, kind in known.items() if key not in own}


# --- programs as the memory holds them -----------------------------------------------------------------------------


def rebuilt(program: Program) -> tuple[Program, str]:
    """The program with its steps where they stand in its own text, and that text."""
    texts = step_texts(program)
    steps = tuple(
        _relocated(step, text, number)
        for number, (step, text) in enumerate(zip(program.steps, texts, strict=True), HEADER_LINE + 1)
    )
    header = program_header(program)
    source = "\n".join((header, *texts, ".END", ""))
    return resolve_program(replace(program, steps=steps, span=Span(HEADER_LINE, 1, len(header) + 1))), source


def _relocated(step: Step, text: str, line: int) -> Step:
    if isinstance(step.statement, BadLine):
        begin = len(text) - len(text.lstrip())
        span = Span(line, begin + 1, len(text) + 1)
        return replace(step, statement=replace(step.statement, span=span), span=span)
    return parse_step(text, line, Dialect.VPLUS)  # printed: its parentheses say all


# --- the editor ----------------------------------------------------------------------------------------------------


class Editor:
    """EDIT: a draft of a program of a station, from the line that opens it to `E`."""

    def __init__(self, station: Station, draft: Draft) -> None:
        self._station = station
        self.draft = draft
        self.done = False
        self._opened = draft.program

    @property
    def name(self) -> str:
        return self.draft.program.name

    @property
    def prompt(self) -> str:
        return self.draft.prompt

    @property
    def changed(self) -> bool:
        """Return whether something would be lost without E."""
        return self.draft.program != self._opened

    @property
    def text(self) -> str:
        return print_program(self.draft.program)

    def take(self, line: str) -> Dialogue[tuple[Reply, ...]]:
        """Carry out a line; what it is answered with. Raises LineRefused, VrsError: the same step is asked for again
        then.
        """
        asked = subcommand(line)
        if asked is not None and asked[0] in LEAVING:
            letter, argument = asked
            return (yield from self._leave(argument) if letter == "E" else self._change(argument))
        if line.strip().upper() == ".END":
            return (yield from self._leave(""))

        def work(draft: Draft, memory: Memory) -> tuple[Draft, tuple[Reply, ...]]:
            change = taken(draft, line, memory.kinds)
            return change.draft, (*change.replies, *change.draft.present())

        draft, replies = yield from self._on_draft(work)
        self.draft = replace(draft, analysed=self.draft.analysed)
        return replies

    def screen(self) -> Dialogue[tuple[Reply, ...]]:
        """Return the lines that are shown on entry."""
        return self._on_draft(lambda draft, _memory: draft.screen())

    def _on_draft(self, work: Callable[[Draft, Memory], W]) -> Dialogue[W]:
        """Work on the draft among what is in memory; of a long program another thread does it, among a copy of that."""
        environment, long = self._station.environment, len(self.draft.steps) > LONG_PROGRAM
        memory = environment.copy() if long else environment
        draft = replace(self.draft, analysed=partial(analysis_of, memory))
        return (yield from beside_if(long, lambda: work(draft, memory)))

    def mistake(self, line: str) -> Diagnostic | None:
        """Return the mistake in an instruction, before it is sent; sub-commands answer for themselves."""
        if not line.strip() or subcommand(line) is not None or line.strip().upper() == ".END":
            return None
        try:
            checked_step(self.draft.program, line, self._station.environment.kinds)
        except LineRefused as refused:
            return refused.diagnostic
        return None

    def _leave(self, argument: str) -> Dialogue[tuple[Reply, ...]]:
        _nothing_after(argument, "E")
        replies = yield from stored(self._station, self.draft.program)
        self.done = True
        return replies

    def _change(self, argument: str) -> Dialogue[tuple[Reply, ...]]:
        name, comma, step = (part.strip() for part in argument.partition(","))
        if not name or (comma and not step):
            raise UsageError("C", LEAVING["C"])
        at = _number(step, "C program, step")
        program = named_program(name)
        refuse_running(self._station, program.name)
        replies = yield from stored(self._station, self.draft.program)
        self.draft = opened(self._station, program, at)
        self._opened = self.draft.program
        return (*replies, *(yield from self.screen()))


def stored(station: Station, program: Program) -> Dialogue[tuple[Reply, ...]]:
    """Put an edited program in memory: its first fault, and what it is now."""
    whole, source = yield from beside_if(len(program.steps) > LONG_PROGRAM, lambda: rebuilt(program))
    found = yield from station.keep(whole, source)
    first = first_error(found)
    report: tuple[Reply, ...] = ()
    if first is not None:
        report = (DiagnosticsReport((Diagnosed(first, source.split("\n")[first.span.line - 1]),)),)
    else:
        bad = next((number for number, step in enumerate(whole.steps, 1) if isinstance(step.statement, BadLine)), None)
        if bad is not None:
            report = (Message(str(ProgramNotExecutable(f"step {bad} cannot be read", "retype it"))),)
    ready = "" if station.environment.program(whole.name).analysis.executable else "; it cannot be executed yet"
    return (*report, Message(f"Program {whole.name}: {count(len(whole.steps), 'step')}{ready}"))


def named_program(text: str) -> Program:
    """An empty program by its name and parameters, `pick(part, height)`. Raises LineRefused."""
    header = parse_prompt(f".PROGRAM {text}")
    assert isinstance(header, ProgramHeader)
    return Program(header.name, header.parameters, (), None, span=Span(HEADER_LINE, 1, 1))


def opened(station: Station, asked: Program, step: int = 1) -> Draft:
    """The program of that name as it is in memory, or a new one. Parameters that are named replace its own."""
    programs = station.programs
    if key_of(asked.name) not in programs:
        return Draft(replace(asked, dialect=station.dialect), analysed=partial(analysis_of, station.environment))
    program = programs[key_of(asked.name)].program
    if asked.parameters:
        program = replace(program, parameters=asked.parameters)
    return Draft(program, analysed=partial(analysis_of, station.environment)).moved(step - 1)


def analysis_of(memory: Memory, program: Program) -> Analysis:
    """A program among those in memory, in the place of one of its name."""
    programs = {key: one.program for key, one in memory.programs.items()} | {program.key: program}
    return analyze(program, memory.kinds, programs)


def refuse_running(station: Station, name: str) -> None:
    """Raises UsageError for a program that runs now."""
    if station.running and station.task is not None and station.task.uses(name):
        raise UsageError(f"{name} is running", "ABORT stops it")


def asked_program(expression: Expression) -> Program:
    """An empty program of the name and parameters of an argument. Raises IllegalValue."""
    given = expression.arguments if isinstance(expression, ProgramCall) else ()
    parameters = tuple(one for one in given if isinstance(one, Variable))
    if not isinstance(expression, ProgramCall) or len(parameters) < len(given):
        raise IllegalValue("the parameters of a program are variables", "EDIT pick(part, height)")
    return Program(expression.name, parameters, (), None, span=Span(HEADER_LINE, 1, 1))
