#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Runs every command with --json and compares what it prints, and the files that it writes, with docs/schemas.

    check_json.py CCSLICED CCSLICE
"""

import json
import pathlib
import re
import signal
import subprocess
import sys
import tempfile

import jsonschema

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
SCHEMAS = REPOSITORY / "docs/schemas"
sys.dont_write_bytecode = True
sys.path.insert(0, str(REPOSITORY / "tests/support"))
from ccsliced_process import Server  # noqa: E402

MATERIALS = ["--material", "soft=#101010", "--material", "hard=#f0f0f080"]
BLEND = "blend:gradient:0=soft,1=hard"
MAPS = [[BLEND], ["direct:gradient=hard,rest=soft"], ["calibration:gradient:hard/soft:0=0,1=0.5"], ["material:hard"],
        ["colour:gradient,gradient,gradient"], ["region:lower=" + BLEND, "region:upper=soft"]]
COLOUR = re.compile("#[0-9a-f]{8}")


def require(condition, what):
    if not condition:
        sys.exit(f"check_json.py: {what}")


def schema(name):
    return json.loads((SCHEMAS / f"{name}.json").read_text(encoding="utf-8"))


def validate(document, name, seen):
    seen.add(name)
    resolver = jsonschema.RefResolver(f"{SCHEMAS.as_uri()}/{name}.json", schema(name))
    errors = list(jsonschema.Draft202012Validator(schema(name), resolver=resolver).iter_errors(document))
    where = errors and "/".join(map(str, errors[0].absolute_path))
    require(not errors, f"{name}: at '{where}': {errors and errors[0].message}")
    require_colours(document, name)


def require_colours(document, name):
    """Wherever a colour is, it has the one form; but for jobs, which are protobuf's own JSON."""
    for key, value in document.items() if isinstance(document, dict) else enumerate(document):
        if str(key).endswith("rgba"):
            require(COLOUR.fullmatch(value), f"{name}: the colour {value}")
        elif isinstance(value, (dict, list)) and key != "slice_job":
            require_colours(value, name)


