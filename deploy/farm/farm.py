#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""A print farm's queue of slicing jobs, on Celery (README.md).

    farm.py submit NAME MESH [--priority P] [--shares N] -- OPTIONS OF ccslice slice
    farm.py status [NAME]
    farm.py cancel NAME
    farm.py retry NAME
    python3 -m celery -A farm worker      # in this folder: a worker

A job is a chord: share I of N is a task that any worker does, and one more task joins the shares. All programs see one
folder, CCSLICE_FARM_FOLDER, with a folder for each job: job.json, the mesh, shares/I, and layers, which is the result.
CCSLICE_FARM_BROKER and CCSLICE_FARM_RESULTS say where Celery keeps its queue and its results."""

import argparse
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

from celery import Celery, chord
from celery.backends.redis import RedisBackend
from celery.result import AsyncResult
from celery.worker.consumer import Gossip, Mingle
from kombu.transport import redis as kombu_redis
from kombu.utils.url import maybe_sanitize_url

FOLDER = pathlib.Path(os.environ.get("CCSLICE_FARM_FOLDER", "farm-jobs")).absolute()
BROKER = os.environ.get("CCSLICE_FARM_BROKER", "redis://localhost:6379/1")
OVER_REDIS = BROKER.startswith("redis")
RESULTS = os.environ.get("CCSLICE_FARM_RESULTS", BROKER if OVER_REDIS else "redis://localhost:6379/1")
LONGEST_SHARE_S = int(os.environ.get("CCSLICE_FARM_LONGEST_SHARE", "3600"))
CCSLICE = shutil.which(os.environ.get("CCSLICE_FARM_PROGRAM", "ccslice"))
LAYERS_OF_SHARE, MOST_SHARES, SLAB = 128, 64, 16
PASSES = (5, 6, 7)  # Exit codes of ccslice's that another attempt may not meet: no server, interrupted, no room.
ATTEMPTS, PAUSE_S = 20, 5
LAST_PRIORITY = 9


class PatientResults(RedisBackend):
    """Waits where results are away. Celery's own (5.2) takes the task for failed, and the job with it."""

    def get(self, key):
        return self.ensure(super().get, (key,))

    def on_chord_part_return(self, *arguments, **options):
        return self.ensure(functools.partial(super().on_chord_part_return, **options), arguments)


PATIENCE = {"max_retries": LONGEST_SHARE_S, "interval_start": 1, "interval_step": 0, "interval_max": 1}
app = Celery("farm", broker=BROKER, backend=RESULTS)
app.loader.override_backends = {scheme: f"{__name__}:PatientResults" for scheme in ("redis", "rediss")}
app.conf.update(
    # A task is done when it is done: that of a worker that dies goes to another one.
    task_acks_late=True, task_reject_on_worker_lost=True, worker_prefetch_multiplier=1,
    # Redis notices a lost worker by this time; it has to be longer than the longest share. RabbitMQ notices at once; it
    # says of each message that it has it, and knows priorities of queues that were made for them.
    broker_transport_options={"visibility_timeout": LONGEST_SHARE_S, "queue_order_strategy": "priority"} if OVER_REDIS
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


def folder_of(name):
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}", name):
        sys.exit(f"farm: {name!r} can't be a job's name: take letters, digits, dots, hyphens and underscores")
    return FOLDER / name


def result_of(name):
    return folder_of(name) / "layers" / "manifest.json"


def read_job(name):
    path = folder_of(name) / "job.json"
    if not path.exists():
        sys.exit(f"farm: there is no job {name} in {FOLDER} (CCSLICE_FARM_FOLDER); farm.py status lists them")
    return json.loads(path.read_text())


def die_with_worker():
    """A worker that is killed takes its ccslice along, which would write beside the next one's."""
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG of <linux/prctl.h>.


def layers_in(share):
    return json.loads((share / "manifest.json").read_text())["share"]["layers"]


