#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What deploy/compose.yaml says, without a Docker engine: who belongs to which profile, how services are confined and
bounded, what they wait for, and the scripts in it. docker-compose has to take the file.

Exit code 1 if anything is wrong, 77 if nothing is but docker-compose isn't here."""

import copy
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time

import yaml

sys.dont_write_bytecode = True
sys.path[:0] = [str(pathlib.Path(__file__).resolve().parents[1] / "support")]

from free_port import free_port  # noqa: E402
from objects import seconds_of, size_of  # noqa: E402
from policies import known_variables, memory_needed  # noqa: E402
from rules import broken_rules  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
FILE = ROOT / "deploy/compose.yaml"
PROFILES = {
    "one": {"ccsliced"},
    "farm": {"ccsliced-1", "ccsliced-2", "mesh-store", "queue", "haproxy", "prometheus", "worker-1", "worker-2"},
    "watch": {"grafana"},
}
PORTS = {"ccsliced": "127.0.0.1:50051:50051", "haproxy": "127.0.0.1:50052:50052", "prometheus": "127.0.0.1:9090:9090",
         "grafana": "127.0.0.1:3000:3000"}
SERVERS = ("ccsliced", "ccsliced-1", "ccsliced-2")
SKIPPED = 77


def confined(services):
    for name, one in services.items():
        if one.get("read_only") is not True or one.get("cap_drop") != ["ALL"] or one.get("privileged"):
            yield f"{name} isn't confined"
        if one.get("security_opt") != ["no-new-privileges:true"]:
            yield f"{name} may gain privileges"
        if re.match(r"(0|root)\b", one.get("user", "0")):
            yield f"{name} is root"
        if not one.get("mem_limit") or not one.get("cpus") or not one.get("pids_limit"):
            yield f"{name} isn't bounded"
        if one.get("ports", []) != [port for who, port in PORTS.items() if who == name]:
            yield f"{name} has the ports {one.get('ports')}"
        if not one.get("healthcheck", {}).get("test"):
            yield f"nobody asks for the health of {name}"


def in_profiles(services):
    for profile, names in PROFILES.items():
        found = {name for name, one in services.items() if one.get("profiles") == [profile]}
        if found != names:
            yield f"profile {profile} is {sorted(found)}"
    for name, one in services.items():
        if len(one.get("profiles", [])) != 1:
            yield f"{name} is in {one.get('profiles')}"


def images_known(services):
    targets = set(re.findall(r"^FROM \S+ AS (\S+)$", (ROOT / "Dockerfile").read_text(), re.MULTILINE))
    kubernetes = "".join(path.read_text() for path in sorted((ROOT / "deploy/kubernetes/rendered").glob("*.yaml")))
    for name, one in services.items():
        if one["image"].startswith("ccslice/"):
            if one["build"]["target"] not in targets or one["image"] != f"ccslice/{one['build']['target']}":
                yield f"{name}: {one['image']} isn't what is built"
            continue
        if not re.search(r":v?\d+\.\d+\.\d+", one["image"]):
            yield f"{name}: {one['image']} has no version"
        if one["image"].split(":")[0] in ("redis", "haproxy") and f"image: {one['image']}\n" not in kubernetes:
            yield f"{name}: {one['image']} isn't that of deploy/kubernetes"


def waits_for_health(services):
    for name, one in services.items():
        for other, how in one.get("depends_on", {}).items():
            if other not in services or services[other]["profiles"] != one["profiles"]:
                yield f"{name} waits for {other}, which isn't started"
            if how != {"condition": "service_healthy"}:
                yield f"{name} doesn't wait until {other} works"


