#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""A print farm's queue of slicing jobs, on Celery (README.md).

    farm.py submit NAME MESH [--priority P] [--shares N] -- OPTIONS OF ccslice slice
    farm.py status [NAME]
    farm.py cancel NAME
    farm.py retry NAME
    farm.py remove NAME
    python3 -m celery -A farm worker      # in this folder: a worker

A job is a chord: share I of N is a task that any worker does, and one more task joins the shares. All programs see one
folder, CCSLICE_FARM_FOLDER, with a folder for each job: job.json, mesh, shares/I, and layers, which is the result; or a
file that says that it is cancelled, or why it failed. Tasks that job.json doesn't name do nothing.
CCSLICE_FARM_BROKER and CCSLICE_FARM_RESULTS say where Celery keeps its queue and its results."""

import argparse
import contextlib
import ctypes
import functools
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import time
import uuid

from billiard import current_process
from celery import Celery, chord
from celery.backends.redis import RedisBackend
from celery.exceptions import Retry
from celery.worker.consumer import Gossip, Mingle
from kombu.exceptions import OperationalError
from kombu.transport import redis as kombu_redis
from kombu.utils.url import maybe_sanitize_url
from redis.exceptions import RedisError

FOLDER = pathlib.Path(os.environ.get("CCSLICE_FARM_FOLDER", "farm-jobs")).absolute()
BROKER = os.environ.get("CCSLICE_FARM_BROKER", "redis://localhost:6379/1")
OVER_REDIS = BROKER.startswith("redis")
RESULTS = os.environ.get("CCSLICE_FARM_RESULTS", BROKER if OVER_REDIS else "redis://localhost:6379/1")
LONGEST_SHARE = os.environ.get("CCSLICE_FARM_LONGEST_SHARE", "3600")
if not re.fullmatch("[1-9][0-9]*", LONGEST_SHARE):
    sys.exit(f"farm: CCSLICE_FARM_LONGEST_SHARE={LONGEST_SHARE}: seconds, for instance 3600")
LONGEST_SHARE_S = int(LONGEST_SHARE)
CCSLICE = shutil.which(os.environ.get("CCSLICE_FARM_PROGRAM", "ccslice"))
LAYERS_OF_SHARE, MOST_SHARES, SLAB = 128, 64, 16
PASSES = (5, 6, 7)  # Exit codes of ccslice's that another attempt may not meet: no server, interrupted, no room.
ATTEMPTS, PAUSE_S = 20, 5
LAST_PRIORITY = 9
# The farm gives these itself, or nothing for them,
OWN_OPTIONS = ("-o", "--output", "--share", "--resume", "--force", "--json", "-h", "--help", "--job", "--write-job")
# and whom a worker trusts, with which token, isn't for a job to say.
WORKERS_OPTIONS = ("--server", "--local", "--ca", "--cert", "--key", "--token-file")


class PatientResults(RedisBackend):
    """Waits where results are away. Celery's own (5.2) takes the task for failed, and the job with it."""

    patient = True

    def ensure(self, fun, args, **policy):
        return super().ensure(fun, args, **(policy if self.patient else {"max_retries": 0}))

    def get(self, key):
        return self.ensure(super().get, (key,))

    def on_chord_part_return(self, *arguments, **options):
        return self.ensure(functools.partial(super().on_chord_part_return, **options), arguments)


PATIENCE = {"max_retries": 3600, "interval_start": 1, "interval_step": 0, "interval_max": 1}
app = Celery("farm", broker=BROKER, backend=RESULTS)
app.loader.override_backends = {scheme: f"{__name__}:PatientResults" for scheme in ("redis", "rediss")}
app.conf.update(
    # A task is done when it is done: that of a worker that dies goes to another one.
    task_acks_late=True, task_reject_on_worker_lost=True, worker_prefetch_multiplier=1, worker_concurrency=1,
    # Redis notices a lost worker by this time; it has to be longer than the longest share. RabbitMQ notices at once; it
    # says of each message that it has it, and knows priorities of queues that were made for them.
    broker_transport_options={"visibility_timeout": LONGEST_SHARE_S, "queue_order_strategy": "priority",
                              "priority_steps": list(range(LAST_PRIORITY + 1))} if OVER_REDIS
    else {"confirm_publish": True},
    task_queue_max_priority=None if OVER_REDIS else LAST_PRIORITY,
    result_backend_transport_options={"visibility_timeout": LONGEST_SHARE_S, "retry_policy": PATIENCE},
    task_publish_retry_policy=PATIENCE,
    # What runs while the broker is away runs on. It is given out again, and found done.
    worker_cancel_long_running_tasks_on_connection_loss=False, broker_connection_max_retries=None,
    task_track_started=True, result_expires=7 * 24 * 3600)

