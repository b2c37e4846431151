"""The colours of what prompt-toolkit draws for the shell, with its own where the shell has none."""

from __future__ import annotations

import pytest
from prompt_toolkit.output import ColorDepth
from prompt_toolkit.styles import default_ui_style, merge_styles

from tests.interfaces.terminals import RecordingTerminal
from tests.render.contrast import LEAST, contrast
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.session.session import Session
from vrs_cli.repl.prompt import STYLE, colour_depth, toolbar
from vrs_cli.values.commands import SetMonitorSpeed, SetSpeed, SpeedUnit

SHOWN = (
    "class:bottom-toolbar class:bottom-toolbar.text",
    "class:validation-toolbar",
    "class:completion-menu class:completion-menu.completion",
    "class:completion-menu class:completion-menu.completion class:completion-menu.completion.current",
    "class:completion-menu class:completion-menu.meta.completion",
    "class:completion-menu class:completion-menu.meta.completion class:completion-menu.meta.completion.current",
    "class:bottom-toolbar class:argument",
    "class:auto-suggestion",
    "class:exiting",
    "class:aborting",
    "class:control-character",
    "class:search",
    "class:incsearch",
    "class:title",
    "class:margin",
    "class:finding.error",
    "class:finding.warning",
    "class:message.error",
    "class:message.warning",
)


@pytest.mark.parametrize("classes", SHOWN)
@pytest.mark.parametrize(("text", "background"), [("ffffff", "000000"), ("000000", "ffffff")], ids=["dark", "light"])
def test_everything_is_readable_on_dark_and_on_light_backgrounds(classes: str, text: str, background: str) -> None:
    attributes = merge_styles([default_ui_style(), STYLE]).get_attrs_for_style_str(classes)
    own, behind = (None if colour == "default" else colour for colour in (attributes.color, attributes.bgcolor))
    assert contrast(f"#{own or text}", f"#{behind or background}") >= LEAST


def test_every_class_of_the_shell_is_looked_at() -> None:
    assert {name for name, _ in STYLE.style_rules} <= {
        name.removeprefix("class:") for row in SHOWN for name in row.split()
    }


@pytest.mark.parametrize(
    ("terminal", "wanted"), [("truecolor", ColorDepth.DEPTH_24_BIT), ("24bit", ColorDepth.DEPTH_24_BIT), ("", None)]
)
def test_all_colours_where_the_terminal_has_them(
    terminal: str, wanted: ColorDepth | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLORTERM", terminal)
    monkeypatch.delenv("NO_COLOR", raising=False)
    monkeypatch.delenv("PROMPT_TOOLKIT_COLOR_DEPTH", raising=False)
    assert colour_depth() == wanted


def test_who_wants_no_colours_gets_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLORTERM", "truecolor")
    monkeypatch.setenv("NO_COLOR", "1")
    assert colour_depth() == ColorDepth.DEPTH_1_BIT


def test_before_the_robot_is_there() -> None:
    assert "one moment" in toolbar(None, "", 80)


def test_clock_tool_speeds_configuration_and_the_last_message() -> None:
    session = Session(RecordingTerminal())
    session.engine.perform(SetMonitorSpeed(50.0))
    session.engine.perform(SetSpeed(250.0, unit=SpeedUnit.MMPS, always=True))
    assert toolbar(Conversation(session).status(), "Program completed", 160) == (
        " t 0.00 s | ^X ABORT | X -20.3 Y 149.1 Z 921.1 | 50 % / 250 MMPS | RIGHTY ABOVE NOFLIP | Program completed"
    )


def test_what_does_not_fit_is_left_out_and_the_message_is_cut() -> None:
    session = Session(RecordingTerminal())
    parts = {"t 0.00 s", "^X ABORT", "X -20.3 Y 149.1 Z 921.1", "100 % / 100 %", "RIGHTY ABOVE NOFLIP"}
    for width in range(10, 120):
        text = toolbar(Conversation(session).status(), "Program completed", width)
        assert len(text) <= width
        for part in text.strip().split(" | "):
            assert part in parts or "Program completed".startswith(part.removesuffix("..."))


def test_how_to_abort_is_shown_in_twenty_columns_and_all_of_the_state_in_ninety() -> None:
    status = Conversation(Session(RecordingTerminal())).status()
    assert toolbar(status, "", 20).endswith("| ^X ABORT")
    assert "NOFLIP" in toolbar(status, "", 90)
