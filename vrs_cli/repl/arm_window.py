"""Draw a picture of the arm on the terminal with prompt-toolkit, in the rows above the text."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, groupby, repeat, zip_longest
from operator import itemgetter
from typing import TYPE_CHECKING

from prompt_toolkit.application import Application, get_app
from prompt_toolkit.data_structures import Point
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import Container, Dimension, FormattedTextControl, HSplit, Layout, Window
from prompt_toolkit.layout.mouse_handlers import MouseHandlers
from prompt_toolkit.layout.screen import Char, Screen, WritePosition
from prompt_toolkit.output import Output
from prompt_toolkit.styles import Style

from vrs_cli.engine.position import Watched
from vrs_cli.interfaces.monitor.explaining import Sight
from vrs_cli.render import arm_picture, colours, console
from vrs_cli.render.blocks import Page, TextLine
from vrs_cli.repl.prompt import colour_depth
from vrs_cli.values.replies import ArmPicture

if TYPE_CHECKING:
    from vrs_cli.world.course import World


RATE = 20.0  # [1/s] number of pictures per second
MIN_PICTURE_ROWS = 10  # [rows] minimum height of a picture; with less room no picture is drawn

# [columns] changed cells at most this far apart are written in one run; moving the cursor would cost more output
NEAR = 4

STYLES = {ink: colours.ink_style(ink) for ink in colours.Ink}
ATTRIBUTES = {ink: Style([]).get_attrs_for_style_str(style) for ink, style in STYLES.items()}
BLANK = " ", colours.Ink.TEXT

Cell = tuple[str, colours.Ink]


class ArmWindow(Container):
    """A window with the picture of the arm. `look` returns the picture, `below` the number of rows to leave for the
    text.

    The window gives prompt-toolkit the whole picture the first time and at the end. In between it writes the changed
    cells itself, before prompt-toolkit writes everything else. Otherwise prompt-toolkit would compare all cells, which
    takes longer than drawing them.
    """

    def __init__(self, look: Callable[[], ArmPicture], below: Callable[[], int]) -> None:
        self._look, self._below = look, below
        self._drawing = arm_picture.ArmDrawing()
        self._unicode = console.has_unicode(os.environ)
        self._where: tuple[int, int, int, int] | None = None
        self._lines: list[TextLine] = []  # the lines of the picture on the screen

    def reset(self) -> None:
        """Do nothing: each picture is drawn from scratch, so there is no state to reset."""

    def preferred_width(self, max_available_width: int) -> Dimension:
        return Dimension(preferred=max_available_width)

    def preferred_height(self, width: int, max_available_height: int) -> Dimension:  # noqa: ARG002 (the interface)
        rows = get_app().output.get_size().rows - self._below()
        return Dimension.exact(rows if rows >= MIN_PICTURE_ROWS else 0)

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
        if at.height < MIN_PICTURE_ROWS:
            return
        page = Page(at.width, colours=True, unicode=self._unicode, height=at.height + 1)
        # drop the first line (time, tool position): the text below repeats it
        _, *lines = self._drawing.lines(self._look(), page)
        app, where = get_app(), (at.xpos, at.ypos, at.width, at.height)
        before = app.renderer.last_rendered_screen
        if before is not None and where == self._where and len(lines) == len(self._lines) and not app.is_done:
            for number in range(len(lines)):
                before.data_buffer.pop(
                    at.ypos + number, None
                )  # now the old and the new screen are equal (empty) here, so prompt-toolkit writes nothing
            _rewrite(self._lines, lines, at, before.get_cursor_position(app.layout.current_window))
        else:
            if before is not None and self._where is not None:
                # tell prompt-toolkit what is on the screen, so that it erases it
                _put(self._lines, before, *self._where[:2])
            _put(lines, screen, at.xpos, at.ypos)
        self._where, self._lines = where, lines
        screen.width, screen.height = max(screen.width, at.xpos + at.width), max(screen.height, at.ypos + at.height)

    def get_children(self) -> Sequence[Container]:  # type: ignore[override]  # callers only iterate over it
        return []


def _put(lines: Sequence[TextLine], screen: Screen, x: int, y: int) -> None:
    for number, line in enumerate(lines, y):
        row = screen.data_buffer[number]
        for column, (mark, ink) in enumerate(_cells(line), x):
            if mark != " ":
                row[column] = Char(mark, STYLES[ink])


def _rewrite(before: Sequence[TextLine], lines: Sequence[TextLine], at: WritePosition, cursor: Point) -> None:
    """Write the changed cells to the terminal, then move the cursor back to where it was."""
    app, y = get_app(), cursor.y
    out, depth = app.output, app.color_depth
    for number, (old, new) in enumerate(zip(before, lines, strict=True), at.ypos):
        for column, cells in _changes(old, new):
            _move(out, number - y, at.xpos + column)
            y = number
            for ink, some in groupby(cells, itemgetter(1)):
                out.set_attributes(ATTRIBUTES[ink], depth)
                out.write("".join([mark for mark, _ in some]))
    out.reset_attributes()
    _move(out, cursor.y - y, cursor.x)


def _move(out: Output, down: int, x: int) -> None:
    """Move the cursor down by `down` rows (negative: up), and to column `x`."""
    if down > 0:
        out.cursor_down(down)
    elif down < 0:
        out.cursor_up(-down)
    out.write_raw("\r")
    if x:
        out.cursor_forward(x)


def _changes(old: TextLine, new: TextLine) -> Iterator[tuple[int, list[Cell]]]:
    """Yield (first column, cells) for each run of changed cells in a line. Runs may include a few unchanged cells
    (`NEAR`)."""
    if old == new:
        return
    cells = list(_cells(new))
    pairs = enumerate(zip_longest(_cells(old), cells, fillvalue=BLANK))
    others = [column for column, (was, now) in pairs if was != now]
    cells += [BLANK] * (others[-1] + 1 - len(cells) if others else 0)
    first = last = others[0] if others else 0
    for column in others[1:]:
        if column > last + NEAR:
            yield first, cells[first : last + 1]
            first = column
        last = column
    if others:
        yield first, cells[first : last + 1]


def _cells(line: TextLine) -> Iterator[Cell]:
    return chain.from_iterable([zip(text, repeat(ink)) for text, ink in line.pieces])


class ArmScreen:
    """A screen with a robot's picture and text below it, which a key closes. `t`: returns the time to show [s]; None
    shows the current time. `text`: returns the text.

    `actions`: the function that each key calls; None for keys that close the screen. `over`: returns whether the screen
    should close by itself. `abort`: the function that Ctrl-X calls. `world`: the robot's cell (parts, fixtures,
    sensors).
    """

    def __init__(
        self,
        robot: Watched | None,
        t: Callable[[], float] | None,
        text: Callable[[], str],
        actions: Mapping[str, Callable[[], object] | None],
        over: Callable[[], bool] = lambda: False,
        abort: Callable[[], object] | None = None,
        world: World | None = None,
    ) -> None:
        self._text, self._shown, self._over = text, text(), over
        keys = KeyBindings()
        for key, act in (dict(actions) if abort is None else {**actions, "c-x": abort}).items():
            keys.add(key)(partial(self._press, act))
        above = list[Container]()
        if robot is not None:
            sight = Sight(robot.arm, world)
            self.look = lambda: sight.picture(robot.timeline, robot.now if t is None else t())
            above.append(ArmWindow(self.look, lambda: self._shown.count("\n") + 1))
        below = Window(FormattedTextControl(lambda: self._shown), dont_extend_height=True, wrap_lines=True)
        self.app: Application[None] = Application(
            layout=Layout(HSplit([*above, below])), key_bindings=keys, color_depth=colour_depth()
        )
        self.app.ttimeoutlen = 0.05  # [s] wait after Esc; then Esc is a key of its own, not the start of a key sequence
        self.app.key_processor.after_key_press += lambda _: self._look()

    @staticmethod
    def _press(act: Callable[[], object] | None, event: KeyPressEvent) -> None:
        if act is None:
            event.app.exit()
        else:
            act()

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
