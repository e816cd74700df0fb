# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Eight `ccslice slice`, each with a job of its own, while servers come and go: what they write, and when."""

import bisect
import hashlib
import shutil
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
LEAST_S = 10


class Slicing:
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


def layer_of(name):
    return int(name.split("_")[1].split(".")[0])


def undisturbed(job, mesh):
    """What half of the time is enough for, or ten seconds: the digests of each job's first layers."""
    with Server(job.ccsliced(), job.folder) as server:
        slicings = [Slicing(job, mesh, server.address(), number) for number in range(len(_JOBS))]
        time.sleep(max(LEAST_S, job.seconds / 2))
        for slicing in slicings:
            slicing.stop()
        ends = [slicing.finish() for slicing in slicings]
    found = [digests for _, digests, _ in ends]
    if not all(found):
        raise RuntimeError("; ".join(failure for failure, _, _ in ends))
    for digests in found:  # The last layer may not have all its files.
        last = max(map(layer_of, digests))
        for name in [name for name in digests if layer_of(name) == last]:
            del digests[name]
    return found


def wait_for(slicings, seconds):
    """Whether they are done within this time."""
    end = time.monotonic() + seconds
    while any(slicing.runs() for slicing in slicings) and time.monotonic() < end:
        time.sleep(0.02)
    return not any(slicing.runs() for slicing in slicings)


def waits_s(arrivals, returns):
    """From each return to the next layer, as long as there was one."""
    return [arrivals[at] - since for since in returns
            if (at := bisect.bisect_right(arrivals, since)) < len(arrivals)]


def differing(digests, whole):
    """How many files differ, are missing or are too many."""
    return sum(digests.get(name) != whole.get(name) for name in digests.keys() | whole.keys())


def sample(job):
    mesh = job.folder / "ring.ccmesh"
    if mesh.exists():
        return mesh
    subprocess.run([job.build / "client/ccslice", "models", "ring", "-o", mesh], check=True, stdout=subprocess.DEVNULL)
    return mesh


def figures(ends, wholes):
    """What came of the jobs, against what comes of them undisturbed."""
    failures = [failure for failure, _, _ in ends if failure]
    for failure in sorted(set(failures)):
        print("  " + failure)
    others = sum(differing(digests, whole) for (_, digests, _), whole in zip(ends, wholes))
    return [Figure("files of layers written meanwhile", sum(len(digests) for _, digests, _ in ends), ""),
            Figure("jobs that failed", len(failures), f"of {len(ends)}", at_most=0),
            Figure("files other than undisturbed", others, "", at_most=0)]
