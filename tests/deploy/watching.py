# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Those who watch, with a real Prometheus that reads a real server with TLS and a Redis: every panel of the dashboard
has data, every rule works, the autoscaler's query says how many calls wait, the page has a line in the documentation for
each figure, and the store's alert comes and stays while nobody asks for a mesh."""

import contextlib
import json
import pathlib
import re
import time
import urllib.error
import urllib.parse
import urllib.request

import yaml

import dashboards
from brokers import Redis, program, running
from certificates import make_certificates
from free_port import free_port
from waiting import wait_for

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRAPED_S = 60  # Until Prometheus has what it needs, beside other work.
RATE = "10s"  # In place of Grafana's $__rate_interval.


def found_by_kubernetes(figures):
    """Targets as Kubernetes tells Prometheus of them, whose Debian package doesn't ask it: a pod as it is rendered, and
    one that has no figures to read (docs: kubernetes_sd_config)."""
    objects = yaml.safe_load_all((ROOT / "deploy/kubernetes/rendered/production.yaml").read_text())
    pod = next(one["spec"]["template"]["metadata"] for one in objects
               if one["kind"] == "Deployment" and one["metadata"]["name"] == "ccsliced")

    def target(name, metadata):
        texts = [("label", metadata["labels"]), ("annotation", metadata["annotations"])]
        labels = {f"__meta_kubernetes_pod_{kind}_{re.sub('[^a-zA-Z0-9_]', '_', key)}": value
                  for kind, several in texts for key, value in several.items()}
        return {"targets": ["127.0.0.1:1"],
                "labels": {"__meta_kubernetes_pod_ip": "127.0.0.1", "__meta_kubernetes_pod_name": name,
                           "__meta_kubernetes_namespace": "ours", **labels}}

    annotations = {**pod["annotations"], "prometheus.io/port": str(figures)}
    return [target("ccsliced-1", {**pod, "annotations": annotations}),
            target("ccsliced-2", {**pod, "annotations": {}}),
            target("ccslice-redis-1", {"labels": {}, "annotations": annotations})]


@contextlib.contextmanager
def prometheus(folder, figures):
    """With deploy/prometheus as in a cluster, but for who tells it of targets, and seconds for minutes."""
    config = yaml.safe_load((ROOT / "deploy/prometheus/kubernetes.yml").read_text())
    config["global"] = {"scrape_interval": "500ms", "evaluation_interval": "500ms"}
    del config["scrape_configs"][0]["kubernetes_sd_configs"]
    config["scrape_configs"][0]["static_configs"] = found_by_kubernetes(figures)
    (folder / "prometheus.yml").write_text(yaml.safe_dump(config))
    rules = (ROOT / "deploy/prometheus/rules.yml").read_text()
    (folder / "rules.yml").write_text(re.sub(r"for: (\d+)m", r"for: \1s", rules))
    port = free_port()
    with running([program("prometheus"), f"--config.file={folder}/prometheus.yml", f"--storage.tsdb.path={folder}/tsdb",
                  f"--web.listen-address=127.0.0.1:{port}"], port, folder / "prometheus.log"):
        yield Asked(port)


class Asked:
    """Prometheus' HTTP API."""

    def __init__(self, port):
        self._address = f"http://127.0.0.1:{port}/api/v1"

    def get(self, path, **query):
        try:
            with urllib.request.urlopen(f"{self._address}/{path}?{urllib.parse.urlencode(query)}") as answer:
                return json.load(answer)["data"]
        except urllib.error.HTTPError as error:
            return {"result": [], "error": error.read().decode()}

    def values(self, query):
        """[(labels, value), ...]; those that are no number are none."""
        found = [(one["metric"], float(one["value"][1])) for one in self.get("query", query=query)["result"]]
        return [(labels, value) for labels, value in found if value == value]

    def is_firing(self, alert):
        return bool(self.values(f'ALERTS{{alertname="{alert}",alertstate="firing"}}'))


def page_of(figures):
    return urllib.request.urlopen(f"http://127.0.0.1:{figures}/metrics").read().decode()


def undocumented(page):
    """Figures without a line of their own in docs/operating.md, and lines without a figure."""
    said = set(re.findall(r"^\| `(ccslice_\w+)", (ROOT / "docs/operating.md").read_text(), re.MULTILINE))
    there = set(re.findall(r"^# TYPE (\w+) ", page, re.MULTILINE))
    return sorted(said ^ there)


def use(client, ccslice, make_meshes):
    """Some calls of all kinds, good ones and bad ones."""
    meshes = make_meshes(ccslice)[:3]
    for mesh in meshes:
        list(client.slice(mesh, pitch=0.5))
        client.plan(mesh, pitch=0.5)
    try:
        client.plan(meshes[0], pitch=1e-9)
    except ccslice.CallError:
        pass


