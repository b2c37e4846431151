"""What the installation has: packages that not everybody needs, and the folders that come with vrs."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path


def how_to_install(package: str) -> str:
    """Return the command for the Python that runs, which works wherever vrs itself was installed from."""
    python = f'"{sys.executable}"' if " " in sys.executable else sys.executable
    pip = f"{python} -m pip install" if find_spec("pip") else f"uv pip install --python {python}"
    return f"{pip} {package}"


def shipped_folder(name: str) -> Path:
    """Return the folder `grammar` or `programs` that comes with vrs: in the installed package, else in the checkout."""
    package = Path(__file__).resolve().parent
    inside = package / name
    return inside if inside.is_dir() else package.parent / name
