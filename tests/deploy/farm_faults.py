# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What goes wrong at a farm, one thing after the other."""

import contextlib
import os
import shutil
import subprocess
import time

from farm_trial import Trial, write_samples
from waiting import wait_for

JOB = ("--pitch", "0.12", "--all-channels", "--encoding", "zstd")
SMALL_JOB = ("--pitch", "0.3", "--channel", "hardness", "--encoding", "zstd")
DAY_S = 24 * 3600

# Slices, and then kills what started it, before the share gets its name: the task's process at the first share, the
# whole worker at the second.
KILLER = """#!/bin/sh
"{program}" "$@" || exit
case "$*" in
  *"--share 1/"*) mark="{folder}/task.killed" victim=$PPID ;;
  *"--share 2/"*) mark="{folder}/worker.killed" victim=-$(ps -o pgid= $$ | tr -d ' ') ;;
  *) exit 0 ;;
esac
if [ -e "$mark" ]; then exit 0; fi
: >"$mark"
kill -s KILL -- "$victim"
"""


def run(row, ccsliced, ccslice, folder):
    folder = folder / "faults"
    folder.mkdir()
    mesh = write_samples(ccslice, folder, ["ring"])["ring"]
    with Trial(ccsliced, ccslice, folder / "farm", workers=1, timeout_s=4) as trial:
        _try_submitting(row, trial, mesh)
        for what, disturb in (("the broker goes amid a share, which ends meanwhile", _lose_broker),
                              ("the mesh file is gone", _lose_mesh),
                              ("a worker is killed once its share is named", _kill_after_move),
                              ("a worker's clock is a day ahead", _join_from_tomorrow)):
            name = disturb.__name__.strip("_")
            words = disturb(trial, name, mesh)
            row(f"farm: {what}", words or "like a single run", not words and trial.is_as_single(name, mesh, *JOB))
        _try_ends(row, trial, mesh)
    _try_joins(row, ccsliced, ccslice, folder, mesh)
    _try_killer(row, ccsliced, ccslice, folder, mesh)
    _try_full_disk(row, ccsliced, ccslice, folder, mesh)


def _try_submitting(row, trial, mesh):
    """What is wrong is told at once, and nothing of it stays."""
    asks = {"a/b": ("a/b", mesh), "a name": ("a name", mesh), "no such file": ("gone", "gone.ccmesh"),
            "an unknown option": ("unknown", mesh, "--", "--pich", "1"),
            "an option of the farm's": ("own", mesh, "--", "--share", "1/2"),
            "a server of its own": ("server", mesh, "--", "--pitch", "1", "--server=elsewhere:50051"),
            "more shares than layers make": ("many", mesh, "--shares", "500", "--", "--pitch", "1"),
            "no shares": ("none", mesh, "--shares", "0", "--", "--pitch", "1"),
            "layers beyond the last": ("beyond", mesh, "--", "--pitch", "1", "--layers", "5000..6000"),
            "a customer of no name": ("odd", mesh, "--customer", "../x", "--", "--pitch", "1"),
            "layers that go down": ("down", mesh, "--", "--pitch", "1", "--layers", "9..1"),
            "a file that a worker wouldn't find": ("file", mesh, "--", "--pitch", "1", "--grade", "a=file:v.txt"),
            "help": ("help", mesh, "--", "--help"),
            "no such priority": ("eager", mesh, "--priority", "10", "--", "--pitch", "1")}
    said = {what: trial.farm("submit", *words) for what, words in asks.items()}
    wrong = [what for what, done in said.items()
             if done.returncode == 0 or not done.stderr or "Traceback" in done.stderr]
    left = list(trial.jobs.iterdir()) if trial.jobs.exists() else []
    row("farm: wrong jobs", f"{len(said) - len(wrong)} of {len(said)} refused", not wrong and not left)
    odd = trial.folder / "job.json"
    shutil.copy(mesh, odd)
    trial.submit("odd", odd, "--pitch", "1", shares=1)
    trial.must_end("odd")
    row("farm: a mesh of the farm's own names", "sliced", trial.is_as_single("odd", mesh, "--pitch", "1"))
    trial.submit("twice", mesh, "--pitch", "1", shares=1)
    trial.must_end("twice")
    again = trial.farm("submit", "twice", mesh, "--", "--pitch", "1")
    row("farm: two jobs of one name", again.stderr.strip()[:60], again.returncode != 0 and "already" in again.stderr)
    trial.broker.kill()
    away = trial.farm("submit", "later", mesh, "--", "--pitch", "1")
    unknown = trial.farm("status", "later")
    trial.broker.start()
    sent = trial.farm("retry", "later")
    trial.must_end("later")
    row("farm: the broker is away", away.stderr.strip()[-60:],
        away.returncode != 0 and "retry later" in away.stderr and sent.returncode == 0
        and unknown.returncode != 0 and "can't be reached" in unknown.stderr and "Traceback" not in unknown.stderr)


