#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What deploy/ ships, with the real programs on loopback: alerts with promtool, a Prometheus that reads a server and has
what the dashboard shows (watching), a mesh store in a Redis with TLS, proxies in front of three servers, which are
restarted one by one, large meshes and long calls through proxies, the farm's queue with workers and servers that are
killed and with all else that goes wrong, two customers' jobs in it, and a cluster of Slurm.

    run.py CCSLICED CCSLICE [--parts PART,...] [--long]

Ends with a table. Exit code 1 if a line of it fails."""

import argparse
import collections
import concurrent.futures
import contextlib
import hashlib
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest.mock

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/support")]

import farm_faults  # noqa: E402
import farm_jobs  # noqa: E402
import farm_trial  # noqa: E402
import farm_turns  # noqa: E402
import redis_tls  # noqa: E402
import slurm  # noqa: E402
import watching  # noqa: E402
from brokers import listens, program  # noqa: E402
from certificates import make_certificates  # noqa: E402
from ccsliced_process import Server  # noqa: E402
from free_port import free_port  # noqa: E402
from waiting import wait_for  # noqa: E402

BESIDE_OTHER_WORK_S = 20  # Bars of time are for --long, on a machine that does nothing else.
PARTS = ("alerts", "watching", "redis-tls", "nginx", "haproxy", "rolling", "passing", "farm-redis", "farm-rabbitmq", "jobs", "slurm",
         "turns", "faults")
MESHES, CALLS = 20, 200
rows = []


def row(what, found, passes):
    rows.append((what, found, "ok" if passes else "FAILED"))


def must_come(condition, seconds, what):
    if not wait_for(condition, seconds):
        raise RuntimeError(f"{what} doesn't come within {seconds} s")


class Replica:
    """A server with figures, and a log that says which mesh each call was for."""

    def __init__(self, ccsliced, folder, name, store, *options):
        folder = folder / name
        folder.mkdir(exist_ok=True)
        self.figures = free_port()
        self.log = folder / "server.log"
        self.server = Server(ccsliced, folder, "--log-format", "json", "--metrics-listen", f"127.0.0.1:{self.figures}",
                             "--mesh-store", f"dir:{store}", "--threads", "1",
                             "--max-connections-per-address", "10000", *options)
        self.address = self.server.address()
        self.seen = 0

    def calls(self):
        """The log's whole lines of slicing calls since the last time."""
        lines = self.log.read_text().split("\n")[:-1]
        fresh, self.seen = lines[self.seen:], len(lines)
        calls = [json.loads(line) for line in fresh if line.startswith("{")]
        return [call for call in calls if call.get("method") == "SliceRange"]

    def restart(self):
        """By the rules. Its exit code, and the calls since the last time."""
        code = self.server.stop_gracefully()
        calls, self.seen = self.calls(), 0
        self.server.start_at(self.address)
        must_come(lambda: listens(self.figures), 10, "the server")
        return code, calls


@contextlib.contextmanager
def nginx(replicas, folder, tls=False):
    """Gives the proxy's address, and what takes another list of servers. `tls`: by the folder's tls.crt and tls.key."""
    port, config = free_port(), folder / "nginx.conf"

    def write(servers):
        lines = "\n".join(f"        server {one.address} max_fails=1 fail_timeout=2s;" for one in servers)
        text = (ROOT / "deploy/proxies/nginx.conf").read_text()
        text = re.sub(r" +server 127\.0\.0\.1:50051.*", lines, text).replace("listen 50052", f"listen 127.0.0.1:{port}")
        if tls:
            files = f"ssl_certificate {folder}/tls.crt; ssl_certificate_key {folder}/tls.key;"
            text = text.replace(f":{port} http2;", f":{port} ssl http2; {files}")
        config.write_text(text)

    write(replicas)
    command = [program("nginx"), "-p", folder, "-c", config, "-e", "stderr", "-g", "daemon off;"]
    with open(folder / "nginx.log", "wb") as log:
        process = subprocess.Popen(command, stderr=log)
    try:
        must_come(lambda: listens(port), 10, "nginx")

        def take(servers):
            write(servers)
            subprocess.run([*command[:-2], "-s", "reload"], check=True, capture_output=True)
            time.sleep(1)

        yield f"127.0.0.1:{port}", take
    finally:
        process.terminate()
        process.wait()


