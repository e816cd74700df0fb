# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""A mesh store in a Redis that speaks TLS alone and knows users, by deploy/proxies/redis-tls.cfg: meshes go there and come
back, and another authority's certificate isn't taken."""

import contextlib
import pathlib
import urllib.request

from brokers import program, running
from ccsliced_process import Server
from certificates import make_certificates
from free_port import free_port
from waiting import wait_for

ROOT = pathlib.Path(__file__).resolve().parents[2]
PASSWORD = "aSecretWord1"


def redis_with_tls(folder):
    """Gives (what runs it, its port)."""
    port = free_port()
    (folder / "redis.conf").write_text(
        f"port 0\ntls-port {port}\nbind 127.0.0.1\nsave \"\"\ndir {folder}\ntls-auth-clients no\n"
        f"tls-cert-file {folder}/tls.crt\ntls-key-file {folder}/tls.key\ntls-ca-cert-file {folder}/ca.crt\n"
        f"user default off\nuser slicer on >{PASSWORD} ~ccslice:* +@all\n")
    return running([program("redis-server"), folder / "redis.conf"], port, folder / "redis.log"), port


def proxy_with_tls(folder, redis_port, authority):
    port = free_port()
    text = (ROOT / "deploy/proxies/redis-tls.cfg").read_text()
    for theirs, ours in (("127.0.0.1:6380", f"127.0.0.1:{port}"), ("redis.example:6379", f"127.0.0.1:{redis_port}"),
                         ("/etc/ssl/certs/ca-certificates.crt", str(authority)), ("verifyhost redis.example", "verifyhost localhost")):
        if theirs not in text:
            raise RuntimeError(f"redis-tls.cfg has no {theirs}")
        text = text.replace(theirs, ours)
    (folder / "redis-tls.cfg").write_text(text)
    return running([program("haproxy"), "-db", "-f", folder / "redis-tls.cfg"], port, folder / "proxy.log"), port


def figure(port, name):
    page = urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics").read().decode()
    return next(float(line.split()[-1]) for line in page.splitlines() if line.startswith(name))


@contextlib.contextmanager
def served(ccsliced, folder, port):
    figures = free_port()
    with Server(ccsliced, folder, "--metrics-listen", f"127.0.0.1:{figures}", "--mesh-store",
                f"redis://slicer@127.0.0.1:{port}/0", "--mesh-store-password-file", folder / "password") as server:
        yield server.address(), figures


def run(row, ccsliced, ccslice, mesh, folder):
    folder, others = folder / "redis-tls", folder / "redis-tls-others"
    for one in (folder, others):
        one.mkdir()
        make_certificates(one, "127.0.0.1")
    (folder / "password").write_text(PASSWORD + "\n")
    redis, redis_port = redis_with_tls(folder)
    with redis:
        proxy, port = proxy_with_tls(folder, redis_port, folder / "ca.crt")
        with proxy, served(ccsliced, folder, port) as (address, figures):
            wait_for(lambda: figure(figures, "ccslice_store_up") == 1, 10)
            with ccslice.Client(address) as client:
                client.upload(mesh)
            written = figure(figures, 'ccslice_store_operations_total{operation="write",outcome="found"}')
            row("a store in Redis with TLS and users", f"{written:g} mesh written", written == 1)
        proxy, port = proxy_with_tls(folder, redis_port, folder / "ca.crt")
        with proxy, served(ccsliced, folder, port) as (address, figures):  # Another server, which has no mesh.
            wait_for(lambda: figure(figures, "ccslice_store_up") == 1, 10)
            with ccslice.Client(address) as client:
                planned = client.plan(mesh.id, pitch=0.5)
            read = figure(figures, 'ccslice_store_operations_total{operation="read",outcome="found"}')
            row("its meshes at another server", f"{read:g} mesh read", planned is not None and read == 1)
        proxy, port = proxy_with_tls(folder, redis_port, others / "ca.crt")
        with proxy, served(ccsliced, folder, port) as (_, figures):
            refused = wait_for(lambda: figure(figures, 'ccslice_store_operations_total{operation="check",outcome="failed"}') > 0, 20)
            row("a certificate of another authority", "isn't taken" if refused else "is taken",
                refused and figure(figures, "ccslice_store_up") == 0)
