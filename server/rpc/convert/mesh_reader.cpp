// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/mesh_reader.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <algorithm>
#include <array>
#include <bit>
#include <optional>

#include "ccslice/v1/mesh.pb.h"
#include "core/base/choice_text.h"
#include "core/base/error.h"
#include "core/base/utf8.h"
#include "core/mesh/validate.h"
#include "server/rpc/convert/block_stream.h"
#include "server/rpc/convert/convert.h"

namespace ccslice::server {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;
using MeshMessage = v1::ControlMesh;

[[noreturn]] void not_a_mesh() {
  throw Error(ErrorCode::kMeshMalformed,
              "the chunks don't add up to a serialized ccslice.v1.ControlMesh: send all its bytes in order", "chunk");
}

[[noreturn]] void mismatch(const std::string& field, std::size_t numbers, const std::string& remedy) {
  throw Error(ErrorCode::kMeshArrayMismatch, field + " has " + std::to_string(numbers) + " numbers: " + remedy, field);
}

/// The contract's values, in the order of the core's.
std::array<int, kCellKinds.size()> contract_kinds() {
  std::array<int, kCellKinds.size()> values{};
  std::ranges::transform(kCellKinds, values.begin(), [](const CellKindTraits& traits) { return to_message(traits); });
  return values;
}

CellKind to_cell_kind(int kind, std::size_t cell) {
  static const auto kValues = contract_kinds();
  const auto found = std::ranges::find(kValues, kind);
  if (found != kValues.end()) return kCellKinds[static_cast<std::size_t>(found - kValues.begin())].kind;
  const std::string field = "cell_kinds[" + std::to_string(cell) + "]";
  if (kind == v1::CELL_KIND_PYRAMID) {
    throw Error(ErrorCode::kMeshUnsupportedCell,
                field + " is a pyramid: no refinement turns it into hexahedra; split it into tetrahedra", field,
                {static_cast<std::int64_t>(cell)});
  }
  throw Error(
      ErrorCode::kMeshUnknownCellKind,
      field + " is " + std::to_string(kind) + ", no cell kind that this server knows: use " + choice_text(kCellKinds),
      field, {static_cast<std::int64_t>(cell)});
}

class MeshReader {
 public:
  MeshReader(const std::vector<std::string>& blocks, const MeshLimits& limits, const CancellationToken& cancel)
      : blocks_(blocks), in_(blocks_.stream()), limits_(limits), poll_(cancel) {
    cancel.throw_if_cancelled();
  }

  ControlMesh read() {
    while (const std::uint32_t tag = in_.ReadTag()) read_field(tag);
    if (!in_.ConsumedEntireMessage()) not_a_mesh();
    require_whole(numbers_, 3, "positions_mm", "3 per vertex");
    require_whole(sharp_ends_, 2, "sharp_edges", "2 vertices per edge");
    require_whole(edge_vertices_, 2, "edge_node_vertices", "2 vertices per edge");
    require_whole(face_vertices_, 4, "face_node_vertices", "4 vertices per face");
    require_whole(node_numbers_, 3, "node_positions_mm", "3 per mid-node");
    std::size_t corners = 0;
    for (const CellKind kind : mesh_.cell_kinds) corners += static_cast<std::size_t>(corner_count(kind));
    if (mesh_.cell_vertices.size() != corners) {
      mismatch("cell_vertices", mesh_.cell_vertices.size(), "cell_kinds asks for " + std::to_string(corners));
    }
    if (!mesh_.as_meshed && !mesh_.mid_nodes.empty()) {
      throw Error(ErrorCode::kMeshBadMidNode, "mid-nodes go with as_meshed alone: set it, or leave them out",
                  "edge_node_vertices");
    }
    join_missed();
    return std::move(mesh_);
  }

