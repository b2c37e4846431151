"""A robot watched on the terminal, with prompt-toolkit: where it is while time goes by, of a trajectory or of one that
others move.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

from msgspec import Struct
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent

from vrs_cli.engine.position import Watched, position_at
from vrs_cli.interfaces.monitor.showing import Sight
from vrs_cli.interfaces.roles.observer import RecordedRobot
from vrs_cli.interfaces.roles.playback import Playback
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.render.text import plain_text
from vrs_cli.repl.arm_window import ArmScreen
from vrs_cli.repl.toolbar import ABORT
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.replies import ArmPicture, Whereabouts

BAR = 30  # characters
SKIP, FAR_SKIP = 1.0, 10.0  # [s]


class Action(NamedTuple):
    """What keys do: `change` makes the next playback; None leaves the player. `live`: only where the robot is watched
    while it moves."""

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


def nothing_else(_t: float) -> str:
    """There is nothing to tell of a trajectory but where the robot is."""
    return ""


class Player(Struct):
    """Holds the playback and draws it; `wall` tells the time of the day [s]. `news`: lines of what else there is to
    tell of the time that is shown, such as who drives the robot; `live`: others move it; `passes`: whether its time
    goes by itself. `abort` stops a robot that others move.
    """

    watched: Watched
    playback: Playback
    wall: Callable[[], float] = time.monotonic
    news: Callable[[float], str] = nothing_else
    live: bool = False
    passes: Callable[[], bool] = lambda: False
    abort: Callable[[], object] | None = None

    def text(self) -> str:
        """What is shown now."""
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
        """What plays on the terminal until the user leaves."""
        sight = Sight(self.watched.arm)
        return ArmScreen(lambda: self._picture(sight), self.text, self._bindings(), abort=self.abort)

    def _picture(self, sight: Sight) -> ArmPicture:
        """The arm at the time that is shown."""
        return sight.picture(self.watched.timeline, self.playback.at(self.wall()))

    def _bindings(self) -> KeyBindings:
        bindings = KeyBindings()
        for action in self._actions():
            for key in action.keys:
                bindings.add(key)(self._handler(action.change))
        return bindings

    def _handler(self, change: Callable[[Playback, float], Playback] | None) -> Callable[[KeyPressEvent], None]:
        def handle(event: KeyPressEvent) -> None:
            if change is None:
                event.app.exit()
            else:
                self.playback = change(self.playback, self.wall())

        return handle


def play(arm: RobotArm, timeline: Timeline, rate: float) -> None:
    """Play a trajectory on the terminal, from its start, `rate` seconds of it in one second."""
    playback = Playback.of(timeline.start, timeline.end, rate, time.monotonic())
    Player(RecordedRobot(arm, timeline), playback).screen().run()


async def watch(
    watched: Watched, news: Callable[[float], str], passes: Callable[[], bool], abort: Callable[[], object]
) -> None:
    """Watch a robot that others move, from where it is now on; `passes`: whether its time goes by itself. `abort` stops
    it.
    """
    timeline = watched.timeline
    playback = Playback.following(timeline.start, timeline.end, watched.now, time.monotonic())
    player = Player(watched, playback, news=news, live=True, passes=passes, abort=abort)
    await player.screen().run_async()
