// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/convert_fields.h"

#include <algorithm>
#include <cmath>
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

namespace ccslice::server {
namespace {

constexpr std::size_t kMaxFieldNameBytes = 256;

[[noreturn]] void refuse(ErrorCode code, const std::string& field, const std::string& what) {
  throw Error(code, field + ": " + what, field);
}

void require_name(const std::string& name, const std::string& path) {
  const std::string field = path + ".name";
  if (name.empty()) refuse(ErrorCode::kFieldInvalid, field, "empty; give the field a name");
  if (name.size() <= kMaxFieldNameBytes) return;
  refuse(ErrorCode::kFieldInvalid, field,
         "longer than " + std::to_string(kMaxFieldNameBytes) + " bytes; give it a shorter one");
}

FormulaFrame to_frame(v1::FieldFrame frame, const std::string& path) {
  switch (frame) {
    case v1::FIELD_FRAME_UNSPECIFIED:
    case v1::FIELD_FRAME_PART: return FormulaFrame::kMesh;
    case v1::FIELD_FRAME_WORLD: return FormulaFrame::kWorld;
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

bool depend_on_placement(const Fields& messages) {
  return std::ranges::any_of(messages, [](const v1::Field& field) {
    return field.formula().find(distance_functions().front()) != std::string::npos;
  });
}

ChannelSources to_sources(const Fields& messages, const std::shared_ptr<const LimitSolid>& solid, const Mat3& placed,
                          const Box3& world_box) {
  if (messages.size() > kMaxFields) {
    refuse(ErrorCode::kFieldInvalid, "fields",
           std::to_string(messages.size()) + " are more than the " + std::to_string(kMaxFields) +
               " of a job; put formulas that are read once into those that read them");
  }
  ChannelSources sources;
  const SolidSummary& summary = solid->summary();
  DistancesOfJob shared(solid, placed);
  std::vector<ChannelRange> channels = summary.channels;
  for (int i = 0; i < messages.size(); ++i) {
    const v1::Field& message = messages[i];
    const std::string path = "fields[" + std::to_string(i) + "]";
    require_name(message.name(), path);
    const FormulaFrame frame = to_frame(message.frame(), path);
    if (message.kind_case() != v1::Field::kFormula) {
      refuse(ErrorCode::kFieldInvalid, path,
             double_quoted(message.name()) + " has nothing that this server knows to take values from; give a formula");
    }
    Formula formula = parse(messages, i, channels, path);
    const Box3& box = frame == FormulaFrame::kWorld ? world_box : summary.bounding_box;
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
    sources.push_back(std::make_shared<FormulaSource>(std::move(range), std::move(formula), frame, std::move(read)));
  }
  ChannelTable(summary.channels, sources).validate_sources();
  return sources;
}

}  // namespace ccslice::server
