"""The monitor commands: what is typed at the `.` prompt, one row each (val2 section 3)."""

from __future__ import annotations

from collections.abc import Mapping

from vrs_cli.language.words.instructions import CALIBRATE, DEFINED, INSTRUCTIONS, SELECT, SIGNALS, SWITCHES, real
from vrs_cli.language.words.word import Argument, Route, Shape, State, Word, by_name

FILE = Argument("file", Shape.FILE)
NEW = Argument("new", Shape.PROGRAM)
PROGRAMS = Argument("program", Shape.PROGRAM, optional=True, repeated=True)
TASK = real("task", optional=True)
EXECUTED = (
    Argument("program", Shape.PROGRAM, optional=True),
    real("cycles", optional=True),
    real("step", optional=True),
)


def _word(
    name: str,
    arguments: tuple[Argument, ...],
    summary: str,
    example: str,
    where: str = "1 2 +",
    route: Route = Route.PROGRAM,
    value: Argument | None = None,
    note: str = "",
    *,
    drastic: bool = False,
) -> Word:
    return Word(name, arguments, route, summary, example, where, value, note=note, drastic=drastic)


def _refused(name: str, summary: str, where: str, note: str) -> Word:
    return Word(name, (), Route.PROGRAM, summary, name, where, state=State.REFUSED, note=note)


_POSITIONS = (
    Word(
        "WHERE",
        (
            real("robot", optional=True),
            Argument("t1", Shape.REAL, optional=True, lead="FROM"),
            Argument("t2", Shape.REAL, optional=True, lead="TO"),
            Argument("dt", Shape.REAL, optional=True, lead="STEP"),
        ),
        Route.POSITION,
        "where the robot is now, at a time, or over a stretch of time",
        "WHERE FROM 0 TO 5 STEP 0.5",
        "1 2 +",
        modifiers=frozenset({"AT"}),
    ),
    _word(
        "HERE",
        (DEFINED,),
        "define a location as the present position, then correct it",
        "HERE part",
        route=Route.POSITION,
    ),
    _word(
        "TEACH",
        (DEFINED,),
        "record the present position under a name, then under the name with rising numbers: part, part1, part2",
        "TEACH part",
        route=Route.POSITION,
    ),
    Word(
        "POINT",
        (DEFINED,),
        Route.POSITION,
        "define or correct a location by typing its numbers",
        "POINT part = TRANS(500, 150, -100, 90, 90, 0)",
        "1 2 +",
        value=Argument("value", Shape.PLACE, optional=True),
    ),
    _word(
        "LISTL",
        (Argument("location", Shape.PLACE, optional=True, repeated=True),),
        "list locations",
        "LISTL part, #safe",
        route=Route.POSITION,
    ),
    _word(
        "LISTR",
        (real("expression", True, True),),
        "list reals; a desk calculator",
        "LISTR count, SIN(30)/2",
        "2 +",
        Route.POSITION,
    ),
    _word(
        "LISTS",
        (Argument("$string", Shape.STRING, optional=True, repeated=True),),
        "list strings",
        "LISTS $part",
        "2 +",
        Route.POSITION,
    ),
)

_STATE = (
    _word("STATUS", (TASK,), "what is running, its step, cycles and speeds", "STATUS"),
    _word("IO", (real("group", optional=True),), "the signals: 0 inputs, 1 outputs, 2 internal ones", "IO 1", "2 +"),
    _word("TIME", (), "the robot clock", "TIME", "2 +"),
    _word("ID", (), "the version of the system and the robot", "ID", "2 +"),
    _word("FREE", (), "how much is stored", "FREE"),
    _word(
        "HELP",
        (Argument("word", Shape.WORD, optional=True),),
        "what there is, or what a word does",
        "HELP APPRO",
        "1 2",
    ),
)

