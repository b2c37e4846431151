"""Values, messages and syntax trees do not change."""

from __future__ import annotations

from collections.abc import Iterator
from types import ModuleType

import pytest
from msgspec import Struct

from vrs_cli.language.compile import lowering
from vrs_cli.language.text import ast
from vrs_cli.net import messages
from vrs_cli.values import acts, commands, hand, questions, results


def _kinds(base: type[Struct]) -> Iterator[type[Struct]]:
    for kind in base.__subclasses__():
        yield kind
        yield from _kinds(kind)


@pytest.mark.parametrize("module", [acts, commands, hand, questions, results, messages, ast, lowering])
def test_every_struct_is_frozen(module: ModuleType) -> None:
    kinds = {kind for kind in _kinds(Struct) if kind.__module__ == module.__name__}
    assert kinds
    assert [kind.__name__ for kind in kinds if not kind.__struct_config__.frozen] == []
