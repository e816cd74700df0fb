# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What goes wrong at a farm, one thing after the other."""

import contextlib
import os
import shutil
import subprocess
import time

from farm_trial import Trial, write_samples

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
        for what, disturb in (("the broker goes amid shares, and is back after 3 s", _lose_broker),
                              ("the results forget how many shares are done", _lose_counter),
                              ("the mesh file is gone", _lose_mesh),
                              ("a worker is killed once its share is named", _kill_after_move),
                              ("a worker's clock is a day ahead", _join_from_tomorrow)):
            name = disturb.__name__.strip("_")
            words = disturb(trial, name, mesh)
            row(f"farm: {what}", words or "like a single run", words or trial.is_as_single(name, mesh, *JOB))
    _try_killer(row, ccsliced, ccslice, folder, mesh)
    _try_full_disk(row, ccsliced, ccslice, folder, mesh)


def _try_submitting(row, trial, mesh):
    """What is wrong is told at once, and nothing of it stays."""
    asks = {"a/b": ("a/b", mesh), "a name": ("a name", mesh), "no such file": ("gone", "gone.ccmesh"),
            "an unknown option": ("unknown", mesh, "--", "--pich", "1"),
            "an option of the farm's": ("own", mesh, "--", "--share", "1/2"),
            "more shares than layers make": ("many", mesh, "--shares", "500", "--", "--pitch", "1"),
            "no such priority": ("eager", mesh, "--priority", "10", "--", "--pitch", "1")}
    said = {what: trial.farm("submit", *words) for what, words in asks.items()}
    wrong = [what for what, done in said.items()
             if done.returncode == 0 or not done.stderr or "Traceback" in done.stderr]
    row("farm: wrong jobs", f"{len(said) - len(wrong)} of {len(said)} refused", not wrong and not trial.jobs.exists())
    trial.submit("twice", mesh, "--pitch", "1", shares=1)
    trial.must_end("twice")
    again = trial.farm("submit", "twice", mesh, "--", "--pitch", "1")
    row("farm: two jobs of one name", again.stderr.strip()[:60], again.returncode != 0 and "already" in again.stderr)
    trial.broker.kill()
    away = trial.farm("submit", "later", mesh, "--", "--pitch", "1")
    trial.broker.start()
    sent = trial.farm("retry", "later")
    trial.must_end("later")
    row("farm: the broker is away", away.stderr.strip()[-60:],
        away.returncode != 0 and "retry later" in away.stderr and sent.returncode == 0)


def _lose_broker(trial, name, mesh):
    trial.submit(name, mesh, *JOB)
    trial.wait_for([name], "running", 20)
    trial.broker.kill()
    time.sleep(3)  # Shares end meanwhile, and can't be acknowledged.
    trial.broker.start()
    trial.must_end(name)


def _lose_counter(trial, name, mesh):
    trial.submit(name, mesh, *JOB)
    trial.wait_for([name], "running", 20)
    end = time.monotonic() + 60
    while not all(trial.share(name, number).exists() for number in range(1, 5)) and time.monotonic() < end:
        for key in trial.results.command("KEYS", "celery-taskset-meta-*").split():
            trial.results.command("DEL", key)
        time.sleep(0.02)
    if not trial.wait_for([name], "joining", 10) or "retry joins it" not in trial.state(name):
        return f"should be joining: {trial.state(name)}"
    trial.farm("retry", name)
    trial.must_end(name)


def _lose_mesh(trial, name, mesh):
    trial.workers[0].stop()
    trial.submit(name, mesh, *JOB)
    (trial.jobs / name / mesh.name).rename(trial.folder / "mesh")
    trial.workers[0].restart()
    if not trial.wait_for([name], "failed", 30) or mesh.name not in trial.state(name):
        return f"should have failed: {trial.state(name)}"
    shutil.copy(trial.folder / "mesh", trial.jobs / name / mesh.name)
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
