"""Programs at a panel: one with its steps, the present one lit, and what runs and stops it. Signals as lamps."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

import viser

from vrs_cli.language.words.values import INPUTS, INTERNAL, OUTPUTS
from vrs_cli.render.html import pieces_html
from vrs_cli.render.scan import scan
from vrs_cli.values.acts import StepList, Surveyed, TaskRow
from vrs_cli.view3d.panel_front_end import PanelFrontEnd
from vrs_cli.view3d.parts import OFF, ON, Hands, boxed, put
from vrs_cli.view3d.window import Surveying

RUN, STEP, PROCEED, PAUSE, GO_ON, ABORT = "Run", "Step", "Proceed", "Pause", "Go on", "Abort"
NONE = "(none in memory)"
HEIGHT = "15em"
LIT = "background:#ffe08a;color:#000"  # the step that is being done
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
        pace = self._front_end.status.pace
        clock = () if pace is None else (GO_ON if pace.paused else PAUSE,)
        put(self.run, options=(RUN, STEP, PROCEED, *clock, ABORT))
        self._list(found)
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
