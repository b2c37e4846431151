"""Test explanations in a notebook: Markdown and LaTeX of the same blocks."""

from __future__ import annotations

from vrs_cli.kinematics.transform import IDENTITY
from vrs_cli.render.blocks import PIPE, Column, Grid, line
from vrs_cli.render.colours import Ink
from vrs_cli.render.documents import latex_document, markdown
from vrs_cli.render.explained import formula, matrices

TABLE = Grid((Column("Name"), Column("x mm", right=True)), (("a|b", "1.000"), ("<i>", "2.000")))


def test_a_table_in_markdown_shows_names_as_they_are() -> None:
    assert markdown([TABLE]).split("\n") == [
        "| Name | x mm |",
        "| :--- | ---: |",
        r"| a\|b | 1.000 |",
        r"| \<i\> | 2.000 |",
        "",
    ]


def test_texts_are_no_markup() -> None:
    assert markdown([line("*not* _this_ $x$ [a](b)")]) == r"\*not\* \_this\_ \$x\$ \[a\]\(b\)" + "\n"
    assert markdown([line("1. The centre", Ink.HEADING)]) == "**1. The centre**\n"
    assert latex_document([line(r"50 % of a_b & \\c")]) == r"50 \% of a\_b \& \backslash \backslash c" + "\n"


def test_formulas_and_matrices_are_latex() -> None:
    (grid,) = matrices([("M", IDENTITY)], PIPE)
    shown = markdown([formula("h = u - a1"), grid])
    assert "$$h = u - a_{1}$$" in shown
    assert "1.000 & 0.000 & 0.000 & 0.000" in shown
    assert "0 & 0 & 0 & 1" in shown
    assert latex_document([formula("h = u - a1"), grid]) == shown


def test_a_table_in_latex() -> None:
    assert latex_document([TABLE]).startswith(r"$$\begin{array}{lr}\text{Name} & \text{x mm} \\ \text{a|b}")


def test_matrices_stand_below_each_other_where_the_page_is_narrow() -> None:
    four = [(name, IDENTITY) for name in "abcd"]
    wide, narrow = list(matrices(four, PIPE)), list(matrices(four, PIPE.__class__(width=50)))
    assert len(wide) < len(narrow) == 4
    assert all(sum(grid.widths()) <= 50 for grid in narrow)
