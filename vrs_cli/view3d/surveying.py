"""What there is at a robot beside its timeline, for one window: asked for when something has happened."""

from __future__ import annotations

from msgspec.structs import replace

from vrs_cli.interfaces.session.survey import MOST_STEPS
from vrs_cli.net import messages
from vrs_cli.net.messages import At, Done, ServerMessage
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.values.acts import Survey, Surveyed, TaskRow

OFTEN = 0.25  # [s] between two looks at least
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
        """Something may be another than it was."""
        self._happened = True

    @property
    def task(self) -> TaskRow | None:
        """The robot program that runs, or has stopped."""
        return next(iter(self.found.tasks), None) if self.found is not None else None

    def look(self, wall: float) -> Surveyed | None:
        """Return what is known, and ask again if that is due, without waiting: always while a program runs."""
        if wall < self._asked_at + (PATIENCE if self._under_way else OFTEN):
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
