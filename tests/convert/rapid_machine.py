"""Carry out RAPID text on a robot of our own with a small machine.

It has only the routines of the language that are used. Motions go to their ends, one by one.
"""

from __future__ import annotations

import copy
import itertools
import math
import operator
import re
from collections import ChainMap
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import reduce
from typing import Any

import numpy as np

from tests.convert.playing import Done, outputs_of
from tests.convert.readers import Matrix, NotRead, about, matrix, of_quaternion
from vrs_cli import Location, Robot
from vrs_cli.language.run.operations import cosine, sine

FIELDS = {
    "trans": 0,
    "rot": 1,
    "robax": 0,
    "tframe": 1,
    "uframe": 3,
    "x": 0,
    "y": 1,
    "z": 2,
    **{f"rax_{k + 1}": k for k in range(6)},
}
TAKEN = re.compile(r"(d[io]|[zv])\d+|dohand|fine|pi", re.IGNORECASE)
CLOSERS = {"IF": "ENDIF", "WHILE": "ENDWHILE", "FOR": "ENDFOR", "TEST": "ENDTEST"}


class Record(list[Any]):
    """An aggregate with the names of its fields."""

    def __getattr__(self, name: str) -> Any:
        if name not in FIELDS:
            raise AttributeError(name)
        return self[FIELDS[name]]

    def __mul__(self, other: Any) -> Record:
        """Return the product of two rotations: the second is in the frame that the first has turned."""
        (a, b, c, d), (e, f, g, h) = self, other
        w, x = a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g
        return Record([w, x, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e])


class Array(dict[Any, Any]):
    """An array with elements from 1 on."""

    def __init__(self, sizes: tuple[int, ...], zero: Any) -> None:
        super().__init__()
        self.sizes, self.zero = sizes, zero

    def checked(self, index: Any) -> tuple[int, ...]:
        key = index if isinstance(index, tuple) else (index,)
        assert all(1 <= k <= size and k == int(k) for k, size in zip(key, self.sizes, strict=True)), "out of bounds"
        return tuple(int(k) for k in key)

    def __getitem__(self, index: Any) -> Any:
        return self.get(self.checked(index), self.zero)

    def __setitem__(self, index: Any, value: Any) -> None:
        super().__setitem__(self.checked(index), value)


@dataclass
class Alias:
    """The target of an INOUT parameter: a variable, or an element of an array."""

    holder: dict[Any, Any]
    key: Any

    @property
    def value(self) -> Any:
        return self.holder[self.key]

    @value.setter
    def value(self, value: Any) -> None:
        self.holder[self.key] = value


@dataclass
class Node:
    """A line, or a block with its parts: (opening line, nodes) each."""

    line: str
    parts: list[tuple[str, list[Node]]] = field(default_factory=list)


@dataclass
class Routine:
    parameters: list[tuple[str, bool]]
    body: list[Node]


class Jump(Exception):
    pass


class Returned(Exception):
    pass


