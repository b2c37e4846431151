"""The view in browsers: a page of this machine, for each browser a window with a robot of its own to hold, filled with
the scene and the panels, and one thread that shows them what is to be seen.
"""

from __future__ import annotations

import json
import logging
import time
import warnings
from collections.abc import Callable
from functools import partial
from math import inf, tan
from threading import Event, Lock, Thread

import numpy as np
import rich
import viser

from vrs_cli.engine.position import Watched
from vrs_cli.errors import RequestRefused, VrsError
from vrs_cli.interfaces.conversation.internal_error import internal_error
from vrs_cli.language.run.signals import Cell
from vrs_cli.net.messages import Abort
from vrs_cli.net.socket_port import SocketPort
from vrs_cli.view3d.bar import PlaybackBar, Plots
from vrs_cli.view3d.door import HOST, Door, opened
from vrs_cli.view3d.figure import FIELD, backdrop, camera_for, looks_of
from vrs_cli.view3d.ghosts import BranchGhosts, DelayPanel, GoalGhost
from vrs_cli.view3d.guard import Guard
from vrs_cli.view3d.panel import Panel
from vrs_cli.view3d.parts import Shown
from vrs_cli.view3d.paths import Path
from vrs_cli.view3d.places import PlacesView, Reasons, explain_refusal
from vrs_cli.view3d.reach import LimitsView, ReachView
from vrs_cli.view3d.studio import scenery
from vrs_cli.view3d.window import TITLE, RobotWindow, error_text
from vrs_cli.world.world import World

ORANGE = (222, 120, 40)  # of what can be pressed
EDGE = 12.0  # [px] from the edges of the picture
HEIGHT = 166.0  # [px] of the bar of time
SHEET = 300.0  # [px] that viser's sheet has at the foot of a phone, when nothing else in it is open
PHONE = 800.0  # [px] of the width of a page, where that sheet takes the place of panels
CHOICES = 230.0  # [px] the width of the panel of what is to be shown


def _add_choices(window: RobotWindow) -> Reasons:
    """Add the parts that are shown as somebody wants it, with their boxes in the panel that is open now. What is
    returned shows why motions are refused."""
    scene, arm, robot = window.client.scene, window.watched.arm, window.robot

    def box(part: object, shows: str, label: str, hint: str, *, at_first: bool = False) -> None:
        """A box that sets an attribute of a part."""
        handle = window.client.gui.add_checkbox(label, at_first, hint=hint)
        handle.on_update(window.doing(lambda: setattr(part, shows, handle.value)))

    path = next(part for part in window.parts if isinstance(part, Path))
    goal, limits = GoalGhost(scene, arm.model), LimitsView(scene, "/robot", arm.model)
    reach, reasons = ReachView(scene, "/robot", arm), Reasons(scene, arm.model)
    window.parts += (goal, limits, reach, reasons)
    box(path, "visible", "Path", "Past blue, planned orange, lighter where motions blend", at_first=True)
    box(path, "commands", "Commands", "The text of each command where its motion begins")
    box(goal, "visible", "Goal", "The arm as it will stand when the motion ends", at_first=True)
    box(limits, "visible", "Joint ranges", "How far each joint goes, and where it is")
    if arm.turning[0]:  # only such an arm has a boundary
        box(reach, "visible", "Reach", "How far the tool gets in this configuration")
    if robot is not None:
        places, branches = PlacesView(scene, arm.model), BranchGhosts(scene, arm, robot, window.again)
        window.parts += (places, branches)
        box(places, "visible", "Places", "The locations that have names", at_first=True)
        box(branches, "visible", "Branches", "The arm as other branches move it", at_first=True)
    return reasons


class Edges:
    """viser's own panel, which has the bar, is as wide as the picture, however wide that is."""

    def __init__(self, window: RobotWindow) -> None:
        self._window, self._panel, self._width = window, window.client.gui.main_panel, window.width
        self._panel.float(x=EDGE, y=-EDGE, width=self._wide, height=HEIGHT)

    def show(self, _shown: Shown) -> None:
        if self._width != self._window.width:
            self._width = self._window.width
            self._panel.set_width(self._wide)

    @property
    def _wide(self) -> float:
        return max(self._width - 2.0 * EDGE, CHOICES)


