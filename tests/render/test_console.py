"""Test which terminals can show Unicode, and the text of lessons."""

from __future__ import annotations

from io import StringIO

import pytest
from rich.console import Console

from vrs_cli.render.console import draw_lesson_text, has_unicode


@pytest.mark.parametrize(
    ("environ", "has"),
    [
        ({}, True),
        ({"LANG": "de_DE.UTF-8", "TERM": "xterm-256color"}, True),
        ({"LANG": "C.utf8"}, True),
        ({"LANG": "en_GB"}, True),
        ({"LC_ALL": "C", "LANG": "de_DE.UTF-8"}, False),
        ({"LC_ALL": "", "LANG": "POSIX"}, False),
        ({"LC_CTYPE": "de_DE.ISO-8859-15@euro", "LANG": "de_DE.UTF-8"}, False),
        ({"LANG": "de_DE.UTF-8", "TERM": "linux"}, False),
    ],
)
def test_unicode(environ: dict[str, str], has: bool) -> None:
    assert has_unicode(environ) is has


TEXT = """\
# A title

A paragraph with `DRIVE 1, 30` in it,
and **strong** words.

- one
- two, which is
  longer

    .WHERE
    code  stays

```
 and so
# does this
```
"""


def drawn(text: str, width: int = 40) -> str:
    stream = StringIO()
    draw_lesson_text(text, console=Console(file=stream, width=width, highlight=False, markup=False, emoji=False))
    return stream.getvalue()


def test_headings_paragraphs_lists_and_code() -> None:
    assert drawn(TEXT).splitlines() == [
        "A title",
        "",
        "A paragraph with DRIVE 1, 30 in it, and",
        "strong words.",
        "",
        "- one",
        "",
        "- two, which is longer",
        "",
        "    .WHERE",
        "    code  stays",
        "",
        "     and so",
        "    # does this",
        "",
    ]


def test_code_in_a_line_is_not_divided() -> None:
    assert drawn("Go there with `MOVES SHIFT(HERE BY 100, 0, 0)` now", 43).splitlines() == [
        "Go there with",
        "MOVES SHIFT(HERE BY 100, 0, 0) now",
        "",
    ]


def test_control_characters_are_shown() -> None:
    assert "\x1b" not in drawn("a \x1b[2J b")
