// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Parts of cells (slicer/cell_fitter.h) that are kept from slab to slab, since most of them are taller than a slab, for
// all workers on a job. Parts depend on their cell alone, so what is kept, or was forgotten, costs time and nothing
// else.

#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "core/slicer/cell_fitter.h"

namespace ccslice {

/// The parts of a cell that were met so far, the whole cell first. Who reads or adds to them holds the mutex.
struct CellParts {
  std::mutex mutex;
  std::vector<CellPart> parts;

  std::size_t memory_bytes() const;
};

/// Safe to call from many threads.
class PieceStore {
 public:
  /// `most_bytes`: beyond, the cells that were asked for longest ago are forgotten.
  explicit PieceStore(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Of a cell that isn't kept: the cell as a single unknown part that lies in `place` (voxels).
  std::shared_ptr<CellParts> parts_of(std::uint32_t cell, const Box3& place);
  /// Takes note of a cell's memory, if these parts are still kept. REQUIRES: the caller holds their mutex.
  void set_memory(std::uint32_t cell, const CellParts& parts);

  std::size_t memory_bytes() const;

 private:
  struct Kept {
    std::uint32_t cell;
    std::size_t bytes;
    std::shared_ptr<CellParts> parts;
  };

  void forget_beyond_most();

  const std::size_t most_bytes_;
  mutable std::mutex mutex_;  // Of what follows.
  std::size_t bytes_ = 0;
  std::list<Kept> kept_;  // Those asked for last come first.
  std::unordered_map<std::uint32_t, std::list<Kept>::iterator> by_cell_;
};

/// With room for what a few slabs of a job need.
std::shared_ptr<PieceStore> make_piece_store();

}  // namespace ccslice
