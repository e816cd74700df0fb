// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/cut_view.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

#include "client/cli/pictures/surface_raster.h"

namespace ccslice::cli {
namespace {

constexpr int kRaysPerSide = 3;   // kRaysPerSide^2 rays a place of the picture.
constexpr double kBorder = 0.02;  // Of the picture's width.
constexpr int kBandRows = 64;     // Of the picture, worked on together: what bounds the memory of a large one.
constexpr double kOutline = 1.2;  // Width of the dark line along a cut, in places of the picture.
constexpr double kSlack = 1e-6;   // Of the part's diagonal.

Box3 box_of(const client::Surface& surface) {
  Box3 box;
  for (const auto& point : surface.points_mm) box.extend(Vec3(point[0], point[1], point[2]));
  return box;
}

/// Rays of the picture, in mm: kRaysPerSide a place each way, numbered from the upper left.
class Camera {
 public:
  Camera(const Box3& part, const CutView& view) : width_(view.width) {
    const double azimuth = view.azimuth_deg * std::numbers::pi / 180;
    const double elevation = view.elevation_deg * std::numbers::pi / 180;
    toward_ =
        Vec3(std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
    right_ = Vec3(-std::sin(azimuth), std::cos(azimuth), 0);
    up_ = toward_.cross(right_);
    for (int d = 0; d < 3; ++d) {
      const auto& cut = view.cut[static_cast<std::size_t>(d)];
      if (cut) cut_[static_cast<std::size_t>(d)] = part.min()[d] + *cut * part.sizes()[d];
    }
    frame(part);
  }

  int width() const { return width_; }
  int height() const { return height_; }
  const Vec3& toward() const { return toward_; }
  const Vec3& right() const { return right_; }
  const Vec3& up() const { return up_; }

  /// Column and row of the ray through a point, and how far the point is behind the origin.
  Vec3 project(const Vec3& p) const {
    return {(p.dot(right_) - left_) / unit_ - 0.5, (top_ - p.dot(up_)) / unit_ - 0.5, -p.dot(toward_)};
  }
  Vec3 point(int column, int row, double depth) const { return origin(column, row) - depth * toward_; }

  /// What is cut away of a ray; empty if nothing is.
  Stretch cut_away(int column, int row) const {
    const Vec3 from = origin(column, row);
    Stretch stretch;
    bool cut = false;
    for (int d = 0; d < 3; ++d) {
      const std::optional<double>& at = cut_[static_cast<std::size_t>(d)];
      if (!at) continue;
      cut = true;
      stretch.clip(from[d], -toward_[d], *at, toward_[d] < 0 ? -1 : 1);
    }
    return cut ? stretch : Stretch{.first = 0, .last = 0};
  }

 private:
  Vec3 origin(int column, int row) const {
    return (left_ + (column + 0.5) * unit_) * right_ + (top_ - (row + 0.5) * unit_) * up_;
  }

  /// Lays the picture round the part's corners.
  void frame(const Box3& part) {
    Box3 box;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 p = part.corner(static_cast<Box3::CornerType>(corner));
      box.extend(Vec3(p.dot(right_), p.dot(up_), 0));
    }
    const double border = kBorder * box.sizes().x();
    const double place = (box.sizes().x() + 2 * border) / width_;
    height_ = std::max(1, static_cast<int>(std::ceil((box.sizes().y() + 2 * border) / place)));
    unit_ = place / kRaysPerSide;
    left_ = box.min().x() - border;
    top_ = box.max().y() + border;
  }

  Vec3 toward_, right_, up_;
  std::array<std::optional<double>, 3> cut_;
  int width_ = 0, height_ = 0;
  double unit_ = 1, left_ = 0, top_ = 0;  // mm. From ray to ray; the picture's upper left corner.
};

/// The colours of the block's voxels, at places between them.
class Colours {
 public:
  explicit Colours(const VoxelBlock& block) : block_(block) {}

  /// Nothing where no voxel inside is near.
  std::optional<Colour> at(const Vec3& p) const {
    const Vec3 place = (p - block_.origin_mm).cwiseQuotient(block_.pitch_mm) - Vec3::Constant(0.5);
    if (!block_.legend.range) return of_nearest(place);
    const std::optional<double> value = value_between(place);
    return value ? material_colour(*value) : of_nearest(place);
  }

