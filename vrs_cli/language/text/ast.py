"""Define the tree of a VAL-II text: immutable values, one class for each construct, each node with its position in the
source.

A program is a list of steps, one for each line, as in the VAL-II editor. Blocks (IF ... END) are not nested nodes: the
analyzer pairs the first and last step of each block (`names.Block`), and the compiler converts the pairs to jumps.
Names are kept as typed. Two names are the same if their first 15 characters are equal, ignoring case (`key`).
"""

from __future__ import annotations

from collections.abc import Collection, Container, Iterable, Iterator, Sequence
from operator import is_
from typing import TypeVar, cast

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.language.words.functions import FUNCTIONS
from vrs_cli.language.words.instructions import INSTRUCTIONS, RESERVED
from vrs_cli.language.words.values import INPUTS, NAME_LENGTH, OUTPUTS
from vrs_cli.language.words.word import Shape, argument_at
from vrs_cli.values.diagnostics import Dialect, Span

ANGLES, AXES = 6, 12  # count of numbers that define a transformation: with three angles, or with three axes


class Node(Struct, frozen=True, kw_only=True):
    """A node of the syntax tree. `span`: its position in the source."""

    span: Span


# --- expressions -----------------------------------------------------------------------------------------------


class Number(Node, frozen=True):
    """A numeric constant. `text`: the constant as typed (`^HFF`, `'A`, `1E-3`)."""

    value: float
    text: str


class StringConstant(Node, frozen=True):
    """A string constant, without its quotes."""

    value: str


class Variable(Node, frozen=True):
    """A variable: `name`, `#name`, `$name`, `name[i]` or `name[i,j]`; `name[]` (the whole array) has `indexes == ()`.

    `sigil` is "" (a real or a transformation; the analyzer decides by the variable's use), "#" (a precision point) or
    "$" (a string). `grouped`: the variable is in parentheses, so that CALL passes a copy. `rest`: the number of indexes
    omitted after the last comma or commas: 1 in `name[i,]` (a row of an array) and `name[,]`, 2 in `name[i,,]`, and 0
    in `name[]`.
    """

    name: str
    sigil: str
    indexes: tuple[Expression, ...] | None
    grouped: bool = False
    rest: int = 0

    @property
    def key(self) -> str:
        """Return the name under which the variable is stored: sigil, lower case, first 15 characters."""
        return self.sigil + self.name.lower()[:NAME_LENGTH]

    @property
    def many(self) -> bool:
        """Return whether this is an array or a part of one, rather than a single variable or element."""
        return self.indexes == () or self.rest > 0


class Unary(Node, frozen=True):
    """An operation with one operand. `operator` is "-", "+", "NOT" or "COM"; `grouped`: the source has parentheses
    around the operation."""

    operator: str
    operand: Expression
    grouped: bool = False


class Binary(Node, frozen=True):
    """An operation with two operands. `operator` is one of + - * / MOD ** == <> < > <= >= AND OR XOR BAND BOR BXOR, or
    `:` (compound).

    `grouped`: the source has parentheses around the operation. The printer keeps them. The analyzer warns about
    relations beside AND and OR only if the relations have no parentheses.
    """

    operator: str
    left: Expression
    right: Expression
    grouped: bool = False


class Call(Node, frozen=True):
    """A function (`ABS(x)`, `TRANS(,,5)`, `#PPOINT(..)`, `$CHR(10)`) or a constant (`PI`, `HERE`: no arguments).

    `name` is in upper case if the table has it, otherwise as typed. An omitted argument is None. `SHIFT(l BY x,y,z)`
    has the arguments (l, x, y, z). `parenthesised` is True for `f()`, False for `f`. `grouped`: the constant itself is
    in parentheses: `(PI)`.
    """

    name: str
    arguments: tuple[Expression | None, ...]
    parenthesised: bool = False
    grouped: bool = False

    @property
    def variable(self) -> Variable:
        sigil = self.name[0] if self.name[0] in "#$" else ""
        return Variable(self.name[len(sigil) :].lower(), sigil, None, self.grouped, span=self.span)


class ProgramCall(Node, frozen=True):
    """A program with its arguments, as after CALL: `pick(a, 5)`. `name`: the program's name as typed; `parenthesised`:
    True for `pick()`, False for `pick`."""

    name: str
    arguments: tuple[Expression | None, ...]
    parenthesised: bool = False

    @property
    def key(self) -> str:
        """Return the name under which the program is stored: lower case, first 15 characters."""
        return self.name.lower()[:NAME_LENGTH]


