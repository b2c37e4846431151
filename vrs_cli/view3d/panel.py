"""The supervisor's panel: commands left, the live view right (Figure 7 of the paper)."""

from __future__ import annotations

from html import escape

import viser

from vrs_cli.errors import VrsError
from vrs_cli.interfaces.conversation.internal_error import internal_error
from vrs_cli.net.messages import LeaseAct
from vrs_cli.render.colours import Ink
from vrs_cli.view3d.drag import Gizmo
from vrs_cli.view3d.panel_front_end import PanelFrontEnd
from vrs_cli.view3d.panel_hand import HandPanel
from vrs_cli.view3d.panel_line import CommandLine
from vrs_cli.view3d.panel_programs import ProgramsPanel, SignalsPanel
from vrs_cli.view3d.parts import Hands, Shown, ShownPart, boxed, put
from vrs_cli.view3d.window import RobotWindow

WIDTH, LEAST, SHARE = 400.0, 320.0, 0.4  # [px] usually, at least, and of the page where that is narrow
DRIVE, ASK, RELEASE, GIVE = "Drive", "Ask to drive", "Let others drive", "Give to "
A_WHILE = 0.5  # [s] that a command takes before it is said to be under way
NO_CONNECTION = "No connection to the robot: it is tried again"


class Panel:
    """A part of a window with a robot. Who may not drive it sees its programs and signals, and who does.
    `parts`: itself, and what is shown beside it.
    """

    def __init__(self, window: RobotWindow) -> None:
        assert window.robot is not None, "a trajectory is not driven"
        assert window.surveying is not None, "a robot can be asked"
        self.robot, self._wall, self._surveying = window.robot, window.wall, window.surveying
        self._drives = window.drives
        self.front_end = PanelFrontEnd(window.robot, window.surveying.happened)
        self.hands = Hands(self._refused)
        self._breaks = self.robot.cuts + self.robot.stalls
        self._waits: tuple[int, float] = 0, 0.0  # the command that is waited for, since that time of the day [s]
        self.parts: list[ShownPart] = [self]
        gui = window.client.gui
        panel = gui.add_panel(order=-1.0)
        with panel.add_tab("Commands" if self._drives else "Robot", viser.Icon.TERMINAL_2):
            self.news = gui.add_html("")
            self.lease = gui.add_button_group("Nobody drives", (DRIVE,), visible=False)
            with gui.add_folder(None, visible=self._drives):
                self.line = CommandLine(gui, self.front_end, self.hands, self._wall)
            tabs = gui.add_tab_group()
            with tabs.add_tab("Programs"):
                self.programs = ProgramsPanel(gui, self.front_end, self.hands, self._surveying)
            if self._drives:
                with tabs.add_tab("Move"):
                    self.hand = HandPanel(gui, self.front_end, self.hands, window.watched.arm, self._wall)
                with tabs.add_tab("Drag"):
                    self.gizmo = Gizmo(window, self.robot, self.front_end, self.hands)
                    self.parts.append(self.gizmo)
            with tabs.add_tab("Signals"):
                self.signals = SignalsPanel(gui, self.front_end, self.hands, drives=self._drives)
        panel.dock_left()
        panel.set_width(min(WIDTH, max(LEAST, SHARE * window.width)))
        self.hands.on(self.lease, self._lease)

    def _lease(self, what: str) -> None:
        if what.startswith(GIVE):
            self.front_end.drive(LeaseAct.GIVE, what.removeprefix(GIVE))
        else:
            self.front_end.drive({DRIVE: LeaseAct.ACQUIRE, ASK: LeaseAct.ASK, RELEASE: LeaseAct.RELEASE}[what])

    def _refused(self, error: Exception) -> None:
        self.front_end.note(str(error) if isinstance(error, VrsError) else internal_error(error).text, Ink.ERROR)

    def show(self, shown: Shown) -> None:
        """Show what has come since."""
        if not shown.reads:
            return
        wall = self._wall()
        found, drives = shown.surveyed, self._drives and self.robot.open and self.front_end.may_drive
        self._show_state(wall)
        breaks = self.robot.cuts + self.robot.stalls
        if self._breaks != breaks:
            self._breaks = breaks
            self.line.drop()  # what was typed or moved before a cut, and is not sent, is not sent later
            if self._drives:
                self.hand.drop()
                self.gizmo.drop()
        self.line.refresh()
        if self._drives:
            self.hand.refresh(shown, found, drives=drives)
        if found is not None:
            self.programs.refresh(found, drives=drives)
            self.signals.refresh(found)

    def _show_state(self, wall: float) -> None:
        driver = self.front_end.who_drives(self.front_end.lease.driver)
        news = self._waited_for(wall) if self.robot.open else NO_CONNECTION
        news = news if self._drives else news or driver
        put(self.news, content=boxed(escape(news)), visible=bool(news))
        # who drives matters at a robot of one user only once that one has asked for it
        shares = self._drives and (bool(self.front_end.lease.driver) or not self.robot.one_user)
        put(self.lease, label=driver, options=self._offers(), visible=shares and self.robot.open)

    def _waited_for(self, wall: float) -> str:
        """Name the command that has been under way for a while; "" for none."""
        first = next(((id, text) for id, text in self.front_end.waiting.items() if text), None)
        if first is None or first[0] != self._waits[0]:
            self._waits = 0 if first is None else first[0], wall
        long = first is not None and wall > self._waits[1] + A_WHILE
        return f"Under way: {first[1]}" if first is not None and long else ""

    def _offers(self) -> tuple[str, ...]:
        lease = self.front_end.lease
        if not lease.driver:
            return (DRIVE,)
        if lease.driver != self.front_end.name:
            return (ASK,)
        return (*((GIVE + lease.asking,) if lease.asking else ()), RELEASE)

    def close(self) -> None:
        self.hands.close()
