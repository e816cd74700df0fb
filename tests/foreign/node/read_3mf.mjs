// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads a .3mf with the 3MF Consortium's own library, writes it again with it and reads that: node read_3mf.mjs FILE
// FOLDER. Prints one JSON document of what the library has found, and how many warnings it gave of either file. The sheets
// of the properties go to FOLDER/PROPERTY_SHEET.png.

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
const functions = all(file.model.GetFunctions(), 'GetCurrentFunction');

// How to sample a property, and what.
function property(number) {
  const found = volume.GetProperty(number);
  const sampler = functions.find((f) => f.GetResourceID() === found.GetFunctionResourceID());
  const stack = file.model.GetImageStackByID(sampler.GetImage3D().GetResourceID());
  const sheets = stack.GetSheetCount();
  for (let k = 0; k < sheets; ++k) {
    stack.GetSheet(k).WriteToFile('/sheet.png');
    fs.writeFileSync(`${process.argv[3]}/${number}_${k}.png`, library.FS.readFile('/sheet.png'));
  }
  const fields = found.GetTransform();
  const transform = [0, 1, 2, 3].map((row) => [0, 1, 2].map((column) => fields[`get_Fields_${row}_${column}`]()));
  const tiles = sampler.GetTileStyles();
  const clamps = ['U', 'V', 'W'].every((axis) => tiles[`TileStyle${axis}`] === library.eTextureTileStyle.Clamp);
  const linear = sampler.GetFilter() === library.eTextureFilter.Linear;
  const [offset, scale] = [sampler.GetOffset(), sampler.GetScale()];
  return {name: found.GetName(), channel: found.GetChannelName(), transform, sheets, linear, clamps, offset, scale};
}

const properties = [];
for (let i = 0; i < volume.GetPropertyCount(); ++i) properties.push(property(i));

file.model.QueryWriter('3mf').WriteToFile('/written.3mf');
const written = read(library.FS.readFile('/written.3mf'));

console.log(JSON.stringify({
  unit: file.model.GetUnit()?.value ?? file.model.GetUnit(),
  triangles: mesh.GetTriangleCount(),
  images: all(file.model.GetImage3Ds(), 'GetCurrentImage3D').length,
  functions: functions.map((f) => f.GetDisplayName()),
  color: volume.GetColor() !== null,
  properties,
  warnings: file.warnings,
  warnings_of_its_own_file: written.warnings,
}));
