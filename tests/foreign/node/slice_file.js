// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A whole client of ccslice in JavaScript, without generated stubs: uploads a .ccmesh file, plans, slices, probes, and
// reads an error. Any Node.js from 16 on:
//
//     npm ci && node slice_file.js localhost:50051 ring.ccmesh hardness
//
// Prints one JSON document of what it got.

'use strict';

const crypto = require('node:crypto');
const fs = require('node:fs');
const path = require('node:path');
const zlib = require('node:zlib');

const grpc = require('@grpc/grpc-js');
const protoLoader = require('@grpc/proto-loader');

const {decodeRuns} = require('./runs_frame.js');

const PROTOS = [path.join(__dirname, '../../../proto'), path.join(__dirname, '../proto')];
const OPTIONS = {includeDirs: PROTOS, keepCase: true, longs: Number, enums: String, defaults: true, oneofs: true};
const CHUNK_BYTES = 256 * 1024;
const PITCH_MM = 0.5;
const FIRST_LAYER = 8;
const LAYERS = 4;

const definitions = protoLoader.loadSync(
    ['ccslice/v1/service.proto', 'google/rpc/status.proto', 'google/rpc/error_details.proto', 'reflection.proto'],
    OPTIONS);
const {SlicerService} = grpc.loadPackageDefinition(definitions).ccslice.v1;
const {ServerReflection} = grpc.loadPackageDefinition(definitions).grpc.reflection.v1alpha;

/** The answer of a call with one request and one response. */
function call(slicer, method, request) {
  return new Promise((resolve, reject) => {
    slicer[method](request, (error, response) => error ? reject(error) : resolve(response));
  });
}

/** The mesh's id. The id is the digest of exactly the bytes that are sent. */
function upload(slicer, content) {
  const meshId = 'sha256:' + crypto.createHash('sha256').update(content).digest('hex');
  return new Promise((resolve, reject) => {
    const stream = slicer.UploadMesh((error, response) => error ? reject(error) : resolve(response.mesh.mesh_id));
    stream.write({start: {mesh_id: meshId, size_bytes: content.length}});
    for (let at = 0; at < content.length; at += CHUNK_BYTES) stream.write({chunk: content.subarray(at, at + CHUNK_BYTES)});
    stream.end();
  });
}

function voxelGrid() {
  return {pitch: {x_mm: PITCH_MM, y_mm: PITCH_MM, z_mm: PITCH_MM}};
}

/** CRC-32 as in PNG and zlib. */
function crc32(bytes) {
  let crc = 0xffffffff;
  for (const byte of bytes) {
    crc ^= byte;
    for (let bit = 0; bit < 8; ++bit) crc = (crc >>> 1) ^ (crc & 1 ? 0xedb88320 : 0);
  }
  return ~crc >>> 0;
}

/** The samples of an 8-bit grey PNG. Of the filters those that ccslice uses: 0, none, and 2, the difference to the row above. */
function greyPng(file) {
  let width = 0;
  const deflated = [];
  for (let at = 8; at < file.length;) {
    const length = file.readUInt32BE(at);
    const name = file.toString('latin1', at + 4, at + 8);
    if (name === 'IHDR') width = file.readUInt32BE(at + 8);
    if (name === 'IDAT') deflated.push(file.subarray(at + 8, at + 8 + length));
    at += length + 12;
  }
  const filtered = zlib.inflateSync(Buffer.concat(deflated));
  const rows = [];
  let above = Buffer.alloc(width);
  for (let at = 0; at < filtered.length; at += width + 1) {
    const filter = filtered[at];
    expect(filter === 0 || filter === 2, `row filter ${filter}`);
    const row = filtered.subarray(at + 1, at + 1 + width);
    above = filter === 0 ? row : row.map((difference, i) => difference + above[i]);
    rows.push(above);
  }
  return Buffer.concat(rows);
}

/** Voxels inside. Rows are padded to whole bytes with zeros, so counting ones does. */
function occupied(bits) {
  let count = 0;
  for (let byte of bits) {
    for (; byte; byte &= byte - 1) ++count;
  }
  return count;
}

function expect(condition, what) {
  if (!condition) throw new Error(what);
}

/** A job of the mesh as it is. */
function jobOn(meshId, grid) {
  return {parts: [{mesh_id: meshId}], grid};
}

