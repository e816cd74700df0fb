// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a voxel's materials are to rounding: its parameter as PointInverter finds it, then plain Newton in that cell
// until nothing is left of the residual; of a voxel off the solid the nearest place, of all cells that come near. And
// by how much two inversions may differ there: each may be off by what it accepts in space, 1e-6 mm, so their materials
// by twice what materials change within that.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/inversion/point_inverter.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"

namespace ccslice::oracle {

enum class VoxelPlace : std::uint8_t {
  kInside,
  kOff,        // Inside the contours, whose tolerance reaches over the solid's boundary.
  kAmbiguous,  // The solid may fold here, or overlap: there may be several parameters.
  kNowhere,    // No parameter was found.
  kOverlap,    // Cells overlap, and none near it may fold. Those that touch aren't looked for by the solid.
};
inline constexpr std::size_t kVoxelPlaces = 5;
const char* to_text(VoxelPlace place);

/// Of lengths, the largest first.
Vec3 scales_of(const Placement& placement);

/// There may be several parameters.
inline bool is_ambiguous(VoxelPlace place) { return place == VoxelPlace::kAmbiguous || place == VoxelPlace::kOverlap; }

struct VoxelTruth {
  CellParam at;
  double residual_mm = 0;  // Mesh frame.
  VoxelPlace place = VoxelPlace::kInside;
  std::vector<double> values;  // By channel.
};

/// One thread.
class TruthFinder {
 public:
  TruthFinder(std::shared_ptr<const LimitSolid> solid, const Placement& placement, double outside_mm);

  /// Nothing if there is no parameter within `outside_mm`.
  std::optional<VoxelTruth> find(const Vec3& world);
  /// By channel: by how much two inversions of the voxel may differ.
  std::vector<double> slack(const VoxelTruth& truth);
  /// Places that are as good as the one of `truth` and in other cell regions: within what inversion accepts, or as near
  /// to a voxel off the solid. Channels may jump from one to the other.
  std::vector<VoxelTruth> places_beyond_interfaces(const Vec3& world, const VoxelTruth& truth);
  /// A cell region comes as near to a voxel as `world_mm`, or by that farther than the place of `truth`.
  bool region_is_near(std::uint8_t region, const Vec3& world, const VoxelTruth& truth, double world_mm);
  /// Another cell holds some of 125 places of this one well within its sides.
  bool overlaps_another(LimitCellId cell);
  std::uint8_t region_of(const VoxelTruth& truth) const { return region_of(truth.at.cell); }

 private:
  double polish(const Vec3& point, CellParam& at);
  void take_nearest(const Vec3& point, VoxelTruth& truth);
  bool may_fold(const Box3& box) const;
  bool is_inside_another(const Vec3& point, LimitCellId cell);
  std::uint8_t region_of(LimitCellId cell) const { return solid_->region_of(solid_->control_cell(cell)); }
  std::vector<double> values_at(const CellParam& at);

  std::shared_ptr<const LimitSolid> solid_;
  Placement mesh_of_world_;
  double least_scale_, diagonal_mm_, accept_mm_;
  PointInverter inverter_;
};

}  // namespace ccslice::oracle