def servers_set_up(services):
    for name in SERVERS:
        one = services[name]
        options = one["environment"]
        yield from (f"{name}: ccsliced has no option {option}" for option in options if option not in known_variables())
        delay, grace = options.get("CCSLICE_DRAIN_DELAY", "0s"), options.get("CCSLICE_SHUTDOWN_GRACE", "25s")
        grace = seconds_of(delay) + seconds_of(grace)
        if grace + 5 > seconds_of(one["stop_grace_period"]):
            yield f"{name}: delay and grace take {grace} s"
        if memory_needed(options, size_of(one["mem_limit"])) > size_of(one["mem_limit"]):
            yield f"{name}: its budgets take more than its limit"
    for name in SERVERS[1:]:
        options = services[name]["environment"]
        if options.get("CCSLICE_MESH_STORE") != "redis://mesh-store:6379/0":
            yield f"{name}: shares no meshes"
        folder = options.get("CCSLICE_MESH_STORE_PASSWORD_FILE", "").removesuffix("/password")
        if f"mesh-store-password:{folder}:ro" not in services[name].get("volumes", []):
            yield f"{name}: doesn't know the password of the store"
        if not options.get("CCSLICE_METRICS_LISTEN", "").endswith(":9464"):
            yield f"{name}: nobody can ask whether it is ready"


def redis_bounded(services):
    for name, policy, most in (("mesh-store", "allkeys-lru", 0.8), ("queue", "noeviction", 0.5)):
        script = services[name]["command"][-1]
        command = shlex.split(script[script.index("exec redis-server"):].replace("\\\n", ""))
        settings = dict(zip(command[3::2], command[4::2]))
        if settings.get("--maxmemory-policy") != policy:
            yield f"{name}: forgets by {settings.get('--maxmemory-policy')}"
        limit = most * size_of(services[name]["mem_limit"])
        if "--maxmemory" not in settings or size_of(settings["--maxmemory"]) > limit:
            yield f"{name}: takes more than its limit"
    queue = services["queue"]
    if "queue:/data" not in queue.get("volumes", []) or "--appendonly yes" not in queue["command"][-1]:
        yield "queue: is lost with its container"


def workers_set_up(services):
    for name in ("worker-1", "worker-2"):
        one = services[name]
        if "farm-jobs:/jobs" not in one["volumes"]:
            yield f"{name}: sees no jobs"
        if one["environment"]["CCSLICE_FARM_BROKER"] != "redis://:${CCSLICE_QUEUE_PASSWORD:-}@queue:6379/1":
            yield f"{name}: has no queue"
        if one["environment"]["CCSLICE_SERVER"] != "haproxy:50052":
            yield f"{name}: goes around the proxy"


def script_of(command, folder):
    """With folders of this test's for those of the container."""
    places = {"$$": "$", "/tmp/": f"{folder}/made-", "/etc/ccslice": str(folder), "/data": str(folder)}
    text = command[-1]
    for place, mine in places.items():
        text = text.replace(place, mine)
    return [*command[:-1], text]


def run_script(command, folder):
    """As a container would, but for the program at the end."""
    *shell, text = script_of(command, folder)
    subprocess.run([*shell, re.sub(r"^exec .*", "", text, flags=re.MULTILINE)], check=True)


