# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""The farm's folder, which all programs of the farm see: jobs, and which share is whose turn.

    NAME/job.json              mesh, options, customer, number of shares, id of the sending that counts
    NAME/mesh/FILE
    NAME/engine                the engine version that all layers have to be of
    NAME/shares/I              a share that is whole; its worker makes it in a hidden folder beside it
    NAME/layers                the result
    NAME/failed, cancelled     ends the job
    NAME/told                  the end that somebody was told of
    .queue/P,TIME,CUSTOMER,NAME/I     a share that waits
    .taken/TICKET              a share that somebody is at
    .turns/CUSTOMER            when the customer last had a turn

Taking a share is a rename from .queue to .taken, so one taker gets it. A ticket is a message of the queue; whoever gets
it after a worker died finds the share under .taken and goes on with it."""

import contextlib
import dataclasses
import functools
import json
import os
import pathlib
import re
import shutil
import time
import uuid

FOLDER = pathlib.Path(os.environ.get("CCSLICE_FARM_FOLDER", "farm-jobs")).absolute()
QUEUE, TAKEN, TURNS = FOLDER / ".queue", FOLDER / ".taken", FOLDER / ".turns"
NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")
NUMBER = re.compile("[1-9][0-9]?")
TICKET = re.compile(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}")
LAST_PRIORITY, MOST_SHARES = 9, 64
TURN = 4  # Shares of one job, after which the next customer has a turn.
TAKEN_BYTES = 1024  # Of a file in .taken from the start: what is written to it later finds room on a full disk.
SILENT_S = 60  # Workers touch their file every second.


class Refused(Exception):
    """Says what is wrong and what to do. `code`: the program's exit code."""

    def __init__(self, words, code):
        super().__init__(words)
        self.code = code


@dataclasses.dataclass
class Job:
    """What job.json holds."""
    name: str
    mesh: str
    options: list
    shares: int
    layers: int
    customer: str
    priority: int
    id: str = ""  # Of the sending that counts.
    sent: float = 0.0
    had: int = 0  # Layers that were there when it was sent.

    def __post_init__(self):
        right = (all(isinstance(getattr(self, field.name), field.type) for field in dataclasses.fields(self))
                 and NAME.fullmatch(self.name) and NAME.fullmatch(self.customer) and 1 <= self.shares <= MOST_SHARES
                 and 0 <= self.priority <= LAST_PRIORITY and all(isinstance(word, str) for word in self.options)
                 and self.mesh and self.mesh == pathlib.PurePath(self.mesh).name)
        if not right:
            raise ValueError("this isn't what farm.py writes")

    @property
    def folder(self):
        return FOLDER / self.name

    def place_of(self, number):
        """A job of one share has no other place than its result."""
        return self.folder / "shares" / str(number) if self.shares > 1 else self.folder / "layers"

    def mesh_path(self):
        """The mesh, unless a link leads elsewhere."""
        path = self.folder / "mesh" / self.mesh
        if path.resolve() != FOLDER.resolve() / self.name / "mesh" / self.mesh:
            raise ValueError(f"{path} is a link to elsewhere")
        return path

    def is_done(self):
        return (self.folder / "layers" / "manifest.json").exists()

    def has_ended(self):
        return self.is_done() or any((self.folder / end).exists() for end in ("failed", "cancelled"))

    def whole_shares(self):
        return [number for number in range(1, self.shares + 1) if self.place_of(number).exists()]

    def engine(self):
        """The version that all shares have to be of; "" where any will do."""
        try:
            return (self.folder / "engine").read_text()
        except FileNotFoundError:
            return ""

    def pin_engine(self, version):
        replace(self.folder / "engine", version)


def engine_order(version):
    return [int(number) for number in re.findall(r"\d+", version)]


def replace(path, text):
    """All of it or nothing, for readers and writers alike."""
    new = path.with_name(f".{path.name}.{uuid.uuid4()}")
    new.write_text(text)
    new.rename(path)


def folder_of(name):
    if not NAME.fullmatch(name):
        raise Refused(f"{name!r} can't be a name: take letters, digits, dots, hyphens and underscores", 2)
    return FOLDER / name


def read_job(name):
    path = folder_of(name) / "job.json"
    try:
        return Job(name=name, **json.loads(path.read_text()))
    except FileNotFoundError:
        raise Refused(f"there is no job {name} in {FOLDER} (CCSLICE_FARM_FOLDER); farm.py status lists them", 3) from None
    except (OSError, ValueError, TypeError) as error:
        raise Refused(f"{path} can't be read ({error}): farm.py remove {name}, and submit it again", 3) from None


def write_job(job, folder=None):
    fields = dataclasses.asdict(job)
    del fields["name"]
    replace((folder or job.folder) / "job.json", json.dumps(fields, indent=1))


