#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""A print farm's queue of slicing jobs, on Celery (README.md).

    farm.py submit NAME MESH [--customer C] [--priority P] [--shares N] -- OPTIONS OF ccslice slice
    farm.py status [NAME] [--json]
    farm.py wait NAME [--timeout SECONDS]
    farm.py cancel NAME
    farm.py retry NAME
    farm.py remove NAME
    farm.py prune --older AGE
    python3 -m celery -A farm worker      # in this folder: a worker

Exit codes are those of ccslice: 2 the command line is wrong, 3 there is no such job or mesh, 4 the server refuses the
job, 5 queue or server can't be reached, 6 interrupted, 7 the folder can't be written or the name is taken. Besides, of
wait: 9 the job failed or was cancelled, 10 it wasn't done in time."""

import argparse
import contextlib
import getpass
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import time

from kombu.exceptions import OperationalError

import farm_folder as jobs
import farm_options
import farm_worker
from farm_folder import FOLDER, Refused
from farm_worker import CCSLICE, app

LAYERS_OF_SHARE, SLAB = 128, 16
USAGE, INPUT, UNREACHABLE, INTERRUPTED, OUTPUT, NOT_DONE, TIME_UP = 2, 3, 5, 6, 7, 9, 10
UNITS_S = {"s": 1, "m": 60, "h": 3600, "d": 86400}


def send(job):
    """Puts the job into the queue, with as many tickets as shares wait: so whatever the queue has forgotten is back."""
    jobs.send(job)
    try:
        farm_worker.send_tickets(max(jobs.count_waiting() - farm_worker.tickets_ready(), 0))
    except (OperationalError, OSError) as error:
        raise Refused(f"the job {job.name} stands in {FOLDER}, but {farm_worker.place()} can't be reached ({error}): "
                      f"farm.py retry {job.name} sends it again", UNREACHABLE) from None


def plan_of(mesh, options):
    """(layers, engine version). ccslice plan knows nothing of --layers."""
    if not CCSLICE:
        raise Refused("there is no ccslice: put it into PATH, or name it in CCSLICE_FARM_PROGRAM", USAGE)
    done = subprocess.run([CCSLICE, "plan", f"./{mesh.name}", *farm_options.of_plan(options), "--json"],
                          capture_output=True, text=True, cwd=mesh.parent)
    if done.returncode:
        raise Refused(done.stderr.strip(), done.returncode)
    plan = json.loads(done.stdout)
    layers, wanted = plan["layer_count"], farm_options.value_of(options, "--layers")
    if wanted is None:
        return layers, plan["engine_version"]
    parts = re.fullmatch(r"(\d+)(?:\.\.(\d+))?", wanted)
    first, last = (int(parts[1]), int(parts[2] or parts[1])) if parts else (1, 0)
    if not first <= last < layers:
        raise Refused(f"--layers {wanted}: FIRST..LAST or one of the layers 0 to {layers - 1}", USAGE)
    return last - first + 1, plan["engine_version"]


