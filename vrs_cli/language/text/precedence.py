"""What binds tighter: the order of the operators, ours and that of VAL-II's own table (val2 section 2.2).

They differ in NOT, AND, OR and XOR against the relations; see the head of grammar/val2.lark.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Generic, TypeVar

from msgspec import Struct

from vrs_cli.language.text.lexer import Token

_RELATIONS = ("==", "<>", "<", ">", "<=", ">=")
_COMMON = {
    **dict.fromkeys(_RELATIONS, 4),
    **dict.fromkeys(("+", "-", "BOR", "BXOR"), 5),
    **dict.fromkeys(("*", "/", "MOD", "BAND"), 6),
    "**": 7,
    ":": 9,
}
_SIGNS = dict.fromkeys(("-", "+", "COM"), 8)

RELATIONS = frozenset(_RELATIONS)
LOGICAL = frozenset({"AND", "OR", "XOR", "NOT"})


class Order(Struct, frozen=True):
    """A higher rank binds tighter; equal ranks group from the left."""

    infix: Mapping[str, int]
    prefix: Mapping[str, int]


ORDER = Order({"OR": 1, "XOR": 1, "AND": 2, **_COMMON}, {"NOT": 3, **_SIGNS})
VAL_ORDER = Order({**_COMMON, "OR": 5, "XOR": 5, "AND": 6}, {"NOT": 8, **_SIGNS})

N = TypeVar("N")


class Grouping(Struct, Generic[N]):
    """The tree of a flat expression `PREFIX* value (INFIX PREFIX* value)*`, by precedence climbing."""

    order: Order
    unary: Callable[[Token, N], N]
    binary: Callable[[Token, N, N], N]

    def tree(self, items: Sequence[Token | N]) -> N:
        root, _ = self._climb(items, 0, 0)
        return root

    def _climb(self, items: Sequence[Token | N], at: int, rank: int) -> tuple[N, int]:
        """The tree that begins at an item and takes what binds tighter than `rank`, and where it ends."""
        first = items[at]
        if isinstance(first, Token):
            operand, at = self._climb(items, at + 1, self.order.prefix[first.value])
            left = self.unary(first, operand)
        else:
            left, at = first, at + 1
        while at < len(items):
            sign = items[at]
            assert isinstance(sign, Token)
            its_rank = self.order.infix[sign.value]
            if its_rank <= rank:
                break
            right, at = self._climb(items, at + 1, its_rank)
            left = self.binary(sign, left, right)
        return left, at
