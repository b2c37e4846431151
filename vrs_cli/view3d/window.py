"""One browser: its window, the time it shows, and what there is at a robot beside its timeline."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from math import inf
from threading import Lock
from typing import Any

import viser
from msgspec.structs import replace

from vrs_cli.engine.position import Watched, position_at
from vrs_cli.errors import RequestRefused, VrsError
from vrs_cli.interfaces.conversation.internal_error import internal_error
from vrs_cli.interfaces.roles.playback import Playback
from vrs_cli.interfaces.session.acts import MOST_STEPS
from vrs_cli.language.words.word import Role
from vrs_cli.net import messages
from vrs_cli.net.messages import At, Done, ServerMessage
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.net.tokens import TEACHER
from vrs_cli.values.acts import Survey, Surveyed, TaskRow
from vrs_cli.view3d.parts import Shown, ShownPart
from vrs_cli.world.world import World

LOOK_PERIOD = 0.25  # [s] between two looks at least
PATIENCE = 5.0  # [s] until a look whose answer does not come is made again
BEFORE = 20  # steps that are shown before the present one
HAPPENED = (messages.Told, messages.Status, messages.Activity, messages.Lease, messages.Welcome)


class Surveying:
    """`found`: all that is known, None at first. `program`: whose steps are wanted, empty for the one that runs."""

    def __init__(self, robot: SocketPort) -> None:
        self.found: Surveyed | None = None
        self.program = ""
        self._robot = robot
        self._asked = Survey()
        self._happened, self._under_way, self._asked_at = True, False, -PATIENCE
        self._version = -1
        robot.listen(self._hear)

    def happened(self) -> None:
        """Note that something may have changed."""
        self._happened = True

    @property
    def task(self) -> TaskRow | None:
        """The robot program that runs, or has stopped."""
        return next(iter(self.found.tasks), None) if self.found is not None else None

    def look(self, wall: float) -> Surveyed | None:
        """Return what is known, and ask again if that is due, without waiting: always while a program runs."""
        if wall < self._asked_at + (PATIENCE if self._under_way else LOOK_PERIOD):
            return self.found
        asked, runs = self._wanted(), self.task is not None and self.task.running
        changed = self._robot.follow().timeline.version != self._version or asked != self._asked
        if not (self._happened or runs or changed):
            return self.found
        self._happened, self._under_way, self._asked_at = False, True, wall
        self._asked, self._version = asked, self._robot.follow().timeline.version
        known = () if self.found is None else self.found.marks
        self._robot.post(lambda id: At(id, replace(asked, known=known)), self._heard)
        return self.found

    def _wanted(self) -> Survey:
        """The steps around the present one; those that are known, where it is among them."""
        task = self.task
        name = self.program or ("" if task is None else task.program)
        step = task.step if task is not None and task.program.lower() == name.lower() and task.step else 1
        first = self._asked.first if name == self._asked.program else 1
        if not first <= step < first + MOST_STEPS:
            first = max(step - BEFORE, 1)
        return Survey(name, first)

    def _heard(self, message: ServerMessage) -> None:
        if not isinstance(message, Done):
            return
        self._under_way = False
        if isinstance(message.found, Surveyed):
            before, now = self.found, message.found
            if (
                before is not None
            ):  # lists that were left out are as they are known; an empty mark is that of no program
                now = replace(
                    now,
                    places=before.places if now.places is None else now.places,
                    programs=before.programs if now.programs is None else now.programs,
                    text=before.text if now.text is None and now.marks[2] else now.text,
                )
            self.found = now

    def _hear(self, message: ServerMessage) -> None:
        if isinstance(message, messages.Welcome):
            self._under_way = False
        if isinstance(message, HAPPENED):
            self._happened = True


# --- the window ------------------------------------------------------------------------------------------------------


TITLE = "vrs"
LEAD = 1.0  # [s] that are shown before the first motion
STAYS = 8.0  # [s] that a message is shown
PERIOD = 0.02  # [s] between two pictures at least
OFTEN = 0.1  # [s] between two looks at what is read, and at all while nothing moves
DRIVERS = (Role.SUPERVISOR.title, TEACHER)
RED = (200, 60, 50)

Change = Callable[[Playback, float], Playback]


class RobotWindow:
    """`robot`: the port to the watched robot; None for the trajectory of a file. `parts`
    are shown whatever of them has changed, in their order; `closing`: what is to be done when the browser goes. `type`
    has a line carried out as one that the user types. It is to be shown when it is `due`, by the time of the day [s];
    `woken` is called where that is sooner than it was. `why_cut`: what was told of the last cut of its connection.
    `world`: what is around the robot and is shown, None for nothing. Any thread may call any method.
    """

    def __init__(
        self,
        client: viser.ClientHandle,
        held: SocketPort | Watched,
        wall: Callable[[], float],
        rate: float = 1.0,
        woken: Callable[[], object] = lambda: None,
    ) -> None:
        self.client, self.wall = client, wall
        self.robot = held if isinstance(held, SocketPort) else None
        self.watched = held.follow() if isinstance(held, SocketPort) else held
        self.surveying = None if self.robot is None else Surveying(self.robot)
        self.parts: list[ShownPart] = []
        self.type: Callable[[str], object] = lambda _line: None
        self.closing: list[Callable[[], object]] = []
        timeline = self.watched.timeline
        self.playback = Playback.of(timeline.start, timeline.end, rate, wall())
        if self.robot is not None:  # it is followed; a trajectory is played from its start
            self.playback = Playback.following(timeline.start, timeline.end, self.watched.now, wall())
        self.due = self._next = self._read_at = -inf  # [s]: when it is shown again, when it may be, when it is read
        self._woken = woken
        self._changing = Lock()
        self._told = ""
        self._told_at = -STAYS
        self.why_cut = ""
        self.world: World | None = None

    # --- time ---

    def change(self, how: Change) -> None:
        """Play on, stop, go elsewhere: `window.change(Playback.toggle)`."""
        with self._changing:
            self.playback = how(self.playback, self.wall())
        self.wake()

    def tick(self, wall: float) -> None:
        """Show what is to be shown at that time of the day [s]."""
        self._next = (self._next if wall < self._next + PERIOD else wall) + PERIOD
        reads = wall >= self._read_at
        if reads:
            self._read_at = wall + OFTEN
        self.due = max(self._read_at, self._next)
        shown = self._look(wall, reads=reads)
        with self.client.atomic():
            for part in tuple(self.parts):
                try:
                    part.show(shown)
                except Exception as error:  # it is told of once, and stands still from then on
                    self.parts.remove(part)
                    self.tell(internal_error(error).text)
        if self.playback.playing:
            live = self.playback.follows and self.robot is not None and self.robot.far.rate
            self.again(wall + _rests(shown) / (live or self.playback.rate))

    def again(self, wall: float = -inf) -> None:
        """Show it again at that time of the day [s], or with the next picture; for what is shown and moves."""
        self.due = min(self.due, max(wall, self._next))

    def wake(self) -> None:
        """Show soon: something has happened that is to be seen."""
        if self.due > self._next:
            self.again()
            self._woken()

    def _look(self, wall: float, *, reads: bool) -> Shown:
        watched, robot, seen = self.watched, self.robot, None
        with suppress(RequestRefused):  # the robot was let go
            seen = None if robot is None else robot.previewed()  # with what is on its way to the robot
        timeline, now = (watched.timeline, watched.now) if seen is None else (seen.timeline, seen.reported)
        begin = timeline.start
        if robot is not None and len(timeline) > 1:  # it has stood before, perhaps for hours: that is not played
            begin = max(begin, timeline[1].start - LEAD)
        with self._changing:
            playback = self.playback.look(wall, begin, timeline.end, now)
            if playback.follows and playback.playing and robot is not None and robot.far.rate is not None:
                playback = playback.follow(wall)  # its clock is known better than a moment ago
            self.playback = playback
        t = playback.at(wall)
        surveyed = None if self.surveying is None else self.surveying.look(wall)
        return Shown(watched.arm, timeline, t, position_at(watched.arm, timeline, t), now, surveyed, seen, reads)

    @property
    def drives(self) -> bool:
        """Return whether there is something to drive, and who looks may: panels that drive are for these alone."""
        return self.robot is not None and self.robot.welcome.role in DRIVERS

    @property
    def width(self) -> float:
        """The width of the picture [px], at least 1: a page that nobody sees may have none."""
        return max(float(self.client.camera.image_width), 1.0)

    # --- what is said ---

    def doing(self, act: Callable[[], object]) -> Callable[[Any], None]:
        """Return the callback of a button: `button.on_click(window.doing(act))`. What is refused is told."""
        return self.doing_with(lambda _event: act())

    def doing_with(self, act: Callable[[Any], object]) -> Callable[[Any], None]:
        """Return the callback of an act that takes the event of viser."""

        def do(event: Any) -> None:
            try:
                act(event)
            except Exception as error:
                self.tell(error_text(error))
            self.wake()

        return do

    def tell(self, text: str) -> None:
        """Show a text that the user has to know; not again while it is there to be read."""
        now = self.wall()
        if text != self._told or now > self._told_at + STAYS:
            self._told, self._told_at = text, now
            self.client.add_notification(TITLE, text, auto_close_seconds=STAYS, color=RED)

    def close(self) -> None:
        """The browser is gone."""
        for close in self.closing:
            close()
        if self.robot is not None:
            self.robot.close()


def error_text(error: Exception) -> str:
    """Return what is refused, or that something is wrong in vrs itself, with a report in a file."""
    return str(error) if isinstance(error, VrsError) else internal_error(error).text


def _rests(shown: Shown) -> float:
    """The time until something moves [s]."""
    timeline, after = shown.timeline, shown.timeline.index_at(shown.t) + 1
    if shown.position.moving:
        return 0.0
    return timeline[after].start - shown.t if after < len(timeline) else inf
