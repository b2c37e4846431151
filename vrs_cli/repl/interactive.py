"""Run the shell on a terminal with prompt-toolkit: it reads lines at a prompt and shows the robot's state below the
prompt.

Only prompt-toolkit is imported before the first prompt appears, so that it appears fast. Then a thread prepares the
robot and the language.
"""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import cache, partial
from math import inf
from textwrap import fill
from threading import Thread
from time import monotonic
from typing import TYPE_CHECKING, Generic, TypeVar

from prompt_toolkit import PromptSession
from prompt_toolkit.application import run_in_terminal
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.enums import EditingMode
from prompt_toolkit.filters import to_filter
from prompt_toolkit.formatted_text import StyleAndTextTuples
from prompt_toolkit.history import InMemoryHistory
from prompt_toolkit.input import Input
from prompt_toolkit.input.typeahead import get_typeahead
from prompt_toolkit.key_binding import KeyPress
from prompt_toolkit.keys import Keys
from prompt_toolkit.patch_stdout import patch_stdout

from vrs_cli.repl import interrupt, piped, prompt
from vrs_cli.repl.config import Config, open_history, read_config, state_folder

if TYPE_CHECKING:
    from vrs_cli.repl.front_end import FrontEnd, Place
    from vrs_cli.repl.terminal import ShellTerminal
    from vrs_cli.values.questions import PromptStatus


V = TypeVar("V")
IDLE = "."
MENU_ROWS = 6
DROPPED = "The line is dropped"


def make_terminal(place: Place, read: Callable[[str], str], config: Config) -> ShellTerminal:
    """Return the terminal of a shell, with its front end (the link to the robot) in `screens`. `read`: asks the user
    for a line."""
    from vrs_cli.language.text import parser
    from vrs_cli.render.console import TerminalRenderer
    from vrs_cli.repl.terminal import ShellTerminal, pager_of

    terminal = ShellTerminal(read, cache(lambda: TerminalRenderer(palette=config.palette)))
    terminal.pager, terminal.palette = pager_of(config.pager, os.environ), config.palette
    terminal.vi = config.keys == "vi"
    terminal.whole_lines = place.lives
    terminal.screens = place.front_end(terminal)
    parser.parse_prompt("WHERE")  # load the parser now, so that the first pressed key does not wait for it
    return terminal


# --- slow parts (the robot, the language, numpy) are prepared while the first prompt is shown ---


class BackgroundValue(Generic[V]):
    """A value that `make` computes in a thread. `ready` never waits; `wait` does, and raises the error if the
    computation failed. `when_ready`: called when the computation has ended."""

    def __init__(self, make: Callable[[], V], when_ready: Callable[[], None] = lambda: None) -> None:
        self._make, self._when_ready = make, when_ready
        self._thread = Thread(target=self._work, name="background value", daemon=True)
        self._value: Future[V] = Future()

    def begin(self) -> None:
        """Start the thread, unless it has been started already."""
        if self._thread.ident is None:
            self._thread.start()

    def _work(self) -> None:
        try:
            self._value.set_result(self._make())
        except BaseException as error:  # `wait` raises it again
            self._value.set_exception(error)
        self._when_ready()

    @property
    def ready(self) -> V | None:
        """The value, or None if it has not been computed yet or the computation failed."""
        return self._value.result() if self._value.done() and self._value.exception() is None else None

    def wait(self) -> V:
        """Return the value. Start the computation if necessary, and wait for it."""
        self.begin()
        return self._value.result()


# --- the shell -----------------------------------------------------------------------------------------------------


class ValCompleter(Completer):
    """The completer of the prompt. It suggests nothing until the tables of words are loaded, or if the search fails."""

    def __init__(self, ready: Callable[[], ShellTerminal | None]) -> None:
        self._ready = ready

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterable[Completion]:
        terminal = self._ready()
        text = document.text_before_cursor
        if terminal is None or (complete_event.text_inserted and not text.strip()):
            return []
        try:
            found = terminal.screens.suggestions(text, complete_event.completion_requested)
        except Exception as error:
            terminal.screens.note(error)
            return []
        return [Completion(one.text, -one.length, display_meta=one.meta) for one in found]


