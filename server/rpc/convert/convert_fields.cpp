// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/convert_fields.h"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/channel/channel_table.h"
#include "core/distance/distance_source.h"
#include "core/formula/formula.h"
#include "core/formula/formula_error.h"
#include "core/formula/formula_source.h"
#include "core/formula/words.h"
#include "core/volume/volume_source.h"
#include "server/service/base/service_error.h"
#include "server/service/meshes/mesh_id.h"

namespace ccslice::server {
namespace {

constexpr std::size_t kMaxFieldNameBytes = 256;

[[noreturn]] void refuse(ErrorCode code, const std::string& field, const std::string& what) {
  throw Error(code, field + ": " + what, field);
}

void require_count(const Fields& messages, const std::string& field) {
  if (messages.size() <= kMaxFields) return;
  refuse(ErrorCode::kFieldInvalid, field,
         std::to_string(messages.size()) + " are more than the " + std::to_string(kMaxFields) +
             " of a job; put formulas that are read once into those that read them");
}

void require_name(const std::string& name, const std::string& path) {
  const std::string field = path + ".name";
  if (name.empty()) refuse(ErrorCode::kFieldInvalid, field, "empty; give the field a name");
  if (name.size() <= kMaxFieldNameBytes) return;
  refuse(ErrorCode::kFieldInvalid, field,
         "longer than " + std::to_string(kMaxFieldNameBytes) + " bytes; give it a shorter one");
}

bool is_of_world(v1::FieldFrame frame, const std::string& path) {
  switch (frame) {
    case v1::FIELD_FRAME_UNSPECIFIED:
    case v1::FIELD_FRAME_PART: return false;
    case v1::FIELD_FRAME_WORLD: return true;
    default: break;
  }
  refuse(ErrorCode::kEnumValueUnknown, path + ".frame",
         std::to_string(static_cast<int>(frame)) + " isn't a frame that this server knows; ask for PART or WORLD");
}

/// Whether the formula of a field can be read once it may read itself and those behind it.
bool reads_ahead(const Fields& all, int field, std::vector<std::string> names) {
  for (int i = field; i < all.size(); ++i) names.push_back(all[i].name());
  try {
    (void)Formula::parse(all[field].formula(), names);
    return true;
  } catch (const FormulaError&) {
    return false;
  }
}

Formula parse(const Fields& all, int field, const std::vector<ChannelRange>& channels, const std::string& path) {
  const v1::Field& message = all[field];
  std::vector<std::string> names;
  for (const ChannelRange& channel : channels) names.push_back(channel.name);
  try {
    return Formula::parse(message.formula(), names);
  } catch (const FormulaError& error) {
    const std::string order = reads_ahead(all, field, names) ? "; a field reads those before it only" : "";
    refuse(ErrorCode::kFieldInvalid, path + ".formula", double_quoted(message.name()) + ", " + error.what() + order);
  }
}

bool is_float(double value) { return std::abs(value) <= std::numeric_limits<float>::max(); }

/// What floats a channel's values may be rounded to.
Interval rounded(const ChannelRange& range) {
  constexpr float kEnd = std::numeric_limits<float>::infinity();
  return {std::nextafter(static_cast<float>(range.min), -kEnd), std::nextafter(static_cast<float>(range.max), kEnd)};
}

ChannelRange given_range(const v1::Field& message, const std::string& path) {
  const double low = message.range().min(), high = message.range().max();
  if (low < high && is_float(low) && is_float(high)) return {message.name(), low, high};
  refuse(ErrorCode::kValueRangeInvalid, path + ".range",
         double_quoted(message.name()) + ", " + number_text(low) + " to " + number_text(high) +
             " isn't a range of floats; give min below max");
}

/// All values that the formula may have in the box, or what the client says.
ChannelRange range_of(const v1::Field& message, const Formula& formula, const std::vector<ChannelRange>& channels,
                      const Box3& box, const std::string& path) {
  if (message.has_range()) return given_range(message, path);
  std::vector<Interval> inputs;
  for (const std::string& name : formula.inputs()) {
    const auto channel = std::ranges::find(channels, name, &ChannelRange::name);
    inputs.push_back(rounded(*channel));
  }
  const Interval bounds = formula.bounds(box, inputs);
  if (is_float(bounds.low) && is_float(bounds.high)) return {message.name(), bounds.low, bounds.high};
  refuse(ErrorCode::kFieldInvalid, path + ".formula",
         double_quoted(message.name()) +
             ": no bounds of its values are found, as where a divisor may be 0 or a product too large; bound them with "
             "clamp(..., low, high), or give the field a range");
}

void require_finite(std::initializer_list<double> numbers, const std::string& field) {
  if (std::ranges::all_of(numbers, is_float)) return;
  refuse(ErrorCode::kFieldInvalid, field, "isn't finite, or too large for a float; correct it");
}

/// Sets where samples lie, from the rows of VolumeSamples.index_to_mm.
void place_samples(const v1::VolumeSamples& message, const std::string& path, VolumeReading& reading) {
  const std::string field = path + ".index_to_mm";
  if (message.index_to_mm_size() != 12) {
    refuse(ErrorCode::kFieldInvalid, field,
           std::to_string(message.index_to_mm_size()) + " numbers; give 3 rows of 4, or none");
  }
  Mat3 mm_of_index;
  Vec3 first_mm;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) mm_of_index(row, column) = message.index_to_mm(4 * row + column);
    first_mm[row] = message.index_to_mm(4 * row + 3);
  }
  if (!mm_of_index.allFinite() || !first_mm.allFinite())
    refuse(ErrorCode::kFieldInvalid, field, "isn't finite; correct it");
  const double volume = mm_of_index.col(0).norm() * mm_of_index.col(1).norm() * mm_of_index.col(2).norm();
  constexpr double kFlat = 1e-9;  // Shares of the volume of a box with the same edges.
  reading.index_of_mm = mm_of_index.inverse();
  reading.first_index = -(reading.index_of_mm * first_mm);
  const bool is_flat = !(std::abs(mm_of_index.determinant()) > kFlat * volume);
  if (!is_flat && reading.index_of_mm.allFinite() && reading.first_index.allFinite()) return;
  refuse(ErrorCode::kFieldInvalid, field,
         "the samples lie in a plane or a line, or nearly so; give three directions with an angle between them");
}

