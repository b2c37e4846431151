"""Macros of a URDF file, expanded by the package xacro where it is installed. Packages that a file names are looked for
beside it, then where ROS has them.

Macros calculate (`${[1] * 10**9}`), so they are expanded in a process of their own, which is given so much memory and
so much time: `python -m vrs_cli.kinematics.urdf.macros FILE NAME=VALUE...`.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, suppress
from importlib.util import find_spec
from io import StringIO
from pathlib import Path
from xml.etree.ElementTree import Element

from vrs_cli.errors import FileDamaged
from vrs_cli.extras import how_to_install
from vrs_cli.kinematics.urdf.tree import EXPRESSION, expanding

XACRO = "xacro:"
MEMORY, SECONDS = 1 << 30, 30  # of address space [bytes], and on the wall, for the macros of a file
REFUSED, TOO_LARGE = 3, 4  # statuses of the process
SOURCES = ("urdf", "xacro", "robots", "models")  # folders of a package that robots are in


def has_macros(file: str, root: Element) -> bool:
    """Whether a file is to be expanded before it is a robot."""
    if Path(file).suffix.lower() == ".xacro" or any(element.tag.startswith(XACRO) for element in root.iter()):
        return True
    if "xmlns:xacro" not in root.attrib:
        return False
    elements = (element for joint in root.findall("joint") for element in joint.iter())
    return any(EXPRESSION.search(value) for element in elements for value in element.attrib.values())


def expanded(file: str, arguments: Mapping[str, str]) -> str:
    """The text of a file without macros. Raises FileDamaged, with the command where the package is not there."""
    if find_spec("xacro") is None:
        hint = f"{how_to_install('xacro')}, or {expanding(file)}"
        raise FileDamaged(f"{file}: it holds xacro macros, and xacro is not installed", hint)
    command = [sys.executable, "-m", __name__, file, *(f"{name}={value}" for name, value in arguments.items())]
    try:
        done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise FileDamaged(f"{file}: xacro: its macros take more than {SECONDS} s", expanding(file)) from None
    if done.returncode == 0:
        return done.stdout
    what, _, hint = done.stderr.strip().partition("\n")
    if done.returncode != REFUSED:  # the system ended it
        what, hint = f"xacro: its macros take more than {MEMORY >> 20} MB", expanding(file)
    raise FileDamaged(f"{file}: {what}", hint)


def _expand(file: str, *pairs: str) -> int:
    """Write the text of a file without macros; else what is wrong and a hint, a line each. Returns the status."""
    with suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    import xacro

    arguments = {name: value for name, _, value in (pair.partition("=") for pair in pairs)}
    hint = "arguments of its macros are given by xacro in a TOML file"
    try:
        with _packages_beside(Path(file).absolute()), redirect_stderr(StringIO()):  # its warnings are for its author
            text = xacro.process_file(file, mappings=arguments, verbosity=0).toxml()
    except _NoPackage as lost:
        what, hint = f"{lost}", f"put its folder there, or, where ROS knows it, {expanding(file)}"
    except Exception as error:  # whatever the macros of a file run into
        if any(isinstance(one, MemoryError) for one in _behind(error)):
            return TOO_LARGE
        what = "xacro: " + (" ".join(f"{error}".split()) or type(error).__name__)
    else:
        sys.stdout.buffer.write(text.encode())
        return 0
    sys.stderr.buffer.write(f"{what}\n{hint}".encode())
    return REFUSED


def _behind(error: BaseException | None) -> Iterator[BaseException]:
    """An error, and those that it was raised for."""
    while error is not None:
        yield error
        error = error.__context__


class _NoPackage(BaseException):
    """What xacro does not put into other words, as it does with exceptions."""


@contextmanager
def _packages_beside(path: Path) -> Iterator[None]:
    """While it is entered, $(find PACKAGE) is a folder above the file or beside one of these; else what ROS knows.

    The package asks ROS alone, by a function that it has no other name for.
    """
    from xacro import substitution_args

    usual = substitution_args._eval_find
    substitution_args._eval_find = lambda name: _folder(path, name, usual)
    substitution_args._eval_dict["find"] = substitution_args._eval_find
    try:
        yield
    finally:
        substitution_args._eval_find = substitution_args._eval_dict["find"] = usual


def _folder(path: Path, name: str, usual: Callable[[str], object]) -> str:
    """Of a package, beside a file or as ROS knows it. Raises _NoPackage."""
    beside = package_folder(path, name)
    try:
        return str(usual(name) if beside is None else beside)
    except Exception:  # each version of ROS has its own, and where there is none it cannot be asked
        raise _NoPackage(f"no folder above it, or beside one of these, is the package {name!r}") from None


def package_folder(path: Path, name: str) -> Path | None:
    """The folder of a package, as seen from a file: one above it of that name, or beside one above it; else the package
    that the file itself is in, whose folder may have another name."""
    above = path.parents
    named = [folder for folder in above if folder.name == name]
    found = (*named, *(folder / name for folder in above if (folder / name).is_dir()))
    own = (folder.parent for folder in above if folder.name in SOURCES)
    return next(iter((*found, *own)), None)


if __name__ == "__main__":
    sys.exit(_expand(*sys.argv[1:]))