/** The occupancy as it is, and a channel as 8 bit, as it is, as PNG and as runs: {layer: checksums of the decoded planes}. */
async function sliceLayers(slicer, meshId, channel) {
  const stiffness = {channel: {name: channel}, sample_type: 'SAMPLE_TYPE_UINT8'};
  const stream = slicer.SliceRange({
    job: {
      ...jobOn(meshId, voxelGrid()),
      planes: [
        {occupancy: {}, encoding: 'PLANE_ENCODING_RAW'},
        {...stiffness, encoding: 'PLANE_ENCODING_RAW'},
        {...stiffness, encoding: 'PLANE_ENCODING_PNG'},
        {...stiffness, encoding: 'PLANE_ENCODING_RUNS_ZSTD'},
      ],
    },
    first_layer: FIRST_LAYER,
    layer_count: LAYERS,
  });
  const layers = {};
  let planes = [];
  let extent;
  let encoded = [];
  for await (const message of stream) {
    if (message.event === 'header') {
      planes = message.header.planes;
      extent = (message.header.region || message.header.grid).extent;
    }
    if (message.event === 'layer_begin') encoded = planes.map(() => []);
    if (message.event === 'plane_chunk') encoded[message.plane_chunk.plane].push(message.plane_chunk.data);
    if (message.event !== 'layer_end') continue;
    const end = message.layer_end;
    const samples = encoded.map((chunks, plane) => {
      const file = Buffer.concat(chunks);
      if (planes[plane].encoding === 'PLANE_ENCODING_PNG') return greyPng(file);
      if (planes[plane].encoding !== 'PLANE_ENCODING_RUNS_ZSTD') return file;
      return decodeRuns(file, {sampleType: planes[plane].sample_type, columns: extent.columns, rows: extent.rows});
    });
    layers[end.layer] = samples.map(crc32);
    samples.forEach((plane, i) => {
      expect(plane.length === end.planes[i].raw_bytes, 'a plane has another size than the server says');
      expect(layers[end.layer][i] === end.planes[i].crc32, 'a plane has another checksum than the server says');
    });
    expect(occupied(samples[0]) === end.voxel_count, 'another number of voxels is inside than the server says');
  }
  return layers;
}

/** The answer to the one request of a bidirectional call. */
function ask(stream, request) {
  return new Promise((resolve, reject) => {
    stream.on('data', resolve).on('error', reject).end(request);
  });
}

/** What the server offers, by reflection. */
async function serviceNames(address, credentials) {
  const reflection = new ServerReflection(address, credentials);
  const answer = await ask(reflection.ServerReflectionInfo(), {list_services: '*'});
  reflection.close();
  return answer.list_services_response.service.map((service) => service.name).sort();
}

/** Values of the channels at a point; null outside. */
async function probe(slicer, meshId, point) {
  const answer = await ask(slicer.ProbePoints(), {mesh_id: meshId, points_mm: point});
  return answer.locations[0] === 'POINT_LOCATION_INSIDE' ? answer.channel_values : null;
}

/** What a call that fails says: its status code, the stable reason, and the field at fault. */
async function failure(slicer, method, request) {
  const error = await call(slicer, method, request).then(() => expect(false, 'the call should have failed'), (e) => e);
  const decode = (type, bytes) => definitions[type].deserialize(bytes);
  const status = decode('google.rpc.Status', error.metadata.get('grpc-status-details-bin')[0]);
  const found = {code: grpc.status[error.code], message: status.message};
  for (const detail of status.details) {
    const type = detail.type_url.split('/').pop();
    if (type === 'google.rpc.ErrorInfo') found.reason = decode(type, detail.value).reason;
    if (type === 'google.rpc.BadRequest') found.field = decode(type, detail.value).field_violations[0].field;
  }
  return found;
}

/** In plain text, or with TLS and a token. */
function channelCredentials(authority, tokenFile) {
  if (!authority) return grpc.credentials.createInsecure();
  const token = fs.readFileSync(tokenFile, 'utf8').trim();
  const withToken = grpc.credentials.createFromMetadataGenerator((_, done) => {
    const metadata = new grpc.Metadata();
    metadata.set('authorization', `Bearer ${token}`);
    done(null, metadata);
  });
  return grpc.credentials.combineChannelCredentials(grpc.credentials.createSsl(fs.readFileSync(authority)), withToken);
}

async function main(address, file, channel, authority, tokenFile) {
  const credentials = channelCredentials(authority, tokenFile);
  const slicer = new SlicerService(address, credentials);
  const meshId = await upload(slicer, fs.readFileSync(file));
  const plan = await call(slicer, 'PlanSlices', {job: jobOn(meshId, voxelGrid())});
  const box = plan.grid.part_box;
  const middle = ['x', 'y', 'z'].map((axis) => (box.min_mm[axis] + box.max_mm[axis]) / 2);
  console.log(JSON.stringify({
    services: await serviceNames(address, credentials),
    mesh_id: meshId,
    pitch_mm: PITCH_MM,
    layer_count: plan.layer_count,
    layers: await sliceLayers(slicer, meshId, channel),
    probed: await probe(slicer, meshId, middle),
    failure: await failure(slicer, 'PlanSlices', {job: jobOn(meshId, {pitch: {x_mm: -1, y_mm: 1, z_mm: 1}})}),
  }));
  slicer.close();
}

main(...process.argv.slice(2)).catch((error) => {
  console.error(error);
  process.exit(1);  // Open channels would keep the process alive.
});