class RapidMachine:
    """Carries out a module on a robot. `done` has what it did, `typed` what it wrote. `inputs`: the changes of inputs
    (time [s], signal, state). A trap is carried out between two lines.
    """

    def __init__(self, text: str, robot: Robot, inputs: Iterable[tuple[float, int, bool]] = ()) -> None:
        self.inputs, self.on = list(inputs), dict[str, bool]()  # `on`: the signals
        self.traps = dict[str, str]()  # which one an interrupt is connected with
        self.armed = dict[str, tuple[str, bool]]()  # what each interrupt waits for: an input, and its state
        self.robot, self.places, self.typed = robot, list[Matrix](), list[str]()
        self.shared, self.routines = dict[str, Any](), dict[str, Routine]()
        self.functions = {name.removeprefix("f_"): getattr(self, name) for name in dir(self) if name.startswith("f_")}
        self.shared |= {"z50": 50, "fine": 0, "pi": math.pi}
        lines = [line.strip() for line in text.splitlines() if line.strip() and not line.strip().startswith("!")]
        assert lines[0].startswith("MODULE ")
        assert lines[-1] == "ENDMODULE"
        self._read(iter(lines[1:-1]))
        self.call("main", [])
        self.done = Done(self.places, outputs_of(robot.timeline), [])

    # --- reading ---

    def _read(self, lines: Iterator[str]) -> None:
        for line in lines:
            if re.match(r"(PERS|VAR|CONST) ", line):
                self._declare(line, self.shared)
            elif m := re.fullmatch(r"(?:PROC|FUNC \w+|TRAP) (\w+)(?:\((.*)\))?", line):
                kind = "END" + line.split()[0]
                assert m[1] not in {*self.shared, *self.routines, *self.functions}, f"{m[1]} is taken"
                parameters = [one.split() for one in (m[2] or "").split(", ") if one]
                told = [(words[-1], words[0] == "INOUT") for words in parameters]
                self.routines[m[1]] = Routine(told, self._nodes(lines, (kind,))[0])
            else:
                raise NotRead(line)

    def _nodes(self, lines: Iterator[str], ends: tuple[str, ...]) -> tuple[list[Node], str]:
        found = list[Node]()
        for line in lines:
            if line.startswith(ends):
                return found, line
            word = line.split()[0]
            opens = (word == "IF" and line.endswith(" THEN")) or (word in ("WHILE", "FOR", "TEST"))
            if not opens:
                found.append(Node(line))
                continue
            node, part = Node(line), line
            while part != CLOSERS[word]:
                nodes, following = self._nodes(lines, (CLOSERS[word], "ELSE", "CASE ", "DEFAULT:"))
                node.parts.append((part, nodes))
                part = following
            found.append(node)
        raise NotRead(f"no {ends[0]}")

    def _declare(self, line: str, into: dict[str, Any]) -> None:
        m = re.fullmatch(r"(?:PERS|VAR|CONST) (\w+) (\w+)(?:\{(.*)\})?(?: := (.*))?;", line)
        if m is None:
            raise NotRead(line)
        own_name = m[2] not in {*into, *self.routines, *self.functions} and not TAKEN.fullmatch(m[2])
        assert own_name, f"{m[2]} is taken"
        assert m[2] == m[2].lower()
        still = Record([Record([0, 0, 0]), Record([1, 0, 0, 0]), Record([0, 0, 0, 0]), Record([9e9] * 6)])
        zero = {"num": 0, "string": "", "bool": False, "robtarget": still, "pose": Record(still[:2])}.get(m[1])
        if m[3]:
            sizes = tuple(int(size) for size in m[3].split(","))
            into[m[2]] = Array(sizes, zero)
            for index in itertools.product(*map(range, sizes)) if m[4] else ():
                into[m[2]][tuple(k + 1 for k in index)] = reduce(operator.getitem, index, self.value(m[4], {}))
        else:
            into[m[2]] = self.value(m[4], {}) if m[4] else copy.deepcopy(zero)

    # --- carrying out ---

    def call(self, name: str, given: list[Any]) -> Any:
        routine, own = self.routines[name], dict[str, Any]()
        for (parameter, _), value in zip(routine.parameters, given, strict=True):
            assert parameter not in {*self.routines, *self.functions, *own}, f"{parameter} is taken"
            own[parameter] = value if isinstance(value, Alias) else copy.deepcopy(value)
        try:
            self._block(routine.body, own)
        except Returned as it:
            return it.args[0]
        return None

    def _alias(self, text: str, own: dict[str, Any]) -> Alias:
        m = re.fullmatch(r"(\w+)(\{(.*)\})?", text)
        assert m, "a reference is a variable"
        holder = own if m[1] in own else self.shared
        if m[2]:
            return Alias(holder[m[1]], self.value(f"({m[3]})", own))
        return holder[m[1]] if isinstance(holder[m[1]], Alias) else Alias(holder, m[1])

    def _block(self, nodes: list[Node], own: dict[str, Any]) -> None:
        place, labels = 0, {node.line[:-1]: k for k, node in enumerate(nodes) if re.fullmatch(r"\w+:", node.line)}
        while place < len(nodes):
            try:
                self._node(nodes[place], own)
                place += 1
            except Jump as to:
                if to.args[0] not in labels:
                    raise
                place = labels[to.args[0]]

    def _node(self, node: Node, own: dict[str, Any]) -> None:
        line = node.line
        if m := re.fullmatch(r"IF (.*) THEN", line):
            for opener, nodes in node.parts:
                if opener == "ELSE" or self.value(m[1], own):
                    return self._block(nodes, own)
        elif m := re.fullmatch(r"WHILE (.*) DO", line):
            while self.value(m[1], own):
                self._block(node.parts[0][1], own)
        elif m := re.fullmatch(r"FOR (\w+) FROM (.*) TO (.*) STEP (.*) DO", line):
            first, last, by = (self.value(text, own) for text in m.groups()[1:])
            assert m[1] not in self.shared, "a loop has a variable of its own"
            value = first
            while min(first, last) <= value <= max(first, last):  # so that the first value is always carried out
                own[m[1]] = value
                self._block(node.parts[0][1], own)
                value += by
            own.pop(m[1], None)
        elif m := re.fullmatch(r"TEST (.*)", line):
            subject = self.value(m[1], own)
            for opener, nodes in node.parts[1:]:
                tests = opener.removeprefix("CASE ").removesuffix(":")
                if opener == "DEFAULT:" or subject in self.value(f"[{tests}]", own):
                    return self._block(nodes, own)
        elif not re.fullmatch(r"\w+:", line):
            self._line(line.removesuffix(";"), own)
            self._interrupt()
        return None

    def _interrupt(self) -> None:
        """Carry out the traps of the inputs that have changed."""
        if self.inputs:
            self.robot.wait()
        while self.inputs and self.inputs[0][0] <= self.robot.now:
            _, signal, on = self.inputs.pop(0)
            self.on[f"di{signal - 1000}"] = on
            for name, awaited in list(self.armed.items()):
                if awaited == (f"di{signal - 1000}", on):
                    del self.armed[name]
                    self.call(self.traps[name], [])

    def _line(self, line: str, own: dict[str, Any]) -> None:
        if m := re.fullmatch(r"IF (.*) (GOTO \w+|RETURN.*)", line):
            if self.value(m[1], own):
                self._line(m[2], own)
        elif line.startswith("GOTO "):
            raise Jump(line[5:])
        elif line.startswith("RETURN"):
            raise Returned(self.value(line[6:], own) if line[6:].strip() else None)
        elif line.startswith("VAR "):
            self._declare(line + ";", own)
        elif m := re.fullmatch(r"([\w.]+)(\{.*\})? := (.*)", line):
            self._assign(m[1], m[2], copy.deepcopy(self.value(m[3], own)), own)
        else:
            word, _, rest = line.partition(" ")
            names = _split(rest)
            if m := re.fullmatch(r"CONNECT (\w+) WITH (\w+)", line):
                assert m[1] not in self.armed, "an interrupt is connected once, until IDelete"
                self.traps[m[1]] = m[2]
            elif word in self.routines:
                assert word not in own, f"{word} is not the routine here"
                pairs = zip(names, self.routines[word].parameters, strict=True)
                self.call(word, [(self._alias if changes else self.value)(one, own) for one, (_, changes) in pairs])
            else:
                getattr(self, f"i_{word}")(*[self._argument(one, own) for one in names])

    def _argument(self, text: str, own: dict[str, Any]) -> Any:
        """Return the value of an argument; the name of a signal stays as it is."""
        return text if re.fullmatch(r"d[oi]\d+|doHand|timer\d+|at_trap\d+|\\\w+", text) else self.value(text, own)

    def _assign(self, path: str, index: str | None, value: Any, own: dict[str, Any]) -> None:
        name, *fields = path.split(".")
        into = own if name in own else self.shared
        assert name in into, f"{name} is not declared"
        if index:
            into[name][self.value(f"({index[1:-1]})", own)] = value
        elif fields:
            target = self.value(name, own)
            for one in fields[:-1]:
                target = target[FIELDS[one]]
            target[FIELDS[fields[-1]]] = value
        else:
            self._alias(name, own).value = value

    def value(self, text: str, own: dict[str, Any]) -> Any:
        parts = re.split(r'("[^"]*")', text.strip())
        return eval("".join(p if k % 2 else _python(p) for k, p in enumerate(parts)), {}, Names(self, own))

    # --- instructions ---

    def _frames(self) -> None:
        for word, T in (("TOOL", _matrix(self.shared["held"][1])), ("BASE", _matrix(self.shared["world"][3]))):
            if word == "TOOL":
                self.robot["held"] = Location.from_matrix(T)
                self.robot.do("TOOL held")
            else:
                turn = math.degrees(math.atan2(T[1, 0], T[0, 0]))
                self.robot.do(f"BASE {', '.join(f'{x:.9f}' for x in (*T[:3, 3] * 1000.0, turn))}")

    def _goes(self, motion: Any, speed: Record) -> None:
        assert speed[0] > 0.0
        self._frames()
        before = self.robot.where().joints
        motion()
        if np.abs(self.robot.where().joints - before).max() > 1e-7:
            self.places.append(self.robot.where().location.matrix)

    def i_MoveAbsJ(self, target: Record, speed: Record, *_: Any) -> None:
        self._goes(lambda: self.robot.move(*target[0]), speed)

    def i_MoveJ(self, target: Record, speed: Record, *_: Any) -> None:
        self._goes(lambda: self.robot.move(Location.from_matrix(_matrix(target))), speed)

    def i_MoveL(self, target: Record, speed: Record, *_: Any) -> None:
        self._goes(lambda: self.robot.moves(Location.from_matrix(_matrix(target))), speed)

    def i_SetDO(self, signal: str, on: int) -> None:
        word = ("CLOSEI", "OPENI")[on] if signal == "doHand" else f"SIGNAL {'' if on else '-'}{signal[2:]}"
        self.robot.do(word)
        self.on[signal] = bool(on)

    def i_WaitTime(self, *given: Any) -> None:
        self.robot.do(f"DELAY {given[-1]}")

    def i_WaitUntil(self, holds: bool) -> None:
        assert holds

    def i_TPWrite(self, text: str) -> None:
        self.typed.append(text)

    def i_IDelete(self, name: str) -> None:
        self.armed.pop(name, None)

    def i_ISignalDI(self, single: str, signal: str, on: int, name: str) -> None:
        assert single == "\\Single"
        self.armed[name] = signal, bool(on)

    def _nothing(self, *_: Any) -> None:
        """Ignore settings, clocks, and the stop of a motion."""

    i_WaitRob = i_ConfJ = i_ConfL = i_ClkStart = i_ClkStop = i_ClkReset = i_AccSet = _nothing  # noqa: N815
    i_StopMove = i_ClearPath = i_StartMove = _nothing  # noqa: N815

    # --- functions ---

    def f_CRobT(self) -> Record:
        self._frames()
        return _robtarget(self.robot.where().location.matrix)

    def f_CalcRobT(self, *_: Any) -> Record:
        """Return the place of the arm, which stands at these joints: the call is right after the motion."""
        return self.f_CRobT()

    def f_CJointT(self) -> Record:
        return Record([Record(self.robot.where().joints.tolist()), Record([9e9] * 6)])

    def f_CalcJointT(self, *_: Any) -> Record:
        return self.f_CJointT()

    def f_RelTool(self, p: Record, x: float, y: float, z: float) -> Record:
        return _robtarget(_matrix(p) @ matrix(np.eye(3), [x / 1000.0, y / 1000.0, z / 1000.0]))

    def f_Offs(self, p: Record, x: float, y: float, z: float) -> Record:
        return _robtarget(matrix(np.eye(3), [x / 1000.0, y / 1000.0, z / 1000.0]) @ _matrix(p))

    def f_PoseMult(self, a: Record, b: Record) -> Record:
        return Record(_robtarget(_matrix(a) @ _matrix(b))[:2])

    def f_PoseInv(self, a: Record) -> Record:
        return Record(_robtarget(np.linalg.inv(_matrix(a)))[:2])

    def f_DefFrame(self, a: Record, b: Record, c: Record) -> Record:
        o, p, q = (np.array(one[0]) for one in (a, b, c))
        x = (p - o) / np.linalg.norm(p - o)
        y = q - o - x * (x @ (q - o))
        y /= np.linalg.norm(y)
        turned = np.array([x, y, np.cross(x, y)]).T
        return Record(_robtarget(matrix(turned, list(o / 1000.0)))[:2])

    def f_OrientZYX(self, z: float, y: float, x: float) -> Record:
        return _robtarget(matrix(about(2, z) @ about(1, y) @ about(0, x), [0.0, 0.0, 0.0]))[1]  # type: ignore[no-any-return]

    def f_Distance(self, a: Record, b: Record) -> float:
        return float(np.linalg.norm(np.array(a) - np.array(b)))

    def f_NumToStr(self, value: float, decimals: int) -> str:
        return f"{value:.{decimals}f}"

    def f_DOutput(self, signal: str) -> float:
        return float(self.robot["HAND"] if signal == "doHand" else self.on.get(signal, False))

    def f_DInput(self, signal: str) -> int:
        return int(self.on.get(signal, False))

    def f_ClkRead(self, _clock: Any) -> float:
        return self.robot.now

    f_Abs = staticmethod(abs)  # noqa: N815
    f_Sqrt = staticmethod(math.sqrt)  # noqa: N815
    f_Trunc = staticmethod(math.trunc)  # noqa: N815
    f_Pow = staticmethod(pow)  # noqa: N815
    f_StrLen = staticmethod(len)  # noqa: N815
    f_Sin = staticmethod(sine)  # noqa: N815 (of degrees, equal to the bit: programs compare)
    f_Cos = staticmethod(cosine)  # noqa: N815

    def f_ATan2(self, y: float, x: float) -> float:
        return math.degrees(math.atan2(y, x))


