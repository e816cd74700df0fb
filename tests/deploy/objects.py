# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Objects of Kubernetes as an overlay has them: what belongs to what, and what their texts stand for."""

import functools
import json
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parents[2]
MIB = 2**20
SPARE_S = 5  # Between the end of a grace and the kill.


def size_of(text):
    """Bytes of 4Gi (Kubernetes), 16GiB (ccsliced) or 1536mb (Redis)."""
    number, unit = re.fullmatch(r"([\d.]+)([A-Za-z]*)", str(text)).groups()
    return int(float(number) * {"": 1, "k": 2**10, "m": MIB, "g": 2**30, "t": 2**40}[unit.lower()[:1]])


def cpus_of(text):
    text = str(text)
    return float(text[:-1]) / 1000 if text.endswith("m") else float(text)


def seconds_of(text):
    number, unit = re.fullmatch(r"([\d.]+)(ms|s|m|h)", text).groups()
    return float(number) * {"ms": 0.001, "s": 1, "m": 60, "h": 3600}[unit]


class Overlay:
    def __init__(self, name, objects):
        self.name, self.objects = name, objects

    def of(self, *kinds):
        return [one for one in self.objects if one["kind"] in kinds]

    def get(self, kind, name):
        return next((one for one in self.of(kind) if name_of(one) == name), None)

    def workloads(self):
        return self.of("Deployment", "StatefulSet", "Job")

    @property
    def options(self):
        return self.get("ConfigMap", "ccsliced")["data"]


def name_of(thing):
    return thing["metadata"]["name"]


def pod_of(workload):
    return workload["spec"]["template"]["spec"]


def labels_of(workload):
    return workload["spec"]["template"]["metadata"]["labels"]


def containers_of(workload):
    return pod_of(workload)["containers"] + pod_of(workload).get("initContainers", [])


def claims_of(workload):
    """{volume: claim} of those that each pod gets for itself."""
    return {name_of(one): one["spec"] for one in workload["spec"].get("volumeClaimTemplates", [])}


def mounts_of(container):
    """{path: volume}"""
    return {one["mountPath"]: one["name"] for one in container.get("volumeMounts", [])}


def environment_of(overlay, container):
    """Variables of a container as they are written: a secret's is None, and none is expanded."""
    variables = {}
    for source in container.get("envFrom", []):
        variables.update(overlay.get("ConfigMap", source["configMapRef"]["name"])["data"])
    return {**variables, **{one["name"]: one.get("value") for one in container.get("env", [])}}


@functools.cache
def image_of(target):
    """What the Dockerfile says of a target: (its command, its variables)."""
    stages = re.split(r"^FROM ", (ROOT / "Dockerfile").read_text().replace("\\\n", " "), flags=re.MULTILINE)
    stage = next(one for one in stages if re.match(rf"\S+ AS {target}\n", one))
    said = dict(re.findall(r"^(ENTRYPOINT|CMD|ENV) (.*)$", stage, re.MULTILINE))
    return json.loads(said["ENTRYPOINT"]) + json.loads(said["CMD"]), dict(re.findall(r"(\w+)=(\S+)", said["ENV"]))


def redis_settings(overlay, name):
    lines = overlay.get("ConfigMap", name)["data"]["redis.conf"].splitlines()
    return dict(line.split(" ", 1) for line in lines)


def selected(selector, labels):
    if "matchExpressions" in selector:
        raise ValueError("matchExpressions aren't understood here")
    return all(labels.get(key) == value for key, value in selector.get("matchLabels", {}).items())


def ports_of(workload):
    """{name: number}, and {number: number}."""
    ports = {}
    for container in containers_of(workload):
        for port in container.get("ports", []):
            ports[port["name"]] = ports[port["containerPort"]] = port["containerPort"]
    return ports


def with_name(rule):
    """Findings begin with the name of the workload."""
    @functools.wraps(rule)
    def named(overlay):
        for workload in overlay.workloads():
            for words in rule(overlay, workload):
                yield f"{name_of(workload)}: {words}"
    return named
