"""SHOW while the arm moves, with prompt-toolkit: the picture of now, until the arm stands or a key is pressed."""

from __future__ import annotations

from collections.abc import Callable

from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.patch_stdout import patch_stdout

from vrs_cli.engine.position import Watched, position_at
from vrs_cli.interfaces.monitor.showing import Sight
from vrs_cli.render.text import plain_text
from vrs_cli.repl.arm_window import ArmScreen
from vrs_cli.repl.toolbar import ABORT
from vrs_cli.values.replies import ArmPicture, Whereabouts

STANDS = 1.0  # [s] after its last motion the arm is believed to be at rest
KEYS = f"{ABORT}   any other key ends the picture, not the motion"


class Live:
    """`keep_up` lets happen what is due; `abort` stops the robot."""

    def __init__(self, watched: Watched, keep_up: Callable[[], None], abort: Callable[[], None]) -> None:
        self._watched, self._keep_up, self._abort = watched, keep_up, abort
        self._sight = Sight(watched.arm)

    def run(self) -> None:
        """Until the user leaves, or there is nothing more to be seen."""
        with patch_stdout(raw=True):
            self.screen().run()

    def screen(self) -> ArmScreen:
        return ArmScreen(self._picture, self.text, _bindings(), self._over, self._abort)

    def text(self) -> str:
        """What is told below the picture."""
        watched = self._watched
        at = position_at(watched.arm, watched.timeline, watched.now)
        doing = at.text or "moving" if at.moving else "at rest"
        return f"t {at.time:.2f} s, {doing}\n{plain_text(Whereabouts(at, units=watched.arm.model.units))}{KEYS}"

    def _picture(self) -> ArmPicture:
        return self._sight.picture(self._watched.timeline, self._watched.now)

    def _over(self) -> bool:
        self._keep_up()
        return self._watched.now > self._watched.timeline.end + STANDS


def _bindings() -> KeyBindings:
    bindings = KeyBindings()

    @bindings.add("<any>")
    def leave(event: KeyPressEvent) -> None:
        event.app.exit()

    return bindings
