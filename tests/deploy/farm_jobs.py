# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What the farm promises of jobs: whose turn it is, which options and messages are taken, one engine, and who is told."""

import http.server
import itertools
import json
import os
import re
import subprocess
import sys
import threading
import time
import uuid

from farm_trial import FARM, Trial, write_samples
from waiting import wait_for

sys.path.append(str(FARM))

import farm_folder  # noqa: E402
import farm_options  # noqa: E402

JOB = ("--pitch", "0.2", "--channel", "hardness", "--encoding", "zstd")

# Says that servers have another engine than they have, as long as the file `engine` names one; writes down what it did.
TURNCOAT = """#!/bin/sh
echo "$@" >>"{folder}/calls"
if ! [ -e "{folder}/engine" ]; then exec "{program}" "$@"; fi
for last; do :; done
"{program}" "$@" || exit
if [ "$1" = slice ]; then
  sed -i "s/\\"engine_version\\": *\\"[0-9]*\\"/\\"engine_version\\": \\"$(cat "{folder}/engine")\\"/" "$last/manifest.json"
fi
"""


# Is told of a job.
TELLER = """#!/bin/sh
cat >"{folder}/told-$1-$2"
"""


def run(row, ccsliced, ccslice, folder, long):
    folder = folder / "jobs"
    folder.mkdir()
    _try_turns(row, folder / "turns")
    _try_options(row, ccslice)
    mesh = write_samples(ccslice, folder, ["ring"])["ring"]
    program = folder / "turncoat"
    program.write_text(TURNCOAT.format(program=ccslice, folder=folder))
    program.chmod(0o755)
    with _Listener() as listener:
        with Trial(ccsliced, ccslice, folder / "farm", servers=1, workers=1, timeout_s=20,
                   CCSLICE_FARM_PROGRAM=str(program), CCSLICE_FARM_TELL=listener.address) as trial:
            _try_forged_job(row, trial, mesh)
            _try_ends(row, trial, mesh, folder, listener)
            _try_engines(row, trial, mesh, folder)
            _try_forgetful_queue(row, trial, mesh)
    teller = folder / "teller"
    teller.write_text(TELLER.format(folder=folder))
    teller.chmod(0o755)
    for broker in ("redis", "rabbitmq") if long else ("redis",):
        with Trial(ccsliced, ccslice, folder / broker, broker, servers=1, workers=1, timeout_s=20,
                   CCSLICE_FARM_TELL=str(teller)) as trial:
            _try_messages(row, f"farm over {broker}", trial, mesh)
    told = json.loads((folder / "told-after-done").read_text())
    row("farm: a command is told", told["state"], told["name"] == "after" and told["layers_done"] == told["layers"])


def _in_folder(folder):
    """farm_folder.py of another folder."""
    for name, path in (("FOLDER", folder), ("QUEUE", folder / ".queue"), ("TAKEN", folder / ".taken"),
                       ("TURNS", folder / ".turns")):
        setattr(farm_folder, name, path)


def _send(name, shares, customer, priority=5):
    job = farm_folder.Job(name, "mesh.ccmesh", [], shares, 16 * shares, customer, priority)
    (job.folder / "mesh").mkdir(parents=True)
    (job.folder / "shares").mkdir()
    farm_folder.send(job)
    return job


