# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What objects of Kubernetes have to be like, beyond what a cluster would take (kubernetes.py). Each rule is a function
of an Overlay that yields what is wrong, in words."""

import functools
import re

import yaml

import queue_policies
from objects import (MIB, ROOT, SPARE_S, Overlay, claims_of, containers_of, cpus_of, labels_of, name_of, pod_of,
                     ports_of, redis_settings, seconds_of, selected, size_of, with_name)
from rules import broken_rules

# What the README has people make.
SECRETS = {"ccsliced-tls", "ccsliced-client-ca", "ccsliced-tokens", "ccslice-redis", "ccslice-queue"}

# Who there is besides the overlay's own pods: name -> (labels of the pod, labels of its namespace or None for ours).
OUTSIDERS = {
    "client": ({"ccslice-access": "client"}, None),
    "a client's namespace": ({}, {"ccslice-access": "client"}),
    "a submitter": ({"ccslice-queue-access": "submitter"}, None),
    "Prometheus": ({}, {"kubernetes.io/metadata.name": "monitoring"}),
    "DNS": ({"k8s-app": "kube-dns"}, {"kubernetes.io/metadata.name": "kube-system"}),
    "another of kube-system": ({}, {"kubernetes.io/metadata.name": "kube-system"}),
    "a stranger": ({}, None),
    "another namespace": ({}, {"kubernetes.io/metadata.name": "other"}),
    "the node": ({}, {}),
}
CLIENTS = ("client", "a client's namespace")

# What has to pass: (from, to, port). Probes come from anywhere, as nodes have no labels.
HEALTH = {(one, "ccsliced", 50053) for one in OUTSIDERS}
TO_CLIENTS = {(one, "ccsliced", 50051) for one in CLIENTS}
TO_METRICS = {("Prometheus", "ccsliced", 9464)}
TO_REDIS = {("ccsliced", "ccslice-redis", 6379), ("ccsliced", "DNS", "53/UDP"), ("ccsliced", "DNS", 53)}
FLOWS = {
    "dev": HEALTH | TO_CLIENTS,
    "production": HEALTH | TO_CLIENTS | TO_METRICS | TO_REDIS,
    "affinity": HEALTH | TO_METRICS | TO_REDIS
    | {(one, "ccslice-proxy", 50052) for one in CLIENTS} | {(one, "ccslice-proxy", 8404) for one in OUTSIDERS}
    | {("ccslice-proxy", "ccsliced", 50051), ("ccslice-proxy", "ccsliced", 9464)}
    | {("ccslice-proxy", "DNS", "53/UDP"), ("ccslice-proxy", "DNS", 53)},
    "farm": HEALTH | TO_CLIENTS
    | {("ccslice-shares", "ccsliced", 50051), ("ccslice-shares", "DNS", "53/UDP"), ("ccslice-shares", "DNS", 53)},
    "queue": HEALTH | TO_CLIENTS
    | {("ccslice-farm-worker", "ccsliced", 50051), ("ccslice-farm-worker", "ccslice-queue", 6379)}
    | {("ccslice-farm-worker", "DNS", "53/UDP"), ("ccslice-farm-worker", "DNS", 53)}
    | {("a submitter", "ccslice-queue", 6379)},
}


CONFINED = {"allowPrivilegeEscalation": False, "readOnlyRootFilesystem": True, "capabilities": {"drop": ["ALL"]}}


# --- All pods ---------------------------------------------------------------------------------------------------------


@with_name
def confined(_, workload):
    pod = pod_of(workload)
    if pod.get("automountServiceAccountToken") is not False:
        yield "gets a token of the cluster"
    if pod.get("enableServiceLinks") is not False:
        yield "gets variables of services"
    for field in ("hostNetwork", "hostPID", "hostIPC"):
        if pod.get(field):
            yield f"{field} is set"
    context = pod.get("securityContext", {})
    if context.get("runAsNonRoot") is not True or not context.get("runAsUser") or not context.get("runAsGroup"):
        yield "may run as root"
    if context.get("seccompProfile") != {"type": "RuntimeDefault"}:
        yield "has no seccomp profile"
    for container in containers_of(workload):
        inner = container.get("securityContext", {})
        if inner != CONFINED:
            yield f"container {container['name']} isn't confined: {inner}"


@with_name
def bounded(_, workload):
    for container in containers_of(workload):
        resources = container.get("resources", {})
        requests, limits = resources.get("requests", {}), resources.get("limits", {})
        if not requests.get("memory") or requests.get("memory") != limits.get("memory"):
            yield f"container {container['name']}: memory that is requested isn't the limit"
        if not requests.get("cpu") or not limits.get("cpu"):
            yield f"container {container['name']}: no request or limit of processors"
        elif cpus_of(requests["cpu"]) > cpus_of(limits["cpu"]):
            yield f"container {container['name']}: requests more processors than its limit"


@with_name
def pinned(_, workload):
    version = (ROOT / "VERSION").read_text().strip()
    for container in containers_of(workload):
        image, _, tag = container["image"].partition(":")
        if not re.match(r"\d+\.\d+\.\d+", tag):
            yield f"image {container['image']} has no version"
        if image.startswith("ccslice/") and tag != version:
            yield f"image {container['image']} isn't of version {version}"


def source_of(overlay, volume):
    """What is wrong with where a volume comes from."""
    secrets = [volume["secret"]["secretName"]] if "secret" in volume else []
    secrets += [one["secret"]["name"] for one in volume.get("projected", {}).get("sources", [])]
    yield from (f"nobody is told of the secret {one}" for one in secrets if one not in SECRETS)
    mode = volume.get("secret", volume.get("projected", {})).get("defaultMode")
    if secrets and (mode is None or mode & 0o007):
        yield f"everybody may read the secrets {secrets}"
    claim = volume.get("persistentVolumeClaim", {}).get("claimName")
    if claim and not overlay.get("PersistentVolumeClaim", claim):
        yield f"there is no claim {claim}"
    config = volume.get("configMap", {})
    if config and not config.get("optional") and not overlay.get("ConfigMap", config["name"]):
        yield f"there is no ConfigMap {config['name']}"
    kinds = set(volume) - {"name"}
    if not kinds <= {"secret", "projected", "persistentVolumeClaim", "configMap", "emptyDir"}:
        yield f"volume {volume['name']} is a {kinds}"


@with_name
def volumes_there(overlay, workload):
    volumes = {**claims_of(workload), **{one["name"]: one for one in pod_of(workload).get("volumes", [])}}
    used = set()
    for container in containers_of(workload):
        for mount in container.get("volumeMounts", []):
            used.add(mount["name"])
            volume = volumes.get(mount["name"], {})
            if not volume:
                yield f"there is no volume {mount['name']}"
            if mount.get("subPath"):
                yield f"{mount['mountPath']} wouldn't follow renewals"
            if {"secret", "projected", "configMap"} & set(volume) and not mount.get("readOnly"):
                yield f"{mount['mountPath']} isn't read-only"
    yield from (f"nobody uses the volume {name}" for name in sorted(set(volumes) - used))
    for volume in pod_of(workload).get("volumes", []):
        yield from source_of(overlay, volume)


@with_name
def variables_there(overlay, workload):
    for container in containers_of(workload):
        for source in container.get("envFrom", []):
            if not overlay.get("ConfigMap", source["configMapRef"]["name"]):
                yield f"there is no ConfigMap {source['configMapRef']['name']}"
        before = set()
        for variable in container.get("env", []):
            secret = variable.get("valueFrom", {}).get("secretKeyRef", {}).get("name")
            if secret and secret not in SECRETS:
                yield f"nobody is told of the secret {secret}"
            # Only variables of the same list that stand before it are put in.
            yield from (f"{variable['name']} wants $({one}), which isn't there yet"
                        for one in re.findall(r"\$\((\w+)\)", variable.get("value", "")) if one not in before)
            before.add(variable["name"])


# --- Probes and the end -----------------------------------------------------------------------------------------------


def probe_port(probe):
    return next((probe[how]["port"] for how in ("grpc", "httpGet", "tcpSocket") if how in probe), None)


@with_name
def probed(_, workload):
    if workload["kind"] == "Job":
        return
    for container in pod_of(workload)["containers"]:
        # Nobody calls what has no port, so nobody asks whether it is ready.
        called = "ports" in container
        wanted = ("startup", "readiness", "liveness") if called else ("startup", "liveness")
        probes = {kind: container.get(f"{kind}Probe") for kind in wanted}
        if not all(probes.values()):
            yield f"container {container['name']} has no probe for {[kind for kind, one in probes.items() if not one]}"
            continue
        for kind, probe in probes.items():
            if called and probe_port(probe) not in ports_of(workload):
                yield f"the {kind} probe asks port {probe_port(probe)}, which isn't there"
            if not called and not probe.get("exec"):
                yield f"the {kind} probe runs nothing, and there is no port"
        patience = {kind: one["periodSeconds"] * one.get("failureThreshold", 3) for kind, one in probes.items()}
        if patience["liveness"] < 2 * patience.get("readiness", 0) or patience["liveness"] < 30:
            yield "is killed where it should only get no calls"
        if patience["startup"] < 60:
            yield f"has {patience['startup']} s to start"


def server_probed(overlay):
    server = overlay.get("Deployment", "ccsliced")
    health = int(overlay.options["CCSLICE_HEALTH_LISTEN"].rpartition(":")[2])
    container = pod_of(server)["containers"][0]
    for kind in ("startup", "readiness", "liveness"):
        if container.get(f"{kind}Probe", {}).get("grpc") != {"port": health}:
            yield f"ccsliced: the {kind} probe doesn't ask for health on port {health}"


def ends_in_time(overlay):
    delay, grace = (seconds_of(overlay.options[f"CCSLICE_{name}"]) for name in ("DRAIN_DELAY", "SHUTDOWN_GRACE"))
    has = pod_of(overlay.get("Deployment", "ccsliced")).get("terminationGracePeriodSeconds", 30)
    if delay + grace + SPARE_S > has:
        yield f"ccsliced: delay and grace take {delay + grace} s, and it has {has} s"
    if delay < 5:
        yield f"ccsliced: {delay} s are too few for others to learn that it goes"
    proxy = overlay.get("Deployment", "ccslice-proxy")
    if proxy:
        config = overlay.get("ConfigMap", "ccslice-proxy")["data"]["haproxy.cfg"]
        hooks = pod_of(proxy)["containers"][0].get("lifecycle", {})
        pause = hooks.get("preStop", {}).get("exec", {}).get("command", [])
        pause_s = float(pause[1]) if pause[:1] == ["sleep"] else 0
        stop = seconds_of(re.search(r"hard-stop-after (\S+)", config).group(1))
        if pause_s < 5 or pause_s + stop + SPARE_S > pod_of(proxy).get("terminationGracePeriodSeconds", 30):
            yield "ccslice-proxy: its pause and its end don't fit into its time"


# --- The server's options ---------------------------------------------------------------------------------------------


def adapter_names():
    text = (ROOT / "deploy/kubernetes/components/scaling-by-waits/adapter.yaml").read_text()
    return [rule["name"]["as"] for rule in yaml.safe_load(text)["rules"]]


@functools.cache
def known_variables():
    text = (ROOT / "server/service/options/options.cpp").read_text()
    return {"CCSLICE_" + flag.upper().replace("-", "_") for flag in re.findall(r'"--([a-z][a-z-]+)"', text)}


def options_known(overlay):
    yield from (f"ccsliced has no option {name}" for name in overlay.options if name not in known_variables())
    yield from (f"{name} isn't text" for name, value in overlay.options.items() if not isinstance(value, str))
    ports = ports_of(overlay.get("Deployment", "ccsliced"))
    for name in ("CCSLICE_LISTEN", "CCSLICE_HEALTH_LISTEN", "CCSLICE_METRICS_LISTEN"):
        host, _, port = overlay.options[name].rpartition(":")
        if host != "0.0.0.0" or int(port) not in ports:
            yield f"{name}={overlay.options[name]} is no port of the container"


def files_mounted(overlay):
    mounts = pod_of(overlay.get("Deployment", "ccsliced"))["containers"][0].get("volumeMounts", [])
    folders = [mount["mountPath"] for mount in mounts]
    for name, value in overlay.options.items():
        path = value.removeprefix("dir:")
        if path.startswith("/") and not any(path == one or path.startswith(one + "/") for one in folders):
            yield f"{name}={value} isn't mounted"


def identified(overlay):
    options = overlay.options
    tls = {"CCSLICE_TLS_CERT", "CCSLICE_TLS_KEY"} & set(options)
    if len(tls) == 1:
        yield "certificate and key go together"
    if "CCSLICE_TOKEN_FILE" in options and not tls and options.get("CCSLICE_ALLOW_PLAINTEXT_TOKENS") != "yes":
        yield "tokens would travel unencrypted"
    known = {"CCSLICE_TLS_CERT", "CCSLICE_TLS_CLIENT_CA", "CCSLICE_TOKEN_FILE"}
    if overlay.name == "production" and not known <= set(options):
        yield "production doesn't know its clients"


def memory_needed(options, limit):
    """The sizes of docs/operating.md together, of the limit or of --memory."""
    memory = size_of(options.get("CCSLICE_MEMORY", limit))
    budgets = {"CACHE": memory // 8 * 3, "PREPARATION_BUDGET": memory // 4, "UPLOAD_BUDGET": memory // 16,
               "CONNECTION_BUDGET": min(max(memory // 32, 64 * MIB), 512 * MIB), "STREAM_BUDGET": memory // 16}
    for name in budgets:
        budgets[name] = size_of(options.get(f"CCSLICE_{name}_BYTES", budgets[name]))
    process = 256 * MIB
    scratch = max(memory - sum(budgets.values()) - process, min(256 * MIB, memory // 4))
    return sum(budgets.values()) + process + size_of(options.get("CCSLICE_SCRATCH_BUDGET_BYTES", scratch))


def memory_fits(overlay):
    container = pod_of(overlay.get("Deployment", "ccsliced"))["containers"][0]
    limit = size_of(container["resources"]["limits"]["memory"])
    if memory_needed(overlay.options, limit) > limit:
        yield f"ccsliced: its budgets take more than its limit of {limit // MIB} MiB"


def store_there(overlay):
    place = overlay.options.get("CCSLICE_MESH_STORE")
    if not place:
        return
    if place.startswith("dir:"):
        claim = overlay.get("PersistentVolumeClaim", "ccslice-meshes")["spec"]
        if claim["accessModes"] != ["ReadWriteMany"]:
            yield "the store is one server's alone"
        if size_of(overlay.options["CCSLICE_MESH_STORE_BYTES"]) >= size_of(claim["resources"]["requests"]["storage"]):
            yield "the store may take more than there is"
        return
    host, port = re.fullmatch(r"redis://([^:/]+):(\d+)/\d+", place).groups()
    service = overlay.get("Service", host)
    if not service or int(port) not in [one["port"] for one in service["spec"]["ports"]]:
        yield f"there is no service {host} on port {port}"
        return
    redis = overlay.get("Deployment", "ccslice-redis")
    settings = redis_settings(overlay, "ccslice-redis")
    limit = size_of(pod_of(redis)["containers"][0]["resources"]["limits"]["memory"])
    if "maxmemory" not in settings or size_of(settings["maxmemory"]) > 0.8 * limit:
        yield "ccslice-redis: takes more than its limit"
    if settings.get("maxmemory-policy") != "allkeys-lru":
        yield "ccslice-redis: doesn't forget what nobody uses"
    if redis["spec"]["replicas"] != 1 or redis["spec"]["strategy"]["type"] != "Recreate":
        yield "ccslice-redis: two of them are two stores"


# --- Names that others use --------------------------------------------------------------------------------------------


def selectors_match(overlay):
    for workload in overlay.of("Deployment", "StatefulSet"):
        if not selected(workload["spec"]["selector"], labels_of(workload)):
            yield f"{name_of(workload)}: its selector isn't that of its pods"
    for workload in overlay.workloads():
        if labels_of(workload).get("app.kubernetes.io/part-of") != "ccslice":
            yield f"{name_of(workload)}: the policies don't see it"
        for spread in pod_of(workload).get("topologySpreadConstraints", []):
            if not selected(spread["labelSelector"], labels_of(workload)):
                yield f"{name_of(workload)}: spreads others than itself"
    if len(pod_of(overlay.get("Deployment", "ccsliced")).get("topologySpreadConstraints", [])) != 2:
        yield "ccsliced: isn't spread over zones and nodes"
    for service in overlay.of("Service"):
        selector = {"matchLabels": service["spec"]["selector"]}
        found = [one for one in overlay.workloads() if selected(selector, labels_of(one))]
        if len(found) != 1:
            yield f"service {name_of(service)}: selects {[name_of(one) for one in found]}"
            continue
        for port in service["spec"]["ports"]:
            if port["targetPort"] not in ports_of(found[0]):
                yield f"service {name_of(service)}: there is no port {port['targetPort']}"
    headless = overlay.get("Service", "ccsliced-headless")
    if not headless or headless["spec"].get("clusterIP") != "None" or headless["spec"].get("publishNotReadyAddresses"):
        yield "ccsliced-headless isn't the addresses of those that serve"


def replicas_told_once(overlay):
    scalers = {one["spec"]["scaleTargetRef"]["name"]: one["spec"] for one in overlay.of("HorizontalPodAutoscaler")}
    yield from (f"scales {name}, which isn't there" for name in scalers if not overlay.get("Deployment", name))
    for workload in overlay.of("Deployment", "StatefulSet"):
        name, replicas = name_of(workload), workload["spec"].get("replicas")
        if (replicas is None) != (name in scalers):
            yield f"{name}: nobody, or two, say how many there are"
    server = scalers.get("ccsliced", {"minReplicas": 1, "maxReplicas": 2})
    least = {"dev": 1, "production": 3, "affinity": 3, "farm": 2, "queue": 2}[overlay.name]
    if server["minReplicas"] != least or server["maxReplicas"] <= least:
        yield f"ccsliced: {server['minReplicas']} to {server['maxReplicas']} servers"


def scaled_by_waits(overlay):
    """Where Prometheus reads figures, the autoscaler goes by them too, under the name that the adapter gives them."""
    scaler = overlay.get("HorizontalPodAutoscaler", "ccsliced")
    if not scaler:
        return
    metrics = scaler["spec"]["metrics"]
    named = [one["pods"]["metric"]["name"] for one in metrics if one["type"] == "Pods"]
    if [one["resource"]["name"] for one in metrics if one["type"] == "Resource"] != ["cpu"]:
        yield "ccsliced: nobody looks at its processors"
    if named != (adapter_names() if overlay.name in ("production", "affinity") else []):
        yield f"ccsliced: scales by {named}, which nobody tells"
    for target in (one["pods"]["target"] for one in metrics if one["type"] == "Pods"):
        if target["type"] != "AverageValue" or not 0 < float(target["averageValue"]) < 10:
            yield f"ccsliced: scales when {target} calls wait"


def disruption_bounded(overlay):
    for name in ("ccsliced", "ccslice-proxy"):
        workload, budget = overlay.get("Deployment", name), overlay.get("PodDisruptionBudget", name)
        if not workload:
            continue
        bounds = budget and selected(budget["spec"]["selector"], labels_of(workload))
        if not bounds or budget["spec"].get("maxUnavailable") != 1:
            yield f"{name}: nothing bounds how many go at once"
        rolling = workload["spec"]["strategy"].get("rollingUpdate", {})
        if rolling.get("maxUnavailable") != 0:
            yield f"{name}: an update takes servers away before new ones serve"


def figures_found(overlay):
    server = overlay.get("Deployment", "ccsliced")
    annotations = server["spec"]["template"]["metadata"].get("annotations", {})
    scraped = annotations.get("prometheus.io/scrape") == "true"
    if scraped and annotations["prometheus.io/port"] != overlay.options["CCSLICE_METRICS_LISTEN"].rpartition(":")[2]:
        yield "ccsliced: Prometheus is sent to another port"
    if scraped != (overlay.name in ("production", "affinity")):
        yield "ccsliced: its figures are read by nobody, or unasked"


# --- The network ------------------------------------------------------------------------------------------------------


def peer_is(peer, labels, namespace):
    if "ipBlock" in peer:
        raise ValueError("ipBlock isn't understood here")
    if "namespaceSelector" in peer:
        if namespace is None:  # Ours has no label that a policy names.
            namespace = {"kubernetes.io/metadata.name": "ours"}
        if not selected(peer["namespaceSelector"], namespace):
            return False
        return selected(peer.get("podSelector", {}), labels)
    return namespace is None and selected(peer["podSelector"], labels)


def lets_through(overlay, direction, pod, other, port):
    """Whether the policies of `pod` let it talk to `other`. Both are (labels, namespace)."""
    kind, side = {"in": ("Ingress", "from"), "out": ("Egress", "to")}[direction]
    if pod[1] is not None:
        return True  # Other namespaces have policies of their own.
    isolated = False
    for policy in overlay.of("NetworkPolicy"):
        if kind not in policy["spec"]["policyTypes"] or not selected(policy["spec"]["podSelector"], pod[0]):
            continue
        isolated = True
        for rule in policy["spec"].get(kind.lower(), []):
            number, _, protocol = str(port).partition("/")
            ports = [(str(one["port"]), one.get("protocol", "TCP")) for one in rule.get("ports", [])]
            if ports and (number, protocol or "TCP") not in ports:
                continue
            if side not in rule or any(peer_is(peer, *other) for peer in rule[side]):
                return True
    return not isolated


def flows(overlay):
    own = {name_of(one): (labels_of(one), None) for one in overlay.workloads()}
    everybody = {**OUTSIDERS, **own}
    ports = {port for one in overlay.workloads() for port in ports_of(one).values()} | {53, "53/UDP", 443}
    for source, pod in everybody.items():
        for target, other in everybody.items():
            if source == target or (source not in own and target not in own):
                continue
            for port in ports:
                if lets_through(overlay, "out", pod, other, port) and lets_through(overlay, "in", other, pod, port):
                    yield source, target, port


def network_as_wanted(overlay):
    found, wanted = set(flows(overlay)), FLOWS[overlay.name]
    yield from (f"{one[0]} doesn't reach {one[1]} on {one[2]}" for one in sorted(wanted - found, key=str))
    yield from (f"{one[0]} reaches {one[1]} on {one[2]}" for one in sorted(found - wanted, key=str))


# --- HAProxy ----------------------------------------------------------------------------------------------------------


def sections_of(config):
    """{section: [setting, ...]} without comments and servers."""
    sections, current = {}, None
    for line in config.splitlines():
        line = line.split("#")[0].rstrip()
        if line and not line.startswith(" "):
            current = sections.setdefault(line, [])
        elif line and not re.match(r"(server|server-template|default-server hash-key) ", line.strip()):
            current.append(line.strip())
    return sections


def proxy_as_tested(overlay):
    """The settings are those that tests/deploy/run.py runs; servers come by name."""
    if not overlay.get("Deployment", "ccslice-proxy"):
        return
    config = overlay.get("ConfigMap", "ccslice-proxy")["data"]["haproxy.cfg"]
    ours, tested = sections_of(config), sections_of((ROOT / "deploy/proxies/haproxy.cfg").read_text())
    for section, settings in tested.items():
        wanted = settings if section != "global" else [one for one in settings if one in ours.get(section, [])]
        if section == "global" and wanted != settings or section != "global" and ours.get(section) != settings:
            yield f"ccslice-proxy: '{section}' isn't that of deploy/proxies/haproxy.cfg"
    template = re.search(r'server-template ccsliced 1-(\d+) "([^.]+)\.\$\{NAMESPACE\}\.svc\.\$\{CLUSTER_DOMAIN\}'
                         r':(\d+)" port (\d+)$', config, re.MULTILINE)
    if not template:
        yield "ccslice-proxy: no server-template"
        return
    slots, host, port, figures = template.groups()
    service = overlay.get("Service", host)
    if not service or service["spec"].get("clusterIP") != "None" or int(port) != service["spec"]["ports"][0]["port"]:
        yield f"ccslice-proxy: {host}:{port} isn't the headless service"
    if figures != overlay.options["CCSLICE_METRICS_LISTEN"].rpartition(":")[2]:
        yield "ccslice-proxy: asks for /readyz at another port"
    if int(slots) < overlay.get("HorizontalPodAutoscaler", "ccsliced")["spec"]["maxReplicas"]:
        yield "ccslice-proxy: has room for fewer servers than there may be"
    limits = pod_of(overlay.get("Deployment", "ccslice-proxy"))["containers"][0]["resources"]["limits"]
    if int(re.search(r"nbthread (\d+)", config).group(1)) > cpus_of(limits["cpu"]):
        yield "ccslice-proxy: more threads than processors"
    # Buffers for both sides of a connection, and a million entries of the table.
    if int(re.search(r"maxconn (\d+)", config).group(1)) * 64 * 1024 + MIB * 128 > size_of(limits["memory"]):
        yield "ccslice-proxy: connections and table take more than its memory"
    if overlay.options.get("CCSLICE_MAX_CONNECTIONS_PER_ADDRESS") != overlay.options.get("CCSLICE_MAX_CONNECTIONS"):
        yield "ccsliced: turns the proxies' connections away"


# --- The farm ---------------------------------------------------------------------------------------------------------


def farm_complete(overlay):
    shares, joins = overlay.get("Job", "ccslice-shares"), overlay.get("Job", "ccslice-join")
    if not shares:
        return
    config = overlay.get("ConfigMap", "ccslice-farm")["data"]
    if shares["spec"].get("completionMode") != "Indexed" or str(shares["spec"]["completions"]) != config["SHARES"]:
        yield f"ccslice-shares: {shares['spec']['completions']} pods for {config['SHARES']} shares"
    if shares["spec"]["activeDeadlineSeconds"] >= joins["spec"]["activeDeadlineSeconds"]:
        yield "ccslice-join: gives up before the shares do"
    for job in (shares, joins):
        if pod_of(job).get("restartPolicy") != "Never":
            yield f"{name_of(job)}: its policy of failures wants pods that aren't restarted"
        rules = {rule["action"]: rule for rule in job["spec"].get("podFailurePolicy", {}).get("rules", [])}
        codes = rules.get("FailJob", {}).get("onExitCodes", {})
        container = pod_of(job)["containers"][0]["name"]
        if codes.get("values") != [1, 2, 3, 4, 8] or codes.get("containerName") != container:
            yield f"{name_of(job)}: tries again what won't pass, or doesn't what may"
    claim = overlay.get("PersistentVolumeClaim", "ccslice-farm")
    if not claim or claim["spec"]["accessModes"] != ["ReadWriteMany"]:
        yield "the shares' volume is one node's alone"
    variables = {one["name"]: one["value"] for one in pod_of(shares)["containers"][0]["env"]}
    server = variables.get("CCSLICE_SERVER")
    if server != "ccsliced-headless:50051":
        yield f"ccslice-shares: {server} isn't the headless service"


RULES = (confined, bounded, pinned, volumes_there, variables_there, probed, server_probed, ends_in_time, options_known,
         files_mounted, identified, memory_fits, store_there, selectors_match, replicas_told_once, scaled_by_waits, disruption_bounded,
         figures_found, network_as_wanted, proxy_as_tested, farm_complete, *queue_policies.RULES)


def findings(name, objects):
    return broken_rules(RULES, Overlay(name, objects))
