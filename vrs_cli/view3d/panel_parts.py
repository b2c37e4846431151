"""Building blocks of panels."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from typing import Any

import viser

from vrs_cli.view3d.placing import put

Act = Callable[[], object]
ON, OFF = "\N{BLACK CIRCLE}", "\N{WHITE CIRCLE}"  # lamps
STYLE = (
    "<style>.vrs pre{margin:0;white-space:pre-wrap;font:inherit}.vrs table{font:inherit;border-spacing:0}"
    ".vrs td,.vrs th{padding:0 0 0 0.7em}</style>"
)


class Hands:
    """Does what is typed and clicked in one browser, in order, in a thread of its own. `refused` is told what goes
    wrong.
    """

    def __init__(self, refused: Callable[[Exception], None]) -> None:
        self._refused = refused
        self._thread = ThreadPoolExecutor(1, "vrs panel")
        self._loop: asyncio.AbstractEventLoop | None = None  # in which the page is heard, once it has said something

    def do(self, act: Act) -> None:
        def guarded() -> None:
            try:
                act()
            except Exception as error:
                self._refused(error)

        with suppress(RuntimeError):  # the browser has gone
            self._thread.submit(guarded)

    def on(self, handle: Any, act: Callable[[Any], object]) -> None:
        """Have what a user does with an input done: `act` is given its value."""

        async def changed(event: viser.GuiEvent[Any]) -> None:
            value, self._loop = event.target.value, asyncio.get_running_loop()
            self.do(lambda: act(value))

        hears = next(name for name in ("on_click", "on_upload", "on_update") if hasattr(handle, name))
        getattr(handle, hears)(changed)

    def fill(self, field: Any, text: str) -> None:
        """Have a text in a field in which a user may be typing: never between what he types and its being heard."""
        if self._loop is None:
            put(field, value=text)
            return
        with suppress(RuntimeError):  # the page has gone
            self._loop.call_soon_threadsafe(lambda: put(field, value=text))

    def close(self) -> None:
        self._thread.shutdown(wait=False, cancel_futures=True)


class OneOf:
    """Buttons of which the one that was pressed last is lit, the first at first; `act` is given its name."""

    def __init__(
        self, gui: viser.GuiApi, hands: Hands, label: str, names: Sequence[str], act: Callable[[str], object]
    ) -> None:
        self._names, self._act = names, act
        self._handle = gui.add_button_group(label, self._lamps(names[0]))
        hands.on(self._handle, self._choose)

    def _choose(self, pressed: str) -> None:
        name = pressed.removeprefix(ON).removeprefix(OFF).strip()
        put(self._handle, options=self._lamps(name))
        self._act(name)

    def _lamps(self, lit: str) -> tuple[str, ...]:
        return tuple(f"{ON if name == lit else OFF} {name}" for name in self._names)


def boxed(content: str) -> str:
    """HTML in the letters of a terminal."""
    return f'{STYLE}<div class="vrs" style="font:12px/1.35 monospace;padding:0 0.8em 0.6em">{content}</div>'
