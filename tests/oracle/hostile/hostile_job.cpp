// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_job.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>
#include <vector>

#include "core/limit/limit_evaluator.h"
#include "core/limit/support.h"
#include "tests/oracle/hostile/hostile_pictures.h"
#include "tests/oracle/hostile/hostile_printing.h"
#include "tests/oracle/hostile/hostile_random.h"
#include "tests/oracle/hostile/hostile_strict.h"
#include "tests/oracle/hostile/hostile_text.h"

namespace ccslice::oracle {
namespace {

constexpr double kLeastVoxels = 10'000;
constexpr double kInterpolatedShare = 10;  // Times the voxels of the layers that are drawn to be inverted.
constexpr double kSlownessOfFolds = 200;
constexpr double kShareOfZooms = 0.5;  // Of the jobs with several cell regions.
constexpr double kMostGridVoxels = 3e7, kMostVoxelsAlong = 600;
constexpr std::uint32_t kMostLayers = 40;  // In a job: two slabs and parts of others.
constexpr double kSteepestPitch = 7;       // Times the mean one, or as much below.
constexpr std::uint64_t kPlaneStream = 9, kInterfaceStream = 10, kPictureStream = 11, kStrictStream = 12,
                        kZoomStream = 14;  // Of random numbers.

/// Of the limit cells, those that may fold.
double folding_share(const LimitSolid& solid) {
  const SolidSummary& summary = solid.summary();
  return static_cast<double>(summary.folding_cells + summary.undecided_cells) /
         static_cast<double>(summary.limit_cells);
}

/// Corners of cells that lie on interfaces of cell regions.
std::vector<CellParam> interface_corners(HostileRandom& random, const LimitSolid& solid) {
  std::vector<CellParam> corners;
  for (const LimitCellId cell : solid.cells()) {
    for (int side = 0; side < 6; ++side) {
      if ((solid.interface_sides(cell) >> side & 1) == 0) continue;
      Vec3 corner(random.pick(0, 1), random.pick(0, 1), random.pick(0, 1));
      corner[side / 2] = side % 2;
      corners.push_back({cell, corner});
    }
  }
  return corners;
}

class JobMaker {
 public:
  JobMaker(std::uint64_t seed, const LimitSolid& solid, double most_voxels)
      : random_(seed, 3),
        interface_random_(seed, kZoomStream),
        solid_(solid),
        // Where a solid folds all cells that may hold a voxel are searched, which takes long.
        voxels_(random_.log_between(std::min(kLeastVoxels, most_voxels), most_voxels) /
                (1 + kSlownessOfFolds * folding_share(solid))),
        interpolated_(folding_share(solid) > 0 ? 2 * voxels_ : kInterpolatedShare * voxels_) {
    result_.most_inverted = kInterpolatedShare * most_voxels / (1 + kSlownessOfFolds * folding_share(solid));
  }

  HostileJob make() {
    choose_placement();
    choose_grid();
    choose_tolerances();
    choose_planes();
    choose_range();
    if (random_.chance(0.3)) choose_region();
    return std::move(result_);
  }

 private:
  void say(const std::string& text) { result_.description += (result_.description.empty() ? "" : ", ") + text; }

  void choose_placement() {
    Placement& placement = result_.job.placement;
    constexpr std::array weights = {0.4, 0.25, 0.08, 0.07, 0.1, 0.1};
    constexpr std::array names = {"identity", "rotated", "turned", "mirrored", "sheared", "scaled"};
    const std::size_t kind = random_.weighted(weights);
    say(names[kind]);
    Mat3 turned;
    turned << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    const Vec3 scales(random_.log_between(0.2, 5), random_.log_between(0.2, 5), random_.log_between(0.2, 5));
    Mat3 shear = Mat3::Identity();
    shear(0, 1) = random_.between(-1.5, 1.5);
    shear(1, 2) = random_.between(-1.5, 1.5);
    const Mat3 rotation = random_.chance(0.5) ? random_.rotation() : Mat3::Identity();
    if (kind == 1) placement.linear() = random_.rotation();
    if (kind == 2) placement.linear() = turned;
    if (kind == 3) placement.linear() = rotation * Vec3(-1, 1, 1).asDiagonal();
    if (kind == 4) placement.linear() = rotation * shear;
    if (kind == 5) placement.linear() = rotation * Mat3(scales.asDiagonal()) * rotation.transpose();
    if (!random_.chance(0.2)) return;
    const double far = random_.log_between(0.1, 1e4);
    placement.translation() = far * random_.in_cube(1);
    say("moved by " + number(far));
  }

