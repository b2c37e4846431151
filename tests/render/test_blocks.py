"""Test grids: their columns, and their layout on narrow pages; and control characters."""

import re
from io import StringIO

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.render.blocks import Column, Grid, grid_lines, number_column, split
from vrs_cli.render.console import TerminalRenderer
from vrs_cli.render.plain import for_stream, visible
from vrs_cli.values.replies import StringTable

FIGURES = Grid(
    tuple(number_column(heading) for heading in ("t", "X", "Y", "Z")),
    (("1.0", "2.0", "3.0", "4.0"),),
    tight=True,
    keys=1,
)
SENTENCES = Grid((Column("", width=4), Column("", fold=True)), (("CP", "a motion blends into the next one"),))


def texts(grid: Grid) -> list[str]:
    return [line.text for line in grid_lines(grid)]


def test_number_columns_are_ten_wide_and_right_aligned() -> None:
    assert texts(FIGURES) == [
        "         t         X         Y         Z",
        "       1.0       2.0       3.0       4.0",
    ]


def test_a_page_without_end_never_splits() -> None:
    assert split(FIGURES, None) == (FIGURES,)


def test_columns_go_below_each_other_with_the_key_repeated() -> None:
    parts = split(FIGURES, 30)
    assert [[column.heading for column in part.columns] for part in parts] == [["t", "X", "Y"], ["t", "Z"]]
    assert [part.rows for part in parts] == [(("1.0", "2.0", "3.0"),), (("1.0", "4.0"),)]


@pytest.mark.parametrize("width", [20, 25, 30, 39])
def test_no_part_is_wider_than_the_page(width: int) -> None:
    assert all(len(text) <= width for part in split(FIGURES, width) for text in texts(part))


def test_a_page_narrower_than_a_column_still_shows_all() -> None:
    shown = [column.heading for part in split(FIGURES, 3) for column in part.columns if column.heading != "t"]
    assert shown == ["X", "Y", "Z"]


def test_long_text_is_folded_below_itself() -> None:
    (folded,) = split(SENTENCES, 30)
    assert texts(folded) == ["CP    a motion blends into the", "      next one"]


LONG = "MOVE part AT 1 and so on and on"


def test_long_text_in_the_middle_is_folded_too() -> None:
    grid = Grid((Column("No."), Column("Command", fold=True), Column("t")), (("1", LONG, "0"),))
    (folded,) = split(grid, 28)
    assert texts(folded) == [
        "No.  Command             t",
        "1    MOVE part AT 1 and  0",
        "     so on and on        ",
    ]


def test_long_text_is_cut_where_a_column_may_be() -> None:
    grid = Grid((Column("No."), Column("Command", cut=True)), (("1", LONG),))
    (cut,) = split(grid, 27)
    assert texts(cut) == ["No.  Command", "1    MOVE part AT 1 and ..."]
    assert len(split(grid, 20)) == 2


LIKE_CAT_V = [
    ("\x1b[31mred\x1b[0m", "^[[31mred^[[0m"),
    ("\x1b]0;title\x07", "^[]0;title\x07"),
    ("\x9b5m", "M-^[5m"),
    ("\x7f\x00", "^?^@"),
    ("a\tb\r\nc\a", "a\tb\r\nc\a"),
    ("é°", "é°"),
    ("\x1b[2Aup", "\x1b[2Aup"),  # TYPE /U2
]


class Screen(StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("text", "shown"), LIKE_CAT_V)
def test_control_characters_are_shown_as_cat_v_does(text: str, shown: str) -> None:
    assert visible(text) == shown


@given(st.text())
def test_law_what_is_visible_stays_as_it_is(text: str) -> None:
    assert visible(visible(text)) == visible(text)
    assert "\x1b" not in re.sub(r"\x1b\[[0-9]+A", "", visible(text))


def test_pipes_get_the_characters() -> None:
    assert for_stream("\x1b[31m", StringIO()) == "\x1b[31m"
    assert for_stream("\x1b[31m", Screen()) == "^[[31m"


def test_answers_on_a_terminal_do_not_obey_them() -> None:
    stream = StringIO()
    TerminalRenderer(stream, width=80).draw(StringTable((("$s", "a\x1b[2Jb"),)))
    assert "a^[[2Jb" in stream.getvalue()
