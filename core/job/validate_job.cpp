// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/validate_job.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "core/base/choice_text.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/channel/channel_table.h"
#include "core/job/placed_part.h"
#include "core/job/validate_placement.h"
#include "core/output/encode.h"
#include "core/output/encodings.h"

namespace ccslice {
namespace {

// One plane of the job; `path` is its field's name, e.g. "planes[2]".
class PlaneCheck {
 public:
  PlaneCheck(const PlaneSpec& plane, std::string path) : plane_(plane), path_(std::move(path)) {}

  void run(const SolidSummary& summary, const ChannelTable& channels, const std::optional<Printing>& printing) const {
    check_values();
    switch (plane_.content) {
      case PlaneContent::kOccupancy: check_occupancy(); break;
      case PlaneContent::kChannel: check_channel(channels); break;
      case PlaneContent::kChannels: check_channels(channels); break;
      case PlaneContent::kMaterials: return check_materials(printing);
      case PlaneContent::kMaterialMask: check_mask(printing); break;
      case PlaneContent::kCellRegions: return check_cell_regions(summary);
    }
    if (plane_.range) check_range(*plane_.range);
    check_outside_sample();
    const auto obstacle = encoding_obstacle(plane_.sample_type, plane_.encoding, channel_count(plane_));
    if (obstacle) refuse(ErrorCode::kEncodingUnsupported, ".encoding", std::string(*obstacle));
  }

 private:
  [[noreturn]] void refuse(ErrorCode code, const std::string& field, const std::string& what) const {
    throw Error(code, path_ + field + ": " + what, path_ + field);
  }

  void check_values() const {
    const auto require = [this](bool known, const char* field, const std::string& choice) {
      if (!known) refuse(ErrorCode::kEnumValueUnknown, field, "unknown; ask for " + choice);
    };
    require(plane_.content <= PlaneContent::kCellRegions, ".content",
            "the occupancy, a channel or several, materials or one of them, or cell regions");
    require(plane_.sample_type <= SampleType::kUint4, ".sample_type", "BIT, UINT2, UINT4, UINT8, UINT16 or FLOAT32");
    require(find_encoding(plane_.encoding) != nullptr, ".encoding", choice_text(encodings()));
  }

  bool has_integer_samples() const {
    return plane_.sample_type == SampleType::kUint8 || plane_.sample_type == SampleType::kUint16;
  }

  void check_occupancy() const {
    if (plane_.sample_type == SampleType::kBit) return;
    refuse(ErrorCode::kEncodingUnsupported, ".sample_type", "occupancy and masks are 1 bit a voxel; ask for BIT");
  }

  void check_channel(const ChannelTable& channels) const {
    channels.require(plane_.channel, path_ + ".channel.name");
    if (!has_integer_samples() && plane_.sample_type != SampleType::kFloat32) {
      refuse(ErrorCode::kEncodingUnsupported, ".sample_type",
             "a channel needs 8 bits a voxel or more; ask for UINT8, UINT16 or FLOAT32");
    }
  }

  void check_channels(const ChannelTable& channels) const {
    if (plane_.channels.empty()) {
      refuse(ErrorCode::kContentInvalid, ".channels", "none; name one or more, or ask for other planes");
    }
    for (std::size_t i = 0; i < plane_.channels.size(); ++i) {
      const std::string field = ".channels.names[" + std::to_string(i) + "]";
      channels.require(plane_.channels[i], path_ + field);
      const auto here = plane_.channels.begin() + static_cast<std::ptrdiff_t>(i);
      if (std::find(plane_.channels.begin(), here, *here) != here) {
        refuse(ErrorCode::kChannelRepeated, field, '"' + echoed(*here) + "\" is named twice; name it once");
      }
    }
    if (plane_.sample_type != SampleType::kFloat32) {
      refuse(ErrorCode::kEncodingUnsupported, ".sample_type",
             "several channels in one plane are floats; ask for FLOAT32, or for a plane each");
    }
  }

  const Printing& require(const std::optional<Printing>& printing) const {
    if (printing) return *printing;
    throw Error(ErrorCode::kMaterialsMissing,
                "printing.materials: " + path_ + " shows them; say what the printer holds", "printing.materials");
  }

  void check_materials(const std::optional<Printing>& printing) const {
    check_numbers(require(printing).materials.size());
  }

  void check_cell_regions(const SolidSummary& summary) const {
    if (summary.cell_regions.empty()) {
      refuse(ErrorCode::kCellRegionsMissing, ".cell_regions",
             "the mesh has none; upload it with cell_region_names and cell_regions, or ask for other planes");
    }
    check_numbers(summary.cell_regions.size());
  }

  /// Checks a plane of numbers. `most`: of so many materials or cell regions.
  void check_numbers(std::size_t most) const {
    if (plane_.range) check_range(*plane_.range);
    check_outside_sample();
    if (const auto obstacle = index_encoding_obstacle(plane_.sample_type, plane_.encoding, most)) {
      const bool fits = !index_encoding_obstacle(plane_.sample_type, Encoding::kRaw, most);
      refuse(ErrorCode::kEncodingUnsupported, fits ? ".encoding" : ".sample_type", std::string(*obstacle));
    }
  }

  void check_mask(const std::optional<Printing>& printing) const {
    if (plane_.material < 1 || plane_.material > require(printing).materials.size()) {
      refuse(ErrorCode::kMaterialUnknown, ".material_mask.material",
             "there is no material " + std::to_string(plane_.material));
    }
    check_occupancy();
  }

