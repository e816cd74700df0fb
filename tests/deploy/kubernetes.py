#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What deploy/kubernetes ships, without a cluster.

    kubernetes.py             schemas, policies (policies.py), scripts of containers, and whether all that would notice
    kubernetes.py --render    whether overlays render to rendered/, and a typed client keeps every field; exit code 77
                              without a kubectl of 1.21 or later
    kubernetes.py --write     renders anew

Exit code 1 if anything is wrong."""

import copy
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

import yaml

sys.dont_write_bytecode = True
sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1] / "support")]

import node_packages  # noqa: E402
import policies  # noqa: E402
from breaks import BREAKS, GONE, QUEUE  # noqa: E402
from free_port import free_port  # noqa: E402
from objects import Overlay, containers_of, name_of, pod_of  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent
FOLDER = HERE.parents[1] / "deploy/kubernetes"
OVERLAYS = ("dev", "production", "affinity", "farm", "queue")
SKIPPED = 77
HEADER = """# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Made of overlays/{0} by tests/deploy/kubernetes.py --write, for kubectl apply -f rendered/{0}.yaml

"""


def output(command, **options):
    return subprocess.run(command, **{"check": True, "text": True, "capture_output": True, **options})


def rendered(name):
    return list(yaml.safe_load_all((FOLDER / f"rendered/{name}.yaml").read_text()))


# --- Rendering --------------------------------------------------------------------------------------------------------


def kubectl():
    """Its path, or None if there is none that understands components."""
    path = shutil.which("kubectl")
    if not path:
        return None
    said = subprocess.run([path, "version", "--client", "-o", "json"], text=True, capture_output=True).stdout
    version = re.search(r'"gitVersion": "v(\d+)\.(\d+)', said)
    return path if version and (int(version[1]), int(version[2])) >= (1, 21) else None


def render(program, name):
    """The text; sys.exit with every warning."""
    done = subprocess.run([program, "kustomize", FOLDER / "overlays" / name], text=True, capture_output=True)
    if done.returncode or done.stderr:
        sys.exit(f"overlays/{name} doesn't render cleanly: {done.stderr}")
    return done.stdout


def write(program):
    for name in OVERLAYS:
        (FOLDER / f"rendered/{name}.yaml").write_text(HEADER.format(name) + render(program, name))


def lost(before, after, where):
    """What is in `before` and isn't in `after`."""
    if isinstance(before, dict) and isinstance(after, dict):
        return [one for key, value in before.items() for one in lost(value, after.get(key), f"{where}.{key}")]
    if isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        return [one for i, pair in enumerate(zip(before, after)) for one in lost(*pair, f"{where}[{i}]")]
    return [] if before == after else [f"{where}: {before} became {after}"]


def round_trip(program, workload):
    """kubectl reads it into Go's types, adds a variable, and writes what it knows."""
    marker = "CCSLICE_ROUND_TRIP"
    command = [program, "set", "env", "--local", "-f", "-", "-o", "json", f"{marker}=yes"]
    done = output(command, input=json.dumps(workload))
    after = json.loads(done.stdout)
    marked = 0
    for container in containers_of(after):
        variables = container.get("env", [])
        marked += any(one["name"] == marker for one in variables)
        container["env"] = [one for one in variables if one["name"] != marker]
    unread = [] if marked else [f"{name_of(workload)}: kubectl didn't read it"]
    return unread + lost(workload, after, name_of(workload))


def check_rendering():
    program = kubectl()
    if not program:
        print("skipped: no kubectl of 1.21 or later is here to render with")
        sys.exit(SKIPPED)
    found = []
    for name in OVERLAYS:
        if (FOLDER / f"rendered/{name}.yaml").read_text() != HEADER.format(name) + render(program, name):
            # Other versions of kubectl may indent otherwise.
            if list(yaml.safe_load_all(render(program, name))) != rendered(name):
                found.append(f"rendered/{name}.yaml isn't what overlays/{name} renders to (kubernetes.py --write)")
        for workload in Overlay(name, rendered(name)).workloads():
            found += round_trip(program, workload)
    broken = copy.deepcopy(Overlay("dev", rendered("dev")).get("Deployment", "ccsliced"))
    pod_of(broken)["containers"][0]["livenesProbe"] = {"grpc": {"port": 1}}
    if len(round_trip(program, broken)) != 1:
        found.append("the round trip doesn't notice a field that nobody knows")
    return found


