# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""A server that is killed every five seconds and then away for 0.2 to 4 s, while eight `ccslice slice` go on, each with
a job of its own. What they write, against what they write undisturbed, and when: the first layer after each return of
the server."""

import bisect
import hashlib
import random
import shutil
import statistics
import subprocess
import time

from ccsliced_process import Server
from load.part import Figure

# More layers than there is time for.
_PITCHES_MM = ["0.15,0.15,0.002", "0.18,0.18,0.002"]
# Not by blue noise, whose mask a new server makes first: that takes a second of its time, and these have a share of it.
_MATERIALS = ["--material", "soft=#101010", "--material", "hard=#f0f0f0", "--map", "blend:hardness:0=soft,1=hard",
              "--halftone", "error-diffusion"]
_PLANES = [["--occupancy"], ["--channel", "hardness"], ["--contours", "json"], _MATERIALS]
_JOBS = [["--pitch", pitch, *planes] for pitch in _PITCHES_MM for planes in _PLANES]
_EVERY_S = 5
_AWAY_S = 0.2, 4
_LEAST_S = 10
_LONGEST = 10  # Times as long as it should take.


class _Slicing:
    """`ccslice slice` with one of the jobs, or with its first layers."""

    def __init__(self, job, mesh, address, number, layers=None):
        self._folder = job.folder / f"job{number}"
        self._errors = job.folder / f"job{number}.log"
        some = ["--layers", f"0..{layers - 1}"] if layers else []
        with open(self._errors, "wb") as errors:
            self._process = subprocess.Popen(
                [job.build / "client/ccslice", "slice", mesh, "--server", address, *_JOBS[number], *some,
                 "--no-contact-sheet", "--quiet", "-o", self._folder], stdout=subprocess.DEVNULL, stderr=errors)

    def runs(self):
        return self._process.poll() is None

    def stop(self):
        self._process.terminate()

    def finish(self):
        """Why it failed, or nothing; its layers' files with their SHA-256; when they were written. Removes them."""
        failure = self._errors.read_text().strip() if self._process.wait() != 0 else ""
        files = sorted(self._folder.glob("layer_*"))
        digests = {path.name: hashlib.sha256(path.read_bytes()).digest() for path in files}
        arrivals = sorted(path.stat().st_mtime for path in files)
        shutil.rmtree(self._folder, ignore_errors=True)
        return failure, digests, arrivals


def _layer_of(name):
    return int(name.split("_")[1].split(".")[0])


def _undisturbed(job, mesh):
    """What half of the time is enough for, or ten seconds: the digests of each job's first layers."""
    with Server(job.ccsliced(), job.folder) as server:
        slicings = [_Slicing(job, mesh, server.address(), number) for number in range(len(_JOBS))]
        time.sleep(max(_LEAST_S, job.seconds / 2))
        for slicing in slicings:
            slicing.stop()
        ends = [slicing.finish() for slicing in slicings]
    found = [digests for _, digests, _ in ends]
    if not all(found):
        raise RuntimeError("; ".join(failure for failure, _, _ in ends))
    for digests in found:  # The last layer may not have all its files.
        last = max(map(_layer_of, digests))
        for name in [name for name in digests if _layer_of(name) == last]:
            del digests[name]
    return found


def _wait_for(slicings, seconds):
    """Whether they are done within this time."""
    end = time.monotonic() + seconds
    while any(slicing.runs() for slicing in slicings) and time.monotonic() < end:
        time.sleep(0.02)
    return not any(slicing.runs() for slicing in slicings)


def _kill_again_and_again(job, mesh, layers):
    """When the server came back, each time, and how each job ended."""
    returns, chance = [], random.Random(1)
    with Server(job.ccsliced(), job.folder) as server:
        slicings = [_Slicing(job, mesh, server.address(), number, count) for number, count in enumerate(layers)]
        end = time.monotonic() + _LONGEST * max(_LEAST_S, job.seconds)
        away_s = chance.uniform(*_AWAY_S)
        while not _wait_for(slicings, _EVERY_S - away_s) and time.monotonic() < end:
            server.kill_for(away_s)
            returns.append(time.time())
            away_s = chance.uniform(*_AWAY_S)
        for slicing in slicings:
            slicing.stop()
        return returns, [slicing.finish() for slicing in slicings]


def _waits_s(arrivals, returns):
    """From each return to the next layer, as long as there was one."""
    return [arrivals[at] - since for since in returns
            if (at := bisect.bisect_right(arrivals, since)) < len(arrivals)]


def _differing(digests, undisturbed):
    """How many files differ, are missing or are too many."""
    return sum(digests.get(name) != undisturbed.get(name) for name in digests.keys() | undisturbed.keys())


def measure(job):
    mesh = job.folder / "ring.ccmesh"
    subprocess.run([job.build / "client/ccslice", "models", "ring", "-o", mesh], check=True, stdout=subprocess.DEVNULL)
    undisturbed = _undisturbed(job, mesh)
    returns, ends = _kill_again_and_again(job, mesh, [1 + max(map(_layer_of, digests)) for digests in undisturbed])
    failures = [failure for failure, _, _ in ends if failure]
    for failure in sorted(set(failures)):
        print("  " + failure)
    differing = sum(_differing(digests, whole) for (_, digests, _), whole in zip(ends, undisturbed))
    waits_s = [wait_s for _, _, arrivals in ends for wait_s in _waits_s(arrivals, returns)]
    return [Figure("the server was killed", len(returns), "times", at_least=1),
            Figure("files of layers written meanwhile", sum(len(digests) for _, digests, _ in ends), ""),
            Figure("jobs that failed", len(failures), f"of {len(ends)}", at_most=0),
            Figure("files other than undisturbed", differing, "", at_most=0),
            Figure("from the server's return to a job's next layer, median", statistics.median(waits_s), "s",
                   at_most=0.5),
            Figure("from the server's return to a job's next layer, longest", max(waits_s), "s")]