def _try_turns(row, folder):
    """Which shares are taken, one after the other, of what waits in a folder without any workers."""
    _in_folder(folder)
    for number in range(3):
        _send(f"a{number}", 2, "ann")
    _send("long", 6, "ann")
    for number in range(2):
        _send(f"b{number}", 1, "bob")
    _send("urgent", 1, "cem", priority=0)

    def take():
        task = farm_folder.take(str(uuid.uuid4()))
        time.sleep(0.005)  # Turns are told apart by the time of a file.
        return task and f"{task['job']}/{task['share']}"

    taken = [take() for _ in range(16)]
    wanted = ["urgent/1", "a0/1", "a0/2", "b0/1", "a1/1", "a1/2", "b1/1", "a2/1", "a2/2", "long/1", "long/2", "long/3",
              "long/4", "long/5", "long/6", None]
    row("farm: turns of two customers", " ".join(map(str, taken[:7])), taken == wanted)
    job = _send("twice", 2, "ann")
    ticket = str(uuid.uuid4())
    again = [farm_folder.take(ticket)["share"] for _ in range(2)]
    farm_folder.dequeue(job.name)
    row("farm: a ticket that comes again", f"shares {again}", again == [1, 1] and not farm_folder.anything_waits())
    threads, found = [], []
    _send("many", 64, "ann")
    for _ in range(8):
        threads.append(threading.Thread(target=lambda: found.extend(iter(take, None))))
        threads[-1].start()
    for thread in threads:
        thread.join()
    row("farm: eight takers at once", f"{len(found)} shares taken, {len(set(found))} of them once",
        len(found) == len(set(found)) == 64)


def _try_options(row, ccslice):
    """Each option that `ccslice slice` has is taken or refused by its name, with a value or without."""
    shown = subprocess.run([ccslice, "slice", "--help"], check=True, capture_output=True, text=True).stdout
    found = {}
    for names, kind in re.findall(r"^  (-\S+)(?: +([A-Z]+)\b)?", shown, re.MULTILINE):
        found.update({re.sub(r"\{.*", "", name): kind in ("TEXT", "FLOAT", "UINT", "INT") for name in names.split(",")})
    unlisted = [name for name in found if not {name, farm_options.SHORT.get(name)} & {*farm_options.KNOWN,
                                                                                    *farm_options.REFUSED}]
    wrong = [name for name, value in farm_options.KNOWN.items() if found.get(name) != value]
    row("farm: options of ccslice slice", f"{len(found)} known, not listed {unlisted}, wrongly {wrong}",
        len(found) > 60 and not unlisted and not wrong)
    right = farm_options.parse(["--pitch", "1", "-q", "--translate", "-1,0,0", "--fit", "sha256:" + "0" * 64])
    odd = (["--server", "x:1"], ["--server=x:1"], ["--token-file=/etc/passwd"], ["--job", "j"], ["-h1"], ["-h"], ["-qo/x"],
           ["--sharp-file=x"], ["--grade", "a=file:/etc/passwd"], ["--allow-includes=/"], ["--max-file-bytes", "9"],
           ["/etc/passwd"], ["--pitch"], ["--pich", "1"], [""], ["--"], ["-"], ["--material", "--server", "x:1"],
           ["sha256:0/../x"], ["--local"], ["--no-local"])
    refused = []
    for words in odd:
        try:
            farm_options.parse(words)
        except farm_options.OptionRefused:
            refused.append(words)
    row("farm: options that aren't a job's", f"{len(refused)} of {len(odd)} refused",
        len(refused) == len(odd) and right[:3] == ["--pitch=1", "--quiet", "--translate=-1,0,0"])


def _forge(trial, name, **changed):
    """Changes a job that waits, as anybody can who may write to the folder."""
    path = trial.jobs / name / "job.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **changed}))


