"""The shell on a terminal, with prompt-toolkit: history, completion, colours, checking before a line is sent.

Only prompt-toolkit is imported before the first prompt is seen; the robot and the language are made ready behind it.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Container, Iterable, Iterator
from math import inf
from textwrap import fill
from time import monotonic
from typing import TYPE_CHECKING

from prompt_toolkit import PromptSession
from prompt_toolkit.application import get_app
from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document
from prompt_toolkit.filters import Condition, has_validation_error, to_filter
from prompt_toolkit.history import InMemoryHistory
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import ConditionalContainer, Layout, Window
from prompt_toolkit.patch_stdout import patch_stdout
from prompt_toolkit.utils import is_dumb_terminal
from prompt_toolkit.validation import ValidationError, Validator

from vrs_cli.repl.backstage import Backstage
from vrs_cli.repl.colours import STYLE, colour_depth
from vrs_cli.repl.echo import unechoed
from vrs_cli.repl.history import history_path, open_history, recovery_folder
from vrs_cli.repl.interrupt import Ended, stoppable
from vrs_cli.repl.lexer import ValLexer
from vrs_cli.repl.toolbar import GAP, toolbar
from vrs_cli.version import __version__

if TYPE_CHECKING:
    from vrs_cli.engine.clock import Clock
    from vrs_cli.interfaces.conversation.conversation import Conversation
    from vrs_cli.kinematics.model import RobotModel
    from vrs_cli.render.console import TerminalRenderer
    from vrs_cli.repl.recorder import Recorder
    from vrs_cli.repl.terminal import ShellTerminal

BANNER = f"vrs {__version__}: VAL-II for a virtual robot. HELP says what there is, EXIT leaves."
IDLE, RUNNING = ".", "*"
MENU_ROWS = 6
KEEPING_UP, RESTING = 0.1, 1.0  # [s] between two looks at a clock on the wall: while the arm moves, and at rest
SHORTEST = 0.01  # [s] however soon the next thing is due
QUESTION = "\0"  # comes in place of a line when a program asks for one


class Workplace:
    """What is made behind the first prompt: the conversation, on a terminal that can ask."""

    def __init__(
        self,
        model: RobotModel | None,
        read: Callable[[str], str],
        recorder: Recorder | None = None,
        clock: Clock | None = None,
    ) -> None:
        from vrs_cli.interfaces.conversation import names  # noqa: F401 (the first key must not wait for it)
        from vrs_cli.interfaces.conversation.conversation import Conversation
        from vrs_cli.interfaces.session.session import Session
        from vrs_cli.language.text import parser
        from vrs_cli.render.console import TerminalRenderer
        from vrs_cli.repl.keeping import Keeper
        from vrs_cli.repl.terminal import ShellTerminal

        renderer: list[TerminalRenderer] = []

        def draw() -> TerminalRenderer:
            if not renderer:
                renderer.append(TerminalRenderer())
            return renderer[0]

        self.terminal: ShellTerminal = ShellTerminal(read, draw)
        session = Session(self.terminal, model, clock=clock)
        session.desk.lives = self.terminal.whole_lines = clock is not None
        self.conversation: Conversation = Conversation(session)
        self.keeper = Keeper(self.conversation, recovery_folder(os.environ))
        self.terminal.line_left = self.keeper.keep
        self.recorded = None if recorder is None else recorder.begin(session)
        self.noted = ""
        self.terminal.interrupt = self.interrupt
        parser.parse_prompt("WHERE")

    def interrupt(self) -> bool:
        """Ctrl-C: stop the program that runs; False when none does."""
        self.terminal.echoed = True
        return self.conversation.session.interrupt()

    def take(self, text: str) -> None:
        self.conversation.take(text)
        self.keep()

    def keep(self) -> None:
        """What is in memory alone outlives the shell, wherever that can be written."""
        try:
            self.keeper.keep()
        except Exception as error:
            self.note(error)

    def stop_program(self) -> None:
        """Ctrl-C on an empty line: the end of the program is told when the arm stands."""
        from vrs_cli.interfaces.tasks.track import ROBOT_PROGRAM

        self.conversation.session.driver.abort(ROBOT_PROGRAM)

    @property
    def asked(self) -> str:
        """What the program asks that has waited longest for a line; empty where none does."""
        waiting = self.conversation.session.driver.unasked()
        return f"{waiting[0][0].task.program} asks: {waiting[0][1].question.text}" if waiting else ""

    def rest(self) -> float:
        """How long nothing happens that somebody would see [s]: until a task goes on, or the arm is elsewhere."""
        from vrs_cli.engine.clock import WallClock

        session = self.conversation.session
        clock, seen = session.engine.clock, RESTING if session.engine.now >= session.engine.end else KEEPING_UP
        due = clock.until(session.driver.peek()) if isinstance(clock, WallClock) else seen
        return min(max(due, SHORTEST), seen)

    def keep_up(self) -> None:
        """Let the robot do what has become due while nobody was looking."""
        try:
            self.conversation.session.settle()
        except Exception as error:
            self.note(error)

    def note(self, error: Exception) -> None:
        """Tell of an error where nothing can be printed: below the toolbar, until the next line."""
        from vrs_cli.interfaces.conversation.mishap import internal_error

        self.noted = internal_error(error).text


# --- what prompt-toolkit asks for -----------------------------------------------------------------------------------


class ValCompleter(Completer):
    """Suggestions of `complete`; none before the tables are there, and none where finding them fails."""

    def __init__(self, ready: Callable[[], Workplace | None]) -> None:
        self._ready = ready

    def get_completions(self, document: Document, complete_event: CompleteEvent) -> Iterable[Completion]:
        work = self._ready()
        text = document.text_before_cursor
        if work is None or (complete_event.text_inserted and not text.strip()):
            return []
        try:
            return list(self._completions(work, text, complete_event.completion_requested))
        except Exception as error:
            work.note(error)
            return []

    def _completions(self, work: Workplace, text: str, everything: bool) -> Iterator[Completion]:
        from vrs_cli.interfaces.conversation.complete import suggestions
        from vrs_cli.interfaces.conversation.names import names_of

        conversation = work.conversation
        in_program = conversation.in_program
        names = names_of(conversation.session)
        for suggestion in suggestions(text, names, in_program=in_program, everything=everything):
            yield Completion(suggestion.text, -suggestion.length, display_meta=suggestion.meta)


class LineValidator(Validator):
    """A line with a mistake is not sent: the cursor goes to it, the message below.

    A dumb terminal has no room for the message: there the line is sent, and its answer tells.
    """

    def __init__(self, work: Callable[[], Workplace]) -> None:
        self._work = work

    def validate(self, document: Document) -> None:
        try:
            mistake = self._work().conversation.mistake(document.text)
        except Exception:  # the line is sent then, and whatever is wrong is told of it
            return
        if mistake is not None:
            column = min(mistake.span.column - 1, len(document.text))
            width = get_app().output.get_size().columns
            raise ValidationError(cursor_position=column, message=fill(mistake.message, width, break_on_hyphens=False))


# --- the shell -----------------------------------------------------------------------------------------------------


class Shell:
    """The loop: read a line, carry it out. Wrong lines and Ctrl-C never end it."""

    def __init__(
        self,
        model: RobotModel | None = None,
        file: str | None = None,
        recorder: Recorder | None = None,
        clock: Clock | None = None,
    ) -> None:
        self.file, self.recorder, self._clock = file, recorder, clock
        history, self.note = open_history(history_path(os.environ))
        self._answers: PromptSession[str] | None = None
        self.backstage = Backstage(lambda: Workplace(model, self._answer, recorder, clock), self._redraw)
        self.prompts: PromptSession[str] = PromptSession(
            self._message,
            history=history,
            lexer=ValLexer(lambda: self.backstage.ready is not None, self._names),
            completer=ValCompleter(lambda: self.backstage.ready),
            validator=None if is_dumb_terminal() else LineValidator(self.backstage.wait),
            validate_while_typing=False,
            complete_while_typing=True,
            bottom_toolbar=self._toolbar,
            style=STYLE,
            color_depth=colour_depth(),
            reserve_space_for_menu=MENU_ROWS,
            key_bindings=key_bindings(),
        )
        unfold_mistakes(self.prompts.layout)
        self.prompts.app.after_render += lambda _app: self.backstage.begin()

    def run(self) -> int:
        """Until EXIT, QUIT or Ctrl-D."""
        print(BANNER)
        if self.note:
            print(self.note)
        if self.recorder is not None:
            work = self.backstage.wait()
            if work.recorded is not None:
                work.terminal.show(work.recorded)
        if self.file is not None:
            with stoppable(self.backstage.wait().interrupt):
                work = self.backstage.wait()
                work.conversation.perform(work.conversation.load(self.file))
        self._recover()
        while self._unhurt_round():
            pass
        if self.backstage.ready is not None and not self._hung_up:
            self.backstage.ready.keeper.forget()
        return 0

    def _recover(self) -> None:
        """Offer what was left by shells that were killed; where there is none, the first prompt does not wait."""
        folder = recovery_folder(os.environ)
        if not folder.is_dir():
            return
        from vrs_cli.files.recovery import files_in

        if files_in(folder):
            with stoppable(self.backstage.wait().interrupt):
                self.backstage.wait().keeper.offer()

    @property
    def _hung_up(self) -> bool:
        """Whether the terminal is gone: its user has not left, and is asked nothing."""
        return self.prompts.app.input.closed

    def _unhurt_round(self) -> bool:
        """A round that Ctrl-C between two others does not end the shell with."""
        try:
            return self._round()
        except Ended:
            raise
        except KeyboardInterrupt:
            return True

    def _round(self) -> bool:
        """One line; False when the user leaves."""
        try:
            line = self._read()
        except Ended:
            raise
        except KeyboardInterrupt:
            if not self.prompts.default_buffer.text.strip() and not self._leave_entry():
                self._stop_program()
            return True
        except EOFError:
            return self._leave_entry() or not self._leave()
        work = self.backstage.wait()
        work.noted = ""
        with stoppable(work.interrupt), unechoed():
            if line == QUESTION:
                work.conversation.perform(work.conversation.answer())
            else:
                work.take(line)
            work.terminal.end_progress()
        return not work.terminal.leaving

    def _read(self) -> str:
        """One line, or QUESTION."""
        work = self.backstage.ready
        if self._clock is not None and work is not None and work.asked:
            return QUESTION
        return self._prompt(self.prompts, self._message, default=self._indent())

    def _prompt(self, prompts: PromptSession[str], message: Callable[[], str] | str, default: str = "") -> str:
        """One line. In real time the robot goes on meanwhile, and what its programs type stands above the prompt."""
        if self._clock is None:
            return prompts.prompt(message, default=default)

        def keep_up() -> None:
            prompts.app.create_background_task(self._keep_up(prompts))

        prompts.app.erase_when_done = False
        with patch_stdout(raw=True):
            return prompts.prompt(message, default=default, pre_run=keep_up)

    async def _keep_up(self, prompts: PromptSession[str]) -> None:
        """Show what changes as it does; at rest that is the time, once in a while."""
        shown, drawn = "", -inf
        while True:
            work = self.backstage.ready
            await asyncio.sleep(KEEPING_UP if work is None else work.rest())
            if work is not None:
                work.keep_up()
                self._turn_to_question(work, prompts)
            state, now = self._toolbar().partition(GAP)[2], monotonic()
            if state != shown or now - drawn >= RESTING:
                shown, drawn = state, now
                self._redraw()

    def _turn_to_question(self, work: Workplace, prompts: PromptSession[str]) -> None:
        """Leave an empty prompt for a question of a program, and a question that waits for no answer any more."""
        idle = prompts is self.prompts and bool(work.asked) and not prompts.default_buffer.text
        withdrawn = prompts is not self.prompts and work.conversation.session.driver.withdrawn
        if (idle or withdrawn) and not prompts.app.is_done:
            prompts.app.erase_when_done = True
            prompts.app.exit(result=QUESTION if idle else "")

    def _stop_program(self) -> None:
        work = self.backstage.ready
        if work is not None and self._clock is not None:
            work.stop_program()

    def _leave_entry(self) -> bool:
        """Ctrl-C or Ctrl-D while a program is typed: back to the prompt, or on with it. False where none was."""
        work = self.backstage.ready
        if work is None or self._hung_up or not work.conversation.in_program:
            return False
        work.conversation.perform(work.conversation.leave_entry())
        work.keep()
        return True

    def _leave(self) -> bool:
        """Ctrl-D at the prompt: as EXIT, but for a terminal that is gone."""
        work = self.backstage.ready
        if work is None or self._hung_up:
            return True
        with stoppable(work.interrupt):
            work.conversation.perform(work.conversation.leave())
        return work.terminal.leaving

    # --- what the prompt shows ---

    def _names(self) -> Container[str]:
        """The keys of the variables that a line may name: of the program that is typed, or those that have a value."""
        from vrs_cli.language.text.parser import variables_in

        work = self.backstage.ready
        if work is None:
            return ()
        entry = work.conversation.entry
        return variables_in((entry.header, *entry.lines)) if entry else work.conversation.session.names()

    def _message(self) -> str:
        work = self.backstage.ready
        if work is None:
            return IDLE
        if work.conversation.in_program:
            return work.conversation.prompt
        session = work.conversation.session
        return RUNNING if session.running else session.prompt

    def _indent(self) -> str:
        work = self.backstage.ready
        entry = work.conversation.entry if work else None
        return entry.indent if entry else ""

    def _toolbar(self) -> str:
        work = self.backstage.ready
        width = self.prompts.app.output.get_size().columns
        if work is None:
            return toolbar(None, "", width)
        note = f"\n{fill(work.noted, width, initial_indent=' ', break_on_hyphens=False)}" if work.noted else ""
        return toolbar(work.conversation.session, work.asked or work.terminal.last, width) + note

    def _redraw(self) -> None:
        self.prompts.app.invalidate()

    def _answer(self, question: str) -> str:
        """A line for PROMPT and `Change?`, with a history of its own."""
        if self._answers is None:
            self._answers = PromptSession(history=InMemoryHistory(), style=STYLE, color_depth=colour_depth())
        return self._prompt(self._answers, question)


def unfold_mistakes(layout: Layout) -> None:
    """The message about a line takes as many rows as it needs; prompt-toolkit gives it one."""
    for part in layout.walk():
        if isinstance(part, ConditionalContainer) and part.filter is has_validation_error:
            assert isinstance(part.content, Window)
            part.content.height = None
            part.content.wrap_lines = part.content.dont_extend_height = to_filter(True)


def key_bindings() -> KeyBindings:
    """Ctrl-D also leaves where the line holds nothing but the indent of a program."""
    bindings = KeyBindings()

    @bindings.add("c-d", filter=Condition(lambda: not get_app().current_buffer.text.strip()))
    def leave(event: KeyPressEvent) -> None:
        event.app.exit(exception=EOFError, style="class:exiting")

    return bindings


def run(
    model: RobotModel | None, file: str | None, recorder: Recorder | None = None, clock: Clock | None = None
) -> int:
    """The interactive shell."""
    return Shell(model, file, recorder, clock).run()