class Names(ChainMap[str, Any]):
    """The names in an expression: variables, functions of the language, and those of the module."""

    def __init__(self, machine: RapidMachine, own: dict[str, Any]) -> None:
        super().__init__(own, machine.shared, machine.functions)
        self.machine = machine

    def __getitem__(self, name: str) -> Any:
        found = super().__getitem__(name)
        return found.value if isinstance(found, Alias) else found

    def __missing__(self, name: str) -> Any:
        if name == "Record":
            return Record
        if re.fullmatch(r"d[io]\d+|doHand", name):
            return name
        if name in self.machine.routines:
            return lambda *given: self.machine.call(name, list(given))
        raise KeyError(name)


def _split(text: str) -> list[str]:
    """Split the arguments of a call at commas outside brackets and strings."""
    found, depth, quoted = [""], 0, False
    for sign in text:
        quoted ^= sign == '"'
        depth += 0 if quoted else (sign in "([{") - (sign in ")]}")
        if sign == "," and not depth and not quoted:
            found.append("")
        else:
            found[-1] += sign
    return [one.strip() for one in found if one.strip()]


def _python(text: str) -> str:
    """Return an expression of RAPID as one of Python."""
    text = re.sub(r"\\\w+(:=\w+)?", "", text).replace("<>", "!=")
    text = re.sub(r"(?<![<>!=:])=(?!=)", "==", text)
    for word, python in {"AND": "and", "OR": "or", "XOR": "!=", "NOT": "not", "TRUE": "True", "FALSE": "False"}.items():
        text = re.sub(rf"\b{word}\b", python, text)
    text = re.sub(r"\bMOD\b", "%", text)
    text = re.sub(r"(?<![\w\]])\[", "Record([", text)  # an aggregate; behind a name stand braces
    text = re.sub(r"\]", "])", text)
    return text.replace("{", "[").replace("}", "]")


