"""The examples and explanations that the help of each subcommand shows below its options. Only `--help-all` shows the
text after a form feed."""

from __future__ import annotations

from collections.abc import Mapping

DELAYS = """\
DELAYS is one of
  200ms                        always the same
  normal 200ms 40ms            mean and standard deviation
  gamma 200ms 80ms             mean and standard deviation
  bursty 50ms 400ms 5s 500ms   the delay in calm and in a burst, and how long each lasts on average
  trace FILE                   as measured: a line is a delay, or a time [s] and a delay
A number without a unit is in seconds. Order is kept; what is lost is sent again after 0.2 s, 0.4 s, ...
"""

EXAMPLES: Mapping[str, str] = {
    "shell": """\
\f
Without a terminal on standard input its lines are executed one after another:

  echo WHERE | vrs

With --realtime the arm moves while you type:

  vrs --realtime
  vrs --realtime 0.25 pick.v2

All subcommands: vrs --help
""",
    "run": """\
  vrs run pick.v2
  vrs run main.v2 lib.v2            one name space
  vrs run cell                      each file of a folder alone
  vrs run cell.v2 load.part --cycles 5 --save cell.vrst
\f

Files that are named are one name space, in which the first program is executed. Those of a folder are apart.

What a program TYPEs goes to standard output as it happens, errors go to standard error; PROMPT reads
standard input. With --json, or --csv -, the result stands alone on standard output and all else goes to
standard error. Time is the robot's and passes as fast as it computes, unless --realtime is given.

  vrs run cell --keep written       the same; what each wrote is in written/NAME
  vrs run cell.v2 --signals cell.csv --max-time 60
  vrs run pick.v2 --csv pick.csv --rate 50 --plot pick.svg
  vrs run pick.v2 --report pick.html
  vrs run pick.v2 --json | jq .duration_s
  vrs run theirs.v2 --sandbox box
  vrs run driver.v2 --allow-net --record-units peers.jsonl
""",
    "convert": """\
  vrs convert pick.v2 --to urscript -o pick.script
\f

What the target cannot say is a comment there and a note on standard error.
""",
    "check": """\
  vrs check pick.v2 place.v2
  vrs check cell                    all program files in a folder, and below it
  vrs check cell --fix              mend what is sure: parentheses, words of VAL
\f

Codes are V and digits; the first of these stand for all that begin so. A program with an error does not run: errors
are always told. A comment at the end of a line silences its warnings; `ignore-file` silences those of the file:

    MOVE part        ; vrs: ignore V401
    ; vrs: ignore-file V056, V058

Exit status: 0 without errors (with --strict: without warnings too), else 1.

  vrs check "cell/**/*.v2" --ignore V056 --strict
  vrs check pick.v2 --cell c.toml   what the cell fills has a value
  vrs check pick.v2 --watch         again whenever a file changes, until Ctrl-C
  vrs check cell --format github    annotations of a GitHub workflow
""",
    "fmt": """\
A file with mistakes is left as it is.

  vrs fmt pick.v2
  vrs fmt --write cell              all program files in a folder, and below it
\f
Formatting twice changes nothing more.

  vrs fmt --check pick.v2 || echo "run vrs fmt --write"
""",
    "view": """\
  vrs view
  vrs view pick.v2 --rate 0.5
  vrs view ws://127.0.0.1:8765

The page is for this machine alone. Ctrl-C, or SIGTERM, ends it (in the shell: EXIT).

\f
On the terminal: space plays and pauses, left and right seek, r rewinds, f follows
the robot again, + and - change the rate, Ctrl-X aborts what others have it do, q leaves.

  vrs view --terminal ws://127.0.0.1:8765
  vrs view --terminal --ahead auto ws://far.example:8765
  vrs view --terminal day.vrst
""",
    "where": """\
  vrs where pick.vrst --at 1.0 2.5
\f

Before the first motion, after the last and between motions the robot stands still.
""",
    "replay": """\
Keys: space plays and pauses, left and right seek, r rewinds, + and - change the rate, q leaves.

  vrs replay pick.vrst --speed 0.25
\f

Without a terminal, or with --step, a table is printed; with --csv, --plot or --report only these are written.

  vrs replay pick.vrst --step 0.5
  vrs replay pick.vrst --plot pick.svg
""",
    "export": """\
  csv   a table of joints and tool positions, one row a sample
  json  a list of positions, one object a sample
  npz   NumPy arrays of samples, and of the segments with their polynomials
  mcap  messages of ROS 2 in a log for Foxglove and rosbag2
  ros   a JointTrajectory of ROS 2 as JSON: its controllers interpolate it exactly; --rate adds points
  html  a page that plays in a browser, offline
  png   a picture of one moment
  gif   a moving picture
  mp4   a film, by ffmpeg

\f
Columns of csv: t [s], jt1 ... jtn [deg; mm where a joint slides], x, y, z [mm], o, a, t_angle [deg].
html, png, gif and mp4 show the robot; a picture or a film is taken by the Chromium
or Chrome of this machine. With --measured csv, json and npz have the measured joints beside the planned ones; all
others show the robot as it was measured.

  vrs export pick.vrst --to csv -o pick.csv --rate 50
  vrs export pick.vrst --to csv | head
  vrs export day.vrst -o day.npz --rate 10
  vrs export pick.vrst -o pick.html --cell pick.toml
  vrs export pick.vrst -o pick.png --at 2.5
""",
    "verify": """\
Exit status 1: something is wrong.

  vrs verify pick.vrst
\f

Reading a file checks its form, checksums, continuity, the ranges of the joints, and their limits in joint space;
this follows every straight line too, with its accelerations and jerks, and tells all that is wrong.
""",
    "learn": """\
  vrs learn                 begin, or go on
  vrs learn 4               lesson 4

At the prompt: HINT, AGAIN, SKIP, BACK, LESSONS, LESSON N, and all of VAL-II.

\f
  vrs learn my_lessons      lessons of your own: a folder of them, or one lesson
  vrs learn --check FOLDER  what is wrong with a lesson, or with all in a folder

HINT helps, AGAIN shows the step again, SKIP does it for you, BACK goes one step back,
LESSONS lists all, LESSON N goes to one.

Without a terminal the lines of standard input are the learner's, and the exit status
is 0 where the lesson is finished, 1 where it is not:

  vrs learn 1 < lines.txt
""",
    "grade": """\
A submission is a .v2 file, or a folder with one, called after its student.
Exit status 1: something could not be graded.

  vrs grade pick class                                all in a folder: ann.v2, bob.v2, carl/robot.v2
  vrs grade pick class/*.v2 --csv grades.csv --json grades.json
\f

EXERCISE is a folder with the folders exercise and teacher, or the name of one that comes with vrs. Marks depend
on steps and simulated time alone: they are the same on every machine. Hidden checks are in --json, --csv, --junit and
teacher.html; students' files tell the points of all hidden checks together.

  vrs grade pick class --html pages                   a page for each student, and one for the teacher
  vrs grade pick /autograder/submission --gradescope /autograder/results/results.json
  vrs grade pick class --dask tcp://scheduler:8786
  vrs grade --check pick                              what is wrong with an exercise
  vrs grade --new mine solution.v2                    propose an exercise from a solution
""",
    "class": """\
  vrs class new 9b ada bob carl       make the folder 9b, with a token for each and the teacher
  vrs class links 9b --at https://robots.school:8765
  vrs class collect 9b --to monday    the newest program of each
  vrs class forget 9b ada             remove ada: the token, and all files

\f
  vrs class new 9b --names names.txt  names from a file; to add some, do it again
  vrs serve --class 9b --host 0.0.0.0 --tls-cert cert.pem --tls-key key.pem
  vrs grade pick monday

A link lets in whoever has it: give each student the own one alone. See docs/serve.md.
""",
    "class token": """\
The file holds hashes of tokens: what is printed here is told once.

  vrs class token tom --file class.toml --role teacher
\f

A server reads the file again when it changes.

  vrs class token ada bob carl --file class.toml
  vrs class token eve --file class.toml --role observer --robots cell1 --expires 2027-07-31
  vrs class token ada --file class.toml --revoke
""",
    "serve": """\
One robot, for this machine alone:

  vrs serve
  vrs connect ws://127.0.0.1:8765        (in another terminal)

Ctrl-C, or SIGTERM, ends it. See docs/serve.md and docs/security.md.

\f
Two robots in real time, which are there again after a crash:

  vrs serve --robot cell1=puma560 --robot cell2=cobra600 --realtime --journal journal

A class, each with a robot of her own (vrs class token makes the tokens):

  vrs serve --host 0.0.0.0 --tls-cert cert.pem --tls-key key.pem --tokens class.toml \\
            --robots-per-token 1 --journal journal --folder files
""",
    "connect": """\
  vrs connect ws://127.0.0.1/robots/cell1
  vrs connect ws://127.0.0.1 --put pick.v2 --as best.v2
\f

  echo WHERE | vrs connect ws://127.0.0.1/robots/cell1
  vrs connect ws://127.0.0.1 --get pick.v2 -o - | vrs check -

LOAD and STORE are about the files of the robot: --put and --get take files there and back.
What concerns the connection is told on stderr.
""",
    "body": """\
  vrs body ws://127.0.0.1:8000 --mujoco
  vrs body ws://lab:8000 --rosbridge ws://arm:9090
\f

A simulated arm takes disturbances on standard input while it runs: push, payload, block, slip, stop, drift, release.
--scenario FILE has them with their times (docs/twin.md).

  echo 'payload mass = 2' | vrs body ws://127.0.0.1:8000 --mujoco
  vrs body ws://lab:8000/robots/left --stream --format json --rate 50
  vrs body ws://lab:8000 --rosbridge ws://arm:9090 --joints pan,lift,elbow,wrist_1,wrist_2,wrist_3
""",
    "robots": """\
  vrs robots cobra600
  vrs robots two_arms.urdf --tip left_tool
""",
    "lab experiment": f"""\
methods tries viewers and controllers of your own; twin disturbs a simulated body; study is for people.

  vrs lab experiment methods --viewer smooth.py:Smooth
\f

All but study happens in virtual time, and is the same for the same seeds (docs/experiment.md).

  vrs lab experiment delays --plot delays.svg
  vrs lab experiment delays --delay 50ms 200ms --jitter 0 80ms --lead 0.4 --policy ABORT
  vrs lab experiment methods --controller mine:Controller
  vrs lab experiment twin --scenario payload storm.toml --plot twin.svg
  vrs lab experiment study study.toml --participant 3

An operator commands a motion every second or so, each for LEAD seconds after it is issued. Somebody far away sees it
  frames     by positions that are shown as they come
  predicted  by positions D_b ahead, shown when their time has come
  deltas     by the timeline, at the present
  ahead      by the timeline, D_f later: where the robot will be when a command of now arrives
  preview    the same, with the commands that are on their way
A row is the mean over all seeds. All of it happens in virtual time, and is the same for the same seeds.

methods tries classes of your own: viewers that show the robot from late frames, and controllers whose set points arrive
late, in fixed scenarios, beside those of vrs. docs/experiment.md says which two methods each has.

twin lets a simulated body follow the timeline, and disturbances befall it: what is seen, beside where the body is.

study is for people: they drive under several delays, in the order of a Latin square, and times and errors go to a CSV
file under pseudonyms. After a kill the same command goes on with the next trial.

{DELAYS}
  vrs lab experiment delays --forward "trace up.txt" --backward "bursty 50ms 400ms 5s 500ms" --loss 1%
""",
    "lab delay": f"""\
Whoever connects to LISTEN is connected to TARGET; both are HOST:PORT, or a PORT of this machine (0: one that is free).
Ctrl-C ends it.

  vrs lab delay 7001 7000 --forward "gamma 200ms 80ms" --loss 1%
  vrs connect ws://127.0.0.1:7001
\f

{DELAYS}
Each connection has delays of its own, the same for the same seed and number.
""",
    "lab steer": """\
A line is a time and the joints [s, deg, mm], or what the first line names, such as t,x,y,z,o,a,t_angle.

  vrs lab steer taught.csv --csv followed.csv
  robot_logger | vrs lab steer ws://lab:8000
\f

  vrs lab steer taught.csv --save followed.vrst --json
  robot_logger | vrs lab steer - --realtime
  vrs lab steer ws://lab:8000/robots/left taught.csv

Each target is followed from its time on, within all limits, until the next one; at the end, or after Ctrl-C,
the robot stops at the last one.

A line that is no target is named and left out.

A robot that is served follows in its own real time; each target is sent ahead, and due so many seconds after its time
as --lead says.
""",
    "tools lsp": """\
Diagnostics while you type, completion, help under the pointer, go to definition, outline, formatting.
How editors are told to start it: docs/editors.md.
""",
    "tools completion": """\
  eval "$(vrs tools completion bash)"                                      in ~/.bashrc
  vrs tools completion zsh > ~/.zfunc/_vrs                                 with ~/.zfunc in fpath
  vrs tools completion fish > ~/.config/fish/completions/vrs.fish
  vrs tools completion powershell | Out-String | Invoke-Expression         in $PROFILE
""",
    "tools config": """\
What it prints can be the file itself.
\f

What is wrong in the file is told on standard error, and the status is 1.
""",
}
