// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The materials of a placed solid as a function of world points: placement^-1, point inversion, mat [Luu19, 3.2.2].

#pragma once

#include <memory>
#include <optional>
#include <span>

#include "core/base/cancellation.h"
#include "core/base/types.h"
#include "core/inversion/point_inverter.h"
#include "core/inversion/row_inverter.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// What a layer's material pass needs of a solid. One thread.
class MaterialField {
 public:
  virtual ~MaterialField() = default;

  /// The parameter of a world point; residual_mm in world mm. `hint`: a parameter solved for a point nearby.
  [[nodiscard]] virtual std::optional<InversionResult> invert(const Vec3& world,
                                                              const std::optional<CellParam>& hint) = 0;
  /// The nearest parameter to a world point that may lie anywhere. Costly: for points that invert() gives up.
  [[nodiscard]] virtual std::optional<InversionResult> nearest(const Vec3& world) = 0;
  /// REQUIRES: out.size() == channel_count().
  virtual void mat(const CellParam& at, std::span<double> out) = 0;
  /// The solid folds in this box, or separate parts of it overlap there, so that materials may jump between
  /// neighbouring points.
  virtual bool is_ambiguous(const Box3& world) const = 0;
  virtual std::size_t channel_count() const = 0;

  /// The parameters of the world points first + k * step, 0 <= k < count, and their channels: invert() and mat() of
  /// each, or anything faster (row_inverter.h). Throws Error{kCancelled}.
  virtual void solve_row(const Vec3& first, const Vec3& step, std::uint32_t count, const std::optional<CellParam>& hint,
                         std::span<const RowEntry> beside, const CancellationToken& cancel, SolvedRow& row);
};

/// How make_material_field() inverts points: of the mesh's frame, under a placement whose singular values are `scales`,
/// largest first.
[[nodiscard]] InversionOptions inversion_options_of(const Vec3& scales, double outside_mm);

/// The real one. A point inside is accepted within 1e-6 mm, less in small cells (acceptance.h), and a point that the
/// contours' tolerance puts inside although it is `outside_mm` off the limit volume still gets a parameter; both are
/// world lengths. Residuals are |placement's largest scale| * the mesh frame's: exact for rotations and uniform scales,
/// an upper bound for the rest. `patch_bytes`: that it keeps at most, for speed; the patches of a slab's cells take
/// about the default. REQUIRES: placement passes validate_placement().
[[nodiscard]] std::unique_ptr<MaterialField> make_material_field(std::shared_ptr<const LimitSolid> solid,
                                                                 const Placement& placement, double outside_mm,
                                                                 std::size_t patch_bytes = 8 << 20);

}  // namespace ccslice
