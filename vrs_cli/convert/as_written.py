"""Translate programs to RAPID as they are written: blocks, jumps, calls, reactions as traps, locations with confdata. A
statement without a counterpart becomes a comment and is reported with its line. Transformations become robtargets,
precision points jointtargets; arrays of RAPID begin at index 1. The routines at the end of a module replace words of
VAL-II that RAPID does not have."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from functools import partial
from itertools import zip_longest
from math import pi
from typing import Any

from msgspec import Struct
from msgspec.structs import replace

from vrs_cli.convert.steps import ExecutedRun
from vrs_cli.convert.writers import external, identifier, jointtarget, number, robtarget, tooldata, wobjdata
from vrs_cli.errors import MotionError
from vrs_cli.kinematics.transform import IDENTITY, Transform, distance
from vrs_cli.language.analysis.names import LOOPS, Analysis, Block, BlockKind, kind_of, loops_of
from vrs_cli.language.run.memory import Memory
from vrs_cli.language.text import ast
from vrs_cli.language.text.printer import expression_text
from vrs_cli.language.words.values import SIGIL_KINDS, Kind

SAME = 1e-6  # [m] maximum distance between positions that count as equal
SIZE = 10  # size of an array if none of its elements is known
TYPES = {Kind.REAL: "num", Kind.STRING: "string", Kind.LOCATION: "robtarget", Kind.PRECISION: "jointtarget"}
STARTS = {Kind.REAL: "", Kind.STRING: "s_", Kind.LOCATION: "", Kind.PRECISION: "j_"}
RAPID_WORDS = """abs accset alias and atan2 backward bool calcjointt calcrobt case cjointt clkread clkreset clkstart
clkstop clock confdata confj confl connect const cos crobt default defframe dest dinput distance div do dohand doutput
else elseif endfor endfunc endif endmodule endproc endrecord endtest endtrap endwhile error exit exitcycle false fine
for from func goal goto held idelete if inout intnum into isignaldi j_ready jointtarget label local loaddata main mod
module moveabsj movej movel nostepin not num numtostr offs or orient orientzyx pers pi pos pose posemult poseinv pow
proc raise readonly record reltool retry return robtarget setdo sin speeddata sqrt startmove step stop stopmove string
strlen switch sysmodule tan test then time to tool tooldata tptype tpwrite trans trap true trunc trynext undo var velset
viewonly waitrob waittime waituntil while with wobjdata world xor zonedata"""
NUMBERED = re.compile(r"(l|again|next|out|temporary|soft|timer|(at_)?trap|d[io]|[vz]|tool|wobj|load)\d+|.*speed")

IDLE_WORDS = """COARSE FINE NULL NONULL CPON INTON INTOFF OVERLAP NOOVERLAP SINGLE MULTIPLE ATTACH DETACH GLOBAL AUTO
LOCAL CALIBRATE"""  # words that change neither the robot's position nor an output
PLAIN = frozenset(IDLE_WORDS.split())
BREAKS = frozenset(("BREAK", "OPENI", "CLOSEI", "RELAXI", "TOOL", "BASE", "HALT", "STOP", "PAUSE", "DELAY"))
MOVES = frozenset(("MOVE", "MOVES", "APPRO", "APPROS", "DEPART", "DEPARTS", "DRIVE", "READY", "NEST", "ALIGN"))
DECIDING = {"End", "Else", "Goto", "Until", "While", "For", "If", *BREAKS, *MOVES}
ENDS = {BlockKind.IF: "ENDIF", BlockKind.CASE: "ENDTEST"}
EMPTY = {
    Kind.REAL: "0",
    Kind.STRING: '""',
    Kind.LOCATION: f"[[0, 0, 0], [1, 0, 0, 0], [0, 0, 0, 0], {external()}]",
    Kind.PRECISION: f"[[0, 0, 0, 0, 0, 0], {external()}]",
}
HERES = {Kind.LOCATION: "CRobT(\\Tool:=held\\WObj:=world)", Kind.PRECISION: "CJointT()"}
SIGNALS = {  # RAPID text for an output, an input, and a signal above 2000
    "SIG": ("DOutput(do{0}) = {1:d}", "DInput(di{0}) = {1:d}", "soft{0} = {2}"),
    "SIGNAL": ("SetDO do{0}, {1:d};", "", "soft{0} := {2};"),
}
# How to write a word in RAPID. Columns: the type of the result ("do" for an instruction, "to" for the target of a
# motion, "joints" for a target given by joints); the word (with () if it has no arguments, with _ for a sign before a
# value, with $ between strings); the RAPID text; the types of the arguments, each with its default if it can be left
# out.
FORMS_TEXT = f"""
num +  ({{}} + {{}})  num num
num -  ({{}} - {{}})  num num
num *  ({{}} * {{}})  num num
num /  ({{}} / {{}})  num num
num MOD  ({{}} MOD {{}})  num num
num **  Pow({{}}, {{}})  num num
num -_  (-{{}})  num
num +_  (+{{}})  num
num ABS  Abs({{}})  num
num SQRT  Sqrt({{}})  num
num SIN  Sin({{}})  num
num COS  Cos({{}})  num
num TAN  Tan({{}})  num
num ATAN2  ATan2({{}}, {{}})  num num
num INT  Trunc({{}})  num
num SQR  Pow({{}}, 2)  num
num PI  pi
num TRUE  -1
num ON  -1
num FALSE  0
num OFF  0
num TIME  ClkRead(timer0)
num TIMER  ClkRead(timer{{}})  const
num HAND  DOutput(doHand)
num DX  x_of({{}})  robtarget
num DY  y_of({{}})  robtarget
num DZ  z_of({{}})  robtarget
num DISTANCE  apart({{}}, {{}})  robtarget robtarget
num LEN  StrLen({{}})  string
bool ==  ({{}} = {{}})  num num
bool ==$  ({{}} = {{}})  string string
bool <>  ({{}} <> {{}})  num num
bool <>$  ({{}} <> {{}})  string string
bool <  ({{}} < {{}})  num num
bool <$  ({{}} < {{}})  string string
bool >  ({{}} > {{}})  num num
bool >$  ({{}} > {{}})  string string
bool <=  ({{}} <= {{}})  num num
bool <=$  ({{}} <= {{}})  string string
bool >=  ({{}} >= {{}})  num num
bool >=$  ({{}} >= {{}})  string string
bool AND  ({{}} AND {{}})  bool bool
bool OR  ({{}} OR {{}})  bool bool
bool XOR  ({{}} XOR {{}})  bool bool
bool NOT_  NOT ({{}})  bool
bool TRUE  TRUE
bool ON  TRUE
bool FALSE  FALSE
bool OFF  FALSE
string +  {{}} + {{}}  string string
robtarget :  both({{}}, {{}})  robtarget robtarget
robtarget HERE  {HERES[Kind.LOCATION]}
robtarget DEST  dest
robtarget NULL  turned(0, 0, 0)
robtarget TRANS  place({{}}, {{}}, {{}}, {{}}, {{}}, {{}})  num=0 num=0 num=0 num=90 num=-90 num=0
robtarget SHIFT  Offs({{}}, {{}}, {{}}, {{}})  robtarget num=0 num=0 num=0
robtarget INVERSE  inverse({{}})  robtarget
robtarget FRAME  framed({{}}, {{}}, {{}}, {{}})  robtarget robtarget robtarget robtarget
robtarget RX  turned({{}}, 0, 0)  num
robtarget RY  turned(0, {{}}, 0)  num
robtarget RZ  turned(0, 0, {{}})  num
jointtarget #PPOINT  [[{{}}, {{}}, {{}}, {{}}, {{}}, {{}}], {external()}]  num=0 num=0 num=0 num=0 num=0 num=0
jointtarget #PHERE  {HERES[Kind.PRECISION]}
to MOVE  {{}}  robtarget
to MOVES  {{}}  robtarget
to APPRO  RelTool({{}}, 0, 0, {{}})  robtarget minus
to APPROS  RelTool({{}}, 0, 0, {{}})  robtarget minus
to DEPART  RelTool(dest, 0, 0, {{}})  minus
to DEPARTS  RelTool(dest, 0, 0, {{}})  minus
joints READY  j_ready
joints MOVE  {{}}  jointtarget
joints DRIVE  goal  const num num=0
do DRIVE2  goal := CalcJointT(dest, held\\WObj:=world); goal.robax.rax_{{0}} := goal.robax.rax_{{0}} + {{1}};  const num
do DRIVE3  goal := CalcJointT(dest, held\\WObj:=world); goal.robax.rax_{{0}} := goal.robax.rax_{{0}} + {{1}}; next_speed := {{2}};  const num num
do BREAK()  WaitRob \\ZeroSpeed;
do DELAY  WaitTime \\InPos, {{}};  num
do ACCEL  AccSet {{1}}, 100;  none=- num
do RETURN()  RETURN;
do PAUSE()  Stop;
do HALT()  EXIT;
do STOP()  ExitCycle;
do OPEN()  SetDO doHand, 1;
do CLOSE()  SetDO doHand, 0;
do OPENI()  WaitRob \\ZeroSpeed; SetDO doHand, 1; WaitTime 0.05;
do CLOSEI()  WaitRob \\ZeroSpeed; SetDO doHand, 0; WaitTime 0.05;
do WAIT  WaitUntil {{}};  bool
do WAIT()  WaitTime 0;
do WAIT.EVENT  WaitTime {{1}};  none=- num
do TIMER  ClkStop timer{{0}}; ClkReset timer{{0}}; ClkStart timer{{0}};  const
do IGNORE  IDelete at_trap{{}};  const
do TOOL  WaitRob \\ZeroSpeed; held.tframe := pose_of({{}}); dest := {HERES[Kind.LOCATION]};  robtarget
do TOOL()  WaitRob \\ZeroSpeed; held.tframe := [[0, 0, 0], [1, 0, 0, 0]]; dest := {HERES[Kind.LOCATION]};
do BASE  WaitRob \\ZeroSpeed; world.uframe := [[{{0}}, {{1}}, {{2}}], OrientZYX({{3}}, 0, 0)]; dest := {HERES[Kind.LOCATION]};  num=0 num=0 num=0 num=0
"""  # noqa: E501
FORMS = {
    tuple(row[0].split()): (row[1], row[2:]) for row in (line.split("  ") for line in FORMS_TEXT.split("\n") if line)
}

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


class NoCounterpart(Exception):
    """The error for a construct of VAL-II that has no counterpart in RAPID."""


class BlockLine(Struct, frozen=True):
    """A line that opens a block or continues one. `wanted`: the type of its operand. `idle`: the operand that keeps the
    block from ever running; it is used if the real operand cannot be translated. `back`, `by`: how many levels the
    indent decreases before the line and increases after it."""

    line: str
    wanted: str = "bool"
    idle: str = "FALSE"
    back: int = 0
    by: int = 1


class Translated(Struct, frozen=True):
    """A RAPID module. `unsaid`: (line, construct) for each construct that has no counterpart in RAPID."""

    text: str
    unsaid: tuple[tuple[int, str], ...]


class RapidTranslator:
    """A translator to RAPID of all programs in memory. `run`: a run of these programs, which shows in which
    configuration the arm reaches each location. `given`: the memory before the run."""

    def __init__(
        self, memory: Memory, programs: Sequence[Analysis], run: ExecutedRun, given: Memory, name: str
    ) -> None:
        self.memory, self.programs, self.run = memory, programs, run
        self.given, self.found = {key: value for kind in Kind for key, value in given.cells(kind).items()}, given
        self.name, self.arm = identifier(name, 32), run.arm
        self.named = dict[str, str]()  # the RAPID name of each program, by the program's key
        for one in programs:
            self.named[one.program.key] = _free(one.program.name, {self.name, *self.named.values()})
        self.unsaid, self.traps = list[tuple[int, str]](), dict[str, str]()
        # RAPID names of variables of the routine, and of the module
        self.of_routine, self.shared = dict[Datum, str](), dict[Datum, str]()
        # for each dimension of an array, the largest constant index in the text; -1: none
        self.arrays = dict[Datum, list[int]]()
        self.kinds = {one.program.key: dict(one.kinds) for one in programs}
        # parameters (program, index) that the program or a program it calls changes
        self.changing = set[tuple[str, int]]()
        self.temporary = 0
        self._learn_from_calls()

    # --- the module ---

    def translate(self) -> Translated:
        procedures = "\n".join([line for analysis in self.programs for line in self._program(analysis)])
        model = self.arm.model
        ready = jointtarget(self.arm, model.poses["ready"])
        used = {
            what: sorted({int(found) for found in re.findall(rf"\b{what}(\d+)", procedures)})
            for what in ("temporary", "soft", "timer", "at_trap")
        }
        head = [
            f"MODULE {self.name}",
            f"  ! as written, for the joints of {model.title}; tried in no simulator of the maker",
            f"  PERS tooldata held := {tooldata(IDENTITY)};",
            f"  PERS wobjdata world := {wobjdata(IDENTITY)};",
            f"  CONST jointtarget j_ready := {ready};",
            "  VAR num all_speed := 100;",
            "  VAR num next_speed := 100;",
            f"  VAR robtarget dest := {EMPTY[Kind.LOCATION]};",
            f"  VAR jointtarget goal := {ready};",
            *(f"  VAR num temporary{k};" for k in used["temporary"]),
            *(f"  VAR bool soft{signal} := FALSE;" for signal in used["soft"]),
            *(f"  VAR clock timer{timer};" for timer in used["timer"]),
            *(f"  VAR intnum at_trap{signal};" for signal in used["at_trap"]),
            *self._data(),
            "  PROC main()",
            "    ConfJ \\Off;",
            "    ConfL \\Off;",
            *(["    ClkStart timer0;"] if 0 in used["timer"] else []),
            f"    dest := {HERES[Kind.LOCATION]};",
            f"    {self.named[self.programs[0].program.key]};",
            "  ENDPROC",
        ]
        traps = [line for trap, body in self.traps.items() for line in (f"  TRAP {trap}", body, "  ENDTRAP")]
        routines = ROUTINES.replace("%TIP", number(1000.0 * model.linear_speed)).replace(
            "%TURN", number(model.angular_speed * 180.0 / pi)
        )
        return Translated("\n".join([*head, procedures, *traps, routines, "ENDMODULE", ""]), tuple(self.unsaid))

    def _data(self) -> Iterator[str]:
        """Yield the declarations of all variables that programs share."""
        for (scope, kind, key), name in self.shared.items():
            sizes = self._sizes((scope, kind, key))
            elements = {} if scope else dict(self.found.cells(kind, key)) if sizes else {(): self.given.get(key)}
            word, value = (
                ("PERS", f" := {self._literal(kind, elements, sizes)}")
                if {*elements.values()} - {None}
                else ("VAR", "")
            )
            yield f"  {word} {TYPES[kind]} {name}{_braces(sizes)}{value};"

    def _sizes(self, datum: Datum) -> list[int]:
        """Return the dimensions of an array, from the elements used in the run and in the text; empty for other
        variables."""
        scope, kind, key = datum
        least = self.arrays.get(datum, [])
        used = [index for index in self.memory.cells(kind, key) if index is not None and not scope] if least else []
        found = [index if isinstance(index, tuple) else (index,) for index in used]
        most = [max([one, *(int(index[k]) for index in found if len(index) > k)]) for k, one in enumerate(least)]
        return [(SIZE - 1 if one < 0 else one) + 1 for one in most]

    def _literal(
        self, kind: Kind, elements: Mapping[Any, object], sizes: Sequence[int], at: tuple[int, ...] = ()
    ) -> str:
        """Return the value of a variable or an array as RAPID text. `sizes`: the sizes of the remaining dimensions;
        `at`: the indexes chosen so far."""
        if sizes:
            return f"[{', '.join([self._literal(kind, elements, sizes[1:], (*at, k)) for k in range(sizes[0])])}]"
        match elements.get(at[0] if len(at) == 1 else at):
            case None:
                return EMPTY[kind]
            case Transform() as value:
                return robtarget(self.arm, value, self._joints_at(value))
            case tuple() as value:
                return jointtarget(self.arm, value)
            case float(value):
                return number(value, 9)
            case value:
                return f'"{value}"'

    def _joints_at(self, T: Transform) -> tuple[float, ...]:
        """Return the joints at which the run reached a location. If the run never reached the location, return the
        joints to which a MOVE from the joints at the start of the run would go."""
        for move in self.run.moves:
            if distance(move.T_world_tool, T) < SAME:
                return move.joints
        try:
            return self.arm.select(T, self.run.start)
        except MotionError:
            return self.run.start

    # --- a program ---

    def _program(self, analysis: Analysis) -> list[str]:
        """Return the lines of a program in RAPID, from PROC to ENDPROC."""
        program, key = analysis.program, analysis.program.key
        self.lines, self.level, self.of_routine = list[str](), 2, {}
        self.left_out = set[int]()  # line numbers of block openings that have no counterpart in RAPID
        self.analysis, self.parameters = analysis, {one.key: one for one in program.parameters}
        self.own = {own.key: own for own in analysis.own}
        openers = [program.steps[block.opener].statement for block in analysis.blocks]
        self.loops = {one.variable.key for one in openers if isinstance(one, ast.For) and self._is_own(one)}
        self.closed = {block.closer: block for block in analysis.blocks}
        parameters = [
            f"{'INOUT ' * ((key, k) in self.changing)}{TYPES[one[1]]} {self.of_routine[one]}"
            for k, one in enumerate(map(self._datum, program.parameters))
        ]
        declared = [self._datum(own.variable) for own in analysis.own if own.automatic]
        for place, step in enumerate(program.steps):
            if step.label is not None:
                self.say(f"l{step.label}:")
            if step.statement is not None:
                self._step(place, step.statement)
        return [
            f"  PROC {self.named[key]}({', '.join(parameters)})",
            *(f"    VAR {TYPES[one[1]]} {self.of_routine[one]}{_braces(self._sizes(one))};" for one in declared),
            *self.lines,
            "  ENDPROC",
        ]

    def _step(self, place: int, statement: ast.Statement) -> None:
        try:
            self._statement(place, statement)
        except NoCounterpart as what:
            self.unsaid.append((statement.span.line, str(what)))
            self.say(f"! NOT SAID: {what} (line {statement.span.line})")
            if (block := BLOCKS.get(type(statement))) is not None:
                self._open(block, block.idle)
                self.left_out.add(place)

    def say(self, *lines: str) -> None:
        self.lines += ["  " * self.level + line for line in lines]

    def _statement(self, place: int, statement: ast.Statement) -> None:
        match statement:
            case (
                ast.Assignment(target=target, value=value)
                | ast.Instruction(word="SET", arguments=(ast.Variable() as target,), value=value)
            ):
                self.say(f"{self.variable(target)} := {self.value(value, TYPES[self._kind(target)])};")
            case ast.Goto(label=label):
                self._jump(place, label, "")
            case ast.IfGoto(condition=condition, label=label):
                self._jump(place, label, f"IF {self.value(condition, 'bool')} ")
            case ast.Instruction(word="HERE", arguments=(ast.Variable() as target,)):
                self.say(f"{self.variable(target)} := {HERES[self._kind(target)]};")
            case ast.If(condition=given) | ast.While(condition=given) | ast.Case(subject=given):
                self._open(BLOCKS[type(statement)], self.value(given, BLOCKS[type(statement)].wanted))
            case ast.Else() | ast.Any():
                self._open(BLOCKS[type(statement)])
            case ast.Value(tests=tests):
                self._open(BLOCKS[ast.Value], ", ".join([self.value(test, "num") for test in tests]))
            case ast.Do():
                self.say(f"again{place}:")
            case ast.Until(condition=condition):
                block = self.closed[place]
                self._label("next", block)
                self.say(f"IF NOT ({self.value(condition, 'bool')}) GOTO again{block.opener};")
                self._label("out", block)
            case ast.For():
                self._for(statement)
            case ast.End():
                self._end(self.closed[place])
            case ast.Instruction():
                self._instruction(place, statement)
            case _:
                raise NoCounterpart(type(statement).__name__)

    def _open(self, block: BlockLine, operand: str = "") -> None:
        self.level -= block.back
        self.say(block.line.format(operand))
        self.level += block.by

    def _end(self, block: Block) -> None:
        opener = self.analysis.program.steps[block.opener].statement
        said = isinstance(opener, ast.For) and block.opener not in self.left_out
        own = said and isinstance(opener, ast.For) and self._is_own(opener)
        if block.kind in LOOPS:
            self._label("next", block)
        if isinstance(opener, ast.For) and said and not own:
            name = self.variable(opener.variable)
            self.say(f"{name} := {name} + {'1' if opener.step is None else self.value(opener.step, 'num')};")
        self.level -= 1 + (block.kind is BlockKind.CASE)
        self.say("ENDFOR" if own else ENDS.get(block.kind, "ENDWHILE"))
        self._label("out", block)

    def _label(self, kind: str, block: Block) -> None:
        """Write the label to which EXIT or NEXT jumps, if the block contains such an instruction."""
        word = "EXIT" if kind == "out" else "NEXT"
        inside = self.analysis.program.steps[block.opener : block.closer]
        if any(isinstance(step.statement, ast.Instruction) and step.statement.word == word for step in inside):
            self.say(f"{kind}{block.opener}:")

    def _for(self, it: ast.For) -> None:
        """Write a FOR loop. RAPID's FOR has its own variable and always runs once with the first value (recalled from
        the manual), so most loops are written as WHILE."""
        step = 1.0 if it.step is None else ast.plain_number(it.step)
        if not step:
            raise NoCounterpart("FOR with a STEP whose sign is not known")
        name, first, last = self.variable(it.variable), self.value(it.first, "num"), self.value(it.last, "num")
        if self._is_own(it):
            self._open(BlockLine("FOR {} DO"), f"{name} FROM {first} TO {last} STEP {number(step, 9)}")
            return
        self.say(f"{name} := {first};")
        last = last if isinstance(it.last, ast.Number) else self._store(last)
        self._open(BLOCKS[ast.While], f"{name} {'<=' if step > 0.0 else '>='} {last}")

    def _store(self, value: str) -> str:
        """Write an assignment of a value to a new variable, and return its name."""
        self.temporary += 1
        self.say(f"temporary{self.temporary} := {value};")
        return f"temporary{self.temporary}"

    def _is_own(self, it: ast.For) -> bool:
        """Return whether a loop can be written as RAPID's FOR: its variable is used only in FOR loops of this program,
        and constant bounds show that each of these loops runs at least once."""
        key, steps, around, within = it.variable.key, self.analysis.program.steps, set[int](), set[int]()
        if it.variable.indexes or key in self.parameters or key in self.own:
            return False
        for block in self.analysis.blocks:
            opener = steps[block.opener].statement
            if isinstance(opener, ast.For) and opener.variable.key == key:
                by = 1.0 if opener.step is None else ast.plain_number(opener.step)
                first, last = ast.plain_number(opener.first), ast.plain_number(opener.last)
                if first is None or last is None or by is None or (last - first) * by < 0.0:
                    return False
                around |= {*range(block.opener, block.closer)}
                within |= {*range(block.opener + 1, block.closer)}
        inside = (statement for place in within if (statement := steps[place].statement) is not None)
        if any(key in _changed_keys(statement, self.changing) for statement in inside):
            return False
        others = [
            step
            for analysis in self.programs
            for place, step in enumerate(analysis.program.steps)
            if analysis is not self.analysis or place not in around
        ]
        return all(not isinstance(n, ast.Variable) or n.key != key for step in others for n in ast.nodes(step))

    def _jump(self, place: int, label: int, condition: str) -> None:
        inside = [block for block in self.analysis.blocks if block.opener < self.analysis.labels[label] <= block.closer]
        if any(not block.opener < place <= block.closer for block in inside):
            raise NoCounterpart(f"GOTO {label} into a block")
        self.say(f"{condition}GOTO l{label};")

    # --- instructions ---

    def _instruction(self, place: int, it: ast.Instruction) -> None:
        alone = None if any(it.arguments) else FORMS.get(("do", f"{it.word}()"))
        form = alone or FORMS.get(("do", it.word))
        if it.modifiers.has_time:
            raise NoCounterpart(f"{it.word} at a time")
        if it.word == "TIMER" and ast.plain_number(it.value) != 0.0:
            raise NoCounterpart("TIMER that is not set to 0")
        if it.word in PLAIN:
            return
        if it.word in MOVES:
            self._motion(place, it)
        elif form is not None:
            self._perform(form, it)
        elif it.word in INSTRUCTIONS:
            INSTRUCTIONS[it.word](self, it)
        elif it.word in ("EXIT", "NEXT"):
            around = [b for b in self.analysis.blocks if b.opener < place < b.closer and b.kind in LOOPS]
            block = sorted(around, key=lambda b: -b.opener)[loops_of(it) - 1]
            self.say(f"GOTO {'out' if it.word == 'EXIT' else 'next'}{block.opener};")
        else:
            has_width = any(it.arguments) and it.word.removesuffix("I") in ("OPEN", "CLOSE")
            raise NoCounterpart(f"{it.word} of a width" if has_width else it.word)

    def _perform(self, form: tuple[str, list[str]], it: ast.Instruction) -> None:
        self.say(*self._fill(form, it.arguments, it.word).replace("; ", ";\n").split("\n"))

    def _motion(self, place: int, it: ast.Instruction) -> None:
        """Write a motion and its destination. The corner is rounded unless the arm must stop at the end of the
        motion."""
        first, tool = next(iter(it.arguments), None), "held\\WObj:=world"
        joints = it.word in ("READY", "DRIVE") or (first is not None and kind_of(first, self._kind) is Kind.PRECISION)
        form = FORMS.get(("joints" if joints else "to", it.word))
        if form is None:
            raise NoCounterpart(f"{it.word} to a precision point" if joints else it.word)
        how = f"rate(), {'fine' if self._stops_after(place) else 'z50'}, {tool};"
        if it.word == "DRIVE" and not 1 <= (ast.plain_number(first) or 0) <= 6:
            raise NoCounterpart("DRIVE of a joint that is computed")
        if it.word == "DRIVE":
            self._perform(FORMS["do", f"DRIVE{len(it.arguments)}"], it)
        target = self._fill(form, it.arguments, it.word)
        if joints:
            self.say(f"MoveAbsJ {target}, {how}", f"dest := CalcRobT({target}, {tool});")
        else:
            self.say(f"dest := {target};", f"{'MoveL' if it.word.endswith('S') else 'MoveJ'} dest, {how}")

    def _stops_after(self, place: int) -> bool:
        """Return whether a following instruction makes the arm stop before its next motion; False if that depends on a
        block, such as IF."""
        following = (step.statement for step in self.analysis.program.steps[place + 1 :])
        words = (one.word if isinstance(one, ast.Instruction) else type(one).__name__ for one in following)
        return next((word for word in words if word in DECIDING), "BREAK") in BREAKS

    def _speed(self, it: ast.Instruction) -> None:
        (value, *turning), unit = it.arguments, it.modifiers.unit
        percent, scale = self.value(value, "num"), {"MMPS": 0.1, "IPS": 2.54}.get(unit or "")
        if unit == "MONITOR":
            self.say(f"VelSet {percent}, 5000;")
            return
        if any(turning) and unit is None:
            raise NoCounterpart("SPEED with another speed of turning")
        percent += "" if scale is None else f" * {number(scale / self.arm.model.linear_speed, 9)}"
        self.say(*[f"{name} := {percent};" for name in ("all_speed", "next_speed")[not it.modifiers.always :]])

    def _signal(self, word: str, it: ast.Expression | None) -> str:
        """Return the RAPID text that sets or reads a signal. Raises NoCounterpart."""
        value = ast.plain_number(it)
        if value is None:
            raise NoCounterpart(f"{word} of a number that is computed")
        signal, on = abs(int(value)), value > 0.0
        which = (signal > 1000) + (signal > 2000)
        if not SIGNALS[word][which]:
            raise NoCounterpart(f"{word} of an input")
        return SIGNALS[word][which].format(signal - 1000 * (which == 1), on, str(on).upper())

    def _type(self, it: ast.Instruction) -> None:
        decimals, parts = 3, list[str]()
        for item in it.arguments:
            match item:
                case ast.Format(code="X", width=width):
                    parts.append(f'"{" " * (width or 1)}"')
                case ast.Format(decimals=given):
                    decimals = given or 0
                case ast.StringConstant() | ast.Variable(sigil="$"):
                    parts.append(self.value(item, "string"))
                case None:
                    pass
                case _:
                    parts.append(f"NumToStr({self.value(item, 'num')}, {decimals})")
        shown = " + ".join(parts) or '""'
        self.say(f"TPWrite {shown};")

    def _call_text(self, called: ast.Expression | None) -> str:
        """Return the text that calls a program defined in the file, after writing the statements that prepare the
        arguments. Raises NoCounterpart."""
        callee = next((one.program for one in self.programs if one.program.key == getattr(called, "key", None)), None)
        if not isinstance(called, ast.ProgramCall) or callee is None:
            raise NoCounterpart("CALL of a program that is not in the file")
        if len(called.arguments) != len(callee.parameters) or None in called.arguments:
            raise NoCounterpart("CALL with another number of arguments")
        given = [self._argument(callee, place, one) for place, one in enumerate(called.arguments)]
        return f"{self.named[callee.key]}{' ' + ', '.join(given) if given else ''}"

    def _argument(self, callee: ast.Program, place: int, value: ast.Expression | None) -> str:
        parameter = callee.parameters[place]
        kind = SIGIL_KINDS.get(parameter.sigil) or self.kinds[callee.key].get(parameter.key, Kind.REAL)
        if isinstance(value, ast.Variable) and value.many:
            raise NoCounterpart("CALL with a whole array")
        argument = self.value(value, TYPES[kind])
        if (callee.key, place) not in self.changing or (isinstance(value, ast.Variable) and not value.grouped):
            return argument
        if kind is not Kind.REAL:
            raise NoCounterpart("CALL with an expression for a reference")
        return self._store(argument)

    def _decompose(self, it: ast.Instruction) -> None:
        (target,) = it.arguments
        if it.value is None or kind_of(it.value, self._kind) is not Kind.PRECISION:
            raise NoCounterpart("DECOMPOSE of a transformation")
        if not isinstance(target, ast.Variable) or target.indexes is None or len(target.indexes) != 1:
            raise NoCounterpart("DECOMPOSE to more than an array")
        self.say(f"goal := {self.value(it.value, 'jointtarget')};")
        for axis in range(min(self.arm.model.joint_count, 6)):
            first = target.indexes[0]
            more = ast.Binary("+", first, ast.Number(float(axis), "", span=it.span), span=it.span)
            place = ast.Number(first.value + axis, "", span=it.span) if isinstance(first, ast.Number) else more
            self.say(f"{self.variable(replace(target, indexes=(place,)))} := goal.robax.rax_{axis + 1};")

    def _react(self, it: ast.Instruction) -> None:
        signal, called = ast.plain_number(it.arguments[0]), it.arguments[1] if len(it.arguments) > 1 else None
        if signal is None or not 1000 < abs(signal) < 2000 or not isinstance(called, ast.ProgramCall):
            raise NoCounterpart(f"{it.word} to more than an input")
        stops = "    StopMove \\Quick;\n    ClearPath;\n    StartMove;\n" if it.word == "REACTI" else ""
        body, at = f"{stops}    {self._call_text(called)};", int(abs(signal))
        known = [name for name in self.traps if name.startswith(f"trap{at}")]
        trap = next((name for name in known if self.traps[name] == body), f"trap{at}{'_' * len(known)}")
        self.traps[trap] = body
        self.say(f"IDelete at_trap{at};", f"CONNECT at_trap{at} WITH {trap};")
        self.say(f"ISignalDI \\Single, di{at - 1000}, {int(signal > 0.0)}, at_trap{at};")

    # --- expressions ---

    def _kind(self, variable: ast.Variable) -> Kind:
        return self._known_kind(self.analysis, variable) or Kind.REAL

    def _known_kind(self, analysis: Analysis, variable: ast.Variable) -> Kind | None:
        """Return the kind of a variable from its use in its program; for a shared variable, also from other programs
        and from the values in the file."""
        key, program = variable.key, analysis.program
        own = {*(one.key for one in program.parameters), *(one.key for one in analysis.own)}
        found = SIGIL_KINDS.get(variable.sigil) or self.kinds[program.key].get(key)
        if found is None and key not in own:
            found = next((kinds[key] for kinds in self.kinds.values() if key in kinds), None)
            found = found or (Kind.LOCATION if isinstance(self.given.get(key), Transform) else None)
        return found

    def variable(self, it: ast.Variable) -> str:
        if it.many:
            raise NoCounterpart("a whole array")
        if it.indexes and it.key in self.parameters:
            raise NoCounterpart("an array that is a parameter")
        datum = self._datum(it)
        name = self.shared.get(datum) or self.of_routine[datum]
        indexes = (
            str(int(one.value) + 1) if isinstance(one, ast.Number) else f"{self.value(one, 'num')} + 1"
            for one in it.indexes or ()
        )
        return name + _braces([*indexes])

    def _datum(self, it: ast.Variable) -> Datum:
        """Return the key that identifies a variable, and give the variable a RAPID name that is unique in its routine
        or module."""
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

    def value(self, it: ast.Expression | None, wanted: str) -> str:
        """Return an expression as RAPID text of a given type. Raises NoCounterpart."""
        if wanted == "minus":
            return self.value(_minus(it), "num")
        word, operands = "", tuple[ast.Expression | None, ...]()
        match it:
            case ast.Number(value=value) if wanted == "num":
                return number(value, 9)
            case ast.StringConstant(value=text) if wanted == "string":
                return '"' + text.replace("\\", "\\\\") + '"'
            case ast.Variable() if TYPES[self._kind(it)] == wanted:
                return self.variable(it)
            case ast.Call(name="SIG", arguments=signals) if wanted == "bool":
                return " AND ".join([self._signal("SIG", one) for one in signals])
            case ast.Call(name=word, arguments=operands):
                operands += operands[:1] * (word == "FRAME" and len(operands) == 3)
            case ast.Unary(operator=sign, operand=operand):
                word, operands = f"{sign}_", (operand,)
            case ast.Binary(operator=sign, left=left, right=right):
                texts = ("bool", f"{sign}$") in FORMS and kind_of(left, self._kind) is Kind.STRING
                word, operands = f"{sign}{'$' * texts}", (left, right)
        if wanted == "const":
            return str(int(abs(ast.plain_number(it) or 0.0)))
        if (wanted, word) in FORMS:
            return self._fill(FORMS[wanted, word], operands, _describe(it))
        if wanted == "bool":
            return f"{self.value(it, 'num')} <> 0"
        if wanted == "num" and (("bool", word) in FORMS or word == "SIG"):
            return f"logical({self.value(it, 'bool')})"
        raise NoCounterpart(_describe(it))

    def _fill(self, form: tuple[str, list[str]], given: Sequence[ast.Expression | None], what: str) -> str:
        """Return a form (RAPID text with gaps) with the arguments filled in. `what`: the construct, named in the error
        if it has too many arguments. Raises NoCounterpart."""
        types = " ".join(form[1]).split()
        if len(given) > len(types):
            raise NoCounterpart(what)
        if "const" in types and ast.plain_number(given[0]) is None:
            raise NoCounterpart(f"{what} of a number that is computed")
        pairs = [(one, *kind.split("=")) for one, kind in zip_longest(given, types)]
        texts = [usual[0] if usual and one is None else self.value(one, kind) for one, kind, *usual in pairs]
        return form[0].format(*texts)

    # --- names ---

    def _learn_from_calls(self) -> None:
        """Find the parameters that programs change, and the kinds of parameters that only the arguments of calls
        determine. Repeat until nothing new is found. A program also changes a parameter if it changes a shared variable
        that was passed for it."""
        programs, known = {one.program.key: one.program for one in self.programs}, -1
        writes: dict[str, set[str]] = {key: set() for key in programs}  # the shared variables that a program changes
        while known != (known := sum(map(len, (self.changing, *self.kinds.values(), *writes.values())))):
            for analysis in self.programs:
                key, parameters = analysis.program.key, analysis.program.parameters
                changed = {key for one in analysis.program.statements for key in _changed_keys(one, self.changing)}
                self.changing |= {(key, place) for place, one in enumerate(parameters) if one.key in changed}
                own = {*(one.key for one in parameters), *(one.key for one in analysis.own)}
                writes[key] |= changed - own
                for call in (one for step in analysis.program.steps for one in ast.nodes(step)):
                    if isinstance(call, ast.ProgramCall) and call.key in programs:
                        writes[key] |= writes[call.key]
                        for place, value in enumerate(call.arguments[: len(programs[call.key].parameters)]):
                            parameter = programs[call.key].parameters[place]
                            kind = None if value is None else kind_of(value, partial(self._known_kind, analysis))
                            if kind is not None and not parameter.sigil:
                                self.kinds[call.key].setdefault(parameter.key, kind)
                            if isinstance(value, ast.Variable) and value.key in writes[call.key] - own:
                                self.changing.add((call.key, place))


BLOCKS: Mapping[type, BlockLine] = {
    ast.If: BlockLine("IF {} THEN"),
    ast.Else: BlockLine("ELSE", back=1),
    ast.While: BlockLine("WHILE {} DO"),
    ast.For: BlockLine("WHILE {} DO"),  # used only for a FOR that cannot be translated
    ast.Case: BlockLine("TEST {}", "num", "0", by=2),
    ast.Value: BlockLine("CASE {}:", "num", "1", back=1),
    ast.Any: BlockLine("DEFAULT:", back=1),
}
Datum = tuple[str, Kind, str]  # identifies a variable: its program ("" if shared), its kind and its key
INSTRUCTIONS: Mapping[str, Callable[[RapidTranslator, ast.Instruction], None]] = {
    "SPEED": RapidTranslator._speed,
    "SIGNAL": lambda self, it: self.say(*[self._signal("SIGNAL", one) for one in it.arguments]),
    "TYPE": RapidTranslator._type,
    "DECOMPOSE": RapidTranslator._decompose,
    "CALL": lambda self, it: self.say(f"{self._call_text(it.arguments[0])};"),
    "REACT": RapidTranslator._react,
    "REACTI": RapidTranslator._react,
}


def _minus(it: ast.Expression | None) -> ast.Expression:
    """Return the negative of a distance. Raises NoCounterpart if the distance is missing."""
    if it is None:
        raise NoCounterpart("a distance that is left out")
    return ast.Number(-it.value, "", span=it.span) if isinstance(it, ast.Number) else ast.Unary("-", it, span=it.span)


def _free(name: str, taken: Collection[str]) -> str:
    """Return an identifier made from a name, such that it is not in `taken`, and is neither a RAPID word nor the name
    of a routine."""
    plain = identifier(name.lower(), 28)
    while plain in TAKEN or plain in taken or NUMBERED.fullmatch(plain):
        plain += "_"
    return plain


def _braces(items: Sequence[object]) -> str:
    """Return sizes, or indexes, in braces; "" if there are none."""
    return "{" + ", ".join(map(str, items)) + "}" if items else ""


def _describe(it: ast.Expression | None) -> str:
    return "a value that is left out" if it is None else expression_text(it)


def _changed_keys(statement: ast.Statement, changing: set[tuple[str, int]]) -> Iterator[str]:
    """Yield the keys of the variables that a statement may change. `changing`: the parameters that programs are known
    to change."""
    match statement:
        case ast.Assignment(target=target) | ast.For(variable=target):
            yield target.key
        case ast.Instruction(word="CALL", arguments=(ast.ProgramCall() as called,)):
            for place, one in enumerate(called.arguments):
                if isinstance(one, ast.Variable) and (called.key, place) in changing:
                    yield one.key
        case ast.Instruction(word="SET" | "HERE" | "DECOMPOSE" | "PROMPT" | "READ", arguments=arguments):
            yield from (one.key for one in arguments if isinstance(one, ast.Variable))
