"""The picture of the arm on the rows that the text below it leaves, with prompt-toolkit."""

from __future__ import annotations

import asyncio
import os
from collections import defaultdict
from collections.abc import Callable, Sequence
from typing import NamedTuple

from prompt_toolkit.application import Application, get_app
from prompt_toolkit.key_binding import KeyBindings
from prompt_toolkit.layout import Container, Dimension, FormattedTextControl, HSplit, Layout, Window
from prompt_toolkit.layout.mouse_handlers import MouseHandlers
from prompt_toolkit.layout.screen import Char, Screen, WritePosition

from vrs_cli.dialogue.replies import Picture
from vrs_cli.render.arm_picture import ArmDrawing
from vrs_cli.render.blocks import Line, Page
from vrs_cli.render.colours import Ink, toolkit_style
from vrs_cli.render.console import has_unicode
from vrs_cli.repl.colours import colour_depth

RATE = 20.0  # pictures a second
ESCAPE = 0.05  # [s] after which the key Esc is one, and not the beginning of another
LEAST = 10  # rows: a smaller picture is left out

STYLES = {ink: toolkit_style(ink) for ink in Ink}


class Kept(NamedTuple):
    """A row that is on the screen."""

    line: Line
    cells: defaultdict[int, Char]


class ArmWindow(Container):
    """Puts its cells on the screen as they are: prompt-toolkit writes those that have changed. (Its own windows take
    four times as long for it.) `below`: the rows that it leaves free.
    """

    def __init__(self, look: Callable[[], Picture], below: Callable[[], int]) -> None:
        self._look, self._below = look, below
        self._drawing = ArmDrawing()
        self._unicode = has_unicode(os.environ)
        self._where: tuple[int, int, int, int] | None = None
        self._rows: dict[int, Kept] = {}  # what is on the screen, by row
        self._cells: dict[Ink, dict[str, Char]] = {ink: {} for ink in Ink}

    def reset(self) -> None:
        """It begins anew with each picture."""

    def preferred_width(self, max_available_width: int) -> Dimension:
        return Dimension(preferred=max_available_width)

    def preferred_height(self, width: int, max_available_height: int) -> Dimension:  # noqa: ARG002 (the interface)
        rows = get_app().output.get_size().rows - self._below()
        return Dimension.exact(rows if rows >= LEAST else 0)

    def write_to_screen(
        self,
        screen: Screen,
        mouse_handlers: MouseHandlers,  # noqa: ARG002 (the interface)
        write_position: WritePosition,
        parent_style: str,  # noqa: ARG002 (the interface)
        erase_bg: bool,  # noqa: ARG002 (the interface)
        z_index: int | None,  # noqa: ARG002 (the interface)
    ) -> None:
        at = write_position
        if at.height < LEAST:
            return
        page = Page(at.width, colours=True, unicode=self._unicode, height=at.height + 1)
        _, *lines = self._drawing.lines(self._look(), page)  # the text tells what the first line does
        app, where = get_app(), (at.xpos, at.ypos, at.width, at.height)
        before = app.renderer.last_rendered_screen
        if before is None or where != self._where or app.is_done:  # then all of the screen is written
            self._where, self._rows, before = where, {}, None
        for number, line in enumerate(lines):
            self._put(at.ypos + number, line, screen, before)
        screen.width, screen.height = max(screen.width, at.xpos + at.width), max(screen.height, at.ypos + at.height)

    def _put(self, y: int, line: Line, screen: Screen, before: Screen | None) -> None:
        """A row that is the same as before is empty, now and before: then prompt-toolkit compares none of its cells,
        which would take the most of its time.
        """
        kept = self._rows.get(y)
        if kept is not None and before is not None:
            if kept.line == line:
                before.data_buffer.pop(y, None)
                return
            before.data_buffer[y] = kept.cells
        row = screen.data_buffer[y]
        self._write(line, row, 0 if self._where is None else self._where[0])
        self._rows[y] = Kept(line, row)

    def _write(self, line: Line, row: dict[int, Char], column: int) -> None:
        for text, ink in line.pieces:
            if not text.isspace():
                cells = self._cells[ink]
                for place, mark in enumerate(text, column):
                    row[place] = cells.get(mark) or cells.setdefault(mark, Char(mark, STYLES[ink]))
            column += len(text)

    def get_children(self) -> Sequence[Container]:  # type: ignore[override]  # any sequence will do
        return []


class ArmScreen:
    """The picture, where there is one, and text below it, until a key ends it. Both are looked at as often as the text
    changes. `over`: whether there is nothing more to be seen.
    """

    def __init__(
        self,
        look: Callable[[], Picture] | None,
        text: Callable[[], str],
        keys: KeyBindings,
        over: Callable[[], bool] = lambda: False,
    ) -> None:
        self._text, self._shown, self._over = text, text(), over
        below = Window(FormattedTextControl(lambda: self._shown), dont_extend_height=True, wrap_lines=True)
        above = () if look is None else (ArmWindow(look, lambda: self._shown.count("\n") + 1),)
        layout = Layout(HSplit([*above, below]))
        self.app: Application[None] = Application(layout=layout, key_bindings=keys, color_depth=colour_depth())
        self.app.ttimeoutlen = ESCAPE
        self.app.key_processor.after_key_press += lambda _: self._look()

    def run(self) -> None:
        self.app.run(pre_run=self._begin)

    async def run_async(self) -> None:
        await self.app.run_async(pre_run=self._begin)

    def _begin(self) -> None:
        self.app.create_background_task(self._keep_looking())

    async def _keep_looking(self) -> None:
        while True:
            await asyncio.sleep(1.0 / RATE)
            self._look()
            if self._over() and not self.app.is_done:
                self.app.exit()

    def _look(self) -> None:
        seen = self._text()
        if seen != self._shown:
            self._shown = seen
            self.app.invalidate()
