"""The robots of one server: who may hold which; those that a token has for itself are made when they are used."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from math import inf
from pathlib import Path
from threading import Lock

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.errors import RequestRefused
from vrs_cli.kinematics.model import RobotModel
from vrs_cli.net.audit import Audit
from vrs_cli.net.room import Room
from vrs_cli.net.served_robot import Plan
from vrs_cli.net.tokens import Grant


class RobotFolders(Struct, frozen=True):
    """Where robots keep what they do (None: nowhere), and their files: each in a folder of its own, unless the `only`
    robot has all of it.
    """

    journal: Path | None
    folder: Path
    only: bool = False

    def plan(self, name: str, model: RobotModel, usual: Plan) -> Plan:
        journal = None if self.journal is None else self.journal / f"{name}.vrst"
        return replace(usual, model=model, folder=self.folder if self.only else self.folder / name, journal=journal)


class Hub:
    """`robots`: those that are there from the start, by name. `own`: how many robots each token has for itself, which
    are paused when nobody has held or watched them for `own_idle` [s]; a teacher has those of all `grants`.

    `open` may be called by any thread, and takes its time; all else by that of the connections.
    """

    def __init__(
        self,
        robots: Mapping[str, RobotModel],
        places: RobotFolders,
        usual: Plan,
        audit: Audit,
        wake: Callable[[str], None],
        tell: Callable[[str], None],
        own: int = 0,
        grants: Callable[[], Iterable[Grant]] = tuple,
        own_idle: float = inf,
    ) -> None:
        self.rooms: dict[str, Room] = {}
        self._robots, self._places, self._usual = robots, places, usual
        self._own, self._grants, self._own_idle = own, grants, own_idle
        self._audit, self._wake, self._tell = audit, wake, tell
        self._opening = Lock()

    def names(self, grant: Grant) -> tuple[str, ...]:
        """The robots that a token may hold: those that there are, and its own."""
        shared = (name for name in self._robots if grant.teacher or grant.robots is None or name in grant.robots)
        others = (name for one in self._grants() for name in self._own_names(one)) if grant.teacher else ()
        return tuple(dict.fromkeys((*self._own_names(grant), *shared, *others)))

    def _own_names(self, grant: Grant) -> tuple[str, ...]:
        return grant.own_names(self._own) if grant.name else ()

    def chosen(self, grant: Grant, wanted: str) -> str:
        """The robot that is meant: by name, or the only one, or the token's first own. Raises RequestRefused, which
        says nothing of robots that the token may not hold.
        """
        names = self.names(grant)
        if wanted in names:
            return wanted
        if not wanted and (len(names) == 1 or self._own_names(grant)):
            return names[0]
        what = f"there is no robot {wanted} for you" if wanted else "which robot"
        raise RequestRefused(what, f"there is {', '.join(names) or 'none'}: ws://HOST:PORT/robots/NAME")

    def open(self, name: str) -> Room:
        """The room of a robot, which is made where there is none yet. Raises VrsError."""
        with self._opening:
            room = self.rooms.get(name)
            if room is None:
                model = self._robots.get(name, self._usual.model)
                usual = self._usual if name in self._robots else replace(self._usual, idle=self._own_idle)
                plan = self._places.plan(name, model, usual)
                room = Room(name, plan, lambda: self._wake(name), self._audit, self._tell, self.names)
                self.rooms = {**self.rooms, name: room}
            return room

    def open_all(self) -> None:
        """Those that are there from the start. Raises VrsError."""
        for name in self._robots:
            self.open(name)

    def close(self) -> None:
        """All is on the disk. Raises FileError."""
        with ExitStack() as stack:
            for room in self.rooms.values():
                stack.callback(room.close)