class Applied(Node, frozen=True):
    """The argument of CALLS: a string that names a program, with arguments: `$name[i](a, 5)`, `"name"(a, 5)`,
    `$kind+"name"(a, 5)`.
    """

    text: Expression
    arguments: tuple[Expression | None, ...]


class Format(Node, frozen=True):
    """A format code of TYPE and $ENCODE: `/F6.2` has the code "F", the width 6 and 2 decimals."""

    code: str
    width: int | None
    decimals: int | None


class BareWord(Node, frozen=True):
    """A word or text that is not an expression, such as the name of a file, a switch, or the keyword of a setting."""

    text: str


Expression = Number | StringConstant | Variable | Unary | Binary | Call | ProgramCall | Applied | Format | BareWord


# --- statements ------------------------------------------------------------------------------------------------


class Assignment(Node, frozen=True):
    """The assignment `x = e` or `$s = e`."""

    target: Variable
    value: Expression


class Modifiers(Struct, frozen=True):
    """The optional words of an instruction that modify it: `AT t` or `IN dt` (a time), `ALWAYS`, and a unit of speed
    (MMPS, IPS, MONITOR). `sort`: the kind of variables in a declaration (REAL, DOUBLE, LOC)."""

    at: Expression | None = None
    within: Expression | None = None  # the dt of IN dt: a duration from now [s]
    always: bool = False
    unit: str | None = None
    sort: str | None = None

    @property
    def has_time(self) -> bool:
        """Return whether AT or IN gives a time."""
        return self.at is not None or self.within is not None


NO_MODIFIERS = Modifiers()


class Instruction(Node, frozen=True):
    """An instruction or a monitor command. The words of blocks and jumps (IF, FOR, GOTO) have their own classes.

    `word`: the whole keyword in upper case, even if the source abbreviates it. In `arguments` an omitted argument is
    None; arguments omitted at the end are left out. `value`: the value after `=` (`TIMER 1 = 0`, `SET a = b`,
    `POINT a = b`, `BITS 1,3 = v`). `empty_group`: whether empty parentheses follow the word (`ATTACH ()`).
    """

    word: str
    arguments: tuple[Expression | None, ...]
    value: Expression | None = None
    modifiers: Modifiers = NO_MODIFIERS
    empty_group: bool = False


class DoInstruction(Node, frozen=True):
    """The monitor command `DO statement`. `DO` alone repeats the statement of the last DO; `statement` is then None."""

    statement: Statement | None


class ExplainCommand(Node, frozen=True):
    """The monitor command EXPLAIN. `statement`: the motion (an Instruction) or location (a Show) to explain, or None.
    `topic`: OAT or IK (about a location), SPLICE (about the last change of the timeline), or ""."""

    topic: str
    statement: Statement | None


class Show(Node, frozen=True):
    """An expression alone at the prompt. The shell shows its value."""

    expression: Expression


class Goto(Node, frozen=True):
    label: int


class IfGoto(Node, frozen=True):
    """`IF condition GOTO label`. `then`: the line has the older form of VAL, `IF a EQ b THEN label`, whose condition is
    a relation."""

    condition: Expression
    label: int
    then: bool = False


class If(Node, frozen=True):
    condition: Expression


class Else(Node, frozen=True):
    """The line `ELSE`."""


class While(Node, frozen=True):
    condition: Expression


class Do(Node, frozen=True):
    """`DO` alone on a line of a program, which begins a loop that ends with UNTIL."""


class Until(Node, frozen=True):
    condition: Expression


class For(Node, frozen=True):
    variable: Variable
    first: Expression
    last: Expression
    step: Expression | None


class Case(Node, frozen=True):
    subject: Expression


class Value(Node, frozen=True):
    tests: tuple[Expression, ...]


class Any(Node, frozen=True):
    """`ANY`, the last branch of a CASE."""


class End(Node, frozen=True):
    """The line `END`, which ends an IF, WHILE, FOR or CASE."""


class BadLine(Node, frozen=True):
    """A line with a syntax error. It is kept as typed and listed with `?`. A program with such a line cannot run."""

    text: str


