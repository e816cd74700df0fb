// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Tiles of solids of small cells, whose every voxel is compared with its inversion.

#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "core/interpolation/tiles/tile_painter.h"
#include "core/interpolation/tiles/tile_tree.h"
#include "core/interpolation/tiles/tile_tree_builder.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {

inline constexpr double kTolerance = 1.0 / 1024;
inline constexpr double kRounding = 3e-8;  // A float's, of values up to 1.
inline constexpr double kCellMm = 0.75;    // Some 400 voxels.
inline constexpr double kOutside = 1e-5;   // mm. So little that it never matters, but more than inversion is off.

/// The real field, a point at a time, which it takes notes of.
class WatchedField final : public MaterialField {
 public:
  WatchedField(const Solid& solid, double outside_mm)
      : field_(make_material_field(solid, Placement::Identity(), outside_mm)) {}

  std::optional<InversionResult> invert(const Vec3& world, const std::optional<CellParam>& hint) override {
    inverted.push_back(world);
    if (on_invert) on_invert();
    if (unreachable && unreachable(world)) return std::nullopt;
    return field_->invert(world, hint);
  }
  std::optional<InversionResult> nearest(const Vec3& world) override {
    ++nearest_calls;
    return field_->nearest(world);
  }
  void mat(const CellParam& at, std::span<double> out) override { field_->mat(at, out); }
  bool is_ambiguous(const Box3& world) const override {
    if (on_question) on_question();
    return field_->is_ambiguous(world);
  }
  std::size_t channel_count() const override { return field_->channel_count(); }

  std::vector<Vec3> inverted;
  std::function<void()> on_invert, on_question;
  std::function<bool(const Vec3&)> unreachable;
  std::size_t nearest_calls = 0;

 private:
  std::unique_ptr<MaterialField> field_;
};

struct TilesOptions {
  double tolerance = kTolerance;
  double outside_mm = kOutside;
};

/// Tiles of a solid's first channel, and the field that they ask.
struct Tiles {
  WatchedField field;
  InterpolationSpec spec;
  TileTree tree;
  TileTreeBuilder builder;
  TilePainter painter;

  Tiles(const Solid& solid, const Grid& grid, const TilesOptions& options)
      : field(solid, options.outside_mm),
        spec{Placement::Identity(), grid, {{0, options.tolerance}}, options.outside_mm},
        tree(grid, 1),
        builder(solid, field, spec, true),
        painter(field, spec.channels) {}
};

using Function = std::function<double(const Vec3&)>;

inline double smooth(const Vec3& p) {
  return 0.5 + 0.2 * std::sin(0.2 * p.x() + 0.1) * std::cos(0.2 * p.y()) + 0.03 * p.z();
}

class TilesTest : public testing::Test {
 protected:
  TilesTest() : plane_(float_plane(), {"", -100, 100}, 0) {}

  static PlaneSpec float_plane() {
    PlaneSpec plane;
    plane.content = PlaneContent::kChannel;
    plane.sample_type = SampleType::kFloat32;
    return plane;
  }

  static ControlMesh box(double jitter_mm = 0.08) {
    ControlMesh mesh = oracle::box_mesh(12, 10, 6, kCellMm);
    oracle::jitter(mesh, jitter_mm, 4);
    return mesh;
  }

  /// Takes a solid with this function of its control points for a channel.
  void take(ControlMesh mesh, const Function& value_at) {
    mesh.channel_names = {"channel"};
    mesh.channel_values.clear();
    for (const Vec3& p : mesh.positions) mesh.channel_values.push_back(static_cast<float>(value_at(p)));
    take(mesh);
  }

  void take(const ControlMesh& mesh) {
    solid_ = prepare_solid(mesh);
    GridRequest request;
    request.pitch = {0.1, 0.12, 0.09};
    grid_ = plan_grid(*solid_, Placement::Identity(), request);
    slabs_.clear();
  }

  Vec3 centre(std::uint32_t x, std::uint32_t y, std::uint32_t layer) const {
    return grid_.lattice().centre(x, y, grid_.layer_z_mm(layer));
  }

  /// What voxel by voxel the field says of a layer: those that it reaches, and their values.
  struct ExactLayer {
    std::vector<VoxelRun> spans;
    std::vector<double> values;  // Of the spans' voxels.
  };
  using ExactSlab = std::vector<ExactLayer>;

  ExactSlab invert_slab(std::uint32_t first_layer) const {
    const auto field = make_material_field(solid_, Placement::Identity(), kOutside);
    std::optional<CellParam> hint;
    const auto invert_layer = [&](std::uint32_t layer) {
      ExactLayer exact;
      for (std::uint32_t y = 0; y < grid_.extent.rows; ++y) {
        for (std::uint32_t x = 0; x < grid_.extent.columns; ++x) {
          if (inside_ && !inside_(centre(x, y, layer))) continue;
          const std::optional<InversionResult> found = field->invert(centre(x, y, layer), hint);
          if (!found) continue;
          hint = found->at;
          field->mat(found->at, std::span(&exact.values.emplace_back(), 1));
          std::vector<VoxelRun>& spans = exact.spans;
          if (!spans.empty() && spans.back().row == y && spans.back().end == x) {
            ++spans.back().end;
          } else {
            spans.push_back({y, x, x + 1});
          }
        }
      }
      return exact;
    };
    ExactSlab slab;
    for (std::uint32_t k = first_layer; k < std::min(first_layer + kSlabLayers, grid_.extent.layers); ++k) {
      slab.push_back(invert_layer(k));
    }
    return slab;
  }

