"""Keeps what a shell has in memory alone where it outlives the shell, and brings back what another one has left."""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from vrs_cli.files.recovery import Left, Recovery, left
from vrs_cli.values.numbers import count
from vrs_cli.values.questions import Confirmation
from vrs_cli.values.replies import Message, Tone, report

if TYPE_CHECKING:
    from vrs_cli.interfaces.conversation.conversation import Conversation
    from vrs_cli.interfaces.dialogue import Terminal

ROBOT = "; robot: "  # of which it was: the first line of a file
SLOW, REST = 0.1, 10.0  # a text that takes more than SLOW [s] is followed by REST times as long without one


class Keeper:
    """Writes the recovery file of a conversation after each line that has changed something."""

    def __init__(
        self,
        conversation: Conversation,
        folder: Path,
        terminal: Terminal,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._conversation, self._folder, self._terminal, self._clock = conversation, folder, terminal, clock
        self._recovery = Recovery(folder)
        self._kept: object = None
        self._not_before = 0.0

    def keep(self) -> None:
        """After a line: write what is not stored, remove the file where all is."""
        session, unfinished = self._conversation.session, self._conversation.unfinished
        if not (unfinished or session.unstored.programs() or session.unstored.items()):
            self.forget()
            return
        from vrs_cli.files.store import store

        begun = self._clock()
        now = (session.unstored.state(), unfinished)
        if now == self._kept or begun < self._not_before:
            return
        worked = time.process_time()
        whose = f"{ROBOT}{session.engine.arm.model.name}\n"
        self._recovery.write(whose + store(session.environment, layout=session.layout) + unfinished)
        self._kept, took = now, time.process_time() - worked
        self._not_before = begun + REST * took if took > SLOW else begun

    def forget(self) -> None:
        """All is stored, or the user has left: nothing need be kept."""
        self._recovery.remove()
        self._kept = None

    def offer(self) -> None:
        """Ask about what other shells have left."""
        for one in left(self._folder):
            self._offer(one)

    def _offer(self, one: Left) -> None:
        session = self._conversation.session
        terminal, (robot, text) = self._terminal, _robot_of(one.text)
        whose = f", robot {robot}" if robot not in ("", session.engine.arm.model.name) else ""
        if not terminal.ask(Confirmation(f"Recovered from {_moment(one.written)}{whose}: {_held(text)}. Load (Y/N)?")):
            terminal.show(Message(f"Not loaded; LOAD {one.decline()} brings it back"))
            return
        terminal.show(report(session.load_text(text), text))
        terminal.show(Message("Loaded, and not stored yet: STORE file stores all", Tone.WARNING))
        self.keep()
        self._recovery.wait()
        one.remove()


def _robot_of(text: str) -> tuple[str, str]:
    """The name of the robot, "" where a file does not tell it; and the rest."""
    first, _, rest = text.partition("\n")
    return (first.removeprefix(ROBOT), rest) if first.startswith(ROBOT) else ("", text)


def _moment(when: datetime) -> str:
    """`14:05`, with the day if it is not today."""
    return f"{when:%H:%M}" if when.date() == datetime.now().date() else f"{when:%d %b %Y %H:%M}"


def _held(text: str) -> str:
    """`programs pick, place, 2 locations`."""
    from vrs_cli.interfaces.monitor.consent import listed
    from vrs_cli.language.text.ast import Program, Section
    from vrs_cli.language.text.parser import parse_file

    parts = parse_file(text)[0].parts
    programs = list(dict.fromkeys(part.name for part in parts if isinstance(part, Program)))
    said = [listed("program", programs)] if programs else []
    nouns = {".LOCATIONS": "location", ".REALS": "real", ".STRINGS": "string"}
    said += [count(len(part.entries), nouns[part.name]) for part in parts if isinstance(part, Section)]
    return ", ".join(said) or "nothing"
