"""Every role has a colour that both libraries know."""

import pytest
from prompt_toolkit.styles import Style
from rich.style import Style as RichStyle

from vrs_cli.render.roles import COLOURS, Role, rich_style, toolkit_style


def test_every_role_has_a_colour() -> None:
    assert set(COLOURS) == set(Role)


@pytest.mark.parametrize("role", Role)
def test_both_libraries_take_the_style(role: Role) -> None:
    RichStyle.parse(rich_style(role))
    attributes = Style([]).get_attrs_for_style_str(toolkit_style(role))
    assert attributes.bold == COLOURS[role][1]