/// Has the samples' cells fill the box.
void fill_box(const Volume& volume, const Box3& box, VolumeReading& reading) {
  Vec3 samples;
  for (int axis = 0; axis < 3; ++axis) samples[axis] = volume.shape().samples[static_cast<std::size_t>(axis)];
  const Vec3 per_mm = samples.cwiseQuotient(box.sizes());
  reading.index_of_mm = per_mm.asDiagonal();
  reading.first_index = -(per_mm.cwiseProduct(box.min()) + Vec3::Constant(0.5));
}

/// `box`: of the part, in the field's frame.
VolumeReading to_reading(const v1::VolumeSamples& message, const Volume& volume, const Box3& box,
                         const std::string& path) {
  VolumeReading reading;
  reading.channel = message.channel();
  if (reading.channel >= volume.shape().channels) {
    refuse(ErrorCode::kFieldInvalid, path + ".channel",
           std::to_string(reading.channel) + ", and the volume's last channel is " +
               std::to_string(volume.shape().channels - 1) + "; they are counted from 0");
  }
  switch (message.interpolation()) {
    case v1::VOLUME_INTERPOLATION_UNSPECIFIED:
    case v1::VOLUME_INTERPOLATION_LINEAR: break;
    case v1::VOLUME_INTERPOLATION_NEAREST: reading.nearest = true; break;
    default:
      refuse(ErrorCode::kEnumValueUnknown, path + ".interpolation",
             std::to_string(static_cast<int>(message.interpolation())) +
                 " isn't one that this server knows; ask for LINEAR or NEAREST");
  }
  if (message.slope() != 0) reading.slope = message.slope();
  reading.intercept = message.intercept();
  reading.outside_value = message.outside_value();
  const Volume::ChannelSamples& samples = volume.channels()[reading.channel];
  require_finite(
      {reading.slope, reading.slope * samples.min + reading.intercept, reading.slope * samples.max + reading.intercept},
      path + ".slope");
  require_finite({reading.intercept}, path + ".intercept");
  require_finite({reading.outside_value}, path + ".outside_value");
  message.index_to_mm().empty() ? fill_box(volume, box, reading) : place_samples(message, path, reading);
  return reading;
}

std::shared_ptr<const VolumeSource> to_volume_source(const v1::Field& message, const Volumes& volumes, bool is_of_world,
                                                     const Box3& box, const std::string& path) {
  const auto named = volumes.find(message.volume().volume_id());
  if (named == volumes.end()) {
    const std::string field = path + ".volume.volume_id";
    throw ServiceError(ServiceErrorCode::kMeshIdInvalid,
                       field + ": the id is a mesh's; give that of a volume, or let a formula read the mesh's channel",
                       field);
  }
  const std::shared_ptr<const Volume>& volume = named->second;
  VolumeReading reading = to_reading(message.volume(), *volume, box, path + ".volume");
  reading.in_world = is_of_world;
  if (message.has_range()) return std::make_shared<VolumeSource>(given_range(message, path), volume, reading);
  const auto [low, high] = value_bounds(*volume, reading, box);
  return std::make_shared<VolumeSource>(ChannelRange{message.name(), low, high}, volume, reading);
}

