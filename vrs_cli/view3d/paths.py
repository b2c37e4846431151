"""The way of the tool in a scene, past and planned, and where each command takes over."""

from __future__ import annotations

import time
from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from viser import SceneApi

from vrs_cli.engine.tool_path import ToolLine, ToolPath
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.model import RobotModel, levers
from vrs_cli.kinematics.transform import Vector, position
from vrs_cli.trajectory.segment import Phase
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.values.motion import MotionKind
from vrs_cli.view3d.parts import Colour, Redrawing, Rooted, Shown, gathered, move_points, put

ERROR = 0.0005  # [m] between the way and its lines, at most
MOST = 6000  # lines; of a way with more the part around the present is shown
AROUND = 23  # lines of the segment under way around the tip: they are sent for each picture
UNDER_WAY = AROUND + 1  # the tip parts one of them in two
# viser takes the colours of single lines as linear light: these are seen as a blue, an orange, and lighter ones
PAST, PLANNED = (11, 26, 147), (205, 49, 4)
BLENDS = {PAST: (57, 77, 212), PLANNED: (244, 123, 36)}  # where one motion turns into the next
THICK = 0.007  # of the reach
DOT = 0.012  # of the reach: between two segments
MARK = 0.02  # of the reach: where a command takes over
LABELS = 40  # of commands at most

Points = NDArray[np.float32]


class Around(NamedTuple):
    """The part of the way that is shown `before` and `after` the present, and after what time that is looked at anew
    [s].
    """

    before: float = 60.0
    after: float = 60.0
    step: float = 20.0


USUAL = Around()


class Path(Rooted):
    """Nodes /path ...: lines, past and planned in two colours, blends lighter; dots between segments; marks where the
    motion of a command begins, with its text if wanted (`commands`). `wall` tells the time of the day [s].
    """

    def __init__(
        self, scene: SceneApi, model: RobotModel, wall: Callable[[], float] = time.monotonic, around: Around = USUAL
    ) -> None:
        self._scene = scene
        _, (self._reach, *_) = levers(model)
        self._redrawing = Redrawing(wall)
        self._around = around
        self._path: ToolPath | None = None
        self._timeline: Timeline | None = None  # kept, so that no other one has its identity
        self._near: list[ToolLine] = []  # the lines around the present, no more than MOST
        self._begins: list[float] = []  # when each of them does [s]
        self._root = scene.add_frame("/path", show_axes=False)
        self._texts = scene.add_frame("/path/commands", show_axes=False)
        self._under_way = scene.add_line_segments(
            "/path/now",
            _none(UNDER_WAY),
            _none(UNDER_WAY).astype(np.uint8),
            thickness=self._reach * THICK,
            visible=False,
        )
        self._drawn: tuple[object, ...] = ()
        self._parted: tuple[ToolLine, int] | None = None  # the line under way, and how many of its points are past
        self._now = _none(UNDER_WAY)
        self._tip: Vector | None = None
        self.commands = False

    def show(self, shown: Shown) -> None:
        if not self.visible:
            return
        arm, timeline, window = shown.arm, shown.timeline, shown.t // self._around.step
        draw = partial(self._draw, arm, timeline, window * self._around.step)
        self._redrawing.look(id(timeline), (window, self.commands), draw)
        self._move_on(shown.t, position(shown.position.T_world_tool))

    def _draw(self, arm: RobotArm, timeline: Timeline, t: float) -> None:
        """Draw all that stays until the timeline changes, or another part of it is to be seen."""
        self._path = self._path or ToolPath(arm, ERROR)
        before, after, step = self._around
        lines = _nearest(self._path.lines(timeline, t - before, t + step + after), t, MOST)
        self._timeline = timeline
        if lines != self._near:
            self._near, self._begins = lines, [line.begin for line in lines]
        elif self._drawn and self._drawn[0] is self.commands:
            return
        count = sum(len(line.points) - 1 for line in lines)
        self._lines = self._scene.add_line_segments(
            "/path/lines",
            _none(count),
            _none(count).astype(np.uint8),
            thickness=self._reach * THICK,
            visible=count > 0,
        )
        self._drawn = ()
        self._add_dots("dots", [line.points[-1] for line in lines], DOT, (120, 126, 134))
        marks = [line for k, line in enumerate(lines) if _begins(lines[k - 1] if k else None, line)]
        self._add_dots("marks", [line.points[0] for line in marks], MARK, (52, 58, 66))
        self._texts.remove()
        self._texts = self._scene.add_frame("/path/commands", show_axes=False)
        # the commands stand at their marks; those at one place one below the other
        written = ((line.points[0], line.motion.text) for line in (marks[:LABELS] if self.commands else []))
        for k, (place, said) in enumerate(gathered(written, MARK * self._reach).items()):
            self._scene.add_label(f"/path/commands/{k}", "\n".join(said), position=place, anchor="bottom-left")

    def _add_dots(self, name: str, points: Sequence[Vector], size: float, colour: Colour) -> None:
        cloud = np.array(points, dtype=np.float32).reshape(-1, 3)
        self._scene.add_point_cloud(
            f"/path/{name}",
            cloud,
            colour,
            point_size=size * self._reach,
            point_shape="circle",
            precision="float32",
            visible=len(points) > 0,
        )

    def _move_on(self, t: float, tip: Vector) -> None:
        """Colour what is past at t [s] and what is planned; the line under way is divided at the tip."""
        lines, place = self._near, bisect_right(self._begins, t) - 1
        line = lines[place] if place >= 0 and lines[place].end > t else None
        passed = 0 if line is None else line.passed(t)
        first = max(passed - 1, 0) // AROUND * AROUND
        sent = None if line is None else first
        drawn = (self.commands, id(lines), place, sent)
        if drawn != self._drawn and lines:
            self._drawn = drawn
            self._lines.points, self._lines.colors = _figure(lines, place + (line is None), sent)
        put(self._under_way, visible=line is not None)
        if line is not None:
            self._part(line, first, passed, tip)

    def _part(self, line: ToolLine, first: int, passed: int, tip: Vector) -> None:
        """Draw the part of a line around the tip, from point `first` on. While the tip is between the same two points
        of it, nothing but the tip is another.
        """
        here = passed - first
        if self._parted != (line, passed):
            self._parted = line, passed
            past, planned = (*line.points[first:passed], tip), (tip, *line.points[passed : first + UNDER_WAY])
            parts = [(past, _colour(line, PAST)), (planned, _colour(line, PLANNED))]
            self._now, self._under_way.colors = _segments(parts, UNDER_WAY)
        elif tip == self._tip:
            return
        self._tip = tip
        if here:
            self._now[here - 1, 1] = tip
        if passed < len(line.points):
            self._now[here, 0] = tip
        move_points(self._under_way, self._now)


