"""VAL-II in a notebook: `%load_ext vrs_cli`, then `%%vrs` runs a cell as if it were typed at the prompt."""

from __future__ import annotations

from typing import Any


def load_ipython_extension(shell: Any) -> None:
    """IPython calls it for `%load_ext vrs_cli`."""
