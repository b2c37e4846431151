"""A robot that is served, in Python: the same object as one of this process."""

from __future__ import annotations

import logging
import os
from pathlib import Path

from vrs_cli.api.location import Units
from vrs_cli.api.robot import Robot
from vrs_cli.errors import told_in_python
from vrs_cli.net.client import hello_of
from vrs_cli.net.mirror import WINDOW
from vrs_cli.net.socket_port import SocketPort

TOKEN = "VRS_TOKEN"  # the variable of the environment

log = logging.getLogger("vrs_cli")


def connect(
    url: str,
    *,
    token: str | None = None,
    name: str = "",
    units: str | Units = Units.VAL,
    ca: str | Path | None = None,
    behind: float = 0.0,
    window: float = WINDOW,
) -> Robot:
    """The robot at an address: `ws://HOST:PORT`, `ws://HOST:PORT/robots/NAME` for one of several, or `wss://`.

    `token`: what the server knows you by (the variable VRS_TOKEN, where none is given); `name`: what others see you
    called, where tokens do not say that; `ca`: the certificate of the server, or of who signed it;
    `behind`: a motion `at=t` begins so many seconds after t, so that what takes no longer to arrive is never too late;
    `window`: so many seconds of the robot's past are kept here, `math.inf` for all of it; the server is asked for what
    was before.

    After a cut it connects again by itself, which is told to the logger "vrs_cli"; what is asked meanwhile is refused.
    Raises NotPossible for what is no address, RequestRefused where no robot answers, and what the server refuses.
    """
    with told_in_python():
        return Robot.of(_port(url, token, name, ca, behind, window), units)


def _port(url: str, token: str | None, name: str, ca: str | Path | None, behind: float, window: float) -> SocketPort:
    hello = hello_of(os.environ.get(TOKEN, "") if token is None else token, name=name, behind=behind)
    return SocketPort.connect(url, hello, ca=None if ca is None else Path(ca), window=window, told=log.warning)
