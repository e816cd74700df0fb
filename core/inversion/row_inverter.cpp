// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/inversion/row_inverter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <span>

#include "core/limit/cell_index.h"

namespace ccslice {

namespace {

constexpr std::uint32_t kPointsPerLook = 16;  // Looking at the clock takes a twentieth of a point.
constexpr int kNodeSteps = 6;                 // Newton's method starts close, so few steps are enough.
constexpr int kCorrections = 3;
// ||I - J(from)^-1 J(to)||: beyond, nodes must lie closer. If J changes by a share d between two nodes, the inverses
// interpolated there are off by about t (1 - t) d^2, so that each correction leaves a sixteenth of the error or so at
// most.
constexpr double kMostTurn = 0.5;
constexpr std::int64_t kBesideReach = 8;  // Points.
constexpr double kReach = 0.5;            // How far beyond the patch its polynomials are followed, in its parameters.

bool is_near_patch(const Vec3& q) { return ((q.array() - 0.5).abs() <= 0.5 + kReach).all(); }
bool in_unit_cube(const Vec3& q) { return (q.array() >= 0).all() && (q.array() <= 1).all(); }

}  // namespace

void SolvedRow::reset(std::size_t count, std::size_t channels) {
  points.assign(count, RowPoint::kUnresolved);
  values.resize(count * channels);
  last.reset();
  entries.clear();
  max_residual_mm = 0;
}

RowInverter::RowInverter(PointInverter& inverter, const LimitSolid& solid, const InversionOptions& options)
    : inverter_(&inverter),
      solid_(&solid),
      options_(options),
      acceptance_(solid, options.accept_mm),
      channels_(solid.channel_count()) {}

void RowInverter::solve(const Vec3& first, const Vec3& step, std::uint32_t count, const std::optional<CellParam>& hint,
                        std::span<const RowEntry> beside, const CancellationToken& cancel, SolvedRow& row) {
  first_ = first;
  step_ = step;
  count_ = count;
  row_ = &row;
  beside_ = beside;
  row.reset(count, channels_);
  std::optional<CellParam> near = hint;
  for (std::uint32_t k = 0; k < count; ++k) {
    if (++points_ % kPointsPerLook == 0) cancel.throw_if_cancelled();
    Node node;
    std::optional<CellParam> at = enter(k, near, node);
    const bool in_patch = at.has_value();
    if (in_patch) {
      keep(node);
    } else {
      at = solve_alone(k, near);
    }
    if (!at) continue;
    row.entries.push_back({k, *at});
    row.last = near = at;
    // A point that was solved alone is a node as well, if it lies in a patch.
    if (k + 1 < count && (in_patch || enter(k, at, node))) k += march(node, *at, *near);
  }
}

/// The k-th point, if it lies in the hint's patch.
std::optional<CellParam> RowInverter::enter(std::uint32_t k, const std::optional<CellParam>& hint, Node& node) {
  if (!hint || is_ambiguous(k, k)) return std::nullopt;
  patch_ = inverter_->evaluator().patch_at(*hint, place_);
  if (patch_ == nullptr) return std::nullopt;
  const Sample here = sample(place_.local);
  // local = factor * cell + const, so the Jacobian by the cell's parameters has factor times the patch's columns, and
  // its inverse the patch's rows divided by factor.
  accept_mm_ = acceptance_.at(place_.factor.cwiseInverse().asDiagonal() * here.inverse);
  if (!is_near_patch(place_.local) || !make_node_from(k, here, place_.local, node)) return std::nullopt;
  if (!in_unit_cube(node.local)) return std::nullopt;
  const CellParam at = in_cell(*hint, node.local);
  place_.local = node.local;
  return at;
}

void RowInverter::keep(const Node& node) {
  patch_channels(*patch_, node.local, std::span(row_->values).subspan(node.point * channels_, channels_));
  row_->points[node.point] = RowPoint::kCoherent;
  row_->max_residual_mm = std::max(row_->max_residual_mm, node.residual_mm);
}

std::optional<CellParam> RowInverter::solve_alone(std::uint32_t k, const std::optional<CellParam>& hint) {
  const std::optional<InversionResult> found = inverter_->invert(point(k), hint);
  if (!found) return std::nullopt;
  inverter_->evaluator().mat(found->at, std::span(row_->values).subspan(k * channels_, channels_));
  row_->points[k] = found->full ? RowPoint::kFull : RowPoint::kCoherent;
  row_->max_residual_mm = std::max(row_->max_residual_mm, found->residual_mm);
  return found->at;
}

/// Where Newton's method or the corrections fail, nodes are put closer: half as far, then twice as far again with every
/// pair that succeeds. Even one point's distance may be too far, beside a fold or where the patch ends.
std::uint32_t RowInverter::march(Node from, const CellParam& at, CellParam& next) {
  const std::uint32_t first = from.point;
  Vec3 bend = Vec3::Zero();  // Change of the slope from point to point.
  std::uint32_t stride = kRowStride;
  while (from.point + 1 < count_) {
    const std::uint32_t ahead = std::min(stride, count_ - 1 - from.point);
    // To second order: the curve's bend is that between the last two nodes.
    const Vec3 guess = from.local + ahead * (from.slope + 0.5 * ahead * bend);
    Node to;
    if (!make_node(from.point + ahead, guess, to) || !solve_between(from, to)) {
      if (ahead == 1) break;
      stride = ahead / 2;
      continue;
    }
    // The node ahead may lie beyond the patch, whose polynomials go on: the curve up to there tells where it is left.
    const std::uint32_t inside = keep_inside(from.point + 1, ahead);
    if (inside > 0) row_->last = in_cell(at, curve_point(inside - 1));
    next = hint_after(from.point + inside, at, inside < ahead ? curve_point(inside) : to.local);
    if (inside < ahead) return from.point + inside - first;
    bend = (to.slope - from.slope) / ahead;
    from = to;
    stride = std::min(kRowStride, 2 * stride);
  }
  return from.point - first;
}

RowInverter::Sample RowInverter::sample(const Vec3& local) const {
  const LimitSample at = patch_sample(patch_->points, local);
  return {at, at.jacobian.inverse()};
}

/// Newton's method in the patch, from a good guess.
bool RowInverter::make_node(std::uint32_t k, const Vec3& guess, Node& node) const {
  return is_near_patch(guess) && make_node_from(k, sample(guess), guess, node);
}

/// `here`: the sample at `local`.
bool RowInverter::make_node_from(std::uint32_t k, Sample here, Vec3 local, Node& node) const {
  for (int n = 1;; ++n) {
    const Vec3 residual = point(k) - here.at.position;
    if (residual.norm() <= accept_mm_) {
      // geo(q(t)) = first + t step, so q' = J^-1 step.
      node = {k, residual.norm(), local, here.at.jacobian, here.inverse, here.inverse * step_};
      return node.slope.allFinite();
    }
    local += here.inverse * residual;
    if (n == kNodeSteps || !is_near_patch(local)) return false;
    here = sample(local);
  }
}

/// Fills curve_ with the points after `from`, up to `to`.
bool RowInverter::solve_between(const Node& from, const Node& to) {
  const double turn = (Mat3::Identity() - from.inverse * to.jacobian).norm();
  if (!(turn <= kMostTurn) || is_ambiguous(from.point, to.point)) return false;
  const std::uint32_t count = to.point - from.point;
  for (std::uint32_t begin = 0; begin < count; begin += kLanes) {
    if (!correct(guess_between(from, to, begin), curve_[begin / kLanes])) return false;
  }
  return true;
}

/// Guesses for the points from.point + 1 + begin + lane; lanes after the last point repeat it. The cubic Hermite
/// polynomial has q and its slopes at both nodes, so its error falls with the fourth power of their distance.
RowInverter::Guess RowInverter::guess_between(const Node& from, const Node& to, std::uint32_t begin) const {
  const double count = to.point - from.point;
  Lanes ahead;
  for (std::uint32_t lane = 0; lane < kLanes; ++lane) ahead[lane] = std::min(begin + lane + 1.0, count);
  const Lanes t = ahead / count, s = 1 - t;
  const Lanes at_from = s * s * (1 + 2 * t), at_to = t * t * (1 + 2 * s);
  const Lanes by_from = s * s * ahead, by_to = -t * t * (count - ahead);
  Guess guess;
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    guess.local[i] = at_from * from.local[a] + at_to * to.local[a] + by_from * from.slope[a] + by_to * to.slope[a];
    guess.point[i] = first_[a] + (from.point + ahead) * step_[a];
    for (int b = 0; b < 3; ++b) {
      guess.inverse[i][static_cast<std::size_t>(b)] = s * from.inverse(a, b) + t * to.inverse(a, b);
    }
  }
  return guess;
}

