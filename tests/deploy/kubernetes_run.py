#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Runs what deploy/kubernetes says without a cluster: real servers with the options of ConfigMaps, Redis and Jobs by
their own scripts, HAProxy with a name server of ours, workers by the image's command and the README's commands for
them. Each pod is an address of loopback.

    kubernetes_run.py CCSLICED CCSLICE

Exit code 1 if anything is wrong."""

import contextlib
import json
import os
import pathlib
import random
import re
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import threading
import time
import urllib.error
import urllib.request

sys.dont_write_bytecode = True

from kubernetes import redis_pod, redis_says, rendered, script_of  # noqa: E402
from policies import Overlay, environment_of, image_of, pod_of  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
A_RECORD = 1
found = []


def expect(passes, words):
    print(("ok: " if passes else "FAILED: ") + words)
    if not passes:
        found.append(words)


def wait_for(condition, seconds):
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


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


# --- production -------------------------------------------------------------------------------------------------------


def make_certificates(folder, address):
    def openssl(*arguments):
        subprocess.run(["openssl", *arguments], check=True, capture_output=True, cwd=folder)

    key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")
    openssl("req", "-x509", *key, "-keyout", "ca.key", "-out", "ca.crt", "-subj", "/CN=authority", "-days", "2")
    for name, subject in (("tls", "server"), ("client", "cadbox")):
        openssl("req", *key, "-keyout", f"{name}.key", "-out", f"{name}.csr", "-subj", f"/CN={subject}")
        (folder / "names").write_text(f"subjectAltName=IP:{address}\n")
        openssl("x509", "-req", "-in", f"{name}.csr", "-CA", "ca.crt", "-CAkey", "ca.key", "-CAcreateserial", "-out",
                f"{name}.crt", "-days", "2", "-extfile", "names")


@contextlib.contextmanager
def redis(*pod):
    """By the script of its pod. Gives the port."""
    server, port = redis_pod(*pod)
    try:
        yield port
    finally:
        server.terminate()
        server.communicate()


def run_production(ccsliced, ccslice, folder):
    overlay = Overlay("production", rendered("production"))
    with redis(overlay, "Deployment", "ccslice-redis", folder, "c2VjcmV0") as port:
        others = {name: str(folder / pathlib.Path(value).name) for name, value in overlay.options.items()
                  if value.startswith("/etc/ccslice/")}
        others["CCSLICE_MESH_STORE"] = f"redis://127.0.0.1:{port}/0"
        line = subprocess.run([ccsliced, "--hash-token", "farm", "write"], input="a-token\n", check=True, text=True,
                              capture_output=True).stdout
        (folder / "tokens").write_text(line)
        (folder / "farm.token").touch(mode=0o600)
        (folder / "farm.token").write_text("a-token\n")
        (folder / "tls.key").touch(mode=0o600)
        address = a_pod()
        make_certificates(folder, address)
        others["CCSLICE_LISTEN"] = f"{address}:50051"
        with pods(ccsliced, folder, overlay, 1, others) as (server,):
            subprocess.run([ccslice, "models", "ring", "-o", folder / "ring.ccmesh", "--quiet"], check=True,
                           capture_output=True)
            whole = [ccslice, "upload", folder / "ring.ccmesh", "--server", f"{address}:50051", "--timeout", "5",
                     "--ca", folder / "ca.crt"]
            certificate = ["--cert", folder / "client.crt", "--key", folder / "client.key"]
            token = ["--token-file", folder / "farm.token"]
            for what, options, code in (("certificate and token get in", certificate + token, 0),
                                        ("a token alone doesn't", token, 5),
                                        ("a certificate alone doesn't", certificate, 4)):
                done = subprocess.run([*whole, *options], text=True, capture_output=True)
                expect(done.returncode == code, f"production: {what} ({done.returncode}) {done.stderr.strip()}")
            held = subprocess.run(["redis-cli", "-p", str(port), "-a", "c2VjcmV0", "--no-auth-warning", "dbsize"],
                                  text=True, capture_output=True).stdout
            expect(int(re.search(r"\d+", held)[0]) > 0, "production: Redis holds the mesh")
            expect(status(f"{server.address}:9464/metrics") == 200, "production: figures can be read")
            server.process.terminate()
            ending = wait_for(lambda: status(f"{server.address}:9464/readyz") == 503, 3)
            expect(ending, "production: /readyz tells of the end")
            expect(server.end() == 0, "production: the server ends well")


# --- affinity ---------------------------------------------------------------------------------------------------------


class NameServer(threading.Thread):
    """Answers each question for an address with all of `addresses`."""

    def __init__(self):
        super().__init__(daemon=True)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.port = self.socket.getsockname()[1]
        self.addresses, self.asked = [], set()
        self.start()

    def run(self):
        while True:
            question, asker = self.socket.recvfrom(4096)
            end = question.index(b"\0", 12)
            labels, at = [], 12
            while at < end:
                labels.append(question[at + 1:at + 1 + question[at]].decode())
                at += 1 + question[at]
            self.asked.add(".".join(labels))
            kind = struct.unpack(">H", question[end + 1:end + 3])[0]
            addresses = list(self.addresses) if kind == A_RECORD else []
            answers = b"".join(b"\xc0\x0c" + struct.pack(">HHIH", A_RECORD, 1, 5, 4) + socket.inet_aton(one)
                               for one in addresses)
            head = question[:2] + b"\x81\x80" + struct.pack(">HHHH", 1, len(addresses), 0, 0)
            self.socket.sendto(head + question[12:end + 5] + answers, asker)


@contextlib.contextmanager
def haproxy(folder, overlay, names):
    """Gives the address for clients, and that for probes."""
    program = shutil.which("haproxy", path="/usr/sbin:/usr/bin")
    config = overlay.get("ConfigMap", "ccslice-proxy")["data"]["haproxy.cfg"]
    version = re.search(r"version (\d+)\.", subprocess.run([program, "-v"], text=True, capture_output=True).stdout)
    if int(version[1]) < 3:
        config = config.replace("hash-key addr-port ", "")
    config = config.replace("parse-resolv-conf", f"nameserver ours 127.0.0.1:{names.port}")
    address = a_pod()
    (folder / "haproxy.cfg").write_text(config.replace("bind :", f"bind {address}:"))
    with open(folder / "haproxy.log", "wb") as log:
        process = subprocess.Popen([program, "-W", "-db", "-f", folder / "haproxy.cfg"], stdout=log, stderr=log,
                                   env={**os.environ, "NAMESPACE": "ours", "CLUSTER_DOMAIN": "cluster.local"})
    try:
        yield f"{address}:50052", f"{address}:8404"
        process.send_signal(signal.SIGUSR1)
        expect(process.wait(timeout=70) == 0, "affinity: HAProxy ends well")
    finally:
        process.kill()
        process.wait()


def run_affinity(ccsliced, ccslice, folder):
    overlay, names = Overlay("affinity", rendered("affinity")), NameServer()
    mesh = folder / "ring.ccmesh"
    others = {"CCSLICE_MESH_STORE": f"dir:{folder}", "CCSLICE_MESH_STORE_PASSWORD_FILE": ""}
    with pods(ccsliced, folder, overlay, 3, others) as servers, haproxy(folder, overlay, names) as (proxy, probes):
        expect(wait_for(lambda: status(f"{probes}/healthz") == 200, 10), "affinity: HAProxy is alive without servers")
        expect(status(f"{probes}/readyz") == 503, "affinity: and isn't ready")
        names.addresses = [one.address for one in servers]
        expect(wait_for(lambda: status(f"{probes}/readyz") == 200, 20), "affinity: it finds servers by their name")
        expect(names.asked == {"ccsliced-headless.ours.svc.cluster.local"}, f"affinity: it asks for {names.asked}")
        time.sleep(2)  # Until each is found alive.

        def slices(number):
            before = [one.slicing_calls() for one in servers]
            for call in range(4):
                subprocess.run([ccslice, "slice", mesh, "--server", proxy, "--pitch", "1", "--channel", "hardness",
                                "-o", folder / f"layers-{number}-{call}", "--quiet"], check=True, capture_output=True)
            return [one.slicing_calls() - old for one, old in zip(servers, before)]

        calls = slices(1)
        expect(sum(calls) >= 4 and calls.count(0) == 2, f"affinity: all calls of a mesh go to one server: {calls}")
        gone = servers[calls.index(max(calls))]
        names.addresses.remove(gone.address)  # As Kubernetes does when the pod is to end.
        expect(gone.end() == 0, "affinity: that server ends well")
        calls = slices(2)
        expect(sum(calls) >= 4 and calls.count(0) == 2, f"affinity: another one takes them: {calls}")
        for one in servers:
            one.process.terminate()
        expect(wait_for(lambda: status(f"{probes}/readyz") == 503, 20), "affinity: without servers it isn't ready")


# --- farm -------------------------------------------------------------------------------------------------------------


def run_farm(ccsliced, ccslice, folder):
    overlay = Overlay("farm", rendered("farm"))
    shares, joins = overlay.get("Job", "ccslice-shares"), overlay.get("Job", "ccslice-join")
    (folder / "part.ccmesh").hardlink_to(folder / "ring.ccmesh")
    with pods(ccsliced, folder, overlay, 2, {"CCSLICE_MESH_STORE": f"dir:{folder}"}) as servers:
        environment = {**os.environ, **overlay.get("ConfigMap", "ccslice-farm")["data"],
                       "CCSLICE_SERVER": ",".join(f"{one.address}:50051" for one in servers),
                       "MESH": str(folder / "part.ccmesh"),
                       "PATH": f"{pathlib.Path(ccslice).resolve().parent}:{os.environ['PATH']}"}
        workers = [subprocess.Popen(script_of(shares, folder, data="data"), stdout=subprocess.DEVNULL,
                                    stderr=subprocess.DEVNULL,
                                    env={**environment, "JOB_COMPLETION_INDEX": str(index)})
                   for index in range(shares["spec"]["completions"])]
        codes = [one.wait(timeout=60) for one in workers]
        expect(codes == [0] * len(workers), f"farm: each pod slices its share {codes}")
        again = subprocess.run(script_of(shares, folder, data="data"), capture_output=True, text=True,
                               env={**environment, "JOB_COMPLETION_INDEX": "1"})
        expect(again.returncode == 0, f"farm: a pod that comes again does no harm ({again.returncode})")
        joined = subprocess.run(script_of(joins, folder, data="data"), env=environment, capture_output=True, text=True)
        expect(joined.returncode == 0, f"farm: shares are joined {joined.stderr.strip()}")
        single = [ccslice, "slice", environment["MESH"], *environment["OPTIONS"].split(), "-o", folder / "single"]
        subprocess.run(single, check=True, capture_output=True, env=environment)
        same = subprocess.run(["diff", "--recursive", folder / "single", folder / "data/part/layers"],
                              capture_output=True)
        expect(same.returncode == 0, "farm: layers and manifest are those of a single run, byte for byte")
        expect(all(one.slicing_calls() for one in servers), "farm: both servers work on it")


# --- queue ------------------------------------------------------------------------------------------------------------


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
        self.container, self.name, self.log = farm.container, name, farm.folder / f"{name}.log"
        self.variables = {**farm.variables, "HOSTNAME": name}
        self.start()

    def start(self):
        command = [*image_of("farm")[0], "--hostname", f"celery@{self.name}"]
        with open(self.log, "ab") as log:
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
        return len(re.findall(r"Task farm\.slice_share\S+ received", self.log.read_text()))

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
        return subprocess.run(["bash", "-euo", "pipefail", "-c", commands], cwd=self.folder / "desk", env=self.variables,
                              capture_output=True, text=True)

    def execute(self, *words):
        return self.run("kubectl exec deployment/ccslice-farm-worker -- " + " ".join(words)).stdout.strip()

    def is_done(self, name):
        return wait_for(lambda: ": done," in self.execute("python3 -m farm status", name), 180)

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


def try_readme(farm, queue):
    """What is submitted without a worker outlives the queue's pod, and is what a single run makes. Gives two workers."""
    start, submit, fetch = readme_commands("A queue of jobs")
    done = farm.run(start + submit)
    expect("part: waiting" in done.stdout, f"queue: a job waits for workers {done.stderr}".strip())
    queue.come_again()
    workers = [Worker(farm, f"pod-{number}") for number in (1, 2)]
    expect(all(wait_for(one.answers, 30) for one in workers), "queue: workers answer their probes")
    expect(not answers(farm.container, {**farm.variables, "HOSTNAME": "pod-3"}), "queue: and nobody else's")
    expect(farm.is_done("part"), "queue: the job outlives the queue's pod")
    get, _, delete = fetch.strip().rpartition("\n")
    done = farm.run(get)
    options = re.search(r"-- (--pitch.*)", submit)[1].split()
    same = farm.is_as_single(farm.folder / "desk/part.ccmesh", options, farm.folder / "desk/layers")
    expect(same, f"queue: layers and manifest are those of a single run, byte for byte {done.stderr}".strip())
    expect(farm.run(delete).returncode == 0 and not any((farm.folder / "jobs").iterdir()), "queue: jobs can be deleted")
    return workers


