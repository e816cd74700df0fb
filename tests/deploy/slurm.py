# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""deploy/slurm with a cluster of Debian's Slurm: one node, this machine, on free ports of loopback."""

import contextlib
import os
import pathlib
import pwd
import socket
import subprocess
import time

from brokers import program
from ccsliced_process import Server
from farm_trial import same_files, write_samples
from free_port import free_port
from waiting import wait_for

SUBMIT = pathlib.Path(__file__).resolve().parents[2] / "deploy/slurm/submit.sh"
USER = pwd.getpwuid(os.getuid()).pw_name
JOB = ("--pitch", "0.2", "--channel", "hardness", "--encoding", "zstd")

# Nobody else is let in by auth/none on loopback for the seconds of a test; sites have auth/munge.
CONFIGURATION = """
ClusterName=test
SlurmctldHost={host}(127.0.0.1)
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/none
CredType=cred/none
SlurmctldPort={controller}
SlurmdPort={daemon}
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=0,sched_interval=1
InactiveLimit=0
KillWait=2
NodeName={host} NodeAddr=127.0.0.1 CPUs={processors} State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""

# No server at the first attempt.
ONCE_AWAY = """#!/bin/sh
case "$*" in
  *"--share 2/"*) if ! [ -e "{folder}/was-away" ]; then : >"{folder}/was-away"; exit 5; fi ;;
esac
exec "{program}" "$@"
"""


class Cluster:
    def __init__(self, folder):
        self.folder = folder
        for name in ("state", "spool"):
            (folder / name).mkdir(parents=True)
        configuration = folder / "slurm.conf"
        configuration.write_text(CONFIGURATION.format(
            user=USER, host=socket.gethostname().split(".")[0], controller=free_port(), daemon=free_port(), folder=folder,
            processors=os.cpu_count()))
        (folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\n")
        self.environment = {**os.environ, "SLURM_CONF": str(configuration)}
        self._log = open(folder / "log", "ab")
        self._processes = [subprocess.Popen([program(name), "-D", "-f", configuration], stdout=self._log,
                                            stderr=self._log, env=self.environment)
                           for name in ("slurmctld", "slurmd")]

    def __enter__(self):
        if not wait_for(lambda: "idle" in self.says("sinfo", "--noheader", "--format", "%t"), 60):
            self.__exit__()
            raise RuntimeError("Slurm doesn't start: " + (self.folder / "log").read_text()[-2000:])
        return self

    def __exit__(self, *_):
        with contextlib.suppress(subprocess.CalledProcessError):
            self.says("scancel", "--user", USER)
        for process in self._processes:
            process.terminate()
        for process in self._processes:
            process.wait()

    def says(self, *words, **variables):
        return subprocess.run(words, env={**self.environment, **variables}, capture_output=True, text=True).stdout

    def ends(self, job, seconds=120):
        """How the job ended, or what it waits for."""
        def state():
            fields = dict(word.partition("=")[::2] for word in self.says("scontrol", "show", "job", job).split())
            return fields.get("JobState", "gone")
        wait_for(lambda: state() in ("COMPLETED", "FAILED", "CANCELLED", "gone") or time.sleep(0.2), seconds)
        return state()


def run(row, ccsliced, ccslice, folder):
    folder = folder / "slurm"
    (folder / "bin").mkdir(parents=True)
    (folder / "server").mkdir()
    mesh = write_samples(ccslice, folder, ["ring"])["ring"]
    wrapper = folder / "bin/ccslice"
    wrapper.write_text(ONCE_AWAY.format(folder=folder, program=ccslice))
    wrapper.chmod(0o755)
    with Server(ccsliced, folder / "server", "--threads", "1") as server, Cluster(folder / "cluster") as cluster:
        variables = {"CCSLICE_SERVER": server.address(), "PATH": f"{folder / 'bin'}:{os.environ['PATH']}"}

        def submit(*words):
            return cluster.says(SUBMIT, *words, **variables).strip()

        single = folder / "single"
        subprocess.run([ccslice, "slice", mesh, *JOB, "-o", single, "-q"], check=True, capture_output=True,
                       env={**os.environ, **variables})
        for shares in ("1", "4"):
            begin = time.monotonic()
            job = folder / f"part-{shares}"
            state = cluster.ends(submit(job, mesh, "--shares", shares, "--", *JOB))
            same = state == "COMPLETED" and same_files(single, job / "layers")
            row(f"Slurm: a job of {shares} share{'s' * (shares > '1')}",
                f"{state}, {time.monotonic() - begin:.0f} s" + ", server away once" * (shares > "1"), same)
        wrong = submit(folder / "wrong", mesh, "--shares", "2", "--", "--pich", "1")
        state = cluster.ends(wrong)
        words = "".join(path.read_text() for path in sorted((folder / "wrong/logs").iterdir()))
        row("Slurm: a wrong option", f"the join is {state}", state in ("CANCELLED", "gone") and "--pich" in words)
        refused = [words for words in ((), (folder / "x",), (folder / "x", mesh), (folder / "x", mesh, "--pitch", "1"),
                                       (folder / "x", mesh, "--shares", "0", "--"), (folder / "x", "gone", "--"),
                                       (folder / "part-4", mesh, "--"), (folder / "x", mesh, "--shares"))
                   if not submit(*words) and not (folder / "x").exists()]
        row("Slurm: wrong commands", f"{len(refused)} of 8 refused", len(refused) == 8)
