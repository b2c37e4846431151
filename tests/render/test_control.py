"""What strings may do to a screen."""

import re
from io import StringIO

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vrs_cli.render.console import TerminalRenderer
from vrs_cli.render.control import for_stream, visible
from vrs_cli.values.replies import StringTable

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