 private:
  bool inside(const Vec3& voxel, std::size_t& index) const {
    if ((voxel.array() < 0).any()) return false;
    const int x = static_cast<int>(voxel.x()), y = static_cast<int>(voxel.y()), z = static_cast<int>(voxel.z());
    if (x >= block_.size[0] || y >= block_.size[1] || z >= block_.size[2]) return false;
    index = block_.index(x, y, z);
    return block_.inside[index] != 0;
  }

  /// Trilinear, of the voxels that are inside.
  std::optional<double> value_between(const Vec3& place) const {
    const Vec3 low = place.array().floor(), share = place - low;
    double sum = 0, weights = 0;
    std::size_t index = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 up(corner & 1, corner >> 1 & 1, corner >> 2);
      if (!inside(low + up, index)) continue;
      const double weight = (Vec3::Ones() - up - share).cwiseAbs().prod();
      sum += weight * block_.value[index] / 255;
      weights += weight;
    }
    return weights > 1e-3 ? std::optional(sum / weights) : std::nullopt;
  }

  std::optional<Colour> of_nearest(const Vec3& place) const {
    double nearest = std::numeric_limits<double>::infinity();
    std::optional<Colour> colour;
    for (int n = 0; n < 27; ++n) {
      const Vec3 voxel = (place + Vec3(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1)).array().round();
      const double distance = (voxel - place).squaredNorm();
      std::size_t index = 0;
      if (distance >= nearest || !inside(voxel, index)) continue;
      nearest = distance;
      colour = block_.colour(index);
    }
    return colour;
  }

  const VoxelBlock& block_;
};

std::vector<Vec3> projected(const client::Surface& surface, const Camera& camera) {
  std::vector<Vec3> points;
  points.reserve(surface.points_mm.size());
  for (const auto& point : surface.points_mm) points.push_back(camera.project(Vec3(point.data())));
  return points;
}

/// Some rows of rays, and what they meet.
class Band {
 public:
  Band(const SurfaceRaster& raster, const Camera& camera, int row_begin, int row_end)
      : columns_(camera.width() * kRaysPerSide), row_begin_(row_begin), row_end_(row_end) {
    for (int row = row_begin; row < row_end; ++row) {
      for (int column = 0; column < columns_; ++column) away_.push_back(camera.cut_away(column, row));
    }
    hits_ = raster.hits(columns_, row_begin, row_end, away_);
  }

  /// REQUIRES: the ray is one of the band's.
  const RayHits& hits(int column, int row) const { return hits_[index(column, row)]; }
  double end_of_cut(int column, int row) const { return away_[index(column, row)].last; }
  /// Whether the ray ends in the material on a cut.
  bool is_cut(int column, int row) const {
    if (column < 0 || column >= columns_ || row < row_begin_ || row >= row_end_) return false;
    const RayHits& ray = hits(column, row);
    return !ray.before && ray.winding != 0;
  }
  bool is_near_end_of_cut(int column, int row) const {
    static const std::vector<std::array<int, 2>> kRound = places_round(kOutline * kRaysPerSide);
    return std::ranges::any_of(kRound, [&](const auto& by) { return !is_cut(column + by[0], row + by[1]); });
  }

 private:
  static std::vector<std::array<int, 2>> places_round(double radius) {
    std::vector<std::array<int, 2>> places;
    for (int turn = 0; turn < 16; ++turn) {
      const double angle = turn * std::numbers::pi / 8, distance = turn % 2 == 0 ? radius : radius / 2;
      places.push_back({static_cast<int>(std::lround(distance * std::cos(angle))),
                        static_cast<int>(std::lround(distance * std::sin(angle)))});
    }
    return places;
  }

  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row - row_begin_) * static_cast<std::size_t>(columns_) +
           static_cast<std::size_t>(column);
  }

  int columns_, row_begin_, row_end_;
  std::vector<Stretch> away_;
  std::vector<RayHits> hits_;
};

/// A channel at the surface: from 0 to 1 in its legend's range, vertex by vertex. Empty if that is not what the block
/// shows.
std::vector<float> surface_values(const client::Surface& surface, const Legend& legend) {
  const auto& channels = surface.header.channels();
  const auto channel = std::ranges::find(channels, legend.title, &v1::Channel::name);
  std::vector<float> values;
  if (!legend.range || channel == channels.end()) return values;
  const auto [low, high] = *legend.range;
  const double scale = high > low ? 1 / (high - low) : 0;
  const auto count = static_cast<std::size_t>(channels.size());
  for (auto i = static_cast<std::size_t>(channel - channels.begin()); i < surface.channel_values.size(); i += count) {
    values.push_back(static_cast<float>(scale * (static_cast<double>(surface.channel_values[i]) - low)));
  }
  return values;
}

