// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/region_values.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/offenders.h"

namespace ccslice {
namespace {

constexpr const char* kVerticesField = "region_value_vertices";
constexpr const char* kRegionsField = "region_value_regions";
constexpr const char* kValuesField = "region_values";

void check_lengths(const ControlMesh& mesh) {
  const std::size_t pairs = region_value_count(mesh);
  const auto require = [&](std::size_t length, std::size_t expected, const char* field) {
    if (length == expected) return;
    throw Error(ErrorCode::kMeshArrayMismatch,
                std::string(field) + " holds " + std::to_string(length) + " numbers, but the " + std::to_string(pairs) +
                    " vertices of " + kVerticesField + " need " + std::to_string(expected),
                field);
  };
  require(mesh.region_value_regions.size(), pairs, kRegionsField);
  require(mesh.region_values.size(), pairs * mesh.channel_count(), kValuesField);
}

void check_pairs(const ControlMesh& mesh) {
  Offenders beyond, unknown;
  for (std::size_t i = 0; i < region_value_count(mesh); ++i) {
    const std::uint32_t vertex = mesh.region_value_vertices[i];
    if (vertex >= mesh.vertex_count()) beyond.add(vertex, i);
    if (mesh.region_value_regions[i] >= mesh.cell_region_names.size()) unknown.add(mesh.region_value_regions[i], i);
  }
  beyond.throw_if_any(ErrorCode::kMeshIndexOutOfRange, "out of range:", kVertices,
                      "the mesh has " + std::to_string(mesh.vertex_count()) + " vertices, counted from 0",
                      kVerticesField);
  unknown.throw_if_any(
      ErrorCode::kMeshBadCellRegion, "no such cell region:", {"region", "regions"},
      "cell_region_names holds " + std::to_string(mesh.cell_region_names.size()) + " names, counted from 0",
      kRegionsField);
  for (std::size_t i = 1; i < region_value_count(mesh); ++i) {
    const std::uint32_t before = mesh.region_value_vertices[i - 1], vertex = mesh.region_value_vertices[i];
    if (before < vertex) continue;
    if (before == vertex && mesh.region_value_regions[i - 1] < mesh.region_value_regions[i]) continue;
    const std::string field = kVerticesField + ("[" + std::to_string(i) + "]");
    throw Error(ErrorCode::kMeshBadCellRegion,
                field + ": vertex " + std::to_string(vertex) +
                    " comes again or too late: list pairs by vertex, then by region, each once",
                field, {vertex});
  }
}

/// Each pair's region has a cell there, and some other region has one, too.
void check_places(const ControlMesh& mesh) {
  std::vector<std::uint8_t> first_region(mesh.vertex_count(), kNoCellRegion);
  std::vector<bool> on_interface(mesh.vertex_count(), false), has_cell(region_value_count(mesh), false);
  std::size_t begin = 0;
  for (std::size_t cell = 0; cell < mesh.cell_count(); ++cell) {
    const std::uint8_t region = mesh.cell_regions[cell];
    const auto count = static_cast<std::size_t>(corner_count(mesh.cell_kinds[cell]));
    for (const std::uint32_t vertex : std::span(mesh.cell_vertices).subspan(begin, count)) {
      if (first_region[vertex] == kNoCellRegion) first_region[vertex] = region;
      if (first_region[vertex] != region) on_interface[vertex] = true;
      if (const auto row = region_value_row(mesh, vertex, region)) has_cell[*row] = true;
    }
    begin += count;
  }
  Offenders misplaced;
  for (std::size_t i = 0; i < region_value_count(mesh); ++i) {
    const std::uint32_t vertex = mesh.region_value_vertices[i];
    if (!has_cell[i] || !on_interface[vertex]) misplaced.add(vertex, i);
  }
  misplaced.throw_if_any(ErrorCode::kMeshBadCellRegion, "values of a region that hasn't an interface at", kVertices,
                         "give them in channel_values", kVerticesField);
}

void check_values(const ControlMesh& mesh) {
  Offenders non_finite;
  for (std::size_t i = 0; i < mesh.region_values.size(); ++i) {
    if (std::isfinite(mesh.region_values[i])) continue;
    non_finite.add(mesh.region_value_vertices[i / mesh.channel_count()], i);
  }
  non_finite.throw_if_any(ErrorCode::kMeshNonFinite, "NaN or infinite value of a region at", kVertices,
                          "give finite values", kValuesField);
}

}  // namespace

std::optional<std::size_t> region_value_row(const ControlMesh& mesh, std::uint32_t vertex, std::uint8_t region) {
  const auto& vertices = mesh.region_value_vertices;
  const auto [first, last] = std::equal_range(vertices.begin(), vertices.end(), vertex);
  for (auto at = first; at != last; ++at) {
    const auto row = static_cast<std::size_t>(at - vertices.begin());
    if (mesh.region_value_regions[row] == region) return row;
  }
  return std::nullopt;
}

std::span<const float> values_in_region(const ControlMesh& mesh, std::uint32_t vertex, std::uint8_t region) {
  const std::size_t channels = mesh.channel_count();
  if (const auto row = region_value_row(mesh, vertex, region)) {
    return std::span(mesh.region_values).subspan(*row * channels, channels);
  }
  return std::span(mesh.channel_values).subspan(vertex * channels, channels);
}

void append_region_values(std::uint32_t vertex, std::uint8_t region, std::span<const float> values, ControlMesh& mesh) {
  mesh.region_value_vertices.push_back(vertex);
  mesh.region_value_regions.push_back(region);
  mesh.region_values.insert(mesh.region_values.end(), values.begin(), values.end());
}

void clear_region_values(ControlMesh& mesh) {
  mesh.region_value_vertices.clear();
  mesh.region_value_regions.clear();
  mesh.region_values.clear();
}

void check_region_values(const ControlMesh& mesh) {
  check_lengths(mesh);
  if (region_value_count(mesh) == 0) return;
  check_pairs(mesh);
  check_places(mesh);
  check_values(mesh);
}

}  // namespace ccslice
