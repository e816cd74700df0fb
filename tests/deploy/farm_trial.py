# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""deploy/farm with real Redis, Celery workers and servers, some of which are killed."""

import filecmp
import os
import pathlib
import signal
import subprocess
import time

from ccsliced_process import Server
from free_port import free_port

FARM = pathlib.Path(__file__).resolve().parents[2] / "deploy/farm"
PYTHON = "/usr/bin/python3"  # Debian's, which has its Celery.


class Worker:
    """A Celery worker in a process group of its own, as it has processes of its own."""

    def __init__(self, name, environment, log):
        self._start = lambda: subprocess.Popen(
            [PYTHON, "-B", "-m", "celery", "-A", "farm", "worker", "-n", f"{name}@%h", "-c", "1", "-l", "warning"],
            cwd=FARM, env=environment, stdout=log, stderr=log, start_new_session=True)
        self.process = self._start()

    def kill(self):
        os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def restart(self):
        self.process = self._start()


class Trial:
    def __init__(self, ccsliced, ccslice, folder, redis_server, port, servers, workers, timeout_s):
        self.ccslice, self.folder = str(ccslice), folder
        self.jobs = folder / "jobs"
        self.logs = [open(folder / name, "wb") for name in ("redis.log", "workers.log")]
        self.redis = subprocess.Popen([redis_server, "--port", str(port), "--bind", "127.0.0.1", "--appendonly", "yes",
                                       "--save", "", "--dir", folder], stdout=self.logs[0], stderr=self.logs[0])
        self.servers = []
        for i in range(servers):
            (folder / f"server{i}").mkdir()
            self.servers.append(Server(ccsliced, folder / f"server{i}", "--mesh-store", f"dir:{folder / 'store'}",
                                       "--threads", "1"))
        broker = f"redis://127.0.0.1:{port}/1"
        self.environment = {**os.environ, "CCSLICE_FARM_BROKER": broker, "CCSLICE_FARM_RESULTS": broker,
                            "CCSLICE_FARM_FOLDER": str(self.jobs), "CCSLICE_FARM_PROGRAM": self.ccslice,
                            "CCSLICE_SERVER": ",".join(server.address() for server in self.servers),
                            "CCSLICE_FARM_LONGEST_SHARE": str(timeout_s)}
        self.workers = [Worker(f"w{i}", self.environment, self.logs[1]) for i in range(workers)]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for worker in self.workers:
            worker.kill()
        for server in self.servers:
            server.kill()
        self.redis.kill()
        self.redis.wait()

    def farm(self, *words):
        return subprocess.run([PYTHON, "-B", FARM / "farm.py", *words], env=self.environment, capture_output=True, text=True)

    def submit(self, name, mesh, *options, shares=4):
        done = self.farm("submit", name, mesh, "--shares", str(shares), "--", *options)
        if done.returncode:
            raise RuntimeError(done.stderr)

    def state(self, name):
        return self.farm("status", name).stdout.strip()

    def wait_for(self, names, state, seconds):
        """Whether all of them get there in time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if all(f": {state}," in self.state(name) for name in names):
                return True
            time.sleep(0.3)
        return False

    def is_as_single(self, name, mesh, *options):
        """Whether the job's layers are, byte for byte, those of one run of ccslice slice."""
        single = self.folder / f"single-{name}"
        subprocess.run([self.ccslice, "slice", mesh, *options, "-o", single, "-q"], check=True, env=self.environment)
        wanted = sorted(path.name for path in single.iterdir())
        got = sorted(path.name for path in (self.jobs / name / "layers").iterdir())
        same, other, odd = filecmp.cmpfiles(single, self.jobs / name / "layers", wanted, shallow=False)
        return wanted == got and not other and not odd

    def queued(self, redis_cli, port):
        """Messages that nobody has acknowledged."""
        done = subprocess.run([redis_cli, "-p", str(port), "-n", "1", "HLEN", "unacked"], capture_output=True, text=True)
        return int(done.stdout)


def run(row, program, ccsliced, ccslice, folder, long):
    folder = folder / "farm"
    folder.mkdir()
    port = free_port()
    samples = ("ring", "coyote", "engine", "bracket", "grid") if long else ("ring", "coyote")
    pitches = {"ring": "0.05", "coyote": "0.1", "engine": "0.12", "bracket": "0.15", "grid": "0.15"} if long else \
        {"ring": "0.1", "coyote": "0.3"}
    meshes = {}
    for sample in samples:
        meshes[sample] = folder / f"{sample}.ccmesh"
        subprocess.run([ccslice, "models", sample, "-o", meshes[sample]], check=True, stdout=subprocess.DEVNULL)
    with Trial(ccsliced, ccslice, folder, program("redis-server"), port, servers=3 if long else 2,
               workers=4 if long else 2, timeout_s=20 if long else 8) as trial:
        options = {sample: ("--pitch", pitches[sample], "--all-channels", "--encoding", "zstd") for sample in samples}
        begin = time.monotonic()
        for sample in samples:
            trial.submit(sample, meshes[sample], *options[sample])
        trial.submit("poisoned", meshes["ring"], "--pitch", "0.5", "--layers", "5000..6000")
        turn = 0
        while time.monotonic() - begin < (600 if long else 120) and not trial.wait_for(samples, "done", 20 if long else 4):
            worker, server = trial.workers[turn % len(trial.workers)], trial.servers[turn % len(trial.servers)]
            if turn and not long:  # Once is enough.
                continue
            worker.kill()
            server.kill_for(0.2)
            worker.restart()
            turn += 1
        seconds = time.monotonic() - begin
        late = [trial.state(sample) for sample in samples if ": done," not in trial.state(sample)]
        if late:
            raise RuntimeError("; ".join(late) + "\n" + (folder / "workers.log").read_text()[-400:])
        right = [trial.is_as_single(sample, meshes[sample], *options[sample]) for sample in samples]
        row("farm: jobs like single runs", f"{sum(right)} of {len(samples)}, {turn} kills, {seconds:.0f} s", all(right))
        poisoned = trial.state("poisoned")
        row("farm: a poisoned job", poisoned.rsplit(": ", 1)[-1][:60], ": failed," in poisoned and "exit code 2" in poisoned)
        left = trial.queued(program("redis-cli"), port)
        row("farm: unacknowledged messages", str(left), left == 0)

        trial.submit("long", meshes["coyote"], "--pitch", "0.03", "--all-channels", "--encoding", "zstd", shares=8)
        trial.wait_for(["long"], "running", 20)
        begin = time.monotonic()
        trial.farm("cancel", "long")
        stopped, own = False, str(trial.jobs / "long" / "shares").encode()
        while not stopped and time.monotonic() - begin < 15:
            stopped = not any(own in command for command in _commands())
        seconds = time.monotonic() - begin
        row("farm: a cancelled job", f"stops in {seconds:.1f} s: {trial.state('long').split(', ')[0]}",
            stopped and seconds < 5 and ": cancelled," in trial.state("long"))
        again = trial.farm("submit", "ring", str(meshes["ring"]), "--", "--pitch", "1")
        row("farm: two jobs of one name", again.stderr.strip()[:60], again.returncode != 0 and "already" in again.stderr)
        trial.redis.kill()
        trial.redis.wait()
        away = trial.farm("submit", "later", str(meshes["ring"]), "--", "--pitch", "1")
        row("farm: the broker is away", away.stderr.strip()[-60:], away.returncode != 0 and "retry later" in away.stderr)


def _commands():
    """Of all processes."""
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            yield path.read_bytes()
        except OSError:
            continue  # It has ended.