  /// Of a grid of so many voxels, each axis by itself.
  Vec3 pitch_of(const Vec3& sizes, double voxels, bool window) {
    const double mean_mm = std::cbrt(sizes.prod() / voxels);
    const bool even = random_.chance(0.3);
    Vec3 pitch;
    for (int axis = 0; axis < 3; ++axis) {
      pitch[axis] = even ? mean_mm : mean_mm * random_.log_between(1 / kSteepestPitch, kSteepestPitch);
      const double most = sizes[axis] / random_.between(1.2, 6);         // A few voxels at least,
      const double least = window ? 0 : sizes[axis] / kMostVoxelsAlong;  // and not too many.
      pitch[axis] = std::max(std::min(pitch[axis], most), least);
    }
    const double across = sizes.x() / pitch.x() * sizes.y() / pitch.y(), most_across = 0.8 * voxels_;
    if (!window && across > most_across) pitch.head<2>() *= std::sqrt(across / most_across);
    return pitch.cwiseMax(1e-4).cwiseMin(1e3);
  }

  /// All of the part, or a window of a finer grid.
  void choose_grid() {
    const Box3 box = bounding_box(solid_, result_.job.placement);
    const bool window = random_.chance(0.15);
    const double voxels = random_.log_between(500, kMostGridVoxels) * (window ? random_.log_between(1, 1e4) : 1);
    const Vec3 pitch = pitch_of(box.sizes(), voxels, window);
    GridRequest request;
    request.pitch = {pitch.x(), pitch.y(), pitch.z()};
    if (may_zoom() && interface_random_.chance(kShareOfZooms)) {
      zoom_to_interface(request);
    } else if (window) {
      place_window(box, pitch, request);
    } else if (random_.chance(0.2)) {
      request.origin_mm = box.min() - pitch.cwiseProduct(Vec3(random_.unit(), random_.unit(), random_.unit()));
    }
    result_.job.grid = plan_grid(solid_, result_.job.placement, request);
    const GridExtent& extent = result_.job.grid.extent;
    const VoxelPitch& used = result_.job.grid.pitch;
    say("pitch " + number(used.x_mm) + "," + number(used.y_mm) + "," + number(used.z_mm));
    say(std::to_string(extent.columns) + "x" + std::to_string(extent.rows) + "x" + std::to_string(extent.layers) +
        (window ? " in a window" : ""));
  }

  /// Fine windows of parts that fold take minutes.
  bool may_zoom() const { return solid_.has_several_regions() && folding_share(solid_) == 0; }

  /// A fine window round a place on an interface, where voxels beside it are many.
  void zoom_to_interface(GridRequest& request) {
    const std::vector<CellParam> corners = interface_corners(interface_random_, solid_);
    if (corners.empty()) return;
    LimitEvaluator evaluator(solid_);
    const CellParam& at = corners[interface_random_.bits() % corners.size()];
    const Mat3 jacobian = result_.job.placement.linear() * evaluator.sample(at).jacobian;
    const Vec3 place = result_.job.placement * evaluator.geo(at);
    const double size_mm = jacobian.colwise().norm().maxCoeff() * interface_random_.log_between(0.2, 2);
    constexpr std::array counts = {48u, 40u, 20u};
    Vec3 pitch;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      pitch[axis] = std::clamp(size_mm / counts[static_cast<std::size_t>(axis)] * interface_random_.log_between(0.5, 2),
                               1e-4, 1e3);
    }
    request.pitch = {pitch.x(), pitch.y(), pitch.z()};
    request.extent = GridExtent{counts[0], counts[1], counts[2]};
    request.origin_mm = place - pitch.cwiseProduct(Vec3(counts[0], counts[1], counts[2])) / 2;
    say("zoomed to an interface");
    zoomed_ = true;
  }