  const ExactSlab& exact_slab(std::uint32_t first_layer) {
    for (const auto& [layer, slab] : slabs_) {
      if (layer == first_layer) return slab;
    }
    return slabs_.emplace_back(first_layer, invert_slab(first_layer)).second;
  }

  struct Result {
    LayerStats stats;
    double worst = 0;  // Over all voxels inside.
    std::vector<std::uint8_t> bytes;

    double interpolated() const {
      return static_cast<double>(stats.voxels_interpolated) / static_cast<double>(stats.voxels_inside);
    }
  };

  /// Solves and paints one slab.
  Result run(Tiles& tiles, std::uint32_t first_layer = 16, const CancellationToken& cancel = {}) {
    const ExactSlab& slab = exact_slab(first_layer);
    std::vector<std::span<const VoxelRun>> spans;
    for (const ExactLayer& layer : slab) spans.emplace_back(layer.spans);
    tiles.painter.start_slab();
    tiles.builder.build(first_layer, spans, cancel, tiles.tree);
    Result result;
    for (std::uint32_t l = 0; l < slab.size(); ++l) {
      plane_.clear(grid_.extent.columns, grid_.extent.rows);
      const LayerWindow all = window_of(grid_.lattice());
      const LayerTarget target{
          grid_.lattice(), grid_.layer_z_mm(first_layer + l), std::span(&plane_, 1), result.stats, cancel, all, all};
      EXPECT_EQ(tiles.painter.paint(tiles.tree, target, first_layer + l, spans[l], {}, spans[l]),
                WindowOutcome::kComplete);
      add(slab[l], result);
    }
    const LayerStats& stats = result.stats;
    EXPECT_EQ(stats.voxels_interpolated + stats.voxels_coherent + stats.voxels_full + stats.voxels_unresolved,
              stats.voxels_inside);
    return result;
  }

  Result run(const TilesOptions& options = {}) {
    Tiles tiles(solid_, grid_, options);
    return run(tiles);
  }

  void add(const ExactLayer& exact, Result& result) const {
    const std::span<const std::uint8_t> samples = plane_.image().samples;
    result.bytes.insert(result.bytes.end(), samples.begin(), samples.end());
    auto expected = exact.values.begin();
    for (const VoxelRun& span : exact.spans) {
      result.stats.voxels_inside += span.end - span.begin;
      for (std::uint32_t x = span.begin; x < span.end; ++x) {
        result.worst = std::max(result.worst, std::abs(sample(x, span.row) - *expected++));
      }
    }
  }

  double sample(std::uint32_t x, std::uint32_t y) const {
    float value;
    std::memcpy(&value, &plane_.image().samples[4 * (std::size_t{grid_.extent.columns} * y + x)], sizeof value);
    return value;
  }

  /// Columns, rows and layers of what was inverted.
  std::set<std::array<std::uint32_t, 3>> inverted_by(const Tiles& tiles) const {
    std::set<std::array<std::uint32_t, 3>> voxels;
    for (const Vec3& p : tiles.field.inverted) {
      const Eigen::Array3d from_origin = p - grid_.origin_mm;
      const Eigen::Array3d voxel = from_origin / Eigen::Array3d(grid_.pitch.x_mm, grid_.pitch.y_mm, grid_.pitch.z_mm);
      voxels.insert({static_cast<std::uint32_t>(voxel.x()), static_cast<std::uint32_t>(voxel.y()),
                     static_cast<std::uint32_t>(voxel.z())});
    }
    return voxels;
  }

  /// How many of a slab's voxels fulfil something; all of them must have been inverted.
  std::size_t expect_inverted(const Tiles& tiles, std::uint32_t first_layer,
                              const std::function<bool(const Vec3&)>& where) {
    const std::set<std::array<std::uint32_t, 3>> inverted = inverted_by(tiles);
    std::size_t count = 0, missed = 0;
    std::uint32_t layer = first_layer;
    for (const ExactLayer& exact : exact_slab(first_layer)) {
      for (const VoxelRun& span : exact.spans) {
        for (std::uint32_t x = span.begin; x < span.end; ++x) {
          if (!where(centre(x, span.row, layer))) continue;
          ++count;
          missed += !inverted.contains({x, span.row, layer});
        }
      }
      ++layer;
    }
    EXPECT_EQ(missed, 0u) << "of " << count;
    return count;
  }

  Solid solid_;
  Grid grid_;
  ContonePlane plane_;
  std::function<bool(const Vec3&)> inside_;  // Leaves out voxels of the solid, if set.
  std::vector<std::pair<std::uint32_t, ExactSlab>> slabs_;
};

}  // namespace ccslice