class Commands:

    def __init__(self, ccslice, address, folder):
        self._start = [ccslice]
        self._server = ["--server", address]
        self._folder = folder
        self.seen = {"common"}

    def run(self, name, command, *words, exit_code=0, local=False):
        words = [command, *map(str, words), "--json", *([] if local else self._server)]
        result = subprocess.run(self._start + words, cwd=self._folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        require(result.returncode == exit_code, f"{words}: exit {result.returncode}: {result.stderr.decode()}")
        document = json.loads(result.stdout)
        validate(document, name, self.seen)
        return document

    def run_until_it_speaks(self, name, *words):
        """Of a command that goes on, what it prints first."""
        command = self._start + [*words, "--json", *self._server]
        with subprocess.Popen(command, cwd=self._folder, stdout=subprocess.PIPE) as process:
            line = process.stdout.readline()
            process.send_signal(signal.SIGINT)
        require(process.returncode == 0, f"{words}: exit {process.returncode}")
        validate(json.loads(line), name, self.seen)

    def give_regions(self, path, to):
        """Halves of its cells."""
        mesh = json.loads((self._folder / path).read_text(encoding="utf-8"))
        cells = len(mesh["cellKinds"])
        mesh["cellRegionNames"] = ["lower", "upper"]
        mesh["cellRegions"] = [2 * cell // cells for cell in range(cells)]
        (self._folder / to).write_text(json.dumps(mesh), encoding="utf-8")

    def validate_file(self, name, path):
        document = json.loads((self._folder / path).read_text(encoding="utf-8"))
        validate(document, name, self.seen)
        return document


def check_meshes(commands):
    commands.run("models-list", "models", local=True)
    commands.run("models", "models", "box", local=True)
    require(len(commands.run("printers", "printers", local=True)) > 1, "there are few printers")
    commands.run("convert", "convert", "box.ccmesh", "-o", "box.json", local=True)
    commands.give_regions("box.json", "regions.json")
    require(commands.run("info-file", "info", "regions.json", local=True)["cell_regions"], "no regions")
    require("deviation" in commands.run("info-file", "info", "regions.json", "--full", local=True), "not in full")
    mesh = commands.run("upload", "upload", "box.ccmesh")["mesh"]["mesh_id"]
    commands.run("info-mesh", "info", mesh)
    commands.run("info-meshes", "info", "--meshes")
    server = commands.run("info-server", "info")
    require(server["printer_profiles"] == commands.run("printers", "printers", local=True), "two forms of printers")


def check_answers(commands):
    answers = commands.run("probe", "probe", "box.ccmesh", "--at", "6,8,4", "--at=-9,0,0")
    require([answer["location"] for answer in answers] == ["inside", "outside"], answers)
    drawn = commands.run("picture", "picture", "box.ccmesh", "--channel", "gradient", "--terminal")
    require("@@@" in drawn["characters"], drawn)
    require("costs" not in commands.run("plan", "plan", "box.ccmesh", "--pitch", "1"), "costs that nobody asked for")
    costs = commands.run("plan", "plan", "box.ccmesh", "--pitch", "1", *MATERIALS, "--map", BLEND, "--costs")["costs"]
    require(costs["sampled_layers"] == 8 and len(costs["materials"]) == 2, costs)
    warned = commands.run("plan", "plan", "box.ccmesh", "--pitch", "1", "--extent", "3,3,3")
    require([warning["kind"] for warning in warned["warnings"]] == ["part_clipped"], warned)
    commands.run("export", "export", "box.ccmesh", "-o", "box.stl")
    commands.run("picture", "picture", "box.ccmesh", "--plane", "z=2", "--channel", "gradient", "--pixels", "32", "-o",
                 "plane.png")
    commands.run("picture", "picture", "box.ccmesh", "--layer", "1", "--pitch", "0.5", *MATERIALS, "--map", BLEND, "-o",
                 "layer.png")
    commands.run("picture", "picture", "box.ccmesh", "--sweep", "3", "-o", "sweep.png")
    commands.run("picture", "picture", "box.ccmesh", "--voxels", "16", "--pixels", "32", "-o", "box.png")
    commands.run_until_it_speaks("view", "view", "box.ccmesh", "--no-open")
    for command in (["plan", "box.ccmesh", "--pitch=-1"], ["models", "teapot"], ["slice"]):
        failure = commands.run("error", *command, exit_code=2, local=command[0] == "models")
        require(failure["error"]["exit_code"] == 2, failure)


def check_slices(commands):
    job = ["box.ccmesh", "--pitch", "1", "--contours", "json", "--occupancy", "--channel", "gradient:u16", "-o", "planes"]
    commands.run("slice", "slice", *job)
    manifest = commands.validate_file("manifest", "planes/manifest.json")
    require("materials" not in manifest, "materials of nothing")
    for layer in manifest["layers"]:
        commands.validate_file("contours", "planes/" + layer["contours"]["file"])
    require(commands.run("slice", "slice", *job, "--resume")["complete_before"], "a finished job isn't done again")
    for number in "12":
        share = ["box.ccmesh", "--pitch", "0.25", *MATERIALS, "--map", BLEND, "--share", f"{number}/2", "-o", f"share-{number}"]
        require(commands.run("slice", "slice", *share)["share"]["job"]["layers"] == 32, "layers of a share")
        commands.validate_file("manifest", f"share-{number}/manifest.json")
        commands.run("slice", "slice", *share, "--resume")
    commands.run("join", "join", "share-2", "share-1", "-o", "joined", local=True)
    require("share" not in commands.validate_file("manifest", "joined/manifest.json"), "a share of what was joined")
    commands.run("error", "join", "share-2", "-o", "half", local=True, exit_code=3)
    if "exr" in commands.run("info-server", "info")["encodings"]:  # A build without OpenImageIO has none.
        commands.run("slice", "slice", "box.ccmesh", "--pitch", "1", "--all-channels", "--no-contact-sheet", "-o", "exr")
        names = commands.validate_file("manifest", "exr/manifest.json")["planes"][0]
        require("channels" in names, "no names of channels")
    for number, maps in enumerate(MAPS):
        mesh = "regions.json" if len(maps) > 1 else "box.ccmesh"
        options = [word for text in maps for word in ("--map", text)]
        commands.run("slice", "slice", mesh, "--pitch", "1", *MATERIALS, *options, "--masks", "-o", f"printed-{number}")
        materials = commands.validate_file("manifest", f"printed-{number}/manifest.json")["materials"]
        require([m["rgba"] for m in materials] == ["#101010ff", "#f0f0f080"], materials)
    commands.run("slice", "slice", "box.ccmesh", "--format", "grabcad", "--dpi", "60", "--layer-height", "0.5",
                 "--material", "VeroCY-V", "-o", "grabcad")
    commands.run("package", "package", "grabcad", "-o", "box.gcvf")


def check_trays(commands):
    packed = commands.run("tray-pack", "tray", "pack", "box.ccmesh", "--copies", "3", "--printer", "j750-hm", "-o",
                          "tray.json")
    require(packed["parts"] == [{"name": "box", "placements": 3}], packed)
    commands.run("tray-export", "tray", "export", "tray.json", "-o", "tray.3mf")
    imported = commands.run("tray-import", "tray", "import", "tray.3mf", "--job", "tray.json", "-o", "again.json")
    require(imported["parts"] == packed["parts"] and imported["left_out"] == 0, imported)


def main(ccsliced, ccslice):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        with Server(ccsliced, folder) as server:
            commands = Commands(ccslice, server.address(), folder)
            check_meshes(commands)
            check_answers(commands)
            check_slices(commands)
            check_trays(commands)
    schemas = {path.stem for path in SCHEMAS.glob("*.json")}
    require(schemas == commands.seen, f"schemas that nothing was compared with: {schemas - commands.seen}")
    print(f"{len(schemas)} schemas: the documents fit")


main(*sys.argv[1:])
