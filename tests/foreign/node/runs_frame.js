// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Decodes a plane of PLANE_ENCODING_RUNS_ZSTD to what PLANE_ENCODING_RAW would have sent. Any Node.js from 16 on:
//
//     const samples = decodeRuns(frame, {sampleType: 'SAMPLE_TYPE_UINT8', columns, rows, channels: 1});
//
// Throws if the frame is cut or changed in a way that shows. The rest is for the checksum, which is the caller's. (Of
// frames that someone may have damaged on purpose: fzstd 0.1.1 has Huffman tables on which it never returns.)

'use strict';

const fzstd = require('fzstd');

const SAMPLE_BITS = {
  SAMPLE_TYPE_BIT: 1, SAMPLE_TYPE_UINT2: 2, SAMPLE_TYPE_UINT4: 4, SAMPLE_TYPE_UINT8: 8, SAMPLE_TYPE_UINT16: 16,
  SAMPLE_TYPE_FLOAT32: 32,
};
const BLOCK_VOXELS = 1024;

function expect(condition, what) {
  if (!condition) throw new Error(`runs frame: ${what}`);
}

/** Reads a Buffer from front to back. */
class Reader {
  constructor(bytes) {
    this.bytes = bytes;
    this.at = 0;
  }

  take(count) {
    expect(count <= this.bytes.length - this.at, 'it ends early');
    this.at += count;
    return this.bytes.subarray(this.at - count, this.at);
  }

  unsigned(count) {
    return this.take(count).reduce((value, byte, i) => value + byte * 2 ** (8 * i), 0);
  }

  /** A number of 7 bits a byte. Five bytes are enough for 32 bits. */
  number(scale = 1) {
    expect(scale < 2 ** 35, 'a number is too long');
    const byte = this.unsigned(1);
    return byte < 128 ? byte * scale : (byte - 128) * scale + this.number(scale * 128);
  }

  end() {
    expect(this.at === this.bytes.length, 'it goes on after its end');
  }
}

/** The content of one zstd frame. The walk is for what fzstd lets pass: any size, and more or less than one frame. */
function unzstd(frame, maxBytes) {
  const reader = new Reader(frame);
  expect(reader.unsigned(4) === 0xfd2fb528, 'it is no zstd frame');
  const flags = reader.unsigned(1);
  const singleSegment = (flags >> 5) & 1;
  reader.take(1 - singleSegment + [0, 1, 2, 4][flags & 3]);  // Window, dictionary.
  const sizeBytes = [singleSegment, 2, 4, 8][flags >> 6];
  expect(sizeBytes, 'it has no content size');
  const size = reader.unsigned(sizeBytes) + (sizeBytes === 2 ? 256 : 0);
  expect(size <= maxBytes, `a content size of ${size}, but such a plane takes ${maxBytes} at most`);
  for (let block = 0; !(block & 1);) {
    block = reader.unsigned(3);
    reader.take((block & 6) === 2 ? 1 : block >> 3);  // Type 1 is a byte that repeats.
  }
  reader.take(flags & 4);  // Checksum.
  reader.end();
  try {
    return Buffer.from(fzstd.decompress(frame, new Uint8Array(size)).buffer);
  } catch (error) {
    throw new Error(`runs frame: ${error.message}`);
  }
}

/** Even numbers stand for 0, 1, 2 ..., odd ones for -1, -2 ... */
function signed(z) {
  return z % 2 ? -(z + 1) / 2 : z / 2;
}

/** Where the spans of a row begin and end. */
function readEdges(reader, above, columns) {
  const edges = [];
  for (let left = 2 * reader.number(); left > 0; --left) {
    const before = edges.length ? edges[edges.length - 1] : -1;
    const edge = signed(reader.number()) + (edges.length < above.length ? above[edges.length] : Math.max(before, 0));
    expect(edge > before && edge <= columns, 'edges that do not ascend, or beyond their row');
    edges.push(edge);
  }
  return edges;
}