# --- Schemas ----------------------------------------------------------------------------------------------------------


def schema_findings(objects):
    return json.loads(output(["node", HERE / "schemas/check.js"], input=json.dumps(objects)).stdout)


def check_schemas():
    node_packages.install(HERE / "schemas")
    found = [words for name in OVERLAYS for words in schema_findings(rendered(name))]
    broken = copy.deepcopy(Overlay("dev", rendered("dev")).get("Deployment", "ccsliced"))
    container = pod_of(broken)["containers"][0]
    container["readinesProbe"] = container.pop("readinessProbe")
    container["ports"][0]["containerPort"] = "grpc"
    if len(schema_findings([broken])) != 2:
        found.append(f"schemas don't notice a broken object: {schema_findings([broken])}")
    broken = copy.deepcopy(Overlay("queue", rendered("queue")).get(*QUEUE))
    claim = broken["spec"]["volumeClaimTemplates"][0]
    claim["label"], claim["spec"]["accesModes"] = {}, claim["spec"].pop("accessModes")
    if len(schema_findings([broken])) != 2:
        found.append(f"schemas don't notice a broken claim: {schema_findings([broken])}")
    return found


# --- Policies ---------------------------------------------------------------------------------------------------------


def at(overlay, kind, name, *path):
    """What is there in an object: (container or key of a dictionary, last key)."""
    place = overlay.get(kind, name)
    for key in path[:-1]:
        place = place[key]
    return place, path[-1]


def check_policies():
    return [f"{name}: {words}" for name in OVERLAYS for words in policies.findings(name, rendered(name))]


def check_breaks():
    """Whether the policies notice."""
    found = []
    for name, kind, thing, path, value, words in BREAKS:
        objects = copy.deepcopy(rendered(name))
        place, key = at(Overlay(name, objects), kind, thing, *path)
        if value is GONE:
            del place[key]
        else:
            place[key] = value
        noticed = policies.findings(name, objects)
        if not any(words in one for one in noticed):
            now = "gone" if value is GONE else value
            found.append(f"nobody notices when {path} of {kind} {thing} is {now}: {noticed}")
    for name, config, file, changes in (
            ("affinity", "ccslice-proxy", "haproxy.cfg",
             (("timeout server 35m", "timeout server 5m"), ("hash-type consistent", ""), ("port 9464", "port 9465"),
              ("maxconn 5000", "maxconn 50000"), ("ccsliced-headless", "ccsliced"))),
            ("queue", "ccslice-queue", "redis.conf",
             (("appendonly yes", "appendonly no"), ("noeviction", "allkeys-lru"), ("384mb", "768mb"),
              ("dir /data", "dir /run/redis")))):
        changed = copy.deepcopy(rendered(name))
        data = Overlay(name, changed).get("ConfigMap", config)["data"]
        whole = data[file]
        for old, new in changes:
            data[file] = whole.replace(old, new)
            if not policies.findings(name, changed):
                found.append(f"nobody notices when {file} has '{new}' for '{old}'")
    return found


# --- Scripts ----------------------------------------------------------------------------------------------------------


def script_of(job, folder, **places):
    """The last argument of a container's command, with folders of this test's for those of the container."""
    command = pod_of(job)["containers"][0]["command"]
    text = command[-1]
    for place, mine in places.items():
        text = text.replace("/" + place.replace("_", "/"), str(folder / mine))
    return [*command[:-1], text]


