"""The table of the subcommands of `vrs`: their modules, arguments and options with kinds of values, defaults and help.

`command_line.py` uses this table to read command lines, and `main.py` makes the page of `vrs --help` from it. The
examples of the help pages are in `examples.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from msgspec import Struct

from vrs_cli.cli import kinds


class OptionRow(Struct, frozen=True):
    """An option or a positional argument of a subcommand.

    `form` is the text that the help shows: "-o --output OUT". An option without a value is true or false; brackets mean
    that a value is optional, and dots that several may be given. A positional argument begins with the name of its
    attribute in the parsed options: "files FILE.v2 ...". `kind`: converts the string given as the value. `const`: the
    value of an option whose value is left out. `repeats`: the option may be given several times. `dest`: the name of
    its attribute, if that differs from its own. `rare`: only `--help-all` shows it.
    """

    form: str
    help: str
    kind: Callable[[str], object] = str
    default: object = None
    choices: tuple[str, ...] = ()
    const: object = None
    required: bool = False
    repeats: bool = False
    dest: str = ""
    rare: bool = False


class OneOf(Struct, frozen=True):
    """Mutually exclusive options: a command line may contain at most one of them."""

    options: tuple[OptionRow, ...]


class Group(Struct, frozen=True):
    """Options that the help shows together, below a title and a sentence `about` them."""

    title: str
    options: tuple[OptionRow | OneOf, ...]
    about: str | None


class Subcommand(Struct, frozen=True):
    """A row of the table of subcommands.

    `vrs --help` shows `arguments` and `summary`; the subcommand's own help begins with the `description`. The module
    has a function with the name of the subcommand: for `where` it is `where(options)`, which returns the exit status,
    or None for 0. For `lab steer` it is `steer`; for `class` it is `class_`, because `class` is a keyword of Python.
    """

    module: str
    arguments: str
    summary: str
    description: str
    options: tuple[OptionRow | OneOf | Group, ...]


rare = partial(OptionRow, rare=True)


def one_of(*options: OptionRow) -> OneOf:
    return OneOf(options)


def group(title: str, *options: OptionRow | OneOf, about: str | None = None) -> Group:
    return Group(title, options, about)


def subcommand(
    module: str, arguments: str, summary: str, description: str, *options: OptionRow | OneOf | Group
) -> Subcommand:
    return Subcommand(module, arguments, summary, description, options)


STANDARD_STREAM = "-"
TASKS = ("pose", "pointing", "upright", "steady", "position", "plane", "point")  # names of the members of ArmTask
SERVED = "ws://HOST:PORT or ws://HOST:PORT/robots/NAME; wss:// too"

# --- options of several subcommands -----------------------------------------------------------------------------------

CHOICES = (
    rare("--base LINK", "see vrs robots --help"),
    rare("--tip LINK", "see vrs robots --help"),
    rare("--task TASK", "see vrs robots --help", choices=TASKS),
)
ROBOT = (OptionRow("--robot NAME|FILE", "name or file: see vrs robots"), *CHOICES)
DIALECT = rare(
    "--dialect", "where a file does not say it (default: vplus)", default="vplus", choices=("val", "val2", "vplus")
)
CELL = OptionRow("--cell CELL.toml", "the cell around the robot (docs/cell.md)")
REALTIME = OptionRow("--realtime [RATE]", "in real time, or RATE times as fast", kinds.clock_rate, const=1.0)
UNITS = group(
    "units",
    rare("--allow-net", "TCP ports and connections on this machine"),
    rare(
        "--net-host ADDRESS",
        "also from other machines: the address at which ports are opened, 0.0.0.0 for all",
        kinds.host_address,
    ),
    rare(
        "--serial N=DEVICE",
        "the device SERIAL:N: a path such as /dev/ttyUSB0,9600, or pty for a pseudo-terminal",
        kinds.serial_line,
        [],
        repeats=True,
    ),
    rare("--patience S", "how long a unit waits for data (with --replay-units 60 s)", kinds.positive),
    rare("--record-units FILE", "record all data that arrives, with times"),
    rare("--replay-units FILE", "replay a record, or follow a script"),
    about="Devices that programs may ATTACH. With --allow-net and --serial, time passes as with --realtime.",
)
OUTPUTS = (
    OptionRow("--csv OUT", "a table of joints and tool (- is standard output)"),
    OptionRow("--rate HZ", "rows per second (default 100)", kinds.sampling_rate),
    OptionRow("--plot OUT.svg|png|pdf", "the curves"),
    OptionRow("--report OUT.html", "a page with curves and a picture"),
    rare("--report-at S", "the time of that picture (default: the end)", kinds.number),
)
CONNECTION = group(
    "the connection",
    OptionRow("--token-file FILE", "a file with the token (default: VRS_TOKEN)"),
    rare("--name NAME", "your name for other users, if tokens have no names", default=""),
    rare("--ca FILE", "the certificate of the server, or of the authority that signed it", kinds.path),
)
MEASURED = OptionRow("--measured", "the measured robot, not the planned one")
LENIENT = rare("--lenient", "read the readable part of a damaged file, with warnings")
PROJECT = rare("--project", "the files of a folder share one name space")
DELAY_OPTIONS = (
    rare("--forward DELAYS", "delays to the robot", kinds.delays),
    rare("--backward DELAYS", "delays from the robot", kinds.delays),
    rare("--loss SHARE", "lost fraction in each direction, such as 1%%", kinds.loss, 0.0),
    rare("--seed N", "seed of all random numbers (default: 1)", kinds.whole, 1),
)
SIGNALS = rare("--signals FILE", "changes of input signals: lines with time, signal, state")
JSON = OptionRow("--json", "print one JSON object")
TRAJECTORY = OptionRow("file T.vrst", "a saved trajectory")
ADDRESS = OptionRow("url URL", SERVED)
JOBS = rare("--jobs N", "processes (default: one for each core)", kinds.size)
FILES = OptionRow("files FILE.v2 ...", "files, folders or patterns (- is standard input)")

# --- the table, in the order of `vrs --help` ------------------------------------------------------------------------

GROUPS: Mapping[str, Mapping[str, Subcommand]] = {
    "work": {
        "shell": subcommand(
            "run",
            "[FILE.v2]",
            "the interactive shell (also plain vrs)",
            "The interactive VAL-II shell of a virtual robot.",
            OptionRow("file [FILE.v2]", "a program file to load first"),
            OptionRow("--save T.vrst", "record every motion in a file; continue the file if it exists"),
            *ROBOT,
            DIALECT,
            CELL,
            REALTIME,
            UNITS,
        ),
        "demo": subcommand(
            "view",
            "",
            "see the arm move, then try it yourself",
            "A sample program moves the arm, in the browser or on the terminal; then you type.",
            OptionRow("--terminal", "open no browser"),
            rare("--no-open", "print the address of the page alone"),
        ),
        "run": subcommand(
            "run",
            "FILE.v2 [PROGRAM]",
            "execute a program of a file, or all files of a folder",
            "Load a VAL-II file and execute a program of it on the virtual robot.",
            OptionRow(
                "files FILE.v2 ...",
                "a program file (- is standard input), and the name of its program (default: the first); or files, "
                "folders",
            ),
            OptionRow("--cycles N", "number of cycles; negative: endless", kinds.cycles, 1),
            PROJECT,
            *ROBOT,
            DIALECT,
            CELL,
            group(
                "limits",
                rare(
                    "--max-time S",
                    "seconds of the robot's time (default: a day, 86400; or an hour, 3600)",
                    kinds.positive,
                ),
                rare(
                    "--max-steps N",
                    "steps of all programs together (default: 100M, in real time any number; or 10M)",
                    kinds.size,
                ),
                rare(
                    "--max-elements N",
                    "elements of arrays and characters of strings (default: 10M)",
                    kinds.size,
                ),
                rare("--max-output BYTES", "output of TYPE (default: 100M; or 1M)", kinds.size),
                rare("--max-disk BYTES", "bytes written to files (default: 1G; or 10M)", kinds.size),
                rare(
                    "--max-wall SECONDS",
                    "real time; where a run ends then depends on the machine (default: any; or 300)",
                    kinds.positive,
                ),
                rare(
                    "--max-memory BYTES",
                    "memory of the process, if the system has such a limit (default: any; or 4G)",
                    kinds.size,
                ),
                about="A program that reaches a limit is stopped with an error. The first default is for one file, "
                "the second for each file of a folder or a pattern, and with --sandbox. K, M and G are 1000, 1000K "
                "and 1000M.",
            ),
            rare(
                "--sandbox FOLDER",
                "for programs of other people: they use files only in this folder (several files: each in FOLDER/NAME)",
            ),
            rare(
                "--keep FOLDER",
                "keep the files that each of several programs wrote, in FOLDER/NAME (else they are removed)",
            ),
            SIGNALS,
            REALTIME,
            UNITS,
            OptionRow("--save T.vrst", "save the trajectory, motion by motion"),
            *OUTPUTS,
            JSON,
            OptionRow("--quiet", "print only the output of TYPE"),
        ),
        "convert": subcommand(
            "convert",
            "FILE.v2 --to TARGET",
            "a program for another robot",
            "Write what a program does for another robot.",
            OptionRow("file FILE.v2", "a program file"),
            OptionRow("--to TARGET", "urscript, rapid, krl or python", required=True),
            OptionRow("--as-written", "rapid: loops and calls"),
            OptionRow("-o --output OUT", "the file to write", default=STANDARD_STREAM),
            *ROBOT,
            DIALECT,
            CELL,
            SIGNALS,
            rare("--replay-units FILE", "what comes from devices"),
        ),
        "check": subcommand(
            "check",
            "FILE.v2 ...",
            "find all mistakes in program files",
            "Find all mistakes in program files. Nothing is run.",
            FILES,
            OptionRow(
                "--format FORMAT", "text (default), json or github", default="text", choices=("text", "json", "github")
            ),
            rare("--select CODES", "warnings to show: V401,V05", kinds.codes, ("V",)),
            OptionRow("--ignore CODES", "warnings to hide", kinds.codes, ()),
            OptionRow("--strict", "exit status 1 also for warnings"),
            OptionRow("--fix", "correct sure mistakes, and report the others"),
            rare("--diff", "with --fix: only show the changes"),
            rare("--watch", "check again whenever a file changes"),
            PROJECT,
            *ROBOT,
            DIALECT,
            CELL,
        ),
        "fmt": subcommand(
            "check",
            "FILE.v2 ...",
            "print or rewrite program files as canonical VAL-II text",
            "Print program files as canonical VAL-II text: one layout, comments kept.",
            FILES,
            DIALECT,
            one_of(
                OptionRow("--write", "rewrite the files in place"),
                OptionRow("--check", "change nothing; status 1 if a file would change"),
                OptionRow("--diff", "the same, and show what would change"),
            ),
        ),
    },
    "trajectories": {
        "view": subcommand(
            "view",
            "[FILE.v2|T.vrst|URL]",
            "a robot in a browser: watch it, drive it, play it back",
            "Watch a robot, and drive it: in a browser, or on the terminal.",
            OptionRow(
                "url [FILE.v2|T.vrst|URL]",
                f"{SERVED}; a program file, or a saved trajectory; without it: a new robot, with a shell",
            ),
            CONNECTION,
            OptionRow("--terminal", "on the terminal: joints, tool, clock, who drives"),
            group(
                "the browser",
                OptionRow("--no-open", "print only the address"),
                rare("--port PORT", "default: any free port", kinds.port, 0),
                rare(
                    "--host HOST",
                    "an address that only this machine can reach (default: 127.0.0.1)",
                    default="127.0.0.1",
                ),
            ),
            *ROBOT,
            CELL,
            rare("--rate R", "seconds of the robot per second (default: 1)", kinds.clock_rate, 1.0),
            rare("--no-run", "load the file without executing it"),
            rare("--window S", "seconds of the robot's past that are kept (default 600)", kinds.positive),
            rare(
                "--ahead T|auto",
                "show a robot in real time this long [s] after its last known state; auto: where a command sent now "
                "will find it, with D_f + D_b as measured (default: its present)",
                kinds.ahead,
            ),
            LENIENT,
        ),
        "where": subcommand(
            "recorded",
            "T.vrst --at TIME ...",
            "print where the robot is at any time",
            "Print where the robot of a saved trajectory is at any time: joints, tool and hand.",
            TRAJECTORY,
            OptionRow("--at TIME ...", "times [s], any number", kinds.number, required=True, repeats=True),
            OptionRow("--json", "a JSON list with an object for every time"),
            MEASURED,
            LENIENT,
        ),
        "replay": subcommand(
            "recorded",
            "T.vrst",
            "play it, with pause, rewind and seek",
            "Play a saved trajectory on the terminal.",
            TRAJECTORY,
            OptionRow("--speed FACTOR", "seconds of the trajectory in one second (default 1)", kinds.positive, 1.0),
            OptionRow("--step S", "print a table, a row every S seconds (default 0.1)", kinds.positive),
            *OUTPUTS,
            MEASURED,
            LENIENT,
        ),
        "export": subcommand(
            "recorded",
            "T.vrst --to FORMAT",
            "write it for other programs: csv, npz, mcap, ...",
            "Write a saved trajectory in a format of other programs.",
            TRAJECTORY,
            OptionRow("--to FORMAT", "one of these; default: by the ending of OUT"),
            OptionRow("-o --output OUT", "the file to write; default: standard output", default=STANDARD_STREAM),
            OptionRow("--rate HZ", "rows per second (default 100), or frames (gif, mp4: 10)", kinds.sampling_rate),
            OptionRow("--at TIME", "the moment of a png [s]; default: the end", kinds.number),
            OptionRow("--cell CELL.toml", "the cell to be shown (mcap: where parts are)"),
            MEASURED,
            LENIENT,
        ),
        "verify": subcommand(
            "recorded",
            "T.vrst",
            "check that it is complete, and that the robot can execute it",
            "Check that a saved trajectory is complete, and that the robot can execute it.",
            TRAJECTORY,
            OptionRow("--json", "print one JSON object: sound, checksums, reports, faults"),
        ),
    },
    "class": {
        "learn": subcommand(
            "learn",
            "[LESSON]",
            "lessons at the prompt: VAL-II and the robot, step by step",
            "Lessons at the prompt, step by step; each step is checked. A lesson continues where you left it.",
            OptionRow("lesson [LESSON|FOLDER]", "a number, a name, or a folder of lessons"),
            OptionRow("--list", "the lessons, and where you are in each"),
            OptionRow("--reset", "forget where you are: in one lesson, or in all"),
            rare(
                "--check FOLDER", "test a lesson: each step without lines, with wrong lines, and with its model lines"
            ),
            group(
                "the browser",
                OptionRow("--view", "show the robot in a browser"),
                rare("--no-open", "print only the address"),
                rare("--port PORT", "default: any free port", kinds.port, 0),
            ),
        ),
        "grade": subcommand(
            "grade",
            "EXERCISE FILES ...",
            "grade submissions for an exercise",
            "Grade submissions for an exercise: run each in all variants, and mark what it did.",
            OptionRow("exercise [EXERCISE]", "a folder, or the name of one that comes with vrs"),
            OptionRow("files [FILES ...]", "submissions: files, folders, patterns"),
            OptionRow("--check FOLDER", "report mistakes in an exercise; runs the model solution and mutants of it"),
            rare(
                "--new NAME",
                "propose the exercise NAME, a new folder, from a solution: its checks are what the solution does",
            ),
            rare("--cell CELL.toml", "with --new: the cell around the robot (default: as for vrs run)"),
            JOBS,
            rare("--dask ADDRESS", "grade on the workers of this Dask scheduler"),
            rare("--quiet", "print no table"),
            group(
                "outputs, - is standard output",
                OptionRow("--json FILE", "all results, with reasons and variants"),
                OptionRow("--csv FILE", "a table for a gradebook"),
                rare("--junit FILE", "JUnit's XML"),
                rare("--gradescope FILE", "results.json of Gradescope; for several submissions a folder"),
                rare("--check50 FILE", "the JSON of check50; for several submissions a folder"),
                OptionRow("--html FOLDER", "pages: FOLDER/students for students, FOLDER/teacher.html"),
            ),
        ),
        "class": subcommand(
            "classroom",
            "COMMAND FOLDER",
            "a class in browsers: new, links, collect, forget",
            "A class in browsers: each student has a robot and a link to it.",
            OptionRow(
                "action new|links|collect|forget|token",
                "what to do (token: see vrs class token --help)",
                choices=("new", "links", "collect", "forget", "token"),
            ),
            OptionRow("folder FOLDER", "the folder of the class"),
            OptionRow("students [NAME ...]", "new, forget: students; links: only for these students"),
            OptionRow("--names FILE", "new: names of students, one in each line"),
            OptionRow("--at URL", "links: the address of the server (default: http://127.0.0.1:8765)"),
            OptionRow("--to FOLDER", "collect: where to (default: collected, in FOLDER)"),
        ),
        "class token": subcommand(
            "classroom",
            "NAME ... --file FILE",
            "make tokens for the users of a server",
            "Make tokens for the users of a server (vrs serve --tokens FILE).",
            OptionRow("names NAME ...", "names for other users, and for the users' own robots"),
            OptionRow("--file FILE", "the token file; it is made if missing", required=True),
            OptionRow(
                "--role",
                "what they may do (default: supervisor)",
                default="supervisor",
                choices=("observer", "designer", "supervisor", "teacher", "body"),
            ),
            OptionRow("--robots A,B", "the shared robots that they may use (default: all)"),
            rare("--expires DAY", "until the end of that day, or an instant", kinds.expiry),
            OptionRow("--revoke", "remove the tokens of these names from the file"),
        ),
    },
    "many": {
        "serve": subcommand(
            "serve",
            "",
            "serve robots to others over the network",
            "Serve virtual robots to others: vrs connect, vrs view, vrs.connect(URL).",
            OptionRow("--host HOST", "the address to listen at (default: only this machine)", default="127.0.0.1"),
            OptionRow("--port PORT", "default: 8765; 0: any free port", kinds.port, 8765),
            OptionRow(
                "--robot NAME=ROBOT",
                "a robot for all, and its name or file; may be repeated",
                kinds.named_robot,
                [],
                repeats=True,
            ),
            *CHOICES,
            OptionRow(
                "--cell [NAME=]CELL.toml",
                "the cell around each robot, or around the named one; may be repeated",
                kinds.named_cell,
                [],
                repeats=True,
            ),
            group(
                "a class",
                OptionRow("--class FOLDER", "the folder of a class (vrs class new)", dest="class_folder"),
                OptionRow("--tokens FILE", "users and their roles (TOML, read again when it changes)"),
                rare("--robots-per-token N", "number of own robots of each token", kinds.size, 0),
                rare("--own-robot ROBOT", "the kind of these robots (default: puma560)", default="puma560"),
            ),
            group(
                "time",
                REALTIME,
                rare("--causality", "what happens to commands that come too late", choices=("ABORT", "POSTPONE")),
                rare(
                    "--when-driver-goes",
                    "what a program does then (default: go-on)",
                    default="go-on",
                    choices=("go-on", "pause", "abort"),
                ),
                rare(
                    "--idle SECONDS",
                    "pause a robot that works while nobody has held or watched it for so long; 0: never (default: 600 "
                    "for those of --robots-per-token, never for others)",
                    kinds.idle_time,
                ),
            ),
            group(
                "what is kept",
                OptionRow("--journal DIR", "keep timelines and programs over a restart"),
                OptionRow("--folder DIR", "the files of robots, one folder for each (default: temporary)"),
                rare("--audit FILE", "a line for each command (default: audit.jsonl in --journal)"),
            ),
            group(
                "the network",
                OptionRow("--tls-cert FILE", "the certificate of this server, with its chain (PEM)"),
                rare("--tls-key FILE", "its key (default: in the same file)"),
                rare("--insecure", "also serve other machines, without encryption"),
                OptionRow("--pages", "show the robots in browsers"),
                rare("--origin URL", "pages of this site may connect too", default=[], repeats=True),
                rare("--nats URL", "publish all robots for viewers: nats://HOST:4222"),
            ),
            group(
                "limits",
                rare("--max-connections N", "in all (default: 4000)", kinds.size),
                rare("--max-folder BYTES", "in a robot's folder (default: 100M)", kinds.size),
                rare("--max-segments N", "of a robot's timeline (default: 2M)", kinds.size),
                rare("--max-steps N", "of one run of a program (default: any number)", kinds.size),
                about="K, M and G are 1000, 1000K and 1000M.",
            ),
        ),
        "connect": subcommand(
            "remote",
            "URL",
            "the shell at a served robot; --put and --get files",
            "The VAL-II shell at a served robot.",
            ADDRESS,
            CONNECTION,
            rare(
                "--behind T",
                "a motion AT t begins T after t: what takes no longer to arrive is not too late",
                kinds.duration,
                0.0,
            ),
            group(
                "files, instead of the shell",
                one_of(
                    OptionRow("--put FILE", "put a file into the robot's folder", kinds.path),
                    OptionRow("--get NAME", "get a file from the robot's folder"),
                ),
                OptionRow("--as NAME", "with --put: the name at the robot (default: the same)", dest="called"),
                OptionRow("-o --output FILE", "with --get: the file to write; - is standard output"),
                OptionRow("--replace", "overwrite a file of the same name"),
            ),
        ),
        "body": subcommand(
            "body",
            "URL",
            "act as a served robot's body: a simulated arm or a program",
            "Act as the body of a served robot: follow its timeline, and report the measured joints.",
            ADDRESS,
            CONNECTION,
            one_of(
                OptionRow("--mujoco", "a simulated arm (extra physics)"),
                OptionRow("--rosbridge URL", "an arm of ROS 2, by a rosbridge server (ws://HOST:9090)"),
                OptionRow("--stream", "another program: set points on stdout, reports on stdin"),
            ),
            OptionRow("--rate HZ", "reports per second (default: 100, at most 2000)", kinds.positive, 100.0),
            group(
                "the simulated arm",
                OptionRow("--scenario FILE.toml", "disturbances, and when they begin", kinds.path),
                rare("--controller", "computed torque, or PD", default="computed", choices=("computed", "pd")),
                rare("--bandwidth RAD/S", "of the controller (default: 40)", kinds.positive, 40.0),
                rare("--resolution DEG", "of the encoders (default: 0.0055)", kinds.positive),
                rare("--noise DEG", "of the encoders, standard deviation (default: 0.0011)", kinds.number),
                rare("--seed N", "of the noise (default: the scenario's, or 0)", kinds.whole),
            ),
            group(
                "the arm of ROS",
                rare("--joints NAMES", "its joints: a,b,... or FILE.toml (default: joint_1, ...)"),
                rare("--ros-controller NAME", "(default: %(default)s)", default="joint_trajectory_controller"),
                rare("--joint-states TOPIC", "(default: %(default)s)", default="joint_states"),
                rare("--action", "send goals to its action, not messages to its topic"),
                rare("--replacement", "it has allow_trajectory_replacement: true"),
            ),
            group(
                "the stream", rare("--format", "of set points (default: csv)", default="csv", choices=("csv", "json"))
            ),
        ),
    },
    "more": {
        "robots": subcommand(
            "tools",
            "[NAME|FILE]",
            "list all robots, or describe one",
            "List the built-in robots, or describe one robot.",
            OptionRow("robot [NAME|FILE]", "a robot's name, or its TOML or URDF file"),
            OptionRow("--base LINK", "of a URDF file: the link that the arm stands on"),
            OptionRow("--tip LINK", "of a URDF file: the link that the arm moves, its flange"),
            OptionRow("--task", "the part of a location that counts; overrides the file", choices=TASKS),
        ),
        "lab experiment": subcommand(
            "experiment",
            "[KIND]",
            "experiments with delays: delays, methods, twin, study",
            "Experiments on commanding a robot over a connection with delays.",
            OptionRow(
                "what [EXPERIMENT]", "delays, methods, twin, study", choices=("delays", "methods", "twin", "study")
            ),
            OptionRow("file [FILE.toml]", "study: its conditions and its task"),
            rare("--participant N", "study: who drives (default: the next participant)", kinds.size),
            rare("--out FILE.csv", "study: the results (default: FILE.csv, with --dry-run FILE.dry.csv)"),
            rare("--dry-run", "study: a scripted participant, in virtual time"),
            rare("--viewer CLASS ...", "methods: module:Class or FILE.py:Class"),
            rare("--controller CLASS ...", "methods: module:Class or FILE.py:Class"),
            rare(
                "--scenario NAME ...",
                "of methods: moves, steps, waves, stops; of twin: healthy, push, payload, blocked, "
                "stop, drift, or a FILE.toml",
            ),
            OptionRow("--delay T ...", "mean delays, gamma distributed (default: 200ms)", kinds.duration),
            rare("--jitter T ...", "their standard deviations (default: 80ms)", kinds.duration),
            *DELAY_OPTIONS,
            OptionRow(
                "--lead T ...", "time from the issue of a command to its begin (default: 0 to 0.8 s)", kinds.duration
            ),
            rare(
                "--policy ...",
                "what becomes of late commands (default: ABORT and POSTPONE)",
                str.upper,
                choices=("ABORT", "POSTPONE"),
            ),
            OptionRow("--seeds N", "trials per row (default: 20, 5 or 2)", kinds.size),
            rare("--seconds T", "duration of each trial (default: 200; methods 30, twin 40)", kinds.trial_seconds),
            rare("--rate HZ", "samples per second of a viewer (default: 25)", kinds.look_rate),
            *ROBOT,
            JOBS,
            OptionRow("--plot [OUT.svg|png|pdf]", "draw curves over the lead; twin: over time", const=STANDARD_STREAM),
            JSON,
        ),
        "lab delay": subcommand(
            "remote",
            "LISTEN TARGET",
            "a line with delays between a client and a server",
            "Put a line with delays, jitter and losses between a client and a server.",
            OptionRow("listen LISTEN", "where clients connect", kinds.endpoint),
            OptionRow("target TARGET", "the server", kinds.endpoint),
            *DELAY_OPTIONS,
            OptionRow("--quiet", "do not report connections"),
        ),
        "lab steer": subcommand(
            "steer",
            "FILE.csv",
            "follow a stream of targets",
            "Make the virtual robot follow a stream of targets.",
            OptionRow("file FILE.csv", "the targets (- is standard input, line by line)"),
            OptionRow("url [URL]", f"the address of the served robot to steer: {SERVED}"),
            rare("--lead S", "for a served robot (default: round trip + 0.35 s)", kinds.positive),
            *ROBOT,
            OptionRow("--speed PCT", "maximum percentage of full speed", kinds.percent, 100.0),
            rare(
                "--profile",
                "LSPB: without limits of jerk; the others: with them (default: as the robot's file says)",
                str.upper,
                choices=("LSPB", "SCURVE", "QUINTIC"),
            ),
            rare("--relative", "times count from the first one (in real time, always)"),
            REALTIME,
            OptionRow("--save T.vrst", "save the trajectory, target by target"),
            *OUTPUTS,
            JSON,
            CONNECTION,
        ),
        "tools lsp": subcommand(
            "tools",
            "",
            "the language server, which editors start",
            "The VAL-II language server (LSP), over standard input and output.",
            OptionRow("--stdio", "use standard input and output (always; some editors give this option)"),
            *ROBOT,
        ),
        "tools completion": subcommand(
            "tools",
            "SHELL",
            "the script of a shell that completes vrs with Tab",
            "Print the script with which a shell completes vrs by the Tab key.",
            OptionRow("shell SHELL", "bash, zsh, fish, powershell", choices=("bash", "zsh", "fish", "powershell")),
        ),
        "tools config": subcommand(
            "tools",
            "",
            "the settings of the shell, and their file",
            "The settings of the shell: keys, pager, suggestions, colours.",
            OptionRow("--path", "print only the name of the file"),
        ),
    },
}
SUBCOMMANDS: Mapping[str, Subcommand] = {name: row for rows in GROUPS.values() for name, row in rows.items()}
