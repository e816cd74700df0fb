// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/pixel_inverter.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <limits>
#include <tuple>
#include <utility>

#include "core/limit/cell_index.h"
#include "core/limit/patch.h"
#include "core/limit/patch_path.h"

namespace ccslice {
namespace {

constexpr std::size_t kPatchCacheBytes = 24 << 20;
constexpr int kMostSteps = 12;
constexpr int kMostClipped = 2;  // Steps that would have left the cell: it is another one that holds the point.
// A step below that share of a patch is the last one. It takes values to first order, and slopes from where it begins.
constexpr double kNearForSlopes = 0.01, kNearForValues = 0.02, kNearForRoughValues = 0.1;
constexpr double kNearAsMeshed = 0.005;                       // Unless rough: quarters of tetrahedra are skew.
constexpr double kFarthestHint = 0.05;                        // Beyond its cell, a guess says nothing about it.
constexpr double kHintMargin = 0.02, kCandidateMargin = 0.1;  // Starts lie that far inside.
constexpr double kBeside = 0.02;                              // Beyond a cell whose neighbour goes on smoothly.
constexpr double kRoughlyBeside = 0.1;                        // The same where values may be rough.
constexpr double kBesideAsMeshed = 1e-4;                      // The same where slopes jump to the neighbour's.
constexpr double kBesideBoundary = 0.1;
constexpr double kLeastMargin = 1e-3;  // From a cell's sides to what is amid it.
constexpr double kSoftClip = 0.1;      // Irregular cells: the share of the way to a side that must remain.
constexpr std::size_t kMostCandidates = 8;
constexpr std::uint32_t kHintBlock = 4;  // Pixels each way.
constexpr std::array<std::array<int, 2>, 6> kBlocksAround = {{{0, 0}, {-1, 0}, {0, -1}, {1, -1}, {-1, -1}, {1, 0}}};

std::uint32_t hint_blocks(std::uint32_t pixels) { return (pixels + kHintBlock - 1) / kHintBlock; }

double beyond_cell(const Vec3& uvw) { return (uvw.array() - 0.5).abs().maxCoeff() - 0.5; }

Vec3 well_inside(const Vec3& uvw, double margin) { return uvw.cwiseMax(margin).cwiseMin(1 - margin); }

TensorBasis basis_at(const Vec3& local) {
  TensorBasis basis;
  for (std::size_t a = 0; a < 3; ++a) {
    bspline_basis(local[static_cast<Eigen::Index>(a)], basis.value[a], basis.slope[a]);
  }
  return basis;
}

/// The inverse Jacobian by a cell's parameters, from that by the parameters of its patch at the place.
Mat3 by_cell(const Mat3& inverse, const PatchPlace& place) {
  Mat3 cell_inverse;
  for (int a = 0; a < 3; ++a) {
    cell_inverse.row(place.axis[static_cast<std::size_t>(a)]) = inverse.row(a) / place.factor[a];
  }
  return cell_inverse;
}

struct Candidate {
  double distance;  // From the cell's middle.
  LimitCellId cell;
  Vec3 guess;

  bool operator<(const Candidate& other) const {
    return std::pair(distance, cell) < std::pair(other.distance, other.cell);
  }
};

}  // namespace

/// A step of Newton's method in a patch.
struct PixelInverter::Step {
  const Patch& patch;
  TensorBasis basis;
  Mat3 inverse;       // Of the Jacobian by the patch's parameters,
  Mat3 cell_inverse;  // and by the cell's.
  Vec3 local;         // The step, in the patch's parameters.
  Vec3 uvw;           // Where it leads to, in the cell's.

