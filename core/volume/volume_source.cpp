// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume/volume_source.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <type_traits>
#include <utility>

#include "core/volume/load_sample.h"

namespace ccslice {
namespace {

/// Points at a time.
constexpr std::uint32_t kBlock = 64;
/// Samples along i that a block of points may spread over, for them to be weighed once.
constexpr std::int64_t kMostColumns = 4 * kBlock;

/// One axis of the samples.
struct Axis {
  double last;              // Index of the last sample.
  std::int32_t most_first;  // Index of the lower sample of the last pair.
  std::int64_t stride;      // In samples, to the next one.
  std::int64_t up;          // To the upper one of a pair; 0 if there is just one.

  Axis(std::uint32_t samples, std::uint64_t step)
      : last(samples - 1.0),
        most_first(samples < 2 ? 0 : static_cast<std::int32_t>(samples - 2)),
        stride(static_cast<std::int64_t>(step)),
        up(samples < 2 ? 0 : stride) {}

  double clamped(double x) const { return std::min(std::max(x, 0.0), last); }
};

std::array<Axis, 3> axes_of(const VolumeShape& shape) {
  const auto& n = shape.samples;
  const std::uint64_t c = shape.channels;
  return {Axis(n[0], c), Axis(n[1], c * n[0]), Axis(n[2], c * n[0] * n[1])};
}

/// Indices of the points of a row.
struct IndexRow {
  Vec3 first, step;

  double at(std::uint32_t point, int axis) const { return first[axis] + point * step[axis]; }
};

/// How far the samples' cells reach beyond the outer ones' centres, in steps.
constexpr double kReach = 0.5 + 1e-6;

bool is_within(double x, const Axis& axis) { return x >= -kReach && x <= axis.last + kReach; }

double lerp(double a, double b, double w) { return a + w * (b - a); }

struct PointRange {
  std::uint32_t begin = 0, end = 0;
};

/// The points from `begin` to end - 1 that lie in the samples' cells. Indices are monotonic along a row, rounding
/// included, so that they follow each other, and their ends are found by halving.
PointRange points_within(const IndexRow& row, const std::array<Axis, 3>& axes, PointRange points) {
  const auto first_where = [&](const auto& holds) {
    std::uint32_t low = points.begin, high = points.end;
    while (low < high) {
      const std::uint32_t middle = low + (high - low) / 2;
      (holds(middle) ? high : low) = holds(middle) ? middle : middle + 1;
    }
    return low;
  };
  for (int a = 0; a < 3; ++a) {
    const Axis& axis = axes[static_cast<std::size_t>(a)];
    const bool rises = row.step[a] > 0;
    const auto has_begun = [&](std::uint32_t k) {
      return rises ? row.at(k, a) >= -kReach : row.at(k, a) <= axis.last + kReach;
    };
    const auto is_over = [&](std::uint32_t k) {
      return !(rises ? row.at(k, a) <= axis.last + kReach : row.at(k, a) >= -kReach);
    };
    points.begin = first_where(has_begun);
    points.end = first_where(is_over);
  }
  return points;
}

/// Gives values of the samples at points in their cells: NaN stands for the value outside.
class RowSampler {
 public:
  RowSampler(const Volume& volume, const VolumeReading& reading, bool has_nan)
      : axes_(axes_of(volume.shape())),
        bytes_(volume.bytes()),
        type_(volume.shape().type),
        channel_(reading.channel),
        nearest_(reading.nearest),
        has_nan_(has_nan) {}

  const std::array<Axis, 3>& axes() const { return axes_; }

  /// REQUIRES: at most kBlock values.
  void run(const IndexRow& row, std::uint32_t begin, std::span<double> values) const {
    with_sample_type(type_, [&](auto sample) {
      using Sample = decltype(sample);
      if (nearest_) {
        nearest<Sample>(row, begin, values);
      } else {
        linear<Sample>(row, begin, values);
      }
    });
  }

 private:
  /// Along an axis, by point: the lower one of two samples, and the weight of the upper one.
  struct Pairs {
    std::array<std::int32_t, kBlock> first;
    std::array<double, kBlock> weight;
  };

  template <typename Sample>
  void nearest(const IndexRow& row, std::uint32_t begin, std::span<double> values) const {
    for (std::size_t k = 0; k < values.size(); ++k) {
      std::int64_t index = 0;
      for (int a = 0; a < 3; ++a) {
        const Axis& axis = axes_[static_cast<std::size_t>(a)];
        const double x = axis.clamped(row.at(begin + static_cast<std::uint32_t>(k), a));
        index += static_cast<std::int64_t>(x + 0.5) * axis.stride;
      }
      values[k] = sample<Sample>(index);
    }
  }

