"""Define the parts of the prompt for prompt-toolkit: colours, the toolbar at the bottom, suggestions from the history,
and keys."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Container, Iterator
from functools import cache
from typing import TYPE_CHECKING, Any

from prompt_toolkit.application import Application, get_app
from prompt_toolkit.auto_suggest import AutoSuggest, Suggestion
from prompt_toolkit.buffer import Buffer
from prompt_toolkit.document import Document
from prompt_toolkit.enums import EditingMode
from prompt_toolkit.filters import Condition, completion_is_selected, emacs_insert_mode, vi_insert_mode
from prompt_toolkit.formatted_text import StyleAndTextTuples
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.key_binding.vi_state import InputMode
from prompt_toolkit.lexers import Lexer
from prompt_toolkit.output import ColorDepth
from prompt_toolkit.styles import Style

from vrs_cli.render.colours import COLOURS, Bar, Ink, Palette, bar_style, ink_style

if TYPE_CHECKING:
    from vrs_cli.interfaces.conversation.complete import Signature
    from vrs_cli.values.questions import PromptStatus


STYLE = Style.from_dict(
    {
        # style classes that prompt-toolkit defines
        "bottom-toolbar": bar_style(Bar.STATUS),
        "validation-toolbar": bar_style(Bar.MISTAKE),
        "completion-menu.completion.current": bar_style(Bar.CHOSEN),
        "exiting": ink_style(Ink.NOTE),
        "aborting": ink_style(Ink.NOTE),
        "control-character": ink_style(Ink.NOTE),
        "search": bar_style(Bar.CHOSEN),
        "auto-suggestion": ink_style(Ink.NOTE),
        # style classes of vrs
        "argument": f"bold underline {bar_style(Bar.ARGUMENT)}",
        "title": bar_style(Bar.TITLE),
        "margin": ink_style(Ink.NOTE),
        "finding.error": f"underline {ink_style(Ink.ERROR)}",
        "finding.warning": f"underline {ink_style(Ink.WARNING)}",
        "message.error": bar_style(Bar.MISTAKE),
        "message.warning": ink_style(Ink.WARNING),
    }
)


def colour_depth() -> ColorDepth | None:
    """Return the colour depth for a terminal with 24-bit colours; None for other terminals, on which prompt-toolkit
    uses the nearest of 256 colours."""
    if os.environ.get("COLORTERM", "").lower() in ("truecolor", "24bit"):
        return ColorDepth.from_env() or ColorDepth.DEPTH_24_BIT
    return None


class ValLexer(Lexer):
    """A lexer that colours lines of VAL-II. Until `ready()` is true, lines have no colours, because the first prompt
    appears before the tables of words are loaded. `names`: returns the keys of the variables that have a value."""

    def __init__(
        self, ready: Callable[[], bool], names: Callable[[], Container[str]] = frozenset, palette: Palette = COLOURS
    ) -> None:
        self._styles = {ink: ink_style(ink, palette) for ink in Ink}
        self._ready = ready
        self._names = names

    def lex_document(self, document: Document) -> Callable[[int], StyleAndTextTuples]:
        if not self._ready():
            return lambda number: [("", document.lines[number])]
        from vrs_cli.language.text.parser import variables_in
        from vrs_cli.render.colours import scan

        variables = variables_in(document.lines) if len(document.lines) > 1 else self._names()

        @cache  # at each key, prompt-toolkit asks several times for each line
        def line(number: int) -> StyleAndTextTuples:
            return [(self._styles[ink], text) for text, ink in scan(document.lines[number], variables)]

        return line

    def invalidation_hash(self) -> object:
        return self._ready()


GAP = " | "
ABORT = "^X ABORT"
MIN_MESSAGE_COLUMNS = 12  # minimum width for a message [columns]; with less room no message is shown


def toolbar(status: PromptStatus | None, last: str, width: int, mode: str = "") -> str:
    """Return the text of the toolbar: as many parts of the robot's state as fit into `width` columns, the most useful
    first, then the `last` message. Without a status, the text says that the robot is being prepared. `mode`: the mode
    of the vi key bindings."""
    if status is None:
        return " one moment: the robot is being made ready"[:width]
    from vrs_cli.render.blocks import shorten

    text = ""
    clock, *rest = _state(status)
    for part in filter(None, (clock, ABORT, mode, *rest)):
        longer = f"{text}{GAP}{part}" if text else f" {part}"
        if len(longer) <= width:
            text = longer
    room = width - len(text) - len(GAP)
    fits = last and room >= min(len(last), MIN_MESSAGE_COLUMNS)
    return f"{text}{GAP}{shorten(last, room)}" if fits else text


def vi_mode(app: Application[Any]) -> str:
    """Return the mode of the vi key bindings, such as INSERT or NORMAL; "" if emacs key bindings are in use."""
    if app.editing_mode is not EditingMode.VI:
        return ""
    mode = app.vi_state.input_mode
    return "NORMAL" if mode is InputMode.NAVIGATION else mode.name.partition("_")[0]


def signature_row(found: Signature, width: int) -> list[tuple[str, str]]:
    """Return the typed word's syntax with the current argument marked, and the word's summary if there is room."""
    from vrs_cli.render.blocks import shorten

    begin, end = found.arguments[found.active]
    pieces = [("", f" {found.form[:begin]}"), ("class:argument", found.form[begin:end]), ("", found.form[end:])]
    room = width - 1 - len(found.form) - len(GAP)
    if room < 0:
        return [(style, text) for (style, _), text in zip(pieces, _cut(pieces, width), strict=True)]
    return [*pieces, ("", f"{GAP}{shorten(found.summary, room)}")] if room >= MIN_MESSAGE_COLUMNS else pieces


def _cut(pieces: list[tuple[str, str]], width: int) -> Iterator[str]:
    for _, text in pieces:
        yield text[: max(width, 0)]
        width -= len(text)


def _state(status: PromptStatus) -> tuple[str, ...]:
    from vrs_cli.language.words.values import millimetres
    from vrs_cli.values.numbers import decimal

    x, y, z = (decimal(millimetres(number), 1) for number in status.tool)
    doing = f"moves until {status.end:.1f} s" if status.clock < status.end else "at rest"
    clock = status.pace  # None in virtual time
    if clock is not None and clock.paused:
        doing = f"paused, {doing}"
    elif clock is not None and clock.rate != 1.0:
        doing = f"rate {clock.rate:g}, {doing}"
    return (
        f"t {decimal(status.clock, 2)} s",
        *([] if clock is None else [doing]),
        f"X {x} Y {y} Z {z}",
        f"{decimal(status.monitor_speed, 0)} % / {decimal(status.speed, 0)} {status.speed_unit}",
        status.configuration,
    )


WORD = re.compile(r"[#$]?[A-Za-z][\w.]*")


def asked_about(document: Document) -> str:
    """Return the word at the cursor if there is help on it, else the first word of the line."""
    from vrs_cli.interfaces.monitor.help import ALL_NAMES

    words = list(WORD.finditer(document.current_line))
    here = document.cursor_position_col
    at = [word[0] for word in words if word.start() <= here <= word.end() and word[0].upper() in ALL_NAMES]
    return next(iter((*at, *(word[0] for word in words))), "")


# --- completion, suggestions and keys ---------------------------------------------------------------------------------


MAX_SUGGESTION_LINES = 2000  # maximum number of history lines, the most recent ones, that are searched at each key


class FromHistory(AutoSuggest):
    """A suggester of the rest of the most recent history line that begins with the typed text."""

    def get_suggestion(self, buffer: Buffer, document: Document) -> Suggestion | None:
        text = document.current_line
        if not text.strip():
            return None
        late = reversed(buffer.history.get_strings()[-MAX_SUGGESTION_LINES:])
        found = next((line for line in late if line.startswith(text) and "\n" not in line), text)
        return Suggestion(found[len(text) :]) if len(found) > len(text) else None


def abort_binding(abort: Callable[[], None]) -> KeyBindings:
    """Return key bindings in which Ctrl-X calls `abort`. The key acts at once, although prompt-toolkit has longer key
    sequences that begin with it."""
    bindings = KeyBindings()

    @bindings.add("c-x", eager=True, save_before=lambda _event: False)
    def stop(_event: KeyPressEvent) -> None:
        abort()

    return bindings


def key_bindings(explain: Callable[[Document], None], abort: Callable[[], None]) -> KeyBindings:
    """Return the key bindings of the prompt.

    Ctrl-D leaves, even if the line has only an indent. F1 explains the word at the cursor. Up moves through the history
    unless a suggestion is chosen. Ctrl-U deletes the whole line, and Ctrl-Y restores it.
    """
    bindings = abort_binding(abort)

    @bindings.add("c-u", filter=emacs_insert_mode | vi_insert_mode)
    def clear(event: KeyPressEvent) -> None:
        event.app.clipboard.set_text(event.current_buffer.text)
        event.current_buffer.document = Document()

    menu = Condition(lambda: get_app().current_buffer.complete_state is not None)

    @bindings.add("up", filter=menu & ~completion_is_selected)
    def back(event: KeyPressEvent) -> None:
        event.current_buffer.cancel_completion()
        event.current_buffer.auto_up(count=event.arg)

    @bindings.add("f1")
    def help_on_word(event: KeyPressEvent) -> None:
        explain(event.current_buffer.document)

    @bindings.add("c-d", filter=Condition(lambda: not get_app().current_buffer.text.strip()))
    def leave(event: KeyPressEvent) -> None:
        event.app.exit(exception=EOFError, style="class:exiting")

    return bindings