  /// Ends the step at another place of the cell.
  void end_at(const Vec3& other, const PatchPlace& place) {
    for (int a = 0; a < 3; ++a) {
      const int axis = place.axis[static_cast<std::size_t>(a)];
      local[a] += place.factor[a] * (other[axis] - uvw[axis]);
    }
    uvw = other;
  }
};

PixelInverter::PixelInverter(std::shared_ptr<const LimitSolid> solid)
    : solid_(std::move(solid)), evaluator_(*solid_, kPatchCacheBytes) {}

void PixelInverter::start(const LayerTarget& target, const InterpolationSpec& spec, MaterialField& field, Care care) {
  lattice_ = target.lattice;
  z_mm_ = target.z_mm;
  field_ = &field;
  care_ = care;
  channels_ = spec.channels;
  const Placement mesh_of_world = spec.placement.inverse(Eigen::Affine);
  first_ = mesh_of_world * lattice_.centre(0, 0, z_mm_);
  across_ = mesh_of_world.linear() * Vec3(lattice_.dx_mm, 0, 0);
  up_ = mesh_of_world.linear() * Vec3(0, lattice_.dy_mm, 0);
  const Vec3 scales = Eigen::JacobiSVD<Mat3>(spec.placement.linear()).singularValues();
  outside_mm_ = inversion_options_of(scales, spec.outside_mm).outside_mm;
  numbers_.assign(std::size_t{lattice_.width} * lattice_.height, 0);
  hint_columns_ = hint_blocks(lattice_.width);
  blocks_.assign(std::size_t{hint_columns_} * hint_blocks(lattice_.height), 0);
  pixels_.clear();
  samples_.clear();
  last_.reset();
}

std::size_t PixelInverter::block_of(std::uint32_t column, std::uint32_t row) const {
  return std::size_t{hint_columns_} * (row / kHintBlock) + column / kHintBlock;
}

double PixelInverter::pixel_mm() const { return std::max(across_.norm(), up_.norm()); }

std::optional<std::uint32_t> PixelInverter::find(std::uint32_t column, std::uint32_t row) const {
  const std::uint32_t number = numbers_[std::size_t{lattice_.width} * row + column];
  return number == 0 ? std::nullopt : std::optional(number - 1);
}

void PixelInverter::forget_after(std::size_t count) {
  for (std::size_t n = count; n < pixels_.size(); ++n) {
    numbers_[std::size_t{lattice_.width} * pixels_[n].row + pixels_[n].column] = 0;
  }
  pixels_.resize(count);
  samples_.resize(count * channels_.size());
  if (last_ && *last_ >= count) last_.reset();
}

CellParam PixelInverter::guess(std::uint32_t near, std::uint32_t column, std::uint32_t row) const {
  const Pixel& from = pixels_[near];
  CellParam at = from.at;
  at.uvw += from.inverse * (place_of(column, row) - place_of(from.column, from.row));
  at.uvw = well_inside(at.uvw, 0);
  return at;
}

/// Parameters bend by how much expectations are off: between corners by less than that.
bool PixelInverter::are_amid_a_cell(std::span<const std::uint32_t> numbers) const {
  const LimitCellId cell = pixels_[numbers.front()].at.cell;
  Vec3 bend = Vec3::Constant(kLeastMargin), margin = Vec3::Constant(1);
  for (const std::uint32_t number : numbers) {
    const Pixel& pixel = pixels_[number];
    if (pixel.at.cell != cell) return false;
    margin = margin.cwiseMin(pixel.at.uvw).cwiseMin(Vec3::Ones() - pixel.at.uvw);
    for (const std::uint32_t from : numbers) {
      const Vec3 step = place_of(pixel.column, pixel.row) - place_of(pixels_[from].column, pixels_[from].row);
      const Vec3 expected = pixels_[from].at.uvw + pixels_[from].inverse * step;
      bend = bend.cwiseMax((pixel.at.uvw - expected).cwiseAbs());
    }
  }
  return (margin.array() >= bend.array()).all();
}

std::uint32_t PixelInverter::invert(std::uint32_t column, std::uint32_t row, Wanted wanted) {
  std::uint32_t& number = numbers_[std::size_t{lattice_.width} * row + column];
  if (number != 0) return number - 1;
  Pixel pixel;
  pixel.column = column;
  pixel.row = row;
  const Vec3 point = place_of(column, row);
  near_ = wanted == Wanted::kValues ? kNearForValues : kNearForSlopes;
  if (solid_->as_meshed()) near_ = kNearAsMeshed;
  if (care_.rough) near_ = kNearForRoughValues;
  nearest_.reset();
  nearest_mm_ = std::numeric_limits<double>::infinity();
  if (!(last_ && solve_near(*last_, kFarthestHint, point, pixel)) && !solve_beside(point, pixel) &&
      !solve_in_candidates(point, pixel)) {
    solve_thoroughly(pixel);
  }
  pixels_.push_back(pixel);
  samples_.resize(pixels_.size() * channels_.size());
  number = static_cast<std::uint32_t>(pixels_.size());
  if (pixel.smooth) {
    last_ = number - 1;
    blocks_[block_of(column, row)] = number;
  }
  return number - 1;
}

bool PixelInverter::solve_near(std::uint32_t near, double farthest, const Vec3& point, Pixel& pixel) {
  const Pixel& from = pixels_[near];
  const Vec3 uvw = from.at.uvw + from.inverse * (point - place_of(from.column, from.row));
  return beyond_cell(uvw) <= farthest && solve_in(from.at.cell, well_inside(uvw, kHintMargin), point, pixel);
}

/// From a pixel of the blocks around, if the point is in its cell.
bool PixelInverter::solve_beside(const Vec3& point, Pixel& pixel) {
  const std::uint32_t rows = hint_blocks(lattice_.height);
  const std::uint32_t x = pixel.column / kHintBlock, y = pixel.row / kHintBlock;
  for (const auto& [across, up] : kBlocksAround) {
    const std::uint32_t column = x + static_cast<std::uint32_t>(across), row = y + static_cast<std::uint32_t>(up);
    if (column >= hint_columns_ || row >= rows) continue;
    const std::uint32_t number = blocks_[std::size_t{hint_columns_} * row + column];
    // What was forgotten may have made way for any other.
    if (number == 0 || number > pixels_.size() || number - 1 == last_ || !pixels_[number - 1].smooth) continue;
    if (solve_near(number - 1, 0, point, pixel)) return true;
  }
  return false;
}

bool PixelInverter::solve_in_candidates(const Vec3& point, Pixel& pixel) {
  const CellIndex& index = solid_->index();
  std::array<Candidate, kMostCandidates> candidates;
  std::size_t count = 0;
  index.cell_boxes.visit_at(point, outside_mm_, [&](std::uint32_t item) {
    const LimitCellId cell{item};
    const Vec3 guess = index.cell_maps[cell](point);
    if (!index.cell_maps[cell].may_hold(guess, outside_mm_)) return;
    const Candidate candidate{beyond_cell(guess), cell, guess};
    if (count == candidates.size() && !(candidate < candidates.back())) return;
    std::size_t at = count < candidates.size() ? count++ : count - 1;
    for (; at > 0 && candidate < candidates[at - 1]; --at) candidates[at] = candidates[at - 1];
    candidates[at] = candidate;
  });
  const auto found = std::span(candidates).first(count);
  return std::ranges::any_of(found, [&](const Candidate& candidate) {
    return solve_in(candidate.cell, well_inside(candidate.guess, kCandidateMargin), point, pixel);
  });
}

void PixelInverter::solve_thoroughly(Pixel& pixel) {
  const auto found = field_->invert(lattice_.centre(pixel.column, pixel.row, z_mm_), nearest_);
  if (!found) return;
  PatchPlace place;
  const Patch* patch = evaluator_.patch_at(found->at, place);
  if (patch == nullptr) return;
  pixel.at = found->at;
  const TensorBasis basis = basis_at(place.local);
  const Mat3 inverse = tensor_sample(patch->points, basis).jacobian.inverse();
  if (!inverse.allFinite()) return;
  keep({*patch, basis, inverse, by_cell(inverse, place), Vec3::Zero(), found->at.uvw}, pixel);
}

/// Newton's method from a start in a cell. True if it ends at the point.
bool PixelInverter::solve_in(LimitCellId cell, Vec3 uvw, const Vec3& point, Pixel& pixel) {
  const double soft_clip = solid_->cell_class(cell) == CellClass::kRegular ? 0 : kSoftClip;
  int clipped = 0;
  for (int n = 0; n < kMostSteps && clipped <= kMostClipped; ++n) {
    PatchPlace place;
    const Patch* patch = evaluator_.patch_at({cell, uvw}, place);
    if (patch == nullptr) return false;
    const TensorBasis basis = basis_at(place.local);
    const LimitSample sample = tensor_sample(patch->points, basis);
    const Vec3 residual = point - sample.position;
    Step step{*patch, basis, sample.jacobian.inverse(), Mat3::Zero(), Vec3::Zero(), uvw};
    step.local = step.inverse * residual;
    if (!step.local.allFinite()) return false;
    step.cell_inverse = by_cell(step.inverse, place);
    step.uvw += step.cell_inverse * residual;
    if (residual.norm() < nearest_mm_) {
      nearest_mm_ = residual.norm();
      nearest_ = {cell, uvw};
    }
    if (care_.rough && is_within(cell, step)) step.end_at(well_inside(step.uvw, 0), place);
    if (step.local.cwiseAbs().maxCoeff() <= near_) {
      if (!is_within(cell, step)) return false;
      pixel.at = {cell, well_inside(step.uvw, 0)};
      keep(step, pixel);
      return true;
    }
    const Vec3 low = soft_clip * uvw, high = Vec3::Ones() - soft_clip * (Vec3::Ones() - uvw);
    const Vec3 next = step.uvw.cwiseMax(low).cwiseMin(high);
    if (next != step.uvw) ++clipped;
    if (next == uvw) return false;
    uvw = next;
  }
  return false;
}

/// Where a step leads to is in the cell, or beside it where its patch's polynomials still tell the channels.
bool PixelInverter::is_within(LimitCellId cell, const Step& step) const {
  if (care_.strict) return beyond_cell(step.uvw) <= 0;
  const double beside = solid_->as_meshed() ? kBesideAsMeshed : care_.rough ? kRoughlyBeside : kBeside;
  if (beyond_cell(step.uvw) <= beside) return true;
  if (!care_.rough && beyond_cell(step.uvw) > kBesideBoundary) return false;
  const Mat3 jacobian = step.cell_inverse.inverse();
  for (int a = 0; a < 3; ++a) {
    const double beyond = std::abs(step.uvw[a] - 0.5) - 0.5;
    if (beyond <= beside) continue;
    const int side = 2 * a + (step.uvw[a] > 0.5 ? 1 : 0);
    const bool on_boundary = solid_->boundary_sides(cell) >> side & 1;
    if (!on_boundary || !(beyond * jacobian.col(a).norm() <= outside_mm_)) return false;
  }
  return true;
}

void PixelInverter::keep(const Step& step, Pixel& pixel) {
  pixel.inverse = step.cell_inverse;
  const Vec3 across = step.inverse * across_, up = step.inverse * up_;
  pixel.smooth = across.allFinite() && up.allFinite();
  for (const ChannelTolerance& channel : channels_) {
    const ChannelSample sample = patch_channel_sample(step.patch, channel.channel, solid_->channel_count(), step.basis);
    samples_.push_back({sample.value + sample.slope.dot(step.local), {sample.slope.dot(across), sample.slope.dot(up)}});
  }
}

}  // namespace ccslice
