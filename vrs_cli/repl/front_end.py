"""Connect a shell with its robot: exchange messages, and send the requests of the prompt and of full-screen views
(suggestions, status, programs that SEE edits)."""

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

AT_ONCE = 1.0  # [s] maximum wait for an answer while the user types
COMING_BACK = 60.0  # [s] maximum wait for a file of the robot, or for the answer when a program is saved


class FrontEnd(loop.Exchange):
    """The exchange between a shell and its robot, with the requests of the prompt and of full-screen views:
    suggestions, status, pictures."""

    def __init__(self, terminal: Terminal, port: Port, notify: Callable[[str], None]) -> None:
        super().__init__(terminal, port, notify)
        self._status = questions.PromptStatus()

    # --- while a line is typed ---

    def status(self) -> questions.PromptStatus:
        self._status = self.port.status()
        return self._status

    def signature(self, text: str, *, steps: bool = False) -> Signature | None:
        """Return the signature (syntax and summary) of the last typed word. `steps`: read the text as a step of a
        program even if no program is being typed."""
        return signature(text, self.port.program, at_prompt=not (self._status.in_program or steps))

    def suggestions(self, text: str, everything: bool) -> list[questions.Suggestion]:
        """Return words that may complete or follow the typed text. `everything`: return them even if no word has been
        started. Raises the internal errors of a robot in this process."""
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
        """Return the time to wait before the next update of the screen [s]; a message may end the wait earlier."""
        now = self.status()
        return min(max(self.port.due, piped.MIN_WAIT_S), piped.KEEPING_UP if now.clock < now.end else piped.RESTING)

    # --- full screens ---

    def hand(self, question: questions.Jogging) -> FarHand:
        """Return the object through which JOG moves the arm. Raises RequestRefused if the robot does not answer."""
        seen = self.end_of(lambda id: At(id, Look()))
        if not isinstance(seen, Done) or not isinstance(seen.found, Seen):
            raise RequestRefused("the robot does not answer", "JOG again")
        return FarHand(self.begin, question.joints, question.units, seen.found)

    def begin(self, make: MakeRequest, outlet: Outlet) -> int:
        """Send a request, possibly while another one is awaited, and carry out all due actions. Return the request's
        number."""
        id = self.port.begin(make, outlet)
        self.keep_up()
        self.after()
        return id

    def fetch_recording(self, question: questions.Playing) -> Recording:
        """Return the trajectory that REPLAY plays. Fetch its file first if the robot is not in this process. Raises
        RequestRefused if the file does not arrive."""
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
        """Return the robot's timeline and clock, to draw the moving arm; None if the robot refuses."""
        try:
            return self.port.follow()
        except RequestRefused:
            return None


class Place(Protocol):
    """The place where a shell's robot runs (this process or a server), and the way to reach the robot."""

    @property
    def lives(self) -> bool:
        """True if the robot keeps running in real time while the user types a line."""

    @property
    def waits(self) -> bool:
        """True if the first prompt must wait for the robot, because the shell first shows or asks something."""

    @property
    def remote(self) -> bool:
        """True if the robot is behind a connection, so that answers take time."""

    @property
    def banner(self) -> str:
        """The text shown on a terminal before the first prompt; may be ""."""

    def front_end(self, terminal: Terminal) -> FrontEnd:
        """Return the shell's front end, which connects the terminal with the robot. Raises VrsError."""


Found = Callable[[tuple[diagnostics.Diagnostic, ...]], None]  # a function that receives the mistakes in the program


class DraftPage:
    """The program that SEE edits. The robot checks one version of the text at a time, and after it the latest
    version."""

    def __init__(self, question: questions.Editing, front_end: FrontEnd) -> None:
        self.name, self.text, self.row, self.dialect = question.name, question.text, question.row, question.dialect
        self._front_end = front_end
        self._latest: tuple[str, Found] | None = None
        self._looking = False

    def look(self, text: str, found: Found) -> None:
        """Let the robot check the edited program, and call `found` with the mistakes when they are known. Wait if
        another check is running."""
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
        except RequestRefused:  # there is no connection: try again when the text changes
            self._looking = False

    def save(self, text: str) -> str:
        """Store the program in the robot's memory. Return the robot's message. Raises VrsError if the robot refuses the
        text."""
        end = self._front_end.end_of(lambda id: At(id, acts.KeepDraft(text)), COMING_BACK)
        if end is not None:
            check_end(end)
        if not isinstance(end, Done) or not isinstance(end.found, acts.Kept):
            raise RequestRefused("the robot does not answer", "store it again")
        self._front_end.after()
        self.name = end.found.name
        return end.found.said
