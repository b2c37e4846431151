"""A trajectory played on the terminal, with prompt-toolkit: position and joints while time goes by."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import NamedTuple

from msgspec import Struct
from prompt_toolkit.application import Application
from prompt_toolkit.key_binding import KeyBindings, KeyPressEvent
from prompt_toolkit.layout import FormattedTextControl, Layout, Window

from vrs_cli.dialogue.replies import Whereabouts
from vrs_cli.engine.position import position_at
from vrs_cli.interfaces.roles.playback import Playback
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.render.text import plain_text
from vrs_cli.trajectory.timeline import Timeline

REFRESH = 0.04  # [s]
BAR = 30  # characters
SKIP, FAR_SKIP = 1.0, 10.0  # [s]


class Action(NamedTuple):
    """What keys do: `change` makes the next playback; None leaves the player."""

    keys: tuple[str, ...]
    shown: str
    change: Callable[[Playback, float], Playback] | None


ACTIONS: tuple[Action, ...] = (
    Action(("space", "p"), "space pause", lambda p, wall: p.toggle(wall)),
    Action(("left",), "left/right 1 s", lambda p, wall: p.skip(-SKIP, wall)),
    Action(("right",), "", lambda p, wall: p.skip(SKIP, wall)),
    Action(("pageup",), "pgup/pgdn 10 s", lambda p, wall: p.skip(-FAR_SKIP, wall)),
    Action(("pagedown",), "", lambda p, wall: p.skip(FAR_SKIP, wall)),
    Action(("home", "r"), "r rewind", lambda p, wall: p.rewind(wall)),
    Action(("end", "e"), "e end", lambda p, wall: p.seek(p.end, wall)),
    Action(("+", "="), "+/- rate", lambda p, wall: p.faster(wall)),
    Action(("-",), "", lambda p, wall: p.slower(wall)),
    Action(("q", "escape", "c-c", "c-d"), "q quit", None),
)


class Player(Struct):
    """Holds the playback and draws it; `wall` tells the time of the day [s]."""

    arm: RobotArm
    timeline: Timeline
    playback: Playback
    wall: Callable[[], float] = time.monotonic

    def text(self) -> str:
        """What is shown now."""
        wall = self.wall()
        position = position_at(self.arm, self.timeline, self.playback.at(wall))
        where = plain_text(Whereabouts(position, units=self.arm.model.units))
        doing = position.text if position.moving else "at rest"
        keys = "  ".join(action.shown for action in ACTIONS if action.shown)
        return f"{self._bar(wall)}\n{doing}\n{where}{keys}"

    def _bar(self, wall: float) -> str:
        playback = self.playback
        t, length = playback.at(wall), playback.end - playback.start
        done = round(BAR * (t - playback.start) / length) if length > 0.0 else BAR
        state = "ended" if playback.ended(wall) else "playing" if playback.playing else "paused"
        return f"[{'#' * done:-<{BAR}}] {t:8.2f} / {playback.end:.2f} s   {state}, rate {playback.rate:g}"

    def run(self) -> None:
        """Play on the terminal until the user leaves."""
        application: Application[None] = Application(
            layout=Layout(Window(FormattedTextControl(self.text), dont_extend_height=True, wrap_lines=True)),
            key_bindings=self._bindings(),
            refresh_interval=REFRESH,
        )
        application.run()

    def _bindings(self) -> KeyBindings:
        bindings = KeyBindings()
        for key, change in _changes().items():
            bindings.add(key)(self._handler(change))
        return bindings

    def _handler(self, change: Callable[[Playback, float], Playback] | None) -> Callable[[KeyPressEvent], None]:
        def handle(event: KeyPressEvent) -> None:
            if change is None:
                event.app.exit()
            else:
                self.playback = change(self.playback, self.wall())

        return handle


def _changes() -> Mapping[str, Callable[[Playback, float], Playback] | None]:
    return {key: action.change for action in ACTIONS for key in action.keys}


def play(arm: RobotArm, timeline: Timeline, rate: float) -> None:
    """Play a trajectory on the terminal, from its start, `rate` seconds of it in one second."""
    playback = Playback.of(timeline.start, timeline.end, rate, time.monotonic())
    Player(arm, timeline, playback).run()
