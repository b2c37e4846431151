"""Print syntax trees as canonical VAL-II text: keywords in upper case, names in lower case, an indent of four blanks
for each block.

Printing a tree and parsing the result gives the same tree. Formatting a file that is already formatted does not change
it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import chain, groupby
from operator import itemgetter
from typing import Any

from vrs_cli.language.text import ast
from vrs_cli.language.text.ast import ANGLES, Expression, File, Program, Section, Statement, Step
from vrs_cli.language.words.functions import FUNCTIONS, ORDER, WITH_BY
from vrs_cli.language.words.instructions import INSTRUCTIONS, RELATIONS_OF_VAL
from vrs_cli.language.words.monitor import COMMANDS
from vrs_cli.language.words.word import COMMAS, Shape, State, Word

INDENT = 4  # indentation for each level of blocks [characters]
NAME_WIDTH = 16  # width of the column of names in a section of variables [characters]
ATOM = 100  # precedence rank of a single value: above the ranks of all operators, so that it never needs parentheses


def print_file(file: File) -> str:
    """Return the text of a file, with its comments, in the order of its parts."""
    return "".join(f"{line}\n" for part in file.parts for line in _PARTS[type(part)](part))


def print_program(program: Program) -> str:
    """Return a program from `.PROGRAM` to `.END`."""
    return print_file(File((program,)))


def program_header(program: Program | ast.ProgramHeader) -> str:
    """Return the heading of a program: `.PROGRAM name(parameters) ;comment`."""
    parameters = ", ".join(expression_text(parameter) for parameter in program.parameters)
    return _with_comment(f".PROGRAM {program.name.lower()}({parameters})", program.comment)


def step_texts(program: Program) -> tuple[str, ...]:
    """Return the indented lines of a program between `.PROGRAM` and `.END`, one line per step."""
    return tuple(_step_lines(program.steps))


# --- files -------------------------------------------------------------------------------------------------------


def _section_lines(section: Section) -> Iterator[str]:
    remarks = ((number, 0, _comment(text)) for number, text in section.remarks)
    entries = ((i, 1, _with_comment(_entry_text(entry), entry.comment)) for i, entry in enumerate(section.entries))
    lines = sorted((*remarks, *entries), key=itemgetter(0, 1))
    return chain((section.name.upper(),), (text for _, _, text in lines), (".END",))


def _entry_text(entry: ast.Entry) -> str:
    name = f"{expression_text(entry.variable):<{NAME_WIDTH}}"
    if entry.text is not None:
        return f"{name} {_quote(entry.text)}"
    if len(entry.numbers) == 1 and not entry.variable.sigil:
        (value,) = entry.numbers
        return f"{name} {int(value) if value.is_integer() and abs(value) < 1e15 else repr(value).upper()}"
    # print six decimals; if this would change the value, print all its digits, because formatting must not change it
    short = (f"{number + 0.0:.6f}" for number in entry.numbers)
    shown = (one if float(one) == of else repr(of).upper() for one, of in zip(short, entry.numbers, strict=True))
    columns = [f" {one:>12}" for one in shown]
    if entry.variable.sigil or len(columns) <= ANGLES:
        return name + "".join(columns)
    return "\n".join((name + "".join(columns[:ANGLES]), " " * NAME_WIDTH + "".join(columns[ANGLES:])))


# matches a character that cannot be in a quoted string: a quote, or a control character other than Tab
_UNQUOTABLE = r'(["\x00-\x08\x0a-\x1f])'


def _quote(text: str) -> str:
    """Return a string as a constant of the language. Characters that cannot be in quotes are written with $CHR:
    `"a"+$CHR(34)+"b"`."""
    shown = (
        f"$CHR({ord(piece)})" if at % 2 else f'"{piece}"'
        for at, piece in enumerate(re.split(_UNQUOTABLE, text))
        if piece
    )
    return "+".join(shown) or '""'


def _comment(text: str | None) -> str:
    return "" if text is None else f";{text.rstrip()}"


def _with_comment(text: str, comment: str | None) -> str:
    return text if comment is None else f"{text} ;{comment.rstrip()}"


_PARTS: Mapping[type, Callable[[Any], Iterable[str]]] = {
    Program: lambda program: (program_header(program), *_step_lines(program.steps), ".END"),
    Section: _section_lines,
    ast.Comment: lambda comment: (_comment(comment.text),),
    ast.BadLine: lambda line: (line.text,),
}

# --- steps -------------------------------------------------------------------------------------------------------


def _step_lines(steps: Sequence[Step]) -> Iterator[str]:
    """Yield the indented lines of the steps. Comments after statements in consecutive steps begin in the same
    column."""
    bodies = list(zip(steps, _bodies(steps), strict=True))
    for beside, run in groupby(bodies, key=lambda one: one[0].comment is not None and one[1].strip() != ""):
        lines = list(run)
        width = max(len(body) for _, body in lines)
        for step, body in lines:
            if beside:
                yield f"{body:<{width}} ;{(step.comment or '').rstrip()}"
            else:
                yield f"{body}{_comment(step.comment)}".rstrip()


def _bodies(steps: Sequence[Step]) -> Iterator[str]:
    """Yield the text of each step without its comment: label, indentation and statement."""
    depth = 1
    for step in steps:
        statement = step.statement
        if isinstance(statement, ast.End | ast.Until):
            depth = max(depth - 1, 1)
        shown = depth - 1 if isinstance(statement, ast.Else | ast.Value | ast.Any) else depth
        indent = " " * (INDENT * max(shown, 1))
        label = "" if step.label is None else f"{step.label} "
        text = "" if statement is None else statement_text(statement)
        yield f"{label:<{len(indent)}}{text}".rstrip() if label else f"{indent}{text}"
        if isinstance(statement, ast.If | ast.While | ast.Do | ast.For | ast.Case):
            depth += 1


# --- statements --------------------------------------------------------------------------------------------------


def statement_text(statement: Statement) -> str:
    """Return a statement in one line, without label and comment."""
    return _STATEMENTS[type(statement)](statement)


def _if_goto(statement: ast.IfGoto) -> str:
    condition = statement.condition
    if not statement.then or not isinstance(condition, ast.Binary):
        return f"IF {expression_text(condition)} GOTO {statement.label}"
    return f"IF {_operation(condition, f' {_WORDS_OF_VAL[condition.operator]} ')} THEN {statement.label}"


_WORDS_OF_VAL = {sign: word for word, sign in RELATIONS_OF_VAL.items()}


def _for(loop: ast.For) -> str:
    step = "" if loop.step is None else f" STEP {expression_text(loop.step)}"
    variable, first, last = map(expression_text, (loop.variable, loop.first, loop.last))
    return f"FOR {variable} = {first} TO {last}{step}"


def _instruction(statement: ast.Instruction) -> str:
    it, row, command = statement.modifiers, INSTRUCTIONS.get(statement.word), COMMANDS.get(statement.word)
    raw = command is not None and command.raw and isinstance(next(iter(statement.arguments), None), ast.BareWord)
    # a word may be both command and instruction: FDELETE file at the prompt, FDELETE (lun) $file in a program
    read_by = command if raw or row is None else row
    assert read_by is not None
    group = "()" * statement.empty_group
    parts = [statement.word, group, it.sort, *_argument_parts(statement, read_by), it.unit, "ALWAYS" * it.always]
    parts += (
        f"{word} {expression_text(time)}" for word, time in (("AT", it.at), ("IN", it.within)) if time is not None
    )
    return " ".join(part for part in parts if part)


def _argument_parts(statement: ast.Instruction, row: Word) -> Iterator[str]:
    arguments = list(statement.arguments)
    if row.state is not State.SUPPORTED:
        yield "".join(argument.text for argument in arguments if isinstance(argument, ast.BareWord))
        return
    if arguments[:1] == [None] and _shape_at(row, 0) is Shape.STRING and ast.begins_with_variable(arguments[1:]):
        arguments.pop(0)
    if row.takes_task and len(arguments) >= len(row.arguments):
        task = arguments.pop(len(row.arguments) - 1)
        yield "" if task is None else expression_text(task)
        arguments = ast.trim(arguments)
    arguments = [_capital(given, _shape_at(row, place)) for place, given in enumerate(arguments)]
    plain = sum(argument.lead in ("", *COMMAS) for argument in row.arguments)
    own = arguments if row.value is None or not row.value.repeated else arguments[:plain]
    yield from _operand_parts(own, row, plain)
    if statement.value is not None and row.value is not None:
        yield f"= {_list_text([_capital(statement.value, row.value.shape)])}"
    elif len(own) < len(arguments):
        yield f"= {_list_text(arguments[plain:])}"


def _operand_parts(own: list[Expression | None], row: Word, plain: int) -> Iterator[str]:
    """Yield the arguments before `=`: first the parenthesized arguments, then the comma-separated ones (up to index
    `plain`), then the ones introduced by a keyword."""
    grouped = ast.trim(own[: row.group_size])
    if row.comma:
        before, after = own[: row.before_comma], own[row.before_comma :]
        yield _list_text(before)
        yield f"{row.comma} {_list_text(after)}" if after else ""
    elif row.group_size == len(row.arguments) and not grouped:
        # keep the leading comma of an omitted group; without it the argument would be read as the group
        yield _list_text(own)
    else:
        yield f"({_list_text(grouped)})" if grouped else ""
        yield _list_text(ast.trim(own[row.group_size : plain]) if row.leads else own[row.group_size :])
        for argument, given in zip(row.arguments[plain:], own[plain:], strict=False):
            if given is not None:
                yield f"{argument.lead} {expression_text(given)}"


def _shape_at(row: Word, place: int) -> Shape:
    if not row.arguments:
        return Shape.REAL
    return row.arguments[min(place, len(row.arguments) - 1)].shape


def _capital(expression: Expression | None, shape: Shape) -> Expression | None:
    """Return the name of a switch or parameter, or a keyword as a setting's value, in upper case; return other
    expressions unchanged."""
    if shape in (Shape.SWITCH, Shape.PARAMETER_NAME, Shape.SETTING) and isinstance(expression, ast.BareWord):
        return ast.BareWord(expression.text.upper(), span=expression.span)
    return expression


def _list_text(items: Sequence[Expression | None]) -> str:
    """Return the items as text, separated by commas and blanks. For an omitted item only the comma is written."""
    shown = ("" if item is None else expression_text(item) for item in items)
    return ",".join(f" {text}" if place and text else text for place, text in enumerate(shown))


def _explain(it: ast.ExplainCommand) -> str:
    return " ".join(filter(None, ("EXPLAIN", it.topic, "" if it.statement is None else statement_text(it.statement))))


_STATEMENTS: Mapping[type, Callable[[Any], str]] = {
    ast.Assignment: lambda given: f"{expression_text(given.target)} = {expression_text(given.value)}",
    ast.Instruction: _instruction,
    ast.DoInstruction: lambda do: "DO" if do.statement is None else f"DO {statement_text(do.statement)}",
    ast.ExplainCommand: _explain,
    ast.Show: lambda statement: expression_text(statement.expression),
    ast.Goto: lambda statement: f"GOTO {statement.label}",
    ast.IfGoto: _if_goto,
    ast.If: lambda statement: f"IF {expression_text(statement.condition)} THEN",
    ast.Else: lambda _: "ELSE",
    ast.While: lambda statement: f"WHILE {expression_text(statement.condition)} DO",
    ast.Do: lambda _: "DO",
    ast.Until: lambda statement: f"UNTIL {expression_text(statement.condition)}",
    ast.For: _for,
    ast.Case: lambda statement: f"CASE {expression_text(statement.subject)} OF",
    ast.Value: lambda statement: f"VALUE {', '.join(map(expression_text, statement.tests))}:",
    ast.Any: lambda _: "ANY",
    ast.End: lambda _: "END",
    ast.BadLine: lambda statement: statement.text,
}

# --- expressions -------------------------------------------------------------------------------------------------


def expression_text(expression: Expression) -> str:
    """Return an expression as text, with the parentheses of its source and any that operator precedence requires."""
    return _EXPRESSIONS[type(expression)](expression)


def _variable(variable: ast.Variable) -> str:
    name = variable.sigil + variable.name.lower()
    if variable.indexes is not None:
        name += f"[{','.join(map(expression_text, variable.indexes))}{',' * variable.rest}]"
    return f"({name})" if variable.grouped else name


def _unary(unary: ast.Unary) -> str:
    """Return a unary operation as text. Nested unary operations are handled in a loop, because a line may have hundreds
    of signs, too many for a recursion."""
    before, closing = "", 0
    operand: Expression = unary
    while isinstance(operand, ast.Unary):
        rank, inner = ORDER.prefix[operand.operator], operand.operand
        wrapped = _rank(inner) <= rank
        before += f"{'(' * operand.grouped}{operand.operator}{' ' * operand.operator.isalpha()}{'(' * wrapped}"
        closing += operand.grouped + wrapped
        operand = inner
    return f"{before}{expression_text(operand)}{')' * closing}"


def _binary(binary: ast.Binary) -> str:
    spaced = ORDER.infix[binary.operator] <= ORDER.infix["=="] or binary.operator.isalpha()
    text = _operation(binary, f" {binary.operator} " if spaced else binary.operator)
    return f"({text})" if binary.grouped else text


def _operation(binary: ast.Binary, sign: str) -> str:
    """Return two operands with the operator `sign` between them. An operand gets parentheses if precedence would group
    it differently without them."""
    rank, left, right = ORDER.infix[binary.operator], expression_text(binary.left), expression_text(binary.right)
    before = f"({left})" if _open_rank(binary.left) < rank else left
    return f"{before}{sign}({right})" if _rank(binary.right) <= rank else f"{before}{sign}{right}"


def _rank(expression: Expression) -> int:
    if isinstance(expression, ast.Binary) and not expression.grouped:
        return ORDER.infix[expression.operator]
    return ATOM


def _open_rank(expression: Expression) -> int:
    """Return the lowest rank among the operators at the right edge of an expression. An operator of higher rank after
    the expression would take over its last operand, unless the expression is in parentheses."""
    if isinstance(expression, ast.Unary) and not expression.grouped:
        return min(ORDER.prefix[expression.operator], _open_rank(expression.operand))
    if isinstance(expression, ast.Binary) and not expression.grouped:
        return min(_rank(expression), _open_rank(expression.right))
    return ATOM


def _call(call: ast.Call) -> str:
    name = call.name if call.name in FUNCTIONS else call.name.lower()
    if not call.parenthesised:
        return f"({name})" if call.grouped else name
    first, rest = call.arguments[:1], call.arguments[1:]
    if call.name in WITH_BY and rest:
        return f"{name}({_list_text(first)} BY {_list_text(rest)})"
    return f"{name}({_list_text(call.arguments)})"


def _format(item: ast.Format) -> str:
    decimals = "" if item.decimals is None else f".{item.decimals}"
    return f"/{item.code}{'' if item.width is None else item.width}{decimals}"


_EXPRESSIONS: Mapping[type, Callable[[Any], str]] = {
    ast.Number: lambda number: number.text,
    ast.StringConstant: lambda text: f'"{text.value}"',
    ast.Variable: _variable,
    ast.Unary: _unary,
    ast.Binary: _binary,
    ast.Call: _call,
    ast.ProgramCall: lambda call: call.name.lower() + f"({_list_text(call.arguments)})" * call.parenthesised,
    ast.Applied: lambda applied: f"{expression_text(applied.text)}({_list_text(applied.arguments)})",
    ast.Format: _format,
    ast.BareWord: lambda word: f'"{word.text}"' if any(sign in word.text for sign in " \t,;=") else word.text,
}
