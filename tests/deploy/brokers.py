# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Redis and RabbitMQ of Debian's packages as processes of their own, on free ports of loopback, with their files in a
folder. Both keep their messages when they are killed."""

import base64
import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import time
import uuid

import kombu
import redis

from free_port import free_port

TICKETS = "ccslice-tickets"  # As farm_worker.py has it.
_START_S = 60
_RABBITMQ = "/usr/lib/rabbitmq/bin"


def program(name):
    path = shutil.which(name, path="/usr/sbin:/usr/bin:/bin")
    if not path:
        raise SystemExit(f"{name} isn't here: deploy/install.sh test installs it")
    return path


def listens(port):
    with socket.socket() as tried:
        return tried.connect_ex(("127.0.0.1", port)) == 0


@contextlib.contextmanager
def running(command, port, log):
    """Another program, once it listens on the port; what it says goes into the file `log`."""
    with open(log, "wb") as output:
        process = subprocess.Popen(command, stdout=output, stderr=output)
    try:
        end = time.monotonic() + _START_S
        while not listens(port):
            if process.poll() is not None or time.monotonic() > end:
                raise RuntimeError(f"{command[0]} doesn't start: {log.read_text()[-2000:]}")
            time.sleep(0.05)
        yield
    finally:
        process.terminate()
        process.wait()


class _Broker:
    def __init__(self, folder, name):
        self.folder = folder / name
        self.folder.mkdir()
        self.port = free_port()
        self._log = open(self.folder / "log", "ab")
        self.start()

    def _run(self, command, **options):
        """In a session of its own, as some start others."""
        self._process = subprocess.Popen(command, stdout=self._log, stderr=self._log, start_new_session=True, **options)
        end = time.monotonic() + _START_S
        while not listens(self.port):
            if self._process.poll() is not None or time.monotonic() > end:
                raise RuntimeError(f"{type(self).__name__} doesn't start: " + (self.folder / "log").read_text()[-2000:])
            time.sleep(0.05)

    def kill(self):
        if self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()


class Redis(_Broker):
    def __init__(self, folder):
        super().__init__(folder, "redis")
        self.url = f"redis://127.0.0.1:{self.port}/1"

    def start(self):
        self._run([program("redis-server"), "--port", str(self.port), "--bind", "127.0.0.1", "--appendonly", "yes",
                   "--appendfsync", "always", "--save", "", "--dir", self.folder])

    def command(self, *words):
        done = subprocess.run([program("redis-cli"), "-p", str(self.port), "-n", "1", *words], check=True,
                              capture_output=True, text=True)
        return done.stdout.strip()

    def put(self, headers, body):
        """A message of anybody's."""
        properties = {"delivery_tag": str(uuid.uuid4()), "delivery_info": {"exchange": "", "routing_key": TICKETS},
                      "body_encoding": "base64"}
        self.put_bytes(json.dumps({"body": base64.b64encode(body).decode(), "content-type": "application/json",
                                   "content-encoding": "utf-8", "headers": headers, "properties": properties}))

    def put_bytes(self, value):
        """What isn't even a message."""
        redis.Redis(port=self.port, db=1).lpush(TICKETS, value)

    def left(self):
        """Messages that wait, or that nobody has acknowledged."""
        client = redis.Redis(port=self.port, db=1)
        waiting = sum(client.llen(key) for key in client.scan_iter(TICKETS + "*") if client.type(key) == b"list")
        return client.hlen("unacked") + waiting


class RabbitMq(_Broker):
    """With a port mapper of its own, which would otherwise stay on as a daemon."""

    def __init__(self, folder):
        self._mapper_port = str(free_port())
        self._distribution_port = str(free_port())
        self._mapper = subprocess.Popen([program("epmd"), "-port", self._mapper_port, "-address", "127.0.0.1"])
        super().__init__(folder, "rabbitmq")
        self.url = f"amqp://guest:guest@127.0.0.1:{self.port}//"

    def _environment(self):
        files = {"MNESIA_BASE": "db", "LOG_BASE": "logs", "CONFIG_FILE": "rabbitmq.conf", "PID_FILE": "pid",
                 "ENABLED_PLUGINS_FILE": "plugins", "GENERATED_CONFIG_DIR": "generated", "CONF_ENV_FILE": "none"}
        return {**os.environ, "HOME": str(self.folder), "ERL_EPMD_PORT": self._mapper_port,
                "ERL_EPMD_ADDRESS": "127.0.0.1", "RABBITMQ_NODENAME": "farm@localhost",
                "RABBITMQ_DIST_PORT": self._distribution_port,
                "RUNNING_UNDER_SYSTEMD": "yes",  # No shell between us and it (sbin/rabbitmq-server of 3.10).
                **{f"RABBITMQ_{name}": str(self.folder / file) for name, file in files.items()}}

    def start(self):
        (self.folder / "rabbitmq.conf").write_text(f"listeners.tcp.1 = 127.0.0.1:{self.port}\nlog.console = true\n"
                                                   "vm_memory_high_watermark.absolute = 200MB\n")
        (self.folder / "plugins").write_text("[].\n")
        self._run([f"{_RABBITMQ}/rabbitmq-server"], env=self._environment(), cwd=self.folder)

    def __exit__(self, *_):
        self.kill()
        self._mapper.kill()
        self._mapper.wait()

    def put(self, headers, body):
        with kombu.Connection(self.url) as connection:
            kombu.Producer(connection).publish(body, routing_key=TICKETS, headers=headers, serializer=None,
                                               content_type="application/json", content_encoding="utf-8")

    def put_bytes(self, value):
        self.put({}, value)

    def left(self):
        """As Redis's."""
        done = subprocess.run([f"{_RABBITMQ}/rabbitmqctl", "-q", "list_queues", "name", "messages"], check=True,
                              capture_output=True, text=True, env=self._environment())
        queues = dict(line.split() for line in done.stdout.splitlines() if len(line.split()) == 2)
        return int(queues[TICKETS])
