# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""The queue of deploy/kubernetes without a cluster: Redis by the script of its pod, workers by the image's own command,
jobs by the README's commands. The queue's pod and a worker go in the middle of it."""

import contextlib
import os
import re
import signal
import subprocess
import time

from kubernetes import redis_pod, redis_says, rendered
from objects import ROOT, Overlay, environment_of, image_of, pod_of
from pods import expect, pods
from waiting import wait_for

# Instead of a cluster: what is executed in a worker runs here.
KUBECTL = """#!/bin/sh
[ "$1" = exec ] || exit 0
while [ "$1" != -- ]; do
  case $1 in */*) target=$1 ;; esac
  shift
done
shift
[ "$target" = deployment/ccslice-farm-worker ] && exec "$@"
"""


def answers(container, variables):
    """Whether the probe finds the worker of these variables."""
    probe = container["livenessProbe"]
    try:
        return subprocess.run(probe["exec"]["command"], env=variables, capture_output=True,
                              timeout=probe["timeoutSeconds"]).returncode == 0
    except subprocess.TimeoutExpired:
        return False


class Worker:
    """The image's own command with the Deployment's variables. A container has the pod's name for a host name."""

    def __init__(self, farm, name):
        self.container, self.log = farm.container, farm.folder / f"{name}.log"
        self.variables = {**farm.variables, "HOSTNAME": name}
        command = [*image_of("farm")[0], "--hostname", f"celery@{name}"]
        with open(self.log, "wb") as log:
            self.process = subprocess.Popen(command, env=self.variables, stdout=log, stderr=log, start_new_session=True)

    def answers(self):
        return answers(self.container, self.variables)

    def pre_stop(self, patience_s):
        """Its hook, with that time for its share. Whether the worker has ended before the hook has, as it should."""
        *shell, script = self.container["lifecycle"]["preStop"]["exec"]["command"]
        script = re.sub(r"(kill -\w+) 1\b", rf"\1 {self.process.pid}", script)
        script = re.sub(r"sleep \d+", f"sleep {patience_s}", script, count=1)
        hook = subprocess.Popen([*shell, script], start_new_session=True)
        ended = wait_for(lambda: self.process.poll() is not None or hook.poll() is not None, 60)
        ended = ended and hook.poll() is None
        with contextlib.suppress(ProcessLookupError):
            os.killpg(hook.pid, signal.SIGKILL)
        hook.wait()
        return ended

    def shares(self):
        """How many it has begun."""
        return len(re.findall(r"Task farm\.work\S+ received", self.log.read_text()))

    def kill(self):
        """With all processes of the container."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()


class Queue:
    """By the script of its pod, which may come again with its volume."""

    def __init__(self, overlay, folder):
        self.pod = (overlay, "StatefulSet", "ccslice-queue", folder, "aSecretWord1")
        self.process, self.port = redis_pod(*self.pod)

    def kill(self):
        self.process.kill()
        self.process.communicate()

    def come_again(self):
        self.kill()
        self.process, _ = redis_pod(*self.pod, self.port)

    def unacknowledged(self):
        return int(redis_says(self.port, "-a", "aSecretWord1", "--no-auth-warning", "-n", "1", "hlen", "unacked"))


class Farm:
    """Programs and variables of workers, and commands for kubectl."""

    def __init__(self, overlay, ccslice, folder, servers, queue):
        self.folder, self.ccslice = folder, ccslice
        self.container = pod_of(overlay.get("Deployment", "ccslice-farm-worker"))["containers"][0]
        for name in ("bin", "desk", "jobs"):
            (folder / name).mkdir()
        (folder / "bin/ccslice").symlink_to(ccslice)
        (folder / "bin/python3").symlink_to("/usr/bin/python3")  # Debian's, which has Celery.
        (folder / "bin/kubectl").write_text(KUBECTL)
        (folder / "bin/kubectl").chmod(0o755)
        places = {"$(QUEUE_PASSWORD)": "aSecretWord1", "@ccslice-queue:6379/": f"@127.0.0.1:{queue.port}/",
                  "ccsliced-headless:50051": ",".join(f"{one.address}:50051" for one in servers),
                  "/jobs": f"{folder}/jobs", "/usr/local/share/ccslice-farm": str(ROOT / "deploy/farm")}
        written = {**image_of("farm")[1], **environment_of(overlay, self.container), "QUEUE_PASSWORD": "aSecretWord1"}
        for place, mine in places.items():
            written = {name: value.replace(place, mine) for name, value in written.items()}
        self.variables = {**os.environ, **written, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}"}

    def run(self, commands):
        """As somebody does at a desk."""
        commands = commands.replace("/jobs", f"{self.folder}/jobs")
        return subprocess.run(["bash", "-euo", "pipefail", "-c", commands], cwd=self.folder / "desk",
                              env=self.variables, capture_output=True, text=True)

    def execute(self, *words):
        return self.run("kubectl exec deployment/ccslice-farm-worker -- " + " ".join(words)).stdout.strip()

    def is_done(self, name):
        if wait_for(lambda: ": done," in self.execute("python3 -m farm status", name), 180):
            return True
        print(self.execute("python3 -m farm status", name))
        return False

    def is_as_single(self, mesh, options, layers):
        single = self.folder / f"single-{mesh.stem}"
        subprocess.run([self.ccslice, "slice", mesh, *options, "-o", single], check=True, capture_output=True,
                       env=self.variables)
        return subprocess.run(["diff", "--recursive", single, layers], capture_output=True).returncode == 0


def readme_commands(section):
    """The README's blocks of commands."""
    text = (ROOT / "deploy/kubernetes/README.md").read_text()
    text = re.search(rf"^## {section}$(.*?)^## ", text, re.MULTILINE | re.DOTALL)[1]
    return re.findall(r"((?:^ {4}.+\n)+)", text, re.MULTILINE)


def try_readme(farm, queue, workers):
    """What is submitted without a worker outlives the queue's pod, and is what a single run makes."""
    start, submit, fetch = readme_commands("A queue of jobs")
    done = farm.run(start + submit)
    expect("part: waiting" in done.stdout, f"queue: a job waits for workers {done.stderr}".strip())
    queue.come_again()
    workers += [Worker(farm, f"pod-{number}") for number in (1, 2)]
    expect(all(wait_for(one.answers, 60) for one in workers), "queue: workers answer their probes")
    expect(not answers(farm.container, {**farm.variables, "HOSTNAME": "pod-3"}), "queue: and nobody else's")
    expect(farm.is_done("part"), "queue: the job outlives the queue's pod")
    get, _, delete = fetch.strip().rpartition("\n")
    done = farm.run(get)
    options = re.search(r"-- (--pitch.*)", submit)[1].split()
    same = farm.is_as_single(farm.folder / "desk/part.ccmesh", options, farm.folder / "desk/layers")
    expect(same, f"queue: layers and manifest are those of a single run, byte for byte {done.stderr}".strip())
    gone = farm.run(delete).returncode == 0 and not any((farm.folder / "jobs").glob("[!.]*"))
    expect(gone, "queue: jobs can be deleted")


def try_ends(farm, queue, workers):
    """The queue's pod goes under idle workers, and then a worker goes in the middle of its share."""
    queue.come_again()
    expect(all(wait_for(one.answers, 60) for one in workers), "queue: workers go on when it is back")
    mesh, options = farm.folder / "coyote.ccmesh", ["--pitch", "0.12", "--all-channels", "--encoding", "zstd"]
    subprocess.run([farm.ccslice, "models", "coyote", "-o", mesh, "--quiet"], check=True, capture_output=True)
    before = [one.shares() for one in workers]
    farm.execute("python3 -m farm submit long", str(mesh), "--shares 1 --", *options)
    working = wait_for(lambda: any((farm.folder / "jobs/long/shares").rglob("layer_*")), 60)
    expect(working, "queue: a worker slices the share")
    first = next(one for one, old in zip(workers, before) if one.shares() > old)
    begin = time.monotonic()
    expect(first.pre_stop(0.5), "queue: a worker ends by its hook")
    expect("Restoring 1 unacknowledged" in first.log.read_text(), "queue: it gives back its share")
    expect(farm.is_done("long"), f"queue: which is another's at once ({time.monotonic() - begin:.0f} s)")
    same = farm.is_as_single(mesh, options, farm.folder / "jobs/long/layers")
    expect(same and queue.unacknowledged() == 0, "queue: nothing is lost by it")


def run_queue(ccsliced, ccslice, folder):
    overlay, own = Overlay("queue", rendered("queue")), folder / "queue"
    own.mkdir()
    queue, workers = Queue(overlay, own), []
    try:
        with pods(ccsliced, own, overlay, 2, {"CCSLICE_MESH_STORE": f"dir:{own}/meshes"}) as servers:
            farm = Farm(overlay, ccslice, own, servers, queue)
            (own / "desk/part.ccmesh").hardlink_to(folder / "ring.ccmesh")
            try_readme(farm, queue, workers)
            try_ends(farm, queue, workers)
    finally:
        for one in workers:
            one.kill()
        queue.kill()