@contextlib.contextmanager
def haproxy(replicas, folder, tls=False):
    """As nginx()."""
    port, config = free_port(), folder / "haproxy.cfg"

    def write(servers):
        lines = "\n".join(f"    server {one.log.parent.name} {one.address} port {one.figures}" for one in servers)
        text = (ROOT / "deploy/proxies/haproxy.cfg").read_text()
        text = re.sub(r" +server one .*", lines, text)
        bind = f"bind 127.0.0.1:{port}"
        if tls:
            (folder / "both.pem").write_text((folder / "tls.crt").read_text() + (folder / "tls.key").read_text())
            text = text.replace(" proto h2\n    # Who", f" ssl crt {folder}/both.pem alpn h2\n    # Who")
        config.write_text(re.sub(r"bind \S+", bind, text))

    write(replicas)
    with open(folder / "haproxy.log", "wb") as log:
        process = subprocess.Popen([program("haproxy"), "-W", "-db", "-f", config], stdout=log, stderr=log)
    try:
        must_come(lambda: listens(port), 10, "HAProxy")
        time.sleep(1)

        def take(servers):
            write(servers)
            process.send_signal(signal.SIGUSR2)  # The master starts a new worker.
            time.sleep(2)

        yield f"127.0.0.1:{port}", take
    finally:
        process.terminate()
        process.wait()


def make_meshes(ccslice):
    points = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    return [ccslice.Mesh(points * (2 + 0.1 * i), [[0, 1, 3, 2, 4, 5, 7, 6]], channels={"x": points[:, 0]})
            for i in range(MESHES)]


def slices(client, mesh):
    return hashlib.sha256(b"".join(layer.occupancy.tobytes() for layer in client.slice(mesh, pitch=0.5))).hexdigest()


def next_calls(replicas, count):
    """By server: the slicing calls since the last time. A server writes of a call after the client has its end, so this
    waits until `count` that ended well are there."""
    found = [[] for _ in replicas]

    def come():
        for calls, replica in zip(found, replicas):
            calls += replica.calls()
        return sum(call["status"] == "OK" for calls in found for call in calls) >= count

    wait_for(come, 10)
    return found


def homes(replicas, count):
    """By mesh: the servers that its calls went to, of the `count` ones since the last time."""
    found = collections.defaultdict(set)
    for number, calls in enumerate(next_calls(replicas, count)):
        for call in calls:
            if call["status"] == "OK":
                found[call["mesh"]].add(number)
    return found


