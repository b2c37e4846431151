"""The instructions of a program: one row each, and the control words (val2 section 4)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from vrs_cli.language.words.word import Argument, Route, Shape, State, Word, by_name

AT = frozenset({"AT"})
ALWAYS = frozenset({"ALWAYS"})


def real(name: str, optional: bool = False, repeated: bool = False) -> Argument:
    return Argument(name, Shape.REAL, optional, repeated)


PLACE = Argument("location", Shape.PLACE)
LOCATION = Argument("location", Shape.LOCATION)
DEFINED = Argument("location", Shape.LOCATION_VARIABLE)
PROGRAM = Argument("program", Shape.PROGRAM)
LABEL = Argument("label", Shape.LABEL)
TEXT = Argument("$text", Shape.STRING)
UNIT = Argument("unit", Shape.GROUP)
DEVICE = Argument("$device", Shape.STRING, optional=True)
TASK = real("task", optional=True)
ITEMS = Argument("item", Shape.ITEM, optional=True, repeated=True)
SWITCHES = Argument("switch", Shape.SWITCH, repeated=True)
LOOPS = real("loops", optional=True)
SIGNALS = Argument("signal", Shape.SIGNALS, repeated=True)
COMPOUND_SHIFT = (real("dx", True), real("dy", True), real("dz", True), real("rotation", True))


def _motion(
    name: str, arguments: tuple[Argument, ...], summary: str, example: str, where: str = "1 2 +", note: str = ""
) -> Word:
    return Word(name, arguments, Route.MOTION, summary, example, where, modifiers=AT, note=note)


def _setting(
    name: str, summary: str, where: str = "1 2 +", arguments: tuple[Argument, ...] = (), breaks: bool = False
) -> Word:
    example = f"{name} ALWAYS"
    return Word(name, arguments, Route.PARAMETER, summary, example, where, modifiers=ALWAYS, breaks=breaks)


def _flag(name: str, summary: str) -> Word:
    return Word(name, (), Route.PARAMETER, summary, name, "1 2 +", note="it stays until the opposite is asked for")


def _declaration(name: str, summary: str, example: str, note: str = "") -> Word:
    variables = (Argument("variable", Shape.VARIABLE, repeated=True),)
    return Word(name, variables, Route.PROGRAM, summary, example, "+", modifiers=frozenset({"SORT"}), note=note)


def _hand(name: str, summary: str, breaks: bool = False) -> Word:
    width = () if name.startswith("RELAX") else (real("width", optional=True),)
    return Word(name, width, Route.PARAMETER, summary, name, "1 2 +", breaks=breaks)


def _refused(name: str, summary: str, where: str, note: str) -> Word:
    return Word(name, (), Route.PROGRAM, summary, name, where, state=State.REFUSED, note=note)


_MOTIONS = (
    _motion("MOVE", (PLACE,), "joint-interpolated motion to a location", "MOVE part"),
    _motion("MOVES", (PLACE,), "straight-line motion to a location", "MOVES part"),
    _motion("MOVET", (PLACE, real("hand")), "MOVE, operating the hand on the way", "MOVET part, 1"),
    _motion("MOVEST", (PLACE, real("hand")), "MOVES, operating the hand on the way", "MOVEST part, 0"),
    _motion(
        "APPRO",
        (LOCATION, real("distance")),
        "motion to a distance [mm] in front of a location, back along its tool axis",
        "APPRO part, 50",
    ),
    _motion("APPROS", (LOCATION, real("distance")), "APPRO in a straight line", "APPROS part, 50"),
    _motion("DEPART", (real("distance"),), "motion back along the tool axis by a distance [mm]", "DEPART 50"),
    _motion("DEPARTS", (real("distance"),), "DEPART in a straight line", "DEPARTS 50"),
    _motion(
        "DRIVE",
        (real("joint"), real("change"), real("speed", optional=True)),
        "turn one joint by so many degrees, or slide it by mm, at a percentage of full speed",
        "DRIVE 1, -30, 50",
    ),
    _motion("READY", (), "motion to the ready position, arm straight up", "READY"),
    _motion("NEST", (), "fold the arm to its parking position", "NEST", "1 2"),
    _motion("GO", (PLACE,), "motion to a location in VAL", "GO part", "1", "MOVE is the same"),
    _motion(
        "DRAW",
        (real("dx", True), real("dy", True), real("dz", True)),
        "straight motion along the axes of the world by so many mm, in VAL",
        "DRAW 0, 0, 50",
        "1",
        "MOVES SHIFT(DEST BY dx, dy, dz) is the same",
    ),
    Word("ALIGN", (), Route.MOTION, "turn the tool so that its Z lies along the nearest world axis", "ALIGN", "1 2 +"),
    Word("DELAY", (real("seconds"),), Route.MOTION, "no motion for so many seconds", "DELAY 0.5", "1 2 +"),
    Word("BREAK", (), Route.MOTION, "wait until the robot has come to rest", "BREAK", "1 2 +", breaks=True),
)

_DEVICE = Argument("ROBOT", Shape.SWITCH)
_CALIBRATED = "nothing is done: a virtual robot is calibrated"
CALIBRATE = Word(
    "CALIBRATE", (), Route.PARAMETER, "find the zero of the joints", "CALIBRATE", "1 2 +", note=_CALIBRATED
)
SELECT = Word(
    "SELECT",
    (_DEVICE,),
    Route.PARAMETER,
    "choose a robot",
    "SELECT ROBOT = 1",
    "+",
    value=real("number"),
    note="there is one, number 1",
)

_SETTINGS = (
    Word(
        "SPEED",
        (real("speed"), real("rotation", optional=True)),
        Route.PARAMETER,
        "program speed, in percent or as the speed of the tool tip, for the next motion or always",
        "SPEED 30 ALWAYS",
        "1 2 +",
        modifiers=frozenset({"UNIT", "ALWAYS"}),
    ),
    Word(
        "DURATION",
        (real("seconds"),),
        Route.PARAMETER,
        "the least time that a motion takes",
        "DURATION 2 ALWAYS",
        "2 +",
        modifiers=ALWAYS,
    ),
    Word(
        "ACCEL",
        (real("acceleration"), real("deceleration", optional=True)),
        Route.PARAMETER,
        "acceleration and deceleration in percent",
        "ACCEL 50, 30",
        "+",
    ),
    _setting("COARSE", "settle loosely at the end of a motion", arguments=(real("tolerance", optional=True),)),
    _setting("FINE", "settle closely at the end of a motion", arguments=(real("tolerance", optional=True),)),
    _setting("NULL", "wait for position errors to vanish when the robot comes to rest"),
    _setting("NONULL", "do not wait for position errors to vanish"),
    _setting("CPON", "pass from motion to motion without a stop", "2 +"),
    _setting("CPOFF", "come to rest between motions", "2 +", breaks=True),
    _setting("INTON", "integral action of the servos during motions", "1 2"),
    _setting("INTOFF", "no integral action of the servos during motions", "1 2"),
    _setting("SINGLE", "keep the wrist joints within one turn"),
    _setting("MULTIPLE", "let the wrist joints use their whole range"),
    _setting("OVERLAP", "let a joint turn more than half a turn in one motion", "2 +"),
    _setting("NOOVERLAP", "refuse more than half a turn of a joint in one motion", "2 +"),
    _flag("RIGHTY", "an arm like a human right arm"),
    _flag("LEFTY", "an arm like a human left arm"),
    _flag("ABOVE", "elbow above the line from shoulder to wrist"),
    _flag("BELOW", "elbow below the line from shoulder to wrist"),
    _flag("FLIP", "joint 5 at negative angles"),
    _flag("NOFLIP", "joint 5 at positive angles"),
    _hand("OPEN", "open the hand during the next motion"),
    _hand("CLOSE", "close the hand during the next motion"),
    _hand("RELAX", "let the hand go slack during the next motion"),
    _hand("OPENI", "come to rest, then open the hand", breaks=True),
    _hand("CLOSEI", "come to rest, then close the hand", breaks=True),
    _hand("RELAXI", "come to rest, then let the hand go slack", breaks=True),
    Word(
        "TOOL",
        (Argument("location", Shape.LOCATION, optional=True),),
        Route.PARAMETER,
        "the tool transformation, from flange to tool tip; NULL when omitted",
        "TOOL gripper",
        "1 2 +",
        breaks=True,
        drastic=True,
    ),
    Word(
        "BASE",
        COMPOUND_SHIFT,
        Route.PARAMETER,
        "shift [mm] and turn [degrees about Z] the world frame against the robot",
        "BASE 100,,-50, 90",
        "1 2 +",
        breaks=True,
        drastic=True,
    ),
    CALIBRATE,
    SELECT,
    Word("ENABLE", (SWITCHES,), Route.PARAMETER, "turn switches on", "ENABLE CP", "2 +"),
    Word("DISABLE", (SWITCHES,), Route.PARAMETER, "turn switches off", "DISABLE MESSAGES", "2 +"),
    Word(
        "SWITCH",
        (Argument("switch", Shape.SWITCH),),
        Route.PARAMETER,
        "turn a switch on or off",
        "SWITCH CP = OFF",
        "2 +",
        value=real("value"),
    ),
    Word(
        "PARAMETER",
        (Argument("parameter", Shape.PARAMETER_NAME),),
        Route.PARAMETER,
        "set a parameter",
        "PARAMETER HAND.TIME = 0.1",
        "2 +",
        value=Argument("value", Shape.SETTING),
    ),
)

_POSITIONS = (
    Word(
        "SHIFT",
        (DEFINED, Argument("dx", Shape.REAL, True, lead="BY"), real("dy", True), real("dz", True)),
        Route.POSITION,
        "move a location along the axes of the world by so many mm, in VAL",
        "SHIFT part BY 5, -5, 10",
        "1",
        note="SET part = SHIFT(part BY dx, dy, dz) is the same",
    ),
    Word(
        "INVERSE",
        (DEFINED,),
        Route.POSITION,
        "define a location as the inverse of another, in VAL",
        "INVERSE b = a",
        "1",
        value=LOCATION,
        note="SET b = INVERSE(a) is the same",
    ),
    Word(
        "FRAME",
        (
            DEFINED,
            Argument("origin", Shape.LOCATION, lead="="),
            Argument("x", Shape.LOCATION),
            Argument("y", Shape.LOCATION),
        ),
        Route.POSITION,
        "define a frame by its origin, a location on its X axis and one on its +Y side, in VAL",
        "FRAME pallet = a, b, c",
        "1",
        note="SET pallet = FRAME(a, b, c, a) is the same",
    ),
    Word(
        "SET",
        (DEFINED,),
        Route.POSITION,
        "define a location by an expression",
        "SET b = a:grip",
        "2 +",
        value=Argument("value", Shape.PLACE),
    ),
    Word("HERE", (DEFINED,), Route.POSITION, "define a location as the present position", "HERE part", "1 2 +"),
    Word(
        "POINT",
        (DEFINED,),
        Route.POSITION,
        "define a location by an expression",
        "POINT b = a",
        "1 2 +",
        value=Argument("value", Shape.PLACE),
    ),
    Word(
        "DECOMPOSE",
        (Argument("element", Shape.REAL_VARIABLE),),
        Route.POSITION,
        "put the six numbers of a location, or all joints, into elements of an array",
        "DECOMPOSE x[1] = part",
        "2 +",
        value=Argument("value", Shape.PLACE),
    ),
)

_INPUT_OUTPUT = (
    Word("TYPE", (ITEMS,), Route.PROGRAM, "print numbers and texts", 'TYPE "x =", /F8.2, x', "1 2 +"),
    Word(
        "TYPEI",
        (real("value"),),
        Route.PROGRAM,
        "print an integer, in VAL",
        "TYPEI count",
        "1",
        note="TYPE is its like",
    ),
    Word(
        "SETI",
        (Argument("variable", Shape.REAL_VARIABLE),),
        Route.PROGRAM,
        "assign an integer, cut toward 0, in VAL",
        "SETI count = count+1",
        "1",
        value=real("value"),
        note="count = INT(value) is the same",
    ),
    Word(
        "PROMPT",
        (
            Argument("$text", Shape.STRING, optional=True),
            Argument("variable", Shape.VARIABLE, optional=True, repeated=True),
        ),
        Route.PROGRAM,
        "print a text and read a line into variables",
        'PROMPT "How many? ", count',
        "1 2 +",
    ),
    Word(
        "SIGNAL",
        (SIGNALS,),
        Route.PROGRAM,
        "turn signals on, or off where the number is negative",
        "SIGNAL 1, -2",
        "1 2 +",
    ),
    Word("RESET", (), Route.PROGRAM, "turn all output signals off", "RESET", "1 2 +"),
    Word(
        "BITS",
        (real("first"), real("count", optional=True)),
        Route.PROGRAM,
        "set signals to the bits of a number",
        "BITS 1, 4 = count",
        "2 +",
        value=real("value"),
    ),
    Word(
        "WAIT",
        (real("condition", optional=True),),
        Route.PROGRAM,
        "hold the program until a condition is true; bare: for one tick",
        "WAIT SIG(1001)",
        "1 2 +",
        note="WAIT 3, a number, is VAL's: the input 3, which is SIG(1003)",
    ),
    Word(
        "PACK",
        (Argument("$element", Shape.STRING_VARIABLE), real("first"), real("count")),
        Route.PROGRAM,
        "put characters into an array whose elements, of 128 each, are taken for one string",
        "PACK $a[0], 120, 20 = $text",
        "+",
        value=Argument("$text", Shape.STRING),
    ),
    Word(
        "TIMER",
        (real("timer"),),
        Route.PROGRAM,
        "set a timer [s]; it counts on from there",
        "TIMER 1 = 0",
        "2 +",
        value=real("seconds"),
    ),
)

_SIGNAL = Argument("signal", Shape.SIGNALS)
_CHANNEL = _SIGNAL

_FLOW = (
    Word("CALL", (PROGRAM,), Route.PROGRAM, "carry out another program", "CALL pick(part, 50)", "2 +"),
    Word(
        "GOSUB",
        (PROGRAM,),
        Route.PROGRAM,
        "carry out another program, in VAL",
        "GOSUB pick",
        "1",
        note="CALL is the same",
    ),
    Word(
        "IFSIG",
        (
            _CHANNEL,
            *(replace(_CHANNEL, optional=True),) * 3,
            Argument("label", Shape.LABEL, lead="THEN"),
        ),
        Route.PROGRAM,
        "go on at a label where these signals are on (off for negative numbers), in VAL",
        "IFSIG 1, -2 THEN 10",
        "1",
        note="the numbers 1 to 512 are inputs, so IF SIG(1001, -1002) GOTO 10 is the same",
    ),
    Word(
        "GRASP",
        (real("width"), LABEL),
        Route.PROGRAM,
        "come to rest, close the hand, and go on at a label where its fingers are nearer than a width [mm]",
        "GRASP 20, 10",
        "1 2",
        breaks=True,
        note="PARAMETER GRASP.WIDTH says what is in the hand: 0, an empty hand, at the start",
    ),
    Word(
        "RETURN",
        (real("steps", optional=True),),
        Route.PROGRAM,
        "go back to the program that called this one",
        "RETURN",
        "1 2 +",
        note="RETURN n, of VAL, leaves out the n steps after the call",
    ),
    Word("EXIT", (LOOPS,), Route.PROGRAM, "leave the loop, or so many loops from the inside", "EXIT", "+"),
    Word("NEXT", (LOOPS,), Route.PROGRAM, "begin the next pass of the loop, or of an outer one", "NEXT 2", "+"),
    Word(
        "CALLS",
        (Argument("$name(arguments)", Shape.PROGRAM_TEXT),),
        Route.PROGRAM,
        "carry out the program that a string names",
        "CALLS $name(part, 50)",
        "+",
    ),
    _declaration("AUTO", "variables of one call of the program: each call has its own", "AUTO REAL i, row[]"),
    _declaration("LOCAL", "variables of the program, which keep their values between calls", "LOCAL count, $name"),
    _declaration(
        "GLOBAL",
        "say that variables belong to all programs",
        "GLOBAL LOC part, pallet[]",
        "every variable that is not declared does, so it changes nothing",
    ),
    Word("STOP", (), Route.PROGRAM, "end this cycle of the main program", "STOP", "1 2 +", breaks=True),
    Word("PAUSE", (), Route.PROGRAM, "stop so that PROCEED goes on", "PAUSE", "1 2 +", breaks=True),
    Word("HALT", (), Route.PROGRAM, "stop for good", "HALT", "1 2 +", breaks=True),
)

_PRIORITY = real("priority", optional=True)

_REACTIONS = (
    Word(
        "REACT",
        (_SIGNAL, PROGRAM, _PRIORITY),
        Route.PROGRAM,
        "call a program when a signal changes, between two steps",
        "REACT 1001, stopped, 5",
        "1 2 +",
    ),
    Word(
        "REACTI",
        (_SIGNAL, PROGRAM, _PRIORITY),
        Route.PROGRAM,
        "REACT that brakes the motion at once",
        "REACTI -1002, guard.open, 10",
        "1 2 +",
    ),
    Word(
        "REACTE",
        (Argument("program", Shape.PROGRAM, optional=True),),
        Route.PROGRAM,
        "call a program when a step fails; bare: no more",
        "REACTE mend",
        "+",
    ),
    Word("IGNORE", (_SIGNAL,), Route.PROGRAM, "end REACT or REACTI", "IGNORE 1001", "1 2 +"),
    Word(
        "LOCK",
        (real("priority"),),
        Route.PROGRAM,
        "the priority of the program, 0 to 127; reactions of this or a lower one wait",
        "LOCK 5",
        "2 +",
    ),
    Word("RETURNE", (), Route.PROGRAM, "return from REACTE to the step after the one that failed", "RETURNE", "+"),
    Word("RUNSIG", (_SIGNAL,), Route.PROGRAM, "keep a signal on while the program runs", "RUNSIG 3", "2 +"),
    Word("BRAKE", (), Route.MOTION, "stop the present motion at once", "BRAKE", "+"),
)

_STARTED = (PROGRAM, real("cycles", optional=True), real("step", optional=True))


def _task_word(name: str, summary: str, example: str) -> Word:
    return Word(name, (TASK,), Route.PROGRAM, summary, example, "+")


def _file(name: str, summary: str) -> Word:
    return Word(name, (UNIT, Argument("$file", Shape.STRING)), Route.PROGRAM, summary, f'{name} (lun) "log.txt"', "+")


_TASKS = (
    Word(
        "EXECUTE",
        (*_STARTED, Argument("task", Shape.TASK, optional=True)),
        Route.PROGRAM,
        "start a program as a task beside this one; without a number, the first that is free",
        "EXECUTE 2 watch(part), -1",
        "+",
    ),
    Word(
        "PCEXECUTE",
        _STARTED,
        Route.PROGRAM,
        "start the process control program, which runs beside the robot program",
        "PCEXECUTE watch, -1",
        "2",
    ),
    _task_word("ABORT", "stop a task after its present step", "ABORT 2"),
    _task_word("KILL", "clear a task that has stopped", "KILL 2"),
    _task_word("CYCLE.END", "let a task end after its present cycle", "CYCLE.END 2"),
    _task_word("PROCEED", "let a task that has stopped go on", "PROCEED 2"),
    _task_word("RETRY", "let a task repeat the step at which it stopped", "RETRY 2"),
    Word(
        "WAIT.EVENT",
        (real("mask", True), real("seconds", True)),
        Route.PROGRAM,
        "wait until another task sets the event of this one, or for so many seconds",
        "WAIT.EVENT 1, 2.5",
        "+",
    ),
    Word("SET.EVENT", (real("task"),), Route.PROGRAM, "set the event of a task", "SET.EVENT 2", "+"),
    Word(
        "ATTACH",
        (Argument("unit", Shape.UNIT, optional=True), Argument("mode", Shape.GROUP, optional=True), DEVICE),
        Route.PROGRAM,
        "take the robot (unit 0), as soon as no other task has it, the disk (5 to 8, 17 to 19) or the terminal (4)",
        'ATTACH (lun, 4) "DISK"',
        "+",
        note="mode 4 chooses a unit of the disk",
    ),
    Word(
        "DETACH",
        (Argument("unit", Shape.GROUP, optional=True),),
        Route.PROGRAM,
        "come to rest and let the robot go; or close the file of a unit, and let that go",
        "DETACH (lun)",
        "+",
    ),
)

_FILES = (
    _file("FOPENR", "open a file to read"),
    _file("FOPENW", "open a new file to write"),
    _file("FOPENA", "open a file to write at its end, a new one where there is none"),
    Word("FCLOSE", (UNIT,), Route.PROGRAM, "close a file", "FCLOSE (lun)", "+"),
    _file("FDELETE", "delete a file"),
    Word(
        "READ",
        (UNIT, Argument("variable", Shape.VARIABLE, repeated=True)),
        Route.PROGRAM,
        "read a line of a file, or of the terminal, into variables",
        "READ (lun) x, y, $name",
        "+",
    ),
    Word(
        "WRITE",
        (UNIT, ITEMS),
        Route.PROGRAM,
        "write a line to a file, or to the terminal, as TYPE does",
        'WRITE (lun) "x =", /F8.2, x',
        "+",
    ),
)

_NO_SENSOR = "there is no sensor line; a motion with AT or IN changes a motion under way"

_REFUSED = (
    _refused("ELSEIF", "not a word of VAL-II", "", "write ELSE, and IF ... THEN on the next line"),
    _refused("ENDIF", "not a word of VAL-II", "", "every block ends in END"),
    _refused("DOUBLE", "not a word by itself", "", "write AUTO DOUBLE x, or LOCAL, or GLOBAL"),
    Word("REMARK", (), Route.PROGRAM, "a comment in VAL", "REMARK pick the part", "1"),
    _refused("ALTER", "change of the path by a sensor", "2 +", _NO_SENSOR),
    _refused("ALTON", "change of the path by a sensor", "2 +", _NO_SENSOR),
    _refused("ALTOFF", "change of the path by a sensor", "2 +", _NO_SENSOR),
    _refused("NOALTER", "change of the path by a sensor", "2", _NO_SENSOR),
    _refused("MC", "a monitor command in a program", "+", "a file that COMMANDS carries out has monitor commands"),
    _refused("KEYMODE", "how a key of the pendant behaves", "+", "there is no pendant; PROMPT asks at the terminal"),
    _refused("VPICTURE", "take a picture", "+", "there is no camera at this robot"),
    _refused("VLOCATE", "find a part in a picture", "+", "there is no camera at this robot"),
    _refused("DEFBELT", "conveyor tracking", "2 +", "there is no conveyor at this robot"),
    _refused("SETBELT", "conveyor tracking", "2 +", "there is no conveyor at this robot"),
    _refused("WINDOW", "conveyor tracking", "2 +", "there is no conveyor at this robot"),
    _refused("FOPEND", "reading of a disk directory", "+", "FDIRECTORY at the prompt lists a folder"),
    _refused("FSEEK", "records of a file by number", "+", "READ and WRITE go from line to line"),
    _refused("FEMPTY", "emptying of buffers", "+", "FCLOSE writes all there is"),
    _refused("FCMND", "disk commands from programs", "+", "FDELETE deletes; FRENAME is typed at the prompt"),
    _refused("ESTOP", "power off at once", "+", "use HALT"),
)

INSTRUCTIONS: Mapping[str, Word] = by_name(
    (*_MOTIONS, *_SETTINGS, *_POSITIONS, *_INPUT_OUTPUT, *_FLOW, *_REACTIONS, *_TASKS, *_FILES, *_REFUSED)
)


def _control(
    name: str,
    arguments: tuple[Argument, ...],
    summary: str,
    example: str,
    after: str = "",
    value: Argument | None = None,
) -> Word:
    return Word(name, arguments, Route.PROGRAM, summary, example, "2 +", value, after=after)


_CONDITION = real("condition")
_COUNTED = Argument("variable", Shape.REAL_VARIABLE)

CONTROL: Mapping[str, Word] = by_name(
    (
        _control("IF", (_CONDITION,), "a block, or a branch, on a condition", "IF x > 2 THEN", "THEN | GOTO label"),
        _control("ELSE", (), "what is done where the condition of IF is false", "ELSE"),
        _control("WHILE", (_CONDITION,), "a loop that tests before each pass", "WHILE x > 2 DO", "DO"),
        _control("DO", (), "a loop that tests after each pass", "DO"),
        _control("UNTIL", (_CONDITION,), "the end of a DO loop: leaves it where the condition is true", "UNTIL x > 2"),
        _control(
            "FOR", (_COUNTED,), "a loop that counts", "FOR i = 1 TO 10 STEP 2", "TO last [STEP step]", real("first")
        ),
        _control("CASE", (real("number"),), "chooses among VALUE parts", "CASE count OF", "OF"),
        _control("VALUE", (real("number", repeated=True),), "a part of CASE", "VALUE 1, 2:", ":"),
        _control("ANY", (), "the part of CASE for every other value", "ANY"),
        _control("END", (), "the end of IF, WHILE, FOR and CASE", "END"),
        _control("GOTO", (LABEL,), "go on at a label", "GOTO 10"),
    )
)

PROGRAM_WORDS: Mapping[str, Word] = {**CONTROL, **INSTRUCTIONS}

DECLARATIONS = frozenset({"AUTO", "LOCAL", "GLOBAL"})  # nothing is done: they say whose variables are
RELATIONS_OF_VAL = {"EQ": "==", "NE": "<>", "GT": ">", "GE": ">=", "LT": "<", "LE": "<="}  # of IF a EQ b THEN label
LOOP_JUMPS = frozenset({"EXIT", "NEXT"})  # jumps that the enclosing loops decide

CONNECTIVES = frozenset({"THEN", "TO", "STEP", "OF", "BY", "ALWAYS", "MMPS", "IPS"})
OPERATOR_WORDS = frozenset({"NOT", "AND", "OR", "XOR", "MOD", "COM", "BAND", "BOR", "BXOR"})

# The words that no variable can have as its name, and why. Every other word is one only in its place: an instruction
# at the start of a line and before neither = nor [, a function before (, STEP or AT where an expression has ended.
# Programs that ran on controllers have variables status, stop, value, delay and dx (val2 sections 1 and 15).
RESERVED: Mapping[str, str] = {
    **dict.fromkeys(sorted(OPERATOR_WORDS), "an operator"),
    **dict.fromkeys(("TRUE", "FALSE", "ON", "OFF", "PI"), "a constant"),
    **dict.fromkeys(
        ("IF", "THEN", "ELSE", "CASE", "OF", "FOR", "TO", "WHILE", "DO", "UNTIL", "GOTO"), "a word of blocks and jumps"
    ),
    **dict.fromkeys(("ALWAYS", "MMPS", "IPS", "BY"), "a word that stands behind a value"),
}


def reserved(word: str) -> tuple[str, str]:
    """Why a word can be no name, and a hint."""
    return f"{word} is a word of the language", f"{RESERVED[word]} is no name"