def adapter_query():
    """What prometheus-adapter asks by deploy/kubernetes (docs/config.md of its own): (name of the metric, query)."""
    text = (ROOT / "deploy/kubernetes/components/scaling-by-waits/adapter.yaml").read_text()
    rule, = yaml.safe_load(text)["rules"]
    series, = re.findall(r"^(\w+)\{", rule["seriesQuery"])
    filled = {"Series": series, "LabelMatchers": 'namespace="ours",pod=~"ccsliced-1"', "GroupBy": "pod"}
    return rule["name"]["as"], re.sub(r"<<\.(\w+)>>", lambda match: filled[match[1]], rule["metricsQuery"])


def without_data(asked):
    """Panels of the dashboards that show nothing."""
    found = []
    for dashboard in dashboards.dashboards().values():
        for title, query in dashboards.queries(dashboard, RATE):
            if not wait_for(lambda: asked.values(query), SCRAPED_S):
                found.append(f"{title}: {asked.get('query', query=query)}: {query}")
    return found


def run(row, ccsliced, ccslice, make_meshes, folder):
    folder = folder / "watching"
    folder.mkdir()
    findings = dashboards.findings()
    row("dashboards as documented", "; ".join(findings)[:200] or "yes", not findings)
    make_certificates(folder, "127.0.0.1")
    port, figures = free_port(), free_port()
    with Redis(folder) as redis, running(
            [ccsliced, "--listen", f"127.0.0.1:{port}", "--log-format", "json", "--log-level", "warning",
             "--metrics-listen", f"127.0.0.1:{figures}", "--mesh-store", f"redis://127.0.0.1:{redis.port}/0", "--tls-cert",
             folder / "tls.crt", "--tls-key", folder / "tls.key", "--tls-client-ca", folder / "ca.crt"],
            port, folder / "server.log"):
        with prometheus(folder, figures) as asked, ccslice.Client(
                f"127.0.0.1:{port}", ca=folder / "ca.crt", cert=folder / "client.crt",
                key=folder / "client.key") as client:
            watch(row, asked, redis, figures, lambda: use(client, ccslice, make_meshes))
        log = (folder / "server.log").read_text()
    audited = [json.loads(line) for line in log.splitlines() if '"event":"audit"' in line]
    uploads = [line for line in audited if line["action"] == "uploaded" and line["client"] == "certificate cadbox"]
    row("audit lines at level warning", f"{len(uploads)} uploads of cadbox", len(uploads) == 3 and '"method"' not in log)


def watch(row, asked, redis, figures, use_it):
    wait_for(lambda: asked.values('up{job="ccslice"} == 1'), SCRAPED_S)
    end = time.monotonic() + 5
    while time.monotonic() < end:
        use_it()
        time.sleep(0.5)
    shown = sum(len(dashboards.queries(one, RATE)) for one in dashboards.dashboards().values())
    empty = without_data(asked)
    print(*empty, sep="\n", end="\n" if empty else "")
    row("panels with data", f"{shown - len(empty)} of {shown}", not empty)

    scraped = asked.get("targets", state="active")["activeTargets"]
    row("pods that are read in a cluster", " ".join(one["labels"].get("pod", "?") for one in scraped),
        [one["labels"].get("pod") for one in scraped] == ["ccsliced-1"])

    rules = [rule for group in asked.get("rules")["groups"] for rule in group["rules"]]
    ill = [rule["name"] for rule in rules if rule["health"] != "ok"]
    row("rules that work", f"{len(rules) - len(ill)} of {len(rules)}", rules and not ill)

    name, query = adapter_query()
    (labels, value), = asked.values(query) or [({}, -1)]
    row("the autoscaler's figure", f"{name} of {labels.get('pod')}: {value:g}", labels == {"pod": "ccsliced-1"} and value >= 0)

    missing = undocumented(page_of(figures))
    row("figures with a line in docs/operating.md", " ".join(missing) or "all", not missing)

    row("the store, while it is there", f"up {asked.values('ccslice_store_up')[0][1]:g}",
        asked.values("ccslice_store_up")[0][1] == 1 and not asked.is_firing("CcsliceStoreGone"))
    redis.kill()
    fires = wait_for(lambda: asked.is_firing("CcsliceStoreGone"), SCRAPED_S)
    ended = fires and wait_for(lambda: not asked.is_firing("CcsliceStoreGone"), 15)
    row("its alert, while nobody asks", "fires on" if fires and not ended else "doesn't", fires and not ended)
    redis.start()
    row("its alert, once it is back", "ends", wait_for(lambda: not asked.is_firing("CcsliceStoreGone"), SCRAPED_S))
