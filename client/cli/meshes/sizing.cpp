// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/sizing.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "client/cli/base/console.h"
#include "client/cli/base/option_group.h"
#include "client/cli/base/text_values.h"
#include "core/mesh/validate.h"
#include "core/prepare/deviation.h"

namespace ccslice::cli {
namespace {

struct Unit {
  std::string_view name;
  double mm;
};

constexpr std::array kUnits = {Unit{"mm", 1}, Unit{"cm", 10}, Unit{"m", 1000}, Unit{"in", 25.4}, Unit{"um", 1e-3}};

double parse_units(const std::string& text) {
  const auto* unit = std::ranges::find(kUnits, text, &Unit::name);
  if (unit == kUnits.end()) {
    throw UsageError("--units takes mm, cm, m, in or um, the unit of the file's coordinates, not '" + text + "'");
  }
  return unit->mm;
}

constexpr double kLeastSideMm = 1e-3, kMostSideMm = 1e6;

[[noreturn]] void refuse_size(const std::string& text) {
  throw UsageError(
      "--size takes the part's longest side in mm, as in 30, or its side along an axis, as in z=30, from 0.001 to "
      "1,000,000; not '" +
      text + "'");
}

void parse_size(const std::string& text, Sizing& sizing) {
  const bool along_axis = text.size() > 1 && text[1] == '=';
  if (along_axis && (text[0] < 'x' || text[0] > 'z')) refuse_size(text);
  if (along_axis) sizing.axis = text[0] - 'x';
  try {
    sizing.side_mm = parse_number("--size", std::string_view(text).substr(along_axis ? 2 : 0));
  } catch (const UsageError&) {
    refuse_size(text);
  }
  if (*sizing.side_mm < kLeastSideMm || *sizing.side_mm > kMostSideMm) refuse_size(text);
}

}  // namespace

void add_size_options(CLI::App& command, SizeOptions& options) {
  const OptionGroup group(command, "Mesh");
  command.add_option(
      "--units", options.units,
      "The unit of the file's coordinates: mm, cm, m, in or um (default: mm). Lengths of all other options "
      "are mm of the result");
  command.add_option(
      "--size", options.size,
      "Scale the part so that its longest side has so many mm, as in 30, or its side along an axis, as in "
      "z=30. Measured on the limit volume, which is what gets printed, after any --scale, which then changes "
      "proportions alone, and before any --rotate");
  command.add_flag("--center", options.center,
                   "Move the middle of the part's box to x = 0, y = 0, before any --rotate and --translate");
  command.add_flag("--on-bed", options.on_bed,
                   "Move the part's lowest point to z = 0, before any --rotate and --translate");
}

Sizing parse_sizing(const SizeOptions& options) {
  Sizing sizing;
  if (!options.units.empty()) sizing.mm_per_unit = parse_units(options.units);
  if (!options.size.empty()) parse_size(options.size, sizing);
  sizing.center = options.center;
  sizing.on_bed = options.on_bed;
  return sizing;
}

void apply_units(const Sizing& sizing, ControlMesh& mesh) {
  if (sizing.mm_per_unit == 1) return;
  for_each_place(mesh, [&](Vec3& place) { place *= sizing.mm_per_unit; });
}

void Similarity::apply(ControlMesh& mesh) const {
  for_each_place(mesh, [this](Vec3& place) { place = (*this)(place); });
}

NearOrigin bring_near(const Sizing& sizing, ControlMesh& mesh) {
  constexpr double kSideMm = 100;
  NearOrigin near;
  if (!sizing.places() || mesh.positions.empty()) return near;
  Box3 box;
  for (const Vec3& position : mesh.positions) {
    if (!position.allFinite()) return near;
    box.extend(position);
  }
  const double farthest = box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
  const Vec3 half = 0.5 * box.max() - 0.5 * box.min();
  if (farthest <= MeshLimits().max_abs_coordinate_mm || !(half.maxCoeff() > 0)) return near;
  near.home = box.min() + half;
  if (sizing.side_mm) near.scale = kSideMm / half.maxCoeff() / 2;
  for_each_place(mesh, [&](Vec3& place) { place = near.scale * (place - near.home); });
  return near;
}

PlaceOfMesh find_place(const SizeOptions& options, const Sizing& sizing, const Vec3& scale, const NearOrigin& near,
                       const ControlMesh& mesh, std::vector<std::string>& notes) {
  const Box3 own = measure_limit(mesh).bounding_box;
  const Vec3 corner = scale.cwiseProduct(own.min()), opposite = scale.cwiseProduct(own.max());
  const Box3 box(corner.cwiseMin(opposite), corner.cwiseMax(opposite));  // As it is printed.
  double factor = 1;
  if (sizing.side_mm) {
    const double side = sizing.axis ? box.sizes()[*sizing.axis] : box.sizes().maxCoeff();
    if (!(side > 0)) throw UsageError("--size " + options.size + ": the part has no extent there; name another axis");
    factor = *sizing.side_mm / side;
  }
  Vec3 offset = factor * near.scale * scale.cwiseProduct(near.home);
  if (sizing.center) offset.head<2>() = -factor * box.center().head<2>();
  if (sizing.on_bed) offset.z() = -factor * box.min().z();
  const Vec3 low = factor * box.min() + offset, high = factor * box.max() + offset;
  const std::string further = scale.cwiseAbs() == Vec3::Ones() ? "" : ", and --scale further";
  notes.push_back((sizing.side_mm
                       ? "--size " + options.size + " scales by " + show_number(factor * near.scale) + further + ": "
                       : "") +
                  "the part takes " + show_box({low.x(), low.y(), low.z()}, {high.x(), high.y(), high.z()}));
  PlaceOfMesh place{{factor, offset.cwiseQuotient(scale)}, Vec3::Zero()};
  if (sizing.on_bed) place.unmirrored.z() = -factor * own.min().z() - place.similarity.offset.z();
  return place;
}

void warn_of_size(const SizeOptions& options, const Vec3& scale, const ControlMesh& mesh,
                  std::vector<std::string>& notes) {
  if (!options.units.empty() || !options.size.empty() || mesh.positions.empty()) return;
  constexpr double kSmallMm = 1, kLargeMm = 1000;
  Box3 box;
  for (const Vec3& position : mesh.positions) box.extend(position);
  const double side = box.sizes().cwiseProduct(scale.cwiseAbs()).maxCoeff();
  if (side >= kSmallMm && side <= kLargeMm) return;
  const std::string otherwise = side < kSmallMm ? "--units m makes it " + show_number(1000 * side) +
                                                      " mm, --units in " + show_number(25.4 * side) + " mm"
                                                : "--units um makes it " + show_number(side / 1000) + " mm";
  notes.push_back("the longest side of the control mesh is " + show_number(side) +
                  " mm. Is the file in another unit? " + otherwise +
                  "; --size sets the size; --units mm says that it is meant");
}

}  // namespace ccslice::cli
