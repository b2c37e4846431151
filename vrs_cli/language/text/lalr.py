"""Parse the tokens of one line by the LALR(1) algorithm (Aho, Sethi, Ullman: Compilers, 4.7).

Lark makes the parse table of a grammar. The table is kept in the user's cache, so that most runs load no Lark, and
`TableParser` follows it, twice as fast as Lark does. Lark shows the table in a private attribute only: if a release has
another table there, `LarkParser` parses through Lark's public interface instead, and gives the same trees.
"""

from __future__ import annotations

import marshal
import os
import zlib
from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from vrs_cli.language.text.lexer import Token
from vrs_cli.version import __version__

END = "$END"  # the terminal behind the last
FORM = f"vrs {__version__}, table 1"  # of the kept file
CHECKSUM = 4  # bytes


class DoesNotFit(Exception):
    """`token` does not fit the grammar (None: the end of the line); the terminals `accepted` would, in its place."""

    def __init__(self, token: Token | None, accepted: frozenset[str]) -> None:
        self.token, self.accepted = token, accepted


class TokenParser(Protocol):
    """`terminals`: the pattern of each terminal of the grammar."""

    terminals: dict[str, str]

    def parse(self, tokens: Sequence[Token], start: str) -> Any:
        """Return what the builder makes of the tokens. Raises DoesNotFit, and LineRefused if the builder does."""


def token_parser(grammar: str, starts: tuple[str, ...], builder: object) -> TokenParser:
    """`builder`: has a method for each rule, which is called with the list of the rule's children."""
    table = table_of(grammar, starts)
    return LarkParser(grammar, starts, builder) if table is None else TableParser(table, builder)


# --- the table -----------------------------------------------------------------------------------------------------


class Rule(NamedTuple):
    """`name`: the builder's method. `origin`: the symbol that the rule makes. `helpers`: for each child, whether it is
    a list whose items take its place. `alone`: an only child is the result, without a call of the method."""

    name: str
    origin: str
    helpers: tuple[bool, ...]
    alone: bool


class Table(NamedTuple):
    """`states`: for each symbol the next state or, below 0, the inverse (~) of the index of the complete rule. `starts`
    and `ends`: the states in which a start symbol begins and is complete. `terminals`: their patterns."""

    states: dict[int, dict[str, int]]
    rules: list[Rule]
    starts: dict[str, int]
    ends: dict[str, int]
    terminals: dict[str, str]


def table_of(grammar: str, starts: tuple[str, ...]) -> Table | None:
    """Return the table of a grammar, kept or new; None if this Lark shows no table of the form that we know."""
    file = _file()
    kept = _kept(file, grammar) if file else None
    if kept is not None:
        return kept
    try:
        table = _table(_lark(grammar, starts))
    except (AttributeError, KeyError, TypeError, ValueError):
        return None
    if not _is_sound(table, starts):
        return None
    if file:
        _keep(file, grammar, table)
    return table


def _lark(grammar: str, starts: tuple[str, ...], builder: object = None) -> Any:
    from lark import Lark

    return Lark(grammar, start=list(starts), parser="lalr", lexer="basic", keep_all_tokens=True, transformer=builder)


def _table(lark: Any) -> Table:
    """Read the table that this Lark has made. Raises AttributeError and others where it has another form."""
    made = lark.parser.parser._parse_table
    rules = {rule: number for number, rule in enumerate(lark.rules)}
    states = {
        state: {str(symbol): ~rules[to] if to in rules else to for symbol, (_, to) in actions.items()}
        for state, actions in made.states.items()
    }
    shapes = [
        Rule(
            str(rule.alias or rule.origin.name),
            str(rule.origin.name),
            tuple(not symbol.is_term and symbol.name.startswith("_") for symbol in rule.expansion),
            bool(rule.options.expand1 and not rule.alias),
        )
        for rule in lark.rules
    ]
    return Table(states, shapes, dict(made.start_states), dict(made.end_states), _terminals(lark))


def _is_sound(table: Table, starts: tuple[str, ...]) -> bool:
    """Whether each start symbol has its states, and each entry leads to a state or a rule that exists."""
    entries = [to for row in table.states.values() for to in row.values()]
    bounds = (*table.starts.values(), *table.ends.values())
    return (
        set(table.starts) == set(table.ends) == set(starts)
        and all(type(to) is int and (to in table.states or 0 <= ~to < len(table.rules)) for to in entries)
        and all(state in table.states for state in bounds)
        and any(to < 0 for to in entries)
    )


def _terminals(lark: Any) -> dict[str, str]:
    return {str(terminal.name): terminal.pattern.to_regexp() for terminal in lark.terminals}


