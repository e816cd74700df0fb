# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Servers as the pods of an overlay, each on an address of loopback, and what tests of them expect."""

import contextlib
import json
import os
import random
import subprocess
import urllib.error
import urllib.request

from waiting import wait_for

found = []


def expect(passes, words):
    print(("ok: " if passes else "FAILED: ") + words)
    if not passes:
        found.append(words)


def a_pod():
    return f"127.{random.randint(2, 250)}.{random.randint(1, 250)}.{random.randint(1, 250)}"


def status(address):
    try:
        with urllib.request.urlopen(f"http://{address}", timeout=2) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code
    except OSError:
        return 0


class Pod:
    """A server on an address of its own, with the overlay's ports and options. `others` replaces some of them."""

    def __init__(self, ccsliced, folder, overlay, others):
        self.ccsliced, self.address = ccsliced, a_pod()
        options = {**overlay.options, "CCSLICE_DRAIN_DELAY": "3s", "CCSLICE_THREADS": "1", **others}
        options = {name: value.replace("0.0.0.0", self.address) for name, value in options.items()}
        self.log = folder / f"{self.address}.log"
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen([ccsliced], env={**os.environ, **options}, stderr=log)

    def healthy(self):
        asked = subprocess.run([self.ccsliced, "--health-check", f"{self.address}:50053"], capture_output=True)
        return asked.returncode == 0

    def slicing_calls(self):
        lines = [json.loads(line) for line in self.log.read_text().splitlines() if line.startswith("{")]
        return sum(line.get("method") == "SliceRange" for line in lines)

    def end(self):
        self.process.terminate()
        return self.process.wait(timeout=80)


@contextlib.contextmanager
def pods(ccsliced, folder, overlay, count, others):
    started = [Pod(ccsliced, folder, overlay, others) for _ in range(count)]
    try:
        expect(all(wait_for(one.healthy, 20) for one in started), f"{overlay.name}: {count} servers are healthy")
        yield started
    finally:
        for one in started:
            one.process.kill()
            one.process.wait()
