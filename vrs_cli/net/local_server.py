"""Run a server in this process for one local user: it serves a robot of this process, or only pages."""

from __future__ import annotations

import asyncio
import os
import secrets
import time
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import quote, urlsplit

from msgspec import Struct, structs

from vrs_cli.errors import UsageError
from vrs_cli.interfaces.session.acts import act_on
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.language.run.signals import Cell
from vrs_cli.net.client import LOOPBACK, Client, hello_of, reason_of
from vrs_cli.net.durable_log import Audit
from vrs_cli.net.http import VIEW, ServedPage
from vrs_cli.net.limits import UNMEASURED, Allowance
from vrs_cli.net.mirror import WINDOW
from vrs_cli.net.relay import Relay
from vrs_cli.net.room import Hub, RobotFolders
from vrs_cli.net.served_robot import Plan
from vrs_cli.net.server import NO_RELAYS, ListenAddress, Server
from vrs_cli.net.socket_port import Loop, SocketPort
from vrs_cli.net.tokens import TokenFile, digest_of
from vrs_cli.values.acts import Define
from vrs_cli.values.replies import Reply, StyledLine

BROWSER, SHELL = "browser", "shell"  # the client names that users of a local robot see
STARTING = 10.0  # [s] maximum time until the server listens
HERE = ListenAddress("127.0.0.1", 0)


class PagePlace(Struct, frozen=True):
    """The listening address of a page, the secret that opens it, and its files."""

    address: ListenAddress
    secret: str
    pages: ServedPage

    def at_port(self, port: int) -> PagePlace:
        return structs.replace(self, address=structs.replace(self.address, port=port))


def new_secret() -> str:
    """Return a new random secret."""
    return secrets.token_urlsafe(18)


def kept_secret(file: Path) -> str:
    """Return the secret in a file that only its owner may read. Create the file if it does not exist; if that fails,
    return a new secret."""
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        with suppress(FileExistsError), open(os.open(file, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600), "w") as made:
            made.write(new_secret())
        return file.read_text().strip() or new_secret()
    return new_secret()


def checked_host(host: str) -> str:
    """Return the listening address for a host. Raises UsageError if other machines could reach it."""
    if host not in LOOPBACK:
        raise UsageError(
            f"--host {host}: the page is for this machine alone, as whoever opens it may drive the robot",
            "others watch with vrs serve and vrs view ws://HOST, or over ssh -L",
        )
    return HERE.host if host == "localhost" else host  # a name may have two addresses, each with a free port


