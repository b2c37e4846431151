"""What binds tighter: the order of the operators, ours and that of VAL-II's own table (val2 section 2.2).

They differ in NOT, AND, OR and XOR against the relations; see the head of grammar/val2.lark.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol, TypeVar

Ranks = Mapping[str, int]

_ARITHMETIC = {
    **dict.fromkeys(("==", "<>", "<", ">", "<=", ">="), 4),
    **dict.fromkeys(("+", "-", "BOR", "BXOR"), 5),
    **dict.fromkeys(("*", "/", "MOD", "BAND"), 6),
    "**": 7,
    ":": 9,
}

INFIX: Ranks = {"OR": 1, "XOR": 1, "AND": 2, **_ARITHMETIC}
PREFIX: Ranks = {"NOT": 3, "-": 8, "+": 8, "COM": 8}

VAL_INFIX: Ranks = {**_ARITHMETIC, "OR": 5, "XOR": 5, "AND": 6}
VAL_PREFIX: Ranks = {"NOT": 8, "-": 7, "+": 7, "COM": 8}

SPELLINGS = {"=<": "<=", "=>": ">="}
RELATIONS = frozenset({"==", "<>", "<", ">", "<=", ">="})
LOGICAL = frozenset({"AND", "OR", "XOR", "NOT"})


class Sign(Protocol):
    """An operator in a flat expression."""

    @property
    def type(self) -> str: ...

    @property
    def value(self) -> str: ...


N = TypeVar("N")
S = TypeVar("S", bound=Sign)


def group(
    items: Sequence[S | N],
    is_sign: Callable[[S | N], bool],
    infix: Ranks,
    prefix: Ranks,
    unary: Callable[[S, N], N],
    binary: Callable[[N, S, N], N],
) -> N:
    """The tree of a flat expression `PREFIX* value (INFIX PREFIX* value)*`, by precedence climbing."""
    raise NotImplementedError
