// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/cell_averages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "core/base/contains.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/similar_name.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/face_cone.h"
#include "core/mesh/offenders.h"
#include "core/mesh/region_values.h"
#include "core/mesh_import/cell_numbers.h"
#include "core/mesh_import/channels.h"

namespace ccslice {
namespace {

/// The mean over a vertex's cells, weighted by their volumes.
class VertexMean {
 public:
  void add(double number, double volume) {
    weighted_ += volume * number;
    weights_ += volume;
    sum_ += number;
    count_ += 1;
  }
  double value() const { return weights_ > 0 ? weighted_ / weights_ : sum_ / count_; }

 private:
  double weighted_ = 0, weights_ = 0;
  double sum_ = 0, count_ = 0;  // Without weights, for vertices whose cells are all flat.
};

using Place = std::pair<std::uint32_t, std::uint8_t>;  // A vertex and a region.

/// Means over a vertex's cells in its first region, that of its lowest cell, and in each other one.
struct RegionMeans {
  std::vector<VertexMean> first;
  std::map<Place, VertexMean> others;
};

/// `regions`: of the cells; none: all are of one.
RegionMeans region_means(const ControlMesh& mesh, std::span<const std::uint8_t> regions,
                         const std::vector<double>& of_cells) {
  RegionMeans means{std::vector<VertexMean>(mesh.vertex_count()), {}};
  std::vector<std::uint8_t> first_region(mesh.vertex_count(), kNoCellRegion);
  std::size_t begin = 0;
  for (std::size_t cell = 0; cell < mesh.cell_count(); ++cell) {
    const CellKind kind = mesh.cell_kinds[cell];
    const auto count = static_cast<std::size_t>(corner_count(kind));
    const std::span<const std::uint32_t> corners = std::span(mesh.cell_vertices).subspan(begin, count);
    const double volume = std::abs(
        cell_volume(kind, corners, [&](std::uint32_t vertex) -> const Vec3& { return mesh.positions[vertex]; }));
    const std::uint8_t region = regions.empty() ? std::uint8_t{0} : regions[cell];
    for (const std::uint32_t vertex : corners) {
      if (first_region[vertex] == kNoCellRegion) first_region[vertex] = region;
      VertexMean& mean = first_region[vertex] == region ? means.first[vertex] : means.others[{vertex, region}];
      mean.add(of_cells[cell], volume);
    }
    begin += count;
  }
  return means;
}

/// Sets the last channel in these regions, where the others stay as they are.
void set_last_channel(const std::map<Place, VertexMean>& means, ControlMesh& mesh) {
  std::vector<float> rows;
  for (const auto& [place, mean] : means) {
    const auto row = values_in_region(mesh, place.first, place.second);
    rows.insert(rows.end(), row.begin(), row.end());
    rows.back() = static_cast<float>(mean.value());
  }
  clear_region_values(mesh);
  std::size_t begin = 0;
  for (const auto& [place, mean] : means) {
    append_region_values(place.first, place.second, std::span(rows).subspan(begin, mesh.channel_count()), mesh);
    begin += mesh.channel_count();
  }
}

void require_floats(const CellNumbers& numbers) {
  Offenders offenders;
  for (std::size_t cell = 0; cell < numbers.of_cells.size(); ++cell) {
    const bool fits = std::abs(numbers.of_cells[cell]) <= std::numeric_limits<float>::max();
    if (!fits) offenders.add(static_cast<std::int64_t>(cell));
  }
  offenders.throw_if_any(ErrorCode::kMeshNonFinite, "'" + echoed(numbers.name) + "' is no finite float in", kCells,
                         "give them numbers", "channel_values");
}

}  // namespace

void average_cell_numbers(const std::string& name, MeanOver over, MeshFile& file) {
  ControlMesh& mesh = file.mesh;
  const auto found = std::ranges::find(file.cell_numbers, name, &CellNumbers::name);
  if (found == file.cell_numbers.end()) {
    throw Error(ErrorCode::kMeshBadChannel,
                "the file has no numbers called '" + echoed(name) + "' for its cells; " + known_cell_numbers(file) +
                    hint_of_case(file.cell_numbers, name, '\''),
                "channel_names");
  }
  if (contains(mesh.channel_names, name)) {
    throw Error(ErrorCode::kMeshBadChannel, "the mesh has a channel '" + echoed(name) + "' already", "channel_names");
  }
  const bool by_region = over == MeanOver::kEachRegion;
  if (by_region && mesh.cell_regions.empty()) {
    throw Error(ErrorCode::kMeshBadCellRegion, "means of each region of '" + echoed(name) + "' need cell regions",
                "cell_regions");
  }
  require_floats(*found);
  const RegionMeans means =
      region_means(mesh, by_region ? mesh.cell_regions : std::vector<std::uint8_t>(), found->of_cells);
  NamedChannel channel{name, {}};
  for (const VertexMean& mean : means.first) channel.values.push_back(static_cast<float>(mean.value()));
  append_channels({&channel, 1}, mesh);
  if (!means.others.empty()) set_last_channel(means.others, mesh);
}

}  // namespace ccslice