  template <typename Sample>
  void linear(const IndexRow& row, std::uint32_t begin, std::span<double> values) const {
    std::array<Pairs, 3> pairs;
    const auto& [i, j, k] = pairs;
    set_pairs(row, begin, values.size(), 0, pairs[0]);
    if (row.step[1] == 0 && row.step[2] == 0 && !has_nan_) {
      const std::int64_t one = i.first[0], other = i.first[values.size() - 1];
      const std::int64_t least = std::min(one, other), columns = std::max(one, other) + 2 - least;
      if (columns <= kMostColumns) {
        for (int a = 1; a < 3; ++a) set_pairs(row, begin, 1, a, pairs[static_cast<std::size_t>(a)]);
        return linear_by_columns<Sample>(pairs, least, columns, values);
      }
    }
    for (int a = 1; a < 3; ++a) set_pairs(row, begin, values.size(), a, pairs[static_cast<std::size_t>(a)]);
    if (has_nan_) return linear_with_nan<Sample>(pairs, values);
    linear_by_corners<Sample>(pairs, values);
  }

  void set_pairs(const IndexRow& row, std::uint32_t begin, std::size_t count, int a, Pairs& pairs) const {
    const Axis& axis = axes_[static_cast<std::size_t>(a)];
    const double first_x = row.first[a], step = row.step[a], last = axis.last;
    const std::int32_t most = axis.most_first;
    const auto begins = static_cast<std::int32_t>(begin);
    for (std::int32_t p = 0; p < static_cast<std::int32_t>(count); ++p) {
      const double x = first_x + static_cast<double>(begins + p) * step;
      const double risen = x < 0 ? 0 : x;
      const double clamped = risen < last ? risen : last;
      const auto whole = static_cast<std::int32_t>(clamped);
      const std::int32_t first = whole < most ? whole : most;
      pairs.first[static_cast<std::size_t>(p)] = first;
      pairs.weight[static_cast<std::size_t>(p)] = clamped - first;
    }
  }

  template <typename Sample>
  double sample(std::int64_t index) const {
    return static_cast<double>(load_sample<Sample>(bytes_, static_cast<std::uint64_t>(channel_ + index)));
  }

  /// Along k, then j, of four samples of one i.
  template <typename Sample>
  double column(std::int64_t at, double j, double k) const {
    const std::int64_t dj = axes_[1].up, dk = axes_[2].up;
    return lerp(lerp(sample<Sample>(at), sample<Sample>(at + dk), k),
                lerp(sample<Sample>(at + dj), sample<Sample>(at + dj + dk), k), j);
  }

  /// Loads what lies around each point first, so that the rest goes in lanes.
  template <typename Sample>
  void linear_by_corners(const std::array<Pairs, 3>& pairs, std::span<double> values) const {
    using Raw = std::conditional_t<std::is_floating_point_v<Sample>, float, std::int32_t>;
    const auto& [i, j, k] = pairs;
    const std::int64_t di = axes_[0].up, dj = axes_[1].up, dk = axes_[2].up;
    const std::array<std::int64_t, 8> corners = {0, dk, dj, dj + dk, di, di + dk, di + dj, di + dj + dk};
    std::array<std::array<Raw, kBlock>, 8> raw;
    const std::size_t count = values.size();
    for (std::size_t p = 0; p < count; ++p) {
      const std::int64_t at =
          channel_ + i.first[p] * axes_[0].stride + j.first[p] * axes_[1].stride + k.first[p] * axes_[2].stride;
      for (std::size_t c = 0; c < 8; ++c) {
        raw[c][p] = load_sample<Sample>(bytes_, static_cast<std::uint64_t>(at + corners[c]));
      }
    }
    double* const to = values.data();
    for (std::size_t p = 0; p < count; ++p) {
      const auto corner = [&](std::size_t c) { return static_cast<double>(raw[c][p]); };
      const auto column = [&](std::size_t c) {
        return lerp(lerp(corner(c), corner(c + 1), k.weight[p]), lerp(corner(c + 2), corner(c + 3), k.weight[p]),
                    j.weight[p]);
      };
      to[p] = lerp(column(0), column(4), i.weight[p]);
    }
  }

  /// All points have the same j and k: what is between the same samples along i shares them.
  template <typename Sample>
  void linear_by_columns(const std::array<Pairs, 3>& pairs, std::int64_t least, std::int64_t count,
                         std::span<double> values) const {
    const auto& [i, j, k] = pairs;
    const std::int64_t row = j.first[0] * axes_[1].stride + k.first[0] * axes_[2].stride + least * axes_[0].stride;
    const std::int64_t there = axes_[0].up == 0 ? 1 : count;
    std::array<double, kMostColumns> columns;
    for (std::int64_t c = 0; c < there; ++c) {
      columns[static_cast<std::size_t>(c)] = column<Sample>(row + c * axes_[0].stride, j.weight[0], k.weight[0]);
    }
    if (there < count) columns[1] = columns[0];
    for (std::size_t p = 0; p < values.size(); ++p) {
      const auto c = static_cast<std::size_t>(i.first[p] - least);
      values[p] = lerp(columns[c], columns[c + 1], i.weight[p]);
    }
  }

