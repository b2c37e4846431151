"""People at one robot that is served, each at a terminal of his own: what a page shows of them is what they see."""

from __future__ import annotations

import io
from contextlib import ExitStack
from pathlib import Path

from msgspec.structs import replace

from tests.net.serving import serving
from vrs_cli.net.client import Client, hello_of
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.repl.connection import Remote
from vrs_cli.repl.loop import PlainTerminal


class Terminal(PlainTerminal):
    """Somebody is there."""

    attended = True


class Person:
    """`seen`: what is on the terminal, with what stderr tells of the connection."""

    def __init__(self, address: str, name: str) -> None:
        self.seen = io.StringIO()
        hello = replace(hello_of(name=name), attended=True)
        connection = SocketPort(Client(address, hello, notify=self._told))
        self.front_end = Remote(connection, self._told).front_end(Terminal(self.seen, iter(())))
        self.front_end.opening()

    def _told(self, text: str) -> None:
        self.seen.write(f"vrs connect: {text}\n")

    def look_up(self) -> None:
        """What has happened so far is seen: a look at a line has its answer after all that."""
        self.front_end.suggestions("WHERE", True)
        self.front_end.keep_up()

    def leave(self) -> None:
        self.front_end.closing()


class People:
    """A server with one robot, and who has come to it."""

    def __init__(self, folder: Path) -> None:
        self._stack, self._folder = ExitStack(), folder
        self._address = ""
        self._people: dict[str, Person] = {}

    def person(self, name: str) -> Person:
        if not self._address:
            self._address = self._stack.enter_context(serving(self._folder, ("cell1",), journal=False)).address
        if name not in self._people:
            self._people[name] = Person(self._address, name)
        return self._people[name]

    def close(self) -> None:
        for person in self._people.values():
            person.leave()
        self._stack.close()
