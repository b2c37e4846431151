"""The picture on the screen: what has changed is written, all else is not."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import StringIO, UnsupportedOperation

from prompt_toolkit.application import create_app_session
from prompt_toolkit.data_structures import Size
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output.vt100 import Vt100_Output

from tests.interfaces.monitor.test_pictures import session
from vrs_cli.render.arm_picture import arm_picture
from vrs_cli.render.blocks import Page
from vrs_cli.repl.arm_window import ArmScreen

LINES = ("DRIVE 2, 60 AT 0", "DRIVE 1, 90 AT 2")
TEXT = "the text\nbelow"


class Terminal(StringIO):
    """What was written, and is not looked at yet."""

    encoding = "utf-8"
    size = Size(24, 80)

    def fileno(self) -> int:
        raise UnsupportedOperation

    def taken(self) -> str:
        text = self.getvalue()
        self.seek(0)
        self.truncate()
        return text


class Watching:
    """A screen, and the time that it shows."""

    def __init__(self, terminal: Terminal) -> None:
        of = session(*LINES)
        self.terminal, self.t, self.text = terminal, 1.0, TEXT
        self.screen = ArmScreen(of.engine, lambda: self.t, lambda: self.text, {})
        self.look = self.screen.look

    def drawn(self) -> str:
        """What is written for one more picture."""
        self.terminal.taken()
        self.screen._look()
        self.screen.app._redraw()
        return self.terminal.taken()

    def run(self, act: Callable[[], None]) -> None:
        """Do it while the application runs."""

        async def acts() -> None:
            await asyncio.sleep(0)
            try:
                self.screen.app._redraw()
                act()
            finally:
                self.screen.app.exit()

        self.screen.app.run(pre_run=lambda: self.screen.app.create_background_task(acts()) and None)


@contextmanager
def watching(columns: int = 80, rows: int = 24) -> Iterator[Watching]:
    terminal = Terminal()
    terminal.size = Size(rows, columns)
    output = Vt100_Output(terminal, lambda: terminal.size, term="xterm")
    with create_pipe_input() as keys, create_app_session(input=keys, output=output):
        yield Watching(terminal)


def test_where_nothing_has_changed_nothing_is_written() -> None:
    with watching() as seen:

        def act() -> None:
            seen.drawn()
            again = seen.drawn()
            assert not set(again) & {chr(code) for code in range(0x2800, 0x2900)}
            assert len(again) < 40

        seen.run(act)


def test_a_step_of_the_arm_is_a_part_of_the_picture() -> None:
    with watching() as seen:

        def act() -> None:
            seen.drawn()
            seen.t = 1.02
            whole = sum(len(line.text) for line in arm_picture(seen.look(), Page(80, unicode=True, height=22)))
            assert 40 < len(seen.drawn()) < 0.5 * whole

        seen.run(act)


def marks(text: str) -> list[str]:
    """The dots that are written, in order."""
    return [mark for mark in text if 0x2801 <= ord(mark) <= 0x28FF]


def test_all_of_it_is_written_when_the_screen_is_left_and_when_its_width_changes() -> None:
    with watching() as seen:
        page = Page(80, colours=True, unicode=True, height=24 - 2 + 1)

        def act() -> None:
            seen.drawn()
            seen.drawn()
            seen.terminal.size = Size(24, 70)
            seen.screen.app.renderer.erase()
            narrow = Page(70, colours=True, unicode=True, height=24 - 2 + 1)
            assert marks(seen.drawn()) == marks("".join(line.text for line in arm_picture(seen.look(), narrow)))
            seen.terminal.size = Size(24, 80)
            seen.drawn()
            seen.drawn()
            seen.terminal.taken()

        seen.run(act)
        assert marks(seen.terminal.taken()) == marks("".join(line.text for line in arm_picture(seen.look(), page)))


def test_a_small_terminal_has_the_text_alone() -> None:
    with watching(rows=10) as seen:

        def act() -> None:
            seen.text = "other text\nbelow"
            assert not marks(seen.drawn())

        seen.run(act)