  /// Samples of weight 0 don't count.
  template <typename Sample>
  void linear_with_nan(const std::array<Pairs, 3>& pairs, std::span<double> values) const {
    for (std::size_t p = 0; p < values.size(); ++p) {
      const auto value = [&](auto&& self, std::size_t axis, std::int64_t at) -> double {
        if (axis == 3) return sample<Sample>(at);
        const double w = pairs[axis].weight[p];
        const std::int64_t up = axes_[axis].up;
        if (w == 0) return self(self, axis + 1, at);
        if (w == 1) return self(self, axis + 1, at + up);
        return lerp(self(self, axis + 1, at), self(self, axis + 1, at + up), w);
      };
      std::int64_t at = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) at += pairs[axis].first[p] * axes_[axis].stride;
      values[p] = value(value, 0, at);
    }
  }

  std::array<Axis, 3> axes_;
  const std::byte* bytes_;
  VolumeSampleType type_;
  std::int64_t channel_;
  bool nearest_;
  bool has_nan_;
};

}  // namespace

std::array<double, 2> value_bounds(const Volume& volume, const VolumeReading& reading, const Box3& box) {
  const Volume::ChannelSamples& samples = volume.channels()[reading.channel];
  const double a = reading.slope * samples.min + reading.intercept, b = reading.slope * samples.max + reading.intercept;
  std::array<double, 2> bounds{std::min(a, b), std::max(a, b)};
  const std::array<Axis, 3> axes = axes_of(volume.shape());
  bool has_outside = samples.nan > 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 index = reading.index_of_mm * box.corner(static_cast<Box3::CornerType>(corner)) + reading.first_index;
    for (int axis = 0; axis < 3; ++axis) {
      has_outside = has_outside || !is_within(index[axis], axes[static_cast<std::size_t>(axis)]);
    }
  }
  if (!has_outside) return bounds;
  return {std::min(bounds[0], reading.outside_value), std::max(bounds[1], reading.outside_value)};
}

VolumeSource::VolumeSource(ChannelRange range, std::shared_ptr<const Volume> volume, const VolumeReading& reading)
    : range_(std::move(range)),
      volume_(std::move(volume)),
      reading_(reading),
      has_nan_(volume_->channels()[reading.channel].nan > 0) {}

void VolumeSource::sample_row(const SourceRow& row, std::span<const std::span<const float>>,
                              std::span<float> values) const {
  const Vec3& first = reading_.in_world ? row.world_first : row.mesh_first;
  const Vec3& step = reading_.in_world ? row.world_step : row.mesh_step;
  const IndexRow indices{reading_.index_of_mm * first + reading_.first_index, reading_.index_of_mm * step};
  const RowSampler sampler(*volume_, reading_, has_nan_);
  const PointRange all{row.begin, row.begin + row.count};
  const PointRange within = points_within(indices, sampler.axes(), all);
  const auto to_float = [&](double value) {
    return static_cast<float>(std::min(std::max(value, range_.min), range_.max));
  };
  const float outside = to_float(reading_.outside_value);
  std::fill(values.begin(), values.begin() + (within.begin - all.begin), outside);
  std::fill(values.begin() + (within.end - all.begin), values.end(), outside);
  std::array<double, kBlock> block;
  for (std::uint32_t begin = within.begin; begin < within.end; begin += kBlock) {
    const std::uint32_t count = std::min(kBlock, within.end - begin);
    sampler.run(indices, begin, {block.data(), count});
    float* const to = values.data() + (begin - all.begin);
    const double slope = reading_.slope, intercept = reading_.intercept, least = range_.min, most = range_.max;
    for (std::uint32_t p = 0; p < count; ++p) {
      const double value = slope * block[p] + intercept;
      const double risen = value < least ? least : value;
      to[p] = static_cast<float>(risen < most ? risen : most);
    }
    if (!has_nan_) continue;
    for (std::uint32_t p = 0; p < count; ++p) {
      if (std::isnan(block[p])) to[p] = outside;
    }
  }
}

bool VolumeSource::is_outside(const Vec3& world, const Vec3& mesh) const {
  const IndexRow point{reading_.index_of_mm * (reading_.in_world ? world : mesh) + reading_.first_index, Vec3::Zero()};
  const RowSampler sampler(*volume_, reading_, has_nan_);
  const PointRange within = points_within(point, sampler.axes(), {0, 1});
  if (within.begin == within.end) return true;
  double value = 0;
  sampler.run(point, 0, {&value, 1});
  return std::isnan(value);
}

Box3 VolumeSource::box() const {
  const Mat3 mm_of_index = reading_.index_of_mm.inverse();
  Box3 box;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 index;
    for (int axis = 0; axis < 3; ++axis) {
      const double last = volume_->shape().samples[static_cast<std::size_t>(axis)] - 0.5;
      index[axis] = (corner >> axis & 1) == 1 ? last : -0.5;
    }
    box.extend(mm_of_index * (index - reading_.first_index));
  }
  return box;
}

}  // namespace ccslice
