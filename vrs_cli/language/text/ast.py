"""The tree of a VAL-II text: frozen values, one node class an idea, every node with its place in the source.

A program is a list of steps, one a line, as the VAL-II editor holds it. Blocks (IF ... END) are not nested nodes:
the analyzer pairs their steps (`analyzer.Block`), the compiler turns the pairs into jumps. Names are kept as
typed; two names are the same when their first 15 characters agree without regard to case (`key`).
"""

from __future__ import annotations

from collections.abc import Iterator

from msgspec import Struct

from vrs_cli.language.words.kind import NAME_LENGTH


class Span(Struct, frozen=True):
    """A stretch of one source line. Line and columns count from 1; `end` is the column after the last character."""

    line: int
    column: int
    end: int


# --- expressions -----------------------------------------------------------------------------------------------


class Number(Struct, frozen=True):
    """A numeric constant; `text` as typed (`^HFF`, `'A`, `1E-3`)."""

    value: float
    text: str
    span: Span


class Text(Struct, frozen=True):
    """A string constant, without its quotes."""

    value: str
    span: Span


class Variable(Struct, frozen=True):
    """`name`, `#name`, `$name`, `name[i]`, `name[i,j]`; `name[]` (the whole array) has `indexes == ()`.

    `sigil` is "", "#" or "$". A bare name is a real or a transformation: the analyzer decides from its use.
    `grouped`: it stands in parentheses, so that CALL passes a copy. `rest`: indexes that are left out after the others,
    less the one of `name[]`: 1 in `name[i,]` (a row of an array) and `name[,]`, 2 in `name[i,,]`.
    """

    name: str
    sigil: str
    indexes: tuple[Expression, ...] | None
    span: Span
    grouped: bool = False
    rest: int = 0

    @property
    def key(self) -> str:
        """The name under which the variable is stored: sigil, lower case, first 15 characters."""
        return self.sigil + self.name.lower()[:NAME_LENGTH]

    @property
    def many(self) -> bool:
        """Whether it is an array, or a part of one, and no element."""
        return self.indexes == () or self.rest > 0


class Unary(Struct, frozen=True):
    """`operator` is "-", "+", "NOT" or "COM"; `grouped` as in Binary."""

    operator: str
    operand: Expression
    span: Span
    grouped: bool = False


class Binary(Struct, frozen=True):
    """`operator` in canonical spelling: + - * / MOD ** == <> < > <= >= AND OR XOR BAND BOR BXOR, and `:` (compound).

    `grouped` is true when the source had parentheses round this node (the printer keeps them; the analyzer warns
    of relations beside AND/OR only when they are missing).
    """

    operator: str
    left: Expression
    right: Expression
    span: Span
    grouped: bool = False


class Call(Struct, frozen=True):
    """A function (`ABS(x)`, `TRANS(,,5)`, `#PPOINT(..)`, `$CHR(10)`) or a constant (`PI`, `HERE`: no arguments).

    `name` is upper case for a function of the table, otherwise as typed. An omitted argument is None.
    `SHIFT(l BY x,y,z)` has the arguments (l, x, y, z). `parenthesised` tells `f()` from `f`; `grouped`: a constant
    that stands in parentheses, as in Variable.
    """

    name: str
    arguments: tuple[Expression | None, ...]
    span: Span
    parenthesised: bool = False
    grouped: bool = False

    @property
    def variable(self) -> Variable:
        """The variable of this name."""
        sigil = self.name[0] if self.name[0] in "#$" else ""
        return Variable(self.name[len(sigil) :].lower(), sigil, None, self.span, self.grouped)


class ProgramCall(Struct, frozen=True):
    """A program where the table asks for one, with its arguments: `pick(a, 5)` after CALL. `name` is as typed.

    `parenthesised` as in Call.
    """

    name: str
    arguments: tuple[Expression | None, ...]
    span: Span
    parenthesised: bool = False

    @property
    def key(self) -> str:
        """The name under which the program is stored."""
        return self.name.lower()[:NAME_LENGTH]


class Applied(Struct, frozen=True):
    """The argument of CALLS: a string that names a program, with that program's arguments: `$name[i](a, 5)`."""

    text: Variable
    arguments: tuple[Expression | None, ...]
    span: Span


class Format(Struct, frozen=True):
    """A format code of TYPE and $ENCODE: `/F6.2` is code "F", width 6, decimals 2."""

    code: str
    width: int | None
    decimals: int | None
    span: Span


class Word(Struct, frozen=True):
    """A bare word or raw text where the table asks for one: a file name, a switch, a program to be stored."""

    text: str
    span: Span


Expression = Number | Text | Variable | Unary | Binary | Call | ProgramCall | Applied | Format | Word


# --- statements ------------------------------------------------------------------------------------------------


class Assignment(Struct, frozen=True):
    """`x = e`, `$s = e`."""

    target: Variable
    value: Expression
    span: Span


class Modifiers(Struct, frozen=True):
    """What may follow the arguments: `AT t` or `IN dt` (our time stamps), `ALWAYS`, and a unit (MMPS, IPS, MONITOR);
    and what may stand before them: the `sort` of the variables of a declaration (REAL, DOUBLE, LOC)."""

    at: Expression | None = None
    within: Expression | None = None  # IN dt, relative to now
    always: bool = False
    unit: str | None = None
    sort: str | None = None