# Kombu (transport/redis.py, 5.2) looks for messages of lost workers at every tenth tick of ten seconds. Look at each.
kombu_redis.QoS.restore_visible.__defaults__ = (0, 10, 1)

# Workers that look for each other stop taking tasks once Redis was away (celery/celery issue 8030). They needn't look.
Gossip.compatible_transports = Mingle.compatible_transports = frozenset()


class JobFailed(Exception):
    """With ccslice's own words."""


def places():
    return " or ".join(dict.fromkeys(maybe_sanitize_url(url) for url in (BROKER, RESULTS)))


def folder_of(name):
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", name):
        sys.exit(f"farm: {name!r} can't be a job's name: take letters, digits, dots, hyphens and underscores")
    return FOLDER / name


def result_of(name):
    return folder_of(name) / "layers" / "manifest.json"


def read_job(name):
    path = folder_of(name) / "job.json"
    try:
        return json.loads(path.read_text())
    except FileNotFoundError:
        sys.exit(f"farm: there is no job {name} in {FOLDER} (CCSLICE_FARM_FOLDER); farm.py status lists them")
    except (OSError, ValueError) as error:
        sys.exit(f"farm: {path} can't be read ({error}): farm.py remove {name}, and submit it again")


def share_folder(name, number):
    return folder_of(name) / "shares" / str(number)


def die_with_worker():
    """A worker that is killed takes its ccslice along, which would write beside the next one's."""
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG of <linux/prctl.h>.


def layers_in(share):
    return json.loads((share / "manifest.json").read_text())["share"]["layers"]


def layers_sliced(folder):
    """Of a share that isn't whole yet: its journal has a line for each, below a first one."""
    try:
        return max((folder / "journal.jsonl").read_text().count("\n") - 1, 0)
    except OSError:
        return 0  # It hasn't begun, or it is done by now.


def tell_progress(task, layers):
    """Slicing waits for nobody who wants to know."""
    task.backend.patient = False
    try:
        task.update_state(state="PROGRESS", meta={"layers": layers})
    except RedisError:
        pass
    finally:
        task.backend.patient = True


