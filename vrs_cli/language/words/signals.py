"""The numbers of digital signals: outputs, inputs, and internal (software) ones."""

from __future__ import annotations

SIGNALS_A_BANK = 512
OUTPUTS = range(1, 1 + SIGNALS_A_BANK)
INPUTS = range(1001, 1001 + SIGNALS_A_BANK)
INTERNAL = range(2001, 2001 + SIGNALS_A_BANK)