def shares_of(layers, wanted):
    most = min(-(-layers // SLAB), jobs.MOST_SHARES)
    if wanted is not None and not 1 <= wanted <= most:
        raise Refused(f"--shares {wanted}: {layers} layers make 1 to {most} shares, as they are cut at multiples of "
                      f"{SLAB}", USAGE)
    return wanted or min(-(-layers // LAYERS_OF_SHARE), most)


def user():
    """The customer, unless one is named."""
    try:
        name = getpass.getuser()
    except (KeyError, OSError):
        name = ""  # In containers users have no names.
    return name if jobs.NAME.fullmatch(name) else f"user-{os.getuid()}"


def submit(arguments):
    folder, source = jobs.folder_of(arguments.name), pathlib.Path(arguments.mesh)
    customer = jobs.folder_of(arguments.customer or user()).name
    options = farm_options.parse(arguments.options)
    if not source.is_file():
        raise Refused(f"{source} is no mesh file", INPUT)
    if (folder / "job.json").exists():
        raise Refused(f"there is a job {arguments.name} already: take another name, farm.py retry {arguments.name}, or "
                      f"farm.py remove {arguments.name}", OUTPUT)
    if folder.exists():
        raise Refused(f"{folder} is there, and no job: take another name, or farm.py remove {arguments.name}", OUTPUT)
    making = FOLDER / f".{arguments.name}.{os.getpid()}"
    try:
        for part in ("mesh", "shares"):
            (making / part).mkdir(parents=True)
        mesh = pathlib.Path(shutil.copy(source, making / "mesh" / source.name))
        layers, engine = plan_of(mesh, options)
        job = jobs.Job(arguments.name, source.name, options, shares_of(layers, arguments.shares), layers, customer,
                       arguments.priority)
        jobs.write_job(job, making)
        (making / "engine").write_text(engine)
        making.rename(folder)
    except OSError as error:
        raise Refused(f"the job can't be put into {folder}: {error}", OUTPUT) from None
    finally:
        shutil.rmtree(making, ignore_errors=True)
    send(job)
    print(f"{job.name}: {layers} layers in {job.shares} share{'s' * (job.shares > 1)}")


def line_of(state):
    """For people."""
    speed = f" in {state['seconds']:.0f} s" if state["state"] == "done" else ""
    if state["seconds_left"] is not None:
        speed = f", {state['layers_a_second']:.1f} a second, {state['seconds_left']:.0f} s left"
    return (f"{state['name']}: {state['state']}, {state['layers_done']} of {state['layers']} layers{speed}"
            f"{state['message'] and ': ' + state['message']}")


def status(arguments):
    """One that can't be read hides no other. Without the queue only what it has forgotten isn't known."""
    states, code, ready = [], 0, None
    try:
        ready = farm_worker.tickets_ready()
    except (OperationalError, OSError) as error:
        code = UNREACHABLE
        print(f"farm: {farm_worker.place()} can't be reached ({error}): start it, or name it in CCSLICE_FARM_BROKER",
              file=sys.stderr)
    for name in [arguments.name] if arguments.name else jobs.job_names():
        try:
            states.append(jobs.state_of(jobs.read_job(name), ready))
        except (Refused, OSError, ValueError) as error:
            print(f"farm: {error}", file=sys.stderr)
            code = INPUT
    if arguments.json:
        print(json.dumps(states, indent=1))
    else:
        print(*map(line_of, states), sep="\n", end="\n" if states else "")
    return code


def wait(arguments):
    end = time.monotonic() + arguments.timeout if arguments.timeout is not None else None
    while True:
        job = jobs.read_job(arguments.name)
        if job.has_ended():
            state = jobs.state_of(job)
            print(line_of(state))
            return 0 if state["state"] == "done" else NOT_DONE
        if end is not None and time.monotonic() >= end:
            raise Refused(line_of(jobs.state_of(job)), TIME_UP)
        time.sleep(0.5)


def refuse_done(job):
    if job.is_done():
        raise Refused(f"{job.name} is done: its layers are in {job.folder / 'layers'}", OUTPUT)


def stop_tasks(job):
    (job.folder / "cancelled").touch()  # For those that begin later.
    jobs.dequeue(job.name)
    taken = jobs.taken_of(job)
    if taken:
        app.control.revoke(list(taken), terminate=True, signal="SIGTERM")
    for ticket in taken:
        jobs.release(ticket)


def cancel(arguments):
    job = jobs.read_job(arguments.name)
    refuse_done(job)
    stop_tasks(job)
    print(f"{job.name}: cancelled")


def retry(arguments):
    """With whatever engine the servers have."""
    job = jobs.read_job(arguments.name)
    refuse_done(job)
    job.pin_engine("")
    send(job)
    print(f"{job.name}: sent again")


def remove(arguments):
    folder = jobs.folder_of(arguments.name)
    if not folder.is_dir():
        jobs.read_job(arguments.name)  # Says so.
    with contextlib.suppress(Refused, OSError, OperationalError):  # A job that can't be read has no tasks that we know.
        job = jobs.read_job(arguments.name)
        if not job.is_done():
            stop_tasks(job)
    (folder / "job.json").unlink(missing_ok=True)  # Tasks that run on find no job.
    jobs.dequeue(arguments.name)
    for _ in range(20):
        shutil.rmtree(folder, ignore_errors=True)
        if not folder.exists():
            print(f"{arguments.name}: removed")
            return
        time.sleep(0.25)  # Somebody writes there still.
    raise Refused(f"{folder} can't be removed: is a worker still at it? Try again", OUTPUT)


def seconds_of(text):
    parts = re.fullmatch(r"(\d{1,6})([smhd])", text)
    if not parts:
        raise argparse.ArgumentTypeError(f"{text}: a number and s, m, h or d, such as 7d")
    return int(parts[1]) * UNITS_S[parts[2]]


def prune(arguments):
    """Removes jobs that ended so long ago."""
    before = time.time() - arguments.older
    for name in jobs.job_names():
        with contextlib.suppress(Refused):
            job = jobs.read_job(name)
            ends = [job.folder / one for one in ("layers/manifest.json", "failed", "cancelled")]
            times = [one.stat().st_mtime for one in ends if one.exists()]
            if times and max(times) < before:
                remove(argparse.Namespace(name=name))


def parser_of():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True, metavar="submit|status|wait|cancel|retry|remove|prune")
    one = commands.add_parser("submit", help="queue a job; the options of ccslice slice stand behind --")
    one.add_argument("name")
    one.add_argument("mesh")
    one.add_argument("--customer", help="who has turns with others; the user unless given")
    one.add_argument("--priority", type=int, default=5, choices=range(jobs.LAST_PRIORITY + 1), metavar="P",
                     help="0 comes first, 9 last; 5 unless given")
    one.add_argument("--shares", type=int, help="how many; one for 128 layers unless given, 64 at most")
    one.set_defaults(run=submit)
    for command, run, words in (("status", status, "layers done, rate, time left"),
                                ("wait", wait, "until a job is done, failed or cancelled"),
                                ("cancel", cancel, "stop a job"),
                                ("retry", retry, "send a job again; shares that are there stay"),
                                ("remove", remove, "stop a job and delete its folder, layers too")):
        one = commands.add_parser(command, help=words)
        one.add_argument("name", nargs="?" if command == "status" else None)
        if command == "status":
            one.add_argument("--json", action="store_true", help="for programs")
        if command == "wait":
            one.add_argument("--timeout", type=float, metavar="SECONDS", help="give up then")
        one.set_defaults(run=run)
    one = commands.add_parser("prune", help="remove jobs that ended long ago, layers too")
    one.add_argument("--older", type=seconds_of, required=True, metavar="AGE", help="such as 90m, 12h or 7d")
    one.set_defaults(run=prune)
    return parser


def main():
    # Who waits at a terminal is told soon.
    app.conf.task_publish_retry_policy = {"max_retries": 2}
    words, parser = sys.argv[1:], parser_of()
    end = words.index("--") if "--" in words else len(words)
    arguments, unknown = parser.parse_known_args(words[:end])
    if unknown:
        parser.error(f"unrecognized arguments: {' '.join(unknown)}; the options of ccslice slice stand behind --")
    arguments.options = words[end + 1:]
    try:
        sys.exit(arguments.run(arguments))
    except Refused as error:
        print(f"farm: {error}", file=sys.stderr)
        sys.exit(error.code)
    except farm_options.OptionRefused as error:
        print(f"farm: {error}", file=sys.stderr)
        sys.exit(USAGE)
    except (OperationalError, ConnectionError) as error:
        print(f"farm: {farm_worker.place()} can't be reached ({error}): start it, or name it in CCSLICE_FARM_BROKER",
              file=sys.stderr)
        sys.exit(UNREACHABLE)
    except KeyboardInterrupt:
        sys.exit(INTERRUPTED)


if __name__ == "__main__":
    main()
