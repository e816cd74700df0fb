// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Checks objects of Kubernetes, a JSON array on standard input: the schema of each, and that no field is unknown to it,
// which schemas alone let pass. Prints a JSON array of what is wrong.
//
//     npm ci && node check.js <objects.json

"use strict";

const fs = require("fs");
const path = require("path");

const MODULES = path.join(__dirname, "node_modules");
const interfaces = new Map();

// The braces that belong together, from the one at `start` on.
function block(text, start) {
  let depth = 0;
  for (let end = start; end < text.length; ++end) {
    if (text[end] === "{") ++depth;
    if (text[end] === "}" && --depth === 0) return text.slice(start + 1, end);
  }
  throw new Error("braces don't match");
}

// Where the type that a field names is declared; null for those that aren't objects of Kubernetes.
function declaredIn(type, imports, file) {
  const name = (type.match(/\bII\w+/) || [null])[0];
  if (!name || !imports.has(name)) return null;
  const from = imports.get(name);
  return (from.startsWith(".") ? path.join(path.dirname(file), from) : path.join(MODULES, from)) + ".d.ts";
}

// The fields of a type's body, whose lines stand at `indent`: Map of name to {file, fields, map}. `fields` are those of
// a list's objects, where the type is written out.
function fieldsIn(body, indent, imports, file) {
  const fields = new Map();
  const pattern = new RegExp(`^ {${indent}}"([^"]+)"\\??: ([\\s\\S]*?);$(?=\\s*(^ {${indent}}"|$(?![\\s\\S])))`, "gm");
  for (const [, name, type] of body.matchAll(pattern)) {
    if (type.startsWith("Array<{")) {
      fields.set(name, { fields: fieldsIn(block(type, type.indexOf("{")), indent + 4, imports, file) });
    } else {
      fields.set(name, { file: declaredIn(type, imports, file), map: type.trim().startsWith("{") });
    }
  }
  return fields;
}

// The fields of the type that a file declares, or null where it is no object.
function fieldsOf(file) {
  if (interfaces.has(file)) return interfaces.get(file);
  const text = fs.readFileSync(file, "utf8").replace(/\/\*[\s\S]*?\*\//g, "");
  const imports = new Map();
  for (const [, names, from] of text.matchAll(/import \{([^}]*)\} from "([^"]+)"/g)) {
    for (const name of names.split(",")) imports.set(name.trim(), from);
  }
  const start = text.search(/export (declare )?interface \w+[^{]*\{/);
  let fields = null;
  if (start >= 0) {
    fields = fieldsIn(block(text, text.indexOf("{", start)), 4, imports, file);
  }
  interfaces.set(file, fields);
  return fields;
}

// Of a value whose type has these fields; null where nothing is known of it.
function unknownFields(value, fields, where) {
  if (Array.isArray(value)) return value.flatMap((one, i) => unknownFields(one, fields, `${where}[${i}]`));
  if (!fields || value === null || typeof value !== "object") return [];
  return Object.entries(value).flatMap(([name, inner]) => {
    const field = fields.get(name);
    if (!field) return [`${where}.${name} is no field of it`];
    const known = field.fields || (field.file ? fieldsOf(field.file) : null);
    if (!field.map) return unknownFields(inner, known, `${where}.${name}`);
    return Object.entries(inner).flatMap(([key, one]) => unknownFields(one, known, `${where}.${name}.${key}`));
  });
}

function check(object) {
  const name = `${object.kind} ${object.metadata && object.metadata.name}`;
  const folder = `kubernetes-models/${object.apiVersion}`;
  const file = path.join(MODULES, folder, `${object.kind}.d.ts`);
  if (!fs.existsSync(file)) return [`${name}: there is no such kind in ${object.apiVersion}`];
  const findings = unknownFields(object, fieldsOf(file), object.kind).map((words) => `${name}: ${words}`);
  try {
    new (require(folder)[object.kind])(object).validate();
  } catch (error) {
    findings.push(`${name}: ${error.message}`);
  }
  return findings;
}

console.log(JSON.stringify(JSON.parse(fs.readFileSync(0, "utf8")).flatMap(check)));