class Painter {
 public:
  Painter(const client::Surface& surface, const VoxelBlock& block, const Camera& camera, const CutView& view,
          double slack)
      : camera_(camera),
        surface_(surface),
        values_(surface_values(surface, block.legend)),
        raster_(projected(surface, camera), surface.triangles, slack),
        normals_(surface.points_mm, surface.triangles, view.crease_deg),
        colours_(block),
        tinted_(!block.legend.empty()) {}

  void paint(int row_begin, int row_end, Picture& picture) const {
    constexpr int kMargin = kRaysPerSide * 2;  // For outlines.
    const Band band(raster_, camera_, kRaysPerSide * row_begin - kMargin, kRaysPerSide * row_end + kMargin);
    for (int row = row_begin; row < row_end; ++row) {
      for (int column = 0; column < picture.width; ++column) {
        Colour sum = Colour::Zero();
        for (int ray = 0; ray < kRaysPerSide * kRaysPerSide; ++ray) {
          sum += colour(band, kRaysPerSide * column + ray % kRaysPerSide, kRaysPerSide * row + ray / kRaysPerSide);
        }
        set_colour(column, row, sum / (kRaysPerSide * kRaysPerSide), picture);
      }
    }
  }

 private:
  /// White where there is nothing.
  Colour colour(const Band& band, int column, int row) const {
    if (band.is_cut(column, row)) return cut_face(band, column, row);
    const RayHits& ray = band.hits(column, row);
    const RayHit& hit = ray.before ? ray.before : ray.behind;
    return hit ? shaded(hit, camera_.point(column, row, hit.depth)) : Colour(Colour::Ones());
  }

  Colour shaded(const RayHit& hit, const Vec3& p) const {
    static const Colour kGrey(0.80, 0.82, 0.85);
    constexpr double kTint = 0.38;
    const Vec3 light = (camera_.toward() + 0.5 * camera_.up() - 0.6 * camera_.right()).normalized();
    const Vec3 normal = normals_.at(hit.triangle, hit.weights);
    const double lit = std::max(0.0, normal.dot(light)), facing = std::max(0.0, normal.dot(camera_.toward()));
    const std::optional<Colour> tint = tinted_ ? surface_colour(hit, p) : std::nullopt;
    const Colour body = tint ? Colour((1 - kTint) * kGrey + kTint * *tint) : kGrey;
    return ((0.30 + 0.55 * lit + 0.15 * facing) * body).cwiseMin(1);
  }

  std::optional<Colour> surface_colour(const RayHit& hit, const Vec3& p) const {
    if (values_.empty()) return colours_.at(p);
    double value = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      value += static_cast<double>(hit.weights[k] * values_[surface_.triangles[hit.triangle][k]]);
    }
    return material_colour(value);
  }

  /// The colour of a place on the cut, which has a dark line along its edge.
  Colour cut_face(const Band& band, int column, int row) const {
    const Vec3 p = camera_.point(column, row, band.end_of_cut(column, row));
    const Colour colour = colours_.at(p).value_or(kPlainMaterial);
    return band.is_near_end_of_cut(column, row) ? Colour(0.25 * colour) : colour;
  }

  const Camera& camera_;
  const client::Surface& surface_;
  const std::vector<float> values_;
  const SurfaceRaster raster_;
  const SurfaceNormals normals_;
  const Colours colours_;
  const bool tinted_;
};

}  // namespace

Picture draw_cut_view(const client::Surface& surface, const VoxelBlock& block, const CutView& view) {
  const Box3 part = box_of(surface);
  const Camera camera(part, view);
  const Painter painter(surface, block, camera, view, kSlack * part.diagonal().norm());
  Picture picture = blank_picture(camera.width(), camera.height());
  for (int row = 0; row < picture.height; row += kBandRows) {
    painter.paint(row, std::min(row + kBandRows, picture.height), picture);
  }
  return picture;
}

}  // namespace ccslice::cli
