"""Find what is installed: optional packages, the folders shipped with vrs, the built page. Also keep computed data in
the user's cache folder."""

from __future__ import annotations

import marshal
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from importlib.util import find_spec, source_hash
from typing import TypeVar

from vrs_cli.version import __version__

V = TypeVar("V")
PACKAGE = os.path.dirname(os.path.realpath(__file__))

# packages of the extra `mesh`: for textures, for DAE files, for all mesh files
MESH_PACKAGES = "pillow pycollada trimesh"
BUILT_PAGE = os.path.join(PACKAGE, "page", "built")


def how_to_install(package: str) -> str:
    """Return the command that installs a package for the Python that runs vrs."""
    python = _quote(sys.executable)
    pip = f"{python} -m pip install" if find_spec("pip") else f"uv pip install --python {python}"
    return f"{pip} {package}"


def shipped_folder(name: str) -> str:
    """Return the folder `grammar` or `programs` that comes with vrs: in the installed package, else in the checkout."""
    inside = os.path.join(PACKAGE, name)
    return inside if os.path.isdir(inside) else os.path.join(os.path.dirname(PACKAGE), name)


def built_page() -> str | None:
    """Return the folder of the built page for the browser (`index.html`, `assets/`, ...); None if it is not built."""
    return BUILT_PAGE if os.path.isfile(os.path.join(BUILT_PAGE, "index.html")) else None


def how_to_build_page() -> str:
    """Return the command that builds the page: in this checkout, or by a new installation from the same source."""
    builder = os.path.join(os.path.dirname(BUILT_PAGE), "hatch_build.py")
    if os.path.isfile(builder):
        return f"{_quote(sys.executable)} {_quote(builder)}"
    return how_to_install(f"--force-reinstall --no-deps --no-cache-dir {_quote(_origin())}")


def _origin() -> str:
    """Return the folder or address of the source from which vrs was installed, or its name in the package index."""
    import json
    from importlib.metadata import PackageNotFoundError, distribution

    try:
        record = distribution("vrs-cli").read_text("direct_url.json")
    except PackageNotFoundError:
        record = None
    return str(json.loads(record)["url"]) if record else "vrs-cli"


def _quote(word: str) -> str:
    return f'"{word}"' if " " in word else word


# --- the user's cache -------------------------------------------------------------------------------------------------

# length of the hash before the data, which detects damage and data of another Python release; marshal does not
HASH_BYTES = 8


def cached(name: str, source: str, make: Callable[[], V]) -> V:
    """Return the result of `make`, which depends on `source` alone.

    Read the result from the file `name` of the cache folder if this version of vrs wrote it for the same source.
    Otherwise compute the result, and write the file unless the result is None. The result must be plain data: numbers,
    strings, tuples, lists and dictionaries.
    """
    key, file = (__version__, source), _cache_file(name)
    with suppress(OSError, EOFError, ValueError, TypeError):
        data = b""
        if file is not None:
            with open(file, "rb") as stream:
                data = stream.read()
        if source_hash(data[HASH_BYTES:]) == data[:HASH_BYTES]:
            found, kept = marshal.loads(data[HASH_BYTES:])
            if found == key:
                result: V = kept
                return result
    result = make()
    if file is not None and result is not None:
        data = marshal.dumps((key, result))  # type: ignore[arg-type]  # the caller gives plain data
        new = f"{os.path.splitext(file)[0]}.{os.getpid()}"
        with suppress(OSError):  # atomic: write the whole file or leave the old one
            os.makedirs(os.path.dirname(file), mode=0o700, exist_ok=True)
            with open(new, "wb") as stream:
                stream.write(source_hash(data) + data)
            os.replace(new, file)
    return result


def _cache_file(name: str) -> str | None:
    """Return the path of a file in the cache folder; None for a user without a home folder."""
    base = os.environ.get("XDG_CACHE_HOME") or os.environ.get("LOCALAPPDATA") or os.path.expanduser("~/.cache")
    return None if base.startswith("~") else os.path.join(base, "vrs", name)
