// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/cell_averages.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "core/base/contains.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh/cell_numbers.h"
#include "core/mesh/channels.h"
#include "core/mesh/face_cone.h"
#include "core/mesh/offenders.h"

namespace ccslice {
namespace {

/// The volume between the cell's bilinear faces. `corners`: in VTK order.
double volume_of(CellKind kind, std::span<const std::uint32_t> corners, const std::vector<Vec3>& positions) {
  const Vec3& origin = positions[corners[0]];
  double six_volumes = 0;
  for (const LocalFace& face : cell_topology(kind).faces) {
    std::array<Vec3, 4> ring;
    for (std::size_t i = 0; i < face.size; ++i) {
      const std::uint8_t local = face.corners[i];
      ring[i] = positions[corners[kind == CellKind::kHex ? vtk_to_bits(local) : local]] - origin;
    }
    six_volumes += six_cones(std::span(ring).first(face.size));
  }
  return std::abs(six_volumes) / 6;
}

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

std::vector<VertexMean> vertex_means(const ControlMesh& mesh, const std::vector<double>& of_cells) {
  std::vector<VertexMean> means(mesh.vertex_count());
  std::size_t first = 0;
  for (std::size_t cell = 0; cell < mesh.cell_count(); ++cell) {
    const CellKind kind = mesh.cell_kinds[cell];
    const auto count = static_cast<std::size_t>(corner_count(kind));
    const std::span<const std::uint32_t> corners = std::span(mesh.cell_vertices).subspan(first, count);
    const double volume = volume_of(kind, corners, mesh.positions);
    for (const std::uint32_t vertex : corners) means[vertex].add(of_cells[cell], volume);
    first += count;
  }
  return means;
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
  if (contains(mesh.channel_names, name)) {
    throw Error(ErrorCode::kMeshBadChannel, "the mesh has a channel '" + echoed(name) + "' already", "channel_names");
  }
  require_floats(*found);
  NamedChannel channel{name, {}};
  for (const VertexMean& mean : vertex_means(mesh, found->of_cells)) {
    channel.values.push_back(static_cast<float>(mean.value()));
  }
  append_channels({&channel, 1}, mesh);
}

}  // namespace ccslice
