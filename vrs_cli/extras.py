"""Find what is installed: optional packages, the folders that come with vrs, the built page."""

from __future__ import annotations

import sys
from importlib.util import find_spec
from pathlib import Path

MESH_PACKAGES = "pillow pycollada trimesh"  # of the extra `mesh`: textures, DAE files, and all others
BUILT_PAGE = Path(__file__).resolve().parent / "page" / "built"


def how_to_install(package: str) -> str:
    """Return the command that installs a package for the Python that runs."""
    python = _quote(sys.executable)
    pip = f"{python} -m pip install" if find_spec("pip") else f"uv pip install --python {python}"
    return f"{pip} {package}"


def shipped_folder(name: str) -> Path:
    """Return the folder `grammar` or `programs` that comes with vrs: in the installed package, else in the checkout."""
    package = Path(__file__).resolve().parent
    inside = package / name
    return inside if inside.is_dir() else package.parent / name


def built_page() -> Path | None:
    """Return the folder of the built page for the browser (`index.html`, `assets/`, ...); None if it is not built."""
    return BUILT_PAGE if (BUILT_PAGE / "index.html").is_file() else None


def how_to_build_page() -> str:
    """Return the command that builds the page: in this checkout, or by a new installation from the same source."""
    builder = BUILT_PAGE.parent / "hatch_build.py"
    if builder.is_file():
        return f"{_quote(sys.executable)} {_quote(str(builder))}"
    return how_to_install(f"--force-reinstall --no-deps --no-cache-dir {_quote(_origin())}")


def _origin() -> str:
    """Return the folder or address that vrs was installed from, or its name at the package index."""
    import json
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        record = distribution("vrs-cli").read_text("direct_url.json")
    except PackageNotFoundError:
        record = None
    return str(json.loads(record)["url"]) if record else "vrs-cli"


def _quote(word: str) -> str:
    return f'"{word}"' if " " in word else word