/// Moves the parameters until the residuals are accepted. False if they aren't after kCorrections.
bool RowInverter::correct(const Guess& guess, LanePoint& local) {
  local = guess.local;
  for (int n = 0;; ++n) {
    const LanePoint position = patch_positions(*patch_, LaneBasis(local));
    LanePoint residual;
    for (std::size_t a = 0; a < 3; ++a) residual[a] = guess.point[a] - position[a];
    const Lanes squared = residual[0] * residual[0] + residual[1] * residual[1] + residual[2] * residual[2];
    const double worst = std::sqrt(largest(squared));
    if (worst <= accept_mm_) {
      row_->max_residual_mm = std::max(row_->max_residual_mm, worst);
      return true;
    }
    if (n == kCorrections || !(worst < std::numeric_limits<double>::infinity())) return false;
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) local[a] += guess.inverse[a][b] * residual[b];
    }
  }
}

/// How many of the `count` points on curve_ come before the first that lies beyond the patch.
std::uint32_t RowInverter::keep_inside(std::uint32_t first, std::uint32_t count) {
  std::uint32_t inside = 0;
  while (inside < count && in_unit_cube(curve_point(inside))) ++inside;
  for (std::uint32_t begin = 0; begin < inside; begin += kLanes) {
    const LaneBasis basis(curve_[begin / kLanes]);
    const std::uint32_t end = std::min(inside, begin + static_cast<std::uint32_t>(kLanes));
    for (std::size_t c = 0; c < channels_; ++c) {
      const Lanes values = patch_channel(*patch_, c, channels_, basis);
      for (std::uint32_t i = begin; i < end; ++i) row_->values[(first + i) * channels_ + c] = values[i - begin];
    }
  }
  std::fill_n(row_->points.begin() + first, inside, RowPoint::kCoherent);
  return inside;
}

