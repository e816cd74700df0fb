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

import policies  # noqa: E402
from free_port import free_port  # noqa: E402
from policies import containers_of, name_of, pod_of  # noqa: E402

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
        for workload in policies.Overlay(name, rendered(name)).workloads():
            found += round_trip(program, workload)
    broken = copy.deepcopy(policies.Overlay("dev", rendered("dev")).get("Deployment", "ccsliced"))
    pod_of(broken)["containers"][0]["livenesProbe"] = {"grpc": {"port": 1}}
    if len(round_trip(program, broken)) != 1:
        found.append("the round trip doesn't notice a field that nobody knows")
    return found


# --- Schemas ----------------------------------------------------------------------------------------------------------


def install_schemas():
    """Where they are missing."""
    folder = HERE / "schemas"
    installed, wanted = folder / "node_modules/.package-lock.json", folder / "package-lock.json"
    if not installed.exists() or installed.stat().st_mtime < wanted.stat().st_mtime:
        subprocess.run(["npm", "ci", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error"], check=True,
                       cwd=folder, stdout=sys.stderr)


def schema_findings(objects):
    return json.loads(output(["node", HERE / "schemas/check.js"], input=json.dumps(objects)).stdout)


def check_schemas():
    install_schemas()
    found = [words for name in OVERLAYS for words in schema_findings(rendered(name))]
    broken = copy.deepcopy(policies.Overlay("dev", rendered("dev")).get("Deployment", "ccsliced"))
    container = pod_of(broken)["containers"][0]
    container["readinesProbe"] = container.pop("readinessProbe")
    container["ports"][0]["containerPort"] = "grpc"
    if len(schema_findings([broken])) != 2:
        found.append(f"schemas don't notice a broken object: {schema_findings([broken])}")
    broken = copy.deepcopy(policies.Overlay("queue", rendered("queue")).get("StatefulSet", "ccslice-queue"))
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


POD = ("spec", "template", "spec")
FIRST = (*POD, "containers", 0)
QUEUE, WORKER = ("StatefulSet", "ccslice-queue"), ("Deployment", "ccslice-farm-worker")
GONE = object()

# (overlay, kind, name, path, value, words of a finding). Each breaks one thing.
BREAKS = (
    ("dev", "Deployment", "ccsliced", (*FIRST, "livenessProbe"), GONE, "has no probe for ['liveness']"),
    ("dev", "Deployment", "ccsliced", (*FIRST, "readinessProbe", "grpc", "port"), 50051, "doesn't ask for health"),
    ("dev", "Deployment", "ccsliced", (*FIRST, "startupProbe", "failureThreshold"), 3, "6 s to start"),
    ("dev", "Deployment", "ccsliced", (*FIRST, "livenessProbe", "failureThreshold"), 1, "only get no calls"),
    ("dev", "Deployment", "ccsliced", (*FIRST, "resources", "limits", "memory"), "4Gi", "memory that is requested"),
    ("dev", "Deployment", "ccsliced", (*FIRST, "resources", "limits"), GONE, "memory that is requested"),
    ("dev", "ConfigMap", "ccsliced", ("data", "CCSLICE_CACHE_BYTES"), "2GiB", "budgets take more"),
    ("dev", "ConfigMap", "ccsliced", ("data", "CCSLICE_MEMORY"), "4GiB", "budgets take more"),
    ("dev", "ConfigMap", "ccsliced", ("data", "CCSLICE_SHUTDOWN_GRACE"), "75s", "delay and grace take"),
    ("dev", "ConfigMap", "ccsliced", ("data", "CCSLICE_DRAIN_DELAY"), "1s", "too few"),
    ("dev", "ConfigMap", "ccsliced", ("data", "CCSLICE_DRAIN_DELAYS"), "10s", "no option"),
    ("dev", "ConfigMap", "ccsliced", ("data", "CCSLICE_LISTEN"), "0.0.0.0:50054", "no port of the container"),
    ("dev", "Deployment", "ccsliced", (*POD, "terminationGracePeriodSeconds"), GONE, "delay and grace take"),
    ("dev", "Deployment", "ccsliced", (*POD, "automountServiceAccountToken"), GONE, "token of the cluster"),
    ("dev", "Deployment", "ccsliced", (*POD, "enableServiceLinks"), GONE, "variables of services"),
    ("dev", "Deployment", "ccsliced", (*POD, "hostNetwork"), True, "hostNetwork"),
    ("dev", "Deployment", "ccsliced", (*POD, "securityContext", "runAsUser"), 0, "as root"),
    ("dev", "Deployment", "ccsliced", (*POD, "securityContext", "seccompProfile"), GONE, "seccomp"),
    ("dev", "Deployment", "ccsliced", (*FIRST, "securityContext", "readOnlyRootFilesystem"), False, "isn't confined"),
    ("dev", "Deployment", "ccsliced", (*FIRST, "securityContext", "privileged"), True, "isn't confined"),
    ("dev", "Deployment", "ccsliced", (*FIRST, "image"), "ccslice/server-slim", "no version"),
    ("dev", "Deployment", "ccsliced", (*FIRST, "image"), "ccslice/server-slim:0.0.9", "isn't of version"),
    ("dev", "Deployment", "ccsliced", ("spec", "selector", "matchLabels"), {"app": "x"}, "its selector"),
    ("dev", "Deployment", "ccsliced", ("spec", "template", "metadata",
     "labels"), {"app.kubernetes.io/name": "ccsliced"},
     "policies don't see it"),
    ("dev", "Deployment", "ccsliced", (*POD, "topologySpreadConstraints", 0, "labelSelector",
     "matchLabels"), {"app": "x"},
     "spreads others"),
    ("dev", "Deployment", "ccsliced", ("spec", "replicas"), GONE, "nobody, or two"),
    ("dev", "Service", "ccsliced", ("spec", "selector"), {"app": "x"}, "service ccsliced: selects []"),
    ("dev", "Service", "ccsliced", ("spec", "ports", 0, "targetPort"), "http", "no port http"),
    ("dev", "Service", "ccsliced-headless", ("spec", "clusterIP"), GONE, "isn't the addresses"),
    ("dev", "PodDisruptionBudget", "ccsliced", ("spec", "selector", "matchLabels"), {"app": "x"}, "nothing bounds"),
    ("dev", "NetworkPolicy", "ccslice-deny", ("spec", "policyTypes"), ["Ingress"], "ccsliced reaches"),
    ("dev", "NetworkPolicy", "ccslice-deny", ("spec", "ingress"), [{}], "a stranger reaches ccsliced"),
    ("dev", "NetworkPolicy", "ccsliced-clients", ("spec", "ingress", 0, "from"), GONE, "a stranger reaches ccsliced"),
    ("dev", "NetworkPolicy", "ccsliced-clients", ("spec", "ingress", 0, "from", 1), GONE, "namespace doesn't reach"),
    ("dev", "NetworkPolicy", "ccsliced-clients", ("spec", "ingress", 0, "ports"), GONE,
     "client reaches ccsliced on 9464"),
    ("dev", "NetworkPolicy", "ccsliced-health", ("spec", "ingress", 0, "ports", 0, "port"), 50052,
     "node doesn't reach"),
    ("dev", "NetworkPolicy", "ccsliced-clients", ("spec", "podSelector", "matchLabels"), {"app": "x"},
     "client doesn't reach"),
    ("production", "HorizontalPodAutoscaler", "ccsliced", ("spec", "minReplicas"), 1, "1 to 12 servers"),
    ("production", "HorizontalPodAutoscaler", "ccsliced", ("spec", "scaleTargetRef", "name"), "x", "which isn't there"),
    ("production", "ConfigMap", "ccsliced", ("data", "CCSLICE_TLS_KEY"), GONE, "go together"),
    ("production", "ConfigMap", "ccsliced", ("data", "CCSLICE_TLS_CLIENT_CA"), GONE, "doesn't know its clients"),
    ("production", "ConfigMap", "ccsliced", ("data", "CCSLICE_TOKEN_FILE"), "/etc/tokens", "isn't mounted"),
    ("production", "ConfigMap", "ccsliced", ("data", "CCSLICE_MESH_STORE"), "redis://redis:6379/0", "no service redis"),
    ("production", "Deployment", "ccsliced", (*FIRST, "volumeMounts", 0, "readOnly"), GONE, "isn't read-only"),
    ("production", "Deployment", "ccsliced", (*FIRST, "volumeMounts", 0), GONE, "nobody uses the volume"),
    ("production", "Deployment", "ccsliced", (*POD, "volumes", 0, "secret", "defaultMode"), GONE, "everybody may read"),
    ("production", "Deployment", "ccsliced", (*POD, "volumes", 0, "secret", "secretName"), "x", "nobody is told"),
    ("production", "Deployment", "ccslice-redis", (*FIRST, "resources", "limits", "memory"), "1Gi",
     "more than its limit"),
    ("production", "Deployment", "ccslice-redis", (*FIRST, "livenessProbe"), GONE, "has no probe"),
    ("production", "NetworkPolicy", "ccslice-redis", ("spec", "ingress", 0, "from"), GONE,
     "a stranger reaches ccslice-redis"),
    ("production", "NetworkPolicy", "ccsliced-redis", ("spec", "egress", 1), GONE, "ccsliced doesn't reach DNS"),
    ("production", "NetworkPolicy", "ccsliced-redis", ("spec", "egress", 0, "to"), GONE,
     "ccsliced reaches a stranger on"),
    ("affinity", "ConfigMap", "ccsliced", ("data", "CCSLICE_MAX_CONNECTIONS_PER_ADDRESS"), GONE, "connections away"),
    ("affinity", "Deployment", "ccslice-proxy", (*FIRST, "lifecycle"), GONE, "its pause and its end"),
    ("affinity", "Deployment", "ccslice-proxy", (*FIRST, "resources", "limits", "cpu"), "1", "more threads"),
    ("affinity", "HorizontalPodAutoscaler", "ccsliced", ("spec", "maxReplicas"), 40, "room for fewer"),
    ("affinity", "Service", "ccsliced-headless", ("spec", "ports", 0, "port"), 50052, "isn't the headless service"),
    ("farm", "ConfigMap", "ccslice-farm", ("data", "SHARES"), "5", "4 pods for 5 shares"),
    ("farm", "Job", "ccslice-shares", ("spec", "completionMode"), GONE, "4 pods for 4 shares"),
    ("farm", "Job", "ccslice-join", ("spec", "podFailurePolicy"), GONE, "tries again"),
    ("farm", "PersistentVolumeClaim", "ccslice-farm", ("spec", "accessModes"), ["ReadWriteOnce"], "one node's alone"),
    ("farm", "PersistentVolumeClaim", "ccslice-meshes", ("spec", "resources", "requests", "storage"), "10Gi",
     "than there is"),
    ("farm", "Job", "ccslice-shares", ("spec", "template", "metadata", "labels", "ccslice-access"), GONE,
     "doesn't reach"),
    ("queue", *QUEUE, (*FIRST, "resources", "limits", "memory"), "512Mi", "more than its limit"),
    ("queue", *QUEUE, (*FIRST, "livenessProbe"), GONE, "has no probe for ['liveness']"),
    ("queue", *QUEUE, (*FIRST, "readinessProbe", "tcpSocket", "port"), 6380, "which isn't there"),
    ("queue", *QUEUE, (*FIRST, "securityContext", "readOnlyRootFilesystem"), GONE, "isn't confined"),
    ("queue", *QUEUE, (*FIRST, "volumeMounts", 3, "mountPath"), "/var/data", "is lost with its pod"),
    ("queue", *QUEUE, (*POD, "automountServiceAccountToken"), GONE, "ccslice-queue: gets a token"),
    ("queue", *QUEUE, (*POD, "volumes", 1, "secret", "defaultMode"), GONE, "everybody may read"),
    ("queue", *QUEUE, ("spec", "replicas"), 2, "two of them are two queues"),
    ("queue", *QUEUE, ("spec", "replicas"), GONE, "nobody, or two"),
    ("queue", *QUEUE, ("spec", "selector", "matchLabels"), {"app": "x"}, "its selector"),
    ("queue", *QUEUE, ("spec", "serviceName"), "ccsliced", "isn't a headless one"),
    ("queue", *QUEUE, ("spec", "volumeClaimTemplates"), GONE, "there is no volume data"),
    ("queue", *QUEUE, ("spec", "volumeClaimTemplates", 0, "spec", "resources", "requests", "storage"), "1Gi",
     "don't fit into its claim"),
    ("queue", *QUEUE, ("spec", "persistentVolumeClaimRetentionPolicy"), {"whenDeleted": "Delete"}, "claim goes"),
    ("queue", "NetworkPolicy", "ccslice-queue", ("spec", "ingress", 0, "from"), GONE,
     "a stranger reaches ccslice-queue"),
    ("queue", "NetworkPolicy", "ccslice-queue", ("spec", "ingress", 0, "from", 1), GONE, "a submitter doesn't reach"),
    ("queue", "NetworkPolicy", "ccslice-queue", ("spec", "ingress", 0, "from", 0), GONE,
     "ccslice-farm-worker doesn't reach ccslice-queue"),
    ("queue", "NetworkPolicy", "ccslice-farm-worker", ("spec", "egress", 0), GONE, "worker doesn't reach ccsliced"),
    ("queue", "NetworkPolicy", "ccslice-farm-worker", ("spec", "egress", 2), GONE, "worker doesn't reach DNS"),
    ("queue", "NetworkPolicy", "ccslice-farm-worker", ("spec", "egress", 1, "to"), GONE, "reaches a stranger on 6379"),
    ("queue", "PersistentVolumeClaim", "ccslice-farm-jobs", ("spec", "accessModes"), ["ReadWriteOnce"],
     "where all workers see them"),
    ("queue", "ConfigMap", "ccslice-farm-worker", ("data", "CCSLICE_SERVER"), "ccsliced:50051", "headless service"),
    ("queue", "ConfigMap", "ccslice-farm-worker", ("data", "CCSLICE_FARM_LONGEST"), "60", "farm.py has no"),
    ("queue", *WORKER, (*FIRST, "args"), ["worker"], "isn't the image's own command"),
    ("queue", *WORKER, (*FIRST, "image"), "ccslice/client:0.1.0", "isn't the image's own command"),
    ("queue", *WORKER, (*FIRST, "image"), "ccslice/farm:0.0.9", "isn't of version"),
    ("queue", *WORKER, (*FIRST, "resources", "requests", "memory"), "512Mi", "memory that is requested"),
    ("queue", *WORKER, (*FIRST, "securityContext", "capabilities"), GONE, "isn't confined"),
    ("queue", *WORKER, (*FIRST, "env", 0), GONE, "wants $(QUEUE_PASSWORD)"),
    ("queue", *WORKER, (*FIRST, "env", 0, "valueFrom", "secretKeyRef", "name"), "x", "nobody is told of the secret x"),
    ("queue", *WORKER, (*FIRST, "env", 0, "valueFrom", "secretKeyRef", "name"), "ccslice-redis", "queue's password"),
    ("queue", *WORKER, (*FIRST, "env", 1, "value"), "redis://:$(QUEUE_PASSWORD)@ccslice-redis:6379/1",
     "isn't the queue"),
    ("queue", *WORKER, (*FIRST, "envFrom"), GONE, "isn't the headless service"),
    ("queue", *WORKER, (*FIRST, "envFrom", 0, "configMapRef", "name"), "x", "there is no ConfigMap x"),
    ("queue", *WORKER, (*FIRST, "volumeMounts", 0, "mountPath"), "/data", "where all workers see them"),
    ("queue", *WORKER, (*FIRST, "volumeMounts", 1), GONE, "no /tmp"),
    ("queue", *WORKER, (*FIRST, "startupProbe"), GONE, "has no probe for ['startup']"),
    ("queue", *WORKER, (*FIRST, "startupProbe", "exec"), GONE, "runs nothing"),
    ("queue", *WORKER, (*FIRST, "startupProbe", "failureThreshold"), 6, "doesn't wait for the queue"),
    ("queue", *WORKER, (*FIRST, "livenessProbe", "failureThreshold"), 3, "doesn't wait for the queue"),
    ("queue", *WORKER, (*FIRST, "livenessProbe", "timeoutSeconds"), GONE, "liveness probe has 1 s"),
    ("queue", *WORKER, (*FIRST, "livenessProbe", "exec", "command", 2), "celery -A farm status", "liveness probe asks"),
    ("queue", *WORKER, (*FIRST, "livenessProbe", "terminationGracePeriodSeconds"), GONE, "stays for long"),
    ("queue", *WORKER, (*FIRST, "lifecycle"), GONE, "doesn't give back"),
    ("queue", *WORKER, (*POD, "terminationGracePeriodSeconds"), 300, "killed before it gives back"),
    ("queue", *WORKER, (*POD, "topologySpreadConstraints", 0, "labelSelector", "matchLabels"), {"app": "x"},
     "spreads others"),
    ("queue", *WORKER, ("spec", "replicas"), GONE, "nobody, or two"),
    ("queue", *WORKER, ("spec", "template", "metadata", "labels", "ccslice-access"), GONE, "doesn't reach ccsliced"),
)


def check_policies():
    return [f"{name}: {words}" for name in OVERLAYS for words in policies.findings(name, rendered(name))]


def check_breaks():
    """Whether the policies notice."""
    found = []
    for name, kind, thing, path, value, words in BREAKS:
        objects = copy.deepcopy(rendered(name))
        place, key = at(policies.Overlay(name, objects), kind, thing, *path)
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
        data = policies.Overlay(name, changed).get("ConfigMap", config)["data"]
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
    found, overlay = [], policies.Overlay("farm", rendered("farm"))
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
            overlay = policies.Overlay(overlay, rendered(overlay))
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
    found, overlay = [], policies.Overlay("queue", rendered("queue"))
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
    config = policies.Overlay("affinity", rendered("affinity")).get("ConfigMap", "ccslice-proxy")["data"]["haproxy.cfg"]
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


CHECKS = (check_schemas, check_policies, check_breaks, check_farm_scripts, check_redis_scripts,
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