def run_ccslice(task, arguments, watched=None):
    """Runs ccslice and tells how many layers are there. Ends with the worker, or when the task is revoked."""
    if not CCSLICE:
        raise JobFailed("this worker has no ccslice: put it into PATH, or name it in CCSLICE_FARM_PROGRAM")
    process = subprocess.Popen([CCSLICE, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                               preexec_fn=die_with_worker)
    try:
        while True:
            try:
                _, said = process.communicate(timeout=1)
                break
            except subprocess.TimeoutExpired:
                if watched:
                    journal = watched / "journal.jsonl"
                    layers = journal.read_text().count("\n") - 1 if journal.exists() else 0
                    task.update_state(state="PROGRESS", meta={"layers": max(layers, 0)})
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


@app.task(bind=True)
def slice_share(self, name, number, count):
    """Into a folder of this worker's, which becomes the share's once it is whole: two workers do no harm."""
    folder = FOLDER / name
    job = json.loads((folder / "job.json").read_text())
    share = folder / "shares" / str(number)
    if not share.exists():
        own = folder / "shares" / f".{number}.{self.request.hostname}"
        run_ccslice(self, ["slice", str(folder / job["mesh"]), *job["options"], "--share", f"{number}/{count}",
                           "--resume", "-o", str(own)], watched=own)
        try:
            own.rename(share)
        except OSError:
            if not share.exists():
                raise
            shutil.rmtree(own, ignore_errors=True)  # Another worker was faster.
    return layers_in(share)


@app.task(bind=True)
def join(self, layers, name, count):
    folder = FOLDER / name
    if not result_of(name).exists():
        shutil.rmtree(folder / "layers", ignore_errors=True)
        run_ccslice(self, ["join", *(str(folder / "shares" / str(i + 1)) for i in range(count)),
                           "-o", str(folder / "layers")])
    for unfinished in (folder / "shares").glob(".*"):
        shutil.rmtree(unfinished, ignore_errors=True)  # Of workers that went, or were slower.
    return sum(layers)


def send(name, job):
    """Puts the job into the queue; the ids of its tasks are known before, so that none is lost on the way."""
    job["tasks"] = [str(uuid.uuid4()) for _ in range(job["shares"])]
    job["join"] = str(uuid.uuid4())
    job["sent"] = time.time()
    path = folder_of(name) / "job.json"
    path.with_suffix(".part").write_text(json.dumps(job, indent=1))
    path.with_suffix(".part").rename(path)
    # 0 comes first in Redis, and last in RabbitMQ.
    options = {"priority": job["priority"] if OVER_REDIS else LAST_PRIORITY - job["priority"]}
    header = [slice_share.s(name, i + 1, job["shares"]).set(task_id=task, **options)
              for i, task in enumerate(job["tasks"])]
    try:
        chord(header)(join.s(name, job["shares"]).set(task_id=job["join"], **options))
    except Exception as error:
        places = " or ".join(dict.fromkeys(maybe_sanitize_url(url) for url in (BROKER, RESULTS)))
        sys.exit(f"farm: the job {name} stands in {folder_of(name)}, but {places} can't be reached ({error}): "
                 f"farm.py retry {name} sends it again")


def layers_of(mesh, options):
    """How many a job has. ccslice plan has no options for what is written, and knows nothing of --layers."""
    flags = {"--no-contact-sheet": 0, "--contours-by-region": 0, "--contours": 1, "--split": 1, "--layers": 1}
    asked, layers, rest = [], None, list(options)
    while rest:
        name, equals, value = rest.pop(0).partition("=")
        if name in ("-o", "--output", "--share", "--resume", "--force", "--json"):
            sys.exit(f"farm: {name} is what the farm gives itself: leave it out")
        if name not in flags:
            asked.append(name + equals + value)
            continue
        if flags[name] and not equals:
            value = rest.pop(0) if rest else sys.exit(f"farm: {name} needs a value")
        if name == "--layers" and re.fullmatch(r"\d+(\.\.\d+)?", value):
            first, _, last = value.partition("..")
            layers = int(last or first) - int(first) + 1
    if not CCSLICE:
        sys.exit("farm: there is no ccslice: put it into PATH, or name it in CCSLICE_FARM_PROGRAM")
    plan = subprocess.run([CCSLICE, "plan", str(mesh), *asked, "--json"], capture_output=True, text=True)
    if plan.returncode:
        print(plan.stderr.strip(), file=sys.stderr)
        sys.exit(plan.returncode)
    return layers or json.loads(plan.stdout)["layer_count"]


def submit(arguments):
    folder = folder_of(arguments.name)
    mesh = pathlib.Path(arguments.mesh)
    if not mesh.is_file():
        sys.exit(f"farm: {mesh} is no mesh file")
    if folder.exists():
        sys.exit(f"farm: there is a job {arguments.name} already: take another name, or farm.py retry {arguments.name}")
    layers = layers_of(mesh, arguments.options)
    most = -(-layers // SLAB)
    if arguments.shares and not 1 <= arguments.shares <= most:
        sys.exit(f"farm: --shares {arguments.shares}: {layers} layers make 1 to {most} shares, as they are cut at "
                 f"multiples of {SLAB}")
    folder.mkdir(parents=True)
    (folder / "shares").mkdir()
    shutil.copy(mesh, folder / mesh.name)
    shares = arguments.shares or min(-(-layers // LAYERS_OF_SHARE), MOST_SHARES)
    send(arguments.name, {"mesh": mesh.name, "options": arguments.options, "shares": shares, "layers": layers,
                          "priority": arguments.priority})
    print(f"{arguments.name}: {layers} layers in {shares} share{'s' * (shares > 1)}")


def state_of(name):
    """(state, layers done, words)."""
    job = read_job(name)
    if result_of(name).exists():
        return "done", job["layers"], ""
    results = [AsyncResult(task, app=app) for task in job["tasks"]]
    layers, words, again, states = 0, "", "", []
    for number, result in enumerate(results):
        state, info = result.state, result.info
        states.append(state)
        if (folder_of(name) / "shares" / str(number + 1)).exists():
            states[-1] = "SUCCESS"
            layers += layers_in(folder_of(name) / "shares" / str(number + 1))
        elif state == "PROGRESS":
            layers += info["layers"]
        elif state == "FAILURE":
            words = f"share {number + 1}: {info}"
        elif state == "RETRY":
            again = f"share {number + 1} is tried again: {info}"
    joined = AsyncResult(job["join"], app=app)
    if "REVOKED" in states:
        return "cancelled", layers, ""
    if words:
        return "failed", layers, words
    if joined.state == "FAILURE":
        return "failed", layers, str(joined.info)
    if all(state == "SUCCESS" for state in states):
        return "joining", layers, "" if joined.state != "PENDING" else "if this lasts, farm.py retry joins it"
    return ("running" if layers or "STARTED" in states else "waiting"), layers, again


def status(arguments):
    names = [arguments.name] if arguments.name else sorted(p.parent.name for p in FOLDER.glob("*/job.json"))
    for name in names:
        job, (state, layers, words) = read_job(name), state_of(name)
        end = result_of(name).stat().st_mtime if state == "done" else time.time()
        seconds = max(end - job["sent"], 0.1)
        speed = f" in {seconds:.0f} s" if state == "done" else ""
        if state == "running" and layers:
            rate = layers / seconds
            speed = f", {rate:.1f} a second, {(job['layers'] - layers) / rate:.0f} s left"
        print(f"{name}: {state}, {layers} of {job['layers']} layers{speed}{words and ': ' + words}")


def refuse_done(name):
    if state_of(name)[0] == "done":
        sys.exit(f"farm: {name} is done: its layers are in {result_of(name).parent}")


def cancel(arguments):
    job = read_job(arguments.name)
    refuse_done(arguments.name)
    app.control.revoke([*job["tasks"], job["join"]], terminate=True, signal="SIGTERM")
    for task in [*job["tasks"], job["join"]]:
        if AsyncResult(task, app=app).state not in ("SUCCESS", "FAILURE"):
            app.backend.mark_as_revoked(task, "cancelled")
    print(f"{arguments.name}: cancelled")


def retry(arguments):
    job = read_job(arguments.name)
    refuse_done(arguments.name)
    send(arguments.name, job)
    print(f"{arguments.name}: sent again")


def main():
    # Who waits at a terminal is told soon.
    app.conf.task_publish_retry_policy = app.conf.result_backend_transport_options["retry_policy"] = {"max_retries": 2}
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True, metavar="submit|status|cancel|retry")
    one = commands.add_parser("submit", help="queue a job; the options of ccslice slice stand behind --")
    one.add_argument("name")
    one.add_argument("mesh")
    one.add_argument("--priority", type=int, default=5, choices=range(LAST_PRIORITY + 1), metavar="P",
                     help="0 comes first, 9 last; 5 unless given")
    one.add_argument("--shares", type=int, help="how many; one for 128 layers unless given, 64 at most")
    one.set_defaults(run=submit)
    for command, run, words in (("status", status, "layers done, rate, time left"), ("cancel", cancel, "stop a job"),
                                ("retry", retry, "send a job again; shares that are there stay")):
        one = commands.add_parser(command, help=words)
        one.add_argument("name", nargs="?" if command == "status" else None)
        one.set_defaults(run=run)
    words = sys.argv[1:]
    end = words.index("--") if "--" in words else len(words)
    arguments = parser.parse_args(words[:end])
    arguments.options = words[end + 1:]
    arguments.run(arguments)


if __name__ == "__main__":
    main()
