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

// The fields of the type that a file declares: Map of name to {file, map}, or null where it is no object.
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
    fields = new Map();
    const body = block(text, text.indexOf("{", start));
    for (const [, name, type] of body.matchAll(/^ {4}"([^"]+)"\??: ([\s\S]*?);$(?=\s*(^ {4}"|$(?![\s\S])))/gm)) {
      fields.set(name, { file: declaredIn(type, imports, file), map: type.trim().startsWith("{") });
    }
  }
  interfaces.set(file, fields);
  return fields;
}

function unknownFields(value, file, where) {
  if (Array.isArray(value)) return value.flatMap((one, i) => unknownFields(one, file, `${where}[${i}]`));
  if (!file || value === null || typeof value !== "object") return [];
  const fields = fieldsOf(file);
  if (!fields) return [];
  return Object.entries(value).flatMap(([name, inner]) => {
    const field = fields.get(name);
    if (!field) return [`${where}.${name} is no field of it`];
    if (!field.map) return unknownFields(inner, field.file, `${where}.${name}`);
    return Object.entries(inner).flatMap(([key, one]) => unknownFields(one, field.file, `${where}.${name}.${key}`));
  });
}

function check(object) {
  const name = `${object.kind} ${object.metadata && object.metadata.name}`;
  const folder = `kubernetes-models/${object.apiVersion}`;
  const file = path.join(MODULES, folder, `${object.kind}.d.ts`);
  if (!fs.existsSync(file)) return [`${name}: there is no such kind in ${object.apiVersion}`];
  const findings = unknownFields(object, file, object.kind).map((words) => `${name}: ${words}`);
  try {
    new (require(folder)[object.kind])(object).validate();
  } catch (error) {
    findings.push(`${name}: ${error.message}`);
  }
  return findings;
}

console.log(JSON.stringify(JSON.parse(fs.readFileSync(0, "utf8")).flatMap(check)));
