"""The supervisor's panel: commands left, the live view right (Figure 7 of the paper)."""

from __future__ import annotations

from html import escape

import viser

from vrs_cli.errors import VrsError
from vrs_cli.interfaces.conversation.mishap import internal_error
from vrs_cli.net.messages import LeaseAct
from vrs_cli.render.colours import Ink
from vrs_cli.view3d.drag import Gizmo
from vrs_cli.view3d.panel_hand import HandPanel
from vrs_cli.view3d.panel_line import CommandLine
from vrs_cli.view3d.panel_parts import Hands, boxed, put
from vrs_cli.view3d.panel_programs import Programs
from vrs_cli.view3d.panel_seat import PanelSeat
from vrs_cli.view3d.panel_signals import SignalsPanel
from vrs_cli.view3d.shown import Shown
from vrs_cli.view3d.window import Window

WIDTH = 400.0  # [px]
OFTEN = 0.1  # [s] between two looks at what has come
DRIVE, ASK, RELEASE, GIVE = "Drive", "Ask to drive", "Let others drive", "Give to "
NO_CONNECTION = "No connection to the robot: it is tried again"


class Panel:
    """A part of a window whose robot can be driven."""

    def __init__(self, window: Window) -> None:
        assert window.robot is not None, "a trajectory is not driven"
        assert window.surveying is not None, "a robot can be asked"
        self.robot, self._wall, self._surveying = window.robot, window.wall, window.surveying
        self.seat = PanelSeat(window.robot, window.surveying.happened)
        self.hands = Hands(self._refused)
        self._due = 0.0
        self._build(window, window.client.gui)

    def _build(self, window: Window, gui: viser.GuiApi) -> None:
        seat, hands, wall = self.seat, self.hands, self._wall
        panel = gui.add_panel(order=-1.0)
        with panel.add_tab("Commands", viser.Icon.TERMINAL_2):
            self.stop = gui.add_button("STOP", color="red", icon=viser.Icon.HAND_STOP, hint="Brake, stop all tasks")
            self.lease = gui.add_button_group("Nobody drives", (DRIVE,), visible=False)
            self.news = gui.add_html("", visible=False)
            self.line = CommandLine(gui, seat, hands, wall)
            tabs = gui.add_tab_group()
            with tabs.add_tab("Programs"):
                self.programs = Programs(gui, seat, hands, self._surveying)
            with tabs.add_tab("Move"):
                self.hand = HandPanel(gui, seat, hands, self.robot.arm, wall)
            with tabs.add_tab("Drag"):
                self.gizmo = Gizmo(window, self.robot, seat, hands)
            with tabs.add_tab("Signals"):
                self.signals = SignalsPanel(gui, seat, hands)
        panel.dock_left()
        panel.set_width(WIDTH)
        panel.expand()  # on a phone too
        self.stop.on_click(lambda _event: seat.abort())  # waits for nothing that was clicked before
        hands.on(self.lease, self._lease)

    def _lease(self, what: str) -> None:
        if what.startswith(GIVE):
            self.seat.drive(LeaseAct.GIVE, what.removeprefix(GIVE))
        else:
            self.seat.drive({DRIVE: LeaseAct.ACQUIRE, ASK: LeaseAct.ASK, RELEASE: LeaseAct.RELEASE}[what])

    def _refused(self, error: Exception) -> None:
        self.seat.note(str(error) if isinstance(error, VrsError) else internal_error(error).text, Ink.ERROR)

    def show(self, shown: Shown) -> None:
        """What has come since; ten times a second are enough for what is read."""
        wall = self._wall()
        if wall < self._due:
            return
        self._due = wall + OFTEN
        found, drives = shown.surveyed, self.robot.open and self.seat.may_drive
        self._show_state()
        self.line.refresh()
        self.hand.refresh(shown, found, drives=drives)
        if found is not None:
            self.programs.refresh(found, drives=drives)
            self.signals.refresh(found)

    def _show_state(self) -> None:
        seat, lease = self.seat, self.seat.lease
        waits = next((text for text in seat.waiting.values() if text), "")
        news = f"Under way: {waits}" if self.robot.open else NO_CONNECTION
        put(self.news, content=boxed(escape(news)), visible=bool(waits) or not self.robot.open)
        put(self.lease, label=seat.who_drives(lease.driver), options=self._offers(), visible=self.robot.open)

    def _offers(self) -> tuple[str, ...]:
        lease = self.seat.lease
        if not lease.driver:
            return (DRIVE,)
        if lease.driver != self.seat.name:
            return (ASK,)
        return (*((GIVE + lease.asking,) if lease.asking else ()), RELEASE)

    def close(self) -> None:
        self.hands.close()
