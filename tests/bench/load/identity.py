# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Tokens and certificates that are renewed while eight clients slice, those that are wrong, and what TLS costs."""

import os
import statistics
import subprocess
import threading
import time

from ccsliced_process import Server
from load.part import Figure
from load.slicing import sample

_CLIENTS = 8
_RENEW_EVERY_S = 1.0
_JOB = ["--pitch", "0.5", "--encoding", "raw", "--no-contact-sheet", "--quiet", "--force"]
_WHOLE_JOB = ["--pitch", "0.1", "--all-channels", "--encoding", "zstd", "--no-contact-sheet", "--quiet", "--force"]
_ROUNDS = 9


def _openssl(folder, *words):
    subprocess.run(["openssl", *words], cwd=folder, check=True, capture_output=True)


def _authority(folder):
    folder.mkdir()
    (folder / "names").write_text("subjectAltName=DNS:localhost,IP:127.0.0.1\n")
    _openssl(folder, "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=authority", "-keyout",
             "ca.key", "-out", "ca.pem")


def _certificate(folder, name):
    _openssl(folder, "req", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=localhost", "-keyout", f"{name}.key", "-out",
             f"{name}.csr")
    _openssl(folder, "x509", "-req", "-in", f"{name}.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-days",
             "2", "-extfile", "names", "-out", f"{name}.pem")


def _put(source, target):
    fresh = target.with_suffix(".fresh")
    fresh.write_bytes(source.read_bytes())
    os.replace(fresh, target)


class _Tokens:
    """A file of tokens in which the client's is renewed: the new one comes before the old one goes."""

    def __init__(self, job, folder):
        self._ccsliced, self._file, self._mine = job.ccsliced(), folder / "tokens", folder / "mine"
        self._count = 0
        self._lines = []
        self.renew()

    def _line(self, token, name="farm", role="write"):
        return subprocess.run([self._ccsliced, "--hash-token", name, role], input=token, text=True, check=True,
                              capture_output=True).stdout

    def renew(self):
        self._count += 1
        token = f"sesame-{self._count}"
        self._lines = [*self._lines, self._line(token)][-3:]
        fresh = self._file.with_suffix(".fresh")
        fresh.write_text("".join(self._lines) + self._line("only-reads", "reader", "read"))
        os.replace(fresh, self._file)
        time.sleep(0 if self._count == 1 else 2.5)  # The server has it.
        fresh = self._mine.with_suffix(".fresh")
        fresh.write_text(token + "\n")
        fresh.chmod(0o600)
        os.replace(fresh, self._mine)


def _slice(job, mesh, address, folder, *options, work=_JOB):
    return subprocess.run([job.build / "client/ccslice", "slice", mesh, "--server", address, *work, *options, "-o", folder],
                          capture_output=True, text=True)


def _renew_under_load(job, mesh, folder):
    """Slices, those that failed, and renewals."""
    _certificate(folder, "one")
    _certificate(folder, "two")
    for end in ("pem", "key"):
        _put(folder / f"one.{end}", folder / f"served.{end}")
    tokens = _Tokens(job, folder)
    over, done, failed = threading.Event(), [], []
    with Server(job.ccsliced(), folder, "--tls-cert", folder / "served.pem", "--tls-key", folder / "served.key",
                "--token-file", folder / "tokens") as server:
        address = server.address()

        def client(number):
            while not over.is_set():
                end = _slice(job, mesh, address, folder / f"layers{number}", "--ca", folder / "ca.pem", "--token-file",
                             folder / "mine")
                (done if end.returncode == 0 else failed).append(end.stderr)

        threads = [threading.Thread(target=client, args=(number,)) for number in range(_CLIENTS)]
        for thread in threads:
            thread.start()
        end, renewals = time.monotonic() + job.seconds, 0
        while time.monotonic() < end:
            name = "two" if renewals % 2 == 0 else "one"
            _put(folder / f"{name}.pem", folder / "served.pem")
            time.sleep(_RENEW_EVERY_S / 2)
            _put(folder / f"{name}.key", folder / "served.key")
            tokens.renew()
            renewals += 1
        over.set()
        for thread in threads:
            thread.join()
    for words in sorted(set(failed)):
        print("  " + words.strip())
    return len(done), len(failed), renewals


def _refusals(job, mesh, folder):
    """How many wrong clients got in, of how many."""
    (folder / "wrong").write_text("wrong\n")
    (folder / "reads").write_text("only-reads\n")
    for name in ("wrong", "reads"):
        (folder / name).chmod(0o600)
    _openssl(folder, "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=other", "-keyout",
             "other.key", "-out", "other.pem")
    with Server(job.ccsliced(), folder, "--tls-cert", folder / "served.pem", "--tls-key", folder / "served.key",
                "--token-file", folder / "tokens") as server:
        ca = ["--ca", folder / "ca.pem"]
        tries = [ca, [*ca, "--token-file", folder / "wrong"], [*ca, "--token-file", folder / "reads"],
                 ["--ca", folder / "other.pem", "--token-file", folder / "mine"], ["--token-file", folder / "mine"]]
        ends = [_slice(job, mesh, server.address(), folder / "refused", *options, "--patience", "2") for options in tries]
        page = (folder / "server.log").read_text()
    secrets = sum(secret in text for secret in ("only-reads", "sesame-") for text in [page, *(end.stderr for end in ends)])
    return sum(end.returncode == 0 for end in ends), len(tries), secrets, page.count("refused: ")


def _cost_of_tls(job, mesh, folder):
    """Whole jobs with TLS against those without, in turns."""
    for name in ("plain", "tls"):
        (folder / name).mkdir()
    plain = Server(job.ccsliced(), folder / "plain")
    tls = Server(job.ccsliced(), folder / "tls", "--tls-cert", folder / "served.pem", "--tls-key", folder / "served.key")
    ratios = []
    with plain, tls:
        for _ in range(_ROUNDS + 1):  # The first one warms up.
            seconds = []
            for server, options in ((plain, []), (tls, ["--ca", folder / "ca.pem"])):
                begin = time.monotonic()
                end = _slice(job, mesh, server.address(), folder / "whole", *options, work=_WHOLE_JOB)
                seconds.append(time.monotonic() - begin)
                if end.returncode:
                    raise RuntimeError(end.stderr)
            ratios.append(seconds[1] / seconds[0])
    return statistics.median(ratios[1:])


def measure(job):
    mesh, folder = sample(job), job.folder / "identity"
    _authority(folder)
    done, failed, renewals = _renew_under_load(job, mesh, folder)
    got_in, tries, secrets, audited = _refusals(job, mesh, folder)
    return [Figure("tokens and certificates were renewed", renewals, "times", at_least=2),
            Figure("slices meanwhile", done, "", at_least=_CLIENTS), Figure("of those, failed", failed, "", at_most=0),
            Figure("wrong clients that got in", got_in, f"of {tries}", at_most=0),
            Figure("refusals that the log has", audited, "", at_least=3),
            Figure("tokens in logs and errors", secrets, "", at_most=0),
            Figure("whole jobs with TLS, against without", _cost_of_tls(job, mesh, folder), "times", at_most=1.1)]
