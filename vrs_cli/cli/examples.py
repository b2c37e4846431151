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
  trace FILE                   measured delays: each line has a delay, or a time [s] and a delay
A number without a unit is in seconds. Messages stay in order; a lost message is sent again after 0.2 s, 0.4 s, ...
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
  vrs run main.v2 lib.v2            in one name space
  vrs run cell                      each file of a folder separately
  vrs run cell.v2 load.part --cycles 5 --save cell.vrst
\f

Several named files share one name space, and the first program is executed. The files of a folder are run separately.

The output of TYPE goes to standard output at once, errors go to standard error; PROMPT reads standard input.
With --json or --csv -, only the result goes to standard output, and everything else to standard error.
Programs run in virtual time, as fast as the computer allows, unless --realtime is given.

  vrs run cell --keep written       also keep the files that each program writes, in written/NAME
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

What the target language cannot express becomes a comment in the file, and a note on standard error.
""",
    "check": """\
  vrs check pick.v2 place.v2
  vrs check cell                    all program files in a folder, and below it
  vrs check cell --fix              correct sure mistakes: parentheses, words of VAL
\f

A code is V and digits; its first characters select all codes that begin with them. Errors are always reported, because
a program with an error does not run. A comment at the end of a line hides its warnings, `ignore-file` those of a file:

    MOVE part        ; vrs: ignore V401
    ; vrs: ignore-file V056, V058

Exit status: 0 without errors (with --strict: without warnings too), else 1.

  vrs check "cell/**/*.v2" --ignore V056 --strict
  vrs check pick.v2 --cell c.toml   variables that the cell sets count as having values
  vrs check pick.v2 --watch         again whenever a file changes, until Ctrl-C
  vrs check cell --format github    annotations of a GitHub workflow
""",
    "fmt": """\
A file with mistakes stays unchanged.

  vrs fmt pick.v2
  vrs fmt --write cell              all program files in a folder, and below it
\f
Formatting a formatted file changes nothing.

  vrs fmt --check pick.v2 || echo "run vrs fmt --write"
""",
    "view": """\
  vrs view
  vrs view pick.v2 --rate 0.5
  vrs view ws://127.0.0.1:8765

Only this machine can open the page. Ctrl-C or SIGTERM ends it (in the shell: EXIT).

\f
On the terminal: space plays and pauses, left and right seek, r rewinds, f follows
the robot again, + and - change the rate, Ctrl-X stops the robot (ABORT), q leaves.

  vrs view --terminal ws://127.0.0.1:8765
  vrs view --terminal --ahead auto ws://far.example:8765
  vrs view --terminal day.vrst
""",
    "where": """\
  vrs where pick.vrst --at 1.0 2.5
\f

Before the first motion, between motions and after the last motion the robot is at rest.
""",
    "replay": """\
Keys: space plays and pauses, left and right seek, r rewinds, + and - change the rate, q leaves.

  vrs replay pick.vrst --speed 0.25
\f

Without a terminal, or with --step, a table is printed. With --csv, --plot or --report, only these files are written.

  vrs replay pick.vrst --step 0.5
  vrs replay pick.vrst --plot pick.svg
""",
    "export": """\
  csv   a table of joints and tool positions, one row per sample
  json  a list of positions, one object per sample
  npz   NumPy arrays of samples, and of the segments with their polynomials
  mcap  messages of ROS 2 in a log for Foxglove and rosbag2
  ros   a JointTrajectory of ROS 2 as JSON, which ROS controllers interpolate exactly; --rate adds points
  html  a page that plays in a browser, offline
  png   a picture of one moment
  gif   an animation
  mp4   a film, made by ffmpeg

\f
Columns of csv: t [s], jt1 ... jtn [deg; mm for a prismatic joint], x, y, z [mm], o, a, t_angle [deg].
html, png, gif and mp4 show the robot; pictures and films need Chromium or Chrome on this machine.
With --measured, csv, json and npz have both the planned and the measured joints; all other formats have the measured
robot only.

  vrs export pick.vrst --to csv -o pick.csv --rate 50
  vrs export pick.vrst --to csv | head
  vrs export day.vrst -o day.npz --rate 10
  vrs export pick.vrst -o pick.html --cell pick.toml
  vrs export pick.vrst -o pick.png --at 2.5