def _nearest(lines: Sequence[ToolLine], t: float, most: int) -> list[ToolLine]:
    """The lines nearest to a time [s] that have no more than `most` parts together."""
    count, kept = 0, list[ToolLine]()
    for line in sorted(lines, key=lambda one: max(one.begin - t, t - one.end)):
        count += len(line.points) - 1
        if count > most:
            break
        kept.append(line)
    return sorted(kept, key=lambda one: one.begin)


def _begins(before: ToolLine | None, line: ToolLine) -> bool:
    """Return whether a command takes over there; a stream of targets is one."""
    if before is None:
        return True
    steered = before.motion.kind is line.motion.kind is MotionKind.STEERED
    return before.motion.number != line.motion.number and not steered


def _colour(line: ToolLine, colour: Colour) -> Colour:
    blends = line.phase is Phase.BLEND and line.motion.kind is not MotionKind.STEERED
    return BLENDS[colour] if blends else colour


def _figure(lines: Sequence[ToolLine], passed: int, first: int | None) -> tuple[Points, NDArray[np.uint8]]:
    """Draw all lines; those before number `passed` are past. Of that one what is around the tip, from point `first` on,
    has no length.
    """

    def parts() -> Iterator[tuple[Sequence[Vector], Colour]]:
        for number, line in enumerate(lines):
            points = line.points
            if first is not None and number == passed:
                last = first + AROUND
                yield points[: first + 1], _colour(line, PAST)
                yield (points[first],) * len(points[first : last + 1]), _colour(line, PAST)
                yield points[last:], _colour(line, PLANNED)
            else:
                yield points, _colour(line, PAST if number < passed else PLANNED)

    return _segments(list(parts()), sum(len(line.points) - 1 for line in lines))


def _segments(parts: Sequence[tuple[Sequence[Vector], Colour]], count: int) -> tuple[Points, NDArray[np.uint8]]:
    """Polylines as `count` lines (count, 2, 3) with their colours, of which the last may have no length."""
    pairs = [pair for points, _ in parts for pair in pairwise(points)]
    inks = [colour for points, colour in parts for _ in points[1:]]
    found, colours = _none(count), np.zeros((count, 2, 3), np.uint8)
    if pairs:
        found[: len(pairs)] = pairs
        found[len(pairs) :] = pairs[-1][1]
        colours[: len(inks)] = np.array(inks, np.uint8)[:, None, :]
    return found, colours


def _none(count: int) -> Points:
    return np.zeros((count, 2, 3), np.float32)