Vec3 RowInverter::curve_point(std::uint32_t i) const {
  const LanePoint& group = curve_[i / kLanes];
  const std::uint32_t lane = i % kLanes;
  return {group[0][lane], group[1][lane], group[2][lane]};
}

bool RowInverter::is_ambiguous(std::uint32_t from, std::uint32_t to) const {
  Box3 box(point(from));
  box.extend(point(to));
  box.min().array() -= options_.outside_mm;
  box.max().array() += options_.outside_mm;
  return solid_->index().is_ambiguous(box);
}

/// A place in or beside the patch of `at`, in the parameters of its cell.
CellParam RowInverter::in_cell(const CellParam& at, const Vec3& local) const {
  CellParam result = at;
  for (int a = 0; a < 3; ++a) {
    result.uvw[place_.axis[static_cast<std::size_t>(a)]] += (local[a] - place_.local[a]) / place_.factor[a];
  }
  return result;
}

/// A hint for the point after the k-th, from a place in or beside the patch of `at`: that place, unless it lies beyond
/// the cell and the row beside entered another patch near there.
CellParam RowInverter::hint_after(std::uint32_t k, const CellParam& at, const Vec3& local) {
  CellParam result = in_cell(at, local);
  if (!in_unit_cube(result.uvw)) {
    while (beside_.size() > 1 && std::abs(beside_[1].point - k - 1) <= std::abs(beside_[0].point - k - 1)) {
      beside_ = beside_.subspan(1);
    }
    if (!beside_.empty() && std::abs(beside_[0].point - k - 1) <= kBesideReach) return beside_[0].at;
  }
  result.uvw = result.uvw.cwiseMax(0).cwiseMin(1);
  return result;
}

}  // namespace ccslice
