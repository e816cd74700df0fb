// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/find_parts.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

#include "client/cli/base/console.h"
#include "client/cli/tray/rigid_fit.h"
#include "core/base/count_text.h"
#include "core/base/echo.h"

namespace ccslice::cli {
namespace {

std::vector<Vec3> transformed(const std::vector<Vec3>& points, const Placement& placement) {
  std::vector<Vec3> moved;
  moved.reserve(points.size());
  for (const Vec3& point : points) moved.push_back(placement * point);
  return moved;
}

Placement linear_only(const Mat3& linear) {
  Placement placement = Placement::Identity();
  placement.linear() = linear;
  return placement;
}

struct Candidate {
  FoundPart found;
  std::vector<Vec3> shape;  // The part's points, as scaled as the job has them.
  RigidFit fit;
};

/// The placement of the part whose points `linear` has made `shape`.
FoundPart found_of(std::size_t part, const Mat3& linear, const std::vector<Vec3>& shape,
                   const std::vector<Vec3>& placed, const RigidFit& fit) {
  FoundPart found{part, fit.placement, fit.residual_mm, fit.mirrors()};
  const Placement snapped = snapped_to_axes(fit.placement, shape);
  constexpr double kNoWorseMm = 1e-4;
  double farthest = 0;
  for (std::size_t i = 0; i < shape.size(); ++i) farthest = std::max(farthest, (snapped * shape[i] - placed[i]).norm());
  if (farthest <= std::min(fit.residual_mm + kNoWorseMm, kMostResidualMm)) {
    found.placement = snapped;
    found.residual_mm = farthest;
  }
  found.placement = found.placement * linear_only(linear);
  return found;
}

/// The best of the parts with as many vertices. Parts of one mesh fit alike: then the name decides.
std::optional<Candidate> best_candidate(const std::vector<ExportedPart>& parts, const TrayInstance& instance,
                                        const std::vector<Vec3>& placed) {
  std::optional<Candidate> best;
  bool best_is_named = false;
  for (std::size_t p = 0; p < parts.size(); ++p) {
    if (parts[p].points.size() != placed.size()) continue;
    for (const Mat3& linear : parts[p].linears) {
      std::vector<Vec3> shape = transformed(parts[p].points, linear_only(linear));
      const RigidFit fit = fit_rigid(shape, placed);
      const bool fits = fit.residual_mm <= kMostResidualMm, named = parts[p].name == instance.name;
      const bool best_fits = best && best->fit.residual_mm <= kMostResidualMm;
      const bool better = !best || (fits != best_fits ? fits
                                    : fits            ? named && !best_is_named
                                                      : fit.residual_mm < best->fit.residual_mm);
      if (!better) continue;
      best_is_named = named;
      best = Candidate{found_of(p, linear, shape, placed, fit), std::move(shape), fit};
    }
  }
  return best;
}

std::string micrometres(double mm) { return show_number(1000 * mm) + " um"; }

/// Says how an object was changed that has a part's vertices in other places.
void describe_change(const Candidate& best, const std::string& part, const std::vector<Vec3>& placed,
                     PartSearch& search) {
  const ScaleFit scale = fit_scale(best.shape, placed);
  const bool is_scaled = scale.residual_mm <= kMostResidualMm;
  search.fault += is_scaled ? " is scaled by " + show_number(scale.factors[0]) + " x " + show_number(scale.factors[1]) +
                                  " x " + show_number(scale.factors[2])
                            : " was edited";
  search.fault += ": its vertices are up to " + micrometres(best.fit.residual_mm) + " from those of '" + echoed(part) +
                  "'" + (is_scaled ? "" : " (vertex " + std::to_string(best.fit.farthest) + ")") +
                  ", and 1 um is the most";
  search.remedy = is_scaled ? "set scales to 100 % there, and scale parts with --scale before they are exported"
                            : "load the exported parts anew, and only move, turn, mirror and copy them";
}

/// Whether points are others that were scaled and edited here and there, and not just as many.
bool is_alike(const std::vector<Vec3>& shape, const std::vector<Vec3>& placed) {
  constexpr double kShare = 0.05;
  Box3 box;
  for (const Vec3& point : placed) box.extend(point);
  return fit_scale(shape, placed).residual_mm <= kShare * box.diagonal().norm();
}

const ExportedPart* part_named(const std::vector<ExportedPart>& parts, const std::string& name) {
  const auto found = std::ranges::find(parts, name, &ExportedPart::name);
  return name.empty() || found == parts.end() ? nullptr : &*found;
}

}  // namespace

PartSearch find_part(const std::vector<ExportedPart>& parts, const TrayInstance& instance) {
  PartSearch search;
  if (instance.points->empty()) {
    search.is_foreign = true;
    search.fault = instance.label + " has no vertices";
    return search;
  }
  const std::vector<Vec3> placed = transformed(*instance.points, instance.placement);
  const std::optional<Candidate> best = best_candidate(parts, instance, placed);
  if (best && best->fit.residual_mm <= kMostResidualMm) {
    search.found = best->found;
    return search;
  }
  const ExportedPart* const named = part_named(parts, instance.name);
  if (best && (named != nullptr || is_alike(best->shape, placed))) {
    search.fault = instance.label;
    describe_change(*best, parts[best->found.part].name, placed, search);
  } else if (named != nullptr) {
    search.fault = instance.label + " has " + count_text(placed.size(), "vertex") + ", and '" + echoed(named->name) +
                   "' was exported with " + std::to_string(named->points.size()) +
                   ": it was edited, or exported with another --chord-tolerance or of another mesh";
    search.remedy = "export the parts again as they are now";
  } else {
    search.is_foreign = true;
    search.fault = instance.label + " is none of the job's parts";
  }
  return search;
}

}  // namespace ccslice::cli
