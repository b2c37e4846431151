"""A robot watched on the terminal, with prompt-toolkit: a trajectory that is played (REPLAY), a robot that others move,
and the arm until it stands (SHOW).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct
from prompt_toolkit.patch_stdout import patch_stdout

from vrs_cli.engine.position import Watched, position_at
from vrs_cli.interfaces.roles.observer import RecordedRobot
from vrs_cli.interfaces.roles.playback import Playback
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.render.text import plain_text
from vrs_cli.repl.arm_window import ArmScreen
from vrs_cli.repl.toolbar import ABORT
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.replies import Whereabouts

if TYPE_CHECKING:
    from vrs_cli.world.world import World

BAR = 30  # characters
SKIP, FAR_SKIP = 1.0, 10.0  # [s]
STANDS = 1.0  # [s] after its last motion the arm is believed to be at rest
LIVE_KEYS = f"{ABORT}   any other key ends the picture, not the motion"


class Action(NamedTuple):
    """The effect of some keys: `change` makes the next playback; None leaves the player. `live`: only where the robot
    is watched while it moves."""

    keys: tuple[str, ...]
    shown: str
    change: Callable[[Playback, float], Playback] | None
    live: bool = False


ACTIONS: tuple[Action, ...] = (
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
    """Holds the playback and draws it; `wall` tells the time of the day [s]. `news`: lines of what else there is to
    tell of the time that is shown, such as who drives the robot; `live`: others move it; `passes`: whether its time
    goes by itself. `abort` stops a robot that others move. `world`: the cell around it.
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
        """Return the text that is shown now."""
        wall, watched = self.wall(), self.watched
        timeline = watched.timeline
        self.playback = self.playback.look(wall, timeline.start, timeline.end, watched.now)
        if self.playback.follows and self.playback.playing and self.passes():
            self.playback = self.playback.follow(wall)  # its clock is known better than a moment ago
        position = position_at(watched.arm, timeline, self.playback.at(wall))
        where = plain_text(Whereabouts(position, units=watched.arm.model.units))
        doing = position.text if position.moving else "at rest"
        lines = (self._bar(wall), self.news(self.playback.at(wall)), doing)
        return "\n".join(line for line in lines if line) + f"\n{where}{self._keys()}"

    def _bar(self, wall: float) -> str:
        playback = self.playback
        t, length = playback.at(wall), playback.end - playback.start
        done = round(BAR * (t - playback.start) / length) if length > 0.0 else BAR
        return (
            f"[{'#' * done:-<{BAR}}] {t:8.2f} / {playback.end:.2f} s   {playback.doing(wall)}, rate {playback.rate:g}"
        )

    def _keys(self) -> str:
        shown = [action.shown for action in self._actions() if action.shown]
        rows = (shown[:-3], [*shown[-3:], ABORT]) if self.live else (shown,)
        return "\n".join("  ".join(row) for row in rows)

    def _actions(self) -> list[Action]:
        return [action for action in ACTIONS if self.live or not action.live]

    def screen(self) -> ArmScreen:
        """Return the application that plays on the terminal until the user leaves."""
        keys = {key: action.change for action in self._actions() for key in action.keys}
        actions = {key: None if change is None else partial(self._change, change) for key, change in keys.items()}
        return ArmScreen(
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
    """Play a trajectory on the terminal, from its start, `rate` seconds of it in one second."""
    playback = Playback.of(timeline.start, timeline.end, rate, time.monotonic())
    Player(RecordedRobot(arm, timeline), playback, world=world).screen().run()


async def watch(
    watched: Watched,
    news: Callable[[float], str],
    passes: Callable[[], bool],
    abort: Callable[[], object],
    world: World | None = None,
) -> None:
    """Watch a robot that others move, from where it is now on; `passes`: whether its time goes by itself. `abort` stops
    it.
    """
    timeline = watched.timeline
    playback = Playback.following(timeline.start, timeline.end, watched.now, time.monotonic())
    player = Player(watched, playback, news=news, live=True, passes=passes, abort=abort, world=world)
    await player.screen().run_async()


def show_motion(
    watched: Watched, keep_up: Callable[[], None], abort: Callable[[], None], world: World | None = None
) -> None:
    """SHOW while the arm moves: picture it as it is now, until it stands or a key is pressed. `keep_up` lets happen
    what is due; `abort` stops the robot; `world` is the cell around it.
    """

    def text() -> str:
        at = position_at(watched.arm, watched.timeline, watched.now)
        doing = at.text or "moving" if at.moving else "at rest"
        return f"t {at.time:.2f} s, {doing}\n{plain_text(Whereabouts(at, units=watched.arm.model.units))}{LIVE_KEYS}"

    def over() -> bool:
        keep_up()
        return watched.now > watched.timeline.end + STANDS

    with patch_stdout(raw=True):
        ArmScreen(watched, None, text, {"<any>": None}, over, abort, world).run()
