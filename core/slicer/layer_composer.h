// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From the parts of a layer to its planes: a voxel that several parts hold is that of the part with the highest
// priority, and of those of the first one. Samples are the owner's to the bit, as if it were alone; voxels that it
// covers are counted.

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/field/contone.h"
#include "core/job/placed_part.h"
#include "core/job/slice_job.h"
#include "core/output/arrange.h"
#include "core/output/encode.h"
#include "core/raster/occupancy.h"
#include "core/raster/region_runs.h"
#include "core/raster/voxel_runs.h"
#include "core/slicer/part_painter.h"

namespace ccslice {

/// Voxels of a row that belong to a part.
struct OwnedRun : VoxelRun {
  std::uint32_t part;
};

/// Which part each voxel of a layer belongs to. Memory is kept from layer to layer.
class VoxelOwners {
 public:
  void clear() { runs_.clear(); }
  /// Gives a part those of its voxels that belong to no part yet; returns them. `spans`: by row, then by column, none
  /// overlap. Calls on_covered(run) for voxels of the spans that belong to another part, `run.part`.
  template <typename OnCovered>
  std::span<const VoxelRun> add(std::uint32_t part, std::span<const VoxelRun> spans, OnCovered on_covered);
  /// By row, then by column.
  std::span<const OwnedRun> runs() const { return runs_; }

 private:
  std::vector<OwnedRun> runs_, merged_;
  std::vector<VoxelRun> added_;
};

/// One thread.
class LayerComposer {
 public:
  /// REQUIRES: parts outlive this.
  explicit LayerComposer(const PlacedParts& parts);

  /// The parts in the order in which they take their voxels.
  std::span<const std::uint32_t> order() const { return order_; }

  /// Forgets all: a layer of which nothing is known. `window`: that of all parts.
  void start(std::uint32_t layer, const LayerWindow& window);
  /// `painted`: of the part numbered `part`, in the layer. Throws Error{kCancelled, kPartsOverlap}. REQUIRES: parts
  /// come in order(); a job's only part is added, and stays painted until finish().
  void add(std::uint32_t part, const PaintedPart& painted, const CancellationToken& cancel);
  /// REQUIRES: all parts were added that the region holds voxels or contours of. Throws Error{kCancelled}.
  Layer finish(const CancellationToken& cancel);

 private:
  /// The samples that a layer's planes are made of.
  struct Samples {
    LayerWindow window;  // Of the channels and the materials.
    std::span<const VoxelRun> inside;
    std::span<const RegionRun> regions;
    std::span<const ContonePlane> channels;
    std::span<const std::uint8_t> materials;
  };
  /// Materials' or cell regions' numbers, and what planes take of them: all of the picture, or what there is of it.
  /// Each is made once a layer.
  struct Numbers {
    std::span<const std::uint8_t> indices;
    std::span<const std::uint32_t> palette;
    Arrangement arrangement;
    std::array<std::optional<std::span<const std::uint8_t>>, 2> made;
    std::array<std::vector<std::uint8_t>, 2> memory;

    void start(std::span<const std::uint8_t> the_indices, std::span<const std::uint32_t> the_palette,
               const Arrangement& the_arrangement) {
      indices = the_indices;
      palette = the_palette;
      arrangement = the_arrangement;
      made = {};
    }
  };

  void add_contours(std::uint32_t part, const PaintedPart& painted);
  void add_stats(const PaintedPart& painted);
  void clear_samples(const CancellationToken& cancel);
  void add_samples(std::uint32_t part, const PaintedPart& painted, const CancellationToken& cancel);
  void add_regions(std::uint32_t part, std::span<const RegionRun> regions, std::span<const VoxelRun> owned);
  void count_owned(std::uint32_t part, const PaintedPart& painted, std::span<const VoxelRun> owned);
  void discount_empty_voxels();
  void note_covered(std::uint32_t part, const OwnedRun& run);
  std::vector<EncodedPlane> encode(const Samples& samples, const CancellationToken& cancel);
  IndexImage numbers_for(const PlaneSpec& plane, Numbers& numbers, const CancellationToken& cancel) const;
  SampleImage arranged_samples(std::span<const ContonePlane> planes, const PlaneSpec& spec,
                               const Arrangement& arrangement, const CancellationToken& cancel);

  const PlacedParts& parts_;
  const SliceJob& job_;  // The first part's: all are alike in what this reads.
  const LayerWindow region_;
  LayerWindow window_;  // What of it the layer's parts may be in.
  std::vector<std::uint32_t> order_;
  std::vector<std::uint32_t> numbers_;                 // By placed part: of the part, which its copies share.
  std::vector<std::vector<std::uint8_t>> regions_of_;  // By part, then by its region: its place in cell_region_names().
  std::vector<std::uint32_t> region_palette_, material_palette_;

  // The layer at hand:
  Layer layer_;
  std::optional<PaintedPart> only_;
  bool is_cleared_ = false;  // The samples below are of this layer.
  VoxelOwners owners_;
  std::vector<ContonePlane> channels_;   // Of the region, as are
  std::vector<std::uint8_t> materials_;  // these.
  std::vector<RegionRun> regions_;

  PlaneEncoder encoder_;
  // Scratch memory:
  std::vector<VoxelRun> inside_, arranged_spans_;
  Numbers material_numbers_, cell_region_numbers_;
  std::vector<std::uint8_t> interleaved_, arranged_, region_numbers_;
  BitImage bits_;
};

template <typename OnCovered>
std::span<const VoxelRun> VoxelOwners::add(std::uint32_t part, std::span<const VoxelRun> spans, OnCovered on_covered) {
  merged_.clear();
  added_.clear();
  auto other = runs_.begin();
  const auto take = [&](std::uint32_t row, std::uint32_t begin, std::uint32_t end) {
    if (begin >= end) return;
    added_.push_back({row, begin, end});
    merged_.push_back({{row, begin, end}, part});
  };
  for (const VoxelRun& span : spans) {
    const auto is_before = [&] {
      return other->row < span.row || (other->row == span.row && other->end <= span.begin);
    };
    while (other != runs_.end() && is_before()) merged_.push_back(*other++);
    std::uint32_t begin = span.begin;
    while (other != runs_.end() && other->row == span.row && other->begin < span.end) {
      take(span.row, begin, other->begin);
      const std::uint32_t first = std::max(begin, other->begin), end = std::min(span.end, other->end);
      on_covered(OwnedRun{{span.row, first, end}, other->part});
      begin = end;
      if (other->end > span.end) break;  // It may cover the next span, too.
      merged_.push_back(*other++);
    }
    take(span.row, begin, span.end);
  }
  merged_.insert(merged_.end(), other, runs_.end());
  runs_.swap(merged_);
  return added_;
}

}  // namespace ccslice