def check_farm_scripts():
    """Each pod slices its own share, and joining waits for all and takes all."""
    found, overlay = [], Overlay("farm", rendered("farm"))
    shares, joins = overlay.get("Job", "ccslice-shares"), overlay.get("Job", "ccslice-join")
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        (folder / "ccslice").write_text('#!/bin/sh\nfor one; do last=$one; done\nmkdir -p "$last"\n'
                                        f'touch "$last/manifest.json"\necho "$@" >>{folder}/calls\n')
        (folder / "ccslice").chmod(0o755)
        environment = {"PATH": f"{folder}:{os.environ['PATH']}", **overlay.get("ConfigMap", "ccslice-farm")["data"]}
        wait = pod_of(joins)["initContainers"][0]["command"]
        wait = subprocess.Popen([*wait[:-1], wait[-1].replace("/data", str(folder / "data"))], env=environment)
        for index in reversed(range(shares["spec"]["completions"])):
            if wait.poll() is not None:
                found.append("ccslice-join: doesn't wait for all shares")
            output(script_of(shares, folder, data="data"), env={**environment, "JOB_COMPLETION_INDEX": str(index)})
        wait.wait(timeout=20)
        output(script_of(joins, folder, data="data"), env=environment)
        output(script_of(joins, folder, data="data"), env=environment)  # Once more does no harm.
        job = folder / "data/part"
        options = "--pitch 0.2 --channel hardness --split 2"
        wanted = [f"slice /mesh/part.ccmesh {options} --share {i}/4 --resume -o {job}/shares/{i}"
                  for i in (4, 3, 2, 1)] + ["join shares/1 shares/2 shares/3 shares/4 -o layers"]
        calls = (folder / "calls").read_text().splitlines()
        if calls != wanted:
            found.append(f"the farm calls {calls}, not {wanted}")
    return found


def patched(objects, patches):
    """Copies, changed by those JSON patches of a kustomization that add or remove."""
    overlay = Overlay("patched", copy.deepcopy(objects))
    for patch in patches:
        target = overlay.get(patch["target"]["kind"], patch["target"]["name"])
        for step in yaml.safe_load(patch["patch"]):
            *path, last = [part.replace("~1", "/") for part in step["path"].split("/")[1:]]
            place = target
            for part in path:
                place = place[part]
            if step["op"] == "remove":
                del place[last]
            else:
                place[last] = step["value"]
    return overlay


def check_kueue():
    """The overlay that README.md describes has Kueue queue the shares, and bounds no time of waiting."""
    text = (FOLDER / "README.md").read_text().split("### Many such jobs, with Kueue")[1]
    block = re.search(r"((?:^ {4}.+\n)+)", text, re.MULTILINE)[1]
    kustomization = yaml.safe_load(block)
    overlay = patched(rendered("farm"), kustomization["patches"])
    shares, joins = overlay.get("Job", "ccslice-shares"), overlay.get("Job", "ccslice-join")
    if shares["metadata"]["labels"].get("kueue.x-k8s.io/queue-name") != "print":
        yield "Kueue: shares have no queue"
    if int(shares["metadata"]["annotations"]["kueue.x-k8s.io/job-min-parallelism"]) >= shares["spec"]["parallelism"]:
        yield "Kueue: shares can't begin with fewer pods"
    if "activeDeadlineSeconds" in joins["spec"] or "kueue.x-k8s.io/queue-name" in joins["metadata"]["labels"]:
        yield "Kueue: the join doesn't wait for shares that wait"
    if kustomization["resources"] != ["ccslice/deploy/kubernetes/overlays/farm"]:
        yield "Kueue: not the overlay farm"
    yield from schema_findings([shares, joins])


