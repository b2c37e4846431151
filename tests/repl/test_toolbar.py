"""The line at the bottom."""

from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.interfaces.conversation.conversation import Conversation
from vrs_cli.interfaces.session.session import Session
from vrs_cli.repl.prompt import toolbar
from vrs_cli.values.commands import SetMonitorSpeed, SetSpeed, SpeedUnit


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