_PROGRAMS = (
    _word("DIRECTORY", (Argument("names", Shape.WORD, optional=True),), "the programs in memory", "DIRECTORY pick*"),
    _word("LISTP", (PROGRAMS,), "list programs with their step numbers", "LISTP pick.place"),
    _word("COPY", (NEW,), "copy a program", "COPY new = old", "2 +", value=Argument("old", Shape.PROGRAM)),
    _word("RENAME", (NEW,), "give a program another name", "RENAME new = old", value=Argument("old", Shape.PROGRAM)),
    _word(
        "DELETE",
        (Argument("program", Shape.PROGRAM, repeated=True),),
        "delete programs and what they alone use",
        "DELETE pick.place",
        drastic=True,
    ),
    _word(
        "DELETEP",
        (Argument("program", Shape.PROGRAM, repeated=True),),
        "delete programs",
        "DELETEP pick.place",
        "2 +",
        drastic=True,
    ),
    _word(
        "DELETEL",
        (Argument("location", Shape.LOCATION_VARIABLE, repeated=True),),
        "delete locations",
        "DELETEL part, #safe",
        "2 +",
        drastic=True,
    ),
    _word(
        "DPOINT",
        (Argument("location", Shape.LOCATION_VARIABLE, repeated=True),),
        "delete locations, in VAL",
        "DPOINT part",
        "1",
        note="DELETEL is the same",
        drastic=True,
    ),
    _word(
        "DELETER",
        (Argument("real", Shape.REAL_VARIABLE, repeated=True),),
        "delete reals",
        "DELETER count",
        "2 +",
        drastic=True,
    ),
    _word(
        "DELETES",
        (Argument("$string", Shape.STRING_VARIABLE, repeated=True),),
        "delete strings",
        "DELETES $part",
        "2 +",
        drastic=True,
    ),
    _word("ZERO", (), "delete all programs and variables", "ZERO", drastic=True),
)

_FILES = (
    _word(
        "LOAD",
        (FILE,),
        "read programs and variables from a file; of a trajectory (.vrst), make a branch to go on with",
        "LOAD pick.v2",
    ),
    _word("LOADP", (FILE,), "read programs from a file, in VAL", "LOADP pick.pg", "1", note="LOAD is the same"),
    _word("LOADL", (FILE,), "read locations from a file, in VAL", "LOADL cell.lc", "1", note="LOAD is the same"),
    _word(
        "STORE",
        (FILE,),
        "write programs with everything they use to a file",
        "STORE cell.v2 = pick, place",
        value=PROGRAMS,
    ),
    _word("STOREP", (FILE,), "write programs to a file", "STOREP cell.pg", value=PROGRAMS),
    _word("STOREL", (FILE,), "write the locations of programs to a file", "STOREL cell.lc", value=PROGRAMS),
    _word("STORER", (FILE,), "write the reals of programs to a file", "STORER cell.rv", "2 +", value=PROGRAMS),
    _word("STORES", (FILE,), "write the strings of programs to a file", "STORES cell.st", "2 +", value=PROGRAMS),
)

_EDITED = (Argument("program", Shape.PROGRAM, optional=True), real("step", True))
NEW_FILE = Argument("new", Shape.FILE)
OLD_FILE = Argument("old", Shape.FILE)
_EDITORS_AND_DISK = (
    _word("EDIT", _EDITED, "the line editor: C D E F I L P R S, an empty line goes on", "EDIT pick.place, 3"),
    _word("SEE", _EDITED, "the screen editor", "SEE pick.place", "+"),
    _word("FLIST", (FILE,), "type a disk file", "FLIST pick.v2", "2 +"),
    _word(
        "FDIRECTORY",
        (Argument("folder", Shape.FILE, optional=True),),
        "the files of a folder, or those that a pattern names",
        "FDIRECTORY *.v2",
        "2 +",
    ),
    _word(
        "LISTF",
        (Argument("folder", Shape.FILE, optional=True),),
        "the files of a folder, in VAL",
        "LISTF",
        "1",
        note="FDIRECTORY is the same",
    ),
    _word("FDELETE", (FILE,), "delete a disk file", "FDELETE old.v2", "2 +", drastic=True),
    _word("FRENAME", (NEW_FILE,), "rename a disk file", "FRENAME new.v2 = old.v2", "2 +", value=OLD_FILE),
    _word("FCOPY", (NEW_FILE,), "copy a disk file", "FCOPY new.v2 = old.v2", "2 +", value=OLD_FILE),
    _word("COMMANDS", (FILE,), "carry out a file of monitor commands", "COMMANDS start.pc", "2 +"),
)

