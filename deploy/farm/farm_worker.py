# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""The farm's workers, on Celery (README.md).

A message of the queue is a ticket. It holds nothing: whoever gets it takes the share whose turn it is from the farm's
folder (farm_folder.py), slices it, joins the job if that was the last one, and tells who wants to know. Each of these
steps is found done when a ticket comes again, because its worker died."""

import ctypes
import datetime
import json
import os
import queue
import re
import shlex
import shutil
import signal
import subprocess
import sys
import urllib.request

import kombu.transport
from billiard import current_process
from celery import Celery
from celery.utils.log import get_task_logger
from celery.utils.time import maybe_iso8601
from celery.worker.consumer import Consumer, Gossip, Mingle
from kombu.asynchronous import get_event_loop
from kombu.exceptions import OperationalError
from kombu.transport import redis as kombu_redis
from kombu.utils.url import maybe_sanitize_url

import farm_folder as jobs
import farm_options



def stop(words):
    print(f"farm: {words}", file=sys.stderr)
    sys.exit(2)


VARIABLES = {f"CCSLICE_FARM_{name}" for name in ("FOLDER", "BROKER", "LONGEST_SHARE", "PROGRAM", "TELL")}
UNKNOWN = sorted({name for name in os.environ if name.startswith("CCSLICE_FARM_")} - VARIABLES)
if UNKNOWN:
    stop(f"there is no {', '.join(UNKNOWN)}; variables are {', '.join(sorted(VARIABLES))}")
BROKER = os.environ.get("CCSLICE_FARM_BROKER", "redis://localhost:6379/1")
OVER_REDIS = BROKER.startswith("redis")
LONGEST_SHARE = os.environ.get("CCSLICE_FARM_LONGEST_SHARE", "3600")
if not re.fullmatch("[1-9][0-9]{0,8}", LONGEST_SHARE):
    stop(f"CCSLICE_FARM_LONGEST_SHARE={LONGEST_SHARE}: seconds, for instance 3600")
LONGEST_SHARE_S = int(LONGEST_SHARE)
CCSLICE = shutil.which(os.environ.get("CCSLICE_FARM_PROGRAM", "ccslice"))
TELL = os.environ.get("CCSLICE_FARM_TELL", "")
TICKETS = "ccslice-tickets"
# Exit codes of ccslice's that another attempt may not meet: no server, interrupted, no room or another engine's layers
# in the folder, two engines.
PASSES, BEGUN_ANEW = (5, 6, 7, 8), (7, 8)
ATTEMPTS, PAUSE_S, TELL_S = 20, 5, 30
TRIES, LATEST_S = range(ATTEMPTS + 1), 24 * 3600  # Clocks may differ.
PATIENCE = {"max_retries": 3600, "interval_start": 1, "interval_step": 0, "interval_max": 1}
log = get_task_logger(__name__)


class _Messages(kombu_redis.QoS):
    def restore_visible(self, start=0, num=10, interval=10):
        """Looks for messages of lost workers at each tick of ten seconds, not at every tenth (kombu 5.2)."""
        return super().restore_visible(start, num, 1)


    def ack(self, delivery_tag):
        """Asks for the next message at once, not when the loop next wakes, up to a second later (kombu 5.2)."""
        super().ack(delivery_tag)
        loop = get_event_loop()
        if loop:
            loop.call_later(0.001, int)


class _Channel(kombu_redis.Channel):
    QoS = _Messages

    def _brpop_read(self, **options):
        """Leaves out what isn't a message, which would end the worker (kombu 5.2). It is out of the queue by now."""
        try:
            return super()._brpop_read(**options)
        except (queue.Empty, *self.connection_errors):
            raise
        except Exception as error:
            log.error("a message that isn't one is left out: %r", error)
            return False


class RedisTransport(kombu_redis.Transport):
    Channel = _Channel


class TicketConsumer(Consumer):
    def create_task_handler(self, *arguments, **options):
        """Takes of a message what a ticket has, and leaves out what isn't one, which would end or stop workers."""
        handle = super().create_task_handler(*arguments, **options)

        def guarded(message):
            try:
                message.headers, message.properties = ticket_of(message.headers), {}
                message.content_type, message.content_encoding, message.body = "application/json", "utf-8", NOTHING
            except (TypeError, KeyError, ValueError) as error:
                log.error("a message that isn't a ticket is left out: %r", error)
                return message.ack_log_error(log, self.connection_errors)
            return handle(message)
        return guarded


