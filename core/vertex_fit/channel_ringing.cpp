// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/vertex_fit/channel_ringing.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "core/subdivision/limit_masks.h"
#include "core/subdivision/refine.h"

namespace ccslice {

namespace {

constexpr std::size_t kCellsAtOnce = 1 << 15;  // Refined, each takes some kilobytes; some seconds in all.
constexpr Eigen::Index kAxes = 3;

/// How far beyond its range, as a share of it.
double share_beyond(const std::array<double, 2>& range, double low, double high) {
  const double size = range[1] - range[0];
  return size > 0 ? std::max(range[0] - low, high - range[1]) / size : 0;
}

/// Positions, then the channels that may ring.
VertexSystem::Values with_channels(const VertexSystem::Values& points, const std::vector<ChannelRinging>& channels) {
  VertexSystem::Values kept(points.rows(), kAxes + static_cast<Eigen::Index>(channels.size()));
  kept.leftCols(kAxes) = points.leftCols(kAxes);
  for (std::size_t i = 0; i < channels.size(); ++i) {
    kept.col(kAxes + static_cast<Eigen::Index>(i)) = points.col(kAxes + static_cast<Eigen::Index>(channels[i].channel));
  }
  return kept;
}

/// All cells, in the order of their first corners along the longest axis. Cells that are refined together then lie side
/// by side: meshers number them in any order, and children around their vertices are made, too.
std::vector<CellId> cells_in_slabs(const CellComplex& complex, const VertexSystem::Values& points) {
  const auto positions = points.leftCols(kAxes);
  Eigen::Index axis = 0;
  (positions.colwise().maxCoeff() - positions.colwise().minCoeff()).maxCoeff(&axis);
  const auto place = [&](CellId c) {
    return std::pair(points(static_cast<Eigen::Index>(complex.cell_vertices(c).front()), axis), c);
  };
  std::vector<CellId> cells = complex.cells().to_vector();
  std::ranges::sort(cells, {}, place);
  return cells;
}

/// Vertices of cells' children, ascending, and of each the last of the cells that has it.
struct ChildVerticesOfCells {
  std::vector<VertexId> vertices;
  std::vector<CellId> cells;
};

ChildVerticesOfCells vertices_of_children(const CellComplex& parent, std::span<const CellId> cells,
                                          const Refinement& refined) {
  std::vector<CellId> last(refined.complex.vertex_count(), CellId{kNone});
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto children = static_cast<std::uint32_t>(parent.cell_vertices(cells[i]).size());
    for (std::uint32_t child = 0; child < children; ++child) {
      for (const VertexId v : refined.complex.cell_vertices(CellId{refined.first_child[i] + child})) last[v] = cells[i];
    }
  }
  ChildVerticesOfCells found;
  for (const VertexId v : refined.complex.vertices()) {
    if (last[v] == kNone) continue;
    found.vertices.push_back(v);
    found.cells.push_back(last[v]);
  }
  return found;
}

/// Widens what channels are known to reach by these samples: a column for each, of a position and the channels, and the
/// cell that it is in.
void take(const Eigen::MatrixXd& samples, std::span<const CellId> cells, std::span<const std::array<double, 2>> ranges,
          std::vector<ChannelRinging>& channels) {
  for (std::size_t i = 0; i < channels.size(); ++i) {
    ChannelRinging& channel = channels[i];
    const std::array<double, 2>& range = ranges[channel.channel];
    for (Eigen::Index n = 0; n < samples.cols(); ++n) {
      const double value = samples(kAxes + static_cast<Eigen::Index>(i), n);
      channel.low = std::min(channel.low, value);
      channel.high = std::max(channel.high, value);
      if (share_beyond(range, value, value) <= share_beyond(range, channel.value, channel.value)) continue;
      channel.value = value;
      channel.place = samples.col(n).head<kAxes>();
      channel.cell = ControlCellId{cells[static_cast<std::size_t>(n)]};
    }
  }
}

}  // namespace

std::vector<ChannelRinging> find_ringing(const CellComplex& complex, const VertexSystem::Values& points,
                                         std::span<const std::array<double, 2>> ranges, const CancellationToken& cancel,
                                         const std::function<void(std::size_t, std::size_t)>& on_sampled) {
  std::vector<ChannelRinging> channels;
  for (std::size_t c = 0; c < ranges.size(); ++c) {
    const auto values = points.col(kAxes + static_cast<Eigen::Index>(c));
    if (share_beyond(ranges[c], values.minCoeff(), values.maxCoeff()) <= kRingingShare) continue;
    channels.push_back(
        {c, ranges[c][1], ranges[c][0], (ranges[c][0] + ranges[c][1]) / 2, Vec3::Zero(), ControlCellId{kNone}});
  }
  if (channels.empty()) return channels;
  const Eigen::MatrixXd parents = with_channels(points, channels).transpose();
  const auto dimension = static_cast<std::size_t>(parents.rows());
  std::vector<CellId> cells = cells_in_slabs(complex, points);
  for (std::size_t begin = 0; begin < cells.size(); begin += kCellsAtOnce) {
    const auto some = std::span(cells).subspan(begin, std::min(kCellsAtOnce, cells.size() - begin));
    std::ranges::sort(some);
    const Refinement refined = refine(complex, some, cancel);
    const ChildVerticesOfCells sampled = vertices_of_children(complex, some, refined);
    const Stencils masks = limit_masks(refined.complex, sampled.vertices, cancel);
    Eigen::MatrixXd children(parents.rows(), refined.stencils.rows()), samples(parents.rows(), masks.rows());
    refined.stencils.apply(0, refined.stencils.rows(), parents.data(), dimension, children.data());
    masks.apply(0, masks.rows(), children.data(), dimension, samples.data());
    take(samples, sampled.cells, ranges, channels);
    if (on_sampled) on_sampled(begin + some.size(), cells.size());
  }
  std::erase_if(channels, [&](const ChannelRinging& channel) {
    return share_beyond(ranges[channel.channel], channel.low, channel.high) <= kRingingShare;
  });
  return channels;
}

}  // namespace ccslice
