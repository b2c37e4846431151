"""Lines come out of a field as they were typed, each once, however late the page hears of it."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.view3d.panel_line import SAME, TypedText, TypingField


def test_enter_ends_a_line() -> None:
    field = TypingField()
    assert field.changed("MOV", 0.0) == TypedText(None, None)
    assert field.changed("MOVE a\n", 0.1) == TypedText("MOVE a", "")
    assert field.changed("W", 1.0) == TypedText(None, None)
    assert field.changed("\n", 2.0) == TypedText("", "")


def test_enter_in_the_middle_ends_the_whole_line() -> None:
    field = TypingField()
    field.changed("SPEED 100", 0.0)
    assert field.changed("SPEED 10\n0", 1.0) == TypedText("SPEED 100", "")


def test_what_is_pasted_is_taken_as_far_as_its_lines_end() -> None:
    field = TypingField()
    assert field.changed(".PROGRAM a()\n TYPE 1\n.END\nEXEC", 0.0) == TypedText(".PROGRAM a()\n TYPE 1\n.END", "EXEC")
    assert field.changed("EXECUTE a\n", 1.0) == TypedText("EXECUTE a", "")


def test_the_same_line_again_is_done_again() -> None:
    field = TypingField()
    assert field.changed("UNDO\n", 0.0).text == "UNDO"
    assert field.changed("UNDO\n", SAME / 2) == TypedText(None, ""), "the page says again what it still has"
    assert field.changed("UNDO\n", SAME * 2).text == "UNDO"
    field.put("UNDO")
    assert field.changed("UNDO\n", SAME * 2).text == "UNDO"


KEYS = st.lists(st.tuples(st.sampled_from("abc \n"), st.booleans()), max_size=60)


@given(KEYS)
def test_each_line_is_taken_once(keys: list[tuple[str, bool]]) -> None:
    """Before some keys the page has heard what is left in its field, before others it still has all that was typed."""
    field, page, wall, answer = TypingField(), "", 0.0, ""
    taken: list[str] = []
    for key, hears in keys:
        wall += 0.01
        if hears:
            page, wall = answer, wall + 1.0
        page += key
        said = field.changed(page, wall)
        taken += [] if said.text is None else [said.text]
        answer = page if said.left is None else said.left
    typed = "".join(key for key, _ in keys)
    assert "\n".join(taken) == typed.rpartition("\n")[0]
    assert answer == typed.rpartition("\n")[2]