NOTHING = json.dumps([[], {}, dict.fromkeys(("callbacks", "errbacks", "chain", "chord"))]).encode()


def ticket_of(headers):
    """Celery's headers of a ticket: its id, and when somebody tries again for the how manieth time."""
    if headers["task"] != work.name or not jobs.TICKET.fullmatch(headers["id"]) or headers["retries"] not in TRIES:
        raise ValueError("its task, id or retries aren't a ticket's")
    if headers["eta"] is not None:
        ahead = maybe_iso8601(headers["eta"]) - datetime.datetime.now(datetime.timezone.utc)
        if ahead.total_seconds() > LATEST_S:
            raise ValueError("it is for the far future")
    nothing = dict.fromkeys(("expires", "group", "parent_id", "origin"))
    kept = {name: headers[name] for name in ("task", "id", "retries", "eta")}
    return {**nothing, **kept, "lang": "py", "root_id": headers["id"], "timelimit": [None, None], "argsrepr": "()",
            "kwargsrepr": "{}"}


kombu.transport.TRANSPORT_ALIASES.update(dict.fromkeys(("redis", "rediss"), f"{__name__}:RedisTransport"))
# Workers that look for each other stop taking tasks once Redis was away (celery/celery issue 8030). They needn't look.
Gossip.compatible_transports = Mingle.compatible_transports = frozenset()

app = Celery("farm", broker=BROKER)
app.conf.update(
    task_default_queue=TICKETS, task_ignore_result=True, worker_consumer=f"{__name__}:TicketConsumer",
    # A task is done when it is done: that of a worker that dies goes to another one.
    task_acks_late=True, task_reject_on_worker_lost=True, worker_prefetch_multiplier=1, worker_concurrency=1,
    # Redis notices a lost worker by this time; it has to be longer than the longest share. RabbitMQ notices at once, and
    # says of each message that it has it.
    broker_transport_options={"visibility_timeout": LONGEST_SHARE_S} if OVER_REDIS else {"confirm_publish": True},
    task_publish_retry_policy=PATIENCE,
    # What runs while the broker is away runs on. It is given out again, and found done.
    worker_cancel_long_running_tasks_on_connection_loss=False, broker_connection_max_retries=None)


class JobFailed(Exception):
    """With ccslice's own words."""


class Passing(Exception):
    """What another attempt may not meet."""


def place():
    return maybe_sanitize_url(BROKER)


def tickets_ready():
    """Tickets that nobody has yet."""
    with app.pool.acquire(block=True) as connection:
        connection.ensure_connection(max_retries=2, interval_start=0.2)
        try:
            with connection.channel() as channel:
                return channel.queue_declare(TICKETS, passive=True).message_count
        except connection.channel_errors:
            return 0  # There is no queue yet.
        except connection.connection_errors as error:
            connection.collapse()
            raise OperationalError(str(error)) from None


def send_tickets(count):
    with app.producer_pool.acquire(block=True) as producer:
        for _ in range(count):
            work.apply_async(producer=producer)


def die_with_worker():
    """A worker that is killed takes its ccslice along, which would write beside the next one's."""
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG of <linux/prctl.h>.