def furnish(window: RobotWindow, title: str) -> None:
    """Add all parts of a window, in the order in which they are shown. `choices` has the boxes of `_add_choices`."""
    client, model = window.client, window.watched.arm.model
    with client.atomic():
        window.parts.extend(scenery(client.scene, model, window.world))
        _look(window)
        window.tick(window.wall())
    client.flush()  # the robot is seen before there are panels, which a page takes longer to make
    if said := looks_of(model).missing:
        window.tell(said)
    gui = client.gui
    gui.configure_theme(show_logo=False, show_share_button=False, brand_color=ORANGE)
    gui.set_panel_label(title)
    choices = gui.add_panel()
    window.parts.append(Edges(window))
    bar = PlaybackBar(window)
    window.parts.append(bar)
    with choices.add_tab("Show"):
        reasons = _add_choices(window)
        window.parts.append(Plots(window, bar))
    choices.float(x=-EDGE, y=EDGE, width=CHOICES)
    choices.minimize()
    if window.robot is not None:
        panel = Panel(window)
        panel.front_end.explained = reasons.explain  # what is typed, and refused, is shown with its reason
        panel.front_end.refused = partial(explain_refusal, window.robot, reasons.explain)
        window.parts += panel.parts
        window.closing.append(panel.hands.close)
        window.type = panel.front_end.type
        window.parts.append(DelayPanel(window, window.robot))


def _look(window: RobotWindow) -> None:
    """Aim the camera so that all of the robot is seen above the bar."""
    camera, base = window.client.camera, window.watched.timeline[-1].motion.frames.base
    covers = SHEET if window.width < PHONE else HEIGHT + EDGE
    height = max(float(camera.image_height), 1.0)  # [px]: a page that nobody sees may have none
    hidden = min(covers / height, 0.5)
    seen = camera_for(window.watched.arm.model, window.width / height / (1.0 - hidden), base)
    eye, aim = np.array(seen.position), np.array(seen.look_at)
    away = (eye - aim) / (1.0 - hidden)
    lower = np.array((0.0, 0.0, hidden * np.linalg.norm(away) * tan(0.5 * FIELD)))
    camera.fov = FIELD
    camera.position, camera.look_at = aim + away - lower, aim - lower


# --- the view --------------------------------------------------------------------------------------------------------


AGAIN = 2.0  # [s] until a robot that does not answer is asked again

Told = Callable[[str], None]


class _Viser(viser.ViserServer):
    """A viser that never opens a way from outside to this machine."""

    def request_share_url(self, verbose: bool = True) -> str | None:  # noqa: ARG002
        return None


