// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/mesh_convert.h"

#include <algorithm>
#include <array>
#include <string>

#include "client/job.h"
#include "core/base/error.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh/cell_regions.h"

namespace ccslice::cli {
namespace {

/// The contract's values, in the order of the core's.
const std::array<v1::CellKind, kCellKinds.size()>& proto_kinds() {
  static const auto kValues = [] {
    std::array<v1::CellKind, kCellKinds.size()> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      v1::CellKind_Parse("CELL_KIND_" + std::string(kCellKinds[i].name), &values[i]);
    }
    return values;
  }();
  return kValues;
}

v1::CellKind kind_to_proto(CellKind kind) { return proto_kinds()[static_cast<std::size_t>(kind)]; }

CellKind kind_from_proto(int cell, int kind) {
  const auto found = std::ranges::find(proto_kinds(), kind);
  if (found != proto_kinds().end()) return kCellKinds[static_cast<std::size_t>(found - proto_kinds().begin())].kind;
  const bool pyramid = kind == v1::CELL_KIND_PYRAMID;
  throw Error(pyramid ? ErrorCode::kMeshUnsupportedCell : ErrorCode::kMeshUnknownCellKind,
              "cell " + std::to_string(cell) +
                  (pyramid ? " is a pyramid, which never refines to hexahedra: split it into tetrahedra"
                           : " is neither a hexahedron, a tetrahedron nor a wedge"),
              "cell_kinds[" + std::to_string(cell) + "]", {cell});
}

v1::FoldPlace fold_to_proto(const FoldPlace& fold) {
  v1::FoldPlace message;
  message.set_limit_cell(fold.cell);
  message.set_control_cell(fold.control_cell);
  *message.mutable_position_mm() = to_proto(fold.position);
  message.set_determinant(fold.determinant);
  return message;
}

v1::Overlaps overlaps_to_proto(const Overlaps& overlaps) {
  v1::Overlaps message;
  message.set_limit_cells(overlaps.cells);
  message.set_depth_mm(overlaps.depth_mm);
  message.set_volume_mm3(overlaps.volume_mm3);
  message.set_more(overlaps.at_least);
  for (const OverlapPlace& place : overlaps.places) {
    v1::OverlapPlace& added = *message.add_places();
    added.set_control_cell(place.cell);
    added.set_other_control_cell(place.other);
    *added.mutable_position_mm() = to_proto(place.position);
    added.set_depth_mm(place.depth_mm);
  }
  return message;
}

void require_multiple(int size, int of, const char* field) {
  if (size % of == 0) return;
  throw Error(ErrorCode::kMeshArrayMismatch,
              std::string(field) + " has " + std::to_string(size) + " numbers, not a multiple of " + std::to_string(of),
              field);
}

/// Numbers beyond those of regions become kNoCellRegion.
std::vector<std::uint8_t> regions_from_proto(const google::protobuf::RepeatedField<std::uint32_t>& numbers) {
  std::vector<std::uint8_t> regions;
  for (const std::uint32_t region : numbers) {
    regions.push_back(static_cast<std::uint8_t>(std::min<std::uint32_t>(region, kNoCellRegion)));
  }
  return regions;
}

std::vector<MissedVertex> missed_from_proto(const v1::ControlMesh& message) {
  if (message.missed_positions_mm_size() != 3 * std::int64_t{message.missed_vertices_size()}) {
    throw Error(ErrorCode::kMeshArrayMismatch,
                "missed_positions_mm has " + std::to_string(message.missed_positions_mm_size()) +
                    " numbers, not 3 for each of the " + std::to_string(message.missed_vertices_size()) +
                    " missed_vertices",
                "missed_positions_mm");
  }
  std::vector<MissedVertex> missed;
  for (int i = 0; i < message.missed_vertices_size(); ++i) {
    missed.push_back({message.missed_vertices(i), Vec3::Map(&message.missed_positions_mm().Get(3 * i))});
  }
  return missed;
}

void nodes_to_proto(const MidNodes& nodes, v1::ControlMesh& message) {
  for (const auto& edge : nodes.edges) {
    for (const std::uint32_t vertex : edge) message.add_edge_node_vertices(vertex);
  }
  for (const auto& face : nodes.faces) {
    for (const std::uint32_t vertex : face) message.add_face_node_vertices(vertex);
  }
  message.mutable_cell_node_cells()->Assign(nodes.cells.begin(), nodes.cells.end());
  for (const Vec3& position : nodes.positions) {
    for (const double coordinate : position) message.add_node_positions_mm(coordinate);
  }
  message.mutable_node_values()->Assign(nodes.values.begin(), nodes.values.end());
}

MidNodes nodes_from_proto(const v1::ControlMesh& message) {
  require_multiple(message.edge_node_vertices_size(), 2, "edge_node_vertices");
  require_multiple(message.face_node_vertices_size(), 4, "face_node_vertices");
  require_multiple(message.node_positions_mm_size(), 3, "node_positions_mm");
  MidNodes nodes;
  for (int i = 0; i < message.edge_node_vertices_size(); i += 2) {
    std::copy_n(&message.edge_node_vertices().Get(i), 2, nodes.edges.emplace_back().begin());
  }
  for (int i = 0; i < message.face_node_vertices_size(); i += 4) {
    std::copy_n(&message.face_node_vertices().Get(i), 4, nodes.faces.emplace_back().begin());
  }
  nodes.cells.assign(message.cell_node_cells().begin(), message.cell_node_cells().end());
  for (int i = 0; i < message.node_positions_mm_size(); i += 3) {
    nodes.positions.emplace_back(Vec3::Map(&message.node_positions_mm().Get(i)));
  }
  nodes.values.assign(message.node_values().begin(), message.node_values().end());
  return nodes;
}

}  // namespace