class Shell:
    """The prompt on a terminal, from which `run_loop` reads lines. It continues after wrong lines and after Ctrl-C."""

    def __init__(self, place: Place) -> None:
        self.place = place
        self._status: PromptStatus | None = None  # the robot's state when it was last read
        history, note = open_history(state_folder(os.environ) / "history")
        self._answers: PromptSession[str] | None = None
        self._pages = False  # whether the last input was a single line, so that long replies may go through a pager
        config = read_config(os.environ)
        self.notes = [*filter(None, (note, *config.wrong))]
        self.terminal_maker = BackgroundValue(lambda: make_terminal(place, self._answer, config), self._redraw)
        self.prompts: PromptSession[str] = PromptSession(
            self._message,
            history=history,
            lexer=prompt.ValLexer(
                lambda: self.terminal_maker.ready is not None,
                lambda: () if self._status is None else self._status.hidden,
                config.palette,
            ),
            completer=ValCompleter(lambda: self.terminal_maker.ready),
            validate_while_typing=False,
            complete_while_typing=True,
            complete_in_thread=place.remote,
            bottom_toolbar=self._toolbar,
            style=prompt.STYLE,
            color_depth=prompt.colour_depth(),
            reserve_space_for_menu=MENU_ROWS,
            key_bindings=prompt.key_bindings(self._help, self._abort),
            auto_suggest=prompt.FromHistory() if config.suggestions else None,
            vi_mode=config.keys == "vi",
            enable_suspend=True,
        )
        # set here: if PromptSession received this option, no completions would appear while the user types
        self.prompts.default_buffer.enable_history_search = to_filter(True)
        self.prompts.app.before_render += self._before_render
        self.prompts.app.after_render += lambda _app: self.terminal_maker.begin()

    def run(self) -> int:
        """Run the shell until EXIT, QUIT or Ctrl-D. Return the exit status."""
        if self.place.banner:
            print(self.place.banner)
        for note in self.notes:
            print(note)
        with without_echo(signals=False), interrupt.abort_on_quit(self._send_abort):
            if self.place.waits:
                terminal = self.terminal_maker.wait()
                with _interruptible(terminal):
                    terminal.screens.opening()
            if (line := self.read()) is not None:  # the first prompt appears before the robot is ready
                exchange = self.terminal_maker.wait().screens
                from vrs_cli.repl.loop import run_loop

                run_loop(self, exchange, line)
        if self.terminal_maker.ready is not None and not self._hung_up:
            self.terminal_maker.ready.screens.closing()
        return 0

    @property
    def _hung_up(self) -> bool:
        """True if the terminal was closed. The user did not choose to leave, and cannot be asked anything."""
        return self.prompts.app.input.closed

    # --- the interface for `run_loop` ---

    def read(self) -> str | None:
        """Return the next line, QUESTION if a program asks, or None if the user leaves.

        Ctrl-C drops the typed line. If no text is typed, Ctrl-C ends the entry of a program, or stops the running
        program.
        """
        while True:
            try:
                status = self._look()
                if self.place.lives and status is not None and status.asked:
                    return piped.QUESTION
                line = self._prompt(self.prompts, self._message, default="" if status is None else status.indent)
                self._pages = "\n" not in line
                return line
            except interrupt.Ended:
                raise
            except KeyboardInterrupt:
                if self.prompts.default_buffer.text.strip():
                    print(DROPPED)
                elif not self._leave_entry() and (ready := self.terminal_maker.ready) is not None:
                    with _interruptible(ready):
                        ready.screens.stop_program()
            except EOFError:
                if not self._leave_entry() and self._leave():
                    return None

    def interruptible(self) -> AbstractContextManager[None]:
        terminal = self.terminal_maker.wait()
        terminal.pages = self._pages
        return _interruptible(terminal)

    def goes_on(self) -> bool:
        """Finish a line. If the connection was lost meanwhile, report that the lines typed since then were not sent,
        and keep them in the history. Return whether the user stays."""
        terminal = self.terminal_maker.wait()
        terminal.end_progress()
        for line in typed_ahead(self.prompts.app.input) if terminal.screens.was_cut() else ():
            self.prompts.history.append_string(line)
            terminal.screens.drop(line)
        return not terminal.leaving

    def _prompt(self, prompts: PromptSession[str], message: Callable[[], str] | str, default: str = "") -> str:
        """Return a line typed at a prompt. In real time the robot keeps running while the user types, and the output of
        its programs appears above the prompt."""
        if not self.place.lives:
            return prompts.prompt(message, default=default)

        def keep_up() -> None:
            prompts.app.create_background_task(self._keep_up(prompts))

        prompts.app.erase_when_done = False
        with patch_stdout(raw=True):
            return prompts.prompt(message, default=default, pre_run=keep_up)

    async def _keep_up(self, prompts: PromptSession[str]) -> None:
        """While a prompt is open, carry out due actions. Redraw the toolbar when the robot's state changes, and at
        least every `RESTING` seconds for the time."""
        shown, drawn, woken, loop = "", -inf, asyncio.Event(), asyncio.get_running_loop()
        while True:
            terminal = self.terminal_maker.ready
            if terminal is not None:
                terminal.screens.wake = partial(_soon, loop, woken.set)
            await wait_or_wake(woken, piped.KEEPING_UP if terminal is None else terminal.screens.rest())
            if terminal is not None:
                terminal.screens.keep_up()
                self._turn_to_question(terminal.screens, prompts)
            self._look()
            state, now = self._state().partition(prompt.GAP)[2], monotonic()
            if state != shown or now - drawn >= piped.RESTING:
                shown, drawn = state, now
                self._redraw()

    def _turn_to_question(self, front_end: FrontEnd, prompts: PromptSession[str]) -> None:
        """Switch from an empty prompt to a program's question, or back to the prompt if the question no longer needs an
        answer."""
        idle = prompts is self.prompts and not prompts.default_buffer.text and bool(front_end.status().asked)
        withdrawn = prompts is not self.prompts and front_end.question_is_withdrawn
        if (idle or withdrawn) and not prompts.app.is_done:
            prompts.app.erase_when_done = True
            prompts.app.exit(result=piped.QUESTION if idle else "")

    def _send_abort(self) -> None:
        """Stop the robot and its programs at once. A signal handler may call this method."""
        if self.terminal_maker.ready is not None:
            self.terminal_maker.ready.screens.abort()

    def _abort(self) -> None:
        """Stop the robot while a prompt is open (Ctrl-X). The typed line stays; the output above it names the stopped
        programs."""
        if self.terminal_maker.ready is not None:
            self._send_abort()
            run_in_terminal(self.terminal_maker.ready.screens.keep_up)

    def _leave_entry(self) -> bool:
        """Drop the program that is being typed, unless the user wants to continue (after Ctrl-C or Ctrl-D). Return
        False if no program is being typed."""
        terminal, status = self.terminal_maker.ready, self._look()
        if terminal is None or status is None or self._hung_up or not status.in_program:
            return False
        with _interruptible(terminal):
            terminal.screens.leave_entry()
        return True

    def _leave(self) -> bool:
        """End the shell like EXIT (after Ctrl-D); ask no question if the terminal was closed. Return whether the user
        leaves."""
        terminal = self.terminal_maker.ready
        if terminal is None or self._hung_up:
            return True
        with _interruptible(terminal):
            terminal.screens.leave()
        return terminal.leaving

    # --- the contents of the prompt ---

    def _before_render(self, _app: object) -> None:
        self._look()

    def _look(self) -> PromptStatus | None:
        """Read and return the robot's state for the prompt; None while the robot is being prepared."""
        terminal = self.terminal_maker.ready
        self._status = None if terminal is None else terminal.screens.status()
        return self._status

    def _message(self) -> str:
        return IDLE if self._status is None else self._status.prompt

    def _toolbar(self) -> StyleAndTextTuples:
        """Return the toolbar's contents: the syntax of the typed word, if it is known, then the robot's state."""
        state: StyleAndTextTuples = [("", self._state())]
        if self.terminal_maker.ready is None:
            return state
        found = self.terminal_maker.ready.screens.signature(
            self.prompts.default_buffer.document.current_line_before_cursor
        )
        width = self.prompts.app.output.get_size().columns
        return state if found is None else [*prompt.signature_row(found, width), ("", "\n"), *state]

    def _help(self, document: Document) -> None:
        """Show the help on the word at the cursor, above the prompt (F1)."""
        run_in_terminal(partial(self.terminal_maker.wait().screens.take, f"? {prompt.asked_about(document)}"))

    def _state(self) -> str:
        terminal, status = self.terminal_maker.ready, self._status
        width = self.prompts.app.output.get_size().columns
        if terminal is None or status is None:
            return prompt.toolbar(None, "", width)
        noted = terminal.screens.noted
        note = f"\n{fill(noted, width, initial_indent=' ', break_on_hyphens=False)}" if noted else ""
        return prompt.toolbar(status, status.asked or terminal.last, width, prompt.vi_mode(self.prompts.app)) + note

    def _redraw(self) -> None:
        self.prompts.app.invalidate()

    def _answer(self, question: str) -> str:
        """Ask a question, such as `Change?` or the question of PROMPT, and return the typed answer. Answers have a
        separate history."""
        if self._answers is None:
            self._answers = PromptSession(
                history=InMemoryHistory(),
                style=prompt.STYLE,
                color_depth=prompt.colour_depth(),
                vi_mode=self.prompts.editing_mode is EditingMode.VI,
                key_bindings=prompt.abort_binding(self._abort),
                enable_suspend=True,
            )
        return self._prompt(self._answers, question)


