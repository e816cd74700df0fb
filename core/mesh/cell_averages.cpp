// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/cell_averages.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh/cell_numbers.h"
#include "core/mesh/channels.h"
#include "core/mesh/offenders.h"

namespace ccslice {
namespace {

/// Of the corners' polyhedron, its faces parted at the means of their corners. `corners`: in VTK order.
double volume_of(CellKind kind, std::span<const std::uint32_t> corners, const std::vector<Vec3>& positions) {
  const Vec3& origin = positions[corners[0]];
  const auto corner = [&](std::uint8_t local) -> Vec3 {
    return positions[corners[kind == CellKind::kHex ? vtk_to_bits(local) : local]] - origin;
  };
  double six_volumes = 0;
  for (const LocalFace& face : cell_topology(kind).faces) {
    Vec3 middle = Vec3::Zero();
    for (std::size_t i = 0; i < face.size; ++i) middle += corner(face.corners[i]) / face.size;
    for (std::size_t i = 0; i < face.size; ++i) {
      six_volumes += corner(face.corners[i]).cross(corner(face.corners[(i + 1) % face.size])).dot(middle);
    }
  }
  return std::abs(six_volumes) / 6;
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

void average_cell_numbers(const std::string& name, MeshFile& file) {
  ControlMesh& mesh = file.mesh;
  const auto found = std::ranges::find(file.cell_numbers, name, &CellNumbers::name);
  if (found == file.cell_numbers.end()) {
    throw Error(ErrorCode::kMeshBadChannel,
                "the file has no numbers called '" + echoed(name) + "' for its cells; " + known_cell_numbers(file),
                "channel_names");
  }
  if (std::ranges::find(mesh.channel_names, name) != mesh.channel_names.end()) {
    throw Error(ErrorCode::kMeshBadChannel, "the mesh has a channel '" + echoed(name) + "' already", "channel_names");
  }
  require_floats(*found);
  struct Mean {
    double weighted = 0, weights = 0;
    double sum = 0, count = 0;  // For vertices whose cells are all flat.
  };
  std::vector<Mean> means(mesh.vertex_count());
  std::size_t first = 0;
  for (std::size_t cell = 0; cell < mesh.cell_count(); ++cell) {
    const CellKind kind = mesh.cell_kinds[cell];
    const auto count = static_cast<std::size_t>(corner_count(kind));
    const std::span<const std::uint32_t> corners = std::span(mesh.cell_vertices).subspan(first, count);
    const double volume = volume_of(kind, corners, mesh.positions), number = found->of_cells[cell];
    for (const std::uint32_t vertex : corners) {
      Mean& mean = means[vertex];
      mean.weighted += volume * number;
      mean.weights += volume;
      mean.sum += number;
      mean.count += 1;
    }
    first += count;
  }
  NamedChannel channel{name, {}};
  for (const Mean& mean : means) {
    channel.values.push_back(
        static_cast<float>(mean.weights > 0 ? mean.weighted / mean.weights : mean.sum / mean.count));
  }
  append_channels({&channel, 1}, mesh);
}

}  // namespace ccslice
