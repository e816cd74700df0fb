// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads a .3mf with the 3MF Consortium's own library, writes it again with it and reads that: node read_3mf.mjs FILE.
// Prints one JSON document of what the library has found, and how many warnings it gave of either file.

import fs from 'node:fs';
import createLibrary from '@3mfconsortium/lib3mf';

const library = await createLibrary();
const wrapper = new library.CWrapper();

function read(bytes) {
  const model = wrapper.CreateModel();
  const reader = model.QueryReader('3mf');
  library.FS.writeFile('/read.3mf', bytes);
  reader.ReadFromFile('/read.3mf');
  return {model, warnings: reader.GetWarningCount()};
}

function all(iterator, current) {
  const found = [];
  while (iterator.MoveNext()) found.push(iterator[current]());
  return found;
}

const file = read(fs.readFileSync(process.argv[2]));
const mesh = all(file.model.GetMeshObjects(), 'GetCurrentMeshObject')[0];
const volume = mesh.GetVolumeData();
const properties = [];
for (let i = 0; i < volume.GetPropertyCount(); ++i) properties.push(volume.GetProperty(i).GetName());
const functions = all(file.model.GetFunctions(), 'GetCurrentFunction').map((f) => f.GetDisplayName());

file.model.QueryWriter('3mf').WriteToFile('/written.3mf');
const written = read(library.FS.readFile('/written.3mf'));

console.log(JSON.stringify({
  unit: file.model.GetUnit()?.value ?? file.model.GetUnit(),
  triangles: mesh.GetTriangleCount(),
  images: all(file.model.GetImage3Ds(), 'GetCurrentImage3D').length,
  functions,
  color: volume.GetColor() !== null,
  properties,
  warnings: file.warnings,
  warnings_of_its_own_file: written.warnings,
}));