/** The voxels inside, by row, then by column: each one's place in the plane and which of them predicts it, else -1. */
function readSpans(reader, columns, rows) {
  const places = new Uint32Array(columns * rows);
  const predictors = new Int32Array(columns * rows);
  let count = 0;
  let edgesAbove = [];
  for (let row = 0, above = 0, begin = 0; row < rows; ++row, above = begin, begin = count) {
    let next = above;  // Of the row above, the first voxel that isn't to the left.
    const edges = readEdges(reader, edgesAbove, columns);
    edgesAbove = edges;
    for (let edge = 0; edge < edges.length; edge += 2) {
      let place = row * columns + edges[edge];
      for (let i = 0; i < edges[edge + 1] - edges[edge]; ++i, ++place, ++count) {
        while (next < begin && places[next] + columns < place) ++next;
        const isBelow = next < begin && places[next] + columns === place;
        if (i > 0 && !isBelow) predictors[count] = count - 1;
        else if (next < begin) predictors[count] = next;
        else predictors[count] = begin > above ? begin - 1 : -1;
        places[count] = place;
      }
    }
  }
  return {places: places.subarray(0, count), predictors: predictors.subarray(0, count)};
}

/** The i-th of the numbers of so many bits. */
function unpack(bytes, bits, i) {
  if (bits === 16) return bytes.readUInt16LE(2 * i);
  return (bytes[(i * bits) >>> 3] >> (8 - bits - ((i * bits) & 7))) & ((1 << bits) - 1);
}

/** The samples of the voxels inside; of FLOAT32 their bits. What is stored in the array wraps around. */
function readSamples(reader, coding, bits, channels, predictors) {
  const count = predictors.length;
  const samples = new (bits <= 8 ? Uint8Array : bits === 16 ? Uint16Array : Uint32Array)(count * channels);
  const prediction = (i, channel) => predictors[i] < 0 ? 0 : samples[predictors[i] * channels + channel];
  if (coding === 0) {
    const sample = reader.unsigned(Math.ceil(bits / 8));
    expect(sample < 2 ** bits, `a sample of ${sample} in ${bits} bits`);
    samples.fill(sample);
  } else if (coding === 1 && bits <= 8) {
    const packed = reader.take(Math.ceil(count * bits / 8));
    for (let i = 0; i < count; ++i) samples[i] = unpack(packed, bits, i);
  } else if (coding === 2 && (bits === 8 || bits === 16)) {
    for (let begin = 0; begin < count; begin += BLOCK_VOXELS) {
      const end = Math.min(begin + BLOCK_VOXELS, count);
      const width = reader.unsigned(1);
      expect([0, 1, 2, 4, 8, 16].includes(width) && width <= bits, `a width of ${width} bits`);
      const packed = reader.take(Math.ceil((end - begin) * width / 8));
      for (let i = begin; i < end; ++i) {
        const z = unpack(packed, width, i - begin);
        samples[i] = prediction(i, 0) + signed(z);
      }
    }
  } else if (coding === 3 && bits === 32) {
    for (let channel = 0; channel < channels; ++channel) {
      const [a, b, c, d] = [0, 1, 2, 3].map(() => reader.take(count));
      for (let i = 0; i < count; ++i) {
        samples[i * channels + channel] = prediction(i, channel) ^ (a[i] | b[i] << 8 | c[i] << 16 | d[i] << 24);
      }
    }
  } else {
    expect(false, `coding ${coding} of samples of ${bits} bits`);
  }
  return samples;
}

/** The samples of a plane as PLANE_ENCODING_RAW has them. Columns and rows are those of the picture. */
function decodeRuns(frame, {sampleType, columns, rows, channels = 1}) {
  const bits = SAMPLE_BITS[sampleType];
  expect(bits, `no sample type ${sampleType}`);
  const rowBytes = Math.ceil(columns * channels * bits / 8);
  const rawBytes = rows * rowBytes;
  const reader = new Reader(unzstd(frame, 64 + 16 * rows + 4 * columns * rows + rawBytes + Math.floor(rawBytes / 1024)));
  const coding = reader.unsigned(1);
  const outside = reader.take(Math.ceil(bits / 8));
  const {places, predictors} = readSpans(reader, columns, rows);
  const samples = readSamples(reader, coding, bits, channels, predictors);
  reader.end();
  expect(bits >= 8 || outside[0] === 0, 'a sample outside that is not 0');
  const raw = Buffer.alloc(rawBytes, outside);
  samples.forEach((sample, i) => {
    const place = places[Math.floor(i / channels)];
    const bit = (place % columns * channels + i % channels) * bits;
    const at = Math.floor(place / columns) * rowBytes + (bit >> 3);
    if (bits < 8) raw[at] |= sample << (8 - bits - (bit & 7));
    else raw.writeUIntLE(sample, at, bits / 8);
  });
  return raw;
}

module.exports = {decodeRuns};
