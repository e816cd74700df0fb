// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Channels that jump across interfaces of cell regions: what a vertex has in one of its regions.

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/mesh/control_mesh.h"

namespace ccslice {

/// How many pairs of a vertex and a region have values of their own.
inline std::size_t region_value_count(const ControlMesh& mesh) { return mesh.region_value_vertices.size(); }

/// Which of them a vertex and a region are, if they are one.
std::optional<std::size_t> region_value_row(const ControlMesh& mesh, std::uint32_t vertex, std::uint8_t region);

/// The channels of a vertex in a region: its row of region_values, else that of channel_values. REQUIRES: a mesh that
/// passes check_arrays().
std::span<const float> values_in_region(const ControlMesh& mesh, std::uint32_t vertex, std::uint8_t region);

/// Adds the channels that a vertex has in a region. REQUIRES: ascending by vertex, then by region; c values.
void append_region_values(std::uint32_t vertex, std::uint8_t region, std::span<const float> values, ControlMesh& mesh);

/// Drops them all.
void clear_region_values(ControlMesh& mesh);

/// Throws Error{kMeshArrayMismatch, kMeshIndexOutOfRange, kMeshBadCellRegion, kMeshNonFinite} unless the pairs ascend,
/// every vertex is on an interface with a cell of that region, and values are finite. REQUIRES: cells and their regions
/// have been checked.
void check_region_values(const ControlMesh& mesh);

}  // namespace ccslice
