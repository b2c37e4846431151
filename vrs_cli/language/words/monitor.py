"""List the monitor commands, which users type at the `.` prompt, with one row for each (val2 section 3)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

from msgspec import Struct

from vrs_cli.language.words.instructions import DEFINED, INSTRUCTIONS, PLACE, unavailable
from vrs_cli.language.words.word import Role, Shape, Word, by_name

_observer = partial(Word, role=Role.OBSERVER)  # for commands that change nothing, which every user may use
_designer = partial(Word, role=Role.DESIGNER)

_MODULES = "programs that belong together go to a file of their own: STORE file = program, ..."

COMMANDS: Mapping[str, Word] = by_name((
    # positions
    _observer("WHERE [part] [FROM t1] [TO t2] [STEP dt] [AT t | IN dt]", "1 2 +",
        "the position of the robot or of a part, or the MEASURED position; now, at a time, or from t1 to t2",
        "WHERE FROM 0 TO 5 STEP 0.5"),
    Word("HERE location", "1 2 +",
        "define a location as the present position, then correct it", "HERE part", shapes=(DEFINED,)),
    Word("TEACH location", "1 2 +",
        "record positions one after the other, under a name and numbers: part, part1, part2",
        "TEACH part", shapes=(DEFINED,)),
    Word("POINT location [= value]", "1 2 +",
        "define or correct a location by typing its numbers", "POINT part = TRANS(500, 150, -100, 90, 90, 0)",
        shapes=(DEFINED, PLACE)),
    _observer("LISTL [location, ...]", "1 2 +", "list locations", "LISTL part, #safe", shapes=(PLACE,)),
    _observer("LISTR [expression, ...]", "2 +", "list reals, or the values of expressions", "LISTR count, SIN(30)/2"),
    _observer("LISTS [$string, ...]", "2 +", "list strings", "LISTS $part"),
    # state
    _observer("STATUS [task] [AT t | IN dt]", "1 2 +",
        "the running programs, their steps, cycles and speeds; at a time: the state of the robot then", "STATUS"),
    _observer("IO [group] [AT t | IN dt]", "2 +",
        "the signals, now or at a time; group 0: inputs, 1: outputs, 2: internal signals", "IO 1"),
    _observer("TIME", "2 +", "the robot clock", "TIME"),
    _observer("ID", "2 +", "the version of the system and the robot", "ID"),
    _observer("FREE", "1 2 +", "the numbers of programs and variables, and the free memory", "FREE"),
    _observer("HELP [word]", "1 2", "list all words, or explain one", "HELP APPRO"),
    # programs
    _observer("DIRECTORY [names]", "1 2 +", "the programs in memory", "DIRECTORY pick*"),
    _observer("LISTP [program, ...]", "1 2 +", "list programs with their step numbers", "LISTP pick.place"),
    Word("COPY new = old", "2 +", "copy a program", "COPY new = old", shapes=(Shape.PROGRAM, Shape.PROGRAM)),
    Word("RENAME new = old", "1 2 +",
        "give a program another name", "RENAME new = old", shapes=(Shape.PROGRAM, Shape.PROGRAM)),
    Word("DELETE program, ...", "1 2 +",
        "delete programs, and everything that only they use", "DELETE pick.place", drastic=True),
    Word("DELETEP program, ...", "2 +", "delete programs", "DELETEP pick.place", drastic=True),
    Word("DELETEL location, ...", "2 +", "delete locations", "DELETEL part, #safe", shapes=(DEFINED,), drastic=True),
    Word("DPOINT location, ...", "1",
        "delete locations, in VAL", "DPOINT part", "DELETEL is the same", shapes=(DEFINED,), drastic=True),
    Word("DELETER real, ...", "2 +", "delete reals", "DELETER count", drastic=True),
    Word("DELETES $string, ...", "2 +",
        "delete strings", "DELETES $part", shapes=(Shape.STRING_VARIABLE,), drastic=True),
    Word("ZERO", "1 2 +", "delete all programs and variables", "ZERO", drastic=True),
    # files
    Word("LOAD file", "1 2 +",
        "read programs and variables from a file; from a trajectory (.vrst) make a branch to continue",
        "LOAD pick.v2"),
    Word("LOADP file", "1", "read programs from a file, in VAL", "LOADP pick.pg", "LOAD is the same"),
    Word("LOADL file", "1", "read locations from a file, in VAL", "LOADL cell.lc", "LOAD is the same"),
    Word("STORE file [= program, ...]", "1 2 +",
        "write programs with everything they use to a file", "STORE cell.v2 = pick, place"),
    Word("STOREP file [= program, ...]", "1 2 +", "write programs to a file", "STOREP cell.pg"),
    Word("STOREL file [= program, ...]", "1 2 +", "write the locations of programs to a file", "STOREL cell.lc"),
    Word("STORER file [= program, ...]", "2 +", "write the reals of programs to a file", "STORER cell.rv"),
    Word("STORES file [= program, ...]", "2 +", "write the strings of programs to a file", "STORES cell.st"),
    # editors and disk
    Word("EDIT [program][, step]", "1 2 +",
        "edit a program by lines, with C D E F I L P R S; an empty line goes to the next step", "EDIT pick.place, 3"),
    Word("SEE [program][, step]", "+", "the screen editor", "SEE pick.place"),
    Word("FLIST file", "2 +", "type a disk file", "FLIST pick.v2"),
    Word("FDIRECTORY [folder]", "2 +", "the files of a folder, or those that match a pattern", "FDIRECTORY *.v2"),
    Word("LISTF [folder]", "1", "the files of a folder, in VAL", "LISTF", "FDIRECTORY is the same"),
    Word("FDELETE file", "2 +", "delete a disk file", "FDELETE old.v2", drastic=True),
    Word("FRENAME new = old", "2 +", "rename a disk file", "FRENAME new.v2 = old.v2", shapes=(Shape.FILE, Shape.FILE)),
    Word("FCOPY new = old", "2 +", "copy a disk file", "FCOPY new.v2 = old.v2", shapes=(Shape.FILE, Shape.FILE)),
    Word("CD [folder]", "+", "go to a folder of files; alone: return to the first one", "CD cells"),
    _observer("PWD", "", "the folder of files", "PWD"),
    Word("COMMANDS file", "2 +", "execute the monitor commands of a file", "COMMANDS start.pc"),
    # execution
    Word("EXECUTE [task] [program][, cycles][, step]", "1 2 +",
        "run a program for some cycles (negative: endlessly), from a step; with a task number, beside the others",
        "EXECUTE pick(part), 5", shapes=(Shape.TASK,)),
    Word("PRIME [program][, cycles][, step]", "2 +", "prepare a program to run", "PRIME pick(part)"),
    Word("DO [instruction]", "1 2 +", "execute one instruction; alone: the last one again", "DO MOVE part"),
    _designer("ABORT [task]", "1 2 +", "stop the program and the motion", "ABORT", drastic=True),
    Word("PROCEED [task]", "1 2 +", "continue a stopped program at its next step", "PROCEED"),
    Word("RETRY [task]", "1 2 +", "continue a stopped program with its failed step", "RETRY"),
    Word("KILL [task]", "+", "clear a program that has stopped, so that it can be changed", "KILL", drastic=True),
    Word("CYCLE.END [task]", "+", "let the program end after its present cycle", "CYCLE.END"),
    Word("SSTEP [program][, cycles][, step]", "2 +", "execute one step, a call as a whole", "SSTEP", drastic=True),
    Word("XSTEP [program][, cycles][, step]", "+",
        "execute one step, also inside a called program", "XSTEP", drastic=True),
    Word("NEXT", "1 2", "execute one step, a call as a whole", "NEXT", drastic=True),
    Word("BPT [program][, step]", "+",
        "stop before a step (negative: no longer); with a program alone: at none of its steps; alone: list all",
        "BPT pick, 3"),
    Word("WATCH [expression]", "+",
        "stop when an expression changes; alone: no longer", "WATCH count", shapes=(Shape.VALUE,)),
    Word("PCEXECUTE [program][, cycles][, step]", "2",
        "start the process control program, beside the robot program", "PCEXECUTE watch"),
    Word("PCABORT", "2", "stop the process control program", "PCABORT", drastic=True),
    Word("PCEND", "2", "end the process control program after this cycle", "PCEND"),
    Word("PCPROCEED", "2", "let the process control program go on", "PCPROCEED"),
    Word("PCRETRY", "2", "repeat the failed step of the process control program", "PCRETRY"),
    _observer("PCSTATUS", "2", "the state of the process control program", "PCSTATUS"),
    _designer("SPEED percent", "1 2 +", "the monitor speed, which scales every motion", "SPEED 50"),
    Word("SIGNAL signal, ... [AT t | IN dt]", "2 +",
        "turn signals on, or off (negative), now or at a time; inputs, too, as if from outside", "SIGNAL 1, -1002"),
    Word("RESET [AT t | IN dt]", "2 +", "turn all output signals off, now or at a time", "RESET", drastic=True),
    # system
    *(INSTRUCTIONS[name] for name in ("TOOL", "BASE", "CALIBRATE", "SELECT")),
    Word("ENABLE switch, ...", "2 +", "turn switches on", "ENABLE CP"),
    Word("DISABLE switch, ...", "2 +", "turn switches off", "DISABLE CP"),
    Word("SWITCH [switch, ...] [= value]", "2 +", "show switches, or turn one on or off", "SWITCH CP"),
    Word("PARAMETER [parameter] [= value]", "2 +",
        "show parameters, or set one", "PARAMETER PROFILE = SCURVE", shapes=(Shape.PARAMETER_NAME, Shape.SETTING)),
    # our own
    _observer("WHY location", "",
        "why a location is in reach or not: all configurations, the choice of MOVE, the straight line from here",
        "WHY part", shapes=(PLACE,)),
    _observer("EXPLAIN [what]", "",
        "explain in numbers: the plan of a motion, a compound a:b, OAT part (its angles), IK part (its joints step by "
        "step), SPLICE (the last change of the timeline); alone: list these",
        "EXPLAIN MOVES part", shapes=(Shape.INSTRUCTION,)),
    _observer("PARTS [AT t | IN dt]", "",
        "the places of the parts of the cell, and what each stands on, or that the hand holds it", "PARTS AT 2.5"),
    _observer("SHOW [AT t | IN dt]", "",
        "draw the arm from the side and from above, now or at a time; in real time the picture moves with it",
        "SHOW AT 2.5"),
    Word("CLOCK [PAUSE | GO | RATE] [= rate]", "",
        "show the clock; in real time pause it, let it go on, or set its rate", "CLOCK RATE = 0.5"),
    _observer("BODY [RELEASE | OFF | WARN | HOLD | ABORT | RESYNC]", "",
        "show which client is the robot's body, and its reports; a supervisor may release it, and choose what "
        "happens if it deviates from the timeline", "BODY HOLD"),
    Word("RESYNC [STOP]", "",
        "let the body hold, move the robot to the measured position and from there to its goal (STOP: not to its "
        "goal), and let the body follow again", "RESYNC"),
    _designer("JOG [axis][, amount]", "",
        "move by hand: a joint [deg], X Y Z RX RY RZ, or TX ... TRZ of the tool [mm, deg]; alone: with keys",
        "JOG Z, -20", "V+ has a JOG of its own"),
    Word("UNDO [n]", "", "undo the last motion command, or the last n", "UNDO", drastic=True),
    Word("REDO [n]", "", "repeat the command that UNDO took back last, or n of them", "REDO"),
    Word("BRANCH [name]", "",
        "go to another timeline; a new branch begins as a copy of the present one; alone: list all, main first",
        "BRANCH trial"),
    _observer("COMPARE [a][, b]", "",
        "compare two branches: a (or main) and b (or the present one); MEASURED as a: the reports of a body",
        "COMPARE main, trial",
        shapes=(Shape.BRANCH, Shape.BRANCH)),
    Word("MERGE [name]", "",
        "make the timeline of a branch (or of the present one) the main timeline", "MERGE trial", drastic=True),
    Word("DELETEB name, ...", "", "delete branches", "DELETEB trial", drastic=True),
    _observer("TIMELINE", "", "the segments of the trajectory", "TIMELINE"),
    _observer("PLOT [what, ...]", "",
        "plot joints (by number), velocity, acceleration, X, Y, Z, tool, speed or hand over time, also into a file",
        "PLOT velocity, 1, 2, arm.svg"),
    Word("SAVE file", "", "write the trajectory to a file", "SAVE demo.vrst"),
    Word("REPLAY file", "", "play a trajectory file", "REPLAY demo.vrst"),
    Word("LOG [file]", "",
        "record lines and answers in a file, text or .html; alone: stop recording", "LOG session.html"),
    _observer("HISTORY [n]", "", "the lines that were typed, or the last n of them", "HISTORY 20"),
    _observer("EXIT", "", "leave the shell", "EXIT"),
    _observer("QUIT", "", "leave the shell", "QUIT"),
    # not available
    unavailable("DEFAULT", "+", "the folder of files", "use CD folder"),
    unavailable("DEBUG", "+", "the debugger", "use BPT, WATCH, SSTEP and XSTEP"),
    unavailable("PANIC", "+", "stop at once", "use ABORT"),
    unavailable("MODULE", "+", "a group of programs", _MODULES),
    unavailable("MDIRECTORY", "+", "the groups of programs", _MODULES),
    unavailable("STOREM", "+", "write a group of programs to a file", _MODULES),
    unavailable("DELETEM", "+", "delete a group of programs", "use DELETE program, ..."),
    unavailable("NET", "+", "the network", "this robot has no network"),
    unavailable("ERASE", "1", "erase a disk in VAL", "use FDELETE"),
    unavailable("COMPRESS", "1", "tidy a disk in VAL", "there is no disk to tidy"),
    unavailable("INIT", "1", "prepare a disk in VAL", "there is no disk to prepare"),
    unavailable("FORMAT", "2 +", "prepare a disk", "there is no disk to prepare"),
    unavailable("ESTOP", "+", "power off at once", "use ABORT"),
    unavailable("STACK", "+", "the size of the stack", "the stack grows as needed"),
    unavailable("SRV.RESET", "+", "reset the servos", "there are no servos"),
    unavailable("PASSTHRU", "+", "talk to a serial line", "there is no serial line"),
    unavailable("PING", "+", "test the network", "use the tools of your system"),
    unavailable("INSTALL", "+", "install options", "everything is installed"),
    unavailable("TESTP", "+", "test for a program", "use DIRECTORY"),
))  # fmt: skip


class Explained(Struct, frozen=True):
    """A topic of EXPLAIN. `form`: what to type after EXPLAIN; `summary`: what it explains; `of_location`: whether it
    takes a location."""

    form: str
    summary: str
    of_location: bool = True


EXPLAINED: Mapping[str, Explained] = {  # by topic
    "OAT": Explained("OAT location", "the three turns O, A, T of a location, each with its matrix"),
    "IK": Explained(
        "IK location", "the joints of a location, step by step, in each configuration, and the choice of MOVE"
    ),
    "SPLICE": Explained("SPLICE", "the segments that the last command has cut, planned and shifted", False),
}
EXPLAINED_ALL = (
    Explained(
        "motion", "the plan of a motion, as EXPLAIN MOVES part AT 2: times, speeds, and which limits bind", False
    ),
    Explained("location", "the chain of transformations, as EXPLAIN table:part: each factor, and their product"),
    *EXPLAINED.values(),
)

# Words that are allowed at the prompt while the robot program runs, in addition to commands that change nothing
# (`Role.OBSERVER`). They set, store, start or stop something, but do not move the arm themselves. All other commands
# and instructions are refused with the reason.
_BESIDE = """
    HERE POINT TEACH DELETEP DELETEL DPOINT DELETER DELETES COPY RENAME EDIT SEE
    LOAD LOADP LOADL STORE STOREP STOREL STORER STORES SAVE FDELETE FRENAME FCOPY COMMANDS
    EXECUTE PRIME SSTEP XSTEP NEXT ABORT PROCEED RETRY KILL CYCLE.END PCEXECUTE PCABORT PCEND PCPROCEED PCRETRY
    BPT WATCH SPEED SIGNAL RESET ENABLE DISABLE SWITCH PARAMETER CLOCK BRANCH EXIT QUIT SET TIMER CD LOG
