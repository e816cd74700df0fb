// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/deviation_warnings.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/echo.h"
#include "core/base/number_text.h"
#include "core/prepare/deviation.h"
#include "server/rpc/convert/convert.h"
#include "server/rpc/convert/plan_warning.h"

namespace ccslice::server {
namespace {

constexpr double kMostVoxels = 0.5;  // From a vertex to its limit point.

/// "12.3 % less volume than", the mesh. A folded mesh may have none to compare with.
std::string volume_text(double limit_mm3, double control_mm3) {
  constexpr double kRounding = 1e-9;
  if (!(control_mm3 > 0)) return "another volume than";
  const double change = limit_mm3 / control_mm3 - 1;
  if (std::abs(change) < kRounding) return "the same volume as";
  return number_text(100 * std::abs(change), 3) + " % " + (change < 0 ? "less" : "more") + " volume than";
}

/// By how much the volumes may differ, as a share of the mesh's. A mesh that was fitted meets the part at its vertices
/// alone, and what is convex holds more than the flat faces between them: a round section of eight faces has 11 % more,
/// which is where faces get too coarse to tell what they stand for. Where edges were rounded that look sharp the flat
/// faces are meant, as those of control meshes are.
double most_volume_change(const Deviation& deviation) {
  return deviation.interpolating && deviation.rounded.count == 0 ? 0.1 : 0.005;
}

/// By what the mesh was made of. `edges`: which ones are to be kept sharp. A fitted mesh can't be fitted once more.
std::string remedy_text(const std::string& edges, bool at_interface, bool interpolating) {
  const std::string finer = "keep " + edges + " sharp (sharp_edges, or --sharp-angle" +
                            (at_interface ? " with --sharp-reentrant" : "") + " of ccslice), or use a finer mesh";
  if (interpolating) return " If that isn't meant, " + finer;
  return " If that isn't meant: for a mesh that was made of a CAD part give ccslice --part; for one of finite elements "
         "--as-meshed (as_meshed); else " +
         finer;
}

/// `step`: from the vertex to its limit point, in voxels and in mm.
std::string deviation_text(const Deviation& deviation, const VertexLimit& farthest, double step_voxels,
                           double step_mm) {
  constexpr int kDigits = 4;
  const std::string volume = "what is printed is the limit, with " +
                             volume_text(deviation.limit_volume_mm3, deviation.control_volume_mm3) + " the ";
  const std::string remedy = remedy_text("edges", farthest.on_interface, deviation.interpolating);
  const std::string rounded = deviation.rounded.count > 0 ? "; " + describe(deviation.rounded) : "";
  if (deviation.interpolating && step_voxels == 0) {
    return volume + "mesh that it interpolates" +
           (rounded.empty() ? ", which is more than it takes to be round between its vertices" : rounded) + "." +
           remedy;
  }
  const std::string distance = " is " + number_text(step_mm, kDigits) + " mm, " + number_text(step_voxels, kDigits) +
                               " voxels, from its limit point.";
  const std::string vertex =
      (farthest.on_interface ? "interface vertex " : "boundary vertex ") + std::to_string(farthest.vertex);
  if (deviation.interpolating) {
    return volume + "mesh that it was fitted to" + rounded + "; " + vertex + ", which the fit missed," + distance +
           remedy;
  }
  return volume + "control mesh; " + vertex + distance + remedy;
}

/// The placed vertex to tell of: the one that is the most mm from its limit point, which the plan's deviation names;
/// where only others are more than half a voxel away, the one that is the most voxels away.
VertexLimit vertex_to_tell(const SliceJob& job, const LimitSolid& solid, const Deviation& deviation,
                           const Vec3& voxels_per_mm) {
  const auto voxels = [&](const VertexLimit& vertex) {
    return (vertex.limit - vertex.position).cwiseProduct(voxels_per_mm).norm();
  };
  VertexLimit most = farthest_vertex(solid, voxels_per_mm.asDiagonal() * job.placement.linear());
  most.position = job.placement * most.position;
  most.limit = job.placement * most.limit;
  return voxels(deviation.farthest) <= kMostVoxels && voxels(most) > kMostVoxels ? most : deviation.farthest;
}

void warn_of_whole(const SliceJob& job, const LimitSolid& solid, const Deviation& deviation,
                   v1::PlanSlicesResponse& plan) {
  const Vec3 voxels_per_mm = Vec3(job.grid.pitch.x_mm, job.grid.pitch.y_mm, job.grid.pitch.z_mm).cwiseInverse();
  const VertexLimit farthest = vertex_to_tell(job, solid, deviation, voxels_per_mm);
  const Vec3 step = farthest.limit - farthest.position;
  const double voxels = step.cwiseProduct(voxels_per_mm).norm();
  const double change_mm3 = std::abs(deviation.limit_volume_mm3 - deviation.control_volume_mm3);
  const double most_mm3 = most_volume_change(deviation) * std::abs(deviation.control_volume_mm3);
  if (change_mm3 <= most_mm3 && voxels <= kMostVoxels) return;
  v1::PlanWarning& warning =
      add_warning(plan, v1::PLAN_WARNING_KIND_DEVIATION, deviation_text(deviation, farthest, voxels, step.norm()));
  if (voxels > 0) *warning.add_places_mm() = to_message(farthest.position);
  if (deviation.rounded.count > 0) *warning.add_places_mm() = to_message(deviation.rounded.place);
}

/// As a share of the mesh's.
double volume_change(double limit_mm3, double control_mm3) { return (limit_mm3 - control_mm3) / std::abs(control_mm3); }

/// Interfaces move like the boundary does, so a part may keep its volume while one of its regions doesn't. Regions that
/// change as the whole does have its warning.
void warn_of_cell_regions(const SolidSummary& solid, v1::PlanSlicesResponse& plan) {
  const double most = most_volume_change(solid.deviation);
  const double whole = volume_change(solid.deviation.limit_volume_mm3, solid.deviation.control_volume_mm3);
  const double told = std::abs(whole) > most ? whole : 0;
  const auto change = [](const CellRegionSummary& region) {
    return volume_change(region.volume_mm3, region.control_volume_mm3);
  };
  const auto changes = [&](const CellRegionSummary& region) {
    return region.control_cells > 0 && std::abs(change(region)) > most && std::abs(change(region) - told) > most;
  };
  const std::vector<CellRegionSummary>& regions = solid.cell_regions;
  const auto count = std::ranges::count_if(regions, changes);
  const auto used = std::ranges::count_if(regions, [](const auto& region) { return region.control_cells > 0; });
  if (count == 0 || used < 2) return;
  const CellRegionSummary* worst = nullptr;
  for (const CellRegionSummary& region : regions) {
    if (changes(region) && (worst == nullptr || std::abs(change(region)) > std::abs(change(*worst)))) worst = &region;
  }
  const std::string others =
      count == 1 ? "" : ", and " + std::to_string(count - 1) + " more of " + std::to_string(used) + " change likewise";
  add_warning(plan, v1::PLAN_WARNING_KIND_DEVIATION,
              "cell region '" + echoed(worst->name) + "' is printed with " +
                  volume_text(worst->volume_mm3, worst->control_volume_mm3) + " " +
                  (solid.deviation.interpolating ? "in the mesh that was fitted" : "its control cells") + others + "." +
                  remedy_text("edges of interfaces", true, solid.deviation.interpolating));
}

}  // namespace

void warn_of_deviation(const SliceJob& job, const LimitSolid& solid, const Deviation& deviation,
                       v1::PlanSlicesResponse& plan) {
  warn_of_whole(job, solid, deviation, plan);
  warn_of_cell_regions(solid.summary(), plan);
}

}  // namespace ccslice::server
