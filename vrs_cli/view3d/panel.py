"""The supervisor's panel: commands left, the live view right (Figure 7 of the paper). Its programs: one with its steps,
the present one lit, and what runs and stops it; and signals as lamps.
"""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

import viser

from vrs_cli.language.words.values import INPUTS, INTERNAL, OUTPUTS
from vrs_cli.net.messages import LeaseAct
from vrs_cli.render.colours import Ink
from vrs_cli.render.displaced import untrue_sentence
from vrs_cli.render.html import pieces_html
from vrs_cli.render.scan import scan
from vrs_cli.values.acts import StepList, Surveyed, TaskRow
from vrs_cli.values.results import Untrue
from vrs_cli.view3d.panel_front_end import PanelFrontEnd
from vrs_cli.view3d.panel_hand import Gizmo, HandPanel
from vrs_cli.view3d.panel_line import CommandLine
from vrs_cli.view3d.parts import OFF, ON, Hands, Shown, ShownPart, boxed, put
from vrs_cli.view3d.window import RobotWindow, Surveying, error_text

RUN, STEP, PROCEED, PAUSE, GO_ON, ABORT = "Run", "Step", "Proceed", "Pause", "Go on", "Abort"
NONE = "(none in memory)"
HEIGHT = "15em"
LIT = "background:#ffe08a;color:#000"  # the step that is being done
UNTRUE = "color:#c62828"
STANDS = "background:#e4e4e4;color:#000"  # the step at which a program has stopped


class ProgramsPanel:
    """`lead`: what drives is hidden where somebody else does."""

    def __init__(self, gui: viser.GuiApi, front_end: PanelFrontEnd, hands: Hands, surveying: Surveying) -> None:
        self._front_end, self._surveying = front_end, surveying
        self._shown: tuple[object, ...] = ()
        self.choice = gui.add_dropdown("Program", (NONE,))
        self.leading = gui.add_folder(None)
        with self.leading:
            self.run = gui.add_button_group("Do", (RUN, STEP, PROCEED, PAUSE, ABORT))
        self.state = gui.add_html("", visible=False)
        self.untrue = gui.add_html("", visible=False)
        self.steps = gui.add_html("")
        self.loading = gui.add_folder(None)
        with self.loading:
            self.upload = gui.add_upload_button("Load a program file (.v2)", icon=viser.Icon.UPLOAD)
        hands.on(self.choice, self._choose)
        hands.on(self.run, self._do)
        hands.on(self.upload, lambda file: front_end.load(file.name, file.content))

    # --- what is done ---

    def _choose(self, name: str) -> None:
        self._surveying.program = "" if name == NONE else name
        self._surveying.happened()

    def _do(self, what: str) -> None:
        front_end, task = self._front_end, self._surveying.task
        name = self.choice.value
        if name == NONE and what in (RUN, STEP):
            front_end.note("No program is in memory: type one, or load a file")
            return
        stopped = task is not None and not task.running and task.step is not None
        goes_on = stopped and task is not None and task.program.lower() == name.lower()
        commands = {
            RUN: f"EXECUTE {name}",
            STEP: "SSTEP" if goes_on else f"SSTEP {name}",
            PROCEED: "PROCEED",
            PAUSE: "CLOCK PAUSE",
            GO_ON: "CLOCK GO",
            ABORT: "ABORT",
        }
        front_end.command(commands[what])

    # --- what is seen ---

    def refresh(self, found: Surveyed, *, drives: bool) -> None:
        put(self.leading, visible=drives)
        put(self.loading, visible=drives)
        pace = self._front_end.robot.status().pace
        clock = () if pace is None else (GO_ON if pace.paused else PAUSE,)
        put(self.run, options=(RUN, STEP, PROCEED, *clock, ABORT))
        self._list(found)
        put(self.untrue, content=boxed(_untrue_lines(found.untrue)), visible=bool(found.untrue))
        task = self._surveying.task
        shown = found.text, task
        if shown != self._shown:
            self._shown = shown
            put(self.steps, content=_listing(found.text, task))
            put(self.state, content=boxed(_said(task)), visible=task is not None)

    def _list(self, found: Surveyed) -> None:
        rows = found.programs.rows if found.programs is not None else ()
        names = tuple(row.name for row in rows) or (NONE,)
        put(self.choice, options=names)
        task = self._surveying.task
        wanted = self._surveying.program or ("" if task is None else task.program)
        known = {name.lower(): name for name in names}
        put(self.choice, value=known.get(wanted.lower(), self.choice.value))
        if not self._surveying.program and task is None and names != (NONE,):
            self._surveying.program = self.choice.value


