"""List the instructions that programs may contain, and the words of blocks and jumps, with one row for each (val2
section 4)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from vrs_cli.language.words.word import Control, Role, Route, Shape, State, Word, by_name

PLACE, LOCATION, DEFINED = Shape.PLACE, Shape.LOCATION, Shape.LOCATION_VARIABLE

_motion = partial(Word, route=Route.MOTION, role=Role.DESIGNER)
_setting = partial(Word, route=Route.PARAMETER)
_location = partial(Word, route=Route.POSITION)


def _flag(name: str, summary: str) -> Word:
    return _setting(name, "1 2 +", summary, name, "it applies until the opposite word is used")


def unavailable(name: str, where: str, summary: str, note: str) -> Word:
    """Return the row of a word of VAL or V+ that is refused. `note`: the hint in the message."""
    return Word(name, where, summary, name, note, state=State.REFUSED)


INSTRUCTIONS: Mapping[str, Word] = by_name((
    # motions
    _motion("MOVE location [AT t | IN dt]", "1 2 +",
        "joint-interpolated motion to a location", "MOVE part", shapes=(PLACE,)),
    _motion("MOVES location [AT t | IN dt]", "1 2 +",
        "straight-line motion to a location", "MOVES part", shapes=(PLACE,)),
    _motion("MOVET location, hand [AT t | IN dt]", "1 2 +",
        "MOVE that opens or closes the hand on the way", "MOVET part, 1", shapes=(PLACE,)),
    _motion("MOVEST location, hand [AT t | IN dt]", "1 2 +",
        "MOVES that opens or closes the hand on the way", "MOVEST part, 0", shapes=(PLACE,)),
    _motion("APPRO location, distance [AT t | IN dt]", "1 2 +",
        "motion to a distance [mm] in front of a location, back along its tool axis", "APPRO part, 50"),
    _motion("APPROS location, distance [AT t | IN dt]", "1 2 +", "APPRO in a straight line", "APPROS part, 50"),
    _motion("DEPART distance [AT t | IN dt]", "1 2 +",
        "motion back along the tool axis by a distance [mm]", "DEPART 50"),
    _motion("DEPARTS distance [AT t | IN dt]", "1 2 +", "DEPART in a straight line", "DEPARTS 50"),
    _motion("DRIVE joint, change[, speed] [AT t | IN dt]", "1 2 +",
        "turn one joint by so many degrees, or slide it by mm, at a percentage of full speed", "DRIVE 1, -30, 50"),
    _motion("JMOVE [value, ...] [AT t | IN dt]", "+",
        "joint-interpolated motion to joints in degrees or mm", "JMOVE 0, -90, 90, 0, x, y",
        "joints that are left out stay as they are"),
    _motion("READY [AT t | IN dt]", "1 2 +", "motion to the ready position, arm straight up", "READY"),
    _motion("NEST [AT t | IN dt]", "1 2", "fold the arm to its parking position", "NEST"),
    _motion("GO location [AT t | IN dt]", "1",
        "motion to a location in VAL", "GO part", "MOVE is the same", shapes=(PLACE,)),
    _motion("DRAW [dx][, dy][, dz] [AT t | IN dt]", "1",
        "straight motion along the axes of the world by so many mm, in VAL", "DRAW 0, 0, 50",
        "MOVES SHIFT(DEST BY dx, dy, dz) is the same"),
    _motion("ALIGN", "1 2 +", "turn the tool so that its Z lies along the nearest world axis", "ALIGN"),
    _motion("DELAY seconds", "1 2 +",
        "hold the arm for so many seconds; the program goes on to its next motion", "DELAY 0.5"),
    _motion("ALTON [(lun)] [mode]", "2 +",
        "let ALTER displace the path along the axes of the tool (mode 0, 1) or the world (2, 3); 1 and 3: adding up",
        "ALTON 3", "we know the meaning of the modes only from memory"),
    _motion("ALTER [(lun)] [dx][, dy][, dz][, rx][, ry][, rz]", "2 +",
        "displace the current motion and all later ones, by mm and degrees", "ALTER , , 2"),
    _motion("ALTOFF [(lun)]", "2 +", "end ALTON: the next motion goes to its own target", "ALTOFF"),
    _motion("NOALTER", "2", "end ALTON, in VAL-II", "NOALTER", "ALTOFF is the same"),
    _motion("BREAK", "1 2 +", "wait until the robot has come to rest", "BREAK", breaks=True),
    # settings
    _setting("SPEED speed[, rotation] [MMPS | IPS | MONITOR] [ALWAYS]", "1 2 +",
        "program speed, in percent or as the speed of the tool tip, for the next motion or always", "SPEED 30 ALWAYS",
        role=Role.DESIGNER),
    _setting("DURATION seconds [ALWAYS]", "2 +", "the least time that a motion takes", "DURATION 2 ALWAYS"),
    _setting("ACCEL [(profile)] [acceleration][, deceleration]", "+",
        "acceleration and deceleration in percent; profile 0 is LSPB, 1 SCURVE, 2 QUINTIC, another one 0",
        "ACCEL (1) 50, 30"),
    _setting("PAYLOAD [percent][, joint]", "+",
        "the load for the servo of one joint, or of all joints", "PAYLOAD 50",
        "it has no effect: a virtual arm follows its path under any load"),
    _setting("SWIVEL [joint][, value] [ALWAYS]", "",
        "on a straight line of a redundant arm: the end value of one joint; without a value, it does not move",
        "SWIVEL 3, 20", "alone: the planner chooses all joints"),
    _setting("COARSE [tolerance] [ALWAYS]", "1 2 +", "settle loosely at the end of a motion", "COARSE ALWAYS"),
    _setting("FINE [tolerance] [ALWAYS]", "1 2 +", "settle closely at the end of a motion", "FINE ALWAYS"),
    _setting("NULL [ALWAYS]", "1 2 +",
        "wait for position errors to vanish when the robot comes to rest", "NULL ALWAYS"),
    _setting("NONULL [ALWAYS]", "1 2 +", "do not wait for position errors to vanish", "NONULL ALWAYS"),
    _setting("CPON [ALWAYS]", "2 +", "pass from motion to motion without a stop", "CPON ALWAYS"),
    _setting("CPOFF [ALWAYS]", "2 +", "come to rest between motions", "CPOFF ALWAYS", breaks=True),
    _setting("INTON [ALWAYS]", "1 2", "integral action of the servos during motions", "INTON ALWAYS"),
    _setting("INTOFF [ALWAYS]", "1 2", "no integral action of the servos during motions", "INTOFF ALWAYS"),
    _setting("SINGLE [ALWAYS]", "1 2 +", "keep the wrist joints within one turn", "SINGLE ALWAYS"),
    _setting("MULTIPLE [ALWAYS]", "1 2 +", "let the wrist joints use their whole range", "MULTIPLE ALWAYS"),
    _setting("OVERLAP [ALWAYS]", "2 +", "let a joint turn more than half a turn in one motion", "OVERLAP ALWAYS"),
    _setting("NOOVERLAP [ALWAYS]", "2 +", "refuse more than half a turn of a joint in one motion", "NOOVERLAP ALWAYS"),
    _flag("RIGHTY", "an arm like a human right arm"),
    _flag("LEFTY", "an arm like a human left arm"),
    _flag("ABOVE", "elbow above the line from shoulder to wrist"),
    _flag("BELOW", "elbow below the line from shoulder to wrist"),
    _flag("FLIP", "joint 5 at negative angles"),
    _flag("NOFLIP", "joint 5 at positive angles"),
    _setting("OPEN [width]", "1 2 +", "open the hand during the next motion", "OPEN"),
    _setting("CLOSE [width]", "1 2 +", "close the hand during the next motion", "CLOSE"),
    _setting("RELAX", "1 2 +", "let the hand go slack during the next motion", "RELAX"),
    _setting("OPENI [width] [AT t | IN dt]", "1 2 +",
        "come to rest, then open the hand; at a time: open it then, also on the way", "OPENI", breaks=True,
        role=Role.DESIGNER),
    _setting("CLOSEI [width] [AT t | IN dt]", "1 2 +",
        "come to rest, then close the hand; at a time: close it then, also on the way", "CLOSEI", breaks=True,
        role=Role.DESIGNER),
    _setting("RELAXI", "1 2 +", "come to rest, then let the hand go slack", "RELAXI", breaks=True,
        role=Role.DESIGNER),
    _setting("TOOL [location]", "1 2 +",
        "the tool transformation, from flange to tool tip; NULL when omitted", "TOOL gripper", breaks=True,
        drastic=True),
    _setting("BASE [dx][, dy][, dz][, rotation]", "1 2 +",
        "shift [mm] and turn [degrees about Z] the world frame relative to the robot", "BASE 100,,-50, 90", breaks=True,
        drastic=True),
    _setting("CALIBRATE", "1 2 +",
        "find the zero of the joints", "CALIBRATE", "it has no effect: a virtual robot is always calibrated"),
    _setting("SELECT ROBOT = number", "+", "choose a robot", "SELECT ROBOT = 1", "there is one, number 1"),
    _setting("ROBOT.OPR (mode) [value, ...]", "+",
        "special functions of the robots of one maker", "ROBOT.OPR (1) 0",
        "it has no effect: no robot here has such functions"),
    _setting("ENABLE switch, ...", "2 +", "turn switches on", "ENABLE CP"),
    _setting("DISABLE switch, ...", "2 +", "turn switches off", "DISABLE MESSAGES"),
    _setting("SWITCH switch = value", "2 +", "turn a switch on or off", "SWITCH CP = OFF"),
    _setting("PARAMETER parameter = value", "2 +",
        "set a parameter", "PARAMETER HAND.TIME = 0.1", shapes=(Shape.PARAMETER_NAME, Shape.SETTING)),
    # positions
    _location("SHIFT location [BY dx][, dy][, dz]", "1",
        "move a location along the axes of the world by so many mm, in VAL", "SHIFT part BY 5, -5, 10",
        "SET part = SHIFT(part BY dx, dy, dz) is the same", shapes=(DEFINED,)),
    _location("INVERSE location = location", "1",
        "define a location as the inverse of another, in VAL", "INVERSE b = a", "SET b = INVERSE(a) is the same",
        shapes=(DEFINED,)),
    _location("FRAME location = origin, x, y", "1",
        "define a frame by its origin, a location on its X axis and one on its +Y side, in VAL",
        "FRAME pallet = a, b, c", "SET pallet = FRAME(a, b, c, a) is the same",
        shapes=(DEFINED, LOCATION, LOCATION, LOCATION)),
    _location("SET location = value", "2 +",
        "define a location by an expression", "SET b = a:grip", shapes=(DEFINED, PLACE)),
    _location("HERE location", "1 2 +", "define a location as the present position", "HERE part", shapes=(DEFINED,)),
    _location("JHERE element, ...", "+",
        "put the present joints, in degrees or mm, into variables", "JHERE j1, j2, j3, j4, j5, j6"),
    _location("POINT location = value", "1 2 +",
        "define a location by an expression", "POINT b = a", shapes=(DEFINED, PLACE)),
    _location("SOLVE.ANGLES element, flags, error = location[, joints][, configuration]", "+",
        "store the joints for a transformation, their CONFIG, and why they are out of reach, as bits of INRANGE",
        "SOLVE.ANGLES j[1], config, why = part, row[1], 1",
        "the solution that MOVE would choose from these joints (or the present ones), or with these bits of CONFIG",
        shapes=(*(Shape.REAL_VARIABLE,) * 3, LOCATION, Shape.ELEMENTS)),
    _location("SOLVE.TRANS location, error = joints", "+",
        "store the place of the tool for joints in an array, and why they are out of reach, as bits of INRANGE",
        "SOLVE.TRANS p, why = row[1]", shapes=(DEFINED, Shape.REAL_VARIABLE, Shape.ELEMENTS)),
    _location("DECOMPOSE element = value", "2 +",
        "put the six numbers of a location, or all joints, into elements of an array", "DECOMPOSE x[1] = part",
        shapes=(Shape.REAL_VARIABLE, PLACE)),
    # input and output
    Word("TYPE [item, ...]", "1 2 +", "print numbers and texts", 'TYPE "x =", /F8.2, x', role=Role.OBSERVER),
    Word("TYPEI value", "1", "print an integer, in VAL", "TYPEI count", "TYPE is similar",
        role=Role.OBSERVER),
    Word("SETI variable = value", "1",
        "assign an integer, cut toward 0, in VAL", "SETI count = count+1", "count = INT(value) is the same",
        shapes=(Shape.REAL_VARIABLE,)),
    Word("PROMPT [$text][, variable, ...]", "1 2 +",
        "print a text and read a line into variables", 'PROMPT "How many? ", count'),
    Word("SIGNAL signal, ... [AT t | IN dt]", "1 2 +",
        "turn signals on, or off where the number is negative, now or at a time", "SIGNAL 1, -2"),
    Word("RESET [AT t | IN dt]", "1 2 +", "turn all output signals off, now or at a time", "RESET"),
    Word("BITS first[, count] = value", "2 +", "set signals to the bits of a number", "BITS 1, 4 = count"),
    Word("WAIT [condition]", "1 2 +",
        "hold the program until a condition is true; alone: for one tick", "WAIT SIG(1001)",
        "WAIT 3 is WAIT SIG(1003), as in VAL; in a program with words of V+ it is a condition that is true"),
    Word("PACK $element, first, count = $text", "+",
        "replace characters in an array that counts as one long string, 128 characters for each element",
        "PACK $a[0], 120, 20 = $text"),
    Word("TIMER timer = seconds", "2 +", "set a timer [s]; it counts on from there", "TIMER 1 = 0"),
    # flow
    Word("CALL program", "2 +", "execute another program", "CALL pick(part, 50)"),
    Word("GOSUB program", "1", "execute another program, in VAL", "GOSUB pick", "CALL is the same"),
    Word("IFSIG signal[, signal][, signal][, signal] THEN label", "1",
        "continue at a label if these signals are on (off for negative numbers), in VAL", "IFSIG 1, -2 THEN 10",
        "the numbers 1 to 512 are inputs, so IF SIG(1001, -1002) GOTO 10 is the same"),
    Word("GRASP width, label", "1 2",
        "come to rest, close the hand, and continue at a label if its fingers are closer than a width [mm]",
        "GRASP 20, 10", "PARAMETER GRASP.WIDTH is the width of the part in the hand; at the start 0, no part",
        breaks=True),
    Word("RETURN [steps]", "1 2 +",
        "go back to the program that called this one", "RETURN",
        "RETURN n, of VAL, skips the n steps after the call"),
    Word("EXIT [loops]", "+", "leave the innermost loop, or so many of the innermost loops", "EXIT"),
    Word("NEXT [loops]", "+", "begin the next pass of the loop, or of an outer one", "NEXT 2"),
    Word("CALLS $name(arguments)", "+", "execute the program that a string names", "CALLS $name(part, 50)",
        'a constant may name it, too: CALLS "pick"(part, 50)'),
    Word("AUTO [REAL | DOUBLE | LOC] variable, ...", "+",
        "variables of one call of the program: each call has its own", "AUTO REAL i, row[]"),
    Word("LOCAL [REAL | DOUBLE | LOC] variable, ...", "+",
        "variables of the program, which keep their values between calls", "LOCAL count, $name"),
    Word("GLOBAL [REAL | DOUBLE | LOC] variable, ...", "+",
        "say that variables belong to all programs", "GLOBAL LOC part, pallet[]",
        "it has no effect, because undeclared variables belong to all programs anyway"),
    Word("STOP", "1 2 +", "end this cycle of the main program", "STOP", breaks=True),
    Word("PAUSE", "1 2 +", "stop; PROCEED continues", "PAUSE", breaks=True),
    Word("HALT", "1 2 +", "stop for good", "HALT", breaks=True),
    # reactions
    Word("REACT signal, program[, priority]", "1 2 +",
        "call a program when a signal changes, between two steps", "REACT 1001, stopped, 5",
        "it is called once; REACT in that program lets it be called again"),
    Word("REACTI signal, program[, priority]", "1 2 +",
        "REACT that brakes the motion at once", "REACTI -1002, guard.open, 10"),
    Word("REACTE [program]", "+", "call a program when a step fails; alone: no longer", "REACTE mend"),
    Word("IGNORE signal", "1 2 +", "end REACT or REACTI", "IGNORE 1001"),
    Word("LOCK priority", "2 +",
        "set the priority of the program, 0 to 127; reactions of the same or a lower priority wait", "LOCK 5"),
    Word("RETURNE", "+", "return from REACTE to the step after the one that failed", "RETURNE"),
    Word("RUNSIG signal", "2 +", "keep a signal on while the program runs", "RUNSIG 3"),
    _motion("BRAKE", "+", "stop the present motion at once", "BRAKE"),
    # tasks
    Word("EXECUTE [task] program[, cycles][, step]", "+",
        "start a program as a task beside this one; without a number, as the first free task",
        "EXECUTE 2 watch(part), -1", shapes=(Shape.TASK,)),
    Word("PCEXECUTE program[, cycles][, step]", "2",
        "start the process control program, which runs beside the robot program", "PCEXECUTE watch, -1"),
    Word("ABORT [task]", "+", "stop a task after its present step", "ABORT 2"),
    Word("KILL [task]", "+", "clear a task that has stopped", "KILL 2"),
    Word("CYCLE.END [task]", "+", "let a task end after its present cycle", "CYCLE.END 2"),
    Word("PROCEED [task]", "+", "let a task that has stopped go on", "PROCEED 2"),
    Word("RETRY [task]", "+", "let a task repeat the step at which it stopped", "RETRY 2"),
    Word("WAIT.EVENT [mask][, seconds]", "+",
        "wait until another task sets the event of this one, or for so many seconds", "WAIT.EVENT 1, 2.5"),
    Word("SET.EVENT task[, flag]", "+", "set the event of a task; there is one flag, 1", "SET.EVENT 2"),
    Word("CLEAR.EVENT [task][, flag]", "+", "clear the event of a task, or of this one", "CLEAR.EVENT"),
    Word("INT.EVENT input[, level]", "+",
        "set the event of this task when an input signal goes on; input 0: no longer", "INT.EVENT 1001"),
    Word("RELEASE [task]", "+",
        "let other tasks run, and continue at the next tick", "RELEASE -1", "tasks take turns by themselves, too"),
    Word("ATTACH [(unit[, mode])] [$device]", "+",
        "take the robot (unit 0), as soon as no other task has it; or the disk (5 to 8, 17 to 19), the terminal (4) or "
        "another device (9 to 16): TCP, SERIAL:1",
        'ATTACH (lun, 4) "DISK"', "mode 4 chooses a unit that is free", shapes=(Shape.UNIT,)),
    Word("DETACH [(unit)]", "+",
        "come to rest and release the robot; or close the file of a unit, and release the unit", "DETACH (lun)"),
    # files
    Word("FOPENR (unit) $file", "+", "open a file to read", 'FOPENR (lun) "log.txt"'),
    Word("FOPENW (unit) $file", "+", "open a new file to write", 'FOPENW (lun) "log.txt"'),
    Word("FOPENA (unit) $file", "+",
        "open a file to write at its end; make the file if there is none", 'FOPENA (lun) "log.txt"'),
    Word("FOPEN (unit[, mode]) item, ...", "+",
        "open a TCP port for clients, or connect to one", 'FOPEN (lun, 16) "/LOCAL_PORT 11000 /CLIENTS 1"',
        "/REMOTE_PORT, after an address, is the port of another program; /BUFFER_SIZE is the length of the longest "
        "line. FOPEN joins the items as TYPE does"),
    Word("FCMND (unit, command) [$data[, $answer]]", "+",
        "give a command to a device; 600: close a connection, whose handle the data have as two characters",
        "FCMND (lun, 600) $INTB(handle)", "$answer gets the answer of the device; for 600 it is empty",
        (Shape.GROUP, Shape.GROUP, Shape.STRING, Shape.STRING_VARIABLE)),
    Word("FCLOSE (unit)", "+", "close a file, or a TCP port with all its connections", "FCLOSE (lun)"),
    Word("FDELETE (unit) $file", "+", "delete a file", 'FDELETE (lun) "log.txt"'),
    Word("READ (unit[, handle[, mode]]) variable, ...", "+",
        "read a line of a file, of the terminal or of another device into variables. The variable for the handle gets "
        "the number of the connection; mode 1: do not wait for a line",
        "READ (lun) x, y, $name", shapes=(Shape.GROUP, Shape.UNIT)),
    Word("WRITE (unit[, handle]) [item, ...]", "+",
        "write a line to a file, to the terminal or to another device, as TYPE does; a handle chooses a connection",
        'WRITE (lun) "x =", /F8.2, x'),
    # not available
    unavailable("ELSEIF", "", "not a word of VAL-II", "write ELSE, and IF ... THEN on the next line"),
    unavailable("ENDIF", "", "not a word of VAL-II", "every block ends in END"),
    unavailable("DOUBLE", "", "not a word by itself", "write AUTO DOUBLE x, or LOCAL, or GLOBAL"),
    Word("REMARK", "1", "a comment in VAL", "REMARK pick the part"),
    *(
        unavailable(word, "+", "a monitor command in a program",
            "write the commands into a file, and execute it with COMMANDS")
        for word in ("MC", "MCS")
    ),
    unavailable("PANIC", "+", "power off at once", "use HALT"),
    unavailable("KEYMODE", "+", "how a key of the pendant behaves", "there is no pendant; PROMPT asks at the terminal"),
    unavailable("VPICTURE", "+", "take a picture", "this robot has no camera"),
    unavailable("VLOCATE", "+", "find a part in a picture", "this robot has no camera"),
    unavailable("DEFBELT", "2 +", "conveyor tracking", "this robot has no conveyor"),
    unavailable("SETBELT", "2 +", "conveyor tracking", "this robot has no conveyor"),
    unavailable("WINDOW", "2 +", "conveyor tracking", "this robot has no conveyor"),
    unavailable("FOPEND", "+", "reading of a disk directory", "FDIRECTORY at the prompt lists a folder"),
    unavailable("FSEEK", "+", "records of a file by number", "READ and WRITE go from line to line"),
    unavailable("FEMPTY", "+", "emptying of buffers", "FCLOSE writes all data"),
    unavailable("ESTOP", "+", "power off at once", "use HALT"),
    unavailable("AIO.OUT", "+", "analog output", "this robot has no analog signals"),
    *(
        unavailable(name, "+", "work with pictures of a camera", "this robot has no camera")
        for name in ("VDISPLAY", "VTRAIN", "VWINDOW", "VSELECT", "VQUEUE", "VPARAMETER", "VRUN")
    ),
    *(
        unavailable(name, "+", "windows of a controller", "TYPE prints on the terminal")
        for name in ("GCLEAR", "GLINE", "GTYPE", "GETEVENT", "FSET")
    ),
    unavailable("SETDEVICE", "+", "set up a camera or an encoder", "this robot has no such devices"),
    unavailable("DEF.DIO", "+", "give signals to boards", "signals 1-512, 1001-1512 and 2001-2512 are there"),
    unavailable("IOPUTB", "+", "write to the bus of the controller", "there is no bus; signals and BITS are there"),
    unavailable("IOPUTS", "+", "write to the bus of the controller", "there is no bus; signals and BITS are there"),
    unavailable("MOVEF", "+", "motion over three places in one", "write APPRO, MOVE and DEPART"),
    unavailable("MOVESF", "+", "straight motion over three places in one", "write APPROS, MOVES and DEPARTS"),
    unavailable("CALLP", "+", "a call through a pointer", "CALLS $name calls the program that a string names"),
))  # fmt: skip

CONTROL: Mapping[str, Control] = by_name((
    Control("IF condition THEN | GOTO label", "2 +",
        "begin a block, or jump to a label, if a condition is true", "IF x > 2 THEN"),
    Control("ELSE", "2 +", "begin the steps for a false condition of IF", "ELSE"),
    Control("WHILE condition DO", "2 +", "a loop that tests before each pass", "WHILE x > 2 DO"),
    Control("DO", "2 +", "a loop that tests after each pass", "DO"),
    Control("UNTIL condition", "2 +", "end the loop of DO; it repeats until the condition is true", "UNTIL x > 2"),
    Control("FOR variable = first TO last [STEP step]", "2 +",
        "a loop that counts", "FOR i = 1 TO 10 STEP 2", shapes=(Shape.REAL_VARIABLE,)),
    Control("CASE number OF", "2 +", "choose one of the VALUE parts by a number", "CASE count OF"),
    Control("VALUE number, ...:", "2 +", "a part of CASE", "VALUE 1, 2:"),
    Control("ANY", "2 +", "the part of CASE for every other value", "ANY"),
    Control("END", "2 +", "the end of IF, WHILE, FOR and CASE", "END"),
    Control("GOTO label", "2 +", "continue at a label", "GOTO 10"),
))  # fmt: skip

PROGRAM_WORDS: Mapping[str, Word] = {**CONTROL, **INSTRUCTIONS}

DECLARATIONS = frozenset({"AUTO", "LOCAL", "GLOBAL"})  # instructions that declare variables and do nothing in a run
# the relations in VAL's IF a EQ b THEN label, with the operators of VAL-II for them
RELATIONS_OF_VAL = {"EQ": "==", "NE": "<>", "GT": ">", "GE": ">=", "LT": "<", "LE": "<="}
LOOP_JUMPS = frozenset({"EXIT", "NEXT"})  # instructions that leave a loop or begin its next pass

CONNECTIVES = frozenset({"THEN", "TO", "STEP", "OF", "BY", "ALWAYS", "MMPS", "IPS"})
OPERATOR_WORDS = frozenset({"NOT", "AND", "OR", "XOR", "MOD", "COM", "BAND", "BOR", "BXOR"})

# Words that cannot be names of variables, with the reasons. Any other word is a keyword only in certain positions: an
# instruction at the start of a line, but not before = or [; a function before (; STEP and AT after an expression.
# Elsewhere it may be a name, because programs that ran on controllers have variables named status, stop, value, delay
# and dx (val2 sections 1 and 15).
RESERVED: Mapping[str, str] = {
    **dict.fromkeys(sorted(OPERATOR_WORDS), "an operator"),
    **dict.fromkeys(("TRUE", "FALSE", "ON", "OFF", "PI"), "a constant"),
    **dict.fromkeys(
        ("IF", "THEN", "ELSE", "CASE", "OF", "FOR", "TO", "WHILE", "DO", "UNTIL", "GOTO"), "a word of blocks and jumps"
    ),
    **dict.fromkeys(("ALWAYS", "MMPS", "IPS", "BY"), "a word after a value"),
}


def why_reserved(word: str) -> tuple[str, str]:
    """Return the detail and the hint of the error for a variable whose name is a reserved word."""
    return f"{word} is a word of the language", f"{RESERVED[word]} is no name"
