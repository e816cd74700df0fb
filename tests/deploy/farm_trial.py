# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""deploy/farm with real brokers, Celery workers and servers, some of which are killed."""

import filecmp
import os
import pathlib
import signal
import subprocess
import time

from brokers import RabbitMq, Redis
from ccsliced_process import Server

FARM = pathlib.Path(__file__).resolve().parents[2] / "deploy/farm"
PYTHON = "/usr/bin/python3"  # Debian's, which has its Celery.
BROKERS = {"redis": Redis, "rabbitmq": RabbitMq}
LOG_LEVEL = "warning"
PITCHES = {"ring": "0.1", "coyote": "0.3"}
LONG_PITCHES = {"ring": "0.05", "coyote": "0.1", "engine": "0.12", "bracket": "0.1,0.1,0.03", "grid": "0.15"}


class Worker:
    """A Celery worker in a process group of its own, as it has processes of its own. `ahead_s`: of its clock."""

    def __init__(self, name, environment, log, ahead_s=0):
        code = (f"import time; now = time.time; time.time = lambda: now() + {ahead_s}; "
                "import celery.__main__ as run; run.main()")
        self._start = lambda: subprocess.Popen(
            [PYTHON, "-B", "-c", code, "-A", "farm", "worker", "-n", f"{name}@%h", "-c", "1", "-l", LOG_LEVEL],
            cwd=FARM, env=environment, stdout=log, stderr=log, start_new_session=True)
        self.process = self._start()

    def kill(self):
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()

    def stop(self):
        """As an operator does: it gives back what it can't end."""
        self.process.terminate()
        self.process.wait()

    def restart(self):
        self.process = self._start()


class Trial:
    """A farm in a folder that isn't there yet. `timeout_s`: when Redis takes a worker for lost."""

    def __init__(self, ccsliced, ccslice, folder, broker="redis", servers=2, workers=2, timeout_s=8, **environment):
        folder.mkdir()
        self.ccslice, self.folder, self.jobs = str(ccslice), folder, folder / "jobs"
        self.log = folder / "workers.log"
        self._log = open(self.log, "ab")
        self.broker = BROKERS[broker](folder)
        self.servers, self.workers = [], []
        for i in range(servers):
            (folder / f"server{i}").mkdir()
            self.servers.append(Server(ccsliced, folder / f"server{i}", "--mesh-store", f"dir:{folder / 'store'}",
                                       "--threads", "1"))
        self.environment = {**os.environ, "CCSLICE_FARM_BROKER": self.broker.url,
                            "CCSLICE_FARM_FOLDER": str(self.jobs), "CCSLICE_FARM_PROGRAM": self.ccslice,
                            "CCSLICE_SERVER": ",".join(server.address() for server in self.servers),
                            "CCSLICE_FARM_LONGEST_SHARE": str(timeout_s), **environment}
        for _ in range(workers):
            self.add_worker()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for worker in self.workers:
            worker.kill()
        for server in self.servers:
            server.kill()
        self.broker.__exit__()

    def add_worker(self, **options):
        self.workers.append(Worker(f"w{len(self.workers)}", self.environment, self._log, **options))
        return self.workers[-1]

    def farm(self, *words):
        return subprocess.run([PYTHON, "-B", FARM / "farm.py", *words], env=self.environment, capture_output=True,
                              text=True)

    def submit(self, name, mesh, *options, shares=4, priority=5, customer="somebody"):
        done = self.farm("submit", name, mesh, "--shares", str(shares), "--priority", str(priority),
                         "--customer", customer, "--", *options)
        if done.returncode:
            raise RuntimeError(done.stderr)

    def state(self, name):
        return self.farm("status", name).stdout.strip()

    def share(self, name, number):
        return self.jobs / name / "shares" / str(number)

    def wait_for(self, names, state, seconds):
        """Whether all of them get there in time."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if all(f": {state}," in self.state(name) for name in names):
                return True
            time.sleep(0.3)
        return False

    def must_end(self, name, seconds=90):
        if not self.wait_for([name], "done", seconds):
            raise RuntimeError(f"{self.state(name)}\n{self.log.read_text()[-2000:]}")

    def is_as_single(self, name, mesh, *options):
        """Whether the job's layers are, byte for byte, those of one run of ccslice slice."""
        single = self.folder / f"single-{name}"
        subprocess.run([self.ccslice, "slice", mesh, *options, "-o", single, "-q"], check=True, env=self.environment,
                       stdout=subprocess.DEVNULL)
        return same_files(single, self.jobs / name / "layers")

    def runs(self, words):
        """Whether a process has that in its command."""
        return any(words.encode() in command for command in _commands())


def same_files(one, other):
    wanted = sorted(path.name for path in one.iterdir())
    _, differing, odd = filecmp.cmpfiles(one, other, wanted, shallow=False)
    return wanted == sorted(path.name for path in other.iterdir()) and not differing and not odd


