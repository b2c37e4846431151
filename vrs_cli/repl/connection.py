"""Run the shell with a robot behind a connection: carry out its slash commands (/who, /ask, /give, /release), and show
messages about the connection and the lease (the right to drive the robot)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress

from msgspec import Struct

from vrs_cli.errors import RequestRefused
from vrs_cli.interfaces import dialogue, users
from vrs_cli.interfaces.port.port import Port
from vrs_cli.net.messages import Announced, At, Drive, Lease, LeaseAct, LessonText, Present, ServerMessage, Welcome, Who
from vrs_cli.repl.front_end import FrontEnd
from vrs_cli.repl.shell import BANNER
from vrs_cli.values.acts import Attend

WORDS = "/who is there and drives, /ask to drive, /give NAME lets another drive, /release lets anybody; all may ABORT"


class Remote(Struct):
    """A robot behind an open connection. `notify`: called with each message about the connection."""

    port: Port
    notify: Callable[[str], None]

    remote = lives = waits = True
    banner = BANNER

    def front_end(self, terminal: dialogue.Terminal) -> FrontEnd:
        return ConnectionWords(FrontEnd(terminal, self.port, self.notify)).front_end


class ConnectionWords:
    """The slash commands of a shell with a remote robot, and the display of messages about its connection."""

    def __init__(self, front_end: FrontEnd) -> None:
        self.front_end, self._port, self._notify = front_end, front_end.port, front_end.notify
        self._attended = front_end.terminal.attended
        front_end.own_lines.append(self.take)
        front_end.hear_connection, front_end.opening = self.hear, self._begin

    def _begin(self) -> None:
        """On a terminal, send a first request: its answer brings the state that the prompt shows. Then show the slash
        commands and the name of the user who drives."""
        if self._attended:
            self.front_end.answer()
            if not self._port.one_user:
                self._notify(WORDS)
            if driver := self._port.status().driver:
                self._notify(self._driver_text(driver))

    def take(self, text: str) -> bool:
        """Carry out a line if it begins with a slash. Return whether it does."""
        if not text.startswith("/"):  # it is a line of VAL-II, where no line begins with a slash
            return False
        words = text[1:].split()
        match [words[0].lower() if words else "", *words[1:]]:
            case ["who"]:
                found = self.front_end.end_of(Who)
                if isinstance(found, Present):
                    self._notify(f"there are {', '.join(found.holders)}; {self._driver_text(found.driver)}")
            case [("ask" | "release") as act]:
                self.front_end.do(lambda id: Drive(id, LeaseAct(act)))
            case ["give", to]:
                self.front_end.do(lambda id: Drive(id, LeaseAct.GIVE, to))
            case _:
                self._notify(WORDS)
        return True

    def hear(self, message: ServerMessage) -> None:
        """Show a message about the connection: it was restored, the lease changed, or a lesson or a teacher sent a
        message."""
        match message:
            case Welcome(resumed=resumed):
                if not resumed:
                    self.front_end.forget_questions()
                self._notify("connected again")
                if self._attended:
                    with suppress(RequestRefused):  # ask for the state that the prompt shows
                        self.front_end.begin(lambda id: At(id, Attend()), self.front_end.receive)
            case LessonText(text) | Announced(text=text):
                by = f"{message.by}: " if isinstance(message, Announced) else ""
                self._notify(by + "".join(one for one in text if one.isprintable() or one == "\n"))
            case Lease(holder, notice) if self._attended:
                text = users.notice_text(notice, self._port.name) or self._driver_text(holder)
                if isinstance(notice, users.Requested) and notice.of == self._port.name:
                    text += f": /give {notice.by}"
                self._notify(text)

    def _driver_text(self, driver: str) -> str:
        return f"{driver or 'nobody'} drives" if driver != self._port.name else "you drive"
