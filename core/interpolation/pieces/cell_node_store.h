// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The nodes of cells (interpolation/pieces/cell_fitter.h), kept from slab to slab for all workers on a job: most cells
// are taller than a slab. Nodes depend on their cell alone, so what is kept, or was forgotten, costs time and nothing
// else.

#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>
#include <vector>

#include "core/interpolation/pieces/cell_fitter.h"
#include "core/interpolation/samples/block_stencils.h"

namespace ccslice {

/// The nodes of a cell that were met so far, the whole cell first. Who reads or adds to them holds the mutex.
struct CellNodes {
  std::mutex mutex;
  std::vector<CellNode> nodes;

  std::size_t memory_bytes() const;
};

/// Safe to call from many threads.
class CellNodeStore {
 public:
  static constexpr std::size_t kMostBytesOfStencils = 32 << 20;

  /// `most_bytes`: beyond, the cells that were asked for longest ago are forgotten. `tiles_fit`: do_tiles_fit() of the
  /// job, if that is known.
  explicit CellNodeStore(std::size_t most_bytes, std::optional<bool> tiles_fit = {},
                         std::size_t most_bytes_of_stencils = kMostBytesOfStencils)
      : tiles_fit_(tiles_fit), most_bytes_(most_bytes), most_bytes_of_stencils_(most_bytes_of_stencils) {}

  /// A cell that isn't kept starts as a single unknown node. `bounds`: hold the cell, in voxels.
  [[nodiscard]] std::shared_ptr<CellNodes> nodes_of(LimitCellId cell, const Box3& bounds);
  /// Takes note of a cell's memory, if these nodes are still kept. REQUIRES: the caller holds their mutex.
  void set_memory(LimitCellId cell, const CellNodes& nodes);

  /// What blocks of the job's cells are sampled with. REQUIRES: always the same solid, which outlives this.
  [[nodiscard]] std::shared_ptr<BlockStencils> stencils_of(const LimitSolid& solid);

  /// do_tiles_fit(), which nothing cancels here: others may wait for it. REQUIRES: always the same solid and spec.
  [[nodiscard]] bool tiles_fit(const std::shared_ptr<const LimitSolid>& solid, const InterpolationSpec& spec);

  /// A worker is about to look for nodes in its first layer. Returns the layer of the worker that came first, while
  /// that looks for its own: somebody waits for it, and others help (PieceFinder::find()).
  [[nodiscard]] std::optional<std::uint32_t> awaited_layer(std::uint32_t first_layer);
  /// A worker knows all nodes of a layer.
  void set_found(std::uint32_t layer);

  /// What the kept nodes take.
  std::size_t memory_bytes() const;

 private:
  struct Kept {
    LimitCellId cell;
    std::size_t bytes;
    std::shared_ptr<CellNodes> nodes;
  };

  static constexpr std::int64_t kNotBegun = -1, kFound = -2;

  void forget_beyond_most();

  std::once_flag stencils_made_;
  std::shared_ptr<BlockStencils> stencils_;
  std::once_flag tiles_tried_;
  std::optional<bool> tiles_fit_;
  std::atomic<std::int64_t> awaited_layer_ = kNotBegun;
  const std::size_t most_bytes_, most_bytes_of_stencils_;
  mutable std::mutex mutex_;  // Guards what follows.
  std::size_t bytes_ = 0;
  std::list<Kept> kept_;  // Those asked for last come first.
  std::unordered_map<std::uint32_t, std::list<Kept>::iterator> by_cell_;
};

/// The most bytes that each of a job's stores holds of pieces, which are those of a few slabs, and of stencils.
struct NodeStoreBytes {
  std::size_t pieces = 0, stencils = 0;
};
[[nodiscard]] NodeStoreBytes bytes_of_store(std::size_t stores);

/// One of so many stores of a job.
[[nodiscard]] std::shared_ptr<CellNodeStore> make_cell_node_store(std::optional<bool> tiles_fit = {},
                                                                  std::size_t stores = 1);

}  // namespace ccslice
