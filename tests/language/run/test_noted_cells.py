"""Cells note every variable that changes, and none that does not."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.language.run.variables import Cells, Item
from vrs_cli.language.words.values import Kind

VALUES = st.dictionaries(st.sampled_from("abcd"), st.sampled_from([0.0, 1.0, 2.0]))
WAYS = st.sampled_from(["each", "together", "removed", "all removed"])


@given(VALUES, st.lists(st.tuples(WAYS, VALUES), max_size=6))
def test_what_differs_is_noted_after_every_kind_of_change(
    first: dict[str, float], changes: list[tuple[str, dict[str, float]]]
) -> None:
    cells = Cells({}, Kind.REAL)
    cells.take(first)
    for way, values in changes:
        changed, before = set[Item](), dict(cells)
        cells.note_changes(changed)
        match way:
            case "each":
                for key, value in values.items():
                    cells[key] = value
            case "together":
                cells.take(values)
            case "removed":
                for key in values:
                    cells.pop(key, None)
            case _:
                cells.clear()
        different = {key for key in {*before, *cells} if before.get(key) != cells.get(key)}
        assert changed == {(key, None) for key in different}