_EXECUTION = (
    _word(
        "EXECUTE",
        (*EXECUTED, Argument("task", Shape.TASK, optional=True)),
        "run a program: how often (negative: for ever), from which step; with a task number, beside the others",
        "EXECUTE pick(part), 5",
    ),
    _word("PRIME", EXECUTED, "get a program ready to run", "PRIME pick(part)", "2 +"),
    _word(
        "DO",
        (Argument("instruction", Shape.INSTRUCTION, optional=True),),
        "carry out one instruction; bare: the last one again",
        "DO MOVE part",
    ),
    _word("ABORT", (TASK,), "stop the program and the motion", "ABORT", drastic=True),
    _word("PROCEED", (TASK,), "go on at the next step", "PROCEED"),
    _word("RETRY", (TASK,), "go on with the step that failed", "RETRY"),
    _word("KILL", (TASK,), "clear a program that has stopped, so that it can be changed", "KILL", "+", drastic=True),
    _word("CYCLE.END", (TASK,), "let the program end after its present cycle", "CYCLE.END", "+"),
    _word("SSTEP", EXECUTED, "carry out one step, a call as a whole", "SSTEP", "2 +", drastic=True),
    _word("XSTEP", EXECUTED, "carry out one step, also of a called program", "XSTEP", "+", drastic=True),
    _word("NEXT", (), "carry out one step, a call as a whole", "NEXT", "1 2", drastic=True),
    _word(
        "BPT",
        (Argument("program", Shape.PROGRAM, optional=True), real("step", optional=True)),
        "stop before a step of a program (negative: no more); a program alone: none in it; bare: list all",
        "BPT pick, 3",
        "+",
    ),
    _word(
        "WATCH",
        (Argument("expression", Shape.ITEM, optional=True),),
        "stop when an expression changes; bare: watch no more",
        "WATCH count",
        "+",
    ),
    _word("PCEXECUTE", EXECUTED, "start the process control program, beside the robot program", "PCEXECUTE watch", "2"),
    _word("PCABORT", (), "stop the process control program", "PCABORT", "2", drastic=True),
    _word("PCEND", (), "end the process control program after this cycle", "PCEND", "2"),
    _word("PCPROCEED", (), "let the process control program go on", "PCPROCEED", "2"),
    _word("PCRETRY", (), "repeat the failed step of the process control program", "PCRETRY", "2"),
    _word("PCSTATUS", (), "the state of the process control program", "PCSTATUS", "2"),
    _word(
        "SPEED", (real("percent"),), "the monitor speed, which scales every motion", "SPEED 50", route=Route.PARAMETER
    ),
    _word(
        "SIGNAL",
        (SIGNALS,),
        "turn signals on, or off (negative); also inputs, as the cabinet",
        "SIGNAL 1, -1002",
        "2 +",
    ),
    _word("RESET", (), "turn all output signals off", "RESET", "2 +", drastic=True),
)

_SYSTEM = (
    INSTRUCTIONS["TOOL"],
    INSTRUCTIONS["BASE"],
    CALIBRATE,
    SELECT,
    _word("ENABLE", (SWITCHES,), "turn switches on", "ENABLE CP", "2 +", Route.PARAMETER),
    _word("DISABLE", (SWITCHES,), "turn switches off", "DISABLE CP", "2 +", Route.PARAMETER),
    _word(
        "SWITCH",
        (Argument("switch", Shape.SWITCH, optional=True, repeated=True),),
        "show switches, or turn one on or off",
        "SWITCH CP",
        "2 +",
        Route.PARAMETER,
        real("value", optional=True),
    ),
    _word(
        "PARAMETER",
        (Argument("parameter", Shape.PARAMETER_NAME, optional=True),),
        "show parameters, or set one",
        "PARAMETER PROFILE = SCURVE",
        "2 +",
        Route.PARAMETER,
        Argument("value", Shape.SETTING, optional=True),
    ),
)

