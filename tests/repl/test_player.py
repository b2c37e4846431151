from __future__ import annotations

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

from tests.files.trajectories import planned, puma
from vrs_cli.interfaces.roles.playback import Playback
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.repl.player import Player


def player_at(wall: float) -> Player:
    """A player whose wall clock stands still; it began to play at 0 s."""
    timeline, _ = planned(6)
    return Player(arm_for(puma()), timeline, Playback.of(0.0, timeline.end, 1.0, 0.0), wall=lambda: wall)


def press(player: Player, keys: str) -> Player:
    """Type keys into a running player, the last of which must leave it."""
    with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
        pipe.send_text(keys)
        player.run()
    return player


def test_the_picture_shows_time_state_and_position() -> None:
    text = player_at(0.0).text()
    assert text.startswith("[" + "-" * 30 + "]     0.00 / ")
    assert "playing, rate 1" in text
    assert "839.387" in text
    assert "space pause" in text


def test_the_picture_fits_on_80_columns() -> None:
    for wall in (0.0, 1e9):
        assert max(map(len, player_at(wall).text().splitlines())) <= 80


def test_the_bar_is_full_at_the_end() -> None:
    assert player_at(1e9).text().startswith("[" + "#" * 30 + "]")
    assert "ended" in player_at(1e9).text()


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ("q", "0.10 / "),
        (" q", "paused"),
        ("  q", "playing"),
        ("+q", "rate 2"),
        ("-q", "rate 0.5"),
        ("\x1b[Cq", "1.10 / "),
        ("\x1b[C\x1b[Drq", "0.00 / "),
        ("eq", "ended"),
        ("\x03", "0.10 / "),
    ],
)
def test_keys(keys: str, told: str) -> None:
    assert told in press(player_at(0.1), keys).text()
