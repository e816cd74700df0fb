// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/material_field.h"

#include <Eigen/SVD>
#include <algorithm>
#include <utility>

#include "core/limit/cell_index.h"

namespace ccslice {
namespace {

constexpr double kAcceptMm = 1e-6;
class InvertedField final : public MaterialField {
 public:
  InvertedField(std::shared_ptr<const LimitSolid> solid, const Placement& placement, double outside_mm,
                std::size_t patch_bytes)
      : solid_(std::move(solid)),
        patch_bytes_(patch_bytes),
        mesh_of_world_(placement.inverse(Eigen::Affine)),
        scales_(Eigen::JacobiSVD<Mat3>(placement.linear()).singularValues()),
        inverter_(*solid_, options(outside_mm)),
        row_inverter_(inverter_, *solid_, options(outside_mm)) {}

  std::optional<InversionResult> invert(const Vec3& world, const std::optional<CellParam>& hint) override {
    return in_world_mm(inverter_.invert(mesh_of_world_ * world, hint));
  }

  std::optional<InversionResult> nearest(const Vec3& world) override {
    if (!far_inverter_) far_inverter_.emplace(*solid_, far_options(world));
    return in_world_mm(far_inverter_->invert(mesh_of_world_ * world));
  }

  void solve_row(const Vec3& first, const Vec3& step, std::uint32_t count, const std::optional<CellParam>& hint,
                 std::span<const RowEntry> beside, const CancellationToken& cancel, SolvedRow& row) override {
    row_inverter_.solve(mesh_of_world_ * first, mesh_of_world_.linear() * step, count, hint, beside, cancel, row);
    row.max_residual_mm *= scales_[0];
  }

  void mat(const CellParam& at, std::span<double> out) override { inverter_.evaluator().mat(at, out); }

  bool is_ambiguous(const Box3& world) const override {
    return solid_->index().is_ambiguous(world.transformed(mesh_of_world_));
  }

  std::size_t channel_count() const override { return solid_->channel_count(); }

 private:
  double diagonal_mm() const { return solid_->summary().bounding_box.diagonal().norm(); }

  InversionOptions options(double outside_mm) const {
    InversionOptions result = inversion_options_of(scales_, outside_mm);
    result.patch_cache_bytes = patch_bytes_;
    return result;
  }

  InversionOptions far_options(const Vec3& world) const {
    InversionOptions result = options(0);
    result.outside_mm = diagonal_mm() + solid_->summary().bounding_box.exteriorDistance(mesh_of_world_ * world);
    return result;
  }

  std::optional<InversionResult> in_world_mm(std::optional<InversionResult> result) const {
    if (result) result->residual_mm *= scales_[0];
    return result;
  }

  std::shared_ptr<const LimitSolid> solid_;
  std::size_t patch_bytes_;
  Placement mesh_of_world_;
  Vec3 scales_;  // Singular values of the placement, largest first.
  PointInverter inverter_;
  RowInverter row_inverter_;
  std::optional<PointInverter> far_inverter_;
};

}  // namespace

void MaterialField::solve_row(const Vec3& first, const Vec3& step, std::uint32_t count,
                              const std::optional<CellParam>& hint, std::span<const RowEntry>,
                              const CancellationToken& cancel, SolvedRow& row) {
  row.reset(count, channel_count());
  std::optional<CellParam> near = hint;
  for (std::uint32_t k = 0; k < count; ++k) {
    cancel.throw_if_cancelled();
    const std::optional<InversionResult> found = invert(first + static_cast<double>(k) * step, near);
    if (!found) continue;
    row.points[k] = found->full ? RowPoint::kFull : RowPoint::kCoherent;
    row.max_residual_mm = std::max(row.max_residual_mm, found->residual_mm);
    if (!row.last) row.entries.push_back({k, found->at});
    row.last = near = found->at;
    mat(found->at, std::span(row.values).subspan(k * channel_count(), channel_count()));
  }
}

InversionOptions inversion_options_of(const Vec3& scales, double outside_mm) {
  InversionOptions result;
  result.accept_mm = kAcceptMm / scales[0];
  result.outside_mm = outside_mm / scales[2];
  return result;
}

std::unique_ptr<MaterialField> make_material_field(std::shared_ptr<const LimitSolid> solid, const Placement& placement,
                                                   double outside_mm, std::size_t patch_bytes) {
  return std::make_unique<InvertedField>(std::move(solid), placement, outside_mm, patch_bytes);
}

}  // namespace ccslice
