"""JOG on the terminal, with prompt-toolkit: keys move the arm, the lines tell where it is."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING

from msgspec import Struct
from prompt_toolkit.patch_stdout import patch_stdout

from vrs_cli.engine.position import Watched
from vrs_cli.interfaces.jog.jogger import SPEEDS, STEPS
from vrs_cli.interfaces.port.far_hand import FarHand
from vrs_cli.render.text import plain_text
from vrs_cli.repl.arm_window import ArmScreen
from vrs_cli.repl.toolbar import ABORT
from vrs_cli.values.hand import CARTESIAN, Axis, Frame, Look, Press, Seen, StopJog
from vrs_cli.values.replies import Whereabouts

if TYPE_CHECKING:
    from vrs_cli.world.world import World

KEYS = f"""\
up/down move   left/right, 1 to 9 axis   m joints/world/tool
[ ] step   + - speed   space stop   {ABORT}   q leave"""


class JogPanel(Struct):
    """Draws the arm, with the axis, the length of a step [mm, deg] and the speed [%], which keys change. `watched`: the
    robot, None where nothing is seen of it; `world`: the cell around it.
    """

    hand: FarHand
    speed: float = 100.0
    watched: Watched | None = None
    abort: Callable[[], None] | None = None
    world: World | None = None
    frame: Frame = Frame.JOINT
    index: int = 0
    step: float = 2.0

    @property
    def axes(self) -> tuple[Axis, ...]:
        count = self.hand.joints if self.frame is Frame.JOINT else len(CARTESIAN)
        return tuple(Axis(self.frame, index) for index in range(count))

    @property
    def axis(self) -> Axis:
        return self.axes[self.index]

    @property
    def unit(self) -> str:
        if self.frame is Frame.JOINT:
            return self.hand.units.unit(self.index + 1)
        return "deg" if self.axis.turns else "mm"

    def look(self) -> Seen:
        return self.hand.do(Look())

    def move(self, sign: float) -> None:
        self.hand.do(Press(self.axis, sign * self.step, self.speed))

    def stop(self) -> None:
        self.hand.do(StopJog())

    def choose(self, index: int) -> None:
        """Choose an axis by its number from 0; a number without an axis has no effect."""
        if 0 <= index < len(self.axes):
            self.index = index

    def next_axis(self, by: int) -> None:
        self.index = (self.index + by) % len(self.axes)

    def next_frame(self) -> None:
        frames = list(Frame)
        self.frame = frames[(frames.index(self.frame) + 1) % len(frames)]
        self.index = min(self.index, len(self.axes) - 1)

    def longer(self, by: int) -> None:
        self.step = _neighbour(STEPS, self.step, by)

    def faster(self, by: int) -> None:
        self.speed = _neighbour(SPEEDS, self.speed, by)

    def text(self) -> str:
        """Return the lines below the picture."""
        seen = self.look()
        now = seen.position.time
        axes = "  ".join(f"[{axis.name}]" if axis == self.axis else f" {axis.name} " for axis in self.axes)
        doing = f"moves until {seen.end:.1f} s" if now < seen.end else "at rest"
        paused = ", clock paused" if seen.paused else ""
        where = plain_text(Whereabouts(seen.position, units=self.hand.units))
        return (
            f"JOG {self.frame.value}: {axes}   step {self.step:g} {self.unit}, speed {self.speed:g} %\n"
            f"t {now:.2f} s{paused}, {doing}\n{where}{seen.said}\n{KEYS}"
        )

    def screen(self) -> ArmScreen:
        """Return the application that shows the panel."""
        actions = {key: partial(act, self) for key, act in ACTIONS.items()} | dict.fromkeys(LEAVING)
        return ArmScreen(self.watched, None, self.text, actions, abort=self.abort, world=self.world)

    def run(self) -> None:
        """Show the panel until the user leaves."""
        with patch_stdout(raw=True):
            self.screen().run()


def _neighbour(row: Iterable[float], value: float, by: int) -> float:
    """The next greater or smaller one of a row, or the value where there is none."""
    choose: Callable[..., float] = min if by > 0 else max
    return choose((one for one in row if (one - value) * by > 0), default=value)


ACTIONS: Mapping[str, Callable[[JogPanel], None]] = {
    **dict.fromkeys(("up", "k"), lambda panel: panel.move(1.0)),
    **dict.fromkeys(("down", "j"), lambda panel: panel.move(-1.0)),
    **dict.fromkeys(("right", "l", "tab"), lambda panel: panel.next_axis(1)),
    **dict.fromkeys(("left", "h", "s-tab"), lambda panel: panel.next_axis(-1)),
    "m": JogPanel.next_frame,
    **dict.fromkeys(("]", ">"), lambda panel: panel.longer(1)),
    **dict.fromkeys(("[", "<"), lambda panel: panel.longer(-1)),
    **dict.fromkeys(("+", "="), lambda panel: panel.faster(1)),
    "-": lambda panel: panel.faster(-1),
    "space": JogPanel.stop,
    **{str(digit): partial(JogPanel.choose, index=digit - 1) for digit in range(1, 10)},
}
LEAVING = ("q", "escape", "c-c", "c-d")