def _try_forged_job(row, trial, mesh):
    """What nobody could submit isn't done either where it stands in the folder."""
    trial.workers[0].stop()
    forged = {"server": {"options": ["--pitch=1", "--server=elsewhere:1"]}, "file": {"options": ["/etc/passwd"]},
              "value": {"options": ["--pitch"]}, "above": {"mesh": "../../../etc/passwd"}, "words": {"options": [7]},
              "count": {"shares": 10 ** 9}, "nothing": {"layers": None}, "linked": {}}
    for name, changed in forged.items():
        trial.submit(name, mesh, "--pitch", "1", shares=1)
        _forge(trial, name, **changed)
    linked = trial.jobs / "linked/mesh" / mesh.name
    linked.unlink()
    linked.symlink_to("/etc/passwd")
    (trial.jobs / ".queue/5,0,nobody,odd").mkdir()
    (trial.jobs / ".queue/0,0,nobody,file").touch()
    for name in ("007", "\u0663", "x", "-1"):
        (trial.jobs / ".queue/5,0,nobody,odd" / name).touch()
    for name, text in (("1", "rubbish"), ("2", json.dumps({"job": "../x", "share": 1, "id": ""})), ("3", "[]")):
        (trial.jobs / ".queue/5,0,nobody,odd" / name).write_text(text)
    trial.submit("after", mesh, "--pitch", "1", shares=1)
    trial.workers[0].restart()
    trial.must_end("after")
    calls = (trial.folder.parent / "calls").read_text()
    bad = [name for name in forged if (trial.jobs / name / "layers").exists()]
    row("farm: forged jobs", f"{len(forged) - len(bad)} of {len(forged)} not done",
        not bad and "elsewhere" not in calls and "slice ../" not in calls and "slice /etc" not in calls)
    for name in forged:
        trial.farm("remove", name)


class _Listener:
    """Who is told of jobs, by POST. Has no time at first."""

    def __init__(self):
        told = self.told = []

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                words = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
                self.send_response(200 if told else 503)
                self.end_headers()
                told.append((words["name"], words["state"]))

            def log_message(self, *_):
                pass

        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.address = f"http://127.0.0.1:{self._server.server_port}/jobs"

    def __enter__(self):
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *_):
        self._server.shutdown()


def _try_ends(row, trial, mesh, folder, listener):
    """wait, status --json, prune, and who is told."""
    listener.told.clear()
    trial.submit("good", mesh, *JOB, shares=1)
    trial.submit("bad", mesh, "--pitch", "1", "--contours", "of no kind", shares=1)
    codes = {"good": trial.farm("wait", "good", "--timeout", "60").returncode,
             "bad": trial.farm("wait", "bad", "--timeout", "60").returncode,
             "none": trial.farm("wait", "none").returncode, "wrong": trial.farm("wait").returncode,
             "variable": subprocess.run([FARM / "farm.py", "status"], capture_output=True,
                                        env={**trial.environment, "CCSLICE_FARM_BROKR": "x"}).returncode}
    joins = [line for line in (folder / "calls").read_text().splitlines() if line.startswith("join")]
    row("farm: a job of one share", f"{len(joins)} joins", not joins and trial.is_as_single("good", mesh, *JOB))
    wait_for(lambda: ("bad", "failed") in listener.told[1:] and ("good", "done") in listener.told[1:], 30)
    once = sorted(listener.told[1:])
    row("farm: who is told of ends", f"{listener.told}", once == [("bad", "failed"), ("good", "done")])
    trial.workers[0].stop()
    trial.submit("queued", mesh, *JOB, shares=2)
    codes["queued"] = trial.farm("wait", "queued", "--timeout", "0.1").returncode
    states = {one["name"]: one for one in json.loads(trial.farm("status", "--json").stdout)}
    row("farm: status --json", str({name: one["state"] for name, one in states.items()}),
        states["good"]["state"] == "done" and states["good"]["engine_version"] and states["bad"]["message"]
        and states["queued"]["state"] == "waiting" and states["queued"]["shares_waiting"] == 2)
    row("farm: a job that is merely queued", trial.state("queued"), "retry" not in trial.state("queued"))
    trial.farm("cancel", "queued")
    codes["cancelled"] = trial.farm("wait", "queued").returncode
    row("farm: exit codes of wait", str(codes), codes == {"good": 0, "bad": 9, "none": 3, "wrong": 2, "variable": 2,
                                                         "queued": 10, "cancelled": 9})
    day_ago = time.time() - 86400
    os.utime(trial.jobs / "good/layers/manifest.json", (day_ago, day_ago))
    done = trial.farm("prune", "--older", "23h")
    left = sorted(path.name for path in trial.jobs.iterdir() if not path.name.startswith("."))
    row("farm: prune", done.stdout.strip(), done.returncode == 0 and left == ["after", "bad", "queued"])
    trial.workers[0].restart()


