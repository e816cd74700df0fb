// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a box of voxels is made of: PARTICLES, boxes of the parameters of cells, or of bricks of cells
// (limit/cell_bricks.h), sampled forward, that meet it.
//
// A brick is one particle as long as its residuals are next to nothing; else it is halved along all axes at once, down
// to its cells.
//
// Cells that are large beside the box are halved, along the axis of their parameters that goes farthest along the axis
// of the voxels in which they stick out most, until no particle sticks out far. So the particles of a small box are
// small, too, and a polynomial of the box isn't asked to fit what lies far from it. Particles are kept while a box is
// cut into smaller ones: those of a half are found among those of the whole.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <unordered_map>
#include <vector>

#include "core/interpolation/samples/interpolation_spec.h"
#include "core/interpolation/samples/voxel_blocks.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

struct TileParticle {
  LimitCellId cell;
  std::uint32_t brick = kNone;                  // The parameters are this one's, unless it is kNone.
  std::uint32_t first_child = 0, children = 0;  // Its parts, if they were needed.
  ParamBox parameters;
  bool one_patch;  // Places and values are tricubic in the parameters, but for residuals.
  Box3 bounds;     // Voxels.
  BlockPlacesInVoxels places;
  std::vector<BlockValues> values;  // By channel.
  BrickResiduals residuals;         // Zero unless it is of a brick. Those of positions and the bulge are in voxels.
  unsigned coarse_axes = 0;         // Bit a: it has several cells along axis a and no fit is made of it as a whole.

  /// A box around all that lies between some of its samples, such as those of a side, of which this is the box.
  Box3 box_around(const Box3& samples) const;
};

/// One thread. Memory is kept.
class TileParticles {
 public:
  static constexpr std::size_t kMost = 2048;

  /// `blocks`: of the solid and the spec, or its own.
  TileParticles(std::shared_ptr<const LimitSolid> solid, const InterpolationSpec& spec,
                std::shared_ptr<VoxelBlocks> blocks = nullptr);

  /// The particles of a box, or none if they aren't known.
  struct Range {
    bool known = false;
    std::size_t first = 0, end = 0;
  };

  /// Forgets all particles.
  void clear();
  /// Enters the particles that meet a box (between the centres of its outer voxels), which lies in the one that
  /// `around` is of. Not known if there are more than `most`, or so many that `voxels` are inverted as quickly. Cells
  /// that were sampled before are kept until clear() as long as there is room.
  Range enter(const Box3& box, std::uint64_t voxels, const Range& around, std::size_t most = kMost);
  /// Forgets what was found since the range's box was entered.
  void leave(const Range& range);

  /// The numbers of a range's particles, for operator[].
  std::span<const std::uint32_t> members(const Range& range) const {
    return std::span(members_).subspan(range.first, range.end - range.first);
  }
  const TileParticle& operator[](std::uint32_t particle) const { return *pool_[particle]; }

  /// A parameter near a voxel.
  [[nodiscard]] std::optional<CellParam> near(const Range& range, const Vec3& voxel) const;
  /// A box of voxels, and as far around it as its voxels may lie off the solid.
  Box3 reached(const Box3& box) const;

 private:
  [[nodiscard]] bool collect(const Box3& box, std::size_t most);
  [[nodiscard]] bool add_meeting(std::uint32_t particle, const Box3& box, std::size_t most);
  std::uint32_t whole(std::uint32_t unit);
  std::uint32_t add_particle(const TileParticle& like, const ParamBox& parameters);
  void sample(TileParticle& particle);
  unsigned axes_to_halve(const TileParticle& particle, const Box3& box) const;
  unsigned coarse_axes(const TileParticle& particle) const;
  [[nodiscard]] bool halve(std::uint32_t particle, unsigned axes);
  unsigned axis_along(const TileParticle& particle, Eigen::Index voxel_axis) const;

  std::shared_ptr<const LimitSolid> solid_;
  const Placement mesh_of_voxel_;
  const Vec3 pitch_mm_, outside_voxels_;
  const std::vector<ChannelTolerance> channels_;
  std::shared_ptr<VoxelBlocks> blocks_;
  std::vector<std::unique_ptr<TileParticle>> pool_;  // The first ones, `used_` of them, are in use.
  std::size_t used_ = 0;
  std::unordered_map<std::uint32_t, std::uint32_t> of_units_;  // The particle that is all of a cell or brick.
  std::vector<std::uint32_t> members_;                         // Particles of the boxes on the way down.
  std::vector<std::uint32_t> units_;                           // That meet the box at hand: bricks, then cells.
};

}  // namespace ccslice
