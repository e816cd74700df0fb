// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/vertex_fit/vertex_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/place_text.h"
#include "core/limit/cell_index.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/offenders.h"
#include "core/mesh/region_values.h"
#include "core/mesh_import/channels.h"
#include "core/prepare/prepare_solid.h"
#include "core/subdivision/limit_masks.h"

namespace ccslice {

namespace {

using Values = VertexSystem::Values;

// Each round halves shares, and none stays below kLeastShare; each from kFirstWiderRound on takes in one ring more, so
// the last ones keep back most of a mesh.
constexpr int kMostRounds = 24, kFirstWiderRound = 3;
constexpr double kLeastShare = 0.2;

Values positions_of(const ControlMesh& mesh) {
  Values values(static_cast<Eigen::Index>(mesh.vertex_count()), 3);
  for (Eigen::Index v = 0; v < values.rows(); ++v) {
    values.row(v) = mesh.positions[static_cast<std::size_t>(v)].transpose();
  }
  return values;
}

Values channels_of(const ControlMesh& mesh) {
  const auto channels = static_cast<Eigen::Index>(mesh.channel_count());
  Values values(static_cast<Eigen::Index>(mesh.vertex_count()), channels);
  const float* value = mesh.channel_values.data();
  for (Eigen::Index v = 0; v < values.rows(); ++v) {
    for (Eigen::Index c = 0; c < channels; ++c) values(v, c) = *value++;
  }
  return values;
}

/// Row by row.
std::vector<float> floats_of(const Values& values) {
  constexpr double kLargestFloat = std::numeric_limits<float>::max();
  std::vector<float> floats;
  floats.reserve(static_cast<std::size_t>(values.size()));
  for (Eigen::Index v = 0; v < values.rows(); ++v) {
    for (Eigen::Index c = 0; c < values.cols(); ++c) {
      floats.push_back(static_cast<float>(std::clamp(values(v, c), -kLargestFloat, kLargestFloat)));
    }
  }
  return floats;
}

/// The largest difference between the two, as a share of its column's range.
double largest_miss(const Values& limits, const Values& values) {
  double largest = 0;
  for (Eigen::Index c = 0; c < values.cols(); ++c) {
    const double range = values.col(c).maxCoeff() - values.col(c).minCoeff();
    if (range > 0) largest = std::max(largest, (limits.col(c) - values.col(c)).cwiseAbs().maxCoeff() / range);
  }
  return largest;
}

std::vector<ControlCellId> without(const std::vector<ControlCellId>& cells, const std::vector<ControlCellId>& known) {
  std::vector<ControlCellId> rest;
  std::ranges::set_difference(cells, known, std::back_inserter(rest));
  return rest;
}

double diagonal(const ControlMesh& mesh) {
  Box3 box;
  for (const Vec3& position : mesh.positions) box.extend(position);
  return box.diagonal().norm();
}

CellComplex connect(ControlMesh& mesh, std::vector<std::uint32_t>& origins, RoundedEdges& rounded,
                    const FitOptions& options) {
  CellComplex complex = validate_and_connect(mesh, options.limits, options.cancel).complex;
  const auto place = [&](std::uint32_t vertex) { return mesh.positions[vertex]; };
  rounded = find_rounded_edges(surface_rings(mesh, complex), place, mesh.sharp_edges);
  if (!has_several_regions(mesh)) return complex;
  SplitMesh split = split_cell_regions(mesh, complex, options.cancel);
  origins = std::move(split.origins);
  return make_cell_complex(split.mesh, options.cancel);
}

}  // namespace

std::vector<ControlCellId> folding_control_cells(const LimitSolid& solid) {
  std::vector<ControlCellId> cells;
  for (const LimitCellId cell : solid.index().fold_cells) cells.push_back(solid.control_cell(cell));
  std::ranges::sort(cells);
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

VertexFit::VertexFit(const ControlMesh& mesh, const FitOptions& options)
    : options_(options),
      mesh_(mesh),
      complex_(connect(mesh_, origins_, rounded_, options_)),
      system_(complex_, options_.cancel),
      met_mm_(kMetShare * diagonal(mesh_)) {}

ControlMesh VertexFit::fit_positions(FittedVertices vertices, FitReport& report) const {
  const Values positions = of_copies(positions_of(mesh_));
  // Limits are linear in control points, L = S P, so moves of these close the gaps where S moves = gaps.
  const Values gaps = positions - system_.limits(positions);
  ControlMesh fitted = vertices == FittedVertices::kAll ? fit_all(gaps) : fit_boundary(gaps);
  measure(fitted, report);
  return fitted;
}

ChannelFit VertexFit::fit_channels(const ControlMesh& meant, ControlMesh& fitted) const {
  fitted.channel_names = meant.channel_names;
  if (meant.channel_names.empty()) return {};
  const bool jumps = region_value_count(meant) > 0;
  const double miss = jumps ? fit_jumping_channels(meant, fitted) : fit_even_channels(meant, fitted);
  return {miss, find_ringing_of(meant, fitted)};
}

double VertexFit::fit_even_channels(const ControlMesh& meant, ControlMesh& fitted) const {
  const Values values = channels_of(meant), copies = of_copies(values);
  const Values solved = values + of_vertices(system_.solve(copies - system_.limits(copies)));
  fitted.channel_values = floats_of(solved);
  return largest_miss(limits_of(solved), values);
}

std::vector<ChannelRinging> VertexFit::find_ringing_of(const ControlMesh& meant, const ControlMesh& fitted) const {
  std::vector<std::array<double, 2>> ranges;
  for (std::size_t c = 0; c < meant.channel_count(); ++c) {
    const auto [low, high] = channel_range(meant, c);
    ranges.push_back({low, high});
  }
  const Values positions = of_copies(positions_of(fitted)), channels = jumping_channels_of(fitted);
  Values points(positions.rows(), positions.cols() + channels.cols());
  points << positions, channels;
  return find_ringing(complex_, points, ranges, options_.cancel, options_.progress.sampling);
}

/// Every copy of a vertex has values of its own.
double VertexFit::fit_jumping_channels(const ControlMesh& meant, ControlMesh& fitted) const {
  const Values values = jumping_channels_of(meant);
  set_jumping_channels(values + system_.solve(values - system_.limits(values)), fitted);
  return largest_miss(system_.limits(jumping_channels_of(fitted)), values);
}

/// The region of a copy.
std::uint8_t VertexFit::copy_region(VertexId copy) const {
  return region_of(mesh_, complex_.vertex_cells(copy).front());
}

/// The channels of `mesh` at all copies: a row for each.
Values VertexFit::jumping_channels_of(const ControlMesh& mesh) const {
  Values values(static_cast<Eigen::Index>(complex_.vertex_count()), static_cast<Eigen::Index>(mesh.channel_count()));
  for (const VertexId copy : complex_.vertices()) {
    const auto row = values_in_region(mesh, origin_of(copy), copy_region(copy));
    for (Eigen::Index c = 0; c < values.cols(); ++c) {
      values(static_cast<Eigen::Index>(copy), c) = row[static_cast<std::size_t>(c)];
    }
  }
  return values;
}

/// Copies within a region, which touch in the vertex alone, get their mean.
void VertexFit::set_jumping_channels(const Values& of_copies, ControlMesh& mesh) const {
  struct Sum {
    Eigen::RowVectorXd values;
    double copies = 0;
  };
  std::map<std::pair<std::uint32_t, std::uint8_t>, Sum> sums;
  std::vector<std::uint8_t> regions(mesh_.vertex_count(), 0);
  for (const VertexId copy : complex_.vertices()) {
    Sum& sum = sums[{origin_of(copy), copy_region(copy)}];
    if (sum.copies == 0) {
      ++regions[origin_of(copy)];
      sum.values = Eigen::RowVectorXd::Zero(of_copies.cols());
    }
    sum.values += of_copies.row(static_cast<Eigen::Index>(copy));
    ++sum.copies;
  }
  mesh.channel_values = floats_of(of_copies.topRows(static_cast<Eigen::Index>(mesh_.vertex_count())));
  clear_region_values(mesh);
  for (const auto& [place, sum] : sums) {
    if (regions[place.first] < 2) continue;
    append_region_values(place.first, place.second, floats_of(sum.values / sum.copies), mesh);
  }
}

std::vector<Vec3> VertexFit::limit_points(const ControlMesh& mesh) const {
  const Values limits = limits_of(positions_of(mesh));
  std::vector<Vec3> points(mesh.vertex_count());
  for (std::size_t v = 0; v < points.size(); ++v) points[v] = limits.row(static_cast<Eigen::Index>(v)).transpose();
  return points;
}

Values VertexFit::of_copies(const Values& of_vertices) const {
  if (origins_.empty()) return of_vertices;
  Values values(static_cast<Eigen::Index>(origins_.size()), of_vertices.cols());
  for (Eigen::Index k = 0; k < values.rows(); ++k) {
    values.row(k) = of_vertices.row(static_cast<Eigen::Index>(origins_[static_cast<std::size_t>(k)]));
  }
  return values;
}

/// The means of copies.
Values VertexFit::of_vertices(const Values& of_copies) const {
  if (origins_.empty()) return of_copies;
  const auto vertices = static_cast<Eigen::Index>(mesh_.vertex_count());
  Values sums = Values::Zero(vertices, of_copies.cols());
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(vertices);
  for (Eigen::Index k = 0; k < of_copies.rows(); ++k) {
    const auto v = static_cast<Eigen::Index>(origins_[static_cast<std::size_t>(k)]);
    sums.row(v) += of_copies.row(k);
    ++counts[v];
  }
  return counts.cwiseInverse().asDiagonal() * sums;
}

Values VertexFit::limits_of(const Values& of_vertices) const {
  return system_.limits(of_copies(of_vertices)).topRows(of_vertices.rows());
}

ControlMesh VertexFit::moved(const Values& moves_of_copies) const {
  const Values moves = of_vertices(moves_of_copies);
  ControlMesh fitted = mesh_;
  fitted.interpolating = true;
  for (std::size_t v = 0; v < fitted.vertex_count(); ++v) {
    fitted.positions[v] += moves.row(static_cast<Eigen::Index>(v)).transpose();
  }
  return fitted;
}

ControlMesh VertexFit::fit_all(const Values& gaps) const {
  ControlMesh fitted = moved(system_.solve(gaps));
  const std::vector<Vec3> limits = limit_points(fitted);
  Offenders missed;
  for (std::size_t v = 0; v < limits.size(); ++v) {
    if (!((limits[v] - mesh_.positions[v]).norm() <= met_mm_)) missed.add(static_cast<std::uint32_t>(v));
  }
  missed.throw_if_any(ErrorCode::kMeshNotInterpolable, "no control points take the limit through", kVertices,
                      "keep edges sharp, or such places back", "positions_mm");
  std::vector<ControlCellId> folds = folding_cells(fitted);
  if (folds.empty()) return fitted;
  const std::vector<ControlCellId> folding_before = folding_cells(mesh_);
  folds = without(folds, folding_before);
  if (folds.empty()) return fitted;
  fitted = moved(system_.solve_boundary(gaps));
  folds = without(folding_cells(fitted), folding_before);
  require_none(folds);
  return fitted;
}

void VertexFit::require_none(const std::vector<ControlCellId>& folds) const {
  constexpr int kDigits = 4;
  if (folds.empty()) return;
  Vec3 middle = Vec3::Zero();
  const auto corners = complex_.cell_vertices(CellId{folds.front()});
  for (const VertexId v : corners) middle += position_of(v) / static_cast<double>(corners.size());
  Offenders offenders;
  for (const ControlCellId c : folds) offenders.add(c);
  offenders.throw_if_any(ErrorCode::kMeshNotInterpolable, "a limit through all vertices of the boundary would fold in",
                         kCells,
                         std::string(folds.size() == 1 ? "it" : "the first") + " is near " +
                             place_text(middle, kDigits) + "; keep such places back, or edges sharp",
                         "cell_vertices");
}

ControlMesh VertexFit::fit_boundary(const Values& gaps) const {
  Eigen::VectorXd shares = Eigen::VectorXd::Ones(gaps.rows());
  std::vector<ControlCellId> folding_before;
  for (int round = 0; round < kMostRounds; ++round) {
    ControlMesh fitted = moved(system_.solve_boundary(shares.asDiagonal() * gaps));
    const std::vector<ControlCellId> folding = folding_cells(fitted);
    // What folded before may go on folding. Preparing the mesh takes long, so that is asked once something folds.
    if (!folding.empty() && round == 0) folding_before = folding_cells(mesh_);
    const std::vector<ControlCellId> folds = without(folding, folding_before);
    if (folds.empty()) return fitted;
    const std::vector<std::uint8_t> marked = around(folds, std::max(0, round - kFirstWiderRound + 1));
    for (std::size_t v = 0; v < marked.size(); ++v) {
      if (!marked[v]) continue;
      double& share = shares[static_cast<Eigen::Index>(v)];
      share = share / 2 < kLeastShare ? 0 : share / 2;
    }
  }
  return moved(Values::Zero(gaps.rows(), gaps.cols()));
}

std::vector<ControlCellId> VertexFit::folding_cells(const ControlMesh& mesh) const {
  ControlMesh positions_only = mesh;
  positions_only.allow_folds = true;
  positions_only.channel_names.clear();
  positions_only.channel_values.clear();
  clear_region_values(positions_only);
  PrepareOptions options;
  options.limits = options_.limits;
  options.cancel = options_.cancel;
  options.threads = options_.threads;
  options.reserve = options_.progress.reserve;
  if (options_.progress.preparing) options.progress = options_.progress.preparing();
  return folding_control_cells(*prepare_solid(std::move(positions_only), options));
}

/// The copies of all that are marked.
void VertexFit::mark_copies(std::vector<std::uint8_t>& marked) const {
  for (std::size_t k = mesh_.vertex_count(); k < origins_.size(); ++k) marked[origins_[k]] |= marked[k];
  for (std::size_t k = mesh_.vertex_count(); k < origins_.size(); ++k) marked[k] = marked[origins_[k]];
}

std::vector<std::uint8_t> VertexFit::around(const std::vector<ControlCellId>& cells, int rings) const {
  std::vector<std::uint8_t> marked(complex_.vertex_count(), 0);
  const auto mark = [&](CellId c) {
    for (const VertexId v : complex_.cell_vertices(c)) marked[v] = 1;
  };
  for (const ControlCellId c : cells) mark(CellId{c});
  mark_copies(marked);
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<std::uint8_t> before = marked;
    for (const VertexId v : complex_.vertices()) {
      if (!before[v]) continue;
      for (const CellId c : complex_.vertex_cells(v)) mark(c);
    }
    mark_copies(marked);
  }
  return marked;
}

void VertexFit::measure(ControlMesh& fitted, FitReport& report) const {
  const std::vector<Vec3> limits = limit_points(fitted);
  report = {};
  fitted.missed_vertices.clear();
  double farthest = -1;
  for (std::uint32_t v = 0; v < limits.size(); ++v) {
    const VertexLimit limit{v, mesh_.positions[v], limits[v]};
    const double distance = limit.distance_mm();
    if (!system_.on_boundary(v)) {
      report.inside_missed += !(distance <= met_mm_);
      report.inside_mm = std::max(report.inside_mm, distance);
      continue;
    }
    if (!(distance <= met_mm_)) fitted.missed_vertices.push_back({v, mesh_.positions[v]});
    if (distance <= farthest) continue;
    farthest = distance;
    report.farthest = limit;
  }
  report.missed = fitted.missed_vertices.size();
  report.swelling = measure_swelling(fitted);
  report.rounded = rounded_;
}

Swelling VertexFit::measure_swelling(const ControlMesh& fitted) const {
  std::vector<Vec3> positions = fitted.positions;
  for (std::size_t k = positions.size(); k < origins_.size(); ++k) positions.push_back(positions[origins_[k]]);
  const std::vector<Vec3> middles = boundary_face_masks(complex_, options_.cancel).apply(positions);
  Swelling most;
  FaceId swollen{};
  std::size_t n = 0;
  for (const FaceId f : complex_.faces()) {
    if (!complex_.face_on_boundary(f)) continue;
    const Vec3& limit = middles[n++];
    const auto ring = complex_.face_vertices(f);
    const auto size = static_cast<double>(ring.size());
    Vec3 middle = Vec3::Zero(), normal = Vec3::Zero();
    double edge = 0;
    for (std::size_t i = 0; i < ring.size(); ++i) {
      const Vec3 &from = position_of(ring[i]), &to = position_of(ring[(i + 1) % ring.size()]);
      middle += from / size;
      // Of a fan of triangles: for a face that isn't flat the mean of their normals, by area.
      normal += (from - position_of(ring[0])).cross(to - position_of(ring[0]));
      edge += (to - from).norm() / size;
    }
    normal.normalize();
    const double along_normal = (limit - middle).dot(normal), distance = std::abs(along_normal);
    most.much += distance > kMuchSwelling * edge;
    if (!(distance > most.edges * edge)) continue;
    swollen = f;
    most = {{}, limit, along_normal * normal, distance / edge, most.much};
  }
  if (most.edges == 0) return most;
  for (const VertexId v : complex_.face_vertices(swollen)) most.vertices.push_back(origin_of(v));
  return most;
}

}  // namespace ccslice
