// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/channels.h"

#include <algorithm>
#include <set>
#include <span>
#include <utility>

#include "core/base/contains.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/mesh/region_values.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/mid_nodes.h"

namespace ccslice {

namespace {

/// Appends a value of each channel to each of `count` rows. value(channel, i): that of row i.
template <typename Value>
void widen(std::size_t columns, std::size_t count, std::span<const NamedChannel> channels, Value value,
           std::vector<float>& rows) {
  std::vector<float> wide;
  wide.reserve(count * (columns + channels.size()));
  for (std::size_t i = 0; i < count; ++i) {
    const auto row = rows.begin() + static_cast<std::ptrdiff_t>(i * columns);
    wide.insert(wide.end(), row, row + static_cast<std::ptrdiff_t>(columns));
    for (const NamedChannel& channel : channels) wide.push_back(value(channel, i));
  }
  rows = std::move(wide);
}

float mean_of(std::span<const float> values, std::span<const std::uint32_t> vertices) {
  double sum = 0;
  for (const std::uint32_t vertex : vertices) sum += values[vertex];
  return static_cast<float>(sum / static_cast<double>(vertices.size()));
}

/// Removes the columns that are marked.
void narrow(const std::vector<bool>& marked, std::vector<float>& rows) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!marked[i % marked.size()]) rows[kept++] = rows[i];
  }
  rows.resize(kept);
}

bool is_component_of(const std::string& array, const std::string& name) {
  if (!name.starts_with(array + ".") || name.size() == array.size() + 1) return false;
  return name.find_first_not_of("0123456789", array.size() + 1) == std::string::npos;
}

}  // namespace

std::string component_name(const std::string& name, std::size_t components, std::size_t i) {
  return components == 1 ? name : name + "." + std::to_string(i);
}

std::vector<NamedChannel> open_channels(const std::string& name, std::size_t components) {
  std::vector<NamedChannel> channels(components);
  for (std::size_t i = 0; i < components; ++i) {
    channels[i].name = component_name(name, components, i);
  }
  return channels;
}

std::array<float, 2> channel_range(const ControlMesh& mesh, std::size_t channel) {
  std::array<float, 2> range = {mesh.channel_values[channel], mesh.channel_values[channel]};
  for (std::size_t at = channel; at < mesh.channel_values.size(); at += mesh.channel_count()) {
    range = {std::min(range[0], mesh.channel_values[at]), std::max(range[1], mesh.channel_values[at])};
  }
  for (const std::vector<float>* others : {&mesh.region_values, &mesh.mid_nodes.values}) {
    if (others == &mesh.mid_nodes.values && !mesh.as_meshed) break;
    for (std::size_t at = channel; at < others->size(); at += mesh.channel_count()) {
      range = {std::min(range[0], (*others)[at]), std::max(range[1], (*others)[at])};
    }
  }
  return range;
}

void append_file_channels(std::vector<NamedChannel> channels, const MeshLimits& limits, MeshFile& file) {
  std::set<std::string> taken(file.mesh.channel_names.begin(), file.mesh.channel_names.end());
  std::erase_if(channels, [&](const NamedChannel& channel) {
    const std::size_t size = channel.name.size();
    std::string why;
    if (size == 0) why = "has no name";
    if (size > limits.max_channel_name_bytes) {
      why = "has a name of " + std::to_string(size) + " bytes, at most " +
            std::to_string(limits.max_channel_name_bytes) + " are allowed";
    }
    if (why.empty() && !taken.insert(channel.name).second) why = "comes again";
    if (!why.empty()) file.warnings.push_back("array '" + echoed(channel.name) + "' left out: it " + why);
    return !why.empty();
  });
  append_channels(channels, file.mesh);
}

void append_channels(std::span<const NamedChannel> channels, ControlMesh& mesh) {
  for (const NamedChannel& channel : channels) {
    if (channel.values.size() == mesh.vertex_count()) continue;
    throw Error(ErrorCode::kFileSyntax, "'" + channel.name + "' has " + std::to_string(channel.values.size()) +
                                            " values for " + std::to_string(mesh.vertex_count()) + " points");
  }
  if (channels.empty()) return;
  const std::size_t columns = mesh.channel_count();
  widen(
      columns, mesh.vertex_count(), channels,
      [](const NamedChannel& channel, std::size_t v) { return channel.values[v]; }, mesh.channel_values);
  const auto region_value = [&](const NamedChannel& channel, std::size_t i) {
    return channel.values[mesh.region_value_vertices[i]];
  };
  widen(columns, mesh.region_value_vertices.size(), channels, region_value, mesh.region_values);
  const MidNodeCorners corners(mesh);
  const auto mid_value = [&](const NamedChannel& channel, std::size_t node) {
    return channel.mid_values.empty() ? mean_of(channel.values, corners[node]) : channel.mid_values[node];
  };
  widen(columns, mesh.mid_nodes.positions.size(), channels, mid_value, mesh.mid_nodes.values);
  for (const NamedChannel& channel : channels) mesh.channel_names.push_back(channel.name);
}

void leave_out_channel(const std::string& name, ControlMesh& mesh) {
  const bool is_channel = contains(mesh.channel_names, name);
  std::vector<bool> marked;
  for (const std::string& channel : mesh.channel_names) {
    marked.push_back(is_channel ? channel == name : is_component_of(name, channel));
  }
  if (!contains(marked, true)) {
    std::vector<std::string> names;
    for (const std::string& channel : mesh.channel_names) {
      if (names.size() < kMaxEchoItems) names.push_back("'" + echoed(channel) + "'");
    }
    const std::string others =
        names.empty() ? "it has none" : "it has " + echoed_list(names, mesh.channel_names.size());
    throw Error(ErrorCode::kMeshBadChannel, "the mesh has no channel '" + echoed(name) + "' to leave out; " + others,
                "channel_names");
  }
  for (std::vector<float>* rows : {&mesh.channel_values, &mesh.region_values, &mesh.mid_nodes.values}) {
    narrow(marked, *rows);
  }
  std::size_t channel = 0;
  std::erase_if(mesh.channel_names, [&](const std::string&) { return marked[channel++]; });
  if (mesh.channel_names.empty()) clear_region_values(mesh);
}

}  // namespace ccslice
