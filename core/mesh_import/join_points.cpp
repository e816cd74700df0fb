// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/join_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/number_text.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/corner_determinant.h"
#include "core/mesh/offenders.h"
#include "core/mesh/point_clusters.h"
#include "core/mesh/region_values.h"
#include "core/mesh_import/channels.h"
#include "core/mesh_import/mid_nodes.h"

namespace ccslice {
namespace {

constexpr double kBillionth = 1e-9, kMillionth = 1e-6;
constexpr int kLengthDigits = 3;

using PointRegion = std::pair<std::uint32_t, std::uint8_t>;

/// A joined vertex's channels in one of its regions.
struct RegionRow {
  std::uint8_t region = 0;
  std::vector<float> values;
};

class PointJoiner {
 public:
  PointJoiner(double distance_mm, const ControlMesh& mesh, std::optional<double> same_mm)
      : distance_mm_(distance_mm),
        same_mm_(same_mm),
        mesh_(mesh),
        clusters_(find_point_clusters(mesh.positions, distance_mm)) {}

  bool nothing() const { return clusters_.empty(); }
  void join(ControlMesh& joined, FileNumbers& numbers);
  JoinReport report() const { return report_; }

 private:
  void number_vertices();
  std::string joined_points() const;
  void find_regions();
  /// Its pairs.
  std::span<const PointRegion> regions_at(std::uint32_t point) const {
    const auto first = std::ranges::lower_bound(regions_, PointRegion(point, 0));
    const auto last = std::ranges::lower_bound(regions_, PointRegion(point + 1, 0));
    return {first, last};
  }
  bool become_one(std::uint32_t a, std::uint32_t b) const {
    return a != b && cluster_of_[a] != kNone && cluster_of_[a] == cluster_of_[b];
  }
  double apart_mm(std::uint32_t a, std::uint32_t b) const { return (mesh_.positions[a] - mesh_.positions[b]).norm(); }
  void check_cells() const;
  bool collapses(std::span<const std::uint32_t> corners) const;
  void check_shapes() const;
  void join_channels(ControlMesh& joined);
  std::optional<std::vector<RegionRow>> rows_of(std::size_t cluster);
  std::vector<float> middle_values(std::size_t cluster, std::span<const std::uint8_t> regions, bool& agree) const;
  void refuse_values(const std::vector<std::size_t>& disagreeing) const;
  void join_features(ControlMesh& joined) const;
  void join_mid_nodes(ControlMesh& joined, FileNumbers& numbers);
  void measure();
  /// Visits each cell as visit(cell, its corners before, where they begin).
  template <typename Visit>
  void each_cell(Visit visit) const;
  template <typename Item>
  void keep_first(std::vector<Item>& items, std::size_t width) const;

