# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What headers.py does, to the port for health, which every pod of a cluster may reach; and pages over HTTP with
headers without end. Health and pages are asked for meanwhile."""

import socket
import subprocess
import threading
import time
import urllib.request

from free_port import free_port
from load import headers
from load.part import Figure

_PAGES_S = 5


def _send_headers(address, over):
    """To whoever speaks HTTP/1."""
    lines = b"a: b\r\n" * 10_000
    while not over.is_set():
        try:
            with socket.create_connection(address, timeout=3) as connection:
                connection.sendall(b"GET /healthz HTTP/1.1\r\n")
                while not over.is_set():
                    connection.sendall(lines)
        except OSError:
            over.wait(0.01)


def _page_s(address):
    begin = time.monotonic()
    with urllib.request.urlopen(f"http://{address[0]}:{address[1]}/healthz", timeout=30):
        return time.monotonic() - begin


def _pages(address, server):
    over = threading.Event()
    threads = [threading.Thread(target=_send_headers, args=(address, over)) for _ in range(8)]
    for thread in threads:
        thread.start()
    time.sleep(_PAGES_S)
    page_s = _page_s(address)
    over.set()
    for thread in threads:
        thread.join()
    return [Figure("pages: memory, at its peak so far", headers.peak_mb(server.pid()), "MB",
                   at_most=headers.MOST_MB),
            Figure("pages: asked for behind headers without end", page_s, "s", at_most=10)]


def measure(job):
    health, pages = f"127.0.0.1:{free_port()}", ("127.0.0.1", free_port())
    with headers.server_of_1gib(job, "--health-listen", health, "--metrics-listen", f"127.0.0.1:{pages[1]}") as server:
        jobs, idle_s = headers.idle(job, server)
        figures = headers.beside(job, "health", health, server, jobs, idle_s)
        begin = time.monotonic()
        healthy = subprocess.run([job.ccsliced(), "--health-check", health], stdout=subprocess.DEVNULL).returncode == 0
        return [*figures, Figure("health: asked for after all", int(healthy), "", at_least=1),
                Figure("health: it took", time.monotonic() - begin, "s", at_most=3), *_pages(pages, server)]
