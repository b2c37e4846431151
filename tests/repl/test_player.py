from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from math import degrees
from pathlib import Path

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

from tests.engine.wall import ManualWall
from tests.files.trajectories import planned, puma
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.files.cell_file import read_cell
from vrs_cli.interfaces.jog.jogger import Jogger
from vrs_cli.interfaces.monitor.explaining import Sight
from vrs_cli.interfaces.roles.playback import Playback
from vrs_cli.interfaces.roles.supervisor import RecordedRobot
from vrs_cli.interfaces.session.session import Session
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.forms import arm_for
from vrs_cli.repl.player import JogPanel, Player
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.replies import ArmPicture, BodyKind


def player_at(wall: float) -> Player:
    """A player whose wall clock stands still; it began to play at 0 s."""
    timeline, _ = planned(6)
    recorded = RecordedRobot(arm_for(puma()), timeline)
    return Player(recorded, Playback.of(0.0, timeline.end, 1.0, 0.0), wall=lambda: wall)


def press(player: Player, keys: str) -> Player:
    """Type keys into a running player, the last of which must leave it."""
    with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
        pipe.send_text(keys)
        player.screen().run()
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


# --- a robot that others move ---------------------------------------------------------------------------------------


@dataclass
class Moved:
    """A robot, and the clock on the wall of who watches it."""

    arm: RobotArm = field(default_factory=lambda: arm_for(puma()))
    timeline: Timeline = field(default_factory=lambda: planned(6)[0])
    now: float = 2.0
    wall: float = 0.0

    def watcher(self) -> Player:
        playback = Playback.begin_live(0.0, self.timeline.end, self.now, 0.0)
        return Player(self, playback, lambda: self.wall, lambda _t: "ann drives", live=True)


def test_who_watches_sees_the_present_and_who_drives() -> None:
    moved = Moved()
    player = moved.watcher()
    assert "    2.00 / " in player.text()
    assert "   live, rate 1\nann drives\n" in player.text()
    moved.now = moved.wall = 3.0
    assert "3.00 / " in player.text().splitlines()[0]
    moved.now = 9.0
    assert "6.0 s behind" in player.text()
    assert max(map(len, player.text().splitlines())) <= 80


def test_who_follows_real_time_is_where_its_clock_is_found_to_be() -> None:
    moved = Moved()
    player = moved.watcher()
    player.passes = lambda: True
    moved.now = 2.4
    assert "    2.40 / " in player.text()
    assert "   live, rate 1" in player.text()
    press(player, "pq")
    moved.now = 3.0
    assert "    2.40 / " in player.text()


def test_who_watches_looks_back_and_follows_again() -> None:
    player = press(Moved().watcher(), "rpq")
    assert "]     0.00 / " in player.text()
    assert "paused" in player.text()
    assert "f follow" in player.text()
    assert "   live" in press(player, "fq").text()


def test_a_timeline_that_grows_is_seen_to_its_end() -> None:
    moved = Moved()
    player = moved.watcher()
    moved.timeline = planned(12)[0]
    assert f" / {moved.timeline.end:.2f} s" in player.text()


def test_there_is_nothing_to_follow_in_a_file() -> None:
    assert "follow" not in player_at(0.0).text()
    assert "0.10 / " in press(player_at(0.1), "fq").text()


PROGRAMS = Path(__file__).parents[2] / "programs"
UP, DOWN, RIGHT = "\x1b[A", "\x1b[B", "\x1b[C"


@pytest.mark.parametrize("leave", ["q", "\x03", "\x04", "\x1b"])
def test_keys_move_the_arm_and_leave(leave: str) -> None:
    session = Session(RecordingTerminal())
    with create_pipe_input() as keys, create_app_session(input=keys, output=DummyOutput()):
        keys.send_text(UP + UP + DOWN + RIGHT + "]" + UP + "5-" + DOWN + leave)
        JogPanel(Jogger(session)).run()
    ready = session.engine.model.poses["ready"]
    changes = [degrees(b - a) for a, b in zip(ready, session.engine.position().joints, strict=True)]
    assert changes == pytest.approx([2.0, 5.0, 0.0, 0.0, -5.0, 0.0])


def test_it_shows_axes_step_speed_place_and_keys() -> None:
    session = Session(RecordingTerminal())
    panel = JogPanel(Jogger(session))
    panel.next_frame()
    panel.choose(2)
    panel.move(-1.0)
    text = panel.text()
    assert text.startswith("JOG world:  X    Y   [Z]   RX    RY    RZ    step 2 mm, speed 100 %\n")
    assert "at rest" in text
    assert "919.120" in text
    assert text.endswith("q leave")
    assert max(map(len, text.splitlines())) <= 80


def test_it_shows_the_arm_where_there_is_room() -> None:
    session = Session(RecordingTerminal())
    drawn: list[ArmPicture] = []
    sight = Sight(session.engine.arm)
    panel = JogPanel(Jogger(session), watched=session.engine)
    with create_pipe_input() as keys, create_app_session(input=keys, output=DummyOutput()):
        keys.send_text(UP + UP + "q")
        panel.run()
        drawn.append(panel.screen().look())
    assert drawn == [sight.picture(session.engine.timeline, session.engine.now)]
    assert drawn[0].past
    assert not hasattr(JogPanel(Jogger(session)).screen(), "look")


def test_what_is_around_the_arm_is_in_the_picture() -> None:
    session = Session(RecordingTerminal())
    session.driver.surround(read_cell(str(PROGRAMS / "pick_and_place.toml")))
    panel = JogPanel(Jogger(session), watched=session.engine, world=session.driver.world)
    kinds = [body.kind for body in panel.screen().look().bodies]
    assert Counter(kinds) == {BodyKind.PART: 1, BodyKind.FIXTURE: 3}


def test_it_says_that_the_clock_stands() -> None:
    wall = ManualWall()
    session = Session(RecordingTerminal(), clock=wall.clock())
    panel = JogPanel(Jogger(session))
    session.perform("CLOCK PAUSE")
    panel.move(1.0)
    assert "t 0.00 s, clock paused, moves until 0." in panel.text()
