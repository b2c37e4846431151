"""How a package that not everybody needs (for plots, logs, the language server) is installed."""

from __future__ import annotations

import sys
from importlib.util import find_spec


def how_to_install(package: str) -> str:
    """The command for the Python that runs, which works wherever vrs itself was installed from."""
    python = f'"{sys.executable}"' if " " in sys.executable else sys.executable
    pip = f"{python} -m pip install" if find_spec("pip") else f"uv pip install --python {python}"
    return f"{pip} {package}"
