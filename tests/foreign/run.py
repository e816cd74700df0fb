#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Runs a client in another language against a real server, and compares what it got with what the C++ client gets.

    run.py python|node CCSLICED CCSLICE
"""

import json
import os
import pathlib
import subprocess
import sys
import tempfile
import zlib

HERE = pathlib.Path(__file__).resolve().parent
PROTO = HERE.parents[1] / "proto"

sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE.parent / "support"))
from ccsliced_process import Server  # noqa: E402
import node_packages  # noqa: E402


def json_of(command, **options):
    return json.loads(subprocess.run(command, check=True, stdout=subprocess.PIPE, **options).stdout)


class Secured:
    """A certificate for localhost, its authority, and a token that may upload."""

    def __init__(self, ccsliced, folder):
        self.authority, self.token, self._folder = folder / "ca.pem", folder / "token", folder
        (folder / "names").write_text("subjectAltName=DNS:localhost,IP:127.0.0.1\n")
        key = ["-newkey", "rsa:2048", "-nodes"]
        self._openssl("req", "-x509", *key, "-days", "2", "-subj", "/CN=authority", "-keyout", "ca.key", "-out", "ca.pem")
        self._openssl("req", *key, "-subj", "/CN=localhost", "-keyout", "key.pem", "-out", "request.pem")
        self._openssl("x509", "-req", "-in", "request.pem", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-days",
                      "2", "-extfile", "names", "-out", "cert.pem")
        self.token.write_text("open-sesame\n")
        self.token.chmod(0o600)
        with open(self.token) as token, open(folder / "tokens", "w") as tokens:
            subprocess.run([ccsliced, "--hash-token", "foreign", "write"], stdin=token, stdout=tokens, check=True)

    def _openssl(self, *words):
        subprocess.run(["openssl", *words], cwd=self._folder, check=True, capture_output=True)

    def server_options(self):
        return ["--tls-cert", self._folder / "cert.pem", "--tls-key", self._folder / "key.pem", "--token-file",
                self._folder / "tokens"]


def python_client(address, folder, _, *secured):
    """Generates the stubs, then runs the example with them."""
    protos = [str(path) for path in sorted(PROTO.rglob("*.proto"))] + [str(HERE / "proto/reflection.proto")]
    subprocess.run(
        ["protoc", "-I", PROTO, "-I", HERE / "proto", f"--python_out={folder}", f"--grpc_python_out={folder}",
         "--plugin=protoc-gen-grpc_python=/usr/bin/grpc_python_plugin", *protos], check=True)
    environment = {**os.environ, "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
    return "stiffness", json_of(["/usr/bin/python3", HERE / "python/slice_bar.py", address, *secured], env=environment)


def node_client(address, folder, ccslice, *secured):
    """Makes a sample, then runs the example with it."""
    node = HERE / "node"
    node_packages.install(node)
    subprocess.run([ccslice, "models", "box", "-o", folder / "box.ccmesh", "--quiet"], check=True, stdout=sys.stderr)
    return "gradient", json_of(["node", node / "slice_file.js", address, folder / "box.ccmesh", "gradient", *secured])


def slice_with_ours(ccslice, address, folder, channel, got, *options):
    """The checksums of the same layers through the command line: {layer: [occupancy, channel]}."""
    layers = sorted(map(int, got["layers"]))
    subprocess.run(
        [ccslice, "slice", got["mesh_id"], "--server", address, "--pitch", str(got["pitch_mm"]), "--occupancy", "--channel",
         channel, "--encoding", "raw", "--layers", f"{layers[0]}..{layers[-1]}", "-o", folder / "ours", "--quiet", *options],
        check=True, stdout=sys.stderr)
    manifest = json.loads((folder / "ours/manifest.json").read_text())
    assert manifest["grid"]["layers"] == got["layer_count"]
    checksums = {}
    for layer in manifest["layers"]:
        checksums[str(layer["layer"])] = [plane["crc32"] for plane in layer["planes"]]
        for plane in layer["planes"]:
            assert zlib.crc32((folder / "ours" / plane["file"]).read_bytes()) == plane["crc32"]
    return checksums


def check(got, ours):
    assert "ccslice.v1.SlicerService" in got["services"], got["services"]
    assert got["layers"].keys() == ours.keys() and len(ours) > 1
    for layer, checksums in got["layers"].items():  # Several encodings of the channel: all decode to the same.
        assert checksums[0] == ours[layer][0] and set(checksums[1:]) == {ours[layer][1]}, (layer, checksums, ours[layer])
    assert abs(got["probed"][0] - 0.5) < 1e-6, got["probed"]
    failure = got["failure"]
    assert failure["code"] == "INVALID_ARGUMENT" and failure["reason"] == "PITCH_INVALID", failure
    assert failure["field"] == "job.grid.pitch.x_mm" and "x_mm" in failure["message"], failure


def main(language, ccsliced, ccslice):
    client = {"python": python_client, "node": node_client}[language]
    for with_tls in (False, True):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            secured = Secured(ccsliced, folder) if with_tls else None
            with Server(ccsliced, folder, *(secured.server_options() if secured else ())) as server:
                address = server.address()
                files = (secured.authority, secured.token) if secured else ()
                channel, got = client(address, folder, ccslice, *files)
                options = ("--ca", files[0], "--token-file", files[1]) if secured else ()
                check(got, slice_with_ours(ccslice, address, folder, channel, got, *options))
        print(f"{language}{', TLS and a token' if secured else ''}: {len(got['layers'])} layers, the same as through the "
              "command line")


if __name__ == "__main__":
    main(*sys.argv[1:])