""",
    "verify": """\
Exit status 1: the file has faults.

  vrs verify pick.vrst
\f

Every command that reads a file checks its form, checksums, continuity, joint ranges, and limits in joint space.
This command also checks accelerations and jerks on every straight line, and reports all faults.
""",
    "learn": """\
  vrs learn                 begin, or continue
  vrs learn 4               lesson 4

At the prompt: HINT, AGAIN, SKIP, BACK, LESSONS, LESSON N, and all of VAL-II.

\f
  vrs learn my_lessons      your own lessons: a folder with lessons, or one lesson
  vrs learn --check FOLDER  report the mistakes in a lesson, or in all lessons of a folder

HINT gives a hint, AGAIN shows the step again, SKIP does the step for you, BACK goes back one step,
LESSONS lists all lessons, LESSON N goes to one of them.

Without a terminal, the lines of standard input are taken as the learner's. The exit status
is 0 if the lesson is finished, otherwise 1:

  vrs learn 1 < lines.txt
""",
    "grade": """\
A submission is a .v2 file, or a folder with one; its name is the student's.
Exit status 1: a submission could not be graded.

  vrs grade pick class                                a folder: ann.v2, bob.v2, carl/robot.v2
  vrs grade pick class/*.v2 --csv grades.csv --json grades.json
\f

EXERCISE is a folder with the folders exercise and teacher, or the name of an exercise that comes with vrs. Marks depend
only on steps and simulated time, so they are the same on every machine. Hidden checks appear in --json, --csv, --junit
and teacher.html; students' files show only the total points of all hidden checks.

  vrs grade pick class --html pages                   a page for each student, and one for the teacher
  vrs grade pick /autograder/submission --gradescope /autograder/results/results.json
  vrs grade pick class --dask tcp://scheduler:8786
  vrs grade --check pick                              report the mistakes in an exercise
  vrs grade --new mine solution.v2                    propose an exercise from a solution
""",
    "class": """\
  vrs class new 9b ada bob carl       make folder 9b, with tokens for students and teacher
  vrs class links 9b --at https://robots.school:8765
  vrs class collect 9b --to monday    copy each student's newest program
  vrs class forget 9b ada             remove ada's token and files

\f
  vrs class new 9b --names names.txt  read the names from a file; repeat the command to add students
  vrs serve --class 9b --host 0.0.0.0 --tls-cert cert.pem --tls-key key.pem
  vrs grade pick monday

Anybody who has a link can connect: give each student only the student's own link. See docs/serve.md.
""",
    "class token": """\
The file contains only hashes of tokens: the printed tokens cannot be shown again.

  vrs class token tom --file class.toml --role teacher
\f

A server reads the file again when it changes.

  vrs class token ada bob carl --file class.toml
  vrs class token eve --file class.toml --role observer --robots cell1 --expires 2027-07-31
  vrs class token ada --file class.toml --revoke
""",
    "serve": """\
One robot, which only this machine can reach:

  vrs serve
  vrs connect ws://127.0.0.1:8765        (in another terminal)

Ctrl-C or SIGTERM ends the server. See docs/serve.md and docs/security.md.

\f
Two robots in real time, whose timelines and programs survive a crash:

  vrs serve --robot cell1=puma560 --robot cell2=cobra600 --realtime --journal journal

A class in which each student has a robot (vrs class token makes the tokens):

  vrs serve --host 0.0.0.0 --tls-cert cert.pem --tls-key key.pem --tokens class.toml \\
            --robots-per-token 1 --journal journal --folder files
""",
    "connect": """\
  vrs connect ws://127.0.0.1/robots/cell1
  vrs connect ws://127.0.0.1 --put pick.v2 --as best.v2
\f

  echo WHERE | vrs connect ws://127.0.0.1/robots/cell1
  vrs connect ws://127.0.0.1 --get pick.v2 -o - | vrs check -

LOAD and STORE read and write files in the robot's folder; --put and --get copy files to this folder and back.
Messages about the connection go to standard error.
""",
    "body": """\
  vrs body ws://127.0.0.1:8000 --mujoco
  vrs body ws://lab:8000 --rosbridge ws://arm:9090
\f

A simulated arm takes disturbances on standard input while it runs: push, payload, block, slip, stop, drift, release.
--scenario FILE reads disturbances with their times (docs/twin.md).

  echo 'payload mass = 2' | vrs body ws://127.0.0.1:8000 --mujoco
  vrs body ws://lab:8000/robots/left --stream --format json --rate 50
  vrs body ws://lab:8000 --rosbridge ws://arm:9090 --joints pan,lift,elbow,wrist_1,wrist_2,wrist_3
""",
    "robots": """\
  vrs robots cobra600
  vrs robots two_arms.urdf --tip left_tool
""",
    "lab experiment": f"""\
methods tests your own viewers and controllers; twin disturbs a simulated body; study is for people.

  vrs lab experiment methods --viewer smooth.py:Smooth
\f

All except study run in virtual time: the same seeds give the same results (docs/experiment.md).

  vrs lab experiment delays --plot delays.svg
  vrs lab experiment delays --delay 50ms 200ms --jitter 0 80ms --lead 0.4 --policy ABORT
  vrs lab experiment methods --controller mine:Controller
  vrs lab experiment twin --scenario payload storm.toml --plot twin.svg
  vrs lab experiment study study.toml --participant 3

delays: an operator commands about one motion a second, each to begin LEAD seconds after it is issued. A remote viewer
shows the robot
  frames     from positions, as they arrive
  predicted  from positions sent D_b ahead, shown at their own times
  deltas     from the timeline, at the present time
  ahead      from the timeline, D_f later: where a command sent now will find the robot
  preview    as ahead, with the commands that are still on their way
A row is the mean over all seeds.

methods tests your own classes in fixed scenarios, and compares them with those of vrs: viewers that show the robot from
late frames, and controllers whose set points arrive late. docs/experiment.md lists the two methods of each class.

twin disturbs a simulated body that follows the timeline, and compares the displayed arm with the body.

study: people drive under several delays, in the order of a Latin square. Times and errors are written to a CSV file
under pseudonyms. If the process is killed, the same command continues with the next trial.

{DELAYS}
  vrs lab experiment delays --forward "trace up.txt" --backward "bursty 50ms 400ms 5s 500ms" --loss 1%
""",
    "lab delay": f"""\
Connections to LISTEN are passed on to TARGET; both are HOST:PORT, or a PORT of this machine (0: a free port).
Ctrl-C ends it.

  vrs lab delay 7001 7000 --forward "gamma 200ms 80ms" --loss 1%
  vrs connect ws://127.0.0.1:7001
\f

{DELAYS}
Each connection has its own delays; the same seed and number give the same delays.
""",
    "lab steer": """\
A line has a time and the joints [s, deg, mm], or the columns that the first line names, such as t,x,y,z,o,a,t_angle.

  vrs lab steer taught.csv --csv followed.csv
  robot_logger | vrs lab steer ws://lab:8000
\f

  vrs lab steer taught.csv --save followed.vrst --json
  robot_logger | vrs lab steer - --realtime
  vrs lab steer ws://lab:8000/robots/left taught.csv

The robot follows each target from its time on, within all limits, until the next target. At the end, or after Ctrl-C,
the robot stops at the last target.

A line that is not a target is reported and skipped.

A served robot follows in its own real time: each target is sent early, and is due --lead seconds after its time.
""",
    "tools lsp": """\
Diagnostics while you type, completion, help under the pointer, go to definition, outline, formatting.
docs/editors.md explains how an editor starts it.
""",
    "tools completion": """\
  eval "$(vrs tools completion bash)"                                      in ~/.bashrc
  vrs tools completion zsh > ~/.zfunc/_vrs                                 with ~/.zfunc in fpath
  vrs tools completion fish > ~/.config/fish/completions/vrs.fish
  vrs tools completion powershell | Out-String | Invoke-Expression         in $PROFILE
""",
    "tools config": """\
The output can be used as the configuration file.
\f

Mistakes in the file are reported on standard error, and the exit status is 1.
""",
}
