"""Read a URDF file: expand its xacro macros, parse its XML, and build the tree of its links and joints.

Like other URDF readers, it accepts undeclared prefixes and an XML declaration anywhere in the file. Format:
http://wiki.ros.org/urdf/XML.

The Python package xacro expands macros, if it is installed. ROS packages that a file names are searched for in the
folders above the file, then where ROS finds them. Macros can do any computation (`${[1] * 10**9}`), so they are
expanded in a separate process with limited memory and time: `python -m vrs_cli.kinematics.urdf.tree FILE
NAME=VALUE...`.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, redirect_stderr, suppress
from dataclasses import dataclass
from importlib.util import find_spec
from io import StringIO
from math import inf, isnan, pi, sqrt
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element, TreeBuilder
from xml.parsers.expat import ExpatError, ParserCreate

from vrs_cli.errors import FileDamaged
from vrs_cli.extras import how_to_install
from vrs_cli.kinematics.joints import JointKind
from vrs_cli.kinematics.transform import Transform, Vector, at_position, compose, rotation_x, rotation_y, rotation_z

XACRO = "xacro:"
MEMORY, SECONDS = 1 << 30, 30  # maximum address space [bytes] and wall time [s] of the process that expands macros
REFUSED, TOO_LARGE = 3, 4  # exit statuses of this process: an error of the macros, or out of memory
SOURCES = ("urdf", "xacro", "robots", "models")  # usual names of a package's folders with robot files


def has_macros(file: str, root: Element) -> bool:
    """Return whether a file has xacro macros or expressions that must be expanded."""
    if Path(file).suffix.lower() == ".xacro" or any(element.tag.startswith(XACRO) for element in root.iter()):
        return True
    if "xmlns:xacro" not in root.attrib:
        return False
    elements = (element for joint in root.findall("joint") for element in joint.iter())
    return any(EXPRESSION.search(value) for element in elements for value in element.attrib.values())


def expand_macros(file: str, arguments: Mapping[str, str]) -> str:
    """Expand the macros of a file in a separate process, and return the expanded content. `arguments`: the values of
    xacro arguments. Raises FileDamaged, whose hint is a command to run if the package xacro is missing.
    """
    if find_spec("xacro") is None:
        hint = f"{how_to_install('xacro')}, or {xacro_hint(file)}"
        raise FileDamaged(f"{file}: it holds xacro macros, and xacro is not installed", hint)
    command = [sys.executable, "-m", __name__, file, *(f"{name}={value}" for name, value in arguments.items())]
    try:
        done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise FileDamaged(f"{file}: xacro: its macros take more than {SECONDS} s", xacro_hint(file)) from None
    if done.returncode == 0:
        return done.stdout
    what, _, hint = done.stderr.strip().partition("\n")
    if done.returncode != REFUSED:  # the process ran out of memory, or the system ended it
        what, hint = f"xacro: its macros take more than {MEMORY >> 20} MB", xacro_hint(file)
    raise FileDamaged(f"{file}: {what}", hint)


def _expand(file: str, *pairs: str) -> int:
    """Expand the macros of a file, and write the result to standard output. If that fails, write the error and a hint,
    in one line each, to standard error. Return the exit status. `pairs`: arguments in the form NAME=VALUE.
    """
    with suppress(ImportError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    import xacro

    arguments = {name: value for name, _, value in (pair.partition("=") for pair in pairs)}
    hint = "arguments of its macros are given by xacro in a TOML file"
    try:
        with (
            _packages_beside(Path(file).absolute()),
            redirect_stderr(StringIO()),
        ):  # hide warnings, which concern only the author of the file
            text = xacro.process_file(file, mappings=arguments, verbosity=0).toxml()
    except _NoPackage as lost:
        what, hint = f"{lost}", f"put its folder there, or, where ROS knows it, {xacro_hint(file)}"
    except Exception as error:  # macros can raise any error
        if any(isinstance(one, MemoryError) for one in _behind(error)):
            return TOO_LARGE
        what = "xacro: " + (" ".join(f"{error}".split()) or type(error).__name__)
    else:
        sys.stdout.buffer.write(text.encode())
        return 0
    sys.stderr.buffer.write(f"{what}\n{hint}".encode())
    return REFUSED


def _behind(error: BaseException | None) -> Iterator[BaseException]:
    """Yield an error, the error that caused it, and so on."""
    while error is not None:
        yield error
        error = error.__context__


class _NoPackage(BaseException):
    """Raised if a ROS package is not found. It is not a subclass of Exception, because xacro changes the
    messages of those errors.
    """


@contextmanager
def _packages_beside(path: Path) -> Iterator[None]:
    """Let $(find PACKAGE) search the folders above the file, and the folders beside these, before it asks ROS; restore
    the normal behaviour at the end of the block.

    This replaces a private function of xacro that asks only ROS.
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
    """Return the folder of a ROS package: the folder that `package_folder` finds for the file at `path`; if it finds
    none, the folder that ROS knows (returned by `usual`). Raises _NoPackage.
    """
    beside = package_folder(path, name)
    try:
        return str(usual(name) if beside is None else beside)
    except Exception:  # versions of ROS raise different classes of errors
        raise _NoPackage(f"no folder above it, or beside one of these, is the package {name!r}") from None


