"""Connect a shell with its robot: exchange messages, and send the requests of a prompt and of full screens
(suggestions, status, the drafts of SEE)."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from vrs_cli.engine import feed, position
from vrs_cli.errors import RequestRefused
from vrs_cli.files.trajectory_file import Recording, read_trajectory
from vrs_cli.interfaces.conversation.complete import Signature, signature
from vrs_cli.interfaces.dialogue import Terminal
from vrs_cli.interfaces.port.port import FarHand, MakeRequest, Outlet, Port, check_end
from vrs_cli.repl import loop, piped
from vrs_cli.values import acts, diagnostics, questions
from vrs_cli.values.hand import Look, Seen
from vrs_cli.wire.messages import At, Complete, Completed, Done, Fetched, Get, Refused, ServerMessage

AT_ONCE = 1.0  # [s] maximum time to wait for an answer after a key
COMING_BACK = 60.0  # [s] maximum time to wait for a file, or for the answer to a save


class FrontEnd(loop.Exchange):
    """The exchange of a shell, extended by the requests of a prompt and full screens: suggestions, status, pictures."""

    def __init__(self, terminal: Terminal, port: Port, told: Callable[[str], None]) -> None:
        super().__init__(terminal, port, told)
        self._status = questions.PromptStatus()

    # --- while a line is typed ---

    def status(self) -> questions.PromptStatus:
        self._status = self.port.status()
        return self._status

    def signature(self, text: str, *, steps: bool = False) -> Signature | None:
        """Return the signature of the word that was typed last. `steps`: read the text as a step of a program in any
        case."""
        return signature(text, self.port.program, at_prompt=not (self._status.in_program or steps))

    def suggestions(self, text: str, everything: bool) -> list[questions.Suggestion]:
        """Return words that may follow a text. If the robot is in this process, its internal errors are raised here."""
        end = self.end_of(lambda id: Complete(id, text, everything))
        if isinstance(end, Refused):
            end.refusal.error()
        return list(end.choices) if isinstance(end, Completed) else []

    def end_of(self, make: MakeRequest, seconds: float = AT_ONCE) -> ServerMessage | None:
        """Send a request without showing its answers. Return the final answer, or None if it does not arrive within
        `seconds`."""
        found: feed.Inbox[ServerMessage] = feed.Inbox()
        try:
            self.port.begin(make, found.put)
        except RequestRefused:
            return None
        return self.port.take(found, seconds)

    def rest(self) -> float:
        """Return the time until the next visible change [s], if no message arrives before."""
        now = self.status()
        return min(max(self.port.due, piped.MIN_WAIT_S), piped.KEEPING_UP if now.clock < now.end else piped.RESTING)

    # --- full screens ---

    def hand(self, question: questions.Jogging) -> FarHand:
        """Return the control of the arm for JOG. Raises RequestRefused if the robot does not answer."""
        seen = self.end_of(lambda id: At(id, Look()))
        if not isinstance(seen, Done) or not isinstance(seen.found, Seen):
            raise RequestRefused("the robot does not answer", "JOG again")
        return FarHand(self.begin, question.joints, question.units, seen.found)

    def begin(self, make: MakeRequest, outlet: Outlet) -> int:
        """Send a request in addition to the awaited request, and carry out all due actions."""
        id = self.port.begin(make, outlet)
        self.keep_up()
        self.after()
        return id

    def recording(self, question: questions.Playing) -> Recording:
        """Return the trajectory for REPLAY. Its file is fetched unless the robot is in this process."""
        if isinstance(self.port.on_screen, Recording):
            return self.port.on_screen
        fetched = self.end_of(lambda id: Get(id, question.path), COMING_BACK)
        if not isinstance(fetched, Fetched):
            raise RequestRefused(f"{question.path} does not come from the robot", "REPLAY again")
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / Path(question.path).name
            path.write_bytes(fetched.data)
            return read_trajectory(path)

    def watched_robot(self) -> position.Watched | None:
        """Return the robot, to watch it while it moves; None if it cannot be watched."""
        try:
            return self.port.follow()
        except RequestRefused:
            return None


class Place(Protocol):
    """Where a shell's robot runs, and how the shell reaches it."""

    @property
    def lives(self) -> bool:
        """Whether the robot continues while a line is typed."""

    @property
    def waits(self) -> bool:
        """Whether the shell shows or asks something before the first line."""

    @property
    def remote(self) -> bool:
        """Whether answers take time, because the robot is behind a connection."""

    @property
    def banner(self) -> str:
        """The text before the first prompt on a terminal; "" for none."""

    def front_end(self, terminal: Terminal) -> FrontEnd:
        """Make the front end of the shell. Raises VrsError."""


Found = Callable[[tuple[diagnostics.Diagnostic, ...]], None]  # a function that is called with the mistakes in a text


class DraftPage:
    """The program of SEE while it is edited. Only one text is checked at a time; after that the latest text is
    checked."""

    def __init__(self, question: questions.Editing, front_end: FrontEnd) -> None:
        self.name, self.text, self.row, self.dialect = question.name, question.text, question.row, question.dialect
        self._front_end = front_end
        self._latest: tuple[str, Found] | None = None
        self._looking = False

    def look(self, text: str, found: Found) -> None:
        """Check a text, and call `found` with its mistakes, either at once or when they arrive."""
        self._latest = text, found
        if not self._looking:
            self._send()

    def _send(self) -> None:
        assert self._latest is not None, "there is something to look at"
        (text, found), self._latest, self._looking = self._latest, None, True

        def hear(end: ServerMessage) -> None:
            self._looking = False
            if isinstance(end, Done) and isinstance(end.found, acts.Findings):
                found(end.found.findings)
            if self._latest is not None:
                self._send()

        try:
            self._front_end.begin(lambda id: At(id, acts.ReadDraft(text)), hear)
        except RequestRefused:  # without a connection, only the next change of the text is checked
            self._looking = False

    def save(self, text: str) -> str:
        """Store the program. Return the robot's message. Raises VrsError."""
        end = self._front_end.end_of(lambda id: At(id, acts.KeepDraft(text)), COMING_BACK)
        if end is not None:
            check_end(end)
        if not isinstance(end, Done) or not isinstance(end.found, acts.Kept):
            raise RequestRefused("the robot does not answer", "store it again")
        self._front_end.after()
        self.name = end.found.name
        return end.found.said