v1::ControlMesh to_proto(const ControlMesh& mesh) {
  v1::ControlMesh message;
  for (const Vec3& position : mesh.positions) {
    for (const double coordinate : position) message.add_positions_mm(coordinate);
  }
  for (const std::string& name : mesh.channel_names) message.add_channel_names(name);
  message.mutable_channel_values()->Assign(mesh.channel_values.begin(), mesh.channel_values.end());
  for (const CellKind kind : mesh.cell_kinds) message.add_cell_kinds(kind_to_proto(kind));
  message.mutable_cell_vertices()->Assign(mesh.cell_vertices.begin(), mesh.cell_vertices.end());
  for (const auto& [a, b] : mesh.sharp_edges) {
    message.add_sharp_edges(a);
    message.add_sharp_edges(b);
  }
  message.mutable_sharp_vertices()->Assign(mesh.sharp_vertices.begin(), mesh.sharp_vertices.end());
  for (const std::string& name : mesh.cell_region_names) message.add_cell_region_names(name);
  message.mutable_cell_regions()->Assign(mesh.cell_regions.begin(), mesh.cell_regions.end());
  message.mutable_region_value_vertices()->Assign(mesh.region_value_vertices.begin(), mesh.region_value_vertices.end());
  message.mutable_region_value_regions()->Assign(mesh.region_value_regions.begin(), mesh.region_value_regions.end());
  message.mutable_region_values()->Assign(mesh.region_values.begin(), mesh.region_values.end());
  message.set_allow_folds(mesh.allow_folds);
  message.set_interpolating(mesh.interpolating);
  for (const auto& [vertex, position] : mesh.missed_vertices) {
    message.add_missed_vertices(vertex);
    for (const double coordinate : position) message.add_missed_positions_mm(coordinate);
  }
  message.set_as_meshed(mesh.as_meshed);
  nodes_to_proto(mesh.mid_nodes, message);
  return message;
}

v1::Vector3 to_proto(const Vec3& vector) { return client::vector_of(vector.x(), vector.y(), vector.z()); }

v1::Box3 to_proto(const Box3& box) {
  v1::Box3 message;
  *message.mutable_min_mm() = to_proto(box.min());
  *message.mutable_max_mm() = to_proto(box.max());
  return message;
}

