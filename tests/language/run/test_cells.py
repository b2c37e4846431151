"""Cells by themselves: what they hold, and what they note."""

from __future__ import annotations

from vrs_cli.language.run.variables import Cells, Item
from vrs_cli.language.words.values import Kind


def test_elements_and_characters_are_what_cells_hold() -> None:
    simple, texts, row = Cells({}, Kind.REAL), Cells({}, Kind.STRING), Cells({}, Kind.REAL, "row")
    simple["a"], texts["s"], row[3] = 1.0, "abc", 1.0
    assert (simple.size(), texts.size(), row.size()) == (0, 3, 1)
    letters = Cells({}, Kind.STRING, "t")
    letters[0] = "abcd"
    assert letters.size() == 5


def test_changes_are_noted_from_when_it_is_asked() -> None:
    cells, row, changed = Cells({}, Kind.REAL), Cells({}, Kind.REAL, "row"), set[Item]()
    cells["a"] = cells["b"] = row[1] = 1.0
    for one in (cells, row):
        one.note_changes(changed)
    cells["a"] = 1.0
    assert changed == set(), "nothing has changed"
    cells["b"] = 2.0
    cells["c"] = 3.0
    row[2] = 1.0
    assert changed == {("b", None), ("c", None), ("row", 2)}
    changed.clear()
    assert cells.pop("a") == 1.0
    assert cells.pop("a", None) is None
    assert changed == {("a", None)}
    row.clear()
    assert changed == {("a", None), ("row", 1), ("row", 2)}
    row.note_changes(None)
    row[5] = 1.0
    assert ("row", 5) not in changed
