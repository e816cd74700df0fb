// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Small control meshes whose connectivity, sharp features and flags come from arbitrary bytes. Positions come from a
// 4 x 4 x 4 lattice with offsets, so that many of them are valid. A mesh that validates must prepare and evaluate to
// finite positions in every cell.
//
// Byte 0: bit 0 allow_folds, bits 1-7 number of cells. Then per cell one byte of kind, then one byte per corner: the
// vertex on the lattice. What is left: pairs of sharp edges.

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "core/base/error.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"
#include "core/mesh/control_mesh.h"
#include "core/prepare/prepare_solid.h"
#include "tests/fuzz/byte_reader.h"

namespace {

using ccslice::fuzz::ByteReader;

constexpr int kLattice = 4;

ccslice::Vec3 lattice_position(int index) {
  const int x = index % kLattice, y = index / kLattice % kLattice, z = index / (kLattice * kLattice);
  return {x + 0.05 * y, y + 0.07 * z, z + 0.03 * x};
}

/// Numbers the lattice vertices that cells use as they are met, so that no vertex is left without a cell.
class MeshFromBytes {
 public:
  explicit MeshFromBytes(ByteReader& bytes) {
    const std::uint8_t head = bytes.next();
    mesh.allow_folds = head & 1;
    mesh.channel_names = {"x"};
    for (int cells = head >> 1; cells > 0 && !bytes.at_end(); --cells) add_cell(bytes);
    while (!bytes.at_end()) {
      const std::uint32_t first = bytes.next(), second = bytes.next();
      mesh.sharp_edges.push_back({first, second});
    }
  }

  ccslice::ControlMesh mesh;

 private:
  void add_cell(ByteReader& bytes) {
    const auto kind = static_cast<ccslice::CellKind>(bytes.next() % 3);
    mesh.cell_kinds.push_back(kind);
    for (int corner = 0; corner < ccslice::corner_count(kind); ++corner) {
      mesh.cell_vertices.push_back(vertex_at(bytes.next() % (kLattice * kLattice * kLattice)));
    }
  }

  std::uint32_t vertex_at(int index) {
    if (numbers_[index] < 0) {
      numbers_[index] = static_cast<int>(mesh.positions.size());
      mesh.positions.push_back(lattice_position(index));
      mesh.channel_values.push_back(static_cast<float>(index));
    }
    return static_cast<std::uint32_t>(numbers_[index]);
  }

  std::vector<int> numbers_ = std::vector<int>(kLattice * kLattice * kLattice, -1);
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ByteReader bytes(data, size);
  MeshFromBytes input(bytes);
  try {
    const auto solid = ccslice::prepare_solid(input.mesh);
    ccslice::LimitEvaluator evaluator(*solid);
    for (const ccslice::LimitCellId cell : solid->cells()) {
      for (const double t : {0.0, 0.3, 1.0}) {
        if (!evaluator.geo({cell, ccslice::Vec3(t, 0.5 * t, 1 - t)}).allFinite()) std::abort();
      }
    }
  } catch (const ccslice::Error& error) {
    if (error.code() == ccslice::ErrorCode::kInternal) std::abort();
  }
  return 0;
}