def _kept(file: Path, grammar: str) -> Table | None:
    try:
        data = file.read_bytes()
        if zlib.crc32(data[CHECKSUM:]) != int.from_bytes(data[:CHECKSUM], "big"):
            return None  # marshal trusts what it reads
        form, source, states, rules, *rest = marshal.loads(data[CHECKSUM:])
        return Table(states, [Rule(*rule) for rule in rules], *rest) if (form, source) == (FORM, grammar) else None
    except (OSError, EOFError, ValueError, TypeError):
        return None


def _keep(file: Path, grammar: str, table: Table) -> None:
    """Write it as a whole or not at all."""
    data = marshal.dumps((FORM, grammar, table.states, list(map(tuple, table.rules)), *table[2:]))
    new = file.with_suffix(f".{os.getpid()}")
    with suppress(OSError):
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        new.write_bytes(zlib.crc32(data).to_bytes(CHECKSUM, "big") + data)
        os.replace(new, file)


def _file() -> Path | None:
    """The path of the kept table, in a folder of the user's own; None for a user without a home."""
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    with suppress(RuntimeError):
        return (Path(base) if base else Path.home() / ".cache") / "vrs" / "grammar.table"
    return None


# --- by the table --------------------------------------------------------------------------------------------------


class TableParser:
    """Follows the table."""

    def __init__(self, table: Table, builder: object) -> None:
        self.table, self.terminals = table, table.terminals
        self._reductions = [_reduction(rule, builder) for rule in table.rules]

    def parse(self, tokens: Sequence[Token], start: str) -> Any:
        states, reductions, done = self.table.states, self._reductions, self.table.ends[start]
        at, values = [self.table.starts[start]], list[Any]()
        for token in (*tokens, None):
            terminal, stand = END if token is None else token.type, at.copy()
            while (to := states[at[-1]].get(terminal)) is not None and to < 0:
                origin, size, build = reductions[~to]
                children = values[len(values) - size :]
                del at[len(at) - size :], values[len(values) - size :]
                values.append(build(children))
                at.append(states[at[-1]][origin])
                if token is None and at[-1] == done:
                    return values[-1]
            if to is None:
                raise DoesNotFit(token, self._accepted(stand, start))
            at.append(to)
            values.append(token)
        raise AssertionError("the end of a line is never shifted")

    def _accepted(self, at: list[int], start: str) -> frozenset[str]:
        """The terminals that may follow. A state names some of which only a reduction shows that they may not."""
        return frozenset(
            symbol for symbol in self.table.states[at[-1]] if symbol.isupper() and self._fits(at.copy(), symbol, start)
        )

    def _fits(self, at: list[int], symbol: str, start: str) -> bool:
        states = self.table.states
        while (to := states[at[-1]].get(symbol)) is not None and to < 0:
            origin, size, _ = self._reductions[~to]
            del at[len(at) - size :]
            at.append(states[at[-1]][origin])
            if at[-1] == self.table.ends[start]:
                return symbol == END
        return to is not None


# When a rule is complete, one symbol (its origin) is made of so many values, by a function.
_Reduction = tuple[str, int, Callable[[list[Any]], Any]]


def _reduction(rule: Rule, builder: object) -> _Reduction:
    build: Callable[[list[Any]], Any] = getattr(builder, rule.name, list)  # a helper is the list of its children
    if rule.alone:
        build = partial(_only_child_or, build)
    if any(rule.helpers):
        build = partial(_with_children_of_helpers, build, rule.helpers)
    return rule.origin, len(rule.helpers), build


def _only_child_or(build: Callable[[list[Any]], Any], children: list[Any]) -> Any:
    return children[0] if len(children) == 1 else build(children)


def _with_children_of_helpers(build: Callable[[list[Any]], Any], helpers: tuple[bool, ...], children: list[Any]) -> Any:
    own = list[Any]()
    for helper, child in zip(helpers, children, strict=True):
        own += child if helper else (child,)
    return build(own)


# --- by Lark's public interface ------------------------------------------------------------------------------------


class LarkParser:
    """Parses through `Lark.parse_interactive`, with the builder as Lark's transformer."""

    def __init__(self, grammar: str, starts: tuple[str, ...], builder: object) -> None:
        self._lark = _lark(grammar, starts, builder)
        self.terminals = _terminals(self._lark)

    def parse(self, tokens: Sequence[Token], start: str) -> Any:
        from lark import UnexpectedToken

        fed, parser = 0, self._lark.parse_interactive(start=start)
        try:
            for token in tokens:
                parser.feed_token(token)
                fed += 1
            return parser.feed_eof()
        except UnexpectedToken:
            refused = tokens[fed] if fed < len(tokens) else None
            raise DoesNotFit(refused, self._accepted(tokens[:fed], start)) from None

    def _accepted(self, tokens: Sequence[Token], start: str) -> frozenset[str]:
        """Feed the tokens that fit again: when Lark refuses one, it has already reduced rules on its behalf."""
        parser = self._lark.parse_interactive(start=start)
        for token in tokens:
            parser.feed_token(token)
        return frozenset(parser.accepts())