NO_MODIFIERS = Modifiers()


class Instruction(Struct, frozen=True):
    """Any operation that is a row of the instruction or the monitor-command table and not a control word.

    `word` is the full upper-case keyword, also when the source abbreviated it. An omitted argument is None, trailing
    ones are absent. `value` is what follows `=` (`TIMER 1 = 0`, `SET a = b`, `POINT a = b`, `BITS 1,3 = v`).
    """

    word: str
    arguments: tuple[Expression | None, ...]
    span: Span
    value: Expression | None = None
    modifiers: Modifiers = NO_MODIFIERS


class DoInstruction(Struct, frozen=True):
    """The monitor command `DO statement`; a bare `DO` at the prompt (repeat the last) has no statement."""

    statement: Statement | None
    span: Span


class Show(Struct, frozen=True):
    """An expression alone at the prompt: its value is shown."""

    expression: Expression
    span: Span


class Goto(Struct, frozen=True):
    label: int
    span: Span


class IfGoto(Struct, frozen=True):
    """`IF condition GOTO label`, or (`then`) VAL's `IF a EQ b THEN label`, whose condition is a relation."""

    condition: Expression
    label: int
    span: Span
    then: bool = False


class If(Struct, frozen=True):
    condition: Expression
    span: Span


class Else(Struct, frozen=True):
    span: Span


class While(Struct, frozen=True):
    condition: Expression
    span: Span


class Do(Struct, frozen=True):
    """`DO` alone in a program: the loop that ends in UNTIL."""

    span: Span


class Until(Struct, frozen=True):
    condition: Expression
    span: Span


class For(Struct, frozen=True):
    variable: Variable
    first: Expression
    last: Expression
    step: Expression | None
    span: Span


class Case(Struct, frozen=True):
    subject: Expression
    span: Span


class Value(Struct, frozen=True):
    tests: tuple[Expression, ...]
    span: Span


class Any(Struct, frozen=True):
    span: Span


class End(Struct, frozen=True):
    span: Span


class BadLine(Struct, frozen=True):
    """A line that could not be read: kept as it stands, listed with `?`; its program is not executable."""

    text: str
    span: Span


Statement = (
    Assignment
    | Instruction
    | DoInstruction
    | Show
    | Goto
    | IfGoto
    | If
    | Else
    | While
    | Do
    | Until
    | For
    | Case
    | Value
    | Any
    | End
    | BadLine
)


# --- programs and files ----------------------------------------------------------------------------------------


class Step(Struct, frozen=True):
    """One line of a program. `statement` is None for a blank or comment line; `comment` is the text after `;`."""

    label: int | None
    statement: Statement | None
    comment: str | None
    span: Span


class Program(Struct, frozen=True):
    """`.PROGRAM name(parameters) ;comment` to `.END`; steps count from 1 in messages and listings.

    `span`: the heading from the name on.
    """

    name: str
    parameters: tuple[Variable, ...]
    steps: tuple[Step, ...]
    comment: str | None
    span: Span

    @property
    def key(self) -> str:
        """The name under which the program is stored."""
        return self.name.lower()[:NAME_LENGTH]


class ProgramHeader(Struct, frozen=True):
    """`.PROGRAM name(parameters) ;comment` at the prompt: what follows, up to `.END`, are its steps."""

    name: str
    parameters: tuple[Variable, ...]
    comment: str | None
    span: Span


class Entry(Struct, frozen=True):
    """A line of a .LOCATIONS, .REALS or .STRINGS section: a variable (constant indexes) and its value.

    Locations: six numbers, mm and degrees as the file writes them; reals: one; strings: `text`.
    """

    variable: Variable
    numbers: tuple[float, ...]
    text: str | None
    span: Span
    comment: str | None = None


class Section(Struct, frozen=True):
    """`.LOCATIONS`, `.REALS` or `.STRINGS` to `.END`; `name` has its dot, in upper case.

    `remarks`: lines without a variable, each as the number of entries before it, and its comment (None: blank).
    """

    name: str
    entries: tuple[Entry, ...]
    span: Span
    remarks: tuple[tuple[int, str | None], ...] = ()


class Comment(Struct, frozen=True):
    """A comment or blank line between programs and sections."""

    text: str | None
    span: Span


class File(Struct, frozen=True):
    """A program file in its order; a bad line is one that stands outside programs and sections."""

    parts: tuple[Program | Section | Comment | BadLine, ...]


def nodes(tree: object) -> Iterator[object]:
    """A tree, or a tuple of trees, node by node, from its root."""
    yield tree
    if isinstance(tree, tuple):
        for child in tree:
            yield from nodes(child)
    elif isinstance(tree, Struct):
        for name in tree.__struct_fields__:
            yield from nodes(getattr(tree, name))


def plain_number(expression: Expression | None) -> float | None:
    """A number as it stands there, also behind a minus; None for anything else."""
    if isinstance(expression, Unary) and expression.operator == "-" and isinstance(expression.operand, Number):
        return -expression.operand.value
    return expression.value if isinstance(expression, Number) else None
