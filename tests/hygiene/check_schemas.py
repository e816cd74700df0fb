#!/usr/bin/python3
# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
"""Compares docs/schemas with the messages of proto/ccslice/cli/v1, which they are made from.

    check_schemas.py            exits with 1 if they differ
    check_schemas.py --write    writes them
"""

import importlib
import json
import pathlib
import subprocess
import sys
import tempfile

from google.protobuf import descriptor_pb2

REPOSITORY = pathlib.Path(__file__).resolve().parents[2]
PROTO = REPOSITORY / "proto"
SCHEMAS = REPOSITORY / "docs/schemas"
PACKAGE = ".ccslice.cli.v1."
COLUMNS = 120
DRAFT = "https://json-schema.org/draft/2020-12/schema"

# Schema -> (title, message or messages). Those in brackets are items of an array.
DOCUMENTS = {
    "contours": ("The outlines of a layer: layer_N_contours.json", "LayerOutlines"),
    "convert": ("ccslice convert --json", "ConvertedMesh"),
    "error": ("What a command prints with --json if it fails", "FailureDocument"),
    "export": ("ccslice export --json", "BoundaryFile"),
    "info-file": ("ccslice info FILE --json", "FileDocument"),
    "info-mesh": ("ccslice info MESH_ID --json", "ServerMesh"),
    "info-meshes": ("ccslice info --meshes --json", ["ServerMesh"]),
    "info-server": ("ccslice info --json", "ServerDocument"),
    "join": ("ccslice join --json", "JoinedLayers"),
    "manifest": ("manifest.json in a folder of layers", "Manifest"),
    "models": ("ccslice models NAME --json", "MeshFile"),
    "models-list": ("ccslice models --json", ["Sample"]),
    "package": ("ccslice package --json", "PackageFile"),
    "picture": ("ccslice picture --json", "PictureDocument"),
    "plan": ("ccslice plan --json", "PlanDocument"),
    "printers": ("ccslice printers --json", ["Printer"]),
    "probe": ("ccslice probe --json", ["PointAnswer"]),
    "slice": ("ccslice slice --json", ("SlicedLayers", "CompleteLayers")),
    "tray-export": ("ccslice tray export --json", "TrayFile"),
    "tray-import": ("ccslice tray import --json", "ImportedTray"),
    "tray-pack": ("ccslice tray pack --json", "PackedTrayDocument"),
    "upload": ("ccslice upload --json", "UploadedMesh"),
    "view": ("ccslice view --json", "ViewAddress"),
}

# How names of fields end -> what their texts look like.
PATTERNS = {"mesh_id": "^sha256:[0-9a-f]{64}$", "sha256": "^[0-9a-f]{64}$", "rgba": "^#[0-9a-f]{8}$"}

Field = descriptor_pb2.FieldDescriptorProto
NUMBER = {"type": "number"}
COUNT = {"type": "integer", "minimum": 0}
PLAIN = {Field.TYPE_BOOL: {"type": "boolean"}, Field.TYPE_DOUBLE: NUMBER, Field.TYPE_UINT32: COUNT,
         Field.TYPE_UINT64: COUNT, Field.TYPE_FIXED32: COUNT}


def read_contract():
    """The files' descriptors, with comments, and the module of form.proto."""
    with tempfile.TemporaryDirectory() as folder:
        out = pathlib.Path(folder) / "contract.binpb"
        sources = sorted(map(str, (PROTO / "ccslice/cli/v1").glob("*.proto")))
        subprocess.run(["protoc", "-I", PROTO, f"--python_out={folder}", f"--descriptor_set_out={out}",
                        "--include_source_info", "--include_imports", *sources], check=True)
        sys.dont_write_bytecode = True
        sys.path.insert(0, folder)
        form = importlib.import_module("ccslice.cli.v1.form_pb2")
        return descriptor_pb2.FileDescriptorSet.FromString(out.read_bytes()), form


