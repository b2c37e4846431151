"""Grids: their columns, and what becomes of them where there is no room."""

import pytest

from vrs_cli.render.blocks import Column, Grid, grid_lines, number_column, split

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
