# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""A server that is killed every five seconds and then away for 0.2 to 4 s, while eight `ccslice slice` go on, each with
a job of its own. What they write, against what they write undisturbed, and when: the first layer after each return of
the server."""

import random
import statistics
import time

from ccsliced_process import Server
from load.part import Figure
from load.slicing import LEAST_S, Slicing, figures, layer_of, sample, undisturbed, wait_for, waits_s

_EVERY_S = 5
_AWAY_S = 0.2, 4
_LONGEST = 10  # Times as long as it should take.


def _kill_again_and_again(job, mesh, layers):
    """When the server came back, each time, and how each job ended."""
    returns, chance = [], random.Random(1)
    with Server(job.ccsliced(), job.folder) as server:
        slicings = [Slicing(job, mesh, server.address(), number, count) for number, count in enumerate(layers)]
        end = time.monotonic() + _LONGEST * max(LEAST_S, job.seconds)
        away_s = chance.uniform(*_AWAY_S)
        while not wait_for(slicings, _EVERY_S - away_s) and time.monotonic() < end:
            server.kill_for(away_s)
            returns.append(time.time())
            away_s = chance.uniform(*_AWAY_S)
        for slicing in slicings:
            slicing.stop()
        return returns, [slicing.finish() for slicing in slicings]


def measure(job):
    mesh = sample(job)
    wholes = undisturbed(job, mesh)
    returns, ends = _kill_again_and_again(job, mesh, [1 + max(map(layer_of, digests)) for digests in wholes])
    waits = [wait_s for _, _, arrivals in ends for wait_s in waits_s(arrivals, returns)]
    return [Figure("the server was killed", len(returns), "times", at_least=1), *figures(ends, wholes),
            Figure("from the server's return to a job's next layer, median", statistics.median(waits), "s", at_most=0.5),
            Figure("from the server's return to a job's next layer, longest", max(waits), "s")]
