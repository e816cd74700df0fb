# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Two customers' small jobs, all of which wait before a worker begins, and jobs under kills of workers.

With --long there are 200 jobs of two shares and ten jobs under kills, and bars of time, for a machine that does nothing
else."""

import statistics
import subprocess
import time

from farm_trial import FARM, PYTHON, Trial, write_samples
from waiting import wait_for

SMALL = ("--pitch", "0.3", "--channel", "hardness", "--encoding", "zstd")
LONGER = ("--pitch", "0.1", "--all-channels", "--encoding", "zstd")


def run(row, ccsliced, ccslice, folder, long):
    folder = folder / "turns"
    folder.mkdir()
    mesh = write_samples(ccslice, folder, ["ring"])["ring"]
    with Trial(ccsliced, ccslice, folder / "farm", workers=2, timeout_s=60) as trial:
        _try_customers(row, trial, mesh, 100 if long else 4, long)
    with Trial(ccsliced, ccslice, folder / "kills", workers=3, timeout_s=10) as trial:
        _try_kills(row, trial, mesh, 10 if long else 2)


# Submits jobs, the name and the customer of each one on a line, and sends their tickets once all wait: workers are up by
# then. Prints when.
LOAD = """
import argparse, sys, time
import farm, farm_worker
send, farm_worker.send_tickets = farm_worker.send_tickets, lambda count: None
mesh, *options = sys.argv[1:]
for line in sys.stdin:
    name, customer = line.split()
    farm.submit(argparse.Namespace(name=name, customer=customer, mesh=mesh, options=options, shares=2, priority=5))
print(time.time())
send(farm.jobs.count_waiting())
"""


def _load(trial, mesh, jobs):
    """When the jobs' tickets were sent."""
    done = subprocess.run([PYTHON, "-B", "-c", LOAD, mesh, *SMALL], env=trial.environment, cwd=FARM, text=True,
                          input="".join(f"{name} {customer}\n" for name, customer in jobs), capture_output=True)
    if done.returncode:
        raise RuntimeError(done.stderr)
    return float(done.stdout.split()[-1])


def _durations(trial, begin, names, seconds):
    """{job: seconds from then on until it was done}."""
    ends = {name: trial.jobs / name / "layers/manifest.json" for name in names}
    if not wait_for(lambda: time.sleep(0.2) or all(end.exists() for end in ends.values()), seconds):
        raise RuntimeError(trial.farm("status").stdout[-2000:] + trial.log.read_text()[-2000:])
    return {name: end.stat().st_mtime - begin for name, end in ends.items()}


def _try_customers(row, trial, mesh, count, bars):
    alone_s = []
    for number in range(4):  # Servers have the mesh after the first one.
        begin = _load(trial, mesh, [(f"alone-{number}", "cem")])
        alone_s += _durations(trial, begin, [f"alone-{number}"], 120).values()
    alone_s = statistics.median(alone_s[1:])
    jobs = [(f"{customer}-{number}", customer) for customer in ("ann", "bob") for number in range(count)]
    seconds = _durations(trial, _load(trial, mesh, jobs), [name for name, _ in jobs], 20 * count)
    first, whole = min(seconds.values()), max(seconds.values())
    medians = [statistics.median(taken for name, taken in seconds.items() if name.startswith(customer))
               for customer in ("ann", "bob")]
    ratio = max(medians) / min(medians)
    row(f"turns: the first of {2 * count} small jobs", f"{first:.2f} s, alone {alone_s:.2f} s; all {whole:.1f} s",
        first <= 1.5 * alone_s if bars else first < whole / 2)
    row("turns: both customers' medians", f"{medians[0]:.1f} s and {medians[1]:.1f} s: {ratio:.2f}",
        ratio <= (1.3 if bars else 2))
    right = [trial.is_as_single(name, mesh, *SMALL) for name in ("ann-0", f"bob-{count - 1}")]
    row("turns: jobs like single runs", f"{sum(right)} of {len(right)}", all(right))


def _try_kills(row, trial, mesh, count):
    names = [f"job-{number}" for number in range(count)]
    begin = time.monotonic()
    for name in names:
        trial.submit(name, mesh, *LONGER, shares=3, customer=f"customer-{name[-1]}")
    kills = 0
    while not trial.wait_for(names, "done", 2):
        if time.monotonic() - begin > 120 * count:
            raise RuntimeError(trial.farm("status").stdout + trial.log.read_text()[-2000:])
        worker = trial.workers[kills % len(trial.workers)]
        worker.kill()
        worker.restart()
        kills += 1
        time.sleep(4)
    right = [trial.is_as_single(name, mesh, *LONGER) for name in names]
    row(f"kills: {count} jobs", f"{sum(right)} like single runs after {kills} kills", all(right) and kills > 0)