def whole_shares(trial, name):
    return sum(trial.share(name, number).exists() for number in range(1, 5))


def _try_ends(row, trial, mesh):
    """What is cancelled, sent again or removed, while nobody works; then somebody does."""
    trial.workers[0].stop()
    for name in ("cancelled", "twice-cancelled", "sent-twice", "removed"):
        trial.submit(name, mesh, *SMALL_JOB, shares=2)
    trial.farm("cancel", "cancelled")
    trial.farm("retry", "twice-cancelled")
    trial.farm("cancel", "twice-cancelled")
    trial.farm("retry", "sent-twice")
    trial.farm("remove", "removed")
    trial.submit("removed", mesh, *SMALL_JOB, shares=1)  # Another job of that name.
    (trial.jobs / "damaged").mkdir()
    (trial.jobs / "damaged" / "job.json").write_text("{")
    trial.workers[0].restart()
    for name in ("sent-twice", "removed"):
        trial.must_end(name)
    wait_for(lambda: trial.broker.left() == 0, 20)
    states = {name: trial.state(name).split(",")[0].split(": ")[1] for name in ("cancelled", "twice-cancelled")}
    row("farm: cancelled before anybody began", str(set(states.values())), set(states.values()) == {"cancelled"}
        and not any(list((trial.jobs / name / "shares").iterdir()) for name in states))
    row("farm: sent twice; removed and submitted anew", "like a single run",
        all(trial.is_as_single(name, mesh, *SMALL_JOB) for name in ("sent-twice", "removed")))
    all_states = trial.farm("status")
    row("farm: a damaged job hides no other", all_states.stderr.strip()[:60],
        all_states.returncode == 3 and "remove damaged" in all_states.stderr and "removed: done" in all_states.stdout)
    again = trial.farm("retry", "removed")
    row("farm: what is done", again.stderr.strip()[:60], again.returncode == 7 and "is done" in again.stderr)
    gone = trial.farm("remove", "damaged")
    row("farm: remove", gone.stdout.strip(), gone.returncode == 0 and not (trial.jobs / "damaged").exists())


# Joins slowly, so that another may come into its way.
SLOW_JOIN = """#!/bin/sh
if [ "$1" = join ]; then sleep 3; fi
exec "{program}" "$@"
"""


def _try_joins(row, ccsliced, ccslice, folder, mesh):
    slow = folder / "slow"
    slow.write_text(SLOW_JOIN.format(program=ccslice))
    slow.chmod(0o755)
    with Trial(ccsliced, ccslice, folder / "joins", workers=2, CCSLICE_FARM_PROGRAM=str(slow)) as trial:
        trial.submit("joins", mesh, *SMALL_JOB, shares=2)
        trial.wait_for(["joins"], "joining", 30)
        trial.farm("retry", "joins")
        trial.must_end("joins")
        row("farm: two joins at once", "like a single run", trial.is_as_single("joins", mesh, *SMALL_JOB))
        trial.submit("given-up", mesh, *SMALL_JOB, shares=2)
        trial.wait_for(["given-up"], "joining", 30)
        trial.farm("cancel", "given-up")
        time.sleep(5)
        state = trial.state("given-up").split(",")[0]
        row("farm: cancelled while it is joined", state, state == "given-up: cancelled")