"""
BESIDE = frozenset(_BESIDE.split())
# commands that move the robot or read its position; while a program runs, they are refused if the user is on another
# branch (timeline) than the program
_ON_BRANCH = "HERE TEACH EXECUTE PRIME SSTEP XSTEP NEXT PROCEED RETRY PCEXECUTE PCPROCEED PCRETRY"
ON_BRANCH = frozenset(_ON_BRANCH.split())


# --- keywords as arguments of commands ---

MEASURED = "MEASURED"  # argument of WHERE and COMPARE: show the measured positions, not the planned ones
CLOCK_WORDS: Mapping[str, str] = {
    "PAUSE": "pause the clock, and with it the arm",
    "GO": "let the clock go on",
    "RATE": "RATE = r: r seconds of the robot in one second",
}
STOP = "STOP"  # argument of RESYNC: stay at the measured position and drop the planned motions
BODY_WORDS: Mapping[str, str] = {
    "RELEASE": "the client is no longer the body",
    "OFF": "do not compare the body with the timeline",
    "WARN": "report an alarm",
    "HOLD": "at an alarm let the body hold",
    "ABORT": "at an alarm stop the robot",
    "RESYNC": "at an alarm let the body hold, and bring it back when the cause has passed",
}
AXIS_WORDS: Mapping[str, str] = {
    "X": "along X, Y, Z of the world [mm]",
    "RX": "about X, Y, Z of the world [deg]",
    "TX": "along X, Y, Z of the tool [mm]",
    "TRX": "about X, Y, Z of the tool [deg]",
}


class Quantity(Struct, frozen=True):
    """A quantity that PLOT can draw. `title`: the title of the plot; `joints`: for a quantity with one curve per joint,
    the field of `position.positions_at` that has its values, otherwise ""; `curves`: the names of the other curves
    (tool and hand)."""

    title: str
    unit: str
    summary: str
    joints: str = ""
    curves: tuple[str, ...] = ()


QUANTITIES: Mapping[str, Quantity] = {
    "POSITION": Quantity("Joints", "deg", "joint angles", joints="joints"),
    "VELOCITY": Quantity("Joint velocities", "deg/s", "joint velocities", joints="velocity"),
    "ACCELERATION": Quantity("Joint accelerations", "deg/s2", "joint accelerations", joints="acceleration"),
    "TOOL": Quantity("Tool", "mm", "X, Y and Z of the tool", curves=("X", "Y", "Z")),
    "X": Quantity("Tool", "mm", "X of the tool", curves=("X",)),
    "Y": Quantity("Tool", "mm", "Y of the tool", curves=("Y",)),
    "Z": Quantity("Tool", "mm", "Z of the tool", curves=("Z",)),
    "SPEED": Quantity("Tool speed", "mm/s", "how fast the tool tip moves", curves=("SPEED",)),
    "HAND": Quantity("Hand", "1 open", "the opening of the hand", curves=("HAND",)),
}
