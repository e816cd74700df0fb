// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/part_places.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <utility>

#include "client/cli/base/text_values.h"
#include "core/base/count_text.h"
#include "core/base/echo.h"

namespace ccslice::cli {
namespace {

/// `placement`, which has a matrix, moved.
v1::Placement moved(v1::Placement placement, const std::vector<double>& by_mm) {
  constexpr int kRow = 4;
  for (int axis = 0; axis < 3; ++axis) {
    const int entry = kRow * axis + kRow - 1;
    placement.set_matrix(entry, placement.matrix(entry) + by_mm[static_cast<std::size_t>(axis)]);
  }
  return placement;
}

/// The file's name without its folder and ending, and a number behind it if another part has that, too.
std::string name_of_part(const std::string& mesh, const v1::SliceJob& job) {
  constexpr std::size_t kMostBytes = 56;
  const std::string name = echoed(std::filesystem::path(mesh).stem().string(), kMostBytes);
  const auto is_taken = [&](const std::string& wanted) {
    return std::ranges::any_of(job.parts(), [&](const v1::Part& part) { return part.name() == wanted; });
  };
  std::string free = name;
  for (int number = 2; is_taken(free); ++number) free = name + "-" + std::to_string(number);
  return free;
}

}  // namespace

void add_part_options(CLI::App& command, PartOptions& options) {
  command.add_option(
      "MORE", options.more,
      "Further parts of the job: files or ids like MESH, which options of the mesh hold for, too. A voxel in "
      "several parts is the first one's");
  command
      .add_option("--at", options.places,
                  "X,Y,Z in mm: where to move a part to, after --scale, --rotate and --translate. Repeated for several "
                  "parts, in their order; for a single one, a copy at each place")
      ->allow_extra_args(false)
      ->group("Placement");
}

void add_overlap_options(CLI::App& command, PartOptions& options) {
  command
      .add_flag("--snap", options.snap,
                "Move copies by up to half a voxel, to whole voxels from the first of their part: copies in the same "
                "layers are computed once, which takes far less time")
      ->group("Placement");
  command
      .add_option("--overlaps", options.overlaps,
                  "Voxels in several parts are those of the first one (priority), or end the job (refuse)")
      ->check(CLI::IsMember({"priority", "refuse"}))
      ->capture_default_str()
      ->group("Placement");
}

void place_parts(const std::string& mesh, const PartOptions& options, v1::SliceJob& job) {
  job.set_snap(options.snap);
  if (options.overlaps == "refuse") job.set_overlaps(v1::PART_OVERLAPS_REFUSE);
  std::vector<std::vector<double>> places;
  for (const std::string& place : options.places) places.push_back(parse_numbers("--at", place, 3, 3));
  const v1::Placement placement = job.parts(0).placements(0);
  if (options.more.empty()) {
    for (std::size_t i = 0; i < places.size(); ++i) {
      *(i == 0 ? job.mutable_parts(0)->mutable_placements(0) : job.mutable_parts(0)->add_placements()) =
          moved(placement, places[i]);
    }
    return;
  }
  if (!places.empty() && places.size() != options.more.size() + 1) {
    throw UsageError("--at: " + count_text(places.size(), "place") + " for " + std::to_string(options.more.size() + 1) +
                     " parts; give it once for each, or not at all");
  }
  job.mutable_parts(0)->set_name(name_of_part(mesh, job));
  for (const std::string& other : options.more) {
    v1::Part part;
    part.set_name(name_of_part(other, job));
    *part.add_placements() = placement;
    *job.add_parts() = std::move(part);
  }
  for (int p = 0; p < job.parts_size() && !places.empty(); ++p) {
    *job.mutable_parts(p)->mutable_placements(0) = moved(placement, places[static_cast<std::size_t>(p)]);
  }
}

}  // namespace ccslice::cli