def try_affinity(name, proxy, ccsliced, ccslice, folder, long):
    folder = folder / name
    folder.mkdir()
    store = folder / "store"
    replicas = [Replica(ccsliced, folder, f"server{i}", store) for i in range(4)]
    meshes = make_meshes(ccslice)
    with contextlib.ExitStack() as stack:
        for replica in replicas:
            stack.enter_context(replica.server)
        with ccslice.Client(replicas[0].address) as client:
            wanted = [slices(client, mesh) for mesh in meshes]
        homes(replicas, MESHES)
        address, take = stack.enter_context(proxy(replicas[:3], folder))
        with ccslice.Client(address) as client:
            right = all(slices(client, meshes[i % MESHES]) == wanted[i % MESHES] for i in range(CALLS))
            first = homes(replicas, CALLS)
            used = len(set().union(*first.values()))
            alone = sum(len(servers) == 1 for servers in first.values())
            row(f"{name}: {CALLS} calls of {MESHES} meshes", f"{alone} meshes at one server each, {used} servers",
                right and len(first) == alone == MESHES and used > 1)

            with unittest.mock.patch.object(ccslice.connection, "_MESH_ID", re.compile("(?!)")):
                with ccslice.Client(address) as stranger:
                    right = all(slices(stranger, mesh) == digest for mesh, digest in zip(meshes, wanted))
                    versions = stranger.server_info().server_version
            row(f"{name}: a client that names no mesh", "all right" if right else "wrong layers", right and versions)
            homes(replicas, MESHES)

            take(replicas)
            right = all(slices(client, mesh) == digest for mesh, digest in zip(meshes, wanted))
            second = homes(replicas, MESHES)
            moved = sum(second[mesh] != first[mesh] for mesh in first)
            row(f"{name}: a fourth server", f"{moved} of {MESHES} meshes moved", right and 0 < moved <= MESHES // 2)

            gone = next(iter(second[meshes[0].id]))
            try_kill(name, ccslice, client, meshes[0], replicas, gone, 2 if long else BESIDE_OTHER_WORK_S)
            begin = time.monotonic()
            right = all(slices(client, mesh) == digest for mesh, digest in zip(meshes, wanted))
            seconds = time.monotonic() - begin
            third = homes([one for i, one in enumerate(replicas) if i != gone], MESHES)
            kept = [i for i in range(len(replicas)) if i != gone]
            strangers = sum(second[mesh] != {gone} and {kept[i] for i in third[mesh]} != second[mesh] for mesh in first)
            row(f"{name}: one killed", f"{strangers} meshes of others moved, {seconds:.1f} s for all",
                right and strangers == 0 and seconds < (20 if long else 3 * BESIDE_OTHER_WORK_S))


def try_kill(name, ccslice, client, mesh, replicas, gone, most_s):
    """The server goes amid a job that it has, for good. Halftones have too many bytes to be underway all at once."""
    printing = ccslice.Printing({"soft": "#101010", "hard": "#f0f0f0"}, ccslice.blend("x", {0: "soft", 1: "hard"}))

    def slice_on(after_layer):
        digest, longest, last = hashlib.sha256(), 0, time.monotonic()
        for number, layer in enumerate(client.slice(mesh, pitch=(0.004, 0.004, 0.005), printing=printing)):
            longest = max(longest, time.monotonic() - last)
            digest.update(layer.materials.tobytes())
            after_layer(number)
            last = time.monotonic()
        return digest.digest(), longest

    wanted, _ = slice_on(lambda _: None)
    found, longest = slice_on(lambda number: number == 10 and replicas[gone].server.kill())
    calls = next_calls([one for i, one in enumerate(replicas) if i != gone], 1)
    began = [call["first_layer"] for server in calls for call in server]
    row(f"{name}: its server killed amid a job", f"layers from {began} by another one, after {longest:.2f} s",
        found == wanted and longest <= most_s and len(began) == 1 and began[0] > 0)


def try_rolling(ccsliced, program_path, folder, long):
    """Restarts each server behind HAProxy, while clients slice one job after the other through it."""
    folder = folder / "rolling"
    folder.mkdir()
    clients, over, failures, done = 16 if long else 6, threading.Event(), [], []
    replicas = [Replica(ccsliced, folder, f"server{i}", folder / "store", "--drain-delay", "5s") for i in range(3)]
    mesh = folder / "ring.ccmesh"
    subprocess.run([program_path, "models", "ring", "-o", mesh], check=True, stdout=subprocess.DEVNULL)
    job = ["--pitch", "0.3", "--encoding", "raw", "--no-contact-sheet", "--force", "--json"]

    def slice_once(address, name):
        command = [program_path, "slice", mesh, *job, "--server", address, "-o", folder / name]
        end = subprocess.run(command, capture_output=True, text=True)
        files = sorted((folder / name).glob("layer_*"))
        return end, hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()

    exits, calls = [], []
    with contextlib.ExitStack() as stack:
        for replica in replicas:
            stack.enter_context(replica.server)
        wanted = slice_once(replicas[0].address, "direct")[1]
        job_bytes = sum(call["bytes"] for call in next_calls(replicas[:1], 1)[0])
        address, _ = stack.enter_context(haproxy(replicas, folder))

        def client(number):
            while not over.is_set():
                end, digest = slice_once(address, f"client{number}")
                (done if end.returncode == 0 and digest == wanted else failures).append(end.stdout + end.stderr)

        threads = [threading.Thread(target=client, args=(number,)) for number in range(clients)]
        for thread in threads:
            thread.start()
        for replica in replicas:
            time.sleep(3)
            code, ended = replica.restart()
            exits.append(code)
            calls += ended
        time.sleep(3)
        over.set()
        for thread in threads:
            thread.join()
        logged = sum(call["status"] == "OK" for call in calls)
        calls += [call for server in next_calls(replicas, len(done) - logged) for call in server]
    for words in sorted(set(failures)):
        print(words.strip())
    row(f"rolling restart under {clients} clients", f"{len(failures)} of {len(done) + len(failures)} jobs failed, servers "
        f"exit with {sorted(set(exits))}", not failures and len(done) > clients and set(exits) == {0})
    sent = sum(call["bytes"] for call in calls)
    row("rolling restart: bytes of layers sent", f"{sent:,} for {len(done)} jobs of {job_bytes:,}",
        sent == len(done) * job_bytes)


def try_passing(name, proxy, ccsliced, ccslice, folder, long):
    """A large mesh, many bytes, and with `long` previews that move and that wait, through a proxy."""
    folder = folder / f"passing-{name}"
    folder.mkdir()
    replica = Replica(ccsliced, folder, "server", folder / "store")
    count, channels = (60, 45) if long else (25, 60)  # 50 MB, or 5
    side = np.arange(count + 1, dtype=float)
    points = np.stack(np.meshgrid(side, side, side, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange((count + 1) ** 3).reshape((count + 1,) * 3)
    corners = [number[x:x + count, y:y + count, z:z + count].reshape(-1)
               for x, y, z in ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))]
    values = np.random.default_rng(1).random((channels, len(points)))
    mesh = ccslice.Mesh(points, np.stack(corners, axis=1), channels={f"c{i}": values[i] for i in range(channels)})
    with replica.server, proxy([replica], folder) as (address, _):
        with ccslice.Client(address) as client:
            begin = time.monotonic()
            arrived = client.upload(mesh).mesh_id == mesh.id
            seconds = time.monotonic() - begin
            row(f"{name}: a large upload", f"{seconds:.1f} s", arrived and seconds < 120)
        plain = ccslice.Mesh(points[:, :], np.stack(corners, axis=1))
        wanted, found = try_tls(ccslice, proxy, replica, folder, plain)
        row(f"{name}: TLS in front", "as direct" if found == wanted else "other layers", found == wanted)
        seconds = {}
        for where in (replica.address, address, replica.address, address):
            with ccslice.Client(where) as client:
                client.upload(plain)
                begin = time.monotonic()
                size = sum(layer.occupancy.nbytes for layer in client.slice(plain, pitch=(0.02, 0.02, 0.1)))
                seconds[where] = time.monotonic() - begin
        ratio = seconds[replica.address] / seconds[address]
        row(f"{name}: throughput against direct", f"{ratio:.2f} of {size / 1e6 / seconds[replica.address]:.0f} MB/s of voxels",
            ratio >= (0.5 if long else 0.1))
        if long:
            with concurrent.futures.ThreadPoolExecutor() as pool:
                lasting = [pool.submit(one, name, ccslice, address, replica.address, plain)
                           for one in (try_previews, try_slow_reader)]
            for one in lasting:
                one.result()


def try_tls(ccslice, proxy, replica, folder, mesh):
    """Digests: direct, and through a proxy that ends TLS."""
    folder = folder / "tls"
    folder.mkdir()
    make_certificates(folder, "127.0.0.1")

    def digest(client):
        client.upload(mesh)
        layers = client.slice(mesh, pitch=1)
        return hashlib.sha256(b"".join(layer.occupancy.tobytes() for layer in layers)).digest()

    with proxy([replica], folder, tls=True) as (address, _):
        with ccslice.Client(replica.address) as direct, \
                ccslice.Client(f"https://{address}", ca=str(folder / "ca.crt")) as client:
            return digest(direct), digest(client)


def try_slow_reader(name, ccslice, address, direct, mesh):
    """One call of ten minutes, read layer by layer."""

    def digest(where, pause_s):
        found = hashlib.sha256()
        with ccslice.Client(where) as client:
            for layer in client.slice(mesh, pitch=(0.02, 0.02, 1)):
                found.update(layer.occupancy.tobytes())
                time.sleep(pause_s)
        return found.digest()

    wanted = digest(direct, 0)
    begin = time.monotonic()
    right = digest(address, 10) == wanted
    seconds = time.monotonic() - begin
    row(f"{name}: layers read over {seconds:.0f} s", "as direct" if right else "other ones", right and seconds >= 600)


def try_previews(name, ccslice, address, _, mesh):
    """A drag of a minute, then five minutes without a word, on one call."""
    moved = []

    def planes():
        end = time.monotonic() + 60
        while time.monotonic() < end:
            yield ccslice.Plane(middle=(12, 12, 1 + (time.monotonic() * 3) % 20))
            time.sleep(1 / 30)
        time.sleep(300)
        yield ccslice.Plane(middle=(12, 12, 12))

    with ccslice.Client(address) as client:
        for picture in client.preview(mesh, planes(), 0.1):
            moved.append(time.monotonic())
    silence = max(b - a for a, b in zip(moved, moved[1:]))
    row(f"{name}: a preview, a minute of drag, five idle", f"{len(moved)} pictures, {silence:.0f} s of silence",
        len(moved) > 300 and silence > 290)


def try_alerts():
    folder = ROOT / "deploy/prometheus"
    promtool = program("promtool")
    for command in (["check", "config", "prometheus.yml"], ["test", "rules", "rules_test.yml"]):
        done = subprocess.run([promtool, *command], cwd=folder, capture_output=True, text=True)
        if done.returncode:
            print(done.stdout, done.stderr)
        row(f"promtool {command[0]} {command[1]}", "silent" if done.returncode == 0 else "complains", done.returncode == 0)


def try_metrics(ccsliced, folder):
    folder = folder / "figures"
    folder.mkdir()
    replica = Replica(ccsliced, folder, "server", folder / "store")
    with replica.server:
        page = subprocess.run(["curl", "-s", f"http://127.0.0.1:{replica.figures}/metrics"], capture_output=True, check=True)
    done = subprocess.run([program("promtool"), "check", "metrics"], input=page.stdout, capture_output=True)
    row("promtool check metrics", f"{len(done.stderr)} bytes of complaints", done.returncode == 0 and not done.stderr)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("ccsliced", type=os.path.abspath)
    parser.add_argument("ccslice", type=os.path.abspath)
    parser.add_argument("--parts", default=",".join(PARTS))
    parser.add_argument("--long", action="store_true", help="the farm with all samples, for minutes")
    arguments = parser.parse_args()
    parts = arguments.parts.split(",")
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        folder.chmod(0o755)
        subprocess.run([ROOT / "client/python/make_stubs.py", folder / "python"], check=True, stdout=subprocess.DEVNULL)
        sys.path[:0] = [str(folder / "python"), str(ROOT / "client/python")]
        import ccslice  # noqa: E402

        if "alerts" in parts:
            try_alerts()
            try_metrics(arguments.ccsliced, folder)
        if "watching" in parts:
            watching.run(row, arguments.ccsliced, ccslice, make_meshes, folder)
        if "redis-tls" in parts:
            redis_tls.run(row, arguments.ccsliced, ccslice, make_meshes(ccslice)[0], folder)
        for name, proxy in (("nginx", nginx), ("haproxy", haproxy)):
            if name in parts:
                try_affinity(name, proxy, arguments.ccsliced, ccslice, folder, arguments.long)
        if "rolling" in parts:
            try_rolling(arguments.ccsliced, arguments.ccslice, folder, arguments.long)
        if "passing" in parts:
            for name, proxy in (("nginx", nginx), ("haproxy", haproxy)):
                try_passing(name, proxy, arguments.ccsliced, ccslice, folder, arguments.long)
        for broker in farm_trial.BROKERS:
            if f"farm-{broker}" in parts:
                farm_trial.run(row, arguments.ccsliced, arguments.ccslice, folder, broker, arguments.long)
        if "jobs" in parts:
            farm_jobs.run(row, arguments.ccsliced, arguments.ccslice, folder, arguments.long)
        if "slurm" in parts:
            slurm.run(row, arguments.ccsliced, arguments.ccslice, folder)
        if "turns" in parts:
            farm_turns.run(row, arguments.ccsliced, arguments.ccslice, folder, arguments.long)
        if "faults" in parts:
            farm_faults.run(row, arguments.ccsliced, arguments.ccslice, folder)
    width = max(len(what) for what, _, _ in rows)
    for what, found, verdict in rows:
        print(f"{what:<{width}}  {found:<40}  {verdict}")
    return any(verdict != "ok" for _, _, verdict in rows)


if __name__ == "__main__":
    sys.exit(main())