def _said(task: TaskRow | None) -> str:
    if task is None:
        return ""
    where = "" if task.step is None else f", step {task.step}"
    asks = f", asks: {task.asks}" if task.asks else ""
    return f"<b>{escape(task.program)}</b> {escape(task.state)}{where}{escape(asks)}"


def _untrue_lines(readings: Iterable[Untrue]) -> str:
    """What programs have read of signals and no longer holds."""
    lines = (f'<div style="{UNTRUE}">{escape(untrue_sentence(one))}</div>' for one in readings)
    return "".join(lines)


def _listing(text: StepList | None, task: TaskRow | None) -> str:
    """The steps, with a mark at the present one, to which the page scrolls (`addition`)."""
    if text is None:
        return boxed("Programs are typed as .PROGRAM name() ... .END, or loaded from a file.")
    here = task.step if task is not None and task.program.lower() == text.name.lower() else None
    style = LIT if task is not None and task.running else STANDS
    rows = [f"<div>{pieces_html(scan(text.header))}</div>"]
    before = text.rows[0].number - 1 if text.rows else 0
    if before:
        rows.append(f"<div>... {before} steps before</div>")
    for row in text.rows:
        mark = f' style="{style}" data-step="here"' if row.number == here else ""
        wrong = "?" if row.bad else " "
        rows.append(f"<div{mark}>{row.number:>4}{wrong}{pieces_html(scan(row.text))}</div>")
    if text.more:
        rows.append(f"<div>... {text.more} steps more</div>")
    return boxed(f'<div style="max-height:{HEIGHT};overflow:auto;white-space:pre">{"".join(rows)}</div>')


USUAL = 8  # signals of a bank that are there always
MOST = 32  # of a bank
BANKS = (("Outputs", OUTPUTS, USUAL), ("Inputs", INPUTS, USUAL), ("Internal", INTERNAL, 0))


class SignalsPanel:
    """Each signal is a button with a lamp, which switches it for who may drive. Those that are on are there too,
    whatever their number.
    """

    def __init__(self, gui: viser.GuiApi, front_end: PanelFrontEnd, hands: Hands, *, drives: bool) -> None:
        self._front_end = front_end
        self._on: frozenset[int] = frozenset()
        self.banks = {
            title: gui.add_button_group(title, _lamps(bank[:usual], frozenset()) or ("",), visible=bool(usual))
            for title, bank, usual in BANKS
        }
        for handle in self.banks.values() if drives else ():
            hands.on(handle, self._switch)

    def _switch(self, lamp: str) -> None:
        number = int(lamp.split()[-1])
        self._front_end.command(f"SIGNAL {-number if number in self._on else number}", again="SIGNAL")

    def refresh(self, found: Surveyed) -> None:
        self._on = frozenset(found.on)
        for title, bank, usual in BANKS:
            there = sorted({*bank[:usual], *(number for number in found.on if number in bank)})[:MOST]
            handle = self.banks[title]
            if there:
                put(handle, options=_lamps(there, self._on))
            put(handle, visible=bool(there))


def _lamps(numbers: Iterable[int], on: frozenset[int]) -> tuple[str, ...]:
    return tuple(f"{ON if number in on else OFF} {number}" for number in numbers)


# --- the panel -------------------------------------------------------------------------------------------------------


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
        self.hands = Hands(lambda error: self.front_end.note(error_text(error), Ink.ERROR))
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
        if lease.driver != self.robot.name:
            return (ASK,)
        return (*((GIVE + lease.asking,) if lease.asking else ()), RELEASE)