def _lose_broker(trial, name, mesh):
    trial.submit(name, mesh, *JOB)
    wait_for(lambda: trial.runs(f"{name}/shares/"), 20)
    before = whole_shares(trial, name)
    trial.broker.kill()
    ended = wait_for(lambda: whole_shares(trial, name) > before, 20)  # It can't be acknowledged.
    time.sleep(3)
    trial.broker.start()
    trial.must_end(name)
    return None if ended else "no share ended while the broker was away"


def _lose_mesh(trial, name, mesh):
    trial.workers[0].stop()
    trial.submit(name, mesh, *JOB)
    (trial.jobs / name / "mesh" / mesh.name).rename(trial.folder / "mesh")
    trial.workers[0].restart()
    if not trial.wait_for([name], "failed", 30) or mesh.name not in trial.state(name):
        return f"should have failed: {trial.state(name)}"
    shutil.copy(trial.folder / "mesh", trial.jobs / name / "mesh" / mesh.name)
    trial.farm("retry", name)
    trial.must_end(name)


def _kill_after_move(trial, name, mesh):
    trial.submit(name, mesh, *JOB)
    while not trial.share(name, 1).exists():
        time.sleep(0.001)
    trial.workers[0].kill()
    trial.workers[0].restart()
    trial.must_end(name)


def _join_from_tomorrow(trial, name, mesh):
    """That worker takes all others for lost, and does their shares again."""
    trial.submit(name, mesh, *JOB)
    trial.wait_for([name], "running", 20)
    worker = trial.add_worker(ahead_s=DAY_S)
    trial.must_end(name)
    worker.stop()


def _try_killer(row, ccsliced, ccslice, folder, mesh):
    killer = folder / "killer"
    killer.write_text(KILLER.format(program=ccslice, folder=folder))
    killer.chmod(0o755)
    with Trial(ccsliced, ccslice, folder / "killed", workers=1, timeout_s=4, CCSLICE_FARM_PROGRAM=str(killer)) as trial:
        trial.submit("killed", mesh, *JOB)
        end = time.monotonic() + 120
        while not trial.wait_for(["killed"], "done", 1) and time.monotonic() < end:
            if trial.workers[0].process.poll() is not None:
                trial.workers[0].restart()
        trial.must_end("killed")
        marks = len(list(folder.glob("*.killed")))
        row("farm: killed before a share is named", f"{marks} kills",
            marks == 2 and trial.is_as_single("killed", mesh, *JOB))


@contextlib.contextmanager
def _small_disk(folder, size):
    folder.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "none", folder], check=True, capture_output=True)
    try:
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", folder], check=True)


def _try_full_disk(row, ccsliced, ccslice, folder, mesh):
    """Full when the shares begin; somebody makes room."""
    if os.geteuid() != 0:
        row("farm: a full disk", "not tried: only root makes a small one", True)
        return
    with _small_disk(folder / "disk", "8m") as disk, \
            Trial(ccsliced, ccslice, folder / "full", workers=1, CCSLICE_FARM_FOLDER=str(disk / "jobs")) as trial:
        trial.jobs = disk / "jobs"
        trial.submit("full", mesh, *SMALL_JOB)
        with open(disk / "ballast", "wb", buffering=0) as ballast, contextlib.suppress(OSError):
            while True:
                ballast.write(b"0" * 4096)
        time.sleep(8)
        state = trial.state("full")
        (disk / "ballast").unlink()
        trial.must_end("full")
        row("farm: a full disk", state.split("tried again: ")[-1][:60],
            "is tried again" in state and "No space left" in state and trial.is_as_single("full", mesh, *SMALL_JOB))