def package_folder(path: Path, name: str) -> Path | None:
    """Return the folder of a ROS package: a folder of this name above the file, or directly inside a folder above the
    file.

    If there is none, return the folder of the package that contains the file, whose name may differ; None if there is
    no such package.
    """
    above = path.parents
    named = [folder for folder in above if folder.name == name]
    found = (*named, *(folder / name for folder in above if (folder / name).is_dir()))
    own = (folder.parent for folder in above if folder.name in SOURCES)
    return next(iter((*found, *own)), None)


MAX_FILE_CHARS = 20_000_000  # maximum number of characters of a URDF file
HUGE = 1e6  # [m, rad] all numbers of an arm must be smaller; refuses infinity and NaN
EXPRESSION = re.compile(r"\$[{(]")  # start of a xacro expression

MAX_FILE_JOINTS = 1000  # maximum number of joints in a file, and between base and tip
ENDLESS = 1e3  # [rad, m] a joint with a limit this large counts as a joint without limits; files write 999999
STEP, ROUNDED = (
    pi / 12,
    1e-5,
)  # [rad] angles this close to a multiple of 15 deg are rounded to it, because files contain 1.5708 for a right angle

MOVING = {"revolute": JointKind.REVOLUTE, "continuous": JointKind.REVOLUTE, "prismatic": JointKind.PRISMATIC}
FIXED = "fixed"
LOOSE = ("floating", "planar")  # joint types that only a vehicle may have
_CHAIN = "an arm is a chain without loops"

_DECLARATION = re.compile(r"<\?xml\s[^>]*\?>")
_TEXT = "a robot description is an XML file"


def robot_element(file: str, text: str) -> Element:
    """Parse the content of a URDF file, and return its root element. Raises FileDamaged."""
    if len(text) > MAX_FILE_CHARS:
        raise FileDamaged(f"{file}: {len(text)} characters", f"at most {MAX_FILE_CHARS} are read")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise FileDamaged(f"{file}: it defines a document type or entities", "a URDF file needs neither: remove them")
    builder, parser = TreeBuilder(), ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(_DECLARATION.sub("", text.lstrip("\ufeff")), True)
    except ExpatError as error:
        raise FileDamaged(f"{file}: {error}", _TEXT) from None
    root = builder.close()
    if root.tag != "robot":
        raise FileDamaged(f"{file}: its root is <{root.tag}>", "a URDF file is one <robot> element")
    return root


def name_of(element: Element, key: str = "name") -> str:
    """Return an element's name (or another attribute), with each run of white space as one blank, as XML parsers do for
    line ends.
    """
    return " ".join(element.get(key, "").split())


def xacro_hint(file: str) -> str:
    """Return a hint with the command that expands the macros of a file."""
    return f"expand it first: xacro {file} > arm.urdf"


class Range(NamedTuple):
    """The limits [rad, m] and the velocity [rad/s, m/s] of a joint in the file: None for missing values, infinite for a
    joint without limits.
    """

    lower: float | None
    upper: float | None
    velocity: float | None

    @property
    def endless(self) -> bool:
        """Return whether a limit is so large that the joint counts as a joint without limits."""
        return any(end is not None and abs(end) >= ENDLESS for end in (self.lower, self.upper))


