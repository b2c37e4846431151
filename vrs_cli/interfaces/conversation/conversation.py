"""Lines into a session, at a terminal or from a pipe: programs are gathered, errors become replies."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

from vrs_cli.dialogue.numbers import count
from vrs_cli.dialogue.questions import Parting
from vrs_cli.dialogue.replies import Message, Tone, refusal, report
from vrs_cli.dialogue.talk import Talk
from vrs_cli.errors import ProgramExists, VrsError
from vrs_cli.interfaces.conversation.entry import Entry, closes_entry, opens_entry
from vrs_cli.interfaces.conversation.mishap import internal_error
from vrs_cli.interfaces.conversation.validate import mistake_in_entry
from vrs_cli.interfaces.monitor.consent import leave, may_replace
from vrs_cli.interfaces.monitor.files import load
from vrs_cli.interfaces.session.session import Session
from vrs_cli.language.text.diagnostics import Diagnostic

_NAME = re.compile(r"\s*\.\w+\s+([A-Za-z][\w.]*)")


class Conversation:
    """One session and the program that is being typed, if one is. Nothing that a user types raises an exception."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.entry: Entry | None = None
        self._refused = False
        self.after: Callable[[], None] = lambda: None  # called after each line, or lines that were pasted together

    # --- lines ---

    def take(self, text: str) -> None:
        """One line, or several that were pasted together; Ctrl-C in one of them forgets those after it."""
        self.session.desk.interrupted = False
        for line in text.splitlines() or [""]:
            self._guarded(self._line(line), line)
            if self.session.desk.interrupted:
                break
        if self._refused and self.session.terminal.attended:
            self.entry, self._refused = None, False  # somebody is there, and knows that it was refused
        self._guarded(self._after(), "")

    def _after(self) -> Talk[None]:
        self.after()
        yield from ()

    def _guarded(self, talk: Talk[None], line: str) -> None:
        """Whatever goes wrong is shown, and the next line may come."""
        terminal = self.session.terminal
        try:
            self.session.converse(talk)
        except VrsError as error:
            terminal.show(refusal(error, line))
        except KeyboardInterrupt:
            self.session.desk.interrupted = True
            terminal.show(Message("interrupted", Tone.ERROR))
        except BrokenPipeError:
            raise  # whoever read us has gone
        except Exception as error:
            terminal.show(internal_error(error))

    def _line(self, line: str) -> Talk[None]:
        if self.entry is not None:
            yield from self._step(self.entry, line)
        elif self.session.desk.editor is None and opens_entry(line):
            yield from self._open(line)
        elif self.session.desk.editor is not None or line.strip():
            yield from self.session.answers(line)

    def answer(self) -> None:
        """Put the questions that tasks have, which go on then."""
        self._guarded(self._answer(), "")

    def _answer(self) -> Talk[None]:
        yield from self.session.driver.ask()
        self.session.settle()

    def mistake(self, text: str) -> Diagnostic | None:
        """The first mistake in a line that is not sent yet. Several lines (pasted) are not looked at."""
        session, entry = self.session, self.entry
        if not text.strip() or "\n" in text:
            return None
        if session.desk.editor is not None:
            return session.desk.editor.mistake(text)
        if entry is not None:
            return mistake_in_entry(entry, text, session.environment.kinds())
        return None if opens_entry(text) and not Entry(text).program else session.mistake(text)

    # --- typing a program ---

    def _open(self, header: str) -> Talk[None]:
        """`.PROGRAM`: the lines after it are its steps, also when it is refused (they are dropped then)."""
        self.entry, self._refused = Entry(header), True
        name = _named(header)
        if name and not (yield from may_replace(self.session, name)):
            raise ProgramExists(name, f"DELETEP {name} deletes it, DISABLE INTERACTIVE lets it be replaced")
        self._refused = False

    def _step(self, entry: Entry, line: str) -> Talk[None]:
        if not closes_entry(line):
            entry.add(line)
            return
        self.entry = None
        refused, self._refused = self._refused, False
        if not refused:
            yield from self._store(entry)

    def _store(self, entry: Entry) -> Talk[None]:
        """`.END`: check the whole and keep it."""
        before = dict(self.session.programs)
        diagnostics = self.session.load_text(entry.text)
        yield report(diagnostics, entry.text)
        for key, stored in self.session.programs.items():
            if before.get(key) is not stored:
                ready = " (replaced)" if key in before else ""
                ready += "" if stored.analysis.executable else "; it cannot be executed yet"
                steps = count(len(stored.program.steps), "step")
                yield Message(f"Program {stored.name}: {steps}{ready}")

    def leave_entry(self, why: str = "") -> None:
        """Ctrl-C, or the end of the input: what was typed of a program is forgotten, and said to be. Somebody who is
        there is asked first, if there is something to forget.
        """
        self.session.converse(self._leave_entry(why))

    def _leave_entry(self, why: str) -> Talk[None]:
        name, how = self._being_typed()
        if not name:
            return
        loses = self._typed and self.session.terminal.attended
        if loses and not (yield Parting(f"{name} is not stored. Leave (Y/N)?")):
            return
        self.entry = self.session.desk.editor = None
        yield Message(f"{why}{name} is not stored ({how})", Tone.ERROR if why else Tone.NOTE)

    def leave(self) -> None:
        """Ctrl-D: as EXIT, which an error of the shell itself does not keep the user from."""
        self.session.converse(leave(self.session))

    def _being_typed(self) -> tuple[str, str]:
        """The name of the program that is typed or edited, and how it would be stored; empty where there is none."""
        if self.session.desk.editor is not None:
            return self.session.desk.editor.name, "E would have stored it"
        if self.entry is not None:
            return _named(self.entry.header) or "the program", ".END would have ended it"
        return "", ""

    @property
    def _typed(self) -> bool:
        """Whether anything of it was typed."""
        editor = self.session.desk.editor
        return editor.changed if editor is not None else self.entry is not None and bool(self.entry.lines)

    @property
    def in_program(self) -> bool:
        """Whether the next line is one of a program."""
        return self.entry is not None or self.session.desk.editor is not None

    @property
    def unfinished(self) -> str:
        """The program that is being typed or edited, as a file would hold it."""

        if self.session.desk.editor is not None:
            return self.session.desk.editor.text
        if self.session.desk.drafted:
            return self.session.desk.drafted
        return self.entry.text if self.entry is not None and not self._refused else ""

    @property
    def prompt(self) -> str:
        """What stands before the next line where it is one of a program, "" where it is not."""
        if self.session.desk.editor is not None:
            return self.session.desk.editor.prompt
        return self.entry.prompt if self.entry is not None else ""

    # --- files ---

    def load(self, path: str) -> None:
        """The file named on the command line."""
        self._guarded(load(self.session, Path(path)), "")


def _named(header: str) -> str:
    """The name in a header, empty where there is none."""
    found = _NAME.match(header)
    return found.group(1) if found else ""
