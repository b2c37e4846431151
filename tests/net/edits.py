"""Random edits of a timeline, from a seed: motions of all kinds and times, undo, redo, ABORT, targets of a stream,
branches, MERGE, and now and then a timeline that has nothing to do with the one before.
"""

from __future__ import annotations

from contextlib import suppress

from tests.laws.sessions import Session
from vrs_cli.engine.book import Book
from vrs_cli.engine.branches import Branches
from vrs_cli.engine.engine import Bookmark, Engine
from vrs_cli.errors import VrsError
from vrs_cli.interfaces.streams import Steering
from vrs_cli.kinematics.robot_file import load_robot
from vrs_cli.values.commands import JointTarget, Move, Request, SetParameter, Stamp

LONGEST = 120  # segments
NAMES = ("one", "two")


class Edits:
    """Edits one robot, and nobody else does meanwhile. `counts`: how often each kind was done."""

    def __init__(self, seed: int, engine: Engine | None = None, branches: Branches | None = None) -> None:
        self._session = Session(seed, load_robot("puma560"))
        self.random = self._session.random
        self.engine = engine or Engine(self._session.model)
        self.branches = branches or Branches(self.engine)
        self._session.engine = self.engine
        self._session.profile = self._profile  # type: ignore[method-assign]
        self.counts: dict[str, int] = {}
        with suppress(VrsError):
            self.engine.perform(Move(JointTarget(self._session.joints_target().joints), False))

    def edit(self) -> None:
        """One edit, which may be refused."""
        kinds = {self.move: 70, self.undo: 8, self.redo: 5, self.stop: 2, self.steer: 6, self.branch: 6, self.merge: 3}
        (kind,) = self.random.choices(list(kinds), list(kinds.values()))
        if len(self.engine.timeline) > LONGEST:
            kind = self.load
        with suppress(VrsError):
            kind()
            self.counts[kind.__name__] = self.counts.get(kind.__name__, 0) + 1

    def move(self) -> None:
        """Mostly a plain motion at some time; sometimes anything that can be asked for."""
        if self.random.random() < 0.2:
            self.engine.perform(self._session.request(), program=self.random.random() < 0.5)
            return
        stamp = Stamp(self._session.instant()) if self.random.random() < 0.6 else None
        self.engine.perform(Move(self._session.joints_target(), False, stamp=stamp), program=self.random.random() < 0.5)

    def _profile(self) -> Request:
        """Those that take long to plan are rare."""
        (name,) = self.random.choices(("LSPB", "SCURVE", "QUINTIC"), (30, 5, 1))
        return SetParameter("PROFILE", name)

    def undo(self) -> None:
        self.engine.undo(self.random.choice((1, 1, 2, 5)))

    def redo(self) -> None:
        self.engine.redo()

    def stop(self) -> None:
        self.engine.stop()

    def steer(self) -> None:
        """Some targets of a stream, one after the other."""
        steering, begin, joints = Steering(self.engine), self.engine.now, self._session.joints_target().joints
        for k in range(self.random.randint(2, 12)):
            goal = tuple(q * (1.0 - 0.01 * k) for q in joints)
            steering.to(goal, begin + 0.02 * k)
        if self.random.random() < 0.5:
            steering.finish()

    def branch(self) -> None:
        """Change over to another branch, which is made where there is none of its name."""
        name = self.random.choice(("main", *NAMES))
        (self.branches.change_over if name in self.branches else self.branches.make)(name)

    def merge(self) -> None:
        """A branch with some motions on it becomes main, which may have changed since."""
        self.branches.change_over("main")
        with suppress(VrsError):
            self.branches.drop("trial")
        self.branches.make("trial")
        for _ in range(self.random.randint(1, 3)):
            with suppress(VrsError):
                self.move()
        if self.random.random() < 0.3:
            self.branches.change_over("main")
            self.move()
        self.branches.merge("trial")

    def load(self) -> None:
        """As LOAD of a trajectory does: another book."""
        book = Book.at(self._session.joints_target().joints)
        self.engine.take_up(Bookmark(book, self.engine.settings, 0.0))
