"""Test the values of a tree."""

from __future__ import annotations

from inspect import getmembers, isclass

from msgspec import Struct

from vrs_cli.language.text import ast


def test_nothing_changes_a_tree() -> None:
    found = [one for _, one in getmembers(ast, isclass) if issubclass(one, Struct) and one is not Struct]
    assert len(found) > 20
    assert [one.__name__ for one in found if not one.__struct_config__.frozen] == []
