"""Keep programs of somebody else from the network and from other processes."""

from __future__ import annotations

import sys

REFUSED = ("socket.", "subprocess.", "os.exec", "os.fork", "os.posix_spawn", "os.spawn", "os.startfile", "os.system")


class Isolation:
    """While it is entered, this process opens no connection and starts no other process: Python asks before it does
    (`sys.audit`). A hook stays for ever, so there is one.
    """

    hooked = entered = False

    def __enter__(self) -> None:
        if not Isolation.hooked:
            sys.addaudithook(self._check)
        Isolation.hooked = Isolation.entered = True

    def __exit__(self, *_error: object) -> None:
        Isolation.entered = False

    @staticmethod
    def _check(event: str, _arguments: object) -> None:
        if Isolation.entered and event.startswith(REFUSED):
            raise PermissionError(f"a program of somebody else: {event} is not for this run")
