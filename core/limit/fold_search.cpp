// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/fold_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/limit/lane_box.h"
#include "core/limit/patch.h"

namespace ccslice {

namespace {

constexpr double kCoefficientRounding =
    1e-12;  // As a share of the largest coefficient: what computing them may get wrong, with room.

constexpr std::size_t stride_of(std::size_t axis) { return std::size_t{1} << (2 * axis); }

TensorBasis basis_at(const Vec3& uvw) {
  TensorBasis basis;
  for (std::size_t a = 0; a < 3; ++a) {
    const double t = uvw[static_cast<Eigen::Index>(a)], r = 1 - t;
    basis.value[a] = {r * r * r, 3 * r * r * t, 3 * r * t * t, t * t * t};
    basis.slope[a] = {-3 * r * r, 3 * r * (r - 2 * t), 3 * t * (2 * r - t), 3 * t * t};
  }
  return basis;
}

void keep_worse(const LimitSample& sample, FoldFinding& finding) {
  const double determinant = sample.jacobian.determinant();
  if (determinant < finding.determinant) finding = {finding.verdict, determinant, sample.position};
  if (finding.determinant <= 0) finding.verdict = FoldVerdict::kFolds;
}

/// True if I - S is an M-matrix, S having no negative entry: then no matrix within S of I is singular.
bool keeps_regular(const Mat3& s) {
  const Mat3 m = Mat3::Identity() - s;
  return m(0, 0) > 0 && m.topLeftCorner<2, 2>().determinant() > 0 && m.determinant() > 0;
}

/// Bounds of the differences along one axis.
template <std::size_t kStride>
LaneBox differences_of(const std::array<Lanes, 64>& net) noexcept {
  std::array<LaneBox, 3> bounds;  // One that all go into would wait for each comparison to end before the next.
  for (std::size_t block = 0; block < net.size(); block += 4 * kStride) {
    for (std::size_t p = block; p < block + kStride; ++p) {
      const Lanes a = net[p], b = net[p + kStride], c = net[p + 2 * kStride], d = net[p + 3 * kStride];
      bounds[0].extend(b - a);
      bounds[1].extend(c - b);
      bounds[2].extend(d - c);
    }
  }
  bounds[0].extend(bounds[1]);
  bounds[0].extend(bounds[2]);
  return bounds[0];
}

/// True if det J has the sign of det J0 all over the net. J0^-1 J is enclosed entry by entry, C +- R: regular if C is,
/// and so is everything within |C^-1| R of I.
bool certainly_unfolded(const BezierVolume& net, const Mat3& jacobian) {
  const LaneMap map(3 * jacobian.inverse());
  const Lanes origin = load_unaligned(net[0].data());
  std::array<Lanes, 64> images;  // Images of the net's points, so that their differences are those of J0^-1 J.
  for (std::size_t p = 0; p < images.size(); ++p) images[p] = map(load_unaligned(net[p].data()) - origin);
  Mat3 centre, radius;
  const std::array<LaneBox, 3> bounds = {differences_of<1>(images), differences_of<4>(images),
                                         differences_of<16>(images)};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& [low, high] = bounds[axis];
    centre.col(static_cast<Eigen::Index>(axis)) = to_vec3((high + low) / 2);
    radius.col(static_cast<Eigen::Index>(axis)) = to_vec3((high - low) / 2);
  }
  if (!(centre.determinant() > 0)) return false;
  // Differences of a Bezier net, times the degree, are coefficients of its derivative, whose values lie in their hull.
  // Any J0^-1 J there is C (I + C^-1 D) with |D| <= R.
  const Mat3 spread = centre.inverse().cwiseAbs() * radius;
  return spread.allFinite() && keeps_regular((1 + kCoefficientRounding) * spread);
}

/// Looks at the middle. True if that settles it.
bool settle_at_middle(const BezierVolume& net, FoldFinding& finding) {
  static const TensorBasis kMiddle = basis_at(Vec3::Constant(0.5));
  const LimitSample middle = tensor_sample(net.data()->data(), kMiddle);
  keep_worse(middle, finding);
  return finding.verdict != FoldVerdict::kFolds && certainly_unfolded(net, middle.jacobian);
}

/// Looks at the middles of the eight halves. True if that settles it.
bool settle_in_halves(const BezierVolume& net, FoldFinding& finding) {
  std::array<BezierVolume, 8> parts;
  parts[0] = net;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t count = std::size_t{1} << axis;
    for (std::size_t i = 0; i < count; ++i) {
      const BezierVolume whole = parts[i];
      halve_net(whole, axis, parts[i], parts[i + count]);
    }
  }
  bool settled = true;
  for (const BezierVolume& part : parts) {
    FoldFinding found;  // Its determinant is that of an eighth.
    settled &= settle_at_middle(part, found);
    found.determinant *= 8;
    if (found.determinant < finding.determinant) finding = found;
  }
  return settled;
}

constexpr double binomial(std::size_t n, std::size_t k) {
  double result = 1;
  for (std::size_t i = 0; i < k; ++i) result = result * static_cast<double>(n - i) / static_cast<double>(i + 1);
  return result;
}

