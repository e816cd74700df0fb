// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/cut_view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace ccslice::cli {
namespace {

constexpr int kMargin = 5;        // Empty voxels round the block: smoothing needs them.
constexpr int kSmoothings = 4;    // Passes of the weights 1, 2, 1 along each axis.
constexpr int kRaysPerSide = 2;   // kRaysPerSide^2 rays a place.
constexpr double kStep = 0.6;     // Voxels.
constexpr double kBorder = 0.02;  // Of the picture's width.
constexpr int kHalvings = 8;

/// Occupancy, smoothed, and value times smoothed occupancy, over the block and its margin. A voxel's centre is at its
/// integer place.
class Field {
 public:
  explicit Field(const VoxelBlock& block) {
    for (std::size_t d = 0; d < 3; ++d) size_[d] = block.size[d] + 2 * kMargin;
    const std::size_t count =
        static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]);
    density_.assign(count, 0);
    weighted_.assign(count, 0);
    for (int z = 0; z < block.size[2]; ++z) {
      for (int y = 0; y < block.size[1]; ++y) {
        for (int x = 0; x < block.size[0]; ++x) {
          const std::size_t from = block.index(x, y, z);
          if (block.inside[from] == 0) continue;
          const std::size_t to = index(x + kMargin, y + kMargin, z + kMargin);
          density_[to] = 1;
          weighted_[to] = static_cast<float>(block.value[from]) / 255;
        }
      }
    }
    for (int pass = 0; pass < kSmoothings; ++pass) {
      for (int axis = 0; axis < 3; ++axis) {
        smooth(axis, density_);
        smooth(axis, weighted_);
      }
    }
  }

  Vec3 last() const { return Vec3(size_[0] - 1, size_[1] - 1, size_[2] - 1); }
  /// REQUIRES: 0 <= p <= last().
  double density(const Vec3& p) const { return sample(density_, p); }
  double value(const Vec3& p) const { return sample(weighted_, p) / std::max(density(p), 1e-6); }
  bool empty_at(const Vec3& p) const {
    return density_[index(static_cast<int>(p.x()), static_cast<int>(p.y()), static_cast<int>(p.z()))] < 0.05f;
  }
  Vec3 outward(const Vec3& p) const {
    Vec3 gradient;
    for (int d = 0; d < 3; ++d) {
      const Vec3 step = Vec3::Unit(d);
      gradient[d] = density((p - step).cwiseMax(0)) - density((p + step).cwiseMin(last()));
    }
    return gradient.normalized();
  }

 private:
  std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(size_[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(size_[0]) +
           static_cast<std::size_t>(x);
  }

  /// Weights 1, 2, 1. The first and last planes are margin and stay 0.
  void smooth(int axis, std::vector<float>& field) const {
    const std::size_t stride = axis == 0 ? 1 : axis == 1 ? index(0, 1, 0) : index(0, 0, 1);
    std::vector<float> before = field;
    for (std::size_t i = stride; i + stride < field.size(); ++i) {
      field[i] = 0.25f * (before[i - stride] + 2 * before[i] + before[i + stride]);
    }
  }

  double sample(const std::vector<float>& field, const Vec3& p) const {
    std::array<int, 3> at{};
    std::array<double, 3> f{};
    for (int d = 0; d < 3; ++d) {
      const auto i = static_cast<std::size_t>(d);
      at[i] = std::min(static_cast<int>(p[d]), size_[i] - 2);
      f[i] = p[d] - at[i];
    }
    const std::size_t corner = index(at[0], at[1], at[2]), up = index(0, 1, 0), above = index(0, 0, 1);
    const auto along_x = [&](std::size_t i) {
      return (1 - f[0]) * static_cast<double>(field[i]) + f[0] * static_cast<double>(field[i + 1]);
    };
    const double low = (1 - f[1]) * along_x(corner) + f[1] * along_x(corner + up);
    const double high = (1 - f[1]) * along_x(corner + above) + f[1] * along_x(corner + up + above);
    return (1 - f[2]) * low + f[2] * high;
  }

  std::array<int, 3> size_{};
  std::vector<float> density_, weighted_;
};

/// A stretch of a ray; empty if first > last.
struct Stretch {
  double first = -std::numeric_limits<double>::infinity(), last = std::numeric_limits<double>::infinity();