  void place_window(const Box3& box, const Vec3& pitch, GridRequest& request) {
    const double side = std::cbrt(voxels_);
    std::array<std::uint32_t, 3> counts;
    Vec3 origin;
    for (int axis = 0; axis < 3; ++axis) {
      const double all = box.sizes()[axis] / pitch[axis];
      const double count = std::floor(std::clamp(side * random_.log_between(0.5, 2), 1.0, std::max(1.0, all)));
      counts[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(count);
      origin[axis] = box.min()[axis] + random_.unit() * (all - count) * pitch[axis];
    }
    request.origin_mm = origin;
    request.extent = GridExtent{counts[0], counts[1], counts[2]};
  }

  void choose_tolerances() {
    constexpr std::array weights = {0.25, 0.2, 0.1, 0.45};
    std::optional<double>& tolerance = result_.job.channel_tolerance;
    switch (random_.weighted(weights)) {
      case 0: break;
      case 1: tolerance = 1.0 / 1024; break;
      case 2: tolerance = 1.0 / 65536; break;
      default: tolerance = random_.log_between(1e-5, 1);
    }
    // Large pieces miss their faces most.
    if (zoomed_) tolerance = interface_random_.log_between(1e-3, 0.3);
    say("tolerance " + (tolerance ? number(*tolerance) : "default"));
    const double size_mm = result_.job.grid.part_box.sizes().maxCoeff();
    double& contours_mm = result_.job.contour_tolerance_mm;
    if (random_.chance(0.3)) contours_mm = random_.log_between(1e-5, 1e-2);
    if (random_.chance(0.8)) contours_mm = std::clamp(contours_mm, 1e-5, std::max(1e-5, size_mm / 200));
    if (contours_mm != 1e-3) say("contours " + number(contours_mm));
  }

  void choose_planes() {
    std::string names;
    std::vector<std::uint32_t> channels;
    const double share = random_.chance(0.5) ? 1 : 0.5;
    for (std::uint32_t c = 0; c < solid_.channel_count(); ++c) {
      if (random_.chance(share)) channels.push_back(c);
    }
    if (channels.empty()) channels.push_back(static_cast<std::uint32_t>(random_.bits() % solid_.channel_count()));
    if (channels.size() > 1 && random_.chance(0.25)) {
      PlaneSpec plane;
      plane.content = PlaneContent::kChannels;
      for (const std::uint32_t channel : channels) plane.channels.push_back(solid_.summary().channels[channel].name);
      plane.sample_type = SampleType::kFloat32;
      add_plane(plane);
      names += " together";
      for (const std::uint32_t channel : channels) names += " " + solid_.summary().channels[channel].name;
    } else {
      for (const std::uint32_t channel : channels) names += " " + add_channel(channel);
    }
    if (random_.chance(0.08)) names += " " + add_channel(channels.front());
    add_plane({});  // The occupancy.
    say("planes" + names);
  }

  void add_plane(PlaneSpec plane) {
    plane.encoding = Encoding::kRaw;
    result_.job.planes.push_back(std::move(plane));
  }

  std::string add_channel(std::uint32_t channel) {
    constexpr std::array types = {SampleType::kFloat32, SampleType::kUint8, SampleType::kUint16};
    constexpr std::array names = {":f32", ":u8", ":u16"};
    constexpr std::array weights = {0.7, 0.15, 0.15};
    const std::size_t type = random_.weighted(weights);
    const ChannelRange& range = solid_.summary().channels[channel];
    PlaneSpec plane;
    plane.content = PlaneContent::kChannel;
    plane.channel = range.name;
    plane.sample_type = types[type];
    std::string name = range.name + names[type];
    const double span = range.max - range.min;
    if (type > 0 && span > 0 && random_.chance(0.3)) {
      const double low = range.min + span * random_.between(-0.5, 0.8);
      plane.range = ValueRange{low, low + span * random_.log_between(0.01, 2)};
      name += "[" + number(plane.range->min) + "," + number(plane.range->max) + "]";
    }
    add_plane(plane);
    return name;
  }

  void choose_range() {
    const GridExtent& extent = result_.job.grid.extent;
    const double layer = static_cast<double>(extent.columns) * extent.rows;
    const auto most = static_cast<std::uint32_t>(std::clamp(interpolated_ / layer, 1.0, double{kMostLayers}));
    const std::uint32_t count = std::min(extent.layers, most), last = extent.layers - count;
    constexpr std::array weights = {0.25, 0.25, 0.5};
    const std::size_t place = random_.weighted(weights);
    result_.layer_count = count;
    result_.first_layer = place == 0 ? 0 : place == 1 ? last : static_cast<std::uint32_t>(random_.bits() % (last + 1));
    say("layers " + std::to_string(result_.first_layer) + ".." + std::to_string(result_.first_layer + count - 1));
    choose_inverted(static_cast<std::uint32_t>(std::clamp(voxels_ / layer, 1.0, static_cast<double>(count))));
  }

  void choose_inverted(std::uint32_t wanted) {
    std::uint32_t left = result_.layer_count;
    for (std::uint32_t k = 0; k < result_.layer_count; ++k, --left) {
      if (random_.bits() % left >= wanted) continue;
      result_.inverted_layers.push_back(result_.first_layer + k);
      --wanted;
    }
  }

  /// Of `count`, some: where they begin and how many.
  std::pair<std::uint32_t, std::uint32_t> part_of(std::uint32_t count) {
    const auto begin = static_cast<std::uint32_t>(random_.bits() % count);
    return {begin, 1 + static_cast<std::uint32_t>(random_.bits() % (count - begin))};
  }

  void choose_region() {
    const GridExtent& extent = result_.job.grid.extent;
    VoxelBox region;
    std::tie(region.first_column, region.extent.columns) = part_of(extent.columns);
    std::tie(region.first_row, region.extent.rows) = part_of(extent.rows);
    std::tie(region.first_layer, region.extent.layers) = part_of(result_.layer_count);
    region.first_layer += result_.first_layer;
    result_.region = region;
    say("region " + std::to_string(region.first_column) + "+" + std::to_string(region.extent.columns) + " x " +
        std::to_string(region.first_row) + "+" + std::to_string(region.extent.rows) + " x " +
        std::to_string(region.first_layer) + "+" + std::to_string(region.extent.layers));
  }

  HostileRandom random_, interface_random_;
  const LimitSolid& solid_;
  const double voxels_, interpolated_;
  bool zoomed_ = false;
  HostileJob result_;
};

/// Moves the grid by half a voxel at most, so that a voxel's centre lies on an interface of cell regions, in a corner
/// of a cell: on plane interfaces whole rows or layers of voxels do.
void put_on_interface(HostileRandom& random, const LimitSolid& solid, HostileJob& job) {
  const std::vector<CellParam> corners = interface_corners(random, solid);
  if (corners.empty()) return;  // Regions of separate parts.
  const Vec3 place = job.job.placement * LimitEvaluator(solid).geo(corners[random.bits() % corners.size()]);
  Grid& grid = job.job.grid;
  const Vec3 pitch(grid.pitch.x_mm, grid.pitch.y_mm, grid.pitch.z_mm);
  for (int axis = 0; axis < 3; ++axis) {
    const double index = std::floor((place[axis] - grid.origin_mm[axis]) / pitch[axis]);
    grid.origin_mm[axis] = place[axis] - (index + 0.5) * pitch[axis];
  }
  job.description += ", a voxel on an interface";
}

}  // namespace

HostileJob make_hostile_job(std::uint64_t seed, const LimitSolid& solid, double most_voxels, bool only_channels) {
  HostileJob job = JobMaker(seed, solid, most_voxels).make();
  job.asked = job.job;
  if (only_channels) return job;
  HostileRandom random(seed, kPlaneStream), interface_random(seed, kInterfaceStream);
  HostileRandom picture_random(seed, kPictureStream), strict_random(seed, kStrictStream);
  if (solid.has_several_regions() && interface_random.chance(0.3)) put_on_interface(interface_random, solid, job);
  job.description += add_hostile_planes(random, solid.summary(), job.job);
  if (job.job.printing) draw_strict_maps(strict_random, solid.summary(), *job.job.printing, job.description);
  job.asked = draw_hostile_pictures(picture_random, solid.summary(), job.job, job.description);
  job.job = without_pictures(job.asked);
  return job;
}

}  // namespace ccslice::oracle