def _try_engines(row, trial, mesh, folder):
    """A server of another engine slices two of a job's shares."""
    whole = trial.jobs / "spans/shares"
    (folder / "engine").write_text("1")
    trial.workers[0].stop()
    trial.submit("spans", mesh, *JOB, shares=3)
    (trial.jobs / "spans/engine").write_text("1")  # As that server would have planned it.
    trial.workers[0].restart()
    wait_for(lambda: (whole / "1").exists(), 30)
    (folder / "engine").unlink()
    trial.must_end("spans")
    calls = (folder / "calls").read_text().splitlines()
    again = sum("--share 1/3" in line and "/spans/" in line for line in calls)
    row("farm: the engine changes amid a job", f"share 1 sliced {again} times", again == 2
        and trial.is_as_single("spans", mesh, *JOB))
    (folder / "engine").write_text("1")  # A server that was forgotten.
    trial.submit("older", mesh, *JOB, shares=1)
    wait_for(lambda: "tried again" in trial.state("older"), 30)
    state = trial.state("older")
    (folder / "engine").unlink()
    trial.must_end("older")
    row("farm: a server of an older engine", state.split(": ")[-1][:60], "has engine 1, and layers of this job" in state
        and trial.is_as_single("older", mesh, *JOB))


def _try_forgetful_queue(row, trial, mesh):
    trial.workers[0].stop()
    trial.submit("forgotten", mesh, *JOB, shares=2)
    trial.broker.command("FLUSHALL")
    state = trial.state("forgotten")
    trial.submit("next", mesh, *JOB, shares=1)  # Brings all tickets back.
    trial.workers[0].restart()
    trial.must_end("forgotten")
    row("farm: the queue forgets a job", state.split(": ")[-1], "has forgotten it: farm.py retry forgotten" in state
        and trial.is_as_single("forgotten", mesh, *JOB))


def _odd_messages():
    """(headers, body) that are almost a ticket's."""
    ticket = {"lang": "py", "task": "farm.work", "id": str(uuid.uuid4()), "retries": 0, "eta": None, "expires": None,
              "group": None, "timelimit": [None, None], "root_id": "x", "parent_id": None, "argsrepr": "()",
              "kwargsrepr": "{}"}
    body = b'[[], {}, {"callbacks": null, "errbacks": null, "chain": null, "chord": null}]'
    for odd in (b"", b"rubbish", b"7", b"[]", b'{"a": 1}', b'[["a"], {"b": 1}, {}]', b"[" * 100000, b"\xff\x00",
                b'[[], {}, {"callbacks": [7], "errbacks": 7, "chain": [{"task": "farm.work"}], "chord": "x"}]'):
        yield ticket, odd
    for name, value in itertools.product(("task", "id", "retries", "eta", "timelimit", "expires"),
                                         ("../../x", "", 7, -1, None, ["x"], {"x": 1}, "2999-01-01T00:00:00+00:00")):
        yield {**ticket, name: value}, body
    for gone in ticket:
        yield {name: value for name, value in ticket.items() if name != gone}, body
    yield {}, b""


def _try_messages(row, label, trial, mesh):
    """The same worker goes on, and nothing but tickets is done."""
    count = 0
    for headers, body in _odd_messages():
        trial.broker.put(headers, body)
        count += 1
    for odd in (b"rubbish", b"", b"{}", b"[]", b"7", b'{"properties": 7}', b"[" * 100000, b"\xff"):
        trial.broker.put_bytes(odd)
        count += 1
    trial.submit("after", mesh, "--pitch", "1", shares=1)
    trial.must_end("after")
    gone = wait_for(lambda: trial.broker.left() == 0, 30)
    row(f"{label}: {count} odd messages", "the worker goes on" if trial.workers[0].process.poll() is None else "it ended",
        trial.workers[0].process.poll() is None and gone and not list((trial.jobs / ".taken").iterdir()))