v1::LimitDeviation to_proto(const Deviation& deviation) {
  v1::LimitDeviation message;
  message.set_control_volume_mm3(deviation.control_volume_mm3);
  message.set_limit_volume_mm3(deviation.limit_volume_mm3);
  *message.mutable_control_box() = to_proto(deviation.control_box);
  message.set_farthest_vertex(deviation.farthest.vertex);
  *message.mutable_farthest_vertex_mm() = to_proto(deviation.farthest.position);
  *message.mutable_farthest_limit_mm() = to_proto(deviation.farthest.limit);
  message.set_farthest_distance_mm(deviation.farthest.distance_mm());
  message.set_farthest_on_interface(deviation.farthest.on_interface);
  message.set_interpolating(deviation.interpolating);
  message.set_as_meshed(deviation.as_meshed);
  message.set_vertex_limits_volume_mm3(deviation.vertex_limits_volume_mm3);
  if (deviation.rounded.count > 0) {
    message.set_rounded_edges(deviation.rounded.count);
    *message.mutable_rounded_edge_mm() = to_proto(deviation.rounded.place);
    message.set_rounded_edge_deg(deviation.rounded.turn_deg);
  }
  return message;
}

v1::MeshSummary to_proto(const SolidSummary& solid) {
  v1::MeshSummary message;
  *message.mutable_bounding_box() = to_proto(solid.bounding_box);
  *message.mutable_deviation() = to_proto(solid.deviation);
  message.set_folding_cells(solid.folding_cells);
  message.set_undecided_cells(solid.undecided_cells);
  for (const FoldPlace& fold : solid.folds) *message.add_folds() = fold_to_proto(fold);
  *message.mutable_overlaps() = overlaps_to_proto(solid.overlaps);
  return message;
}

v1::CellRegion to_proto(const CellRegionSummary& region) {
  v1::CellRegion message;
  message.set_name(region.name);
  message.set_control_cells(region.control_cells);
  message.set_volume_mm3(region.volume_mm3);
  message.set_control_volume_mm3(region.control_volume_mm3);
  return message;
}

ControlMesh from_proto(const v1::ControlMesh& message) {
  require_multiple(message.positions_mm_size(), 3, "positions_mm");
  require_multiple(message.sharp_edges_size(), 2, "sharp_edges");
  ControlMesh mesh;
  for (int i = 0; i < message.positions_mm_size(); i += 3) {
    mesh.positions.emplace_back(message.positions_mm(i), message.positions_mm(i + 1), message.positions_mm(i + 2));
  }
  mesh.channel_names.assign(message.channel_names().begin(), message.channel_names().end());
  mesh.channel_values.assign(message.channel_values().begin(), message.channel_values().end());
  for (int i = 0; i < message.cell_kinds_size(); ++i) {
    mesh.cell_kinds.push_back(kind_from_proto(i, message.cell_kinds(i)));
  }
  mesh.cell_vertices.assign(message.cell_vertices().begin(), message.cell_vertices().end());
  for (int i = 0; i < message.sharp_edges_size(); i += 2) {
    mesh.sharp_edges.push_back({message.sharp_edges(i), message.sharp_edges(i + 1)});
  }
  mesh.sharp_vertices.assign(message.sharp_vertices().begin(), message.sharp_vertices().end());
  mesh.cell_region_names.assign(message.cell_region_names().begin(), message.cell_region_names().end());
  mesh.cell_regions = regions_from_proto(message.cell_regions());
  mesh.region_value_vertices.assign(message.region_value_vertices().begin(), message.region_value_vertices().end());
  mesh.region_value_regions = regions_from_proto(message.region_value_regions());
  mesh.region_values.assign(message.region_values().begin(), message.region_values().end());
  mesh.allow_folds = message.allow_folds();
  mesh.interpolating = message.interpolating();
  mesh.missed_vertices = missed_from_proto(message);
  mesh.as_meshed = message.as_meshed();
  mesh.mid_nodes = nodes_from_proto(message);
  return mesh;
}

}  // namespace ccslice::cli
