# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Three servers with one mesh store, one of which is killed every five seconds and comes back, while eight
`ccslice slice` go on with all of them. And two servers of one thread each against one of them: `slice --split 2`."""

import pathlib
import statistics
import subprocess
import time

from ccsliced_process import Server
from load.part import Figure
from load.slicing import LEAST_S, Slicing, figures, layer_of, sample, undisturbed, wait_for, waits_s

_EVERY_S = 5
_AWAY_S = 1
_LONGEST = 10  # Times as long as it should take.
_SPLIT_JOB = ["--pitch", "0.1,0.1,0.05", "--all-channels", "--encoding", "zstd", "--no-contact-sheet", "--quiet"]
_SPLIT_ROUNDS = 3


def _start(job, name, *options):
    folder = job.folder / name
    folder.mkdir()
    return Server(job.ccsliced(), folder, *options)


def _kill_in_turn(job, mesh, layers):
    """When each server was killed, how each job ended, and how many uploads there were."""
    kills, uploads = [], 0
    servers = [_start(job, f"server{i}", "--mesh-store", f"dir:{job.folder / 'store'}") for i in range(3)]
    try:
        addresses = ",".join(server.address() for server in servers)
        slicings = [Slicing(job, mesh, addresses, number, count) for number, count in enumerate(layers)]
        end = time.monotonic() + _LONGEST * max(LEAST_S, job.seconds)
        while not wait_for(slicings, _EVERY_S - _AWAY_S) and time.monotonic() < end:
            server = servers[len(kills) % len(servers)]
            uploads += _uploads_of(job, len(kills) % len(servers))
            kills.append(time.time())
            server.kill_for(_AWAY_S)
        for slicing in slicings:
            slicing.stop()
        ends = [slicing.finish() for slicing in slicings]
        return kills, ends, uploads + sum(_uploads_of(job, i) for i in range(len(servers)))
    finally:
        for server in servers:
            server.kill()


def _uploads_of(job, number):
    """Since the server was started: its log begins anew then."""
    return (job.folder / f"server{number}" / "server.log").read_text().count("uploaded: ")


def _seconds(job, mesh, addresses, *options):
    folder = job.folder / "split"
    command = [job.build / "client/ccslice", "slice", mesh, "--server", addresses, *_SPLIT_JOB, *options, "--force",
               "-o", folder]
    begin = time.monotonic()
    subprocess.run(command, check=True)
    return time.monotonic() - begin


def _split(job, mesh):
    """How much faster two servers are than one, in turns."""
    one, two = (_start(job, name, "--threads", "1") for name in ("one", "two"))
    with one, two:
        both = f"{one.address()},{two.address()}"
        ratios = []
        for _ in range(_SPLIT_ROUNDS + 1):  # The first one warms up.
            alone = _seconds(job, mesh, one.address())
            ratios.append(alone / _seconds(job, mesh, both, "--split", "2"))
    return statistics.median(ratios[1:])


def measure(job):
    mesh = sample(job)
    wholes = undisturbed(job, mesh)
    kills, ends, uploads = _kill_in_turn(job, mesh, [1 + max(map(layer_of, digests)) for digests in wholes])
    waits = [wait_s for _, _, arrivals in ends for wait_s in waits_s(arrivals, kills)]
    engine = pathlib.Path(job.folder / "engine.ccmesh")
    subprocess.run([job.build / "client/ccslice", "models", "engine", "-o", engine], check=True,
                   stdout=subprocess.DEVNULL)
    return [Figure("servers were killed", len(kills), "times", at_least=1), *figures(ends, wholes),
            Figure("uploads of the one mesh", uploads, "", at_most=len(ends)),
            Figure("from a kill to a job's next layer, median", statistics.median(waits), "s", at_most=0.5),
            Figure("from a kill to a job's next layer, longest", max(waits), "s"),
            Figure("--split 2 over two servers of one thread each, against one", _split(job, engine), "times",
                   at_least=1.7)]