  void check_range(const ValueRange& range) const {
    const auto refuse_range = [this](const std::string& what) {
      refuse(ErrorCode::kValueRangeInvalid, ".value_range", what);
    };
    if (plane_.content != PlaneContent::kChannel || !has_integer_samples()) {
      refuse(ErrorCode::kValueRangeUnexpected, ".value_range",
             "only channels with integer samples have one; leave it out");
    }
    if (!std::isfinite(range.min) || !std::isfinite(range.max) || !std::isfinite(range.max - range.min)) {
      refuse_range("not finite; give the values that 0 and the largest sample stand for");
    }
    if (!(range.min < range.max)) {
      refuse_range("empty (min " + number_text(range.min) + ", max " + number_text(range.max) +
                   "); min must be below max");
    }
  }

  void check_outside_sample() const {
    const double sample = plane_.outside_sample;
    const auto refuse_sample = [&](const std::string& what) {
      refuse(ErrorCode::kOutsideSampleInvalid, ".outside_sample", what);
    };
    if (sample == 0) return;
    if (plane_.content != PlaneContent::kChannel && plane_.content != PlaneContent::kChannels) {
      refuse_sample("only channels have another one than 0; leave it out");
    }
    if (!has_integer_samples()) {
      if (std::isnan(sample) || std::abs(sample) <= std::numeric_limits<float>::max()) return;
      refuse_sample(number_text(sample) + " is no FLOAT32; give a number that is, or NaN");
    }
    const double largest = plane_.sample_type == SampleType::kUint8 ? 255 : 65535;
    if (sample >= 0 && sample <= largest && std::floor(sample) == sample) return;
    refuse_sample(number_text(sample) + " is no sample; give a whole number from 0 to " + number_text(largest));
  }

  const PlaneSpec& plane_;
  std::string path_;
};

void validate_contour_tolerance(double tolerance_mm, const SliceLimits& limits) {
  const double low = limits.min_contour_tolerance_mm;
  const double high = limits.max_contour_tolerance_mm;
  if (tolerance_mm >= low && tolerance_mm <= high) return;
  throw Error(ErrorCode::kToleranceInvalid,
              "contour_tolerance_mm: " + number_text(tolerance_mm) + " is outside [" + number_text(low) + ", " +
                  number_text(high) + "]; 0.001 does for any printer",
              "contour_tolerance_mm");
}

void validate_channel_tolerance(double tolerance, const SliceLimits& limits) {
  if (tolerance >= 0 && tolerance <= limits.max_channel_tolerance) return;
  throw Error(ErrorCode::kToleranceInvalid,
              "channel_tolerance: " + number_text(tolerance) + " is outside [0, " +
                  number_text(limits.max_channel_tolerance) +
                  "]; leave it out for one that suits the samples, or give 0 to invert every voxel",
              "channel_tolerance");
}

void validate_layer_bytes(const SolidSummary& summary, const SliceJob& job, const SliceLimits& limits) {
  std::uint64_t bytes = most_layer_bytes(summary, job);
  if (job.printing) {  // What halftoning works on: the map's channels as floats, and a byte a voxel.
    const LayerWindow window = window_of_solid(summary, job);
    const std::uint64_t voxels = std::uint64_t{window.columns} * window.rows;
    bytes += voxels * (sizeof(float) * channels_of(*job.printing).size() + 1);
  }
  if (bytes <= limits.max_layer_bytes) return;
  throw Error(ErrorCode::kLayerBytesTooLarge,
              "planes: " + std::to_string(bytes) + " bytes of samples a layer are more than the limit of " +
                  std::to_string(limits.max_layer_bytes) +
                  "; ask for RUNS_ZSTD, which leaves out what is outside, for fewer "
                  "planes, smaller samples or a larger pitch",
              "planes");
}

}  // namespace

void validate_job(const LimitSolid& solid, const SliceJob& job, const SliceLimits& limits) {
  validate_job(solid.summary(), job, limits);
}

void validate_job(const SolidSummary& summary, const SliceJob& job, const SliceLimits& limits) {
  validate_placement(job.placement, limits);
  validate_pitch(job.grid.pitch, limits);
  validate_extent(job.grid.extent, limits);
  validate_place(job.grid, limits);
  if (job.region) validate_region(job.grid, *job.region);
  validate_contour_tolerance(job.contour_tolerance_mm, limits);
  if (job.channel_tolerance) validate_channel_tolerance(*job.channel_tolerance, limits);
  if (job.planes.empty() && !job.contours) {
    throw Error(ErrorCode::kNothingRequested,
                "planes: nothing is asked for; add an occupancy or a channel plane, or set contours", "planes");
  }
  if (job.contours_by_cell_region && summary.cell_regions.empty()) {
    throw Error(
        ErrorCode::kCellRegionsMissing,
        "contours_by_cell_region: the mesh has no cell regions; upload it with cell_region_names and cell_regions, or "
        "ask for the contours of the whole",
        "contours_by_cell_region");
  }
  if (job.planes.size() > limits.max_planes) {
    throw Error(ErrorCode::kTooManyPlanes,
                "planes: " + std::to_string(job.planes.size()) + " are more than the limit of " +
                    std::to_string(limits.max_planes) + "; split the job by planes",
                "planes");
  }
  const ChannelTable channels(summary.channels, job.sources);
  channels.validate_sources();
  if (job.cut) channels.require(*job.cut, "cut");
  if (job.printing) validate_printing(*job.printing, summary, job.sources);
  for (std::size_t i = 0; i < job.planes.size(); ++i) {
    PlaneCheck(job.planes[i], "planes[" + std::to_string(i) + "]").run(summary, channels, job.printing);
  }
  validate_layer_bytes(summary, job, limits);
}

}  // namespace ccslice
