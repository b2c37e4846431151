"""Press Ctrl-X in `vrs connect` while another client defines, loads and lists a long program.

    python -m tests.net.stops 3 [LINES]

The program of one client moves the arm slowly, and that client gives the robot long work without a pause. An onlooker
at a pseudo-terminal, with a line begun, presses Ctrl-X. The figures are the times from the key until a third client is
told of the braking.
"""

from __future__ import annotations

import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from tests.by_hand import command
from tests.net.onlookers import served
from tests.net.serving import Caller
from tests.repl.ptys import Pty, shell_on_pty
from vrs_cli.net.messages import At, Delta, Hello, Line, Put, Request, Subscribe
from vrs_cli.values.acts import Define

SLOW = (".PROGRAM slow()", "SPEED 1 ALWAYS", "DO", "DRIVE 1, 100", "DRIVE 1, -100", "UNTIL FALSE", ".END")
AWAKE = 0.4  # [s] that a load has been worked at when the key is pressed


def program(lines: int) -> str:
    return "\n".join((".PROGRAM big()", *(f"  x = {number % 10}" for number in range(lines)), ".END", ""))


LOADS: dict[str, Callable[[str], Callable[[int], Request]]] = {
    "nothing": lambda _text: lambda id: Line(id, "STATUS"),
    "Define": lambda text: lambda id: At(id, Define(text, "big:")),
    "LOAD": lambda _text: lambda id: Line(id, "LOAD big"),
    "LISTP": lambda _text: lambda id: Line(id, "LISTP big"),
}


def drained(watcher: Caller, seconds: float) -> None:
    """Take what the watcher is told for so long [s]."""
    end = time.monotonic() + seconds
    with suppress(TimeoutError):
        while (left := end - time.monotonic()) > 0.0:
            watcher.protocol.receive(watcher.socket.recv(timeout=left))


def stopped_after(shell: Pty, watcher: Caller, driver: Caller, load: Callable[[int], Request]) -> float:
    """The time from the key until the watcher is told of the braking [s]."""
    driver.send(lambda id: Line(id, "EXECUTE slow"))
    watcher.until(lambda message: isinstance(message, Delta))
    over = threading.Event()

    def work() -> None:
        while not over.is_set():
            driver.ask(load)

    busy = threading.Thread(target=work, daemon=True)
    busy.start()
    shell.type("WHERE")
    drained(watcher, AWAKE)
    pressed = time.monotonic()
    shell.type("\x18")
    watcher.until(lambda message: isinstance(message, Delta))
    taken = time.monotonic() - pressed
    over.set()
    busy.join()
    shell.type("\x15")
    drained(watcher, AWAKE)
    return taken


def measure(times: int, lines: int, folder: Path) -> dict[str, list[float]]:
    """Of each load, how long each stop took [s]."""
    text, found = program(lines), dict[str, list[float]]()
    with served(folder) as address, Caller(address, Hello((1,), name="ada")) as driver:
        driver.ask(lambda id: Put(id, "big.v2", text.encode()))
        driver.lines("DISABLE INTERACTIVE", *SLOW)
        driver.ask(lambda id: At(id, Define(text, "big:")))
        watcher = Caller(address, Hello((1,), name="eve"))
        watcher.ask(lambda id: Subscribe(id, deltas=True))
        with shell_on_pty(folder, "connect", address) as shell:
            shell.until("EXIT leaves")
            for name, load in LOADS.items():
                found[name] = [stopped_after(shell, watcher, driver, load(text)) for _ in range(times)]
                print(name, *(f"{seconds * 1000:.0f} ms" for seconds in found[name]), flush=True)
    return found


def main(times: int = 3, lines: int = 180_000) -> None:
    with tempfile.TemporaryDirectory() as folder:
        measure(times, lines, Path(folder))


if __name__ == "__main__":
    command(main)