class Contract:

    def __init__(self):
        files, self._form = read_contract()
        self.messages, self._enums, self._comments = {}, {}, {}
        for file in files.file:
            comments = {tuple(place.path): " ".join(place.leading_comments.split()) for place in
                        file.source_code_info.location}
            for enum in file.enum_type:
                self._enums[f".{file.package}.{enum.name}"] = [value.name for value in enum.value]
            for number, message in enumerate(file.message_type):
                name = f".{file.package}.{message.name}"
                self.messages[name] = message
                self._comments[name] = [comments.get((4, number, 2, at), "") for at in range(len(message.field))]
                self._comments[name].append(comments.get((4, number), ""))

    def comment(self, name):
        return {"description": self._comments[name][-1]} if self._comments[name][-1] else {}

    def _is_required(self, name, message, field):
        if field.label == Field.LABEL_REPEATED:
            return not field.options.Extensions[self._form.unless_empty]
        if field.HasField("oneof_index"):
            return False  # That of an optional field too.
        return field.type != Field.TYPE_MESSAGE or name.startswith(PACKAGE)

    def _value(self, field):
        if field.options.Extensions[self._form.as_protobuf]:
            return {"type": "object"}
        if field.type == Field.TYPE_MESSAGE:
            return {"$ref": "common.json#/$defs/" + field.type_name.rsplit(".", 1)[1]}
        if field.type == Field.TYPE_ENUM:
            return {"enum": self._enums[field.type_name][1:]}
        if field.type == Field.TYPE_STRING:
            patterns = [pattern for end, pattern in PATTERNS.items() if field.name.endswith(end)]
            return {"type": "string", **({"pattern": patterns[0]} if patterns else {})}
        if field.options.Extensions[self._form.or_nan]:
            return {"anyOf": [NUMBER, {"const": "NaN"}]}
        return PLAIN[field.type]

    def _property(self, message, field):
        for entry in message.nested_type:
            if field.type_name.endswith(f".{message.name}.{entry.name}"):
                return {"type": "object", "additionalProperties": self._value(entry.field[1])}
        value = self._value(field)
        if field.label != Field.LABEL_REPEATED:
            return value
        items = field.options.Extensions[self._form.items]
        return {"type": "array", "items": value, **({"minItems": items, "maxItems": items} if items else {})}

    def schema(self, name):
        message = self.messages[name]
        if name == ".ccslice.v1.Vector3":
            return {"description": "Along x, y and z.", "type": "array", "items": NUMBER, "minItems": 3, "maxItems": 3}
        comments = self._comments[name]
        properties = {
            field.name: self._property(message, field) | ({"description": comments[at]} if comments[at] else {})
            for at, field in enumerate(message.field)
        }
        required = [field.name for field in message.field if self._is_required(name, message, field)]
        alternatives = [[{"required": [field.name]} for field in message.field
                         if field.HasField("oneof_index") and field.oneof_index == at and not field.proto3_optional]
                        for at in range(len(message.oneof_decl))]
        return {**self.comment(name), "type": "object", "properties": properties,
                **({"required": required} if required else {}),
                **{"oneOf": choice for choice in alternatives if choice}, "additionalProperties": False}

    def parts(self, name):
        """The messages that a message has fields of."""
        message = self.messages[name]
        if name == ".ccslice.v1.Vector3":
            return set()
        return {field.type_name for field in message.field
                if field.type_name in self.messages and not field.options.Extensions[self._form.as_protobuf]}


def with_parts(contract, names):
    """All that these messages are made of, themselves not, unless others are made of them."""
    found, left = set(), list(names)
    while left:
        new = contract.parts(left.pop()) - found
        found |= new
        left += new
    return found


def packed(texts, start):
    """As many of the texts on a line as fit."""
    rows = [start + texts[0]]
    for text in texts[1:]:
        fits = len(rows[-1]) + len(text) + 3 <= COLUMNS
        rows[-1:] = [rows[-1] + ", " + text] if fits else [rows[-1] + ",", start + text]
    return "\n".join(rows)


def written(value, indent=0, used=0):
    """JSON: what doesn't fit on one line has a line for each value, or, if none has others in it, as few as possible."""
    if isinstance(value, dict):
        items, ends = [(json.dumps(key) + ": ", item) for key, item in value.items()], "{}"
    elif isinstance(value, list):
        items, ends = [("", item) for item in value], "[]"
    else:
        return json.dumps(value, ensure_ascii=False)
    line = f"{ends[0]} {', '.join(key + written(item) for key, item in items)} {ends[1]}"
    if indent + used + len(line) < COLUMNS and "\n" not in line:
        return line
    start = " " * (indent + 2)
    if any(isinstance(item, (dict, list)) for _, item in items):
        rows = ",\n".join(start + key + written(item, indent + 2, len(key)) for key, item in items)
    else:
        rows = packed([key + written(item) for key, item in items], start)
    return f"{ends[0]}\n{rows}\n{' ' * indent}{ends[1]}"


def schemas():
    contract = Contract()
    names = {schema: [PACKAGE + name for name in ([messages] if isinstance(messages, str) else messages)]
             for schema, (_, messages) in DOCUMENTS.items()}
    shared = with_parts(contract, [name for of_one in names.values() for name in of_one])
    shared |= {name for schema, (_, messages) in DOCUMENTS.items() if isinstance(messages, list)
               for name in names[schema]}
    made = {"common": {"title": "Parts of the other documents",
                       "$defs": {name.rsplit(".", 1)[1]: contract.schema(name) for name in sorted(shared)}}}
    for schema, (title, messages) in DOCUMENTS.items():
        forms = [{"$ref": "common.json#/$defs/" + name.rsplit(".", 1)[1]} if name in shared else contract.schema(name)
                 for name in names[schema]]
        form = ({"type": "array", "items": forms[0]} if isinstance(messages, list)
                else {"oneOf": forms} if len(forms) > 1 else forms[0])
        made[schema] = {"title": title, **form}
    return {name: written({"$schema": DRAFT, **schema}) + "\n" for name, schema in made.items()}


def main(arguments):
    made = schemas()
    if arguments == ["--write"]:
        for path in SCHEMAS.glob("*.json"):
            path.unlink()
        for name, text in made.items():
            (SCHEMAS / f"{name}.json").write_text(text, encoding="utf-8")
        return
    there = {path.stem: path.read_text(encoding="utf-8") for path in SCHEMAS.glob("*.json")}
    wrong = sorted(name for name in made.keys() | there.keys() if made.get(name) != there.get(name))
    if wrong:
        sys.exit(f"docs/schemas: {', '.join(wrong)} differ from proto/ccslice/cli/v1; "
                 "write them anew: tests/hygiene/check_schemas.py --write")
    print(f"{len(made)} schemas: as their messages")


if __name__ == "__main__":
    main(sys.argv[1:])