class LocalServer:
    """A server in a separate thread, for one user. `place`: the address and files of its page; None: any free port and
    no page. `tokens`: the tokens of the browser (the page's secret) and of the shell. `relays`: as for `Server`. Raises
    UsageError if the address is in use."""

    def __init__(
        self,
        place: PagePlace | None = None,
        *,
        relays: Mapping[str, Relay] = NO_RELAYS,
        robots: Mapping[str, RobotModel] | None = None,
        plan: Plan | None = None,
        tell: Callable[[str], None] = lambda _text: None,
    ) -> None:
        self._left, address = ExitStack(), HERE if place is None else place.address
        secret, pages = ("", None) if place is None else (place.secret, place.pages)
        try:
            self.folder = Path(self._left.enter_context(TemporaryDirectory(prefix="vrs-")))
            self.tokens = {BROWSER: secret or new_secret(), SHELL: new_secret()}
            rows = (f'[[token]]\nname = "{name}"\nsha256 = "{digest_of(it).hex()}"' for name, it in self.tokens.items())
            tokens = self.folder / "tokens.toml"
            tokens.write_text("\n".join(rows))
            robots, allowance, audit = robots or {}, Allowance(folder=UNMEASURED), Audit(None, time.time, tell)
            server = Server(address, allowance, audit, TokenFile(tokens, robots), tell, pages, relays)
            plan = plan or Plan(load_robot("puma560"), self.folder)
            self.hub = Hub(robots, RobotFolders(None, plan.folder, only=True), plan, audit, server.wake, tell)
            self.hub.open_all()
            self._left.callback(self.hub.close)
            self._prepare()
            self.address = self._start(server, address)
            self.port = urlsplit(self.address).port or 0
        except BaseException:
            self._left.close()
            raise

    def _prepare(self) -> None:
        """Prepare the robots before clients can connect. Subclasses override this method."""

    def _start(self, server: Server, place: ListenAddress) -> str:
        loop, stop, address = Loop(), asyncio.Event(), asyncio.Queue[str | OSError]()
        self._left.callback(loop.close)

        async def run() -> None:
            try:
                await server.run(self.hub, address.put_nowait, stop)
            except OSError as error:
                address.put_nowait(error)

        running = loop.begin(run())
        self._left.callback(running.result, STARTING)
        self._left.callback(loop.soon, stop.set)
        found = loop.wait(address.get(), STARTING)
        if isinstance(found, OSError):
            raise UsageError(f"{place.host}:{place.port}: {reason_of(found)}", "name another --port")
        return found

    def page(self, name: str, query: str = "") -> str:
        """Return the address of a robot's page, with the secret."""
        return (
            f"{self.address.replace('ws', 'http', 1)}{VIEW}{quote(name, safe='')}{query}#token={self.tokens[BROWSER]}"
        )

    def close(self) -> None:
        """Stop serving. Files in a folder that the user named are kept."""
        self._left.close()


class LocalRobot(LocalServer):
    """A local server of one robot. `name`: the robot's name; if empty, the name of its model. `folder`: the folder of
    its files; None: a temporary folder. `url`, `tokens`: for clients, who are all one user and need no lease. `rate`:
    seconds of the robot's clock per second; None: virtual time. `cell`: the cell around the robot. `program`: programs
    to load; `runs`: the first page to connect executes the first of these programs. `styled`: as for `Plan`. Change
    `session` only in the robot's thread, with `session.actor.call`. Raises the error of a program that cannot be
    loaded."""

    def __init__(
        self,
        model: RobotModel,
        place: PagePlace | None = None,
        *,
        name: str = "",
        rate: float | None = 1.0,
        folder: Path | None = None,
        cell: Cell | None = None,
        program: Define | None = None,
        runs: bool = True,
        styled: Callable[[Reply, int], Iterable[StyledLine]] = lambda _reply, _columns: (),
        tell: Callable[[str], None] = lambda _text: None,
    ) -> None:
        self.name = name or model.name
        own = ExitStack()
        here = folder or Path(own.enter_context(TemporaryDirectory(prefix="vrs-")))
        plan = Plan(
            model,
            here,
            realtime=rate,
            allowance=Allowance(folder=UNMEASURED),
            one_user=True,
            cell=cell,
            styled=styled,
        )
        self._program, self._runs = program, runs
        with own:
            super().__init__(place, robots={self.name: model}, plan=plan, tell=tell)
            self._left.push(own.pop_all())
        self.session = self.hub.rooms[self.name].session
        self.url = f"{self.address}/robots/{quote(self.name, safe='')}"

    def _prepare(self) -> None:
        (room,) = self.hub.rooms.values()
        if self._program is not None:
            names = room.session.actor.submit(act_on(room.session, self._program)).result().names
            room.first_line = f"EXECUTE {names[0]}" if names and self._runs else ""

    def hold(self, notify: Callable[[str], None] = lambda _text: None, *, who: str = BROWSER) -> SocketPort:
        """Return a new port to the robot, for the client `who`. Raises RequestRefused."""
        hello = hello_of(self.tokens[who], attended=who == BROWSER)
        return SocketPort.connect(self.url, hello, notify=notify, window=WINDOW)

    def client(self, *, attended: bool) -> Client:
        """Return a client for a shell; the caller opens it."""
        return Client(self.url, hello_of(self.tokens[SHELL], attended=attended))
