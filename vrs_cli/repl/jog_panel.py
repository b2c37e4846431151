"""JOG on the terminal, with prompt-toolkit: keys move the arm, the lines tell where it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.patch_stdout import patch_stdout

from vrs_cli.engine.position import Watched
from vrs_cli.interfaces.jog.jogger import JogArm, JogKeys
from vrs_cli.interfaces.monitor.showing import Sight
from vrs_cli.render.text import plain_text
from vrs_cli.repl.arm_window import ArmScreen
from vrs_cli.repl.toolbar import ABORT
from vrs_cli.values.replies import ArmPicture, Whereabouts


class Action(NamedTuple):
    """What keys do; `act` is None for those that leave."""

    keys: tuple[str, ...]
    act: Callable[[JogKeys], None] | None


KEYS = f"""\
up/down move   left/right, 1 to 9 axis   m joints/world/tool
[ ] step   + - speed   space stop   {ABORT}   q leave"""
ACTIONS: tuple[Action, ...] = (
    Action(("up", "k"), lambda panel: panel.move(1.0)),
    Action(("down", "j"), lambda panel: panel.move(-1.0)),
    Action(("right", "l", "tab"), lambda panel: panel.next_axis(1)),
    Action(("left", "h", "s-tab"), lambda panel: panel.next_axis(-1)),
    Action(("m",), lambda panel: panel.next_frame()),
    Action(("]", ">"), lambda panel: panel.longer(1)),
    Action(("[", "<"), lambda panel: panel.longer(-1)),
    Action(("+", "="), lambda panel: panel.faster(1)),
    Action(("-",), lambda panel: panel.faster(-1)),
    Action(("space",), lambda panel: panel.stop()),
    Action(("q", "escape", "c-c", "c-d"), None),
    *(Action((str(digit),), lambda panel, index=digit - 1: panel.choose(index)) for digit in range(1, 10)),  # type: ignore[misc]
)


class JogPanel:
    """Holds the panel and draws it."""

    def __init__(
        self,
        hand: JogArm,
        speed: float = 100.0,
        watched: Watched | None = None,
        abort: Callable[[], None] | None = None,
    ) -> None:
        self.panel, self._watched, self._abort = JogKeys(hand, speed=speed), watched, abort

    def text(self) -> str:
        """What is shown now."""
        panel, seen = self.panel, self.panel.look()
        now = seen.position.time
        axes = "  ".join(f"[{axis.name}]" if axis == panel.axis else f" {axis.name} " for axis in panel.axes)
        doing = f"moves until {seen.end:.1f} s" if now < seen.end else "at rest"
        paused = ", clock paused" if seen.paused else ""
        where = plain_text(Whereabouts(seen.position, units=panel.hand.units))
        return (
            f"JOG {panel.frame.value}: {axes}   step {panel.step:g} {panel.unit}, speed {panel.speed:g} %\n"
            f"t {now:.2f} s{paused}, {doing}\n{where}{seen.said}\n{KEYS}"
        )

    def run(self) -> None:
        """Until the user leaves."""
        with patch_stdout(raw=True):
            ArmScreen(self.picture(), self.text, self._bindings(), abort=self._abort).run()

    def picture(self) -> Callable[[], ArmPicture] | None:
        """The arm now; None where nothing is seen of it."""
        watched = self._watched
        if watched is None:
            return None
        sight = Sight(watched.arm)
        return lambda: sight.picture(watched.timeline, watched.now)

    def _bindings(self) -> KeyBindings:
        bindings = KeyBindings()
        for action in ACTIONS:
            for key in action.keys:
                bindings.add(key)(self._handler(action.act))
        return bindings

    def _handler(self, act: Callable[[JogKeys], None] | None) -> Callable[[KeyPressEvent], None]:
        def handle(event: KeyPressEvent) -> None:
            if act is None:
                event.app.exit()
            else:
                act(self.panel)

        return handle
