"""Search for contacts before an engine commits a motion. With ENABLE COLLISION, a motion that causes a contact is
refused. Without it, in a cell with a scene, contacts are reported once per motion."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING

from msgspec import structs

from vrs_cli.engine.engine import Engine
from vrs_cli.engine.settings import Settings
from vrs_cli.errors import CollisionAhead, IllegalValue, MotionError
from vrs_cli.trajectory.timeline import Timeline, TimelineDelta
from vrs_cli.values.commands import HAND, MotionKind, Move

if TYPE_CHECKING:
    from vrs_cli.contacts.checker import Checker
    from vrs_cli.values.scene import CellScene
    from vrs_cli.values.world import Contact
    from vrs_cli.world.course import World


MM = 1e-3  # [m] a millimetre
MAX_CONTACTS = 1000  # maximum number of reported contacts that are kept


class ContactWatch:
    """A check of an engine's motions for contacts. `around`: returns the scene of the cell and its world, which
    computes the states of parts (None: no world). `tell`: shows a message to the user. `checker`: the checker used
    last, or None."""

    def __init__(
        self,
        engine: Engine,
        around: Callable[[], tuple[CellScene, World | None]],
        tell: Callable[[str], None],
    ) -> None:
        self._engine, self._around, self._tell = engine, around, tell
        self.checker: Checker | None = None
        self._missing = False  # whether the user was informed that MuJoCo is missing
        # reported contacts, with the descriptions of their motions
        self.contacts: deque[tuple[str, Contact]] = deque(maxlen=MAX_CONTACTS)
        self._number = 0  # number of the motion whose contact was reported last
        engine.checks.append(self.check)

    def check(self, timeline: Timeline, delta: TimelineDelta, settings: Settings) -> None:
        """Report the first contact that a change of the timeline causes; if COLLISION is enabled, raise CollisionAhead
        instead."""
        found, later = self.of_change(timeline, delta, settings)
        if found is None:
            return
        text = delta.motion.text or "the motion"
        said = f"{text}: {found.describe()}{later}"
        if settings.switch("COLLISION"):
            raise CollisionAhead(
                said,
                "DISABLE COLLISION lets it begin all the same",
                value=found.depth,
                lower=found.needed,
                place=found.place,
            )
        if delta.motion.kind is MotionKind.STEERED and delta.motion.number == self._number:
            return  # a contact of this steered motion was already reported for an earlier target
        self._number = delta.motion.number
        self.contacts.append((text, found))
        self._tell(said)

    def of_change(self, timeline: Timeline, delta: TimelineDelta, settings: Settings) -> tuple[Contact | None, str]:
        """Return the first contact that a change causes (None if contacts are not checked), and, for a contact on a
        later motion, a string with the name of this motion."""
        if self._around()[1] is None and not settings.switch("COLLISION"):
            return None, ""
        found, after = None, timeline.apply(delta)
        moves = any(segment.motion.kind is not MotionKind.REST for segment in delta.segments)
        if moves or (delta.events is not None and any(event.channel == HAND for event in delta.events.events)):
            found = self.first_contact(after, delta.cut, _end(delta), settings)
        if found is not None:
            return found, ""
        found = self._later(timeline, after, delta, settings)
        return found, f" (on {after.locate(found.t)[0].motion.text})" if found is not None else ""

    def _later(self, before: Timeline, after: Timeline, delta: TimelineDelta, settings: Settings) -> Contact | None:
        """Return the first contact on motions that a change only shifts in time. Their paths stay the same, but the
        hand may now hold a different part, and parts may be at different positions."""
        times = [delta.segments[-1].finish] if delta.segments else []
        if not times and delta.events is not None:
            times = [event.time for event in delta.events.events]
        since, world = min(times, default=after.end), self._around()[1]
        checker = self._checker(settings) if since < after.end else None
        if checker is None:
            return None
        old, new = (None if world is None else world.course(one) for one in (before, after))
        return checker.first_changed((before, old), (after, new), since, delta.shift)

    def ahead(self, move: Move) -> Contact | None:
        """Return the first contact of a motion if it started now; `t` of the contact counts from now [s]. Return None
        if there is no contact, or if the arm cannot execute the motion."""
        try:
            delta = self._engine.trial(move)
        except (MotionError, IllegalValue):
            return None
        found = self.first_contact(self._engine.timeline.apply(delta), delta.cut, _end(delta), self._engine.settings)
        return None if found is None else structs.replace(found, t=found.t - delta.executed)

    def first_contact(self, timeline: Timeline, begin: float, end: float, settings: Settings) -> Contact | None:
        """Return the first contact between two times [s]. Return None if there is none, or if contacts are not
        checked."""
        checker = self._checker(settings) if end > begin else None
        if checker is None:
            return None
        world = self._around()[1]
        return checker.first_contact(timeline, begin, end, world.course(timeline) if world is not None else None)

    def prepare(self, checker: Checker | None = None) -> None:
        """Import MuJoCo now: the import may start a process, which is not allowed later, while programs of other users
        run. `checker`: the checker of another robot with the same model and scene, to reuse."""
        if find_spec("mujoco") is not None:
            import_module("vrs_cli.contacts.checker")
            self.checker = checker

    def tell_missing(self) -> None:
        """Report once that contacts are not checked because MuJoCo is missing."""
        if not self._missing and find_spec("mujoco") is None:
            self._missing = True
            from vrs_cli.extras import how_to_install

            self._tell(f"contacts are not checked: that needs mujoco-core ({how_to_install('mujoco-core')})")

    def _checker(self, settings: Settings) -> Checker | None:
        """Return the checker for the current scene; None if contacts are not checked."""
        scene, refused = self._around()[0], settings.switch("COLLISION")
        if scene.empty and not refused:
            return None
        if find_spec("mujoco") is None:
            if refused:  # tell the user only if COLLISION is enabled
                self.tell_missing()
            return None
        from vrs_cli.contacts.checker import Checker

        clearance = float(settings.parameters["CLEARANCE"]) * MM
        known = self.checker
        if known is None or known.scene is not scene or known.clearance != clearance:
            known = self.checker = Checker(self._engine.arm, scene, clearance)
        return known


def _end(delta: TimelineDelta) -> float:
    """Return the time at which the changed part of the timeline ends [s]; motions after it are only shifted."""
    events = () if delta.events is None else delta.events.events
    ends = [segment.finish for segment in delta.segments] + [event.time + event.duration for event in events]
    return max(ends, default=delta.cut)