@contextmanager
def _interruptible(terminal: ShellTerminal) -> Iterator[None]:
    """Let Ctrl-C stop the user's command that the block carries out."""
    with interrupt.stoppable(terminal.interrupt), without_echo(signals=True):
        yield


async def wait_or_wake(woken: asyncio.Event, seconds: float) -> None:
    """Wait for `seconds` [s], or until `woken` is set; then clear `woken`."""
    with suppress(TimeoutError):
        async with asyncio.timeout(seconds):
            await woken.wait()
    woken.clear()


def _soon(loop: asyncio.AbstractEventLoop, act: Callable[[], None]) -> None:
    """Schedule a call of `act` in the event loop of a prompt, from any thread. Do nothing if the prompt is closed."""
    with suppress(RuntimeError):
        loop.call_soon_threadsafe(act)


ABORT_KEY = b"\x18"  # Ctrl-X, which aborts: all keyboards have this key, and few programs use it


@contextmanager
def without_echo(*, signals: bool) -> Iterator[None]:
    """Switch off the terminal's echo during the block. `signals`: whether Ctrl-C and Ctrl-X send signals; otherwise the
    next prompt reads them as keys."""
    try:
        import termios
    except ImportError:  # on Windows the terminal echoes only while a program reads
        yield
        return
    try:
        before = termios.tcgetattr(sys.stdin)
    except (termios.error, OSError, ValueError):
        yield
        return
    quiet = [*before]
    quiet[6] = [*before[6]]
    quiet[6][termios.VQUIT] = ABORT_KEY
    quiet[3] &= ~(termios.ECHO | termios.ISIG)
    quiet[3] |= termios.ISIG * signals
    termios.tcsetattr(sys.stdin, termios.TCSANOW, quiet)
    try:
        yield
    finally:
        with suppress(termios.error):  # the terminal may be closed
            termios.tcsetattr(sys.stdin, termios.TCSANOW, before)


def typed_ahead(source: Input) -> list[str]:
    """Remove from the terminal's input the lines that were typed before the next prompt, and return those that are not
    blank. The last line may be unfinished."""
    keys = get_typeahead(source)
    with source.raw_mode():
        while more := source.read_keys():
            keys += more
        keys += source.flush_keys()
    return [line for line in "".join(map(_text, keys)).splitlines() if line.strip()]


def _text(pressed: KeyPress) -> str:
    """Return the text that a key adds to a line; "" for a control key."""
    if pressed.key in (Keys.ControlM, Keys.ControlJ):
        return "\n"
    return pressed.data if pressed.key is Keys.BracketedPaste or len(pressed.key) == 1 else ""