def job_names():
    return sorted(path.parent.name for path in FOLDER.glob("*/job.json") if NAME.fullmatch(path.parent.name))


def manifest_of(folder):
    return json.loads((folder / "manifest.json").read_text())


def layers_in(folder):
    """Of a share or a job that is whole."""
    return len(manifest_of(folder)["layers"])


def layers_under_way(job):
    """Of shares that aren't whole yet: a worker's journal has a line for each layer, below a first one."""
    most = {}
    for journal in job.folder.glob("shares/.*/journal.jsonl"):
        number = journal.parent.name.split(".")[1]
        with contextlib.suppress(OSError, ValueError):
            int(number)
            most[number] = max(most.get(number, 0), journal.read_text().count("\n") - 1)
    return sum(layers for number, layers in most.items() if not job.place_of(number).exists())


# The queue.


def enqueue(job, numbers):
    """Has these shares wait. All of them are there at once, for those who look."""
    making = QUEUE / f".{uuid.uuid4()}"
    making.mkdir(parents=True)
    for number in numbers:
        task = json.dumps({"job": job.name, "id": job.id, "share": number})
        (making / str(number)).write_text(task.ljust(TAKEN_BYTES))
    entry = QUEUE / f"{job.priority},{job.sent:017.6f},{job.customer},{job.name}"
    try:
        making.rename(entry)
    except OSError:  # Some of the job's shares wait already.
        for number in numbers:
            (making / str(number)).replace(entry / str(number))
        making.rmdir()


def dequeue(name):
    """Nobody takes this job's shares any more."""
    for entry in QUEUE.glob(f"*,{name}"):
        with contextlib.suppress(OSError):
            gone = entry.rename(QUEUE / f".{uuid.uuid4()}")
            shutil.rmtree(gone, ignore_errors=True)


def waiting_of(entry):
    """Numbers of shares that wait, of one job."""
    with contextlib.suppress(OSError):
        return sorted(int(one) for one in os.listdir(entry) if NUMBER.fullmatch(one))
    return []


def last_turn(customer):
    try:
        return (TURNS / customer).stat().st_mtime_ns
    except OSError:
        return 0


def jobs_in_turn():
    """Folders of waiting jobs: by priority, then the customer whose last turn was first, then as they were sent."""
    found, turn_of = [], functools.cache(last_turn)
    with contextlib.suppress(FileNotFoundError):
        for entry in os.listdir(QUEUE):
            parts = entry.split(",")
            if len(parts) == 4 and NAME.fullmatch(parts[2]):
                found.append((parts[0], turn_of(parts[2]), parts[2], parts[1], QUEUE / entry))
    return [(entry, customer) for _, _, customer, _, entry in sorted(found)]


def anything_waits():
    return any(waiting_of(entry) for entry, _ in jobs_in_turn())


def count_waiting():
    return sum(len(waiting_of(entry)) for entry, _ in jobs_in_turn())


def end_turn(customer):
    with contextlib.suppress(OSError):  # A full disk: somebody has two turns.
        TURNS.mkdir(exist_ok=True)
        (TURNS / customer).touch()


def _take_next(ticket):
    for entry, customer in jobs_in_turn():
        numbers = waiting_of(entry)
        if not numbers:
            with contextlib.suppress(OSError):
                entry.rmdir()
            continue
        TAKEN.mkdir(exist_ok=True)
        (entry / str(numbers[0])).rename(TAKEN / ticket)
        if len(numbers) == 1 or numbers[0] % TURN == 0:
            end_turn(customer)
        return


def take(ticket):
    """The ticket's share, which is the next one that waits unless it had one; None if nothing waits."""
    while not (TAKEN / ticket).exists():
        try:
            _take_next(ticket)
            break
        except FileNotFoundError:
            continue  # Another one was faster.
    return task_of(TAKEN / ticket)


def task_of(path):
    """What a file under .taken says, and how long ago its worker was at it. None if it is gone or nonsense."""
    try:
        task = json.loads(path.read_text())
        right = isinstance(task["job"], str) and NAME.fullmatch(task["job"]) and isinstance(task["share"], int)
        return {**task, "silent_s": time.time() - path.stat().st_mtime} if right else None
    except (OSError, ValueError, TypeError, KeyError):
        return None


def taken_of(job):
    """{ticket: task} of the job's shares that somebody is at."""
    tasks = {path.name: task_of(path) for path in TAKEN.glob("*")}
    return {ticket: task for ticket, task in tasks.items()
            if task and task["job"] == job.name and task.get("id") == job.id}


def anybody_works():
    """Whoever ends a share sees to it that the next one isn't forgotten."""
    return any(task["silent_s"] <= SILENT_S for task in map(task_of, TAKEN.glob("*")) if task)