/// The derivative along an axis in the scaled Bernstein basis (coefficients times binomials), where multiplying is
/// convolving. sizes[a]: coefficients along axis a.
struct Derivative {
  std::array<Vec3, 48> c;
  std::array<std::size_t, 3> sizes;
};

Derivative derivative_of(const BezierVolume& net, std::size_t axis) {
  Derivative result;
  result.sizes = {4, 4, 4};
  result.sizes[axis] = 3;
  std::size_t at = 0;
  for (std::size_t k = 0; k < result.sizes[2]; ++k) {
    for (std::size_t j = 0; j < result.sizes[1]; ++j) {
      for (std::size_t i = 0; i < result.sizes[0]; ++i) {
        const std::size_t p = i + 4 * j + 16 * k;
        const double scale =
            binomial(result.sizes[0] - 1, i) * binomial(result.sizes[1] - 1, j) * binomial(result.sizes[2] - 1, k);
        result.c[at++] = 3 * scale * (net[p + stride_of(axis)] - net[p]).head<3>();
      }
    }
  }
  return result;
}

/// Calls visit(index, k-th coefficient's place) for all coefficients of a derivative, where `place` is their offset in
/// a grid of nx * ny * ... coefficients.
template <typename Visit>
void for_each_coefficient(const std::array<std::size_t, 3>& sizes, std::size_t nx, std::size_t ny, Visit visit) {
  std::size_t at = 0;
  for (std::size_t k = 0; k < sizes[2]; ++k) {
    for (std::size_t j = 0; j < sizes[1]; ++j) {
      for (std::size_t i = 0; i < sizes[0]; ++i) visit(at++, i + nx * (j + ny * k));
    }
  }
}

constexpr std::array<double, 9> kBinomials = {1, 8, 28, 56, 70, 56, 28, 8, 1};  // Binomial coefficients of 8.

double least_of(const std::array<double, 729>& b) {
  std::array<double, 9> least;  // Nine at a time: one register after the other.
  std::copy_n(b.begin(), 9, least.begin());
  for (std::size_t row = 9; row < b.size(); row += 9) {
    for (std::size_t i = 0; i < 9; ++i) least[i] = std::min(least[i], b[row + i]);
  }
  return *std::min_element(least.begin(), least.end());
}

/// De Casteljau at the middle, along the axis with this stride; `b` becomes the upper half.
void halve(std::array<double, 729>& b, std::size_t stride, std::array<double, 729>& low) {
  for (std::size_t first = 0; first < b.size(); first += 9 * stride) {
    double* line = b.data() + first;
    for (std::size_t round = 0; round < 9; ++round) {
      std::copy_n(line, stride, low.data() + first + round * stride);
      for (std::size_t i = 0; i < (8 - round) * stride; ++i) line[i] = 0.5 * (line[i] + line[i + stride]);
    }
  }
}

/// How much the coefficients differ along an axis, over the lines through corners and middle.
double variation(const std::array<double, 729>& b, std::size_t axis) {
  constexpr std::array<std::size_t, 3> kStrides = {1, 9, 81};
  const std::size_t stride = kStrides[axis], side = kStrides[(axis + 1) % 3], other = kStrides[(axis + 2) % 3];
  double sum = 0;
  constexpr std::array<std::array<std::size_t, 2>, 5> kLines = {{{0, 0}, {8, 0}, {0, 8}, {8, 8}, {4, 4}}};
  for (const auto& [i, j] : kLines) {
    const double* line = b.data() + i * side + j * other;
    double low = line[0], high = line[0];
    for (std::size_t k = 1; k < 9; ++k) {
      low = std::min(low, line[k * stride]);
      high = std::max(high, line[k * stride]);
    }
    sum += high - low;
  }
  return sum;
}

}  // namespace

void halve_net(const BezierVolume& net, std::size_t axis, BezierVolume& low, BezierVolume& high) {
  const std::size_t stride = stride_of(axis);
  for (std::size_t p = 0; p < 64; ++p) {
    if ((p / stride) % 4 != 0) continue;
    const std::size_t q = p + stride, r = q + stride, s = r + stride;
    const Eigen::Vector4d pq = (net[p] + net[q]) / 2, qr = (net[q] + net[r]) / 2, rs = (net[r] + net[s]) / 2;
    const Eigen::Vector4d pqr = (pq + qr) / 2, qrs = (qr + rs) / 2;
    low[p] = net[p], low[q] = pq, low[r] = pqr, low[s] = high[p] = (pqr + qrs) / 2;
    high[q] = qrs, high[r] = rs, high[s] = net[s];
  }
}

Mat3 edges_of(const BezierVolume& net) noexcept {
  Mat3 edges;
  edges.col(0) = (net[3] + net[15] + net[51] + net[63] - net[0] - net[12] - net[48] - net[60]).head<3>() / 4;
  edges.col(1) = (net[12] + net[15] + net[60] + net[63] - net[0] - net[3] - net[48] - net[51]).head<3>() / 4;
  edges.col(2) = (net[48] + net[51] + net[60] + net[63] - net[0] - net[3] - net[12] - net[15]).head<3>() / 4;
  return edges;
}

