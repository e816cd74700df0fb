// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/channels.h"

#include <algorithm>
#include <numeric>
#include <set>
#include <span>
#include <utility>

#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice {

namespace {

/// Appends the channels' values to the rows, which are those of these vertices.
void widen(std::size_t columns, std::span<const std::uint32_t> vertices, std::span<const NamedChannel> channels,
           std::vector<float>& rows) {
  std::vector<float> wide;
  wide.reserve(vertices.size() * (columns + channels.size()));
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const auto row = rows.begin() + static_cast<std::ptrdiff_t>(i * columns);
    wide.insert(wide.end(), row, row + static_cast<std::ptrdiff_t>(columns));
    for (const NamedChannel& channel : channels) wide.push_back(channel.values[vertices[i]]);
  }
  rows = std::move(wide);
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
  for (std::size_t at = channel; at < mesh.region_values.size(); at += mesh.channel_count()) {
    range = {std::min(range[0], mesh.region_values[at]), std::max(range[1], mesh.region_values[at])};
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
  std::vector<std::uint32_t> all(mesh.vertex_count());
  std::iota(all.begin(), all.end(), 0u);
  widen(mesh.channel_count(), all, channels, mesh.channel_values);
  widen(mesh.channel_count(), mesh.region_value_vertices, channels, mesh.region_values);
  for (const NamedChannel& channel : channels) mesh.channel_names.push_back(channel.name);
}

}  // namespace ccslice
