# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What the queue of jobs and its workers have to be like on Kubernetes, as policies.py says it of the rest."""

import re

from objects import (ROOT, SPARE_S, claims_of, environment_of, image_of, mounts_of, name_of, pod_of, redis_settings,
                     size_of)


def queue_lasts(overlay):
    """What was submitted outlives the pod of Redis, and is never thrown away for want of memory."""
    queue = overlay.get("StatefulSet", "ccslice-queue")
    if not queue:
        return
    settings, container = redis_settings(overlay, "ccslice-queue"), pod_of(queue)["containers"][0]
    claim = claims_of(queue).get(mounts_of(container).get(settings["dir"]))
    if not claim or settings.get("appendonly") != "yes":
        yield "ccslice-queue: is lost with its pod"
    elif size_of(claim["resources"]["requests"]["storage"]) < 4 * size_of(settings["maxmemory"]):
        yield "ccslice-queue: its file, and the one that takes its place, don't fit into its claim"
    if "Delete" in queue["spec"].get("persistentVolumeClaimRetentionPolicy", {}).values():
        yield "ccslice-queue: its claim goes with it"
    if settings.get("maxmemory-policy") != "noeviction":
        yield "ccslice-queue: forgets jobs"
    limit = size_of(container["resources"]["limits"]["memory"])
    if "maxmemory" not in settings or 2 * size_of(settings["maxmemory"]) > limit:
        yield "ccslice-queue: with a copy of itself it takes more than its limit"
    if queue["spec"]["replicas"] != 1:
        yield "ccslice-queue: two of them are two queues"
    service = overlay.get("Service", queue["spec"]["serviceName"])
    if not service or service["spec"].get("clusterIP") != "None":
        yield "ccslice-queue: its service isn't a headless one"


def workers_complete(overlay):
    """The image's own command finds the queue, the servers and the jobs."""
    worker = overlay.get("Deployment", "ccslice-farm-worker")
    if not worker:
        return
    container = pod_of(worker)["containers"][0]
    if not container["image"].startswith("ccslice/farm:") or {"command", "args"} & set(container):
        yield "ccslice-farm-worker: isn't the image's own command"
    variables = environment_of(overlay, container)
    sources = "".join(path.read_text() for path in (ROOT / "deploy/farm").glob("*.py"))
    known = set(re.findall(r"CCSLICE_FARM_\w+", sources))
    yield from (f"ccslice-farm-worker: deploy/farm has no {one}" for one in variables
                if one.startswith("CCSLICE_FARM_") and one not in known)
    if variables.get("CCSLICE_SERVER") != "ccsliced-headless:50051":
        yield f"ccslice-farm-worker: {variables.get('CCSLICE_SERVER')} isn't the headless service"
    volumes = {one["name"]: one for one in pod_of(worker)["volumes"]}
    mounts = mounts_of(container)
    jobs = volumes.get(mounts.get(image_of("farm")[1]["CCSLICE_FARM_FOLDER"]), {})
    claim = overlay.get("PersistentVolumeClaim", jobs.get("persistentVolumeClaim", {}).get("claimName"))
    if not claim or claim["spec"]["accessModes"] != ["ReadWriteMany"]:
        yield "ccslice-farm-worker: jobs aren't where all workers see them"
    if "emptyDir" not in volumes.get(mounts.get("/tmp"), {}):
        yield "ccslice-farm-worker: Celery has no /tmp to write to"


def queue_found(overlay):
    """Workers have its address and its password."""
    worker = overlay.get("Deployment", "ccslice-farm-worker")
    if not worker:
        return
    container = pod_of(worker)["containers"][0]
    written = environment_of(overlay, container).get("CCSLICE_FARM_BROKER", "")
    address = re.fullmatch(r"redis://:\$\((\w+)\)@([^:/]+):(\d+)/\d+", written)
    service = address and overlay.get("Service", address[2])
    if not service or name_of(service) != "ccslice-queue" or int(address[3]) != service["spec"]["ports"][0]["port"]:
        yield f"ccslice-farm-worker: {written} isn't the queue"
        return
    sources = {one["name"]: one.get("valueFrom", {}) for one in container["env"]}
    secret = sources[address[1]]["secretKeyRef"]
    volumes = pod_of(overlay.get("StatefulSet", "ccslice-queue"))["volumes"]
    secrets = {one["secret"]["secretName"] for one in volumes if "secret" in one}
    if secret["key"] != "password" or secret["name"] not in secrets:
        yield f"ccslice-farm-worker: {secret} isn't the queue's password"


def workers_asked(overlay):
    """Probes ask this worker, take the time that Python takes, and bear with a queue that moves to another node."""
    worker = overlay.get("Deployment", "ccslice-farm-worker")
    if not worker:
        return
    container = pod_of(worker)["containers"][0]
    for kind in ("startup", "liveness"):
        probe = container[f"{kind}Probe"]
        command = probe["exec"]["command"]
        asks = re.search(r'celery -A farm inspect ping --destination "celery@\$HOSTNAME" --timeout (\d+)$', command[-1])
        if not asks:
            yield f"ccslice-farm-worker: the {kind} probe asks {command}"
        elif probe.get("timeoutSeconds", 1) < int(asks[1]) + 10:
            yield f"ccslice-farm-worker: the {kind} probe has {probe.get('timeoutSeconds', 1)} s"
        if probe["periodSeconds"] * probe["failureThreshold"] < {"startup": 300, "liveness": 600}[kind]:
            yield f"ccslice-farm-worker: the {kind} probe doesn't wait for the queue"
        # Who doesn't answer ends no share, so the pauses before its end are for nothing.
        if probe.get("terminationGracePeriodSeconds", 600) > 60:
            yield f"ccslice-farm-worker: one that the {kind} probe gives up stays for long"


def workers_end(overlay):
    """A worker ends its share, or gives it back, before it is killed."""
    worker = overlay.get("Deployment", "ccslice-farm-worker")
    if not worker:
        return
    hook = pod_of(worker)["containers"][0].get("lifecycle", {}).get("preStop", {}).get("exec", {}).get("command", [""])
    steps = re.fullmatch(r"kill -TERM 1; sleep (\d+); kill -QUIT 1; sleep (\d+)", hook[-1])
    if not steps:
        yield f"ccslice-farm-worker: doesn't give back its share: {hook}"
    elif int(steps[1]) + int(steps[2]) + SPARE_S > pod_of(worker).get("terminationGracePeriodSeconds", 30):
        yield "ccslice-farm-worker: is killed before it gives back its share"
    elif int(steps[2]) < 20:
        yield "ccslice-farm-worker: has too little time to give back its share"


RULES = (queue_lasts, queue_found, workers_complete, workers_asked, workers_end)