Statement = (
    Assignment
    | Instruction
    | DoInstruction
    | ExplainCommand
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


class Step(Node, frozen=True):
    """One line of a program. `statement`: None for a blank or comment line; `comment`: the text after `;`."""

    label: int | None
    statement: Statement | None
    comment: str | None


class Program(Node, frozen=True, dict=True, weakref=True):
    """A program from `.PROGRAM name(parameters) ;comment` to `.END`. Messages and listings number its steps from 1.
    `span`: the position of the heading, beginning at the name."""

    name: str
    parameters: tuple[Variable, ...]
    steps: tuple[Step, ...]
    comment: str | None
    dialect: Dialect = Dialect.VPLUS

    @property
    def statements(self) -> tuple[Statement, ...]:
        """Return the statements of all steps, without blank lines and comments."""
        return tuple([step.statement for step in self.steps if step.statement is not None])

    @property
    def key(self) -> str:
        """Return the name under which the program is stored: lower case, first 15 characters."""
        return self.name.lower()[:NAME_LENGTH]


class ProgramHeader(Node, frozen=True):
    """The line `.PROGRAM name(parameters) ;comment` at the prompt. The lines after it, up to `.END`, are the steps of
    the program."""

    name: str
    parameters: tuple[Variable, ...]
    comment: str | None


class Entry(Node, frozen=True):
    """A line of a .LOCATIONS, .REALS or .STRINGS section: a variable (with constant indexes) and its value.

    `numbers`: for a location, six numbers (position [mm] and angles [degrees], as in the file) or twelve (the axes n,
    s, a and the position [mm]); for a precision point, its joints; for a real, one number. `text`: the value of a
    string.
    """

    variable: Variable
    numbers: tuple[float, ...]
    text: str | None
    comment: str | None = None


class Section(Node, frozen=True):
    """A section from `.LOCATIONS`, `.REALS` or `.STRINGS` to `.END`. `name`: the section's name in upper case, with the
    dot. `remarks`: the comment and blank lines, each as the number of entries before it and its text (None for a blank
    line). `whole`: whether all lines of the section were read without mistakes."""

    name: str
    entries: tuple[Entry, ...]
    remarks: tuple[tuple[int, str | None], ...] = ()
    whole: bool = True


class Comment(Node, frozen=True):
    """A comment or blank line between programs and sections."""

    text: str | None


class File(Struct, frozen=True):
    """A program file. `parts`: its programs, sections and comments in their order; a BadLine is a line outside programs
    and sections that is neither comment nor blank."""

    parts: tuple[Program | Section | Comment | BadLine, ...]


def nodes(tree: object) -> Iterator[object]:
    """Yield all nodes of a tree, or of a tuple of trees, each before its children (depth first)."""
    waiting = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        if isinstance(node, tuple):
            waiting += reversed(node)
        elif isinstance(node, Struct):
            waiting += [getattr(node, name) for name in reversed(node.__struct_fields__)]


def children(tree: Struct) -> Iterator[Expression]:
    """Yield the expressions that are direct children of a statement or an expression."""
    for name in tree.__struct_fields__:
        child = getattr(tree, name)
        if isinstance(child, Modifiers):
            yield from children(child)
        else:
            yield from (one for one in (child if isinstance(child, tuple) else (child,)) if isinstance(one, Expression))


def plain_number(expression: Expression | None) -> float | None:
    """Return the value of a numeric constant with or without a minus sign; None for any other expression."""
    if isinstance(expression, Unary) and expression.operator == "-" and isinstance(expression.operand, Number):
        return -expression.operand.value
    return expression.value if isinstance(expression, Number) else None


def channel(expression: Expression) -> int | None:
    """Return the signal number for an input channel of VAL: 1001 for channel 1, -1001 for channel -1 (tested for off).
    Return None if the expression is not a whole number other than 0."""
    if isinstance(expression, Unary) and expression.operator == "-":
        inner = channel(expression.operand)
        return None if inner is None else -inner
    if not isinstance(expression, Number) or not expression.value.is_integer() or not expression.value:
        return None
    number = int(expression.value)
    return number + INPUTS[0] - OUTPUTS[0] if number in OUTPUTS else number


def signals_on(channels: Iterable[Expression | None], span: Span) -> Call:
    """Return the expression `SIG(...)` for input channels of VAL. A channel that is not a numeric constant is used as a
    signal number without conversion."""
    signals = list[Expression]()
    for one in channels:
        number = None if one is None else channel(one)
        if one is not None and number is not None:
            known = Number(float(abs(number)), str(abs(number)), span=one.span)
            signals.append(known if number > 0 else Unary("-", known, span=one.span))
        elif one is not None:
            signals.append(one)
    return Call("SIG", tuple(signals), True, span=span)


def to_variable(expression: Expression) -> Expression:
    """Convert a constant such as HERE to the variable with the same name, for places where an instruction defines a
    variable. Other expressions are returned unchanged."""
    if isinstance(expression, Call) and not expression.parenthesised:
        return expression.variable
    if isinstance(expression, Binary) and expression.operator == ":":
        return replace(expression, right=to_variable(expression.right))
    return expression


def begins_with_variable(items: Sequence[Expression | None]) -> bool:
    """Return whether the arguments of PROMPT begin with a variable to read, rather than with the text to show.

    PROMPT reads a string variable if it is the only argument; before other arguments, the string is the text to show.
    """
    first = to_variable(items[0]) if items and items[0] is not None else None
    return isinstance(first, Variable) and (first.sigil != "$" or len(items) == 1)


def trim(items: list[Expression | None]) -> list[Expression | None]:
    """Return a list without the omitted items (None) at its end."""
    while items and items[-1] is None:
        items = items[:-1]
    return items


# --- variables with the names of functions ---

Tree = TypeVar("Tree")

# names that can be a function without arguments or a variable (HERE, TOOL), by the key of the variable
FUNCTION_NAMES = {name.lower(): name for name, row in FUNCTIONS.items() if row.constant and name not in RESERVED}
DEFINING = frozenset({Shape.VARIABLE, Shape.REAL_VARIABLE, Shape.STRING_VARIABLE, Shape.LOCATION_VARIABLE, Shape.UNIT})
_CALLED = frozenset({Shape.PROGRAM, Shape.PROGRAM_TEXT})


def resolve_program(program: Program) -> Program:
    """Return a program in which bare names of functions are replaced by variables if the program assigns or declares
    them.

    A bare name such as HERE, TOOL or HAND is either a function without arguments or a variable. The parser sees only
    one line and assumes the function, so this function decides for the whole program. `HAND()` is always the function.
    """
    names = variables_named_like_functions(program.parameters, (step.statement for step in program.steps))
    return replace(program, steps=_replace(program.steps, names)) if names else program


def resolve_line(statement: Statement, known: Container[str]) -> Statement:
    """Return a statement in which bare names of functions are replaced by variables if the statement assigns them or
    `known` contains them. `known`: the keys of the existing variables."""
    inner = statement.statement if isinstance(statement, DoInstruction | ExplainCommand) else statement
    names = variables_named_like_functions((), (inner,)) | {key for key in FUNCTION_NAMES if key in known}
    return _replace(statement, names) if names else statement


def variables_named_like_functions(parameters: Iterable[Variable], statements: Iterable[Statement | None]) -> set[str]:
    """Return the keys of those parameters and assigned or declared variables that have the name of a function."""
    named = {parameter.key for parameter in parameters}
    for statement in statements:
        named.update(variables_given_by(statement))
    return named & FUNCTION_NAMES.keys()


def variables_given_by(statement: Statement | None) -> Iterator[str]:
    """Yield the keys of the variables that a statement declares or assigns, directly or through a CALL."""
    for variable in definitions(statement):
        yield variable.key
    for called in _arguments(statement, _CALLED):
        if isinstance(called, ProgramCall | Applied):
            yield from (argument.key for argument in called.arguments if isinstance(argument, Variable))


def definitions(statement: Statement | None) -> Iterator[Variable]:
    """Yield the variables that a statement declares or assigns itself, not through a CALL."""
    if isinstance(statement, Assignment):
        yield statement.target
    elif isinstance(statement, For):
        yield statement.variable
    for given in _arguments(statement, DEFINING):
        last = given.right if isinstance(given, Binary) else given  # HERE a:b defines b, relative to a
        if isinstance(last, Variable):
            yield last


def _arguments(statement: Statement | None, shapes: frozenset[Shape]) -> Iterator[Expression]:
    """Yield the arguments of an instruction whose shape in the word tables is one of `shapes`."""
    row = INSTRUCTIONS.get(statement.word) if isinstance(statement, Instruction) else None
    if row is not None and isinstance(statement, Instruction) and not row.operand_shapes.isdisjoint(shapes):
        for place, given in enumerate(statement.arguments):
            argument = argument_at(row, place)
            if argument is not None and given is not None and argument.shape in shapes:
                yield given


def _replace(tree: Tree, names: Collection[str]) -> Tree:
    """Return a tree in which functions without parentheses whose lower-case name is in `names` are replaced by
    variables."""
    if isinstance(tree, Call) and not tree.parenthesised and tree.name.lower() in names:
        return cast(Tree, tree.variable)
    if isinstance(tree, tuple):
        children = tuple(_replace(child, names) for child in tree)
        return cast(Tree, tree if all(map(is_, children, tree)) else children)
    if not isinstance(tree, Struct) or isinstance(tree, Span):
        return tree
    changed: dict[str, Any] = {}
    for name in tree.__struct_fields__:
        before = getattr(tree, name)
        after = _replace(before, names)
        if after is not before:
            changed[name] = after
    return cast(Tree, replace(cast(Any, tree), **changed)) if changed else tree
