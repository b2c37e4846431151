"""Programs in RAPID as they are written: blocks, jumps, calls, reactions as traps, locations with confdata.

What has no counterpart is a comment, and is named with its line. Transformations are robtargets, precision points
jointtargets; arrays of RAPID begin at 1. The routines at the end of a module say in RAPID what VAL-II has as words.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import partial
from math import pi

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.convert.steps import ExecutedRun
from vrs_cli.convert.writers import RapidWriter, external, identifier, number, robtarget, tooldata, wobjdata
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.transform import IDENTITY, Transform, distance
from vrs_cli.language.analysis.names import Analysis, Block, BlockKind, kind_of, loops_of
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.text import ast
from vrs_cli.language.text.printer import expression_text
from vrs_cli.language.words.values import Kind

SAME = 1e-6  # [m] of two places
SIZE = 10  # of an array of which no element is known
TYPES = {Kind.REAL: "num", Kind.STRING: "string", Kind.LOCATION: "robtarget", Kind.PRECISION: "jointtarget"}
STARTS = {Kind.REAL: "", Kind.STRING: "s_", Kind.LOCATION: "", Kind.PRECISION: "j_"}
SIGILS = {"": None, "$": Kind.STRING, "#": Kind.PRECISION}
RAPID_WORDS = """abs accset alias and atan2 backward bool calcjointt calcrobt case cjointt clkread clkreset clkstart
clkstop clock confdata confj confl connect const cos crobt default defframe dest dinput distance div do dohand doutput
else elseif endfor endfunc endif endmodule endproc endrecord endtest endtrap endwhile error exit exitcycle false fine
for from func goal goto held idelete if inout intnum into isignaldi j_ready jointtarget label local loaddata main mod
module moveabsj movej movel nostepin not num numtostr offs or orient orientzyx pers pi pos pose posemult poseinv pow
proc raise readonly record reltool retry return robtarget setdo sin speeddata sqrt startmove step stop stopmove string
strlen switch sysmodule tan test then time to tool tooldata tptype tpwrite trans trap true trunc trynext undo var velset
viewonly waitrob waittime waituntil while with wobjdata world xor zonedata"""
NUMBERED = re.compile(r"(l|again|next|out|temporary|soft|timer|(at_)?trap|d[io]|[vz]|tool|wobj|load)\d+|.*speed")
RELATIONS = {"==": "=", "<>": "<>", "<": "<", ">": ">", "<=": "<=", ">=": ">="}
LOGIC = {"AND": "AND", "OR": "OR", "XOR": "XOR"}
ARITHMETIC = {"+": "+", "-": "-", "*": "*", "/": "/", "MOD": "MOD"}
REALS = {  # functions of numbers, and what they are called
    **{name: name.capitalize() for name in ("ABS", "SQRT", "SIN", "COS", "TAN")},
    "ATAN2": "ATan2",
    "INT": "Trunc",
}
OF_PLACES = {"DX": "x_of", "DY": "y_of", "DZ": "z_of", "DISTANCE": "apart"}
IDLE_WORDS = """COARSE FINE NULL NONULL CPON INTON INTOFF OVERLAP NOOVERLAP SINGLE MULTIPLE ATTACH DETACH GLOBAL AUTO
LOCAL CALIBRATE"""  # they change no place and no output
PLAIN = frozenset(IDLE_WORDS.split())
BREAKS = frozenset(("BREAK", "OPENI", "CLOSEI", "RELAXI", "TOOL", "BASE", "HALT", "STOP", "PAUSE", "DELAY"))
MOVES = frozenset(("MOVE", "MOVES", "APPRO", "APPROS", "DEPART", "DEPARTS", "DRIVE", "READY", "NEST", "ALIGN"))
ENDS = {BlockKind.IF: "ENDIF", BlockKind.WHILE: "ENDWHILE", BlockKind.CASE: "ENDTEST"}

ROUTINES = """\
  FUNC speeddata rate()
    VAR num part;
    part := next_speed / 100;
    next_speed := all_speed;
    RETURN [part * %TIP, part * %TURN, 5000, 1000];
  ENDFUNC
  FUNC robtarget place(num x, num y, num z, num o, num a, num t)
    VAR robtarget p;
    p := dest;
    p.trans := [x, y, z];
    p.rot := OrientZYX(o - 90, a + 90, 0) * OrientZYX(t, 0, 0);
    RETURN p;
  ENDFUNC
  FUNC robtarget turned(num x, num y, num z)
    VAR robtarget p;
    p := dest;
    p.trans := [0, 0, 0];
    p.rot := OrientZYX(z, y, x);
    RETURN p;
  ENDFUNC
  FUNC robtarget of_pose(pose q)
    VAR robtarget p;
    p := dest;
    p.trans := q.trans;
    p.rot := q.rot;
    RETURN p;
  ENDFUNC
  FUNC robtarget framed(robtarget a, robtarget b, robtarget c, robtarget d)
    VAR pose q;
    q := DefFrame(a, b, c \\Origin:=1);
    q.trans := d.trans;
    RETURN of_pose(q);
  ENDFUNC
  FUNC pose pose_of(robtarget p)
    RETURN [p.trans, p.rot];
  ENDFUNC
  FUNC robtarget both(robtarget a, robtarget b)
    RETURN of_pose(PoseMult(pose_of(a), pose_of(b)));
  ENDFUNC
  FUNC robtarget inverse(robtarget a)
    RETURN of_pose(PoseInv(pose_of(a)));
  ENDFUNC
  FUNC num x_of(robtarget p)
    RETURN p.trans.x;
  ENDFUNC
  FUNC num y_of(robtarget p)
    RETURN p.trans.y;
  ENDFUNC
  FUNC num z_of(robtarget p)
    RETURN p.trans.z;
  ENDFUNC
  FUNC num apart(robtarget a, robtarget b)
    RETURN Distance(a.trans, b.trans);
  ENDFUNC
  FUNC num logical(bool b)
    IF b RETURN -1;
    RETURN 0;
  ENDFUNC"""

TAKEN = frozenset((*RAPID_WORDS.split(), *re.findall(r"FUNC \w+ (\w+)", ROUTINES)))


class Unsaid(Exception):
    """A construct without a counterpart."""


class Translated(Struct, frozen=True):
    """A module of RAPID, and `unsaid`: (line, what) of what has no counterpart."""

    text: str
    unsaid: tuple[tuple[int, str], ...]


class RapidTranslator:
    """Translates the programs of a memory. `run`: an execution of them, which tells in which configuration places were
    reached; `given`: the memory before it.
    """

    def __init__(
        self, memory: Memory, programs: Sequence[Analysis], run: ExecutedRun, given: Memory, name: str
    ) -> None:
        self.memory, self.programs, self.run = memory, programs, run
        self.given = {key: value for kind in Kind for key, value in given.cells(kind).items()}
        self.name, self.arm = identifier(name, 32), run.arm
        self.named = dict[str, str]()  # the name of each program, by its key
        for one in programs:
            self.named[one.program.key] = _free(one.program.name, {self.name, *self.named.values()})
        self.unsaid = list[tuple[int, str]]()
        self.of_routine = dict[Datum, str]()  # the names of data of the present routine
        self.lines, self.level = list[str](), 2
        self.softs, self.timers, self.traps = set[int](), set[int](), dict[str, str]()
        self.interrupts = set[int]()  # inputs
        self.shared = dict[Datum, str]()  # the names of data of the module
        self.arrays = dict[Datum, list[int]]()  # their sizes, as far as indexes that are constants tell
        self.kinds = {one.program.key: dict(one.kinds) for one in programs}
        self.changing = set[tuple[str, int]]()  # parameters that a program changes, or gives to one that does
        self._learn_from_calls()
        self.temporary = 0

    # --- the module ---

    def translate(self) -> Translated:
        procedures = list[str]()
        for analysis in self.programs:
            self.lines, self.level = [], 2
            self._program(analysis)
            procedures += self.lines
        model = self.arm.model
        ready = RapidWriter(self.run, self.name, "").jointtarget(model.poses["ready"])
        still = "[[0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0], " + external() + "]"
        head = [
            f"MODULE {self.name}",
            f"  ! as written, for the joints of {model.title}; tried in no simulator of the maker",
            f"  PERS tooldata held := {tooldata(IDENTITY)};",
            f"  PERS wobjdata world := {wobjdata(IDENTITY)};",
            f"  CONST jointtarget j_ready := {ready};",
            "  VAR num all_speed := 100;",
            "  VAR num next_speed := 100;",
            f"  VAR robtarget dest := {still};",
            f"  VAR jointtarget goal := {ready};",
            *(f"  VAR num temporary{k + 1};" for k in range(self.temporary)),
            *(f"  VAR bool soft{signal} := FALSE;" for signal in sorted(self.softs)),
            *(f"  VAR clock timer{timer};" for timer in sorted(self.timers)),
            *(f"  VAR intnum at_trap{signal};" for signal in sorted(self.interrupts)),
            *self._data(),
            "  PROC main()",
            "    ConfJ \\Off;",
            "    ConfL \\Off;",
            *(["    ClkStart timer0;"] if 0 in self.timers else []),
            "    dest := CRobT(\\Tool:=held\\WObj:=world);",
            f"    {self.named[self.programs[0].program.key]};",
            "  ENDPROC",
        ]
        traps = [line for trap, body in self.traps.items() for line in (f"  TRAP {trap}", body, "  ENDTRAP")]
        routines = ROUTINES.replace("%TIP", number(1000.0 * model.linear_speed)).replace(
            "%TURN", number(model.angular_speed * 180.0 / pi)
        )
        return Translated("\n".join([*head, *procedures, *traps, routines, "ENDMODULE", ""]), tuple(self.unsaid))

    def _data(self) -> Iterator[str]:
        """Yield the declarations of all variables that programs share."""
        for (scope, kind, key), name in self.shared.items():
            datum = (scope, kind, key)
            if not scope and key in self.given and datum not in self.arrays:
                yield f"  PERS {TYPES[kind]} {name} := {self._value(kind, self.given[key])};"
            else:
                yield f"  VAR {TYPES[kind]} {name}{self._sizes(datum)};"

    def _sizes(self, datum: Datum) -> str:
        """Return the sizes of an array, "" for what is none: as many elements as the run, or the text, has used."""
        scope, kind, key = datum
        if datum not in self.arrays:
            return ""
        used = [index for index in self.memory.cells(kind, key) if index is not None and not scope]
        found = [index if isinstance(index, tuple) else (index,) for index in used]
        most = [
            max([least, *(int(one[k]) for one in found if len(one) > k)]) for k, least in enumerate(self.arrays[datum])
        ]
        return "{" + ", ".join(str((SIZE - 1 if one < 0 else one) + 1) for one in most) + "}"

    def _value(self, kind: Kind, value: object) -> str:
        if kind is Kind.REAL:
            return number(float(value), 9)  # type: ignore[arg-type]
        if kind is Kind.STRING:
            return f'"{value}"'
        if kind is Kind.PRECISION:
            return RapidWriter(self.run, self.name, "").jointtarget(value)  # type: ignore[arg-type]
        assert isinstance(value, Transform)
        return robtarget(self.arm, value, self._reached(value))

    def _reached(self, T: Transform) -> tuple[float, ...]:
        """Return the joints in which the run has reached a place; those of a MOVE from where it began for others."""
        for move in self.run.moves:
            if distance(move.T_world_tool, T) < SAME:
                return move.joints
        try:
            return self.arm.select(T, self.run.start)
        except MotionError:
            return self.run.start

    # --- a program ---

    def _program(self, analysis: Analysis) -> None:
        program = analysis.program
        self.left_out = set[int]()  # openers of blocks that could not be said
        self.analysis, self.parameters = analysis, {one.key: one for one in program.parameters}
        self.own = {own.key: own for own in analysis.own}
        openers = [analysis.program.steps[block.opener].statement for block in analysis.blocks]
        self.loops = {one.variable.key for one in openers if isinstance(one, ast.For) and self._is_own(one)}
        self.closed = {block.closer: block for block in analysis.blocks}
        self.of_routine = {}
        told = [self._parameter(program, place) for place in range(len(program.parameters))]
        self.lines.append(f"  PROC {self.named[program.key]}({', '.join(told)})")
        declared = [self._datum(own.variable) for own in analysis.own if own.automatic]
        for place, step in enumerate(program.steps):
            if step.label is not None:
                self.say(f"l{step.label}:")
            if step.statement is not None:
                self._step(place, step.statement)
        told = [f"    VAR {TYPES[d[1]]} {self.of_routine[d]}{self._sizes(d)};" for d in declared]
        self.lines = [self.lines[0], *told, *self.lines[1:], "  ENDPROC"]

    def _parameter(self, program: ast.Program, place: int) -> str:
        kind = self._kind(program.parameters[place])
        way = "INOUT " if (program.key, place) in self.changing else ""
        return f"{way}{TYPES[kind]} {self.of_routine[self._datum(program.parameters[place])]}"

    def _step(self, place: int, statement: ast.Statement) -> None:
        try:
            self._statement(place, statement)
        except Unsaid as what:
            self.unsaid.append((statement.span.line, str(what)))
            self.say(f"! NOT SAID: {what} (line {statement.span.line})")
            if (line := PLACEHOLDERS.get(type(statement))) is not None:
                self.level -= isinstance(statement, ast.Value)
                self._open(line)
                self.level += isinstance(statement, ast.Case)
                self.left_out.add(place)

    def say(self, line: str) -> None:
        self.lines.append("  " * self.level + line)

    def _statement(self, place: int, statement: ast.Statement) -> None:
        match statement:
            case ast.Assignment(target=target, value=value):
                kind = self._kind(target)
                self.say(f"{self.variable(target)} := {self.text(value) if kind is Kind.STRING else self.num(value)};")
            case ast.Goto(label=label):
                self._jump(place, label, "")
            case ast.IfGoto(condition=condition, label=label):
                self._jump(place, label, f"IF {self.cond(condition)} ")
            case ast.If(condition=condition):
                self._open(f"IF {self.cond(condition)} THEN")
            case ast.Else():
                self._between("ELSE")
            case ast.While(condition=condition):
                self._open(f"WHILE {self.cond(condition)} DO")
            case ast.Do():
                self.say(f"again{place}:")
            case ast.Until(condition=condition):
                block = self.closed[place]
                self._label("next", block)
                self.say(f"IF NOT ({self.cond(condition)}) GOTO again{block.opener};")
                self._label("out", block)
            case ast.For():
                self._for(statement)
            case ast.Case(subject=subject):
                self._open(f"TEST {self.num(subject)}")
                self.level += 1
            case ast.Value(tests=tests):
                self._between(f"CASE {', '.join(map(self.num, tests))}:")
            case ast.Any():
                self._between("DEFAULT:")
            case ast.End():
                self._end(self.closed[place])
            case ast.Instruction():
                self._instruction(place, statement)
            case _:
                raise Unsaid(type(statement).__name__)

    def _open(self, line: str) -> None:
        self.say(line)
        self.level += 1

    def _between(self, line: str) -> None:
        self.level -= 1
        self._open(line)

    def _end(self, block: Block) -> None:
        if block.kind in (BlockKind.WHILE, BlockKind.FOR):
            self._label("next", block)
        opener = self.analysis.program.steps[block.opener].statement
        own = isinstance(opener, ast.For) and self._is_own(opener)
        if isinstance(opener, ast.For) and not own and block.opener not in self.left_out:
            name = self.variable(opener.variable)
            self.say(f"{name} := {name} + {'1' if opener.step is None else self.num(opener.step)};")
        self.level -= 2 if block.kind is BlockKind.CASE else 1
        self.say("ENDFOR" if own and block.opener not in self.left_out else ENDS.get(block.kind, "ENDWHILE"))
        self._label("out", block)

    def _label(self, kind: str, block: Block) -> None:
        """Write a label for EXIT or NEXT where one of them jumps there."""
        word = "EXIT" if kind == "out" else "NEXT"
        inside = self.analysis.program.steps[block.opener : block.closer]
        if any(isinstance(step.statement, ast.Instruction) and step.statement.word == word for step in inside):
            self.say(f"{kind}{block.opener}:")

    def _for(self, it: ast.For) -> None:
        """A loop: FOR of RAPID has a variable of its own, WHILE stands for a FOR whose variable is seen elsewhere."""
        step = 1.0 if it.step is None else ast.plain_number(it.step)
        if not step:
            raise Unsaid("FOR with a STEP whose sign is not known")
        if self._is_own(it):
            by = number(step, 9)
            name = self.of_routine[self._datum(it.variable)]
            self._open(f"FOR {name} FROM {self.num(it.first)} TO {self.num(it.last)} STEP {by} DO")
            return
        name, last = self.variable(it.variable), self.num(it.last)
        self.say(f"{name} := {self.num(it.first)};")
        if not isinstance(it.last, ast.Number):
            self.temporary += 1
            self.say(f"temporary{self.temporary} := {last};")
            last = f"temporary{self.temporary}"
        self._open(f"WHILE {name} {'<=' if step > 0.0 else '>='} {last} DO")

    def _is_own(self, it: ast.For) -> bool:
        """Whether the variable of a loop is used in loops over it alone, in this program alone, and not assigned."""
        key, inside, all_uses = it.variable.key, 0, 0
        if it.variable.indexes or key in self.parameters or key in self.own:
            return False
        for analysis in self.programs:
            steps = analysis.program.steps
            uses = [sum(isinstance(n, ast.Variable) and n.key == key for n in ast.nodes(step)) for step in steps]
            all_uses += sum(uses)
            for block in analysis.blocks if analysis is self.analysis else ():
                opener = steps[block.opener].statement
                if isinstance(opener, ast.For) and opener.variable.key == key:
                    within = [step.statement for step in steps[block.opener + 1 : block.closer] if step.statement]
                    if any(key in _assigned(one, self.changing) for one in within):
                        return False
                    inside += sum(uses[block.opener : block.closer])
        return inside == all_uses

    def _jump(self, place: int, label: int, condition: str) -> None:
        target = self.analysis.labels[label]
        inside = [block for block in self.analysis.blocks if block.opener < target <= block.closer]
        if any(not block.opener < place <= block.closer for block in inside):
            raise Unsaid(f"GOTO {label} into a block")
        self.say(f"{condition}GOTO l{label};")

    # --- instructions ---

    def _instruction(self, place: int, it: ast.Instruction) -> None:
        if it.modifiers.timed:
            raise Unsaid(f"{it.word} at a time")
        if it.word in PLAIN:
            return
        if it.word in MOVES:
            self._motion(place, it)
        elif it.word in INSTRUCTIONS:
            INSTRUCTIONS[it.word](self, it)
        elif it.word in ("EXIT", "NEXT"):
            around = [b for b in self.analysis.blocks if b.opener < place < b.closer and b.kind in LOOPS]
            block = sorted(around, key=lambda b: -b.opener)[loops_of(it) - 1]
            self.say(f"GOTO {'out' if it.word == 'EXIT' else 'next'}{block.opener};")
        else:
            raise Unsaid(it.word)

    def _motion(self, place: int, it: ast.Instruction) -> None:
        """Write the destination, and the motion there: with a corner unless the arm is to stand behind it."""
        straight, zone = it.word.endswith("S") and it.word != "READYS", "fine" if self._stands(place) else "z50"
        first, second = [*it.arguments, None, None][:2]
        how, tool = f"rate(), {zone}", "held\\WObj:=world"
        if it.word in ("READY", "DRIVE") or (first is not None and self._is_joints(first)):
            if it.word == "DRIVE":
                self._drive(it)
            elif it.word not in ("READY", "MOVE"):
                raise Unsaid(f"{it.word} to a precision point")
            target = {"READY": "j_ready", "DRIVE": "goal"}.get(it.word) or self.joints(first)
            self.say(f"MoveAbsJ {target}, {how}, {tool};")
            self.say(f"dest := CalcRobT({target}, {tool});")
            return
        if it.word in ("MOVE", "MOVES"):
            target = self.place(first)
        elif it.word in ("APPRO", "APPROS"):
            target = f"RelTool({self.place(first)}, 0, 0, {self.num(_minus(second))})"
        elif it.word in ("DEPART", "DEPARTS"):
            target = f"RelTool(dest, 0, 0, {self.num(_minus(first))})"
        else:
            raise Unsaid(it.word)
        self.say(f"dest := {target};")
        self.say(f"{'MoveL' if straight else 'MoveJ'} dest, {how}, {tool};")

    def _drive(self, it: ast.Instruction) -> None:
        joint, change, *speed = [*it.arguments, None, None]
        if not isinstance(joint, ast.Number) or not 1 <= joint.value <= 6:
            raise Unsaid("DRIVE of a joint that is computed")
        axis = f"goal.robax.rax_{int(joint.value)}"
        self.say("goal := CalcJointT(dest, held\\WObj:=world);")
        self.say(f"{axis} := {axis} + {self.num(change)};")
        if speed and speed[0] is not None:
            self.say(f"next_speed := {self.num(speed[0])};")

    def _stands(self, place: int) -> bool:
        """Whether what follows a motion waits until the arm stands; where a block decides that, it does not."""
        for step in self.analysis.program.steps[place + 1 :]:
            if isinstance(step.statement, ast.Instruction) and step.statement.word in (BREAKS | MOVES):
                return step.statement.word in BREAKS
            if isinstance(step.statement, ast.End | ast.Else | ast.Goto | ast.Until | ast.While | ast.For | ast.If):
                return False
        return True

    def _set(self, it: ast.Instruction) -> None:
        (target,) = it.arguments
        if not isinstance(target, ast.Variable) or it.value is None:
            raise Unsaid("SET of more than a variable")
        joints = self._kind(target) is Kind.PRECISION
        self.say(f"{self.variable(target)} := {self.joints(it.value) if joints else self.place(it.value)};")

    def _here(self, it: ast.Instruction) -> None:
        (target,) = it.arguments
        if not isinstance(target, ast.Variable):
            raise Unsaid("HERE of more than a variable")
        joints = self._kind(target) is Kind.PRECISION
        self.say(f"{self.variable(target)} := {'CJointT()' if joints else HERE};")

    def _speed(self, it: ast.Instruction) -> None:
        (value, *turning), unit = it.arguments, it.modifiers.unit
        if unit == "MONITOR":
            self.say(f"VelSet {self.num(value)}, 5000;")
            return
        if any(turning) and unit is None:
            raise Unsaid("SPEED with another speed of turning")
        scale = {"MMPS": 0.1 / self.arm.model.linear_speed, "IPS": 2.54 / self.arm.model.linear_speed}.get(unit or "")
        percent = self.num(value) if scale is None else f"{self.num(value)} * {number(scale, 9)}"
        for name in ("all_speed", "next_speed") if it.modifiers.always else ("next_speed",):
            self.say(f"{name} := {percent};")

    def _operate(self, it: ast.Instruction) -> None:
        if any(it.arguments):
            raise Unsaid(f"{it.word} of a width")
        if it.word.endswith("I"):
            self.say("WaitRob \\ZeroSpeed;")
        self.say(f"SetDO doHand, {int(it.word.startswith('OPEN'))};")
        if it.word.endswith("I"):
            self.say("WaitTime 0.05;")

    def _signal(self, it: ast.Instruction) -> None:
        for argument in it.arguments:
            value = ast.plain_number(argument)
            if value is None:
                raise Unsaid("SIGNAL of a number that is computed")
            signal, on = abs(int(value)), value > 0.0
            if signal > 2000:
                self.softs.add(signal)
                self.say(f"soft{signal} := {str(on).upper()};")
            else:
                self.say(f"SetDO do{signal}, {int(on)};")

    def _wait(self, it: ast.Instruction) -> None:
        self.say(f"WaitUntil {self.cond(it.arguments[0])};" if any(it.arguments) else "WaitTime 0;")

    def _wait_event(self, it: ast.Instruction) -> None:
        if len(it.arguments) != 2 or it.arguments[0] is not None:
            raise Unsaid("WAIT.EVENT without a time alone")
        self.say(f"WaitTime {self.num(it.arguments[1])};")

    def _timer(self, it: ast.Instruction) -> None:
        timer, value = it.arguments[0], it.value
        if not isinstance(timer, ast.Number) or ast.plain_number(value) != 0.0:
            raise Unsaid("TIMER that is not set to 0")
        self.timers.add(int(timer.value))
        for word in ("ClkStop", "ClkReset", "ClkStart"):
            self.say(f"{word} timer{int(timer.value)};")

    def _type(self, it: ast.Instruction) -> None:
        decimals, parts = 3, list[str]()
        for item in it.arguments:
            match item:
                case ast.Format(code="X", width=width):
                    parts.append(f'"{" " * (width or 1)}"')
                case ast.Format(decimals=given):
                    decimals = given or 0
                case ast.StringConstant() | ast.Variable(sigil="$"):
                    parts.append(self.text(item))
                case None:
                    pass
                case _:
                    parts.append(f"NumToStr({self.num(item)}, {decimals})")
        shown = " + ".join(parts) or '""'
        self.say(f"TPWrite {shown};")

    def _call(self, it: ast.Instruction) -> None:
        self.say(f"{self._called(it.arguments[0])};")

    def _called(self, called: ast.Expression | None) -> str:
        """Return a call of a program of the file; what it needs before it is written."""
        callee = next((one.program for one in self.programs if one.program.key == getattr(called, "key", None)), None)
        if not isinstance(called, ast.ProgramCall) or callee is None:
            raise Unsaid("CALL of a program that is not in the file")
        if len(called.arguments) != len(callee.parameters) or None in called.arguments:
            raise Unsaid("CALL with another number of arguments")
        given = [self._argument(callee, place, one) for place, one in enumerate(called.arguments)]
        return f"{self.named[callee.key]}{' ' + ', '.join(given) if given else ''}"

    def _argument(self, callee: ast.Program, place: int, value: ast.Expression | None) -> str:
        parameter = callee.parameters[place]
        kind = SIGILS[parameter.sigil] or self.kinds[callee.key].get(parameter.key, Kind.REAL)
        if isinstance(value, ast.Variable) and value.many:
            raise Unsaid("CALL with a whole array")
        text = {Kind.REAL: self.num, Kind.STRING: self.text, Kind.LOCATION: self.place, Kind.PRECISION: self.joints}
        told = text[kind](value)
        if (callee.key, place) not in self.changing or (isinstance(value, ast.Variable) and not value.grouped):
            return told
        if kind is not Kind.REAL:
            raise Unsaid("CALL with an expression for a reference")
        self.temporary += 1
        self.say(f"temporary{self.temporary} := {told};")
        return f"temporary{self.temporary}"

    def _decompose(self, it: ast.Instruction) -> None:
        (target,) = it.arguments
        if not isinstance(target, ast.Variable) or it.value is None or not self._is_joints(it.value):
            raise Unsaid("DECOMPOSE of a transformation")
        if not target.indexes or len(target.indexes) != 1:
            raise Unsaid("DECOMPOSE to more than an array")
        self.say(f"goal := {self.joints(it.value)};")
        for axis in range(min(self.arm.model.joint_count, 6)):
            first = target.indexes[0]
            more = ast.Binary("+", first, ast.Number(float(axis), "", span=it.span), span=it.span)
            place = ast.Number(first.value + axis, "", span=it.span) if isinstance(first, ast.Number) else more
            self.say(f"{self.variable(replace(target, indexes=(place,)))} := goal.robax.rax_{axis + 1};")

    def _react(self, it: ast.Instruction) -> None:
        signal, called = ast.plain_number(it.arguments[0]), it.arguments[1] if len(it.arguments) > 1 else None
        if signal is None or not 1000 < abs(signal) < 2000 or not isinstance(called, ast.ProgramCall):
            raise Unsaid(f"{it.word} to more than an input")
        stops = "    StopMove \\Quick;\n    ClearPath;\n    StartMove;\n" if it.word == "REACTI" else ""
        body, at = f"{stops}    {self._called(called)};", int(abs(signal))
        known = [name for name in self.traps if name.startswith(f"trap{at}")]
        trap = next((name for name in known if self.traps[name] == body), f"trap{at}{'_' * len(known)}")
        self.traps[trap] = body
        self.interrupts.add(at)
        self.say(f"IDelete at_trap{at};")
        self.say(f"CONNECT at_trap{at} WITH {trap};")
        self.say(f"ISignalDI \\Single, di{at - 1000}, {int(signal > 0.0)}, at_trap{at};")

    def _ignore(self, it: ast.Instruction) -> None:
        signal = ast.plain_number(it.arguments[0])
        if signal is None:
            raise Unsaid("IGNORE of a number that is computed")
        self.interrupts.add(int(abs(signal)))
        self.say(f"IDelete at_trap{int(abs(signal))};")

    def _tool(self, it: ast.Instruction) -> None:
        self.say("WaitRob \\ZeroSpeed;")
        if any(it.arguments):
            self.say(f"held.tframe := pose_of({self.place(it.arguments[0])});")
        else:
            self.say("held.tframe := [[0, 0, 0], [1, 0, 0, 0]];")
        self.say(f"dest := {HERE};")

    def _base(self, it: ast.Instruction) -> None:
        x, y, z, turn = ["0" if one is None else self.num(one) for one in (*it.arguments, *(None,) * 4)[:4]]
        self.say("WaitRob \\ZeroSpeed;")
        self.say(f"world.uframe := [[{x}, {y}, {z}], OrientZYX({turn}, 0, 0)];")
        self.say(f"dest := {HERE};")

    # --- expressions ---

    def _kind(self, variable: ast.Variable) -> Kind:
        return self._known_kind(self.analysis, variable) or Kind.REAL

    def _known_kind(self, analysis: Analysis, variable: ast.Variable) -> Kind | None:
        """Return the kind of a variable as its program decides it; of a shared one also as others, or the file, do."""
        key, program = variable.key, analysis.program
        own = {*(one.key for one in program.parameters), *(one.key for one in analysis.own)}
        found = SIGILS[variable.sigil] or self.kinds[program.key].get(key)
        if found is None and key not in own:
            found = next((kinds[key] for kinds in self.kinds.values() if key in kinds), None)
            found = found or (Kind.LOCATION if isinstance(self.given.get(key), Transform) else None)
        return found

    def variable(self, it: ast.Variable) -> str:
        if it.many:
            raise Unsaid("a whole array")
        if it.indexes and it.key in self.parameters:
            raise Unsaid("an array that is a parameter")
        datum = self._datum(it)
        name = self.shared.get(datum) or self.of_routine[datum]
        if not it.indexes:
            return name
        return name + "{" + ", ".join(map(self._index, it.indexes)) + "}"

    def _datum(self, it: ast.Variable) -> Datum:
        """Return what a variable is, with a name of its own: of the routine, or of the module."""
        own, program = self.own.get(it.key), self.analysis.program
        inner = it.key in self.parameters or it.key in self.loops or (own is not None and own.automatic)
        datum = (program.key if inner or own is not None else "", kind := self._kind(it), it.key)
        names = self.of_routine if inner else self.shared
        if datum not in names:
            before = f"{program.name}_" if own is not None and not inner else ""
            hidden = {name for known, name in self.shared.items() if inner and known[1:] == datum[1:]}
            taken = {*self.named.values(), *self.shared.values(), *self.of_routine.values()} - hidden
            names[datum] = _free(f"{STARTS[kind]}{before}{it.name}", taken)
        if it.indexes:
            sizes = [
                int(one.value) if isinstance(one, ast.Number) else SIZE - 1 if datum[0] else -1 for one in it.indexes
            ]
            self.arrays[datum] = [max(pair) for pair in zip(self.arrays.get(datum, sizes), sizes, strict=False)]
        return datum

    def _index(self, it: ast.Expression) -> str:
        return str(int(it.value) + 1) if isinstance(it, ast.Number) else f"{self.num(it)} + 1"

    def num(self, it: ast.Expression | None) -> str:
        match it:
            case ast.Number(value=value):
                return number(value, 9)
            case ast.Variable() if self._kind(it) is Kind.REAL:
                return self.variable(it)
            case ast.Unary(operator="-" | "+" as sign, operand=operand):
                return f"({sign}{self.num(operand)})"
            case ast.Binary(operator=operator, left=a, right=b) if operator in ARITHMETIC:
                return f"({self.num(a)} {ARITHMETIC[operator]} {self.num(b)})"
            case ast.Binary(operator="**", left=a, right=b):
                return f"Pow({self.num(a)}, {self.num(b)})"
            case ast.Binary(operator=operator) if operator in RELATIONS or operator in LOGIC:
                return f"logical({self.cond(it)})"
            case ast.Unary(operator="NOT") | ast.Call(name="SIG"):
                return f"logical({self.cond(it)})"
            case ast.Call(name="TRUE" | "ON"):
                return "-1"
            case ast.Call(name="FALSE" | "OFF"):
                return "0"
            case ast.Call(name="PI"):
                return "pi"
            case ast.Call(name="SQR", arguments=(one,)):
                return f"Pow({self.num(one)}, 2)"
            case ast.Call(name="TIME"):
                self.timers.add(0)
                return "ClkRead(timer0)"
            case ast.Call(name="HAND"):
                return "DOutput(doHand)"
            case ast.Call(name="TIMER", arguments=(ast.Number(value=timer),)):
                self.timers.add(int(timer))
                return f"ClkRead(timer{int(timer)})"
            case ast.Call(name=name, arguments=arguments) if name in REALS:
                return f"{REALS[name]}({', '.join(map(self.num, arguments))})"
            case ast.Call(name=name, arguments=arguments) if name in OF_PLACES:
                return f"{OF_PLACES[name]}({', '.join(map(self.place, arguments))})"
            case ast.Call(name="LEN", arguments=(one,)):
                return f"StrLen({self.text(one)})"
        raise Unsaid(_told(it))

    def cond(self, it: ast.Expression | None) -> str:
        match it:
            case ast.Binary(operator=operator, left=a, right=b) if operator in LOGIC:
                return f"({self.cond(a)} {LOGIC[operator]} {self.cond(b)})"
            case ast.Binary(operator=operator, left=a, right=b) if operator in RELATIONS:
                text = isinstance(a, ast.Variable | ast.StringConstant) and _is_text(a)
                say = self.text if text else self.num
                return f"({say(a)} {RELATIONS[operator]} {say(b)})"
            case ast.Unary(operator="NOT", operand=operand):
                return f"NOT ({self.cond(operand)})"
            case ast.Call(name="SIG", arguments=arguments):
                return " AND ".join(map(self._on, arguments))
            case ast.Call(name="TRUE" | "ON"):
                return "TRUE"
            case ast.Call(name="FALSE" | "OFF"):
                return "FALSE"
        return f"{self.num(it)} <> 0"

    def _on(self, it: ast.Expression | None) -> str:
        value = ast.plain_number(it)
        if value is None:
            raise Unsaid("SIG of a number that is computed")
        signal, on = abs(int(value)), value > 0.0
        if signal > 2000:
            self.softs.add(signal)
            return f"soft{signal} = {str(on).upper()}"
        read = f"DInput(di{signal - 1000})" if signal > 1000 else f"DOutput(do{signal})"
        return f"{read} = {int(on)}"

    def text(self, it: ast.Expression | None) -> str:
        match it:
            case ast.StringConstant(value=value):
                return '"' + value.replace("\\", "\\\\") + '"'
            case ast.Variable(sigil="$"):
                return self.variable(it)
            case ast.Binary(operator="+", left=a, right=b):
                return f"{self.text(a)} + {self.text(b)}"
        raise Unsaid(_told(it))

    def place(self, it: ast.Expression | None) -> str:
        match it:
            case ast.Variable() if self._kind(it) is Kind.LOCATION:
                return self.variable(it)
            case ast.Binary(operator=":", left=a, right=b):
                return f"both({self.place(a)}, {self.place(b)})"
            case ast.Call(name="HERE"):
                return HERE
            case ast.Call(name="DEST"):
                return "dest"
            case ast.Call(name="NULL"):
                return "turned(0, 0, 0)"
            case ast.Call(name="TRANS", arguments=arguments):
                usual = ("0", "0", "0", "90", "-90", "0")
                given = [*arguments, *(None,) * 6][:6]
                six = [zero if one is None else self.num(one) for one, zero in zip(given, usual, strict=True)]
                return f"place({', '.join(six)})"
            case ast.Call(name="SHIFT", arguments=(of, *ways)):
                three = ["0" if one is None else self.num(one) for one in [*ways, None, None, None][:3]]
                return f"Offs({self.place(of)}, {', '.join(three)})"
            case ast.Call(name="INVERSE", arguments=(of,)):
                return f"inverse({self.place(of)})"
            case ast.Call(name="FRAME", arguments=(a, b, c, *more)):
                four = [a, b, c, more[0] if more else a]
                return f"framed({', '.join(map(self.place, four))})"
            case ast.Call(name="RX" | "RY" | "RZ" as name, arguments=(angle,)):
                return f"turned({', '.join(self.num(angle) if name[1] == axis else '0' for axis in 'XYZ')})"
        raise Unsaid(_told(it))

    def joints(self, it: ast.Expression | None) -> str:
        match it:
            case ast.Variable(sigil="#"):
                return self.variable(it)
            case ast.Call(name="#PPOINT", arguments=arguments) if len(arguments) <= 6:
                six = ["0" if one is None else self.num(one) for one in [*arguments, *(None,) * 6][:6]]
                return f"[[{', '.join(six)}], {external()}]"
            case ast.Call(name="#PHERE"):
                return "CJointT()"
        raise Unsaid(_told(it))

    def _is_joints(self, it: ast.Expression) -> bool:
        return isinstance(it, ast.Variable | ast.Call) and getattr(it, "sigil", it.name[0]) == "#"

    # --- names ---

    def _learn_from_calls(self) -> None:
        """Find the parameters that programs change, and the kinds that only arguments decide, until nothing is new."""
        programs, known = {one.program.key: one.program for one in self.programs}, -1
        while known != (known := len(self.changing) + sum(map(len, self.kinds.values()))):
            for analysis in self.programs:
                changed = {key for one in analysis.program.statements for key in _assigned(one, self.changing)}
                places = enumerate(analysis.program.parameters)
                self.changing |= {(analysis.program.key, place) for place, one in places if one.key in changed}
                for call in (one for step in analysis.program.steps for one in ast.nodes(step)):
                    if isinstance(call, ast.ProgramCall) and call.key in programs:
                        for parameter, value in zip(programs[call.key].parameters, call.arguments, strict=False):
                            kind = None if value is None else kind_of(value, partial(self._known_kind, analysis))
                            if kind is not None and not parameter.sigil:
                                self.kinds[call.key].setdefault(parameter.key, kind)


PLACEHOLDERS: Mapping[type, str] = {  # openers of blocks without a counterpart: the block is not carried out
    ast.If: "IF FALSE THEN",
    ast.While: "WHILE FALSE DO",
    ast.For: "WHILE FALSE DO",
    ast.Case: "TEST 0",
    ast.Value: "CASE 1:",
}
Datum = tuple[str, Kind, str]  # a program ("": all of them share it), kind and key of a variable
LOOPS = (BlockKind.WHILE, BlockKind.DO, BlockKind.FOR)
HERE = "CRobT(\\Tool:=held\\WObj:=world)"


def _minus(it: ast.Expression | None) -> ast.Expression:
    """Return the negative of a distance. Raises Unsaid for one that is left out."""
    if it is None:
        raise Unsaid("a distance that is left out")
    return ast.Number(-it.value, "", span=it.span) if isinstance(it, ast.Number) else ast.Unary("-", it, span=it.span)


def _free(name: str, taken: Collection[str]) -> str:
    """Return an identifier for a name of VAL-II that is not taken, no word of RAPID and no name of a routine."""
    plain = identifier(name.lower(), 28)
    while plain in TAKEN or plain in taken or NUMBERED.fullmatch(plain):
        plain += "_"
    return plain


def _is_text(it: ast.Variable | ast.StringConstant) -> bool:
    return isinstance(it, ast.StringConstant) or it.sigil == "$"


def _told(it: ast.Expression | None) -> str:
    return "a value that is left out" if it is None else expression_text(it)


def _assigned(statement: ast.Statement, changing: set[tuple[str, int]]) -> Iterator[str]:
    """Yield the keys of variables that a statement may change; `changing`: parameters of which that is known."""
    match statement:
        case ast.Assignment(target=target) | ast.For(variable=target):
            yield target.key
        case ast.Instruction(word="CALL", arguments=(ast.ProgramCall() as called,)):
            for place, one in enumerate(called.arguments):
                if isinstance(one, ast.Variable) and (called.key, place) in changing:
                    yield one.key
        case ast.Instruction(word="SET" | "HERE" | "DECOMPOSE" | "PROMPT" | "READ", arguments=arguments):
            yield from (one.key for one in arguments if isinstance(one, ast.Variable))


INSTRUCTIONS: Mapping[str, Callable[[RapidTranslator, ast.Instruction], None]] = {
    "SET": RapidTranslator._set,
    "HERE": RapidTranslator._here,
    "SPEED": RapidTranslator._speed,
    **dict.fromkeys(("OPEN", "CLOSE", "OPENI", "CLOSEI"), RapidTranslator._operate),
    "SIGNAL": RapidTranslator._signal,
    "WAIT": RapidTranslator._wait,
    "WAIT.EVENT": RapidTranslator._wait_event,
    "TIMER": RapidTranslator._timer,
    "TYPE": RapidTranslator._type,
    "DECOMPOSE": RapidTranslator._decompose,
    "CALL": RapidTranslator._call,
    "REACT": RapidTranslator._react,
    "REACTI": RapidTranslator._react,
    "IGNORE": RapidTranslator._ignore,
    "TOOL": RapidTranslator._tool,
    "BASE": RapidTranslator._base,
    "BREAK": lambda self, _it: self.say("WaitRob \\ZeroSpeed;"),
    "DELAY": lambda self, it: self.say(f"WaitTime \\InPos, {self.num(it.arguments[0])};"),
    "RETURN": lambda self, _it: self.say("RETURN;"),
    "ACCEL": lambda self, it: self.say(f"AccSet {self.num(it.arguments[0])}, 100;"),
    "PAUSE": lambda self, _it: self.say("Stop;"),
    "HALT": lambda self, _it: self.say("EXIT;"),
    "STOP": lambda self, _it: self.say("ExitCycle;"),
}
