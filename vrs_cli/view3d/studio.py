"""The parts of each scene; a scene that nobody drives, of a trajectory to be recorded or photographed; and a trajectory
as one HTML file that plays without a server and without the Internet.

The page is viser's own client with a recording of the scene inside it: what moves is sent again for each frame.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from itertools import pairwise
from math import floor, inf

import rich
import viser
from viser import SceneApi

from vrs_cli.engine.position import position_at
from vrs_cli.kinematics.arm import RobotArm
from vrs_cli.kinematics.model import RobotModel, levers
from vrs_cli.render.browser import PictureError
from vrs_cli.trajectory.segment import Phase
from vrs_cli.trajectory.timeline import Timeline
from vrs_cli.view3d.contact_marks import ContactMarks
from vrs_cli.view3d.figure import FIELD, Figure, Stage, backdrop, camera_for
from vrs_cli.view3d.parts import Shown, ShownPart, put
from vrs_cli.view3d.paths import USUAL, Around, Path
from vrs_cli.view3d.scene_bodies import SceneBodies
from vrs_cli.world.world import World

MOST_SEGMENTS = 400  # whose way is drawn as usual: a recording has all of it anew for each of them, 30 MB for so many
NEAR = Around(before=5.0, after=5.0, step=5.0)  # of more segments
HOST = "127.0.0.1"
TENTHS = 10  # of a second in a caption: finer figures are not read while they change


def scenery(scene: SceneApi, model: RobotModel, world: World | None, around: Around = USUAL) -> list[ShownPart]:
    """Make all parts of the scene itself, with the way of the tool so far `around` the present, and what is in the
    world, red where it touches.
    """
    arm = ArmScene(scene, model, world)
    parts: list[ShownPart] = [arm, Path(scene, model, around=around)]
    if world is not None:
        bodies = SceneBodies(scene, world)
        parts += bodies, ContactMarks(world, arm.figure, bodies)
    return parts


class ArmScene:
    """The robot where it is, with what is around it. In a cell its fingers stop at the part that they hold."""

    def __init__(self, scene: SceneApi, model: RobotModel, world: World | None = None) -> None:
        self._stage, self.figure, self._world = Stage(scene, model), Figure(scene, "/robot", model), world

    def show(self, shown: Shown) -> None:
        base, hand = shown.frames.base, shown.position.hand
        if self._world is not None:
            hand = self._world.course(shown.timeline).opening(shown.t)
        self._stage.pose(shown.position.T_world_tool, base)
        self.figure.pose(shown.position.joints, hand, base)


class Studio:
    """A scene of a timeline, one moment at a time; with `parts` that only some pictures have. Of the way
    of the tool it is less where there are many segments.
    """

    def __init__(
        self, scene: SceneApi, arm: RobotArm, timeline: Timeline, world: World | None, *parts: ShownPart
    ) -> None:
        self._arm, self._timeline = arm, timeline
        backdrop(scene)
        seen = scenery(scene, arm.model, world, NEAR if len(timeline) > MOST_SEGMENTS else USUAL)
        self._parts: tuple[ShownPart, ...] = (*seen, *parts)

    def show(self, t: float) -> Shown:
        """The moment t [s]."""
        shown = Shown(self._arm, self._timeline, t, position_at(self._arm, self._timeline, t), t)
        for part in self._parts:
            part.show(shown)
        return shown


@contextmanager
def server() -> Iterator[viser.ViserServer]:
    """A viser on a free port of this machine, for as long as something is recorded or photographed.

    viser tells its address on standard output, which may be where a page goes; and a browser opens a connection in
    advance that it may not need, which the library of its server logs as a fault. Neither is seen meanwhile.
    """
    console, log = rich.get_console(), logging.getLogger("websockets.server")
    quiet, disabled = console.quiet, log.disabled
    console.quiet = log.disabled = True
    try:
        made = viser.ViserServer(host=HOST, port=0, verbose=False)
        try:
            yield made
        finally:
            made.stop()
    finally:
        console.quiet, log.disabled = quiet, disabled


class Caption:
    """The time and the command that moves the robot, above the arm."""

    def __init__(self, scene: SceneApi, model: RobotModel) -> None:
        (_, _, foot), reaches = levers(model)
        height = foot + 1.05 * reaches[0]
        self._label = scene.add_label(
            "/caption", "", anchor="bottom-center", position=(0.0, 0.0, height), font_screen_scale=1.5
        )

    def show(self, shown: Shown) -> None:
        put(self._label, text=caption(shown))


def caption(shown: Shown) -> str:
    """`3.2 s  MOVES part`, the command only while it moves the robot."""
    t = floor(shown.t * TENTHS + 1e-6) / TENTHS
    command = shown.position.text if shown.position.moving else ""
    return f"{t:.1f} s  {command}".rstrip()


# --- pages -----------------------------------------------------------------------------------------------------------


RATE = 30.0  # [1/s] frames while the robot moves
REST_RATE = 1.0  # [1/s] while it stands still: the caption goes on
MOST_FRAMES = 18_000  # 10 minutes at 30 frames a second: about 5 MB, and what a browser still holds with ease
HOLD = 1.0  # [s] the end is seen before a page begins again
ASPECT = 0.8  # of the picture, width to height: all of the arm is seen below a cell, and nearly all of it on a phone
TITLE = "<title>Viser</title>"  # of viser's client


def usual_rate(timeline: Timeline) -> float:
    """30 frames a second, fewer where more than ten minutes move [1/s]."""
    moving = sum(last - first for first, last, moves in stretches(timeline) if moves)
    return min(RATE, MOST_FRAMES / max(moving, 1.0))


def page(
    arm: RobotArm,
    timeline: Timeline,
    rate: float,
    world: World | None = None,
    between: tuple[float, float] = (-inf, inf),
) -> str:
    """A page that plays a timeline `between` two times [s], with so many frames a second. The same text for the same
    timeline.

    Raises PictureError for more frames than a page can hold.
    """
    first, last = (min(max(t, timeline.start), timeline.end) for t in between)
    times = [first, *(t for t in frame_times(timeline, rate) if first < t < last), *[last] * (last > first)]
    if len(times) > 2 * MOST_FRAMES:
        raise PictureError(
            f"{len(times)} frames are more than a page holds",
            f"without --rate there are {usual_rate(timeline):.3g} a second",
        )
    with server() as viser, viser.atomic():  # nobody is woken for each message
        studio = Studio(viser.scene, arm, timeline, world, Caption(viser.scene, arm.model))
        studio.show(times[0])
        camera = camera_for(arm.model, ASPECT)
        viser.initial_camera.position, viser.initial_camera.look_at = camera
        viser.initial_camera.fov = FIELD
        recording = viser.get_scene_serializer()
        for before, t in pairwise(times):
            recording.insert_sleep(t - before)
            studio.show(t)
        recording.insert_sleep(HOLD)
        html = recording.as_html()
    return html.replace(TITLE, f"<title>{escape(arm.model.title)}</title>", 1)


DATA = "<script>window.__VISER_EMBED_DATA__"  # where the recording of a page of viser begins
LOADER = """<script>
(function () {
  var name = location.hash.slice(1);
  if (/^[A-Za-z0-9_.-]+$/.test(name)) document.write('<script src="replays/' + name + '.js"><' + '/script>');
})();
</script>"""


def viewer_and_recording(html: str) -> tuple[str, str]:
    """Split a page into a viewer, which plays the recording `replays/NAME.js` beside it as `viewer.html#NAME`, and the
    text of such a file. The viewer is the same for all pages of a robot.
    """
    begin = html.index(DATA)
    end = html.index("</script>", begin)
    return html[:begin] + LOADER + html[end + len("</script>") :], html[begin + len("<script>") : end] + "\n"


Stretch = tuple[float, float, bool]  # from, to [s], whether the robot moves


def stretches(timeline: Timeline) -> list[Stretch]:
    """The times in which the robot moves, and in which it stands, in their order."""
    found: list[Stretch] = []
    for segment in timeline:
        for first, last, moves in (
            (found[-1][1] if found else timeline.start, segment.start, False),
            (segment.start, segment.finish, segment.phase is not Phase.REST),
        ):
            if found and found[-1][2] is moves:
                found[-1] = (found[-1][0], max(last, found[-1][1]), moves)
            elif last > first:
                found.append((first, last, moves))
    return found


def frame_times(timeline: Timeline, rate: float) -> Iterator[float]:
    """The times of the frames: `rate` times a second while the robot moves, and where it begins and ends to [s]."""
    yield timeline.start
    for first, last, moves in stretches(timeline):
        step = 1.0 / (rate if moves else REST_RATE)
        count = round((last - first) / step - 0.5)
        yield from (first + k * step for k in range(1, count + 1) if first + k * step < last)
        yield last