def _matrix(p: Record) -> Matrix:
    return matrix(of_quaternion(*p[1]), [x / 1000.0 for x in p[0]])


def _robtarget(T: Matrix) -> Record:
    w = math.sqrt(max(0.0, 1.0 + T[0, 0] + T[1, 1] + T[2, 2])) / 2.0
    xyz = [math.sqrt(max(0.0, 1.0 + 2.0 * T[k, k] - np.trace(T[:3, :3]))) / 2.0 for k in range(3)]
    q = [w, *xyz]
    most = max(range(4), key=lambda k: abs(q[k]))
    R = T[:3, :3]
    pairs = {(0, 1): R[2, 1] - R[1, 2], (0, 2): R[0, 2] - R[2, 0], (0, 3): R[1, 0] - R[0, 1]}
    pairs |= {(1, 2): R[0, 1] + R[1, 0], (1, 3): R[0, 2] + R[2, 0], (2, 3): R[1, 2] + R[2, 1]}
    signed = [q[most] if k == most else pairs[min(k, most), max(k, most)] / (4.0 * q[most]) for k in range(4)]
    xyz_mm = Record([1000.0 * float(x) for x in T[:3, 3]])
    return Record([xyz_mm, Record(map(float, signed)), Record([0, 0, 0, 0]), Record([9e9] * 6)])