def run_ccslice(task, arguments, cwd, watched=None):
    """Runs ccslice and tells how many layers are there. Ends with the worker, or when the task is revoked."""
    if not CCSLICE:
        raise JobFailed("this worker has no ccslice: put it into PATH, or name it in CCSLICE_FARM_PROGRAM")
    process = subprocess.Popen([CCSLICE, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                               cwd=cwd, preexec_fn=die_with_worker)
    try:
        while True:
            try:
                _, said = process.communicate(timeout=1)
                break
            except subprocess.TimeoutExpired:
                if watched:
                    tell_progress(task, layers_sliced(watched))
    finally:
        if process.poll() is None:
            process.terminate()
            process.wait()
    if process.returncode == 0:
        return
    words = (said.strip().splitlines() or ["nothing was said"])[-1]
    if process.returncode in PASSES or process.returncode < 0:
        raise task.retry(countdown=PAUSE_S, max_retries=ATTEMPTS, exc=JobFailed(words))
    raise JobFailed(f"exit code {process.returncode}: {words}")


def stands(folder, task_id):
    """The job, or None where it doesn't want that task, which is an earlier job's of that name, or an ended one's."""
    try:
        job = json.loads((folder / "job.json").read_text())
    except (OSError, ValueError):
        return None  # Somebody has removed it.
    ended = (folder / "cancelled").exists() or (folder / "failed").exists()
    return job if task_id in (*job["tasks"], job["join"]) and not ended else None


@contextlib.contextmanager
def telling_failure(folder, what):
    """The first one ends the job: other tasks do nothing then."""
    try:
        yield
    except Retry:
        raise
    except Exception as error:
        with contextlib.suppress(OSError):
            (folder / "failed").write_text(f"{what}: {error}")
        raise


@app.task(bind=True)
def slice_share(self, name, number, count):
    """Into a folder of this process's, which becomes the share's once it is whole: two workers do no harm."""
    folder, share = FOLDER / name, FOLDER / name / "shares" / str(number)
    job = stands(folder, self.request.id)
    if not job:
        return 0
    with telling_failure(folder, f"share {number}"):
        if not share.exists():
            for option in job["options"]:  # The folder is anybody's who may submit.
                if option.partition("=")[0] in WORKERS_OPTIONS:
                    raise JobFailed(f"{option.partition('=')[0]} is for the worker's operator to say")
            own = own_folder(self, folder / "shares", number)
            run_ccslice(self, ["slice", f"./{job['mesh']}", *job["options"], "--share", f"{number}/{count}", "--resume",
                               "-o", str(own)], cwd=folder / "mesh", watched=own)
            put_in_place(own, share)
        return layers_in(share)


@app.task(bind=True)
def join(self, layers, name, count):
    folder = FOLDER / name
    if not stands(folder, self.request.id):
        return 0
    with telling_failure(folder, "joining"):
        if not (folder / "layers").exists():
            own = own_folder(self, folder, "layers")
            shutil.rmtree(own, ignore_errors=True)
            run_ccslice(self, ["join", *(f"shares/{i + 1}" for i in range(count)), "-o", str(own)], cwd=folder)
            put_in_place(own, folder / "layers")
        for unfinished in (folder / "shares").glob(".*"):
            shutil.rmtree(unfinished, ignore_errors=True)  # Of workers that went, or were slower.
        return sum(layers)


def own_folder(task, folder, what):
    """Of this process of this worker, hidden until it is put in place."""
    return folder / f".{what}.{task.request.hostname}.{getattr(current_process(), 'index', 0)}"


def put_in_place(own, place):
    try:
        own.rename(place)
    except OSError:
        if not place.exists():
            raise
        shutil.rmtree(own, ignore_errors=True)  # Another worker was faster.


def send(name):
    """Puts the job into the queue; the ids of its tasks are known before, so that none is lost on the way."""
    job, folder = read_job(name), folder_of(name)
    job["tasks"] = [str(uuid.uuid4()) for _ in range(job["shares"])]
    job["join"] = str(uuid.uuid4())
    job["sent"], job["had"] = time.time(), sum(layers_of_shares(name, job["shares"]).values())
    (folder / "job.part").write_text(json.dumps(job, indent=1))
    (folder / "job.part").rename(folder / "job.json")
    for ended in ("cancelled", "failed"):
        (folder / ended).unlink(missing_ok=True)
    # 0 comes first in Redis, and last in RabbitMQ.
    options = {"priority": job["priority"] if OVER_REDIS else LAST_PRIORITY - job["priority"]}
    header = [slice_share.s(name, i + 1, job["shares"]).set(task_id=task, **options)
              for i, task in enumerate(job["tasks"])]
    try:
        chord(header)(join.s(name, job["shares"]).set(task_id=job["join"], **options))
    except Exception as error:
        sys.exit(f"farm: the job {name} stands in {folder}, but {places()} can't be reached ({error}): "
                 f"farm.py retry {name} sends it again")


def layers_of_shares(name, count):
    """{number: layers} of those that are whole."""
    return {number: layers_in(share_folder(name, number)) for number in range(1, count + 1)
            if share_folder(name, number).exists()}


def layers_of(mesh, options):
    """How many a job has. ccslice plan has no options for what is written, and knows nothing of --layers."""
    flags = {"--no-contact-sheet": 0, "--contours-by-cell-region": 0, "--contours": 1, "--split": 1, "--layers": 1}
    asked, wanted, rest = [], None, list(options)
    while rest:
        name, equals, value = rest.pop(0).partition("=")
        if name in OWN_OPTIONS:
            sys.exit(f"farm: {name} is what the farm gives itself, or nothing for it: leave it out")
        if name in WORKERS_OPTIONS:
            sys.exit(f"farm: {name} is for the worker's operator to say (CCSLICE_SERVER, ...): leave it out")
        if name not in flags:
            asked.append(name + equals + value)
            continue
        if flags[name] and not equals:
            value = rest.pop(0) if rest else sys.exit(f"farm: {name} needs a value")
        if name == "--layers":
            wanted = value
    if not CCSLICE:
        sys.exit("farm: there is no ccslice: put it into PATH, or name it in CCSLICE_FARM_PROGRAM")
    plan = subprocess.run([CCSLICE, "plan", f"./{mesh.name}", *asked, "--json"], capture_output=True, text=True,
                          cwd=mesh.parent)
    if plan.returncode:
        print(plan.stderr.strip(), file=sys.stderr)
        sys.exit(plan.returncode)
    layers = json.loads(plan.stdout)["layer_count"]
    if wanted is None:
        return layers
    parts = re.fullmatch(r"(\d+)(?:\.\.(\d+))?", wanted)
    first, last = (int(parts[1]), int(parts[2] or parts[1])) if parts else (1, 0)
    if not first <= last < layers:
        sys.exit(f"farm: --layers {wanted}: FIRST..LAST or one of the layers 0 to {layers - 1}")
    return last - first + 1


def submit(arguments):
    folder, source = folder_of(arguments.name), pathlib.Path(arguments.mesh)
    if not source.is_file():
        sys.exit(f"farm: {source} is no mesh file")
    if (folder / "job.json").exists():
        sys.exit(f"farm: there is a job {arguments.name} already: take another name, farm.py retry {arguments.name}, "
                 f"or farm.py remove {arguments.name}")
    if folder.exists():
        sys.exit(f"farm: {folder} is there, and no job: take another name, or farm.py remove {arguments.name}")
    making = FOLDER / f".{arguments.name}.{os.getpid()}"
    try:
        for part in ("mesh", "shares"):
            (making / part).mkdir(parents=True)
        mesh = shutil.copy(source, making / "mesh" / source.name)
        layers = layers_of(pathlib.Path(mesh), arguments.options)
        most = -(-layers // SLAB)
        if arguments.shares is not None and not 1 <= arguments.shares <= most:
            sys.exit(f"farm: --shares {arguments.shares}: {layers} layers make 1 to {most} shares, as they are cut at "
                     f"multiples of {SLAB}")
        shares = arguments.shares or min(-(-layers // LAYERS_OF_SHARE), MOST_SHARES)
        job = {"mesh": source.name, "options": arguments.options, "shares": shares, "layers": layers,
               "priority": arguments.priority, "tasks": [], "join": "", "sent": time.time(), "had": 0}
        (making / "job.json").write_text(json.dumps(job, indent=1))
        making.rename(folder)
    except OSError as error:
        sys.exit(f"farm: the job can't be put into {folder}: {error}")
    finally:
        shutil.rmtree(making, ignore_errors=True)
    send(arguments.name)
    print(f"{arguments.name}: {layers} layers in {shares} share{'s' * (shares > 1)}")


def state_of(name, job):
    """(state, layers done, words)."""
    folder = folder_of(name)
    if result_of(name).exists():
        return "done", job["layers"], ""
    done = layers_of_shares(name, job["shares"])
    layers = sum(done.values())
    if (folder / "cancelled").exists():
        return "cancelled", layers, ""
    if (folder / "failed").exists():
        return "failed", layers, (folder / "failed").read_text()
    if len(done) == job["shares"]:
        return "joining", layers, f"if this lasts, farm.py retry {name} joins it"
    again, states = "", set()
    for number, task in enumerate(job["tasks"], 1):
        if number in done:
            continue
        told = app.backend.get_task_meta(task)
        states.add(told["status"])
        if told["status"] == "PROGRESS" and isinstance(told["result"], dict):
            layers += told["result"].get("layers", 0)
        elif told["status"] == "RETRY":
            again = f"share {number} is tried again: {told['result']}"
    at_work = states & {"STARTED", "PROGRESS", "RETRY"}
    lost = "" if at_work else f"nobody is at it; if this lasts, farm.py retry {name} sends it again"
    return ("running" if layers or states & {"STARTED", "PROGRESS"} else "waiting"), layers, again or lost


def status_of(name):
    job = read_job(name)
    state, layers, words = state_of(name, job)
    end = result_of(name).stat().st_mtime if state == "done" else time.time()
    seconds = max(end - job["sent"], 0.1)
    speed = f" in {seconds:.0f} s" if state == "done" else ""
    if state == "running" and layers > job["had"]:
        rate = (layers - job["had"]) / seconds
        speed = f", {rate:.1f} a second, {(job['layers'] - layers) / rate:.0f} s left"
    return f"{name}: {state}, {layers} of {job['layers']} layers{speed}{words and ': ' + words}"


def status(arguments):
    names = sorted(p.parent.name for p in FOLDER.glob("*/job.json") if not p.parent.name.startswith("."))
    failed = False
    for name in [arguments.name] if arguments.name else names:
        try:
            print(status_of(name))
        except SystemExit as error:  # One that can't be read hides no other.
            print(error, file=sys.stderr)
            failed = True
    return failed


def refuse_done(name):
    if result_of(name).exists():
        sys.exit(f"farm: {name} is done: its layers are in {result_of(name).parent}")


def stop_tasks(name):
    job = read_job(name)
    (folder_of(name) / "cancelled").touch()  # For those that begin later.
    app.control.revoke([*job["tasks"], job["join"]], terminate=True, signal="SIGTERM")


def cancel(arguments):
    read_job(arguments.name)
    refuse_done(arguments.name)
    stop_tasks(arguments.name)
    print(f"{arguments.name}: cancelled")


def retry(arguments):
    read_job(arguments.name)
    refuse_done(arguments.name)
    send(arguments.name)
    print(f"{arguments.name}: sent again")


def remove(arguments):
    folder = folder_of(arguments.name)
    if not folder.is_dir():
        read_job(arguments.name)  # Says so.
    if not result_of(arguments.name).exists():
        with contextlib.suppress(SystemExit, OSError):  # A job that can't be read has no tasks that we know.
            stop_tasks(arguments.name)
    (folder / "job.json").unlink(missing_ok=True)  # Tasks that run on find no job.
    for _ in range(20):
        shutil.rmtree(folder, ignore_errors=True)
        if not folder.exists():
            print(f"{arguments.name}: removed")
            return
        time.sleep(0.25)  # Somebody writes there still.
    sys.exit(f"farm: {folder} can't be removed: is a worker still at it? Try again")


def main():
    # Who waits at a terminal is told soon.
    app.conf.task_publish_retry_policy = app.conf.result_backend_transport_options["retry_policy"] = {"max_retries": 2}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True, metavar="submit|status|cancel|retry|remove")
    one = commands.add_parser("submit", help="queue a job; the options of ccslice slice stand behind --")
    one.add_argument("name")
    one.add_argument("mesh")
    one.add_argument("--priority", type=int, default=5, choices=range(LAST_PRIORITY + 1), metavar="P",
                     help="0 comes first, 9 last; 5 unless given")
    one.add_argument("--shares", type=int, help="how many; one for 128 layers unless given, 64 at most")
    one.set_defaults(run=submit)
    for command, run, words in (("status", status, "layers done, rate, time left"), ("cancel", cancel, "stop a job"),
                                ("retry", retry, "send a job again; shares that are there stay"),
                                ("remove", remove, "stop a job and delete its folder, layers too")):
        one = commands.add_parser(command, help=words)
        one.add_argument("name", nargs="?" if command == "status" else None)
        one.set_defaults(run=run)
    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    arguments, unknown = parser.parse_known_args(words[:end])
    if unknown:
        parser.error(f"unrecognized arguments: {' '.join(unknown)}; the options of ccslice slice stand behind --")
    arguments.options = words[end + 1:]
    try:
        sys.exit(arguments.run(arguments))
    except (OperationalError, RedisError, ConnectionError) as error:
        sys.exit(f"farm: {places()} can't be reached ({error}): start it, or name it in CCSLICE_FARM_BROKER and "
                 "CCSLICE_FARM_RESULTS")


if __name__ == "__main__":
    main()
