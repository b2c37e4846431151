"""Signals at a panel: lamps that are switches."""

from __future__ import annotations

from collections.abc import Iterable

import viser

from vrs_cli.language.words.signals import INPUTS, INTERNAL, OUTPUTS
from vrs_cli.values.acts import Surveyed
from vrs_cli.view3d.panel_front_end import PanelFrontEnd
from vrs_cli.view3d.panel_parts import OFF, ON, Hands, put

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