  /// Keeps where sign * (origin + t * way) >= sign * bound along an axis.
  void clip(double origin, double way, double bound, double sign) {
    const double rate = sign * way, room = sign * (origin - bound);
    if (std::abs(rate) < 1e-12) {
      if (room < 0) first = std::numeric_limits<double>::infinity();
    } else if (rate > 0) {
      first = std::max(first, -room / rate);
    } else {
      last = std::min(last, -room / rate);
    }
  }
};

class Camera {
 public:
  Camera(const VoxelBlock& block, const CutView& view, const Vec3& last) : field_last_(last), width_(view.width) {
    const double azimuth = view.azimuth_deg * std::numbers::pi / 180;
    const double elevation = view.elevation_deg * std::numbers::pi / 180;
    toward_ =
        Vec3(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    right_ = Vec3(-std::sin(azimuth), std::cos(azimuth), 0);
    up_ = toward_.cross(right_);
    for (int d = 0; d < 3; ++d) {
      const auto& cut = view.cut[static_cast<std::size_t>(d)];
      if (cut) cut_[static_cast<std::size_t>(d)] = kMargin - 0.5 + *cut * block.size[static_cast<std::size_t>(d)];
    }
    frame(block);
  }

  int width() const { return width_; }
  int height() const { return height_; }
  const Vec3& toward() const { return toward_; }
  const Vec3& right() const { return right_; }
  const Vec3& up() const { return up_; }

  /// Where the ray of a place in the picture begins. The place is in the picture's units from the upper left.
  Vec3 origin(double column, double row) const {
    return (left_ + column * unit_) * right_ + (top_ - row * unit_) * up_;
  }
  Stretch within_block(const Vec3& origin) const {
    Stretch stretch;
    for (int d = 0; d < 3; ++d) {
      stretch.clip(origin[d], -toward_[d], 0, 1);
      stretch.clip(origin[d], -toward_[d], field_last_[d], -1);
    }
    return stretch;
  }
  std::optional<Stretch> cut_away(const Vec3& origin) const {
    std::optional<Stretch> stretch;
    for (int d = 0; d < 3; ++d) {
      const std::optional<double>& at = cut_[static_cast<std::size_t>(d)];
      if (!at) continue;
      if (!stretch) stretch.emplace();
      stretch->clip(origin[d], -toward_[d], *at, toward_[d] < 0 ? -1 : 1);
    }
    return stretch;
  }

 private:
  /// Lays the picture round the block's corners.
  void frame(const VoxelBlock& block) {
    Box3 box;
    for (int corner = 0; corner < 8; ++corner) {
      Vec3 p;
      for (int d = 0; d < 3; ++d) {
        p[d] = kMargin - 0.5 + (corner >> d & 1) * block.size[static_cast<std::size_t>(d)];
      }
      box.extend(Vec3(p.dot(right_), p.dot(up_), 0));
    }
    const double border = kBorder * box.sizes().x();
    unit_ = (box.sizes().x() + 2 * border) / width_;
    height_ = std::max(1, static_cast<int>(std::ceil((box.sizes().y() + 2 * border) / unit_)));
    left_ = box.min().x() - border;
    top_ = box.max().y() + border;
  }

  Vec3 field_last_, toward_, right_, up_;
  std::array<std::optional<double>, 3> cut_;
  int width_ = 0, height_ = 0;
  double unit_ = 1, left_ = 0, top_ = 0;
};

constexpr double kSurface = 0.5;

class Tracer {
 public:
  Tracer(const VoxelBlock& block, const Field& field, const Camera& camera)
      : block_(block),
        field_(field),
        camera_(camera),
        has_values_(block.palette.empty() &&
                    std::any_of(block.value.begin(), block.value.end(), [](std::uint8_t v) { return v != 0; })) {}

  /// White where there is nothing.
  Colour trace(double column, double row) const {
    const Vec3 origin = camera_.origin(column, row);
    const Stretch block = camera_.within_block(origin);
    const std::optional<Stretch> away = camera_.cut_away(origin);
    if (!away || away->first >= away->last) return surface(origin, block).value_or(Colour::Ones());
    const auto before = surface(origin, {block.first, std::min(block.last, away->first)});
    if (before) return *before;
    const Stretch behind = {std::max(block.first, away->last), block.last};
    if (behind.first < behind.last && behind.first > block.first) {
      const Vec3 start = at(origin, behind.first);
      if (field_.density(start) >= kSurface) return cut_face(start);
    }
    return surface(origin, behind).value_or(Colour::Ones());
  }