/// The distances that fields of a part read. Each takes memory and time, so formulas share them.
class DistancesOfJob {
 public:
  DistancesOfJob(const std::shared_ptr<const LimitSolid>& solid, const Mat3& placed) : solid_(solid), placed_(placed) {}

  /// The distance as a channel of its own.
  std::shared_ptr<const ChannelSource> made(const FormulaDistance& distance, ChannelRange range,
                                            const std::string& path) {
    const std::string name = double_quoted(range.name);
    if (std::ranges::find(seen_, distance) == seen_.end()) seen_.push_back(distance);
    if (seen_.size() > kMost) {
      refuse(ErrorCode::kFieldInvalid, path + ".formula",
             name + ": a job has at most " + std::to_string(kMost) +
                 " distances of different reach; ask for the farthest, and let other formulas read that");
    }
    const SurfaceKind surface = distance.from_interfaces ? SurfaceKind::kInterfaces : SurfaceKind::kBoundary;
    try {
      return std::make_shared<DistanceSource>(std::move(range), solid_, placed_, surface, distance.reach_mm);
    } catch (const Error& error) {
      refuse(error.code(), path + ".formula", name + ": " + error.what());
    }
  }
  /// The distance as an input of the formula of this name.
  std::shared_ptr<const ChannelSource> find(const FormulaDistance& distance, const std::string& name,
                                            const std::string& path) {
    const auto known = std::ranges::find(shared_, distance, &Shared::distance);
    if (known != shared_.end()) return known->source;
    return shared_.emplace_back(Shared{distance, made(distance, {name, 0, distance.reach_mm}, path)}).source;
  }

 private:
  static constexpr std::size_t kMost = 4;
  struct Shared {
    FormulaDistance distance;
    std::shared_ptr<const ChannelSource> source;
  };

  const std::shared_ptr<const LimitSolid>& solid_;
  const Mat3& placed_;
  std::vector<Shared> shared_;
  std::vector<FormulaDistance> seen_;
};

}  // namespace

std::vector<std::string> volume_ids_of(const Fields& messages, const std::string& path) {
  require_count(messages, path + "fields");
  std::vector<std::string> ids;
  for (int i = 0; i < messages.size(); ++i) {
    if (!messages[i].has_volume()) continue;
    const std::string& id = messages[i].volume().volume_id();
    require_mesh_id(id, path + "fields[" + std::to_string(i) + "].volume.volume_id");
    if (std::ranges::find(ids, id) == ids.end()) ids.push_back(id);
  }
  return ids;
}

bool depend_on_placement(const Fields& messages) {
  return std::ranges::any_of(messages, [](const v1::Field& field) {
    return field.formula().find(distance_functions().front()) != std::string::npos;
  });
}

ChannelSources to_sources(const Fields& messages, const Volumes& volumes,
                          const std::shared_ptr<const LimitSolid>& solid, const Mat3& placed, const Box3& world_box) {
  require_count(messages, "fields");
  ChannelSources sources;
  const SolidSummary& summary = solid->summary();
  DistancesOfJob shared(solid, placed);
  std::vector<ChannelRange> channels = summary.channels;
  for (int i = 0; i < messages.size(); ++i) {
    const v1::Field& message = messages[i];
    const std::string path = "fields[" + std::to_string(i) + "]";
    require_name(message.name(), path);
    const bool in_world = is_of_world(message.frame(), path);
    const Box3& box = in_world ? world_box : summary.bounding_box;
    if (message.has_volume()) {
      sources.push_back(to_volume_source(message, volumes, in_world, box, path));
      channels.push_back(sources.back()->range());
      continue;
    }
    if (message.kind_case() != v1::Field::kFormula) {
      refuse(ErrorCode::kFieldInvalid, path,
             double_quoted(message.name()) +
                 " has nothing that this server knows to take values from; give a formula or a volume");
    }
    Formula formula = parse(messages, i, channels, path);
    ChannelRange range = formula.is_distance() && !message.has_range()
                             ? ChannelRange{message.name(), 0, formula.distances().front().reach_mm}
                             : range_of(message, formula, channels, box, path);
    channels.push_back(range);
    const std::span<const FormulaDistance> distances = formula.distances();
    if (formula.is_distance()) {
      sources.push_back(shared.made(distances.front(), std::move(range), path));
      continue;
    }
    ChannelSources read;
    for (const FormulaDistance& distance : distances) read.push_back(shared.find(distance, message.name(), path));
    sources.push_back(std::make_shared<FormulaSource>(
        std::move(range), std::move(formula), in_world ? FormulaFrame::kWorld : FormulaFrame::kMesh, std::move(read)));
  }
  ChannelTable(summary.channels, sources).validate_sources();
  return sources;
}

}  // namespace ccslice::server
