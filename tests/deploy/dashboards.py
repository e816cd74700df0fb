# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""What Grafana's documentation asks of a dashboard's JSON ("Dashboard JSON model", and the schema of its release 10,
kinds/dashboard/dashboard_kind.cue) and of the files that provision it ("Provision Grafana"). Each check yields what is
wrong, in words."""

import copy
import json
import pathlib
import re

import yaml

from rules import broken_rules

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / "deploy/grafana"

# Fields by kind, those first that have to be there.
DASHBOARD = (("title", "uid", "schemaVersion", "panels", "templating", "time"),
             ("id", "description", "tags", "timezone", "editable", "graphTooltip", "refresh", "version", "links",
              "annotations", "timepicker", "weekStart", "fiscalYearStartMonth", "liveNow"))
PANEL = (("id", "type", "title", "gridPos", "datasource", "targets", "fieldConfig", "options"),
         ("description", "transformations", "transparent", "links", "interval", "maxDataPoints", "repeat",
          "repeatDirection", "timeFrom", "timeShift", "pluginVersion"))
ROW = (("id", "type", "title", "gridPos", "collapsed", "panels"), ("repeat", "datasource"))
FIELD = ((), ("unit", "decimals", "min", "max", "color", "thresholds", "mappings", "noValue", "displayName", "custom",
              "links", "description", "filterable"))
TARGET = (("refId", "datasource", "expr"), ("legendFormat", "instant", "range", "format", "hide", "interval", "exemplar",
                                            "editorMode"))
VARIABLE = (("name", "type", "query"),
            ("label", "datasource", "definition", "refresh", "sort", "multi", "includeAll", "allValue", "current", "hide",
             "skipUrlSync", "regex", "options", "description"))
TYPES = ("stat", "timeseries", "table")  # Of panels that come with Grafana.
CUSTOM = ("drawStyle", "lineWidth", "fillOpacity", "showPoints", "stacking")
COLORS = ("thresholds", "palette-classic", "fixed")


def fields_known(name, thing, fields):
    needed, more = fields
    yield from (f"{name}: {field} is missing" for field in needed if field not in thing)
    yield from (f"{name}: nobody knows the field {field}" for field in thing if field not in needed + more)


def panels_of(dashboard):
    return [panel for panel in dashboard["panels"] if panel["type"] != "row"]


def whole(dashboard):
    yield from fields_known("dashboard", dashboard, DASHBOARD)
    if not re.fullmatch(r"[\w-]{1,40}", dashboard["uid"]) or not isinstance(dashboard["schemaVersion"], int):
        yield "dashboard: its uid or its schemaVersion is none"
    if set(dashboard["time"]) != {"from", "to"}:
        yield "dashboard: shows no time"
    identifiers = [panel["id"] for panel in dashboard["panels"]]
    if len(set(identifiers)) != len(identifiers):
        yield "dashboard: two panels have the same id"
    for variable in dashboard["templating"]["list"]:
        yield from fields_known(f"variable {variable.get('name')}", variable, VARIABLE)


def in_the_grid(dashboard):
    taken = {}
    for panel in dashboard["panels"]:
        place, title = panel["gridPos"], panel["title"]
        if set(place) != {"x", "y", "w", "h"} or min(place.values()) < 0 or not 0 < place["w"] <= 24 - place["x"]:
            yield f"{title}: its place is {place}"
            continue
        for x in range(place["x"], place["x"] + place["w"]):
            for y in range(place["y"], place["y"] + place["h"]):
                if taken.setdefault((x, y), title) != title:
                    yield f"{title} covers {taken[x, y]}"
                    return


def panels_complete(dashboard):
    for panel in dashboard["panels"]:
        name = panel.get("title")
        yield from fields_known(name, panel, ROW if panel["type"] == "row" else PANEL)
        if panel["type"] == "row":
            continue
        if panel["type"] not in TYPES:
            yield f"{name}: {panel['type']} doesn't come with Grafana"
        defaults, overrides = panel["fieldConfig"]["defaults"], panel["fieldConfig"]["overrides"]
        yield from fields_known(f"{name}, fields", defaults, FIELD)
        if overrides or any(field not in CUSTOM for field in defaults.get("custom", {})):
            yield f"{name}: has settings that aren't looked at here"
        if defaults.get("color", {"mode": "fixed"})["mode"] not in COLORS:
            yield f"{name}: {defaults['color']} is no colour"
        steps = defaults.get("thresholds", {"mode": "absolute", "steps": [{"value": None}]})["steps"]
        values = [step["value"] for step in steps]
        if values[0] is not None or values[1:] != sorted(values[1:]):
            yield f"{name}: thresholds begin with one without a value, and rise"


def queries_complete(dashboard):
    variables = {variable["name"]: variable for variable in dashboard["templating"]["list"]}
    if variables["datasource"]["type"] != "datasource" or variables["datasource"]["query"] != "prometheus":
        yield "datasource is no variable of Prometheus' data sources"
    for panel in panels_of(dashboard):
        name, references = panel["title"], [target["refId"] for target in panel["targets"]]
        if len(set(references)) != len(references) or not references:
            yield f"{name}: its queries are {references}"
        for target in panel["targets"]:
            yield from fields_known(f"{name}, query", target, TARGET)
            if target["datasource"] != {"type": "prometheus", "uid": "${datasource}"}:
                yield f"{name}: asks {target['datasource']}"
            unknown = set(re.findall(r"\$(\w+)", target["expr"])) - set(variables) - {"__rate_interval"}
            if unknown:
                yield f"{name}: {unknown} is no variable"
            if "job=\"ccslice\"" not in target["expr"] and "ALERTS" not in target["expr"]:
                yield f"{name}: asks for figures of others"


RULES = (whole, in_the_grid, panels_complete, queries_complete)


def provisioned():
    """What Grafana reads at its start, and whether it finds the data source and the dashboards."""
    source, = yaml.safe_load((FOLDER / "provisioning/datasources/prometheus.yaml").read_text())["datasources"]
    if source["type"] != "prometheus" or source["access"] != "proxy" or not source["url"].startswith("http://"):
        yield f"the data source is {source}"
    config = yaml.safe_load((FOLDER / "provisioning/dashboards/ccslice.yaml").read_text())
    provider, = config["providers"]
    if config["apiVersion"] != 1 or provider["type"] != "file" or not provider["options"]["path"].startswith("/"):
        yield f"dashboards come from {provider}"


def dashboards():
    return {path.name: json.loads(path.read_text()) for path in sorted((FOLDER / "dashboards").glob("*.json"))}


def queries(dashboard, rate_interval):
    """(title, query) of all panels, as Grafana asks when all servers are chosen."""
    return [(panel["title"], target["expr"].replace("$__rate_interval", rate_interval).replace("$instance", ".*"))
            for panel in panels_of(dashboard) for target in panel["targets"]]


def _broken(dashboard):
    """(what to do to a dashboard, words of a finding)."""
    first = panels_of(dashboard)[0]
    return (
        (lambda: dashboard.update(titel="x"), "nobody knows the field titel"),
        (lambda: dashboard.pop("schemaVersion"), "schemaVersion is missing"),
        (lambda: first.update(id=panels_of(dashboard)[1]["id"]), "the same id"),
        (lambda: first.update(gridPos={**first["gridPos"], "w": 25}), "its place is"),
        (lambda: first.update(gridPos={**first["gridPos"], "x": first["gridPos"]["x"] + 1}), "covers"),
        (lambda: first.update(type="graph3d"), "doesn't come with Grafana"),
        (lambda: first.pop("options"), "options is missing"),
        (lambda: first["fieldConfig"]["defaults"].update(units="s"), "nobody knows the field units"),
        (lambda: first["fieldConfig"]["defaults"]["thresholds"]["steps"].reverse(), "thresholds begin"),
        (lambda: first["targets"][0].update(datasource={"uid": "x"}), "asks"),
        (lambda: first["targets"][0].update(expr='x{job="ccslice"} > $y'), "is no variable"),
        (lambda: first["targets"][0].update(expr="up"), "figures of others"),
    )


def findings():
    """What is wrong with all that is shipped, and what these checks don't notice."""
    found = [f"provisioning: {words}" for words in provisioned()]
    for name, dashboard in dashboards().items():
        found += [f"{name}: {words}" for words in broken_rules(RULES, dashboard)]
        for i in range(len(_broken(dashboard))):
            changed = copy.deepcopy(dashboard)
            change, words = _broken(changed)[i]
            change()
            if not any(words in one for one in broken_rules(RULES, changed)):
                found.append(f"{name}: nobody notices what should be '{words}'")
    return found