  double distance_mm_;
  std::optional<double> same_mm_;
  const ControlMesh& mesh_;
  std::vector<PointCluster> clusters_;
  std::vector<std::uint32_t> cluster_of_;    // By point: its cluster, or kNone.
  std::vector<std::uint32_t> new_vertices_;  // By point.
  std::size_t vertex_count_ = 0;             // Of vertices.
  std::vector<PointRegion> regions_;         // Joined points and a region of theirs, ascending.
  std::vector<double> agreement_;            // By channel: how far apart values may be.
  JoinReport report_;
};

template <typename Visit>
void PointJoiner::each_cell(Visit visit) const {
  std::size_t begin = 0;
  for (std::size_t cell = 0; cell < mesh_.cell_count(); ++cell) {
    const auto count = static_cast<std::size_t>(corner_count(mesh_.cell_kinds[cell]));
    visit(cell, std::span(mesh_.cell_vertices).subspan(begin, count), begin);
    begin += count;
  }
}

void PointJoiner::number_vertices() {
  cluster_of_.assign(mesh_.vertex_count(), kNone);
  for (std::uint32_t i = 0; i < clusters_.size(); ++i) {
    for (const std::uint32_t point : clusters_[i].points) cluster_of_[point] = i;
  }
  new_vertices_.resize(mesh_.vertex_count());
  for (std::uint32_t point = 0; point < mesh_.vertex_count(); ++point) {
    const std::uint32_t cluster = cluster_of_[point];
    const bool first = cluster == kNone || clusters_[cluster].points.front() == point;
    new_vertices_[point] =
        first ? static_cast<std::uint32_t>(vertex_count_++) : new_vertices_[clusters_[cluster].points.front()];
  }
}

std::string PointJoiner::joined_points() const {
  if (distance_mm_ == 0) return "points at the same coordinates are joined";
  return "points within " + number_text(distance_mm_, kLengthDigits) + " mm of each other are joined";
}

/// Cells with two corners in one cluster that may not become one.
void PointJoiner::check_cells() const {
  Offenders repeated;
  std::string first;
  each_cell([&](std::size_t cell, std::span<const std::uint32_t> corners, std::size_t begin) {
    for (std::size_t i = 1; i < corners.size(); ++i) {
      const auto is_twin = [&](std::uint32_t v) {
        return become_one(v, corners[i]) && !(same_mm_ && apart_mm(v, corners[i]) <= *same_mm_);
      };
      const auto before = corners.first(i);
      const auto twin = std::ranges::find_if(before, is_twin);
      if (twin == before.end()) continue;
      repeated.add(static_cast<std::int64_t>(cell), begin + i);
      if (!first.empty()) return;
      const double apart = apart_mm(*twin, corners[i]);
      first = "two of the first one's corners are " +
              (apart > 0 ? number_text(apart, kLengthDigits) + " mm apart" : "two vertices in one place") +
              " before, and one vertex afterwards";
      return;
    }
  });
  repeated.throw_if_any(ErrorCode::kMeshRepeatedVertex, joined_points() + ", which leaves a corner repeated in", kCells,
                        first + "; join points within a smaller distance, or none", "cell_vertices");
}

bool PointJoiner::collapses(std::span<const std::uint32_t> corners) const {
  for (std::size_t i = 1; i < corners.size(); ++i) {
    for (const std::uint32_t v : corners.first(i)) {
      if (become_one(v, corners[i])) return true;
    }
  }
  return false;
}

/// Cells that were neither flat nor folded before. What collapsed ones become isn't known yet.
void PointJoiner::check_shapes() const {
  if (mesh_.allow_folds || mesh_.interpolating) return;
  Offenders worse;
  std::string first;
  const auto moved = [&](std::uint32_t v) { return cluster_of_[v] != kNone && clusters_[cluster_of_[v]].length > 0; };
  each_cell([&](std::size_t cell, std::span<const std::uint32_t> corners, std::size_t) {
    if (std::ranges::none_of(corners, moved) || collapses(corners)) return;
    const CellKind kind = mesh_.cell_kinds[cell];
    const auto least = [&](bool joined, double sign) {
      const auto place = [&](std::size_t corner) -> Vec3 {
        const std::uint32_t v = corners[vtk_corner(kind, static_cast<std::uint8_t>(corner))];
        return joined && cluster_of_[v] != kNone ? clusters_[cluster_of_[v]].box.center() : mesh_.positions[v];
      };
      double determinant = std::numeric_limits<double>::infinity();
      for (std::size_t i = 0; i < corners.size(); ++i) {
        determinant = std::min(determinant, sign * corner_determinant(kind, i, place));
      }
      return determinant;
    };
    const double sign = least(false, 1) > 0 ? 1 : -1;  // Cells that are mirrored as a whole are reoriented later.
    const double before = least(false, sign), after = least(true, sign);
    if (!(before > 0) || after > 0) return;
    worse.add(static_cast<std::int64_t>(cell));
    if (!first.empty()) return;
    first = "the least Jacobian at the first one's corners is " + number_text(before, kLengthDigits) +
            " mm^3 before, and " + number_text(after, kLengthDigits) + " afterwards";
  });
  worse.throw_if_any(ErrorCode::kMeshInvertedCell, joined_points() + ", which flattens or folds", kCells,
                     first + "; join points within a smaller distance, or none", "cell_vertices");
}

void PointJoiner::find_regions() {
  each_cell([&](std::size_t cell, std::span<const std::uint32_t> corners, std::size_t) {
    const std::uint8_t region = region_of(mesh_, CellId{static_cast<std::uint32_t>(cell)});
    for (const std::uint32_t v : corners) {
      if (cluster_of_[v] != kNone) regions_.emplace_back(v, region);
    }
  });
  std::ranges::sort(regions_);
  regions_.erase(std::unique(regions_.begin(), regions_.end()), regions_.end());
}

/// The middle of what the cluster's points have in these regions. `agree` says whether they do.
std::vector<float> PointJoiner::middle_values(std::size_t cluster, std::span<const std::uint8_t> regions,
                                              bool& agree) const {
  const std::size_t channels = mesh_.channel_count();
  std::vector<float> low, high;
  agree = true;
  for (const std::uint32_t point : clusters_[cluster].points) {
    for (const auto& [_, region] : regions_at(point)) {
      if (std::ranges::find(regions, region) == regions.end()) continue;
      const std::span<const float> values = values_in_region(mesh_, point, region);
      if (low.empty()) low = high = std::vector<float>(values.begin(), values.end());
      for (std::size_t c = 0; c < channels; ++c) {
        // What isn't finite stays, for validate() to refuse.
        low[c] = std::isfinite(values[c]) ? std::min(low[c], values[c]) : values[c];
        high[c] = std::isfinite(values[c]) ? std::max(high[c], values[c]) : values[c];
      }
    }
  }
  for (std::size_t c = 0; c < low.size(); ++c) {
    if (double{high[c]} - double{low[c]} > agreement_[c]) agree = false;
    low[c] = static_cast<float>((double{low[c]} + double{high[c]}) / 2);
  }
  return low;
}

/// The channels of a cluster: one row if they are the same in all of its regions, one for each region if they are the
/// same within each, else none.
std::optional<std::vector<RegionRow>> PointJoiner::rows_of(std::size_t cluster) {
  std::set<std::uint8_t> found;
  for (const std::uint32_t point : clusters_[cluster].points) {
    for (const auto& [_, region] : regions_at(point)) found.insert(region);
  }
  const std::vector<std::uint8_t> regions(found.begin(), found.end());
  bool agree = true;
  const std::vector<float> all = middle_values(cluster, regions, agree);
  if (agree) return std::vector<RegionRow>{{regions.empty() ? std::uint8_t{0} : regions.front(), all}};
  std::vector<RegionRow> rows;
  for (const std::uint8_t region : regions) {
    rows.push_back({region, middle_values(cluster, {&region, 1}, agree)});
    if (!agree) return std::nullopt;
  }
  ++report_.jumps;
  return rows;
}

/// Names the two values that are farthest apart of one region.
void PointJoiner::refuse_values(const std::vector<std::size_t>& disagreeing) const {
  if (disagreeing.empty()) return;
  std::map<std::uint8_t, std::vector<std::uint32_t>> points_of;  // By region.
  for (const std::uint32_t point : clusters_[disagreeing.front()].points) {
    for (const auto& [_, region] : regions_at(point)) points_of[region].push_back(point);
  }
  std::uint32_t low = 0, high = 0;
  std::uint8_t in_region = 0;
  std::size_t channel = 0;
  double most = -1;  // In shares of what may be.
  for (const auto& [region, points] : points_of) {
    for (std::size_t c = 0; c < mesh_.channel_count(); ++c) {
      const auto value = [&](std::uint32_t point) { return values_in_region(mesh_, point, region)[c]; };
      const auto [least, greatest] = std::ranges::minmax_element(points, {}, value);
      const double share = (double{value(*greatest)} - value(*least)) / agreement_[c];
      if (!(share > most)) continue;
      most = share, in_region = region, channel = c, low = *least, high = *greatest;
    }
  }
  const auto text = [&](std::uint32_t point) {
    constexpr int kValueDigits = 9;
    return number_text(values_in_region(mesh_, point, in_region)[channel], kValueDigits);
  };
  const std::size_t more = disagreeing.size() - 1;
  const std::string others =
      more == 0 ? ""
                : ", and values disagree in " + std::to_string(more) + (more == 1 ? " more place" : " more places");
  throw Error(ErrorCode::kMeshBadChannel,
              "channel '" + echoed(mesh_.channel_names[channel]) + "' is " + text(low) + " at " +
                  named_ids(kVertices, {low}) + " and " + text(high) + " at " + named_ids(kVertices, {high}) +
                  ", points in one place" + others +
                  ": points that are joined need one value, or cell regions between which it jumps",
              "channel_values", {std::min(low, high), std::max(low, high)});
}

template <typename Item>
void PointJoiner::keep_first(std::vector<Item>& items, std::size_t width) const {
  std::size_t kept = 0;
  for (std::size_t point = 0; point < new_vertices_.size(); ++point) {
    if (new_vertices_[point] != kept) continue;
    std::copy_n(items.begin() + static_cast<std::ptrdiff_t>(point * width), width,
                items.begin() + static_cast<std::ptrdiff_t>(kept * width));
    ++kept;
  }
  items.resize(kept * width);
}

void PointJoiner::join_channels(ControlMesh& joined) {
  const std::size_t channels = mesh_.channel_count();
  if (channels == 0) return;
  for (std::size_t c = 0; c < channels; ++c) {
    const auto [low, high] = channel_range(mesh_, c);
    agreement_.push_back(kMillionth * (double{high} - double{low}));
  }
  find_regions();
  std::vector<std::pair<std::uint32_t, RegionRow>> jumps;
  for (std::size_t i = 0; i < region_value_count(mesh_); ++i) {
    const std::uint32_t point = mesh_.region_value_vertices[i];
    if (cluster_of_[point] != kNone) continue;
    const auto row = std::span(mesh_.region_values).subspan(i * channels, channels);
    jumps.push_back({new_vertices_[point], {mesh_.region_value_regions[i], {row.begin(), row.end()}}});
  }
  keep_first(joined.channel_values, channels);
  std::vector<std::size_t> disagreeing;
  for (std::size_t i = 0; i < clusters_.size(); ++i) {
    std::optional<std::vector<RegionRow>> rows = rows_of(i);
    if (!rows) {
      disagreeing.push_back(i);
      continue;
    }
    const std::uint32_t vertex = new_vertices_[clusters_[i].points.front()];
    std::ranges::copy(rows->front().values,
                      joined.channel_values.begin() + static_cast<std::ptrdiff_t>(vertex * channels));
    for (RegionRow& row : std::span(*rows).subspan(1)) jumps.emplace_back(vertex, std::move(row));
  }
  refuse_values(disagreeing);
  std::ranges::sort(jumps, {}, [](const auto& jump) { return std::pair(jump.first, jump.second.region); });
  clear_region_values(joined);
  for (const auto& [vertex, row] : jumps) append_region_values(vertex, row.region, row.values, joined);
}

void PointJoiner::join_features(ControlMesh& joined) const {
  // Lists may name vertices that there are none of, for validate() to refuse.
  const auto now = [&](std::uint32_t v) { return v < new_vertices_.size() ? new_vertices_[v] : v; };
  std::set<std::array<std::uint32_t, 2>> edges;
  std::erase_if(joined.sharp_edges, [&](std::array<std::uint32_t, 2>& edge) {
    for (std::uint32_t& v : edge) v = now(v);
    const auto ascending = std::array{std::min(edge[0], edge[1]), std::max(edge[0], edge[1])};
    return edge[0] == edge[1] || !edges.insert(ascending).second;
  });
  std::set<std::uint32_t> corners;
  std::erase_if(joined.sharp_vertices, [&](std::uint32_t& v) { return !corners.insert(v = now(v)).second; });
  for (MissedVertex& missed : joined.missed_vertices) missed.vertex = new_vertices_[missed.vertex];
  std::ranges::stable_sort(joined.missed_vertices, {}, &MissedVertex::vertex);
  const auto same = [](const MissedVertex& a, const MissedVertex& b) { return a.vertex == b.vertex; };
  joined.missed_vertices.erase(std::unique(joined.missed_vertices.begin(), joined.missed_vertices.end(), same),
                               joined.missed_vertices.end());
}

void PointJoiner::join_mid_nodes(ControlMesh& joined, FileNumbers& numbers) {
  if (mesh_.mid_nodes.empty()) return;
  std::vector<std::uint32_t> cells(mesh_.cell_count());
  std::iota(cells.begin(), cells.end(), 0u);
  MidNodeList list(mesh_.channel_count());
  list.add(mesh_.mid_nodes, numbers.mid_nodes, new_vertices_, cells);
  MidNodeList::Result result = list.finish(distance_mm_);
  report_.has_other_order = is_another_order(joined, result);
  if (report_.has_other_order) result.nodes = {}, result.numbers = {};
  joined.mid_nodes = std::move(result.nodes);
  if (!numbers.mid_nodes.empty()) numbers.mid_nodes = std::move(result.numbers);
  report_.disagreeing_edges = result.other_values;
  report_.bent_edges = result.conflicts.size();
  report_.bent_by_mm = result.farthest_apart_mm;
}

void PointJoiner::measure() {
  report_.places = clusters_.size();
  for (const PointCluster& cluster : clusters_) {
    report_.joined += cluster.points.size() - 1;
    report_.farthest_apart_mm = std::max(report_.farthest_apart_mm, cluster.length);
    if (cluster.length <= distance_mm_ * (1 + kBillionth)) continue;
    ++report_.chains;
    if (cluster.length <= report_.longest_chain.length_mm) continue;
    report_.longest_chain = {cluster.points.size(), cluster.length, cluster.box.center()};
  }
}

void PointJoiner::join(ControlMesh& joined, FileNumbers& numbers) {
  number_vertices();
  check_cells();
  check_shapes();
  join_channels(joined);
  keep_first(joined.positions, 1);
  for (const PointCluster& cluster : clusters_) {
    joined.positions[new_vertices_[cluster.points.front()]] = cluster.box.center();
  }
  for (std::uint32_t& v : joined.cell_vertices) v = new_vertices_[v];
  join_features(joined);
  join_mid_nodes(joined, numbers);
  if (!numbers.vertices.empty()) keep_first(numbers.vertices, 1);
  measure();
}

/// The last of so many significant digits of the number.
double unit_of_digit(double largest, int digits) { return std::pow(10, std::floor(std::log10(largest)) + 1 - digits); }

bool has_digits(double x, int digits) {
  constexpr double kRounding = 8 * std::numeric_limits<double>::epsilon();  // Units of length were turned to mm.
  if (x == 0) return true;
  const double in_units = std::abs(x) / unit_of_digit(std::abs(x), digits);
  return std::abs(in_units - std::round(in_units)) <= kRounding * in_units;
}

/// How many decimal digits suffice for all coordinates; none if it takes more than the 9 that tell single-precision
/// numbers apart.
std::optional<int> digits_of(const ControlMesh& mesh) {
  constexpr int kMostDigits = 9;
  int digits = 1;
  for (const Vec3& position : mesh.positions) {
    for (const double x : position) {
      while (!has_digits(x, digits)) {
        if (++digits > kMostDigits) return std::nullopt;
      }
    }
  }
  return digits;
}

/// Two units in the last place of the largest single-precision coordinate; 0 if there are others.
double single_precision_mm(const ControlMesh& mesh) {
  double largest = 0;
  for (const Vec3& position : mesh.positions) {
    for (const double x : position) {
      if (static_cast<double>(static_cast<float>(x)) != x) return 0;
      largest = std::max(largest, std::abs(x));
    }
  }
  return 2 * std::numeric_limits<float>::epsilon() * largest;
}

double diagonal_of(const ControlMesh& mesh) {
  Box3 box;
  for (const Vec3& position : mesh.positions) {
    if (position.allFinite()) box.extend(position);
  }
  return box.isEmpty() ? 0 : box.diagonal().norm();
}

}  // namespace

double same_place_mm(const ControlMesh& mesh) {
  const double diagonal = diagonal_of(mesh);
  return std::max(kBillionth * diagonal, std::min(single_precision_mm(mesh), kMillionth * diagonal));
}

double last_digit_mm(const ControlMesh& mesh) {
  constexpr int kFewestDigits = 6;  // Numbers of fewer digits are round ones, and what they say is meant.
  double largest = 0;
  for (const Vec3& position : mesh.positions) largest = std::max(largest, position.cwiseAbs().maxCoeff());
  if (!(largest > 0) || !std::isfinite(largest)) return 0;
  const std::optional<int> digits = digits_of(mesh);
  if (!digits || *digits < kFewestDigits) return 0;
  const double neighbours =
      std::max(2 * unit_of_digit(largest, *digits), 2 * std::numeric_limits<float>::epsilon() * largest);
  return std::min(neighbours, std::max(kMillionth, 2 * std::pow(10, 1 - *digits)) * diagonal_of(mesh));
}

JoinReport join_points(double distance_mm, ControlMesh& mesh, FileNumbers& numbers, std::optional<double> same_mm) {
  PointJoiner joiner(distance_mm, mesh, same_mm);
  if (joiner.nothing()) return {};
  ControlMesh joined = mesh;
  joiner.join(joined, numbers);
  mesh = std::move(joined);
  return joiner.report();
}

}  // namespace ccslice
