"""Show and move a robot on the terminal with prompt-toolkit: play a trajectory (REPLAY), watch a robot that others
move, show the arm until it is at rest (SHOW), and move it by keys (JOG)."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct
from prompt_toolkit.patch_stdout import patch_stdout

from vrs_cli.engine.position import Watched, position_at
from vrs_cli.interfaces.jog.jogger import SPEEDS, STEPS
from vrs_cli.interfaces.port.port import FarHand
from vrs_cli.interfaces.roles.playback import Playback
from vrs_cli.interfaces.roles.supervisor import RecordedRobot
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.render.text import plain_text
from vrs_cli.repl import arm_window, prompt
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.hand import CARTESIAN, Axis, Frame, Look, Press, Seen, StopJog
from vrs_cli.values.replies import Whereabouts

if TYPE_CHECKING:
    from vrs_cli.world.course import World


BAR = 30  # [characters] length of the progress bar
SKIP, FAR_SKIP = 1.0, 10.0  # [s] steps through time for the keys left/right and pgup/pgdn
STANDS = 1.0  # [s] SHOW ends this long after the end of the last motion


class Action(NamedTuple):
    """The effect of some keys. `shown`: the keys' text on the screen. `change`: returns the playback after the key at a
    wall clock's reading [s]; None for keys that leave the player. `live`: whether the keys work only for a robot that
    is watched while it moves."""

    keys: tuple[str, ...]
    shown: str
    change: Callable[[Playback, float], Playback] | None
    live: bool = False


PLAYER_ACTIONS: tuple[Action, ...] = (
    Action(("space", "p"), "space pause", lambda p, wall: p.toggle(wall)),
    Action(("left",), "left/right 1 s", lambda p, wall: p.skip(-SKIP, wall)),
    Action(("right",), "", lambda p, wall: p.skip(SKIP, wall)),
    Action(("pageup",), "pgup/pgdn 10 s", lambda p, wall: p.skip(-FAR_SKIP, wall)),
    Action(("pagedown",), "", lambda p, wall: p.skip(FAR_SKIP, wall)),
    Action(("home", "r"), "r rewind", lambda p, wall: p.rewind(wall)),
    Action(("end", "e"), "e end", lambda p, wall: p.seek(p.end, wall)),
    Action(("f",), "f follow", lambda p, wall: p.follow(wall), live=True),
    Action(("+", "="), "+/- rate", lambda p, wall: p.faster(wall)),
    Action(("-",), "", lambda p, wall: p.slower(wall)),
    Action(("q", "escape", "c-c", "c-d"), "q quit", None),
)


class Player(Struct):
    """The screen that plays a robot's trajectory. `watched`: the robot. `playback`: the shown time, its rate and its
    end. `wall`: returns the wall clock's reading [s]. `news`: returns more lines about a shown time [s], such as who
    drives the robot.

    `live`: whether others move the robot. `passes`: returns whether the robot's clock runs in real time. `abort`: stops
    a robot that others move. `world`: the robot's cell (parts, fixtures, sensors).
    """

    watched: Watched
    playback: Playback
    wall: Callable[[], float] = time.monotonic
    news: Callable[[float], str] = lambda _t: ""
    live: bool = False
    passes: Callable[[], bool] = lambda: False
    abort: Callable[[], object] | None = None
    world: World | None = None

    def text(self) -> str:
        """Update the playback, and return the text below the picture."""
        wall, watched = self.wall(), self.watched
        timeline = watched.timeline
        self.playback = self.playback.look(wall, timeline.start, timeline.end, watched.now)
        if self.playback.follows and self.playback.playing and self.passes():
            self.playback = self.playback.follow(wall)  # the robot's clock may have been corrected since the last look
        playback, t = self.playback, self.playback.at(wall)
        length = playback.end - playback.start
        done = round(BAR * (t - playback.start) / length) if length > 0.0 else BAR
        times = f"{t:8.2f} / {playback.end:.2f} s   {playback.state_text(wall)}, rate {playback.rate:g}"
        position = position_at(watched.arm, timeline, t)
        where = plain_text(Whereabouts(position, units=watched.arm.model.units))
        lines = (f"[{'#' * done:-<{BAR}}] {times}", self.news(t), position.text if position.moving else "at rest")
        shown = [action.shown for action in self._actions() if action.shown]
        rows = (shown[:-3], [*shown[-3:], prompt.ABORT]) if self.live else (shown,)
        keys = "\n".join("  ".join(row) for row in rows)
        return "\n".join(line for line in lines if line) + f"\n{where}{keys}"

    def _actions(self) -> list[Action]:
        return [action for action in PLAYER_ACTIONS if self.live or not action.live]

    def screen(self) -> arm_window.ArmScreen:
        """Return the screen, which plays on the terminal until the user leaves."""
        keys = {key: action.change for action in self._actions() for key in action.keys}
        actions = {key: None if change is None else partial(self._change, change) for key, change in keys.items()}
        return arm_window.ArmScreen(
            self.watched,
            lambda: self.playback.at(self.wall()),
            self.text,
            actions,
            abort=self.abort,
            world=self.world,
        )

    def _change(self, change: Callable[[Playback, float], Playback]) -> None:
        self.playback = change(self.playback, self.wall())


def play(arm: RobotArm, timeline: Timeline, rate: float, world: World | None = None) -> None:
    """Play a trajectory on the terminal from its start, at `rate` seconds of the trajectory per second."""
    playback = Playback.of(timeline.start, timeline.end, rate, time.monotonic())
    Player(RecordedRobot(arm, timeline), playback, world=world).screen().run()


async def watch(
    watched: Watched,
    news: Callable[[float], str],
    passes: Callable[[], bool],
    abort: Callable[[], object],
    world: World | None = None,
) -> None:
    """Show a robot that others move, starting at its current time, until the user leaves. `news`: returns more lines
    about a shown time [s]. `passes`: returns whether the robot's clock runs in real time. `abort`: stops the robot."""
    timeline = watched.timeline
    playback = Playback.begin_live(timeline.start, timeline.end, watched.now, time.monotonic())
    player = Player(watched, playback, news=news, live=True, passes=passes, abort=abort, world=world)
    await player.screen().run_async()