def run_ccslice(ticket, arguments, cwd):
    """Its exit code and its last words. Ends with the worker, or when the task is revoked."""
    if not CCSLICE:
        raise JobFailed("this worker has no ccslice: put it into PATH, or name it in CCSLICE_FARM_PROGRAM")
    process = subprocess.Popen([CCSLICE, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                               errors="replace", cwd=cwd, preexec_fn=die_with_worker)
    try:
        while True:
            try:
                _, said = process.communicate(timeout=1)
                break
            except subprocess.TimeoutExpired:
                jobs.touch(ticket)
    finally:
        if process.poll() is None:
            process.terminate()
            process.wait()
    return process.returncode, (said.strip().splitlines() or ["nothing was said"])[-1]


def require_success(code, words):
    if code in PASSES or code < 0:
        raise Passing(words)
    if code:
        raise JobFailed(f"exit code {code}: {words}")


def own_folder(task, folder, what):
    """Of this process of this worker, hidden until it is put in place."""
    return folder / f".{what}.{task.request.hostname}.{getattr(current_process(), 'index', 0)}"


def pin(job, own):
    """Has the job's layers be of the newest engine that a server had. Older ones are sliced again (finish)."""
    found, pinned = jobs.manifest_of(own)["engine_version"], job.engine()
    if jobs.engine_order(found) < jobs.engine_order(pinned):
        shutil.rmtree(own)
        raise Passing(f"the server has engine {found}, and layers of this job are of {pinned}: if all servers have "
                      f"{found} again, farm.py retry {job.name} slices them anew")
    if found != pinned:
        job.pin_engine(found)


def slice_share(task, ticket, job, number):
    """Into a folder of this process's, which becomes the share's once it is whole: two workers do no harm."""
    own = own_folder(task, job.folder / "shares", number)
    which = ["--share", f"{number}/{job.shares}"] if job.shares > 1 else []
    code, words = run_ccslice(ticket, ["slice", f"./{job.mesh_path().name}", *farm_options.check(job.options), *which,
                                       "--resume", "-o", str(own)], cwd=job.folder / "mesh")
    if code in BEGUN_ANEW:
        shutil.rmtree(own, ignore_errors=True)
    require_success(code, words)
    pin(job, own)
    jobs.put_in_place(own, job.place_of(number))


def join(task, ticket, job):
    own = own_folder(task, job.folder, "layers")
    shutil.rmtree(own, ignore_errors=True)
    require_success(*run_ccslice(ticket, ["join", *(f"shares/{i + 1}" for i in range(job.shares)), "-o", str(own)],
                                 cwd=job.folder))
    jobs.put_in_place(own, job.folder / "layers")


def finish(task, ticket, job):
    """Joins the job if all shares are there, and of one engine. Otherwise those of another one wait again."""
    if len(job.whole_shares()) < job.shares:
        return
    if not job.is_done():
        old = jobs.drop_shares_of_others(job)
        if old:
            jobs.enqueue(job, old)
            send_tickets(len(old))
            return
        join(task, ticket, job)
    for unfinished in (job.folder / "shares").glob(".*"):
        shutil.rmtree(unfinished, ignore_errors=True)  # Of workers that went, or were slower.


def tell(job):
    """Runs the command, or asks the address, of CCSLICE_FARM_TELL, once for each end of a job."""
    told = job.folder / "told"
    if not TELL or not job.has_ended() or told.exists():
        return
    state = jobs.state_of(job)
    if state["state"] == "cancelled":
        return
    words = json.dumps(state).encode()
    try:
        if re.match("https?://", TELL):
            request = urllib.request.Request(TELL, words, {"Content-Type": "application/json"})
            urllib.request.urlopen(request, timeout=TELL_S).close()
        else:
            subprocess.run([*shlex.split(TELL), job.name, state["state"]], input=words, stdout=subprocess.DEVNULL,
                           timeout=TELL_S, check=True, preexec_fn=die_with_worker)
    except (OSError, ValueError, subprocess.SubprocessError) as error:
        raise Passing(f"CCSLICE_FARM_TELL can't be told that {job.name} is {state['state']}: {error}") from None
    told.write_text(state["state"])


def do_share(task, ticket, job, number):
    if job.has_ended():
        return
    if not job.place_of(number).exists():
        slice_share(task, ticket, job, number)
    finish(task, ticket, job)


def do_taken(task, ticket, taken):
    """What passes is tried again, and the ticket keeps its share. What doesn't ends the job."""
    job = jobs.standing(taken)
    if not job:
        return
    try:
        try:
            do_share(task, ticket, job, taken["share"])
        except (JobFailed, ValueError, KeyError, TypeError, farm_options.OptionRefused) as error:
            end(job, taken, error)
        tell(job)
    except (Passing, OSError) as error:
        if not jobs.standing(taken):
            return  # Somebody has removed the job, or sent it again.
        log.warning("%s, share %d: %s", job.name, taken["share"], error)
        jobs.note(ticket, again=str(error)[:400])
        if task.request.retries < ATTEMPTS:
            raise task.retry(countdown=PAUSE_S, max_retries=ATTEMPTS) from None
        if not job.has_ended():
            end(job, taken, error)


def end(job, taken, error):
    log.error("%s, share %d: %s", job.name, taken["share"], error)
    jobs.fail(job, f"share {taken['share']}: {error}")


@app.task(bind=True, name="farm.work")
def work(self):
    """What a ticket is good for. Then, where things wait and the queue has no ticket, it has forgotten one."""
    ticket = self.request.id
    taken = jobs.take(ticket)
    if taken:
        do_taken(self, ticket, taken)
    jobs.release(ticket)
    try:
        if taken and jobs.anything_waits() and tickets_ready() == 0:
            send_tickets(1)
    except OperationalError as error:
        log.warning("%s can't be reached: %s", place(), error)  # It keeps its tickets.
