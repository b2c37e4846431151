"""JOG with keys."""

from __future__ import annotations

from collections import Counter
from math import degrees
from pathlib import Path

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

from tests.engine.wall import ManualWall
from tests.interfaces.terminals import RecordingTerminal
from vrs_cli.files.cell_file import read_cell
from vrs_cli.interfaces.jog.jogger import Jogger
from vrs_cli.interfaces.monitor.pictures import Sight
from vrs_cli.interfaces.session.session import Session
from vrs_cli.repl.player import JogPanel
from vrs_cli.values.replies import ArmPicture, BodyKind

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