def write_samples(ccslice, folder, names):
    meshes = {name: folder / f"{name}.ccmesh" for name in names}
    for name, path in meshes.items():
        subprocess.run([ccslice, "models", name, "-o", path], check=True, stdout=subprocess.DEVNULL)
    return meshes


def time_undisturbed(ccsliced, ccslice, folder, broker, meshes, options, **size):
    with Trial(ccsliced, ccslice, folder, broker, **size) as trial:
        begin = time.monotonic()
        for name, mesh in meshes.items():
            trial.submit(name, mesh, *options[name])
        for name in meshes:
            trial.must_end(name, 900)
        return time.monotonic() - begin


def run(row, ccsliced, ccslice, folder, broker, long):
    label = f"farm over {broker}"
    folder = folder / f"farm-{broker}"
    folder.mkdir()
    pitches = LONG_PITCHES if long else PITCHES
    meshes = write_samples(ccslice, folder, pitches)
    options = {name: ("--pitch", pitch, "--all-channels", "--encoding", "zstd") for name, pitch in pitches.items()}
    size = {"servers": 3, "workers": 4, "timeout_s": 20} if long else {"servers": 2, "workers": 2, "timeout_s": 8}
    alone_s = 0
    if long:
        alone_s = time_undisturbed(ccsliced, ccslice, folder / "undisturbed", broker, meshes, options, **size)
    with Trial(ccsliced, ccslice, folder / "farm", broker, **size) as trial:
        begin = time.monotonic()
        for name, mesh in meshes.items():
            trial.submit(name, mesh, *options[name])
        odd = trial.farm("submit", "odd", meshes["ring"], "--pitch", "0.5").stderr.strip()
        row(f"{label}: options before --", odd[-60:], "options of ccslice slice stand behind --" in odd)
        trial.submit("poisoned", meshes["ring"], "--pitch", "0.5", "--contours", "of no kind", shares=2)
        kills = _disturb(trial, meshes, begin, long)
        seconds = time.monotonic() - begin
        right = [trial.is_as_single(name, meshes[name], *options[name]) for name in meshes]
        row(f"{label}: jobs like single runs", f"{sum(right)} of {len(right)}, {kills} kills", all(right))
        if long:
            row(f"{label}: against undisturbed", f"{seconds:.0f} s / {alone_s:.0f} s = {seconds / alone_s:.2f}",
                seconds <= 1.5 * alone_s)
        poisoned = trial.state("poisoned")
        row(f"{label}: a poisoned job", poisoned.rsplit(": ", 1)[-1][:60],
            ": failed," in poisoned and "exit code 2" in poisoned)
        _try_cancel(row, label, trial, meshes["coyote"])
        _try_priorities(row, label, trial, meshes["ring"])
        for worker in trial.workers:
            worker.stop()
        left = trial.broker.left()
        row(f"{label}: messages left", str(left), left == 0)


def _disturb(trial, names, begin, long):
    """Kills a worker and a server, and every 20 s with `long`, until the jobs are done. How often."""
    kills = 0
    while not trial.wait_for(names, "done", 20 if long else 4):
        if time.monotonic() - begin > (900 if long else 150):
            raise RuntimeError("\n".join(trial.state(name) for name in names) + trial.log.read_text()[-2000:])
        if kills and not long:  # Once is enough.
            continue
        worker, server = trial.workers[kills % len(trial.workers)], trial.servers[kills % len(trial.servers)]
        worker.kill()
        server.kill_for(0.2)
        worker.restart()
        kills += 1
    return kills


def _try_cancel(row, label, trial, mesh):
    trial.submit("long", mesh, "--pitch", "0.03", "--all-channels", "--encoding", "zstd", shares=8)
    own = str(trial.jobs / "long" / "shares")
    trial.wait_for(["long"], "running", 20)
    ran = trial.runs(own)
    begin = time.monotonic()
    trial.farm("cancel", "long")
    while trial.runs(own) and time.monotonic() - begin < 15:
        pass
    seconds = time.monotonic() - begin
    time.sleep(3)  # Shares that wait don't begin either.
    row(f"{label}: a cancelled job", f"stops in {seconds:.1f} s: {trial.state('long').split(', ')[0]}",
        ran and seconds < 5 and not trial.runs(own) and ": cancelled," in trial.state("long"))


def _try_priorities(row, label, trial, mesh):
    """What comes later and matters more is done first."""
    for worker in trial.workers[1:]:
        worker.stop()
    trial.submit("first", mesh, "--pitch", "0.1", "--all-channels", shares=6, priority=9)
    trial.submit("urgent", mesh, "--pitch", "1", shares=1, priority=0)
    trial.must_end("urgent")
    state = trial.state("first")
    row(f"{label}: an urgent job comes first", state.split(", ")[0], ": running," in state or ": waiting," in state)
    trial.must_end("first")


def _commands():
    """Of all processes."""
    for path in pathlib.Path("/proc").glob("[0-9]*/cmdline"):
        try:
            yield path.read_bytes()
        except OSError:
            continue  # It has ended.