 private:
  void read_field(std::uint32_t tag) {
    poll_();
    switch (WireFormatLite::GetTagFieldNumber(tag)) {
      case MeshMessage::kPositionsMmFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_FIXED64, [this] { add_position(read_fixed64()); });
      case MeshMessage::kChannelNamesFieldNumber:
        return read_name(tag,
                         {ErrorCode::kMeshBadChannel, "channel_names", "channels", limits_.max_channels,
                          limits_.max_channel_name_bytes},
                         mesh_.channel_names);
      case MeshMessage::kCellRegionNamesFieldNumber:
        return read_name(tag,
                         {ErrorCode::kMeshBadCellRegion, "cell_region_names", "cell regions", limits_.max_cell_regions,
                          limits_.max_cell_region_name_bytes},
                         mesh_.cell_region_names);
      case MeshMessage::kCellRegionsFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_VARINT, [this] {
          require_room(mesh_.cell_regions.size(), limits_.max_cells, "cell_regions", "cells");
          add_region(read_varint(), "cell_regions", mesh_.cell_regions);
        });
      case MeshMessage::kRegionValueVerticesFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_VARINT, [this] {
          require_room_for_pair(mesh_.region_value_vertices.size(), "region_value_vertices");
          mesh_.region_value_vertices.push_back(read_varint());
        });
      case MeshMessage::kRegionValueRegionsFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_VARINT, [this] {
          require_room_for_pair(mesh_.region_value_regions.size(), "region_value_regions");
          add_region(read_varint(), "region_value_regions", mesh_.region_value_regions);
        });
      case MeshMessage::kRegionValuesFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_FIXED32,
                             [this] { mesh_.region_values.push_back(read_fixed32()); });
      case MeshMessage::kChannelValuesFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_FIXED32,
                             [this] { mesh_.channel_values.push_back(read_fixed32()); });
      case MeshMessage::kCellKindsFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_VARINT, [this] { add_cell_kind(read_varint()); });
      case MeshMessage::kCellVerticesFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_VARINT, [this] { add_corner(read_varint()); });
      case MeshMessage::kSharpEdgesFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_VARINT, [this] { add_sharp_end(read_varint()); });
      case MeshMessage::kSharpVerticesFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_VARINT, [this] { add_sharp_vertex(read_varint()); });
      case MeshMessage::kAllowFoldsFieldNumber: return read_flag(tag, mesh_.allow_folds);
      case MeshMessage::kMissedVerticesFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_VARINT, [this] { add_missed_vertex(read_varint()); });
      case MeshMessage::kMissedPositionsMmFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_FIXED64, [this] { add_missed_number(read_fixed64()); });
      case MeshMessage::kInterpolatingFieldNumber: return read_flag(tag, mesh_.interpolating);
      case MeshMessage::kAsMeshedFieldNumber: return read_flag(tag, mesh_.as_meshed);
      default: read_node_field(tag);
    }
  }

  /// Mid-nodes: an edge of a hexahedron has at most one, and so has a face.
  void read_node_field(std::uint32_t tag) {
    switch (WireFormatLite::GetTagFieldNumber(tag)) {
      case MeshMessage::kEdgeNodeVerticesFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_VARINT,
                             [this] { add_key(2, 12, "edge_node_vertices", edge_vertices_, mesh_.mid_nodes.edges); });
      case MeshMessage::kFaceNodeVerticesFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_VARINT,
                             [this] { add_key(4, 6, "face_node_vertices", face_vertices_, mesh_.mid_nodes.faces); });
      case MeshMessage::kCellNodeCellsFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_VARINT, [this] {
          require_room(mesh_.mid_nodes.cells.size(), limits_.max_cells, "cell_node_cells", "cells");
          mesh_.mid_nodes.cells.push_back(read_varint());
        });
      case MeshMessage::kNodePositionsMmFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_FIXED64, [this] {
          if (node_numbers_ % 3 == 0) {
            require_room(mesh_.mid_nodes.positions.size(), 19 * limits_.max_cells, "node_positions_mm", "mid-nodes");
            mesh_.mid_nodes.positions.emplace_back(Vec3::Zero());
          }
          mesh_.mid_nodes.positions.back()[static_cast<int>(node_numbers_++ % 3)] = read_fixed64();
        });
      case MeshMessage::kNodeValuesFieldNumber:
        return read_repeated(tag, WireFormatLite::WIRETYPE_FIXED32,
                             [this] { mesh_.mid_nodes.values.push_back(read_fixed32()); });
      default: unknown_field(tag);
    }
  }

  [[noreturn]] static void unknown_field(std::uint32_t tag) {
    const std::string number = std::to_string(WireFormatLite::GetTagFieldNumber(tag));
    throw Error(ErrorCode::kMeshUnknownField,
                "field number " + number +
                    " of the control mesh is unknown to this server: use a newer server, or leave the field out",
                number);
  }

  /// One value of this type, or packed ones.
  template <class ReadOne>
  void read_repeated(std::uint32_t tag, WireFormatLite::WireType type, ReadOne&& read_one) {
    if (WireFormatLite::GetTagWireType(tag) == type) return read_one();
    if (WireFormatLite::GetTagWireType(tag) != WireFormatLite::WIRETYPE_LENGTH_DELIMITED) unknown_field(tag);
    const auto limit = in_.PushLimit(static_cast<int>(read_length()));
    while (in_.BytesUntilLimit() > 0) {
      poll_();
      read_one();
    }
    in_.PopLimit(limit);
  }

  /// The length of the field that follows. The bytes hold at least as much.
  std::uint32_t read_length() {
    std::uint32_t length = 0;
    if (!in_.ReadVarint32(&length)) not_a_mesh();
    if (length > blocks_.size() - static_cast<std::size_t>(in_.CurrentPosition())) not_a_mesh();
    return length;
  }
  std::uint32_t read_varint() {
    std::uint32_t value = 0;
    if (!in_.ReadVarint32(&value)) not_a_mesh();
    return value;
  }
  double read_fixed64() {
    std::uint64_t bits = 0;
    if (!in_.ReadLittleEndian64(&bits)) not_a_mesh();
    return std::bit_cast<double>(bits);
  }
  float read_fixed32() {
    std::uint32_t bits = 0;
    if (!in_.ReadLittleEndian32(&bits)) not_a_mesh();
    return std::bit_cast<float>(bits);
  }

  void add_position(double coordinate) {
    if (numbers_ % 3 == 0) {
      require_room(mesh_.positions.size(), limits_.max_vertices, "positions_mm", "vertices");
      mesh_.positions.emplace_back(Vec3::Zero());
    }
    mesh_.positions.back()[static_cast<int>(numbers_++ % 3)] = coordinate;
  }

  void add_cell_kind(std::uint32_t kind) {
    require_room(mesh_.cell_kinds.size(), limits_.max_cells, "cell_kinds", "cells");
    mesh_.cell_kinds.push_back(to_cell_kind(static_cast<int>(kind), mesh_.cell_kinds.size()));
  }

  void add_corner(std::uint32_t vertex) {
    require_room(mesh_.cell_vertices.size(), 8 * limits_.max_cells, "cell_vertices", "corners");
    mesh_.cell_vertices.push_back(vertex);
  }

  void add_sharp_end(std::uint32_t vertex) {
    if (sharp_ends_++ % 2 == 0) {
      require_room(mesh_.sharp_edges.size(), 12 * limits_.max_cells, "sharp_edges", "sharp edges");
      mesh_.sharp_edges.push_back({vertex, 0});
    } else {
      mesh_.sharp_edges.back()[1] = vertex;
    }
  }

  void add_sharp_vertex(std::uint32_t vertex) {
    require_room(mesh_.sharp_vertices.size(), limits_.max_vertices, "sharp_vertices", "sharp vertices");
    mesh_.sharp_vertices.push_back(vertex);
  }

  /// `each`: vertices of one; `read`: of all so far.
  template <typename Key>
  void add_key(std::size_t each, std::size_t most_of_cell, const char* field, std::size_t& read,
               std::vector<Key>& keys) {
    if (read % each == 0) {
      require_room(keys.size(), most_of_cell * limits_.max_cells, field, "mid-nodes");
      keys.emplace_back();
    }
    keys.back()[read++ % each] = read_varint();
  }

  void add_missed_vertex(std::uint32_t vertex) {
    require_room(missed_vertices_.size(), limits_.max_vertices, "missed_vertices", "missed vertices");
    missed_vertices_.push_back(vertex);
  }

  void add_missed_number(double number) {
    require_room(missed_numbers_.size(), 3 * limits_.max_vertices, "missed_positions_mm", "numbers");
    missed_numbers_.push_back(number);
  }

  void require_room_for_pair(std::size_t have, const char* field) const {
    require_room(have, 8 * limits_.max_cells, field, "pairs of vertices and regions");
  }

  void add_region(std::uint32_t region, const char* list, std::vector<std::uint8_t>& regions) {
    if (region >= limits_.max_cell_regions) {
      const std::string field = list + ("[" + std::to_string(regions.size()) + "]");
      throw Error(ErrorCode::kMeshBadCellRegion,
                  field + " is " + std::to_string(region) + ", beyond the limit of " +
                      std::to_string(limits_.max_cell_regions) + " cell regions, counted from 0",
                  field, {static_cast<std::int64_t>(regions.size())});
    }
    regions.push_back(static_cast<std::uint8_t>(region));
  }

  /// What is named in a mesh, and the limits.
  struct NamedKind {
    ErrorCode code;
    const char* field;
    const char* many;
    std::size_t max_count, max_bytes;
  };

  void read_name(std::uint32_t tag, const NamedKind& kind, std::vector<std::string>& names) {
    if (WireFormatLite::GetTagWireType(tag) != WireFormatLite::WIRETYPE_LENGTH_DELIMITED) unknown_field(tag);
    require_room(names.size(), kind.max_count, kind.field, kind.many);
    const std::uint32_t length = read_length();
    const std::string which = std::string(kind.field) + "[" + std::to_string(names.size()) + "]";
    if (length > kind.max_bytes) {
      throw Error(kind.code, which + " is longer than " + std::to_string(kind.max_bytes) + " bytes: shorten it", which,
                  {static_cast<std::int64_t>(names.size())});
    }
    std::string name;
    if (!in_.ReadString(&name, static_cast<int>(length))) not_a_mesh();
    if (!is_utf8(name)) not_a_mesh();
    names.push_back(std::move(name));
  }

  void read_flag(std::uint32_t tag, bool& flag) {
    std::uint64_t value = 0;
    if (WireFormatLite::GetTagWireType(tag) != WireFormatLite::WIRETYPE_VARINT) unknown_field(tag);
    if (!in_.ReadVarint64(&value)) not_a_mesh();
    flag = value != 0;
  }

  void join_missed() {
    if (missed_numbers_.size() != 3 * missed_vertices_.size()) {
      mismatch("missed_positions_mm", missed_numbers_.size(), "give 3 for each of missed_vertices");
    }
    mesh_.missed_vertices.reserve(missed_vertices_.size());
    for (std::size_t i = 0; i < missed_vertices_.size(); ++i) {
      poll_();
      mesh_.missed_vertices.push_back({missed_vertices_[i], Vec3::Map(&missed_numbers_[3 * i])});
    }
  }

  static void require_room(std::size_t have, std::size_t limit, const std::string& field, const char* what) {
    if (have < limit) return;
    throw Error(ErrorCode::kMeshTooLarge,
                field + ": more than " + std::to_string(limit) + " " + what +
                    ", which is the limit; split the part or use a coarser control mesh",
                field);
  }

  static void require_whole(std::size_t numbers, std::size_t each, const std::string& field, const std::string& take) {
    if (numbers % each != 0) mismatch(field, numbers, "give " + take);
  }

  BlockStream blocks_;
  CodedInputStream in_;
  const MeshLimits& limits_;
  PeriodicPoll poll_;
  ControlMesh mesh_;
  std::size_t numbers_ = 0;                            // In positions_mm.
  std::size_t sharp_ends_ = 0;                         // In sharp_edges.
  std::size_t edge_vertices_ = 0, face_vertices_ = 0;  // In edge_node_vertices and face_node_vertices.
  std::size_t node_numbers_ = 0;                       // In node_positions_mm.
  std::vector<std::uint32_t> missed_vertices_;
  std::vector<double> missed_numbers_;
};

}  // namespace

ControlMesh read_control_mesh(const std::vector<std::string>& blocks, const MeshLimits& limits,
                              const CancellationToken& cancel) {
  return MeshReader(blocks, limits, cancel).read();
}

}  // namespace ccslice::server
