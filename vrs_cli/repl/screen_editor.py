"""Edit a program on the full screen (SEE) with prompt-toolkit: keys, colours, mistakes that are underlined while the
text is typed, search, undo.

`interfaces.editor.buffer` holds the program and finds its mistakes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial

from prompt_toolkit.application import Application
from prompt_toolkit.buffer import Buffer
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.enums import EditingMode
from prompt_toolkit.filters import Filter, emacs_mode, has_focus, vi_insert_mode, vi_navigation_mode
from prompt_toolkit.formatted_text import StyleAndTextTuples
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.key_binding.vi_state import InputMode
from prompt_toolkit.layout import Dimension, Float, FloatContainer, HSplit, Layout, Window
from prompt_toolkit.layout.containers import WindowRenderInfo
from prompt_toolkit.layout.controls import BufferControl, FormattedTextControl, UIContent
from prompt_toolkit.layout.margins import Margin, ScrollbarMargin
from prompt_toolkit.layout.menus import CompletionsMenu
from prompt_toolkit.layout.processors import (
    HighlightIncrementalSearchProcessor,
    Processor,
    Transformation,
    TransformationInput,
)
from prompt_toolkit.layout.utils import explode_text_fragments
from prompt_toolkit.search import start_search
from prompt_toolkit.widgets import SearchToolbar

from vrs_cli.errors import VrsError
from vrs_cli.interfaces.editor.buffer import INDENT, canonical, canonical_line, depth
from vrs_cli.interfaces.monitor.help import page as help_page
from vrs_cli.render.colours import COLOURS, Palette
from vrs_cli.render.text import plain_text
from vrs_cli.repl.front_end import DraftPage, FrontEnd
from vrs_cli.repl.prompt import ABORT, STYLE, ValLexer, asked_about, colour_depth, signature_row, vi_mode
from vrs_cli.values import diagnostics, questions

_BEGUN = re.compile(r"[#$]?[A-Za-z][\w.]*$")
_NAME = re.compile(r"[#$]?\b[a-z][a-z0-9_.]*\b")
KEYS = f" {ABORT} ^S save ^Q quit ^F find F3 next ^Z/^Y undo ^K cut F5 format F1 help"
NO_WORD = "F1 explains the word at the cursor, Tab completes one that is begun"
STOPPED = "ABORT was sent: what it stopped is said when this screen is left"
UNSAVED = "Changes are not stored: ^S stores them, ^Q again leaves without them"


class WordCompleter(Completer):
    """The completer of the Tab key. `suggested`: returns the suggestions at the cursor of a document."""

    def __init__(self, suggested: Callable[[Document], list[questions.Suggestion]]) -> None:
        self._suggestions = suggested

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterable[Completion]:  # noqa: ARG002
        return [Completion(one.text, -one.length, display_meta=one.meta) for one in self._suggestions(document)]


class Underlined(Processor):
    """A processor of prompt-toolkit that underlines the mistakes in a line of the program."""

    def __init__(self, editor: ScreenEditor) -> None:
        self._editor = editor

    def apply_transformation(self, transformation_input: TransformationInput) -> Transformation:
        found = [one for one in self._editor.findings if one.span.line == transformation_input.lineno + 1]
        if not found:
            return Transformation(transformation_input.fragments)
        fragments = explode_text_fragments(transformation_input.fragments)
        for one in reversed(found):
            begin = min(one.span.column - 1, max(len(fragments) - 1, 0))
            for i in range(begin, min(max(one.span.end - 1, begin + 1), len(fragments))):
                style, text, *_ = fragments[i]
                fragments[i] = (f"{style} class:finding.{one.severity.value}", text)
        return Transformation(fragments)


class ScreenEditor:
    """The full-screen editor for one program. `vi`: whether to use vi key bindings."""

    def __init__(
        self, question: questions.Editing, screens: FrontEnd, palette: Palette = COLOURS, *, vi: bool = False
    ) -> None:
        self.page, self._screens = (page := DraftPage(question, screens)), screens
        self.message = ""
        self.findings: tuple[diagnostics.Diagnostic, ...] = ()
        self._draws = False  # whether the editor is on the screen
        self._quiet = False  # whether the editor itself is changing the text
        # the row in which the user has typed; it is formatted when the cursor leaves it
        self._touched: int | None = None
        self._typed_up_to = -1  # the position after the last typed character
        self._kept = page.text
        self._warned = False
        self.buffer = Buffer(
            multiline=True,
            document=Document(page.text, _start_of(page.text, page.row)),
            completer=WordCompleter(self._suggestions),
            complete_while_typing=False,
            on_text_changed=lambda _: self._take_change(),
            on_cursor_position_changed=lambda _: self._take_move(),
        )
        self.search = SearchToolbar(text_if_not_searching="", ignore_case=True)
        self._control = BufferControl(
            buffer=self.buffer,
            lexer=ValLexer(lambda: True, palette=palette),
            search_buffer_control=self.search.control,
            input_processors=[HighlightIncrementalSearchProcessor(), Underlined(self)],
            preview_search=True,
        )
        self._take_change()
        self._touched = None
        self.app: Application[None] = Application(
            layout=self._layout(),
            key_bindings=self._bindings(),
            style=STYLE,
            color_depth=colour_depth(),
            full_screen=True,
            mouse_support=False,
            editing_mode=EditingMode.VI if vi else EditingMode.EMACS,
        )

    def run(self) -> None:
        """Run the editor until the user leaves."""
        self._draws = True
        self.app.run(pre_run=self._begin)

    def _begin(self) -> None:
        """With vi key bindings, start in NORMAL mode, as vi does when it opens a file."""
        self.app.vi_state.input_mode = InputMode.NAVIGATION

    # --- the text ---

    @property
    def _row(self) -> int:
        return self.buffer.document.cursor_position_row

    def _take_change(self) -> None:
        self.page.look(self.buffer.text, self._take_findings)
        self._warned = False
        if not self._quiet:
            self._touched, self.message = self._row, ""

    def _take_findings(self, findings: tuple[diagnostics.Diagnostic, ...]) -> None:
        """Show the mistakes that the robot found in the text. Over a connection they may refer to a slightly older
        text."""
        self.findings = findings
        if self._draws:
            self.app.invalidate()

    def _take_move(self) -> None:
        if not self._quiet and self._touched is not None and self._touched != self._row:
            self.tidy()

    def tidy(self) -> None:
        """Convert the row in which the user has typed to canonical form (capitals, blanks, indentation)."""
        row, self._touched = self._touched, None
        lines = self.buffer.document.lines
        if row is None or row >= len(lines):
            return
        text = canonical_line(self.buffer.text, row, self.page.dialect)
        if text == lines[row]:
            return
        at_row, column = self._row, self.buffer.document.cursor_position_col
        if at_row == row:
            column = max(column + len(text) - len(lines[row]), 0)
        self._replace("\n".join((*lines[:row], text, *lines[row + 1 :])), at_row, column)

    def format(self) -> None:
        """Convert the whole text to canonical form (capitals, blanks, indentation)."""
        row, column = self._row, self.buffer.document.cursor_position_col
        self._touched = None
        text = canonical(self.buffer.text, self.page.dialect)
        if text != self.buffer.text:
            self._replace(text, row, column)

    def _replace(self, text: str, row: int, column: int) -> None:
        document = Document(text)
        row = min(row, document.line_count - 1)
        position = document.translate_row_col_to_index(row, min(column, len(document.lines[row])))
        with self._quietly():
            self.buffer.document = Document(text, position)

    @contextmanager
    def _quietly(self) -> Iterator[None]:
        before, self._quiet = self._quiet, True
        try:
            yield
        finally:
            self._quiet = before

    def new_line(self) -> None:
        """Convert the line to canonical form, and begin a new line with the indent of its block (Enter)."""
        row, rest = self._row, self.buffer.document.current_line_after_cursor
        if rest.strip() or not row:
            self.buffer.insert_text("\n")
        else:
            self._touched = row
            self.tidy()
            with self._quietly():
                self.buffer.cursor_position += self.buffer.document.get_end_of_line_position()
                self.buffer.delete(len(self.buffer.document.current_line_after_cursor))
            self.buffer.insert_text("\n")
        with self._quietly():
            self.buffer.insert_text(INDENT * (1 + depth(self.buffer.document.lines[1 : self._row])))

    # --- leaving ---

    def save(self) -> None:
        """Format and store the program."""
        self.format()
        try:
            self.message = self.page.save(self.buffer.text)
            self._kept = self.buffer.text
        except VrsError as error:
            self.message = str(error)

    def leave(self) -> None:
        """Leave at once if everything is stored; otherwise leave at the second request."""
        if self.buffer.text == self._kept or self._warned:
            self.app.exit()
        else:
            self.message, self._warned = UNSAVED, True

    # --- the screen ---

    def _layout(self) -> Layout:
        text = Window(
            self._control,
            left_margins=[StepMargin()],
            right_margins=[ScrollbarMargin(display_arrows=False)],
            wrap_lines=False,
        )
        form = Window(FormattedTextControl(self._form), height=1, style="class:bottom-toolbar")
        message = Window(
            FormattedTextControl(self._message), height=Dimension(min=1), wrap_lines=True, dont_extend_height=True
        )
        title = Window(FormattedTextControl(self._title), height=1, style="class:title")
        bar = Window(FormattedTextControl(KEYS), height=1, style="class:title")
        body = HSplit([title, text, self.search, message, form, bar])
        menu = Float(CompletionsMenu(max_height=8), xcursor=True, ycursor=True)
        return Layout(FloatContainer(body, [menu]), focused_element=text)

    def _title(self) -> str:
        changed = " (changed)" if self.buffer.text != self._kept else ""
        place = f"step {self._row}, column {self.buffer.document.cursor_position_col + 1}"
        return "   ".join(filter(None, (f" SEE {self.page.name}{changed}", place, vi_mode(self.app))))

    def _form(self) -> StyleAndTextTuples:
        """Return the syntax and the summary of the typed word, for the row below the text."""
        line = self.buffer.document.current_line_before_cursor
        found = self._screens.signature(line, steps=True) if self._row else None
        return [] if found is None else [*signature_row(found, self.app.output.get_size().columns)]

    def _suggestions(self, document: Document) -> list[questions.Suggestion]:
        """Return words that may come next: the names in the edited text that begin with the typed letters, and the
        robot's suggestions."""
        line = document.current_line_before_cursor
        found = self._screens.suggestions(line, True) if document.cursor_position_row else []
        begun = _BEGUN.search(line)
        word = begun[0] if begun is not None else ""
        names = dict.fromkeys(_NAME.findall(document.text)) if word.islower() else ()
        known = {one.text for one in found} | {word}
        own = [questions.Suggestion(name, len(word)) for name in names if name.startswith(word) and name not in known]
        return [*own, *found]

    def _message(self) -> StyleAndTextTuples:
        """Return the latest message. If there is none, return a mistake in the cursor's row, or else the first error or
        warning."""
        if self.message:
            return [("", f" {self.message}")]
        if not self.findings:
            return []
        here = [one for one in self.findings if one.span.line == self._row + 1]
        errors = [one for one in self.findings if one.severity is diagnostics.Severity.ERROR]
        shown = (here or errors or list(self.findings))[0]
        place = "" if here else f"step {shown.span.line - 1}: "
        return [(f"class:message.{shown.severity.value}", f" {place}{shown.message}")]

    # --- keys ---

    def _bindings(self) -> KeyBindings:
        keys, here = KeyBindings(), has_focus(self.buffer)

        def bind(key: str, where: Filter | bool, saves: bool, act: Callable[[], None]) -> None:
            keys.add(key, filter=where, eager=True, save_before=lambda _event: saves)(lambda _event: act())

        typing, undo = here & (emacs_mode | vi_insert_mode), partial(self._travel, self.buffer.undo)
        # key, where it acts, whether an undo step begins before it, its action
        rows: tuple[tuple[str, Filter | bool, bool, Callable[[], None]], ...] = (
            ("enter", typing, True, self._enter),
            ("tab", typing, True, self._tab),
            ("f1", here, False, self._explain),
            ("f3", here, False, self._find_next),
            ("f5", here, True, self.format),
            ("c-s", here, True, self.save),
            ("c-k", here, True, self._cut_line),
            ("c-q", here, False, self.leave),
            ("c-c", here, False, self.leave),
            ("c-f", here, False, start_search),
            ("c-z", here, False, undo),
            ("c-y", here, False, partial(self._travel, self.buffer.redo)),
            ("c-x", True, False, self._abort),
            ("u", here & vi_navigation_mode, False, undo),
        )
        keys.add("<any>", filter=typing, save_before=self._begins_word)(self._type)
        for row in rows:
            bind(*row)
        return keys

    def _abort(self) -> None:
        self._screens.abort()
        self._screens.keep_up()
        self.message = STOPPED

    def _find_next(self) -> None:
        self.buffer.apply_search(self._control.search_state, include_current_position=False)

    def _tab(self) -> None:
        """Complete the word before the cursor with the next suggestion; if no word has begun, insert blanks."""
        if self.buffer.complete_state is not None:
            self.buffer.complete_next()
        elif _BEGUN.search(self.buffer.document.current_line_before_cursor):
            self.buffer.start_completion(insert_common_part=True)
        else:
            self.buffer.insert_text(INDENT)

    def _enter(self) -> None:
        """Accept the chosen suggestion; if none is chosen, begin a new line."""
        state = self.buffer.complete_state
        if state is not None and state.current_completion is not None:
            self.buffer.complete_state = None
        else:
            self.new_line()

    def _explain(self) -> None:
        """Show the help on the word at the cursor, below the text (F1)."""
        word = asked_about(self.buffer.document)
        try:
            self.message = plain_text(help_page(word)).rstrip() if word else NO_WORD
        except VrsError as error:
            self.message = str(error)

    def _begins_word(self, event: KeyPressEvent) -> bool:
        """Return whether a typed key begins a new undo step: a blank, or a key at another position. Thus undo removes a
        word at a time."""
        return event.data == " " or self.buffer.cursor_position != self._typed_up_to

    def _type(self, event: KeyPressEvent) -> None:
        self.buffer.insert_text(event.data * event.arg)
        self._typed_up_to = self.buffer.cursor_position

    def _cut_line(self) -> None:
        """Delete the cursor's line, unless it is the program's heading."""
        if self._row:
            lines = self.buffer.document.lines
            rest = [*lines[: self._row], *lines[self._row + 1 :]]
            last = min(self._row, len(rest) - 1)
            self._touched = None
            self.buffer.document = Document("\n".join(rest), _start_of("\n".join(rest), last))

    def _travel(self, go: Callable[[], None]) -> None:
        """Undo or redo a change. The restored text is not formatted again."""
        self._touched = None
        with self._quietly():
            go()


class StepMargin(Margin):
    """The left margin, with the step number of each line. The program's heading has no number."""

    def get_width(self, get_ui_content: Callable[[], UIContent]) -> int:  # noqa: ARG002 (the interface)
        return 6

    def create_margin(
        self,
        window_render_info: WindowRenderInfo,
        width: int,
        height: int,  # noqa: ARG002 (the interface)
    ) -> StyleAndTextTuples:
        result: StyleAndTextTuples = []
        before = None
        for row in window_render_info.displayed_lines:
            shown = f"{row:{width - 1}d} " if row and row != before else " " * width
            result.append(("class:margin", f"{shown}\n"))
            before = row
        return result


def _start_of(text: str, row: int) -> int:
    """Return the position of the first non-blank character of a row."""
    document = Document(text)
    row = min(row, document.line_count - 1)
    line = document.lines[row]
    return document.translate_row_col_to_index(row, len(line) - len(line.lstrip()))
