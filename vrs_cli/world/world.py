"""The world around an arm: it gives the course of a timeline, and computes again only what an edit has changed."""

from __future__ import annotations

from collections.abc import Iterator
from threading import Lock

from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.transform import Transform
from vrs_cli.language.run.signals import Cell
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.world.course import WorldCourse
from vrs_cli.world.settings import WorldSettings

MOST_COURSES = 6  # of the versions asked for last


class World:
    """An arm in a cell. Any thread may ask."""

    def __init__(self, arm: RobotArm, cell: Cell) -> None:
        self.cell, self.settings = cell, WorldSettings(arm, cell)
        self._courses: list[WorldCourse] = []  # the one asked for last stands last
        self._lock = Lock()

    def course(self, timeline: Timeline) -> WorldCourse:
        """The course of a timeline."""
        with self._lock:
            found = next((one for one in self._courses if one.timeline is timeline), None)
            if found is None:
                found = self._made(timeline)
            else:
                self._courses.remove(found)
            self._courses = [*self._courses[1 - MOST_COURSES :], found]
            return found

    def poses(self, timeline: Timeline, t: float) -> Iterator[tuple[str, Transform]]:
        """Yield the parts that are there at t [s], each with T_world_part."""
        course = self.course(timeline)
        for name in course.parts():
            state = course.state(name, t)
            if state.exists:
                yield name, state.pose

    def _made(self, timeline: Timeline) -> WorldCourse:
        """Continue from the course that is the same for the longest time."""
        best, since = None, timeline.start
        for course in reversed(self._courses):
            if course.timeline.world is not timeline.world:
                continue
            same = course.timeline.same_until(timeline)
            if same > since:
                best, since = course, same
            if same >= course.timeline.end:  # the timeline goes on from its end
                break
        return WorldCourse(self.settings, timeline) if best is None else best.edited(timeline, since)