/// det J = J_u . (J_v x J_w), whose factors have degrees (2,3,3), and (3,2,3) + (3,3,2) = (6,5,5).
void FoldSearch::set_up(const BezierVolume& net) {
  const Derivative u = derivative_of(net, 0), v = derivative_of(net, 1), w = derivative_of(net, 2);
  for (auto& component : cross_) component.fill(0);
  for_each_coefficient(v.sizes, 7, 6, [&](std::size_t p, std::size_t from) {
    for_each_coefficient(w.sizes, 7, 6, [&](std::size_t q, std::size_t to) {
      const Vec3 product = v.c[p].cross(w.c[q]);
      for (std::size_t d = 0; d < 3; ++d) cross_[d][from + to] += product[static_cast<Eigen::Index>(d)];
    });
  });
  parts_.clear();
  Part& whole = parts_.emplace_back();
  whole.b.fill(0);
  for_each_coefficient(u.sizes, 9, 9, [&](std::size_t p, std::size_t from) {
    for (std::size_t row = 0; row < 36; ++row) {
      double* to = whole.b.data() + from + 9 * (row % 6) + 81 * (row / 6);
      const std::size_t at = 7 * row;
      for (std::size_t i = 0; i < 7; ++i) {
        to[i] += u.c[p][0] * cross_[0][at + i] + u.c[p][1] * cross_[1][at + i] + u.c[p][2] * cross_[2][at + i];
      }
    }
  });
  for_each_coefficient({9, 9, 9}, 9, 9, [&](std::size_t p, std::size_t) {
    whole.b[p] /= kBinomials[p % 9] * kBinomials[p / 9 % 9] * kBinomials[p / 81];
  });
  whole.least = least_of(whole.b);
}

/// Halves it along the axis where it helps most; the half with the smaller coefficient ends on top. False if all are
/// used up.
bool FoldSearch::halve_top() {
  parts_.emplace_back();
  Part &high = parts_[parts_.size() - 2], &low = parts_.back();
  double most = -1;
  std::size_t axis = 3;
  for (std::size_t a = 0; a < 3; ++a) {
    if (high.size[static_cast<Eigen::Index>(a)] * kFinest <= 1) continue;
    const double gain = variation(high.b, a);
    if (gain > most) most = gain, axis = a;
  }
  if (axis == 3) return parts_.pop_back(), false;
  constexpr std::array<std::size_t, 3> kStrides = {1, 9, 81};
  halve(high.b, kStrides[axis], low.b);
  high.size[static_cast<Eigen::Index>(axis)] /= 2;
  low.size = high.size;
  low.low = high.low;
  high.low[static_cast<Eigen::Index>(axis)] += high.size[static_cast<Eigen::Index>(axis)];
  for (Part* part : {&low, &high}) part->least = least_of(part->b);
  if (high.least < low.least) std::swap(low, high);
  return true;
}

void FoldSearch::search_polynomial(const BezierVolume& net, FoldFinding& finding) {
  finding.verdict = FoldVerdict::kUndecided;
  if (halvings_left_ < kSetUpHalvings) return;
  halvings_left_ -= kSetUpHalvings;
  set_up(net);
  const auto larger = [](double a, double b) { return std::abs(a) < std::abs(b); };
  const auto& b = parts_.front().b;
  const double rounding = kCoefficientRounding * std::abs(*std::max_element(b.begin(), b.end(), larger));
  bool undecided = false;
  for (int halvings = 0; !parts_.empty();) {
    const Part& part = parts_.back();
    // A Bernstein polynomial is no smaller than its least coefficient.
    if (part.least > rounding) {
      parts_.pop_back();
      continue;
    }
    look_at_corners(net, part, rounding, finding);
    if (finding.verdict == FoldVerdict::kFolds) return;
    if (halvings == kHalvingsPerPatch || halvings_left_ == 0) return;
    ++halvings;
    --halvings_left_;
    if (halve_top()) continue;
    undecided = true;
    parts_.pop_back();
  }
  if (!undecided) finding.verdict = FoldVerdict::kUnfolded;
}

/// Where a corner's coefficient is negative beyond rounding, evaluates there.
void FoldSearch::look_at_corners(const BezierVolume& net, const Part& part, double rounding, FoldFinding& finding) {
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t i = corner & 1, j = corner >> 1 & 1, k = corner >> 2;
    if (part.b[8 * i + 72 * j + 648 * k] > -rounding) continue;
    const Vec3 which(static_cast<double>(i), static_cast<double>(j), static_cast<double>(k));
    keep_worse(tensor_sample(net.data()->data(), basis_at(part.low + which.cwiseProduct(part.size))), finding);
  }
}

FoldFinding FoldSearch::examine(const BezierVolume& net) {
  FoldFinding finding;
  if (settle_at_middle(net, finding) || settle_in_halves(net, finding)) return finding;
  if (finding.verdict != FoldVerdict::kFolds) search_polynomial(net, finding);
  return finding;
}

FoldFinding FoldSearch::sample(const BezierVolume& net) noexcept {
  FoldFinding finding;
  settle_at_middle(net, finding);
  return finding;
}

}  // namespace ccslice
