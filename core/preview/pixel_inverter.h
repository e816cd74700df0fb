// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Channels at single pixels of a plane, and how they change from pixel to pixel there.
//
// With J the Jacobian and m the channels' derivatives by the parameters, the slope along a step s is m J^-1 s. So one
// inversion says what the pixels around have, too, and which parameter they have, about: pixels asked for one after
// another start from each other. One that lies in another cell tries those whose maps say that it may be in them
// (CellIndex), the nearest to their middles first. Newton's method stops where the next step is a small share of a
// patch, and takes that step to first order only; no search but PointInverter's goes farther than that, which is left
// what fails.
//
// An answer depends on the pixels that were asked for before in the same picture, within about a thousandth of the
// channels' range, and on nothing else.

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/types.h"
#include "core/field/layer_target.h"
#include "core/field/material_field.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"
#include "core/preview/pixel_surface.h"

namespace ccslice {

struct Patch;
struct PatchPlace;
struct TensorBasis;

/// One solid, one thread. Patches are kept from picture to picture.
class PixelInverter {
 public:
  explicit PixelInverter(std::shared_ptr<const LimitSolid> solid);

  struct Care {
    bool strict = false;  // No parameter beyond its cell is taken, for channels that jump between cells.
    /// A step of a tenth of a patch is the last one, and what is a little beyond a cell is taken at its side.
    bool rough = false;
  };

  /// For the pixels of one picture. REQUIRES: all outlive the picture; the field is of the solid.
  void start(const LayerTarget& target, const InterpolationSpec& spec, MaterialField& field, Care care);

  struct Pixel {
    std::uint32_t column = 0, row = 0;
    bool smooth = false;  // It has a parameter and finite slopes. If not, its values are undefined.
    CellParam at;
    Mat3 inverse = Mat3::Zero();  // The parameter's change by mm of the mesh frame.
  };

  enum class Wanted : std::uint8_t { kSlopes, kValues };

  /// The number of a pixel, by which it is known from now on. Where only values are wanted, all is a little rougher.
  std::uint32_t invert(std::uint32_t column, std::uint32_t row, Wanted wanted = Wanted::kSlopes);
  /// A pixel's number, if it has been asked for.
  std::optional<std::uint32_t> find(std::uint32_t column, std::uint32_t row) const;
  /// How many have been asked for.
  std::size_t count() const { return pixels_.size(); }
  /// Forgets all but the first `count` of them.
  void forget_after(std::size_t count);
  const Pixel& pixel(std::uint32_t number) const { return pixels_[number]; }
  /// The spec's n-th channel, and its slopes by columns and rows.
  const SurfaceSample& sample(std::uint32_t number, std::size_t n) const {
    return samples_[number * channels_.size() + n];
  }
  /// About where a pixel is, from a smooth one nearby.
  CellParam guess(std::uint32_t near, std::uint32_t column, std::uint32_t row) const;
  /// Smooth pixels, the corners of a rectangle among them, are in one cell, and so is what is between them: they are
  /// farther from its sides than any is from where another one expects it.
  bool are_amid_a_cell(std::span<const std::uint32_t> numbers) const;
  /// In the mesh frame.
  Vec3 place_of(double column, double row) const { return first_ + column * across_ + row * up_; }
  double outside_mm() const { return outside_mm_; }  // Mesh frame.
  double pixel_mm() const;                           // The longer side, mesh frame.

 private:
  struct Step;

  std::size_t block_of(std::uint32_t column, std::uint32_t row) const;
  bool solve_near(std::uint32_t near, double farthest, const Vec3& point, Pixel& pixel);
  bool solve_beside(const Vec3& point, Pixel& pixel);
  bool solve_in_candidates(const Vec3& point, Pixel& pixel);
  void solve_thoroughly(Pixel& pixel);
  bool solve_in(LimitCellId cell, Vec3 uvw, const Vec3& point, Pixel& pixel);
  bool is_within(LimitCellId cell, const Step& step) const;
  void keep(const Step& step, Pixel& pixel);

  std::shared_ptr<const LimitSolid> solid_;
  LimitEvaluator evaluator_;
  // Of the picture:
  LayerLattice lattice_;
  double z_mm_ = 0;
  MaterialField* field_ = nullptr;
  Care care_;
  std::vector<ChannelTolerance> channels_;
  Vec3 first_ = Vec3::Zero(), across_ = Vec3::Zero(), up_ = Vec3::Zero();  // Mesh frame.
  double outside_mm_ = 0;
  std::vector<std::uint32_t> numbers_;  // By pixel: 1 + its number, 0 if it hasn't been asked for.
  std::vector<Pixel> pixels_;
  std::vector<SurfaceSample> samples_;
  std::optional<std::uint32_t> last_;  // The smooth pixel asked for last.
  std::uint32_t hint_columns_ = 0;
  std::vector<std::uint32_t> blocks_;  // By block of hints: 1 + the smooth pixel in it asked for last, or 0.
  // Of the pixel at hand: from how far a step is the last one, and where Newton's method came nearest.
  double near_ = 0;
  std::optional<CellParam> nearest_;
  double nearest_mm_ = 0;
};

}  // namespace ccslice
