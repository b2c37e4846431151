"""The parse table of a grammar: lark makes it, and it is kept between runs, so that most of them need no lark.

The table is what the LALR(1) algorithm asks for: what to do in a state for a terminal, and what a rule is made of.
"""

from __future__ import annotations

import marshal
import os
import zlib
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from vrs_cli.version import __version__

END = "$END"  # the terminal behind the last
FORM = f"vrs {__version__}, table 1"  # of what is kept
CHECKSUM = 4  # bytes


class Rule(NamedTuple):
    """`name`: the method that builds it. `origin`: the symbol that it makes. `helpers`: which of its children are lists
    of children that belong in their place. `alone`: an only child stands for the whole."""

    name: str
    origin: str
    helpers: tuple[bool, ...]
    alone: bool


class Table(NamedTuple):
    """`states`: for a symbol, the next state or, below 0, the inverse (~) of the rule that is complete. `starts` and
    `ends`: the states in which a start symbol begins and is complete. `terminals`: their patterns."""

    states: dict[int, dict[str, int]]
    rules: list[Rule]
    starts: dict[str, int]
    ends: dict[str, int]
    terminals: dict[str, str]


def table_of(grammar: str, starts: tuple[str, ...]) -> Table:
    """The table of a grammar, as it was kept or made anew."""
    file = _file()
    kept = _kept(file, grammar) if file else None
    if kept is not None:
        return kept
    table = _made(grammar, starts)
    if file:
        _keep(file, grammar, table)
    return table


def _made(grammar: str, starts: tuple[str, ...]) -> Table:
    from lark import Lark

    lark = Lark(grammar, start=list(starts), parser="lalr", lexer="basic", keep_all_tokens=True)
    made: Any = lark.parser.parser
    rules = {rule: number for number, rule in enumerate(lark.rules)}
    states = {
        state: {str(symbol): ~rules[to] if to in rules else to for symbol, (_, to) in actions.items()}
        for state, actions in made._parse_table.states.items()
    }
    terminals = {str(terminal.name): terminal.pattern.to_regexp() for terminal in lark.terminals}
    starts_at, ends_at = made._parse_table.start_states, made._parse_table.end_states
    return Table(states, list(map(_rule, lark.rules)), dict(starts_at), dict(ends_at), terminals)


def _rule(rule: Any) -> Rule:
    helpers = tuple(not symbol.is_term and symbol.name.startswith("_") for symbol in rule.expansion)
    name, origin = str(rule.alias or rule.origin.name), str(rule.origin.name)
    return Rule(name, origin, helpers, bool(rule.options.expand1 and not rule.alias))


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
    """Where it is kept: in a folder of the user's own; nowhere for a user without a home."""
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA")
    with suppress(RuntimeError):
        return (Path(base) if base else Path.home() / ".cache") / "vrs" / "grammar.table"
    return None