 private:
  Vec3 at(const Vec3& origin, double t) const {
    return (origin - t * camera_.toward()).cwiseMax(0).cwiseMin(field_.last());
  }

  /// The surface that a ray meets first, if it starts outside the part.
  std::optional<Colour> surface(const Vec3& origin, const Stretch& stretch) const {
    for (double t = stretch.first; t < stretch.last; t += kStep) {
      const Vec3 p = at(origin, t);
      if (field_.empty_at(p) || field_.density(p) < kSurface) continue;
      double out = t - kStep, in = t;
      for (int i = 0; i < kHalvings; ++i) {
        const double middle = (out + in) / 2;
        (field_.density(at(origin, middle)) < kSurface ? out : in) = middle;
      }
      return shaded(at(origin, in));
    }
    return std::nullopt;
  }

  Colour shaded(const Vec3& p) const {
    static const Colour kGrey(0.80, 0.82, 0.85);
    const Vec3 light = (camera_.toward() + 0.5 * camera_.up() - 0.6 * camera_.right()).normalized();
    const Vec3 normal = field_.outward(p);
    const double lit = std::max(0.0, normal.dot(light)), facing = std::max(0.0, normal.dot(camera_.toward()));
    const Colour body = has_values_ ? Colour(0.62 * kGrey + 0.38 * material_colour(field_.value(p))) : kGrey;
    return ((0.30 + 0.55 * lit + 0.15 * facing) * body).cwiseMin(1);
  }

  /// The colour of a place on the cut, which has a dark line along its edge.
  Colour cut_face(const Vec3& p) const {
    constexpr double kLine = 0.72;
    const Colour colour = !block_.palette.empty() ? printed_material(p)
                          : has_values_           ? material_colour(field_.value(p))
                                                  : kPlainMaterial;
    return field_.density(p) < kLine ? Colour(0.25 * colour) : colour;
  }

  /// The colour of the voxel inside that is nearest, just behind the cut.
  Colour printed_material(const Vec3& p) const {
    constexpr double kBehind = 0.3;  // Voxels.
    const Vec3 place = p - kBehind * camera_.toward() - Vec3::Constant(kMargin);
    double nearest = std::numeric_limits<double>::infinity();
    Colour colour = kPlainMaterial;
    for (int n = 0; n < 27; ++n) {
      const Vec3 voxel = (place + Vec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)).array().round();
      const double distance = (voxel - place).squaredNorm();
      if (distance >= nearest || (voxel.array() < 0).any()) continue;
      const int x = static_cast<int>(voxel.x()), y = static_cast<int>(voxel.y()), z = static_cast<int>(voxel.z());
      if (x >= block_.size[0] || y >= block_.size[1] || z >= block_.size[2]) continue;
      const std::size_t index = block_.index(x, y, z);
      if (block_.inside[index] == 0) continue;
      nearest = distance;
      colour = block_.palette[block_.value[index] - 1u];
    }
    return colour;
  }

  const VoxelBlock& block_;
  const Field& field_;
  const Camera& camera_;
  const bool has_values_;
};

}  // namespace

Picture draw_cut_view(const VoxelBlock& block, const CutView& view) {
  const Field field(block);
  const Camera camera(block, view, field.last());
  const Tracer tracer(block, field, camera);
  Picture picture{camera.width(), camera.height(), {}};
  for (int row = 0; row < picture.height; ++row) {
    for (int column = 0; column < picture.width; ++column) {
      Colour sum = Colour::Zero();
      for (int ray = 0; ray < kRaysPerSide * kRaysPerSide; ++ray) {
        const double x = (ray % kRaysPerSide + 0.5) / kRaysPerSide, y = (ray / kRaysPerSide + 0.5) / kRaysPerSide;
        sum += tracer.trace(column + x, row + y);
      }
      for (const double part : sum / (kRaysPerSide * kRaysPerSide)) {
        picture.rgb.push_back(to_byte(part));
      }
    }
  }
  return picture;
}

}  // namespace ccslice::cli