class App:
    """`hold`: takes hold of the robot for one more browser; what becomes of the connection is told to what it is given.
    `door`: where browsers come in, a new one if there is none. `title`: of the page, that of the robot where it is
    empty. `rate`: seconds of a trajectory in one second, at first. `first`: what is done with the first window, once.
    `cell`: around the robot, whose parts and sensors are shown.
    """

    def __init__(
        self,
        hold: Callable[[Told], SocketPort | Watched],
        *,
        door: Door | None = None,
        title: str = "",
        rate: float = 1.0,
        cell: Cell | None = None,
        first: Callable[[RobotWindow], object] = lambda _window: None,
        tell: Told = lambda _text: None,
        wall: Callable[[], float] = time.monotonic,
    ) -> None:
        self._hold, self._title, self._tell, self._wall = hold, title, tell, wall
        self._rate, self._first, self._cell = rate, first, cell
        self._windows: dict[int, RobotWindow] = {}
        self._gone: set[int] = set()  # browsers that went before there was a window
        self._lock, self._stirred, self._ended = Lock(), Event(), Event()
        self._came = False  # whether there was a window
        door = door or opened()
        self.address = door.address
        guard = Guard(door, lambda error: self._tell(internal_error(error).text), self._look, self._stop)
        self._viser = _serve(guard)
        backdrop(self._viser.scene)  # all browsers hear of it before their windows are furnished
        self._viser.on_client_connect(self._come)
        self._viser.on_client_disconnect(self._go)
        self._thread = Thread(target=self._run, name="vrs view", daemon=True)
        self._thread.start()
        guard.let_in()

    @property
    def windows(self) -> tuple[RobotWindow, ...]:
        with self._lock:
            return tuple(self._windows.values())

    def close(self) -> None:
        """Every browser is let go."""
        self._ended.set()
        self._stirred.set()
        self._thread.join()
        self._viser.stop()
        for window in self.windows:
            window.close()

    # --- browsers ---

    def _come(self, client: viser.ClientHandle) -> None:
        """A browser is there; it is shown why where that cannot be."""
        try:
            watched = self._held(client)
            if watched is None:
                return
            window = self._furnished(client, watched)
        except Exception as error:
            said = error_text(error)
            client.add_notification(TITLE, said, color="red")
            self._tell(said)
            return
        with self._lock:
            there = client.client_id not in self._gone
            first, self._came = there and not self._came, there or self._came
            if there:
                self._windows[client.client_id] = window
        if not there:
            window.close()
            return
        self._stirred.set()
        if first:
            window.doing(lambda: self._first(window))(None)

    def _furnished(self, client: viser.ClientHandle, held: SocketPort | Watched) -> RobotWindow:
        # viser gathers what comes within that time, and wakes for it: a tick is gathered as it is
        client._websock_connection.get_message_buffer().window_duration_sec = 0.0
        window = RobotWindow(client, held, self._wall, self._rate, self._stirred.set)
        try:
            if window.robot is not None:  # what it says may be seen
                window.robot.listen(lambda _message: window.wake())
            window.world = None if window.robot is None else window.robot.far.world
            if window.world is None and self._cell is not None:
                window.world = World(window.watched.arm, self._cell)
            furnish(window, self._title or window.watched.arm.model.title)
        except BaseException:
            window.close()  # nobody else knows of it
            raise
        return window

    def _held(self, client: viser.ClientHandle) -> SocketPort | Watched | None:
        """The robot; it is asked for again as long as it does not answer and the browser is there."""
        waiting: viser.NotificationHandle | None = None
        while not self._ended.is_set() and client.client_id not in self._gone:
            try:
                watched = self._hold(lambda text: self._cut(client.client_id, text))
            except RequestRefused as refused:
                if waiting is None:
                    waiting = client.add_notification(TITLE, "", loading=True, with_close_button=False)
                waiting.body = str(refused)
                self._ended.wait(AGAIN)
                continue
            if waiting is not None:
                waiting.remove()
            return watched
        return None

    def _go(self, client: viser.ClientHandle) -> None:
        with self._lock:
            self._gone.add(client.client_id)
            window = self._windows.pop(client.client_id, None)
        if window is not None:
            window.close()

    def _cut(self, number: int, why: str) -> None:
        """The connection of a window is cut."""
        with self._lock:
            window = self._windows.get(number)
        if window is not None:
            window.why_cut = why

    # --- what pages ask for beside viser ---

    def _look(self) -> str:
        """Say as JSON whether the robot may be stopped from here, and since when it is not heard."""
        windows = [window for window in self.windows if window.robot is not None]
        found = {"drives": any(window.drives for window in windows), "lost": next(filter(None, map(lost, windows)), "")}
        return json.dumps(found)

    def _stop(self) -> str:
        """The emergency stop, from whichever page: all are of the same user. Empty, or why it was not done."""
        robots = [window.robot for window in self.windows if window.robot is not None and window.drives]
        robot = next((robot for robot in robots if robot.open), *robots[:1] or (None,))
        if robot is None:
            return "STOP did not reach the robot."
        try:
            robot.ask(Abort)
        except VrsError as error:
            return f"STOP did not reach the robot. {error}"
        return ""

    # --- time ---

    def _run(self) -> None:
        """Show each window when it is due, and wait for what happens meanwhile."""
        while True:
            self._stirred.clear()
            if self._ended.is_set():
                return
            for window in self.windows:
                if window.due <= self._wall():
                    try:
                        window.tick(self._wall())
                    except Exception as error:  # all others go on
                        window.tell(internal_error(error).text)
            due = min((window.due for window in self.windows), default=inf)
            self._stirred.wait(None if due == inf else max(due - self._wall(), 0.0))


def lost(window: RobotWindow) -> str:
    """Since when the robot of a window is not heard; empty where it is."""
    silent = None if window.robot is None else window.robot.far.unheard
    if window.robot is None or silent is None:
        return ""
    since = time.strftime("%H:%M:%S", time.localtime(time.time() - silent))
    if window.robot.open:
        return f"Nothing is heard of the robot since {since}. What is seen was planned then. STOP may not reach it."
    why = f" ({window.why_cut})" if window.why_cut else ""
    return f"No connection to the robot since {since}{why}. What is seen was planned then. STOP does not reach it."


def _serve(guard: Guard) -> _Viser:
    rich.reconfigure(quiet=True)  # viser tells its address, which is not the whole one
    logging.getLogger("websockets.server").disabled = True  # browsers open connections that they do not use
    warnings.filterwarnings("ignore", ".* on a closed connection", UserWarning)  # browsers go when they like
    with guard.standing():
        server = _Viser(host=HOST, port=0, verbose=False)  # which it is not asked for, behind a guard
    if not guard.stands:
        server.stop()
        raise RuntimeError("this viser opens its server in another way: nobody would guard it")
    return server
