"""A robot of this process, served to its own windows: what they hold is the same as over the network."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

from vrs_cli.kinematics.model import RobotModel
from vrs_cli.language.run.signals import Cell
from vrs_cli.net.audit import Audit
from vrs_cli.net.client import Client, hello_of
from vrs_cli.net.limits import UNMEASURED, Allowance
from vrs_cli.net.mirror import WINDOW
from vrs_cli.net.room import Hub, RobotFolders
from vrs_cli.net.served_robot import Plan
from vrs_cli.net.server import ListenAddress, Server
from vrs_cli.net.socket_port import Loop, SocketPort
from vrs_cli.net.tokens import TokenFile, add_tokens

BROWSER, SHELL = "browser", "shell"  # who holds it, as all see them called
OPENING = 10.0  # [s] until it listens


class Hosted:
    """Serves one robot on a free port of this machine. `url` and `tokens`, by who they are for, are what it takes to
    hold it; who does is one user, and does not have to let himself drive. `folder`: its files; `rate`: seconds of its
    time in one second, None for virtual time; `cell`: what is around it. `session` is changed in the robot's thread
    alone: `session.actor.call`.
    """

    def __init__(
        self,
        model: RobotModel,
        *,
        rate: float | None = 1.0,
        folder: Path | None = None,
        cell: Cell | None = None,
        tell: Callable[[str], None] = lambda _text: None,
    ) -> None:
        self._left = ExitStack()
        try:
            here = Path(self._left.enter_context(TemporaryDirectory(prefix="vrs-")))
            self.tokens = add_tokens(here / "tokens.toml", (BROWSER, SHELL))
            allowance = Allowance(folder=UNMEASURED)
            audit = Audit(None, time.time, tell)
            server = Server(
                ListenAddress("127.0.0.1", 0), allowance, audit, TokenFile(here / "tokens.toml", (model.name,)), tell
            )
            plan = Plan(model, folder or here, realtime=rate, allowance=allowance, one_user=True, cell=cell)
            hub = Hub(
                {model.name: model}, RobotFolders(None, folder or here, only=True), plan, audit, server.wake, tell
            )
            hub.open_all()
            self._left.callback(hub.close)
            self.session = hub.rooms[model.name].session
            self.url = self._served(server, hub)
        except BaseException:
            self._left.close()
            raise

    def _served(self, server: Server, hub: Hub) -> str:
        loop, stop, address = Loop(), asyncio.Event(), asyncio.Queue[str]()
        self._left.callback(loop.close)
        running = loop.begin(server.run(hub, address.put_nowait, stop))
        self._left.callback(running.result, OPENING)
        self._left.callback(loop.soon, stop.set)
        return f"{loop.wait(address.get(), OPENING)}/robots/{next(iter(hub.rooms))}"

    def hold(self, told: Callable[[str], None] = lambda _text: None, *, who: str = BROWSER) -> SocketPort:
        """Take hold of it. Raises RequestRefused."""
        hello = hello_of(self.tokens[who], attended=who == BROWSER)
        return SocketPort.connect(self.url, hello, told=told, window=WINDOW)

    def client(self, *, attended: bool) -> Client:
        """A client for a shell, which is to be opened."""
        return Client(self.url, hello_of(self.tokens[SHELL], attended=attended))

    def close(self) -> None:
        """Nobody holds it any more; its files stay in their folder."""
        self._left.close()