class Mimic(NamedTuple):
    """How a joint follows another joint: its value is factor * leader + offset."""

    leader: str
    factor: float
    offset: float


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint between two links of a URDF file. The data in its XML element is read only when it is needed."""

    element: Element
    name: str
    type: str
    parent: str
    child: str

    @property
    def moves(self) -> bool:
        return self.type != FIXED

    @property
    def mimics(self) -> bool:
        return self.element.find("mimic") is not None


class Tree:
    """The link tree of a URDF file: its joints, found by their child links. Each link has at most one parent."""

    def __init__(self, file: str, robot: Element) -> None:
        self.file, self.robot, self.name = file, robot, name_of(robot) or "robot"
        self.by_child: dict[str, Joint] = {}
        self.below: dict[str, list[Joint]] = {}
        for element in robot.findall("joint")[: MAX_FILE_JOINTS + 1]:
            self._add(element)
        if not self.by_child or len(self.by_child) > MAX_FILE_JOINTS:
            raise FileDamaged(
                f"{self.file}: {len(self.by_child)} joints", f"1 to {MAX_FILE_JOINTS} <joint> elements make an arm"
            )
        names = [joint.name for joint in self.by_child.values() if joint.moves]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise FileDamaged(f"{self.file}: two joints that move are called {twice!r}", "give each its own name")
        self.roots = [link for link in self.below if link not in self.by_child]
        if not self.roots:
            raise FileDamaged(f"{self.file}: no link is without a parent", _CHAIN)
        reached = list(self.roots)
        for link in reached:
            reached += [joint.child for joint in self.below.get(link, ())]
        seen = set(reached)
        for joint in self.by_child.values():
            if joint.child not in seen:
                raise self.wrong(joint.element, f"is in a loop with link {joint.parent!r}", _CHAIN)

    def _add(self, element: Element) -> None:
        parent, child, name = self._end(element, "parent"), self._end(element, "child"), name_of(element)
        if EXPRESSION.search(name):
            raise FileDamaged(f"{self.file}: a joint is called {name!r}", xacro_hint(self.file))
        joint = Joint(element, name or "joint", element.get("type", ""), parent, child)
        if child in self.by_child:
            raise self.wrong(joint.element, f"link {child!r} has two parents", _CHAIN)
        if child == parent:
            raise self.wrong(joint.element, f"leads from link {parent!r} to itself", _CHAIN)
        self.by_child[child] = joint
        self.below.setdefault(parent, []).append(joint)

    def _end(self, element: Element, which: str) -> str:
        found = element.find(which)
        link = "" if found is None else name_of(found, "link")
        if not link:
            raise self.wrong(element, f"has no {which} link", f'give <{which} link="..."/>')
        if EXPRESSION.search(link):
            raise self.wrong(element, f"its {which} link is {link!r}", xacro_hint(self.file))
        return link

    # --- links of the tree ---

    def check_link(self, link: str) -> str:
        if link not in self.by_child and link not in self.below:
            links = sorted({*self.by_child, *self.below})
            raise FileDamaged(f"{self.file}: no joint has a link {link!r}", f"links are {', '.join(links[:20])}")
        return link

    def root(self) -> str:
        if len(self.roots) != 1:
            hint = "a chain has one root; name it by --base LINK, or urdf_base in a TOML"
            raise FileDamaged(f"{self.file}: {', '.join(self.roots)} are without a parent", hint)
        return self.roots[0]

    def way(self, base: str, tip: str) -> list[Joint]:
        """Return the joints between the links base and tip, in this order. Raises FileDamaged if the tip is not below
        the base.
        """
        way: list[Joint] = []
        link = tip
        while link != base:
            if link not in self.by_child or len(way) > MAX_FILE_JOINTS:
                raise FileDamaged(
                    f"{self.file}: no chain of joints leads from {base} to {tip}", "name two links of one arm"
                )
            way.append(self.by_child[link])
            link = self.by_child[link].parent
        return way[::-1]

    def together(self, link: str) -> list[str]:
        """Return a link and all links below it that fixed joints connect to it."""
        found = [link]
        for parent in found:
            found += [joint.child for joint in self.below.get(parent, ()) if not joint.moves]
        return found

    def nearest(self, link: str) -> list[Joint]:
        """Return the moving joints that are attached to a link or to links fixed to it."""
        return [joint for held in self.together(link) for joint in self.below.get(held, ()) if joint.moves]

    def moving_below(self, joint: Joint) -> Iterator[Joint]:
        """Yield a joint and all moving joints below it in the tree."""
        left = [joint]
        while left:
            joint = left.pop()
            yield joint
            left += self.nearest(joint.child)

    # --- data of joints ---

    def kind(self, joint: Joint) -> JointKind:
        kind = MOVING.get(joint.type)
        if kind is None:
            right = f"an arm has joints of the types {', '.join(MOVING)} and {FIXED}"
            raise self.wrong(joint.element, f"is of type {joint.type!r}", right)
        return kind

    def range(self, joint: Joint) -> Range:
        limit = joint.element.find("limit")
        values: Mapping[str, str] = {} if limit is None else limit.attrib
        lower, upper, velocity = (self._limit(joint, values, key) for key in ("lower", "upper", "velocity"))
        if joint.type == "continuous":
            lower, upper = -inf, inf
        return Range(lower, upper, velocity)

    def mimic(self, joint: Joint) -> Mimic:
        found = joint.element.find("mimic")
        assert found is not None  # callers check first that the element exists
        (factor,) = self.numbers(joint.element, "mimic multiplier", found.get("multiplier", "1"), 1)
        (offset,) = self.numbers(joint.element, "mimic offset", found.get("offset", "0"), 1)
        return Mimic(name_of(found, "joint"), factor, offset)

    def _limit(self, joint: Joint, values: Mapping[str, str], key: str) -> float | None:
        """Return the number (perhaps infinite) with this key; None if it is missing."""
        if key not in values:
            return None
        with suppress(ValueError):
            if not isnan(value := float(values[key])):
                return value
        return self.numbers(joint.element, f"limit {key}", values[key], 1)[0]

    def origin(self, element: Element) -> Transform:
        """Return the transform of the element `origin`, such as T_parent_child while a joint is 0. The angles of URDF
        are roll, pitch, yaw about fixed axes.
        """
        origin = element.find("origin")
        values: Mapping[str, str] = {} if origin is None else origin.attrib
        x, y, z = self.numbers(element, "origin xyz", values.get("xyz", "0 0 0"), 3)
        angles = self.numbers(element, "origin rpy", values.get("rpy", "0 0 0"), 3)
        steps = [round(angle / STEP) * STEP for angle in angles]
        roll, pitch, yaw = (b if abs(a - b) < ROUNDED else a for a, b in zip(angles, steps, strict=True))
        turned = compose(compose(rotation_z(yaw), rotation_y(pitch)), rotation_x(roll))
        return at_position(turned, x, y, z)

    def axis(self, joint: Joint) -> Vector:
        """Return the axis of a joint, as a unit vector in the frame of its child link."""
        axis = joint.element.find("axis")
        text = "1 0 0" if axis is None else axis.get("xyz", "1 0 0")
        x, y, z = self.numbers(joint.element, "axis xyz", text, 3)
        length = sqrt(x * x + y * y + z * z)
        if not length > 0.0:
            raise self.wrong(joint.element, "axis xyz is 0 0 0", "give its direction")
        return x / length, y / length, z / length

    def numbers(self, element: Element, what: str, text: str, count: int) -> tuple[float, ...]:
        """Parse the value of an attribute as `count` numbers. `what`: the attribute's name in errors. Raises
        FileDamaged with the element's name.
        """
        try:
            values = tuple(map(float, text.split()))
        except ValueError:
            values = ()
        if len(values) != count or not all(abs(value) < HUGE for value in values):
            below = f"below {HUGE:g}"
            right = (
                f"give a number {below}" if count == 1 else f"give {count} numbers {below}, with blanks between them"
            )
            raise self.wrong(
                element, f"{what} is {text!r}", xacro_hint(self.file) if EXPRESSION.search(text) else right
            )
        return values

    def wrong(self, joint: Element, what: str, right: str) -> FileDamaged:
        """Return the error for a joint. `what`: what is wrong; `right`: what would be right."""
        return FileDamaged(f"{self.file}: joint {name_of(joint) or '?'}: {what}", right)


if __name__ == "__main__":
    sys.exit(_expand(*sys.argv[1:]))
