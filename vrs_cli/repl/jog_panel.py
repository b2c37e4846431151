"""JOG on the terminal, with prompt-toolkit: keys move the arm, the lines tell where it is."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from prompt_toolkit.application import Application
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import FormattedTextControl, Layout, Window
from prompt_toolkit.patch_stdout import patch_stdout

from vrs_cli.dialogue.replies import Whereabouts
from vrs_cli.interfaces.jog.jogger import Axis, Jogger, Panel
from vrs_cli.render.text import plain_text

REFRESH = 0.04  # [s]


class Action(NamedTuple):
    """What keys do; `act` is None for those that leave."""

    keys: tuple[str, ...]
    act: Callable[[Panel], None] | None


KEYS = "up/down move   left/right, 1 to 9 axis   m joints/world/tool\n[ ] step   + - speed   space stop   q leave"
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

    def __init__(self, jogger: Jogger) -> None:
        self.panel = Panel(jogger)

    def text(self) -> str:
        """What is shown now."""
        panel = self.panel
        engine = panel.jogger.engine
        panel.jogger.settle()
        axes = "  ".join(f"[{axis.name}]" if axis == panel.axis else f" {axis.name} " for axis in self._axes())
        doing = f"moves until {engine.end:.1f} s" if engine.now < engine.end else "at rest"
        paused = ", clock paused" if engine.clock.paused else ""
        where = plain_text(Whereabouts(engine.position(), units=engine.model.units))
        return (
            f"JOG {panel.frame.value}: {axes}   step {panel.step:g} {panel.unit}, speed {panel.jogger.speed:g} %\n"
            f"t {engine.now:.2f} s{paused}, {doing}\n{where}{panel.said}\n{KEYS}"
        )

    def _axes(self) -> tuple[Axis, ...]:
        return self.panel.jogger.axes(self.panel.frame)

    def run(self) -> None:
        """Until the user leaves."""
        application: Application[None] = Application(
            layout=Layout(Window(FormattedTextControl(self.text), dont_extend_height=True, wrap_lines=True)),
            key_bindings=self._bindings(),
            refresh_interval=REFRESH,
        )
        application.ttimeoutlen = 0.05  # Esc leaves at once
        with patch_stdout(raw=True):
            application.run()

    def _bindings(self) -> KeyBindings:
        bindings = KeyBindings()
        for action in ACTIONS:
            for key in action.keys:
                bindings.add(key)(self._handler(action.act))
        return bindings

    def _handler(self, act: Callable[[Panel], None] | None) -> Callable[[KeyPressEvent], None]:
        def handle(event: KeyPressEvent) -> None:
            if act is None:
                event.app.exit()
            else:
                act(self.panel)

        return handle
