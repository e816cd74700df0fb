// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/gmsh_node_data.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "core/mesh/cell_complex.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/mid_nodes.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kNoRow = std::numeric_limits<std::uint32_t>::max();

/// Some programs give values to corners alone: nodes between them get the mean of theirs.
void fill_mid_nodes(const std::vector<std::uint32_t>& row_of, const MeshFile& file, std::vector<float>& values) {
  const SecondOrderCells& curved = file.second_order;
  std::size_t corner = 0, next = 0;
  for (std::size_t cell = 0; cell < file.mesh.cell_count() && next < curved.cells.size(); ++cell) {
    const CellKind kind = file.mesh.cell_kinds[cell];
    const std::uint32_t* const corners = &file.mesh.cell_vertices[corner];
    corner += static_cast<std::size_t>(corner_count(kind));
    if (curved.cells[next] != cell) continue;
    const std::uint64_t begin = curved.first_nodes[next++];
    const std::uint64_t end = next < curved.cells.size() ? curved.first_nodes[next] : curved.nodes.size();
    std::uint64_t node = begin;
    const auto fill = [&](const auto& ends) {
      if (node == end) return;
      const std::uint32_t vertex = curved.nodes[node++];
      if (vertex == kNone || row_of[vertex] != kNoRow) return;
      double sum = 0;
      for (const std::uint8_t of : ends) sum += values[corners[of]];
      values[vertex] = static_cast<float>(sum / static_cast<double>(ends.size()));
    };
    for (const auto& edge : mid_edges(kind)) fill(edge);
    for (const auto& face : mid_faces(kind)) fill(face);
    if (kind == CellKind::kHex) fill(std::array<std::uint8_t, 8>{0, 1, 2, 3, 4, 5, 6, 7});
  }
}

}  // namespace

void GmshNodeData::read(GmshScanner& scanner, const MeshLimits& limits) {
  const GmshFieldHeader header = read_field_header(scanner, limits.max_vertices);
  Field field{open_channels(header.name, header.components), {}, header.step, {}};
  const auto known = std::ranges::find_if(fields_, [&](const Field& other) {
    return !other.channels.empty() && !field.channels.empty() && other.channels[0].name == field.channels[0].name;
  });
  if (known == fields_.end()) {
    read_rows(header.count, scanner, field);
    fields_.push_back(std::move(field));
  } else if (header.partition > 0 && known->step == header.step && known->channels.size() == header.components) {
    read_rows(header.count, scanner, *known);
  } else {
    read_rows(header.count, scanner, field);
    warnings_.push_back("field '" + printable(header.name) + "' comes again for another time: left out");
  }
}

void GmshNodeData::read_rows(std::uint64_t count, GmshScanner& scanner, Field& field) {
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t tag = scanner.integer("a node's number");
    for (NamedChannel& channel : field.channels) {
      const double value = scanner.any_real("a value");
      channel.values.push_back(field.unfit.value(value, field.tags.size(), "a value", scanner.text()));
    }
    field.tags.push_back(tag);
  }
}

/// Left out where a corner has no value. Vertices that no cell uses need none.
void GmshNodeData::add_field(const Field& field, const Used& used_ones, const NodeNumbers& nodes,
                             const TextScanner& text, const MeshLimits& limits, MeshFile& file) {
  const auto& [corners, used] = used_ones;
  std::vector<std::uint32_t> row_of(used.size(), kNoRow);
  std::vector<bool> used_rows(field.tags.size(), false);
  std::size_t disagreeing = 0;
  for (std::size_t row = 0; row < field.tags.size(); ++row) {
    const std::optional<std::uint32_t> vertex = nodes.index_of(field.tags[row]);
    if (!vertex) continue;
    const std::uint32_t before = row_of[*vertex];
    disagreeing += before != kNoRow && std::ranges::any_of(field.channels, [&](const NamedChannel& channel) {
                     return channel.values[before] != channel.values[row];
                   });
    row_of[*vertex] = static_cast<std::uint32_t>(row);
    used_rows[row] = used[*vertex];
  }
  std::size_t lacking = 0;
  for (std::size_t vertex = 0; vertex < used.size(); ++vertex) lacking += corners[vertex] && row_of[vertex] == kNoRow;
  if (lacking > 0) {
    file.warnings.push_back("field '" + printable(field.channels.empty() ? "" : field.channels[0].name) +
                            "' left out: " + std::to_string(lacking) + " vertices have no value in it");
    return;
  }
  field.unfit.throw_if_used(used_rows, {file.numbers.vertex_noun, file.numbers.cell_noun, field.tags, {}}, text);
  if (disagreeing > 0) {
    file.warnings.push_back("field '" + printable(field.channels[0].name) +
                            "' has other values for nodes that have one already, " + std::to_string(disagreeing) +
                            " in all: the last value of a node is taken");
  }
  std::vector<NamedChannel> channels;
  for (const NamedChannel& channel : field.channels) {
    NamedChannel& made = channels.emplace_back(NamedChannel{channel.name, {}});
    for (const std::uint32_t row : row_of) made.values.push_back(row == kNoRow ? 0.0f : channel.values[row]);
    fill_mid_nodes(row_of, file, made.values);
  }
  append_file_channels(std::move(channels), limits, file);
}

void GmshNodeData::finish(const NodeNumbers& nodes, const TextScanner& text, const MeshLimits& limits,
                          MeshFile& file) const {
  file.warnings.insert(file.warnings.end(), warnings_.begin(), warnings_.end());
  if (fields_.empty()) return;
  const Used used{used_vertices(file.mesh), used_nodes(file)};
  for (const Field& field : fields_) add_field(field, used, nodes, text, limits, file);
}

}  // namespace ccslice