def try_ends(farm, queue, workers):
    """The queue's pod goes under idle workers, and then a worker goes in the middle of its share."""
    queue.come_again()
    time.sleep(5)  # Until workers are there again, or aren't.
    for one in workers:
        if not one.answers():
            one.kill()
            one.start()
    expect(all(wait_for(one.answers, 30) for one in workers), "queue: a probe finds workers that lost the queue for good")
    mesh, options = farm.folder / "coyote.ccmesh", ["--pitch", "0.12", "--all-channels", "--encoding", "zstd"]
    subprocess.run([farm.ccslice, "models", "coyote", "-o", mesh, "--quiet"], check=True, capture_output=True)
    before = [one.shares() for one in workers]
    farm.execute("python3 -m farm submit long", str(mesh), "--shares 1 --", *options)
    working = wait_for(lambda: any((farm.folder / "jobs/long/shares").rglob("layer_*")), 30)
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
            workers = try_readme(farm, queue)
            try_ends(farm, queue, workers)
    finally:
        for one in workers:
            one.kill()
        queue.kill()


def main():
    ccsliced, ccslice = (str(pathlib.Path(one).resolve()) for one in sys.argv[1:3])
    with tempfile.TemporaryDirectory() as temporary:
        for run in (run_production, run_affinity, run_farm, run_queue):
            run(ccsliced, ccslice, pathlib.Path(temporary))
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