def show_motion(
    watched: Watched, keep_up: Callable[[], None], abort: Callable[[], None], world: World | None = None
) -> None:
    """Show the arm as it moves (SHOW), until it is at rest or a key is pressed.

    `keep_up`: carries out due actions. `abort`: stops the robot. `world`: the robot's cell (parts, fixtures, sensors).
    """

    def text() -> str:
        at = position_at(watched.arm, watched.timeline, watched.now)
        doing = at.text or "moving" if at.moving else "at rest"
        where = plain_text(Whereabouts(at, units=watched.arm.model.units))
        return f"t {at.time:.2f} s, {doing}\n{where}{prompt.ABORT}   any other key ends the picture, not the motion"

    def over() -> bool:
        keep_up()
        return watched.now > watched.timeline.end + STANDS

    with patch_stdout(raw=True):
        arm_window.ArmScreen(watched, None, text, {"<any>": None}, over, abort, world).run()


JOG_KEYS = f"""\
up/down move   left/right, 1 to 9 axis   m joints/world/tool
[ ] step   + - speed   space stop   {prompt.ABORT}   q leave"""


class JogPanel(Struct):
    """The screen of JOG: the arm, and the axis, step length [mm, deg] and speed [%], which keys change. `hand`: moves
    the arm. `watched`: the robot for the picture, None for no picture. `index`: the chosen axis, from 0. `world`: the
    robot's cell."""

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
        """Choose an axis by its index, from 0. An index that no axis has is ignored."""
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
            f"t {now:.2f} s{paused}, {doing}\n{where}{seen.said}\n{JOG_KEYS}"
        )

    def screen(self) -> arm_window.ArmScreen:
        """Return the screen that shows the panel."""
        actions = {key: partial(act, self) for key, act in JOG_ACTIONS.items()}
        leaving = dict.fromkeys(("q", "escape", "c-c", "c-d"))
        abort = None if self.abort is None else partial(self._stop_robot, self.abort)
        return arm_window.ArmScreen(self.watched, None, self.text, actions | leaving, abort=abort, world=self.world)

    def _stop_robot(self, abort: Callable[[], None]) -> None:
        """Stop the robot. Also end the JOG motion, so that the next key can start a new one."""
        abort()
        self.stop()

    def run(self) -> None:
        """Show the panel until the user leaves."""
        with patch_stdout(raw=True):
            self.screen().run()


def _neighbour(row: Iterable[float], value: float, by: int) -> float:
    """Return the next greater (`by` > 0) or next smaller number in a sequence, or the value itself if there is none."""
    choose: Callable[..., float] = min if by > 0 else max
    return choose((one for one in row if (one - value) * by > 0), default=value)


JOG_ACTIONS: Mapping[str, Callable[[JogPanel], None]] = {
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