_OURS = (
    _word(
        "WHY",
        (Argument("location", Shape.PLACE),),
        "why a location is in reach or not: all configurations, what MOVE would choose, the straight line from here",
        "WHY part",
        "",
        Route.POSITION,
    ),
    _word(
        "CLOCK",
        (Argument("PAUSE | GO | RATE", Shape.WORD, optional=True),),
        "show the clock; in real time stop it, let it go on, or make it faster or slower",
        "CLOCK RATE = 0.5",
        "",
        value=Argument("rate", Shape.WORD, optional=True),
    ),
    _word(
        "JOG",
        (Argument("axis", Shape.SETTING, optional=True), real("amount", optional=True)),
        "move by hand: a joint [deg], X Y Z RX RY RZ, or TX ... TRZ of the tool [mm, deg]; bare: with the keys",
        "JOG Z, -20",
        "",
        Route.MOTION,
        note="V+ has a JOG of its own",
    ),
    _word(
        "UNDO",
        (real("n", optional=True),),
        "take the last motion command back, or n of them",
        "UNDO",
        "",
        Route.MOTION,
        drastic=True,
    ),
    _word("REDO", (real("n", optional=True),), "do again what UNDO took back, or n of that", "REDO", "", Route.MOTION),
    _word(
        "BRANCH",
        (Argument("name", Shape.BRANCH, optional=True),),
        "try another timeline: go to a branch, made of what is there if there is none; bare: list them, main first",
        "BRANCH trial",
        "",
        Route.MOTION,
    ),
    _word(
        "COMPARE",
        (Argument("a", Shape.BRANCH, optional=True), Argument("b", Shape.BRANCH, optional=True)),
        "two branches side by side: a, or main, and b, or the present one",
        "COMPARE main, trial",
        "",
        Route.POSITION,
    ),
    _word(
        "MERGE",
        (Argument("name", Shape.BRANCH, optional=True),),
        "make what a branch (the present one) has become the main timeline",
        "MERGE trial",
        "",
        Route.MOTION,
        drastic=True,
    ),
    _word(
        "DELETEB", (Argument("name", Shape.BRANCH, repeated=True),), "drop branches", "DELETEB trial", "", drastic=True
    ),
    _word("TIMELINE", (), "the segments of the trajectory", "TIMELINE", "", Route.POSITION),
    _word(
        "PLOT",
        (Argument("what", Shape.WORD, optional=True, repeated=True),),
        "plot joints (by number), velocity, acceleration, X, Y, Z, tool, speed or hand over time",
        "PLOT velocity, 1, 2",
        "",
        Route.POSITION,
    ),
    _word("SAVE", (FILE,), "write the trajectory to a file", "SAVE demo.vrst", ""),
    _word("REPLAY", (FILE,), "play a trajectory file", "REPLAY demo.vrst", ""),
    _word("EXIT", (), "leave the shell", "EXIT", ""),
    _word("QUIT", (), "leave the shell", "QUIT", ""),
)

_MODULES = "programs that belong together go to a file of their own: STORE file = program, ..."

_REFUSED = (
    _refused("CD", "the folder of files", "+", "start vrs in the folder, or write it before the name of a file"),
    _refused("DEFAULT", "the folder of files", "+", "start vrs in the folder, or write it before the name of a file"),
    _refused("DEBUG", "the debugger", "+", "use BPT, WATCH, SSTEP and XSTEP"),
    _refused("PANIC", "stop at once", "+", "use ABORT"),
    _refused("MODULE", "a group of programs", "+", _MODULES),
    _refused("MDIRECTORY", "the groups of programs", "+", _MODULES),
    _refused("STOREM", "write a group of programs to a file", "+", _MODULES),
    _refused("DELETEM", "delete a group of programs", "+", "use DELETE program, ..."),
    _refused("NET", "the network", "+", "there is no network at this robot"),
    _refused("ERASE", "erase a disk in VAL", "1", "use FDELETE"),
    _refused("COMPRESS", "tidy a disk in VAL", "1", "there is no disk to tidy"),
    _refused("INIT", "prepare a disk in VAL", "1", "there is no disk to prepare"),
    _refused("FORMAT", "prepare a disk", "2 +", "there is no disk to prepare"),
    _refused("ESTOP", "power off at once", "+", "use ABORT"),
    _refused("STACK", "the size of the stack", "+", "the stack grows as needed"),
    _refused("SRV.RESET", "reset the servos", "+", "there are no servos"),
    _refused("PASSTHRU", "talk to a serial line", "+", "there is no serial line"),
    _refused("PING", "test the network", "+", "use the tools of your system"),
    _refused("INSTALL", "install options", "+", "everything is installed"),
    _refused("TESTP", "test for a program", "+", "use DIRECTORY"),
)

COMMANDS: Mapping[str, Word] = by_name(
    (*_POSITIONS, *_STATE, *_PROGRAMS, *_FILES, *_EDITORS_AND_DISK, *_EXECUTION, *_SYSTEM, *_OURS, *_REFUSED)
)