def redis_pod(overlay, kind, name, folder, password, port=None):
    """Runs its script with folders of this test's, and gives (process, port)."""
    port, workload = port or free_port(), overlay.get(kind, name)
    config = overlay.get("ConfigMap", name)["data"]["redis.conf"]
    config = config.replace("port 6379", f"port {port}").replace("bind * -::*", "bind 127.0.0.1")
    (folder / "run").mkdir(exist_ok=True)
    (folder / "redis.conf").write_text(config.replace("/run/redis", f"{folder}/run").replace("/data", str(folder)))
    (folder / "password").write_text(password + "\n")
    places = {name.replace("ccslice-", "etc_ccslice_"): "", "etc_redis": "", "run_redis": "run"}
    command = script_of(workload, folder, **places)
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True), port


def redis_says(port, *arguments):
    """Once it listens."""
    for _ in range(100):
        said = output(["redis-cli", "-p", str(port), *arguments], check=False).stdout
        if said:
            break
        time.sleep(0.05)
    return said


def check_redis_scripts():
    """Redis starts with its configuration, and wants the password."""
    found = []
    for overlay, kind, name, wanted in (("production", "Deployment", "ccslice-redis", ("1610612736", "allkeys-lru")),
                                        ("queue", *QUEUE, ("402653184", "noeviction"))):
        with tempfile.TemporaryDirectory() as temporary:
            overlay = Overlay(overlay, rendered(overlay))
            server, port = redis_pod(overlay, kind, name, pathlib.Path(temporary), "aSecretWord1")
            password = ("-a", "aSecretWord1", "--no-auth-warning")
            try:
                said = [redis_says(port, "ping"), redis_says(port, *password, "config", "get", "maxmemory*")]
            finally:
                server.terminate()
                server.communicate()
            if "NOAUTH" not in said[0] or not all(one in said[1] for one in wanted):
                found.append(f"{name} answers {said}")
    return found


def check_queue_password():
    """One that can't be part of an address is refused where somebody looks: by the queue, at its start."""
    found, overlay = [], Overlay("queue", rendered("queue"))
    for password in ("a/word", "a@word", ""):
        with tempfile.TemporaryDirectory() as temporary:
            server, _ = redis_pod(overlay, *QUEUE, pathlib.Path(temporary), password)
            try:
                said = server.communicate(timeout=10)[1]
            except subprocess.TimeoutExpired:
                server.kill()
                said = "nothing"
            if server.returncode != 1 or "take letters and digits" not in said:
                found.append(f"ccslice-queue takes the password '{password}' and says {said}")
    return found


def check_haproxy():
    """HAProxy takes the configuration; 2.6 knows no hash-key yet."""
    program = shutil.which("haproxy", path="/usr/sbin:/usr/bin")
    if not program:
        print("not looked at: haproxy.cfg, as there is no haproxy here")
        return []
    config = Overlay("affinity", rendered("affinity")).get("ConfigMap", "ccslice-proxy")["data"]["haproxy.cfg"]
    version = re.search(r"version (\d+)\.(\d+)", output([program, "-v"]).stdout)
    if (int(version[1]), int(version[2])) < (3, 0):
        config = config.replace("hash-key addr-port ", "")
    with tempfile.NamedTemporaryFile("w", suffix=".cfg") as file:
        file.write(config)
        file.flush()
        done = subprocess.run([program, "-c", "-f", file.name], text=True, capture_output=True,
                              env={**os.environ, "NAMESPACE": "ours", "CLUSTER_DOMAIN": "cluster.local"})
    complaints = [line for line in done.stderr.splitlines() if "ALERT" in line or "WARNING" in line]
    return [f"HAProxy: {line}" for line in complaints]


CHECKS = (check_schemas, check_policies, check_breaks, check_farm_scripts, check_kueue, check_redis_scripts,
          check_queue_password, check_haproxy)


def main():
    arguments = sys.argv[1:]
    if arguments == ["--write"]:
        write(kubectl() or sys.exit("kubernetes.py: no kubectl of 1.21 or later is here to render with"))
        return
    if arguments not in ([], ["--render"]):
        sys.exit(__doc__)
    found = check_rendering() if arguments else [words for check in CHECKS for words in check()]
    print(*found, sep="\n", end="\n" if found else "")
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
