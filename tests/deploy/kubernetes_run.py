#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Runs what deploy/kubernetes says without a cluster: real servers with the options of ConfigMaps, Redis and Jobs by
their own scripts, HAProxy with a name server of ours, workers by the image's command and the README's commands for
them. Each pod is an address of loopback.

    kubernetes_run.py CCSLICED CCSLICE

Exit code 1 if anything is wrong."""

import contextlib
import os
import pathlib
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

sys.dont_write_bytecode = True

from kubernetes import redis_pod, rendered, script_of  # noqa: E402
from kubernetes_queue import run_queue  # noqa: E402
from objects import Overlay  # noqa: E402
from certificates import make_certificates  # noqa: E402
from pods import a_pod, expect, found, pods, status  # noqa: E402
from waiting import wait_for  # noqa: E402

A_RECORD = 1


# --- production -------------------------------------------------------------------------------------------------------


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


def main():
    ccsliced, ccslice = (str(pathlib.Path(one).resolve()) for one in sys.argv[1:3])
    with tempfile.TemporaryDirectory() as temporary:
        for run in (run_production, run_affinity, run_farm, run_queue):
            run(ccsliced, ccslice, pathlib.Path(temporary))
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