def redis_answers(service, folder, password):
    """What Redis says to whoever knows no password, and whether it is healthy, once it answers."""
    port = free_port()
    *shell, text = script_of(service["command"], folder)
    environment = {**os.environ, "QUEUE_PASSWORD": password}
    server = subprocess.Popen([*shell, text.replace("--appendonly", f"--port {port} --bind 127.0.0.1 --appendonly", 1)],
                              env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        for _ in range(100):
            said = subprocess.run(["redis-cli", "-p", str(port), "ping"], text=True, capture_output=True).stdout
            if said or server.poll() is not None:
                break
            time.sleep(0.05)
        *_, health = script_of(service["healthcheck"]["test"], folder)
        healthy = subprocess.run(health.replace("redis-cli", f"redis-cli -p {port}"), shell=True, env=environment,
                                 capture_output=True).returncode == 0
        running = server.poll() is None
    finally:
        server.terminate()
        complaint = server.communicate()[1]
    return said if running else complaint, healthy


def redis_locked(services):
    """Both want a password: that of meshes the one that it made at its first start, the other one that it was given."""
    if not shutil.which("redis-server"):
        print("not looked at: Redis, which isn't here")
        return
    with tempfile.TemporaryDirectory() as temporary:
        folders = [pathlib.Path(temporary) / name for name in ("mesh-store", "queue")]
        for folder, password in zip(folders, ("", "aSecretWord1")):
            folder.mkdir()
            for _ in range(2):
                said, healthy = redis_answers(services[folder.name], folder, password)
                if "NOAUTH" not in said or not healthy:
                    yield f"{folder.name}: answers {said!r}, and is {'' if healthy else 'not '}healthy"
                kept = folder / "password"
                password = password or kept.read_text()
        if not re.fullmatch(r"[0-9a-f]{48}", kept_word := (folders[0] / "password").read_text()):
            yield f"mesh-store: its password is {kept_word!r}"
        for bad in ("", "a/word", "a@word"):
            said, healthy = redis_answers(services["queue"], folders[1], bad)
            if "takes letters and digits" not in said or healthy:
                yield f"queue: takes the password {bad!r}, and says {said!r}"


def grafana_provisioned(services):
    """It has what deploy/grafana names, and nobody may change anything."""
    one = services["grafana"]
    options = one["environment"]
    if options.get("GF_AUTH_ANONYMOUS_ORG_ROLE") != "Viewer" or (
            options.get("GF_SECURITY_DISABLE_INITIAL_ADMIN_CREATION") != "true"):
        yield "grafana: somebody may change it"
    folders = {volume.split(":")[1]: volume.split(":")[0] for volume in one["volumes"]}
    if folders.get("/etc/grafana/provisioning") != "./grafana/provisioning":
        yield "grafana: isn't provisioned"
    provider, = yaml.safe_load((ROOT / "deploy/grafana/provisioning/dashboards/ccslice.yaml").read_text())["providers"]
    if folders.get(provider["options"]["path"]) != "./grafana/dashboards":
        yield f"grafana: finds no dashboards in {provider['options']['path']}"
    source, = yaml.safe_load((ROOT / "deploy/grafana/provisioning/datasources/prometheus.yaml").read_text())["datasources"]
    if source["url"] != "http://prometheus:9090" or "prometheus" not in services:
        yield f"grafana: asks {source['url']}"


def scripts_work(services):
    """HAProxy and Prometheus take what the scripts make of files that are tested."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        for file in ("proxies/haproxy.cfg", "prometheus/prometheus.yml", "prometheus/rules.yml"):
            shutil.copy(ROOT / "deploy" / file, folder)
        run_script(services["haproxy"]["command"], folder)
        run_script(services["prometheus"]["entrypoint"], folder)
        config = (folder / "made-haproxy.cfg").read_text()
        proxied = re.findall(r"^ +server \S+ (\S+):50051 port 9464", config, re.MULTILINE)
        scraped = yaml.safe_load((folder / "made-prometheus.yml").read_text())["scrape_configs"][0]
        if proxied != list(SERVERS[1:]):
            yield f"haproxy: sends calls to {proxied}"
        if scraped["static_configs"][0]["targets"] != [f"{name}:9464" for name in SERVERS[1:]]:
            yield f"prometheus: asks {scraped}"
        for program, *arguments in (("haproxy", "-c", "-f", folder / "made-haproxy.cfg"),
                                    ("promtool", "check", "config", folder / "made-prometheus.yml")):
            path = shutil.which(program, path="/usr/sbin:/usr/bin")
            if not path:
                print(f"not looked at: the configuration of {program}, which isn't here")
                continue
            done = subprocess.run([path, *arguments], text=True, capture_output=True)
            if done.returncode:
                yield f"{program}: {done.stdout}{done.stderr}"


def volumes_there(services, volumes):
    for name, one in services.items():
        for volume in one.get("volumes", []):
            source = volume.split(":")[0]
            if source.startswith("."):
                if not (FILE.parent / source).exists() or not volume.endswith(":ro"):
                    yield f"{name}: {volume} isn't there, or can be written"
            elif source not in volumes:
                yield f"{name}: there is no volume {source}"


RULES = (confined, in_profiles, images_known, waits_for_health, servers_set_up, redis_bounded, workers_set_up,
         grafana_provisioned)

# (service, path, value, words of a finding). Each breaks one thing.
GONE = object()
BREAKS = (
    ("ccsliced", ("profiles",), GONE, "profile one is"),
    ("ccsliced", ("ports",), ["50051:50051"], "has the ports"),
    ("ccsliced", ("mem_limit",), GONE, "isn't bounded"),
    ("ccsliced", ("mem_limit",), "2g", "budgets take more"),
    ("ccsliced", ("stop_grace_period",), "10s", "delay and grace"),
    ("ccsliced-1", ("environment", "CCSLICE_DRAIN_DELAY"), "30s", "delay and grace"),
    ("ccsliced-1", ("environment", "CCSLICE_MESH_STORE"), GONE, "shares no meshes"),
    ("ccsliced-1", ("environment", "CCSLICE_MESHSTORE"), "x", "no option"),
    ("ccsliced-1", ("environment", "CCSLICE_MESH_STORE_PASSWORD_FILE"), GONE, "doesn't know the password"),
    ("ccsliced-2", ("volumes",), [], "doesn't know the password"),
    ("grafana", ("environment", "GF_AUTH_ANONYMOUS_ORG_ROLE"), "Admin", "may change it"),
    ("grafana", ("volumes", 1), "./grafana/dashboards:/dashboards:ro", "finds no dashboards"),
    ("worker-1", ("environment", "CCSLICE_FARM_BROKER"), "redis://queue:6379/1", "has no queue"),
    ("ccsliced-1", ("build", "target"), "slim", "isn't what is built"),
    ("mesh-store", ("image",), "redis:7", "has no version"),
    ("mesh-store", ("command",), ["sh", "-c", "exec redis-server /tmp/redis.conf"], "takes more than its limit"),
    ("mesh-store", ("healthcheck",), GONE, "nobody asks"),
    ("queue", ("volumes",), [], "lost with its container"),
    ("haproxy", ("user",), "0:0", "is root"),
    ("haproxy", ("read_only",), GONE, "isn't confined"),
    ("haproxy", ("depends_on", "ccsliced-1"), {"condition": "service_started"}, "doesn't wait until"),
    ("worker-1", ("environment", "CCSLICE_SERVER"), "ccsliced-1:50051", "goes around"),
)


def findings(services):
    return broken_rules(RULES, services)


def check_breaks(services):
    for name, path, value, words in BREAKS:
        changed = copy.deepcopy(services)
        place = changed[name]
        for key in path[:-1]:
            place = place[key]
        if value is GONE:
            del place[path[-1]]
        else:
            place[path[-1]] = value
        noticed = findings(changed)
        if not any(words in one for one in noticed):
            yield f"nobody notices when {path} of {name} is {'gone' if value is GONE else value}: {noticed}"


def check_docker_compose(program, services):
    """It takes the file. Debian's lists all services, whatever the profile."""
    password = "aSecretWord1"
    given = json.loads(json.dumps(services).replace("${CCSLICE_QUEUE_PASSWORD:-}", password))
    for profile in PROFILES:
        done = subprocess.run([program, "--file", FILE, "--profile", profile, "config"], text=True, capture_output=True,
                              env={**os.environ, "CCSLICE_QUEUE_PASSWORD": password})
        if done.returncode or done.stderr:
            yield f"docker-compose: {done.stderr}"
            continue
        taken = yaml.safe_load(done.stdout)["services"]
        for name in PROFILES[profile]:
            if {key: taken[name].get(key) for key in ("image", "environment", "mem_limit")} != {
                    key: given[name].get(key) for key in ("image", "environment", "mem_limit")}:
                yield f"docker-compose understands {name} otherwise: {taken[name]}"


def main():
    document = yaml.safe_load(FILE.read_text())
    services = document["services"]
    found = [*findings(services), *volumes_there(services, document["volumes"]), *scripts_work(services),
             *redis_locked(services), *check_breaks(services)]
    program = shutil.which("docker-compose")
    if program:
        found += check_docker_compose(program, services)
    print(*found, sep="\n", end="\n" if found else "")
    if not found and not program:
        print("skipped: docker-compose isn't here to read the file (deploy/install.sh test)")
        sys.exit(SKIPPED)
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    main()