def note(ticket, **more):
    """Adds to what the ticket's file says, in its place."""
    with contextlib.suppress(OSError, ValueError), open(TAKEN / ticket, "r+b", buffering=0) as file:
        words = json.dumps({**json.loads(file.read()), **more}).encode()
        file.seek(0)
        file.write(words.ljust(TAKEN_BYTES))


def touch(ticket):
    with contextlib.suppress(OSError):
        os.utime(TAKEN / ticket)


def release(ticket):
    (TAKEN / ticket).unlink(missing_ok=True)


def standing(task):
    """The job, or None where it doesn't want this share: it is another job of that name, or was sent again since."""
    try:
        job = read_job(task["job"])
    except Refused:
        return None
    return job if job.id == task.get("id") and 1 <= task["share"] <= job.shares else None


# What a job does.


def send(job):
    """Has all waits that a job lacks. What an earlier sending left does nothing any more."""
    dequeue(job.name)
    for ticket in taken_of(job):
        release(ticket)
    whole = job.whole_shares()
    job.id, job.sent = str(uuid.uuid4()), time.time()
    job.had = sum(layers_in(job.place_of(number)) for number in whole)
    for end in ("cancelled", "failed", "told"):
        (job.folder / end).unlink(missing_ok=True)
    write_job(job)
    # Whoever finds his share whole looks whether all are.
    enqueue(job, [number for number in range(1, job.shares + 1) if number not in whole] or [job.shares])


def drop_shares_of_others(job):
    """Numbers of shares of another engine than the job's, which are gone then."""
    pinned, dropped = job.engine(), []
    for number in job.whole_shares():
        place = job.place_of(number)
        if manifest_of(place)["engine_version"] == pinned:
            continue
        aside = place.with_name(f".old.{uuid.uuid4()}")
        with contextlib.suppress(OSError):
            place.rename(aside)
            if manifest_of(aside)["engine_version"] == pinned:
                aside.rename(place)  # Somebody has put a new one there meanwhile.
                continue
            shutil.rmtree(aside, ignore_errors=True)
        dropped.append(number)
    return dropped


def fail(job, words):
    with contextlib.suppress(OSError):
        (job.folder / "failed").write_text(words)
    dequeue(job.name)


def put_in_place(own, place):
    try:
        own.rename(place)
    except OSError:
        if not place.exists():
            raise
        shutil.rmtree(own, ignore_errors=True)  # Another worker was faster.


def state_of(job, ready=None):
    """What status --json has of a job. `ready`: tickets in the queue, where somebody knows."""
    whole = job.whole_shares()
    taken = taken_of(job)
    waiting = [number for entry in QUEUE.glob(f"*,{job.name}") for number in waiting_of(entry)]
    layers = job.layers if job.is_done() else sum(layers_in(job.place_of(number)) for number in whole)
    state, words = "waiting", ""
    if job.is_done():
        state = "done"
    elif (job.folder / "cancelled").exists():
        state = "cancelled"
    elif (job.folder / "failed").exists():
        state, words = "failed", (job.folder / "failed").read_text()
    else:
        layers += layers_under_way(job)
        if len(whole) == job.shares:
            state = "joining"
        elif taken or layers:
            state = "running"
        words = _words_of(job, taken, waiting, ready)
    end = next(((job.folder / one).stat().st_mtime for one in ("layers/manifest.json", "failed", "cancelled")
                if state in ("done", "failed", "cancelled") and (job.folder / one).exists()), time.time())
    seconds = max(end - job.sent, 0.1)
    rate = (layers - job.had) / seconds
    return {"name": job.name, "customer": job.customer, "priority": job.priority, "state": state, "message": words,
            "layers": job.layers, "layers_done": layers, "shares": job.shares, "shares_done": len(whole),
            "shares_taken": len(taken), "shares_waiting": len(waiting), "engine_version": job.engine(),
            "sent": job.sent, "seconds": round(seconds, 3), "layers_a_second": round(rate, 3),
            "seconds_left": round((job.layers - layers) / rate, 1) if state == "running" and rate > 0 else None,
            "folder": str(job.folder / "layers") if state == "done" else None}


def _words_of(job, taken, waiting, ready):
    """What is odd about a job that hasn't ended."""
    again = [f"share {task['share']} is tried again: {task['again']}" for task in taken.values() if task.get("again")]
    silent = [f"nothing was heard of share {task['share']} for {task['silent_s']:.0f} s"
              for task in taken.values() if task["silent_s"] > SILENT_S]
    if not taken and not waiting and not job.has_ended():
        return f"nobody is at it: farm.py retry {job.name} sends it again"
    if waiting and ready == 0 and not anybody_works():
        return f"the queue has forgotten it: farm.py retry {job.name} sends it again"
    return "; ".join(again + silent)
