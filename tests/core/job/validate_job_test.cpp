// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/validate_job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>

#include "core/base/error.h"
#include "core/job/slice_job.h"
#include "core/output/image_file.h"

namespace ccslice {
namespace {

SolidSummary two_channels() {
  SolidSummary summary;
  summary.channels = {{"stiffness", 0, 1}, {"colour", -1, 1}};
  summary.bounding_box = Box3(Vec3::Zero(), Vec3::Constant(2));
  return summary;
}

PlaneSpec channel_plane(const std::string& name, SampleType type = SampleType::kUint8) {
  PlaneSpec plane;
  plane.content = PlaneContent::kChannel;
  plane.channel = name;
  plane.sample_type = type;
  return plane;
}

SliceJob good_job() {
  SliceJob job;
  job.grid.pitch = {0.1, 0.1, 0.1};
  job.grid.extent = {100, 100, 10};
  job.planes = {PlaneSpec{}, channel_plane("stiffness"), channel_plane("colour", SampleType::kFloat32)};
  return job;
}

// One way to spoil a good job, and what the user is told.
struct Spoiled {
  const char* name;
  std::function<void(SliceJob&)> spoil;
  ErrorCode code;
  const char* field;
  const char* message;
};

class ValidateJob : public testing::TestWithParam<Spoiled> {};

TEST_P(ValidateJob, NamesTheFieldAndTheRemedy) {
  SliceJob job = good_job();
  GetParam().spoil(job);
  try {
    validate_job(two_channels(), job);
    FAIL() << "passed";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), GetParam().code) << error.what();
    EXPECT_EQ(error.field(), GetParam().field);
    EXPECT_THAT(error.what(), testing::StartsWith(GetParam().field));
    EXPECT_THAT(error.what(), testing::HasSubstr(GetParam().message));
  }
}

void set_channels(PlaneSpec& plane, std::vector<std::string> channels) {
  plane.content = PlaneContent::kChannels;
  plane.channels = std::move(channels);
}

constexpr double kNotANumber = std::numeric_limits<double>::quiet_NaN();

INSTANTIATE_TEST_SUITE_P(
    Catalogue, ValidateJob,
    testing::Values(
        Spoiled{"OriginFarOut", [](SliceJob& job) { job.grid.origin_mm.y() = -2e7; }, ErrorCode::kGridOriginOutOfRange,
                "grid.origin_mm.y", "leave it out to anchor at the part"},
        Spoiled{"OriginNotFinite", [](SliceJob& job) { job.grid.origin_mm.x() = kNotANumber; },
                ErrorCode::kGridOriginNonFinite, "grid.origin_mm.x", "NaN or infinite"},
        Spoiled{"PartFarOut", [](SliceJob& job) { job.grid.part_box = Box3(Vec3::Zero(), Vec3(1, 1, 1e8)); },
                ErrorCode::kPlacementOutOfRange, "placement", "move it closer"},
        Spoiled{"NoPlanes", [](SliceJob& job) { job.planes.clear(); }, ErrorCode::kNothingRequested, "planes",
                "nothing is asked for; add an occupancy or a channel plane, or set contours"},
        Spoiled{"TooManyPlanes", [](SliceJob& job) { job.planes.resize(65); }, ErrorCode::kTooManyPlanes, "planes",
                "65 are more than the limit of 64"},
        Spoiled{"UnknownChannel", [](SliceJob& job) { job.planes[2].channel = "stifness"; }, ErrorCode::kChannelUnknown,
                "planes[2].channel.name",
                R"(the mesh has no channel "stifness"; it has "stiffness", "colour"; did you mean "stiffness"?)"},
        Spoiled{"UnknownContent", [](SliceJob& job) { job.planes[1].content = static_cast<PlaneContent>(9); },
                ErrorCode::kEnumValueUnknown, "planes[1].content", "unknown"},
        Spoiled{"ChannelAsBits", [](SliceJob& job) { job.planes[1].sample_type = SampleType::kBit; },
                ErrorCode::kEncodingUnsupported, "planes[1].sample_type", "ask for UINT8, UINT16 or FLOAT32"},
        Spoiled{"MaterialsWithoutAny", [](SliceJob& job) { job.planes[1].content = PlaneContent::kMaterials; },
                ErrorCode::kMaterialsMissing, "printing.materials", "planes[1] shows them"},
        Spoiled{"MaskOfAnUnknownMaterial",
                [](SliceJob& job) {
                  job.printing = Printing{.materials = {{"resin", 0xffffffff}}, .map = {}, .halftone = {}};
                  job.planes[0].content = PlaneContent::kMaterialMask;
                  job.planes[0].material = 2;
                },
                ErrorCode::kMaterialUnknown, "planes[0].material_mask.material", "there is no material 2"},
        Spoiled{"MaterialsInTooFewBits",
                [](SliceJob& job) {
                  job.printing = Printing{.materials = {{"a", 1}, {"b", 2}}, .map = {}, .halftone = {}};
                  job.printing->map.kind = BlendMap{"stiffness", {{0, 1}, {1, 2}}};
                  job.planes[0].content = PlaneContent::kMaterials;
                },
                ErrorCode::kEncodingUnsupported, "planes[0].sample_type", "too few bits"},
        Spoiled{"MaterialsAsTiff",
                [](SliceJob& job) {
                  job.printing = Printing{.materials = {{"resin", 0xffffffff}}, .map = {}, .halftone = {}};
                  job.planes[0].content = PlaneContent::kMaterials;
                  job.planes[0].encoding = Encoding::kTiff;
                },
                ErrorCode::kEncodingUnsupported, "planes[0].encoding", "ask for PNG"},
        Spoiled{"ChannelAsRgba", [](SliceJob& job) { job.planes[1].encoding = Encoding::kPngRgba; },
                ErrorCode::kEncodingUnsupported, "planes[1].encoding", "materials only"},
        Spoiled{"OccupancyAsBytes", [](SliceJob& job) { job.planes[0].sample_type = SampleType::kUint8; },
                ErrorCode::kEncodingUnsupported, "planes[0].sample_type", "ask for BIT"},
        Spoiled{"UnknownSampleType", [](SliceJob& job) { job.planes[1].sample_type = static_cast<SampleType>(50); },
                ErrorCode::kEnumValueUnknown, "planes[1].sample_type", "unknown; ask for BIT, UINT2"},
        Spoiled{"FloatsAsPng", [](SliceJob& job) { job.planes[2].encoding = Encoding::kPng; },
                ErrorCode::kEncodingUnsupported, "planes[2].encoding", "PNG holds no floats"},
        Spoiled{"BytesAsExr", [](SliceJob& job) { job.planes[1].encoding = Encoding::kExr; },
                ErrorCode::kEncodingUnsupported, "planes[1].encoding", "EXR holds floats only"},
        Spoiled{"NoChannels", [](SliceJob& job) { job.planes[2].content = PlaneContent::kChannels; },
                ErrorCode::kContentInvalid, "planes[2].channels", "none"},
        Spoiled{"UnknownChannelOfSeveral",
                [](SliceJob& job) {
                  set_channels(job.planes[2], {"stiffness", "weight"});
                },
                ErrorCode::kChannelUnknown, "planes[2].channels.names[1]", "no channel \"weight\""},
        Spoiled{"ChannelNamedTwice",
                [](SliceJob& job) {
                  set_channels(job.planes[2], {"colour", "stiffness", "colour"});
                },
                ErrorCode::kChannelRepeated, "planes[2].channels.names[2]", "\"colour\" is named twice"},
        Spoiled{"ChannelsAsBytes",
                [](SliceJob& job) {
                  set_channels(job.planes[1], {"colour", "stiffness"});
                },
                ErrorCode::kEncodingUnsupported, "planes[1].sample_type", "ask for FLOAT32"},
        Spoiled{"ChannelsAsTiff",
                [](SliceJob& job) {
                  set_channels(job.planes[2], {"colour", "stiffness"});
                  job.planes[2].encoding = Encoding::kTiff;
                },
                ErrorCode::kEncodingUnsupported, "planes[2].encoding", "ask for EXR"},
        Spoiled{"UnknownEncoding", [](SliceJob& job) { job.planes[0].encoding = static_cast<Encoding>(50); },
                ErrorCode::kEnumValueUnknown, "planes[0].encoding",
                "ask for RAW, RAW_ZSTD, PNG, PNG_RGBA, TIFF, EXR, PNG_ALPHA, TIFF_ALPHA or RUNS_ZSTD"},
        Spoiled{"EmptyRange",
                [](SliceJob& job) {
                  job.planes[1].range = {2, 2};
                },
                ErrorCode::kValueRangeInvalid, "planes[1].value_range", "empty (min 2, max 2); min must be below max"},
        Spoiled{"ReversedRange",
                [](SliceJob& job) {
                  job.planes[1].range = {3, 2};
                },
                ErrorCode::kValueRangeInvalid, "planes[1].value_range", "min must be below max"},
        Spoiled{"NanRange",
                [](SliceJob& job) {
                  job.planes[1].range = {0, kNotANumber};
                },
                ErrorCode::kValueRangeInvalid, "planes[1].value_range", "not finite"},
        Spoiled{"OverflowingRange",
                [](SliceJob& job) {
                  job.planes[1].range = {-1.5e308, 1.5e308};
                },
                ErrorCode::kValueRangeInvalid, "planes[1].value_range", "not finite"},
        Spoiled{"RangeOfFloats",
                [](SliceJob& job) {
                  job.planes[2].range = {0, 1};
                },
                ErrorCode::kValueRangeUnexpected, "planes[2].value_range", "leave it out"},
        Spoiled{"RangeOfOccupancy",
                [](SliceJob& job) {
                  job.planes[0].range = {0, 1};
                },
                ErrorCode::kValueRangeUnexpected, "planes[0].value_range", "leave it out"},
        Spoiled{"OutsideOfOccupancy", [](SliceJob& job) { job.planes[0].outside_sample = 1; },
                ErrorCode::kOutsideSampleInvalid, "planes[0].outside_sample", "leave it out"},
        Spoiled{"OutsideBeyondBytes", [](SliceJob& job) { job.planes[1].outside_sample = 256; },
                ErrorCode::kOutsideSampleInvalid, "planes[1].outside_sample", "a whole number from 0 to 255"},
        Spoiled{"OutsideBetweenSamples", [](SliceJob& job) { job.planes[1].outside_sample = 0.5; },
                ErrorCode::kOutsideSampleInvalid, "planes[1].outside_sample", "a whole number from 0 to 255"},
        Spoiled{"OutsideNanOfBytes", [](SliceJob& job) { job.planes[1].outside_sample = kNotANumber; },
                ErrorCode::kOutsideSampleInvalid, "planes[1].outside_sample", "a whole number from 0 to 255"},
        Spoiled{"OutsideBeyondFloats", [](SliceJob& job) { job.planes[2].outside_sample = 1e300; },
                ErrorCode::kOutsideSampleInvalid, "planes[2].outside_sample", "no FLOAT32"},
        Spoiled{"OccupancyWithAlpha", [](SliceJob& job) { job.planes[0].encoding = Encoding::kPngAlpha; },
                ErrorCode::kEncodingUnsupported, "planes[0].encoding", "PNG without"},
        Spoiled{"ToleranceZero", [](SliceJob& job) { job.contour_tolerance_mm = 0; }, ErrorCode::kToleranceInvalid,
                "contour_tolerance_mm", "0 is outside [1e-05, 1]"},
        Spoiled{"ToleranceNan", [](SliceJob& job) { job.contour_tolerance_mm = kNotANumber; },
                ErrorCode::kToleranceInvalid, "contour_tolerance_mm", "nan is outside"},
        Spoiled{"ToleranceLarge", [](SliceJob& job) { job.contour_tolerance_mm = 2; }, ErrorCode::kToleranceInvalid,
                "contour_tolerance_mm", "2 is outside"},
        Spoiled{"ChannelToleranceNegative", [](SliceJob& job) { job.channel_tolerance = -1e-9; },
                ErrorCode::kToleranceInvalid, "channel_tolerance", "is outside [0, 1]"},
        Spoiled{"ChannelToleranceNan", [](SliceJob& job) { job.channel_tolerance = kNotANumber; },
                ErrorCode::kToleranceInvalid, "channel_tolerance", "nan is outside [0, 1]"},
        Spoiled{"ChannelToleranceLarge", [](SliceJob& job) { job.channel_tolerance = 1.5; },
                ErrorCode::kToleranceInvalid, "channel_tolerance", "give 0 to invert every voxel"},
        Spoiled{"PlacementSingular", [](SliceJob& job) { job.placement.linear().setOnes(); },
                ErrorCode::kPlacementSingular, "placement.matrix", "singular"},
        Spoiled{"PitchZero", [](SliceJob& job) { job.grid.pitch.z_mm = 0; }, ErrorCode::kPitchInvalid,
                "grid.pitch.z_mm", "give a positive length"},
        Spoiled{"GridTooWide", [](SliceJob& job) { job.grid.extent.columns = 70'000; }, ErrorCode::kGridTooLarge,
                "grid.extent.columns", "70000 is more than the limit of 65536"},
        Spoiled{"GridOfNothing", [](SliceJob& job) { job.grid.extent.layers = 0; }, ErrorCode::kGridExtentZero,
                "grid.extent.layers", "at least one voxel"},
        Spoiled{"HalftonesTooLarge",
                [](SliceJob& job) {
                  job.grid.extent = {16384, 16384, 1};
                  job.grid.pitch.x_mm = job.grid.pitch.y_mm = 1e-4;
                  job.placement.linear() *= 2;
                  job.planes.resize(1);
                  job.printing = Printing{.materials = {{"a", 1}, {"b", 2}}, .map = {}, .halftone = {}};
                  job.printing->map.kind = DirectMap{{{"stiffness", 1}, {"colour", 2}}, 0};
                },
                ErrorCode::kLayerBytesTooLarge, "planes", "bytes of samples a layer"},
        Spoiled{"LayerTooLarge",
                [](SliceJob& job) {
                  job.grid.extent = {16384, 16384, 1};
                  job.planes.assign(3, channel_plane("stiffness", SampleType::kFloat32));
                },
                ErrorCode::kLayerBytesTooLarge, "planes", "3221225472 bytes of samples a layer"}),
    [](const testing::TestParamInfo<Spoiled>& info) { return std::string(info.param.name); });

TEST(ValidateJobOfGoodJobs, Passes) {
  EXPECT_NO_THROW(validate_job(two_channels(), good_job()));
  SliceJob contours_only = good_job();
  contours_only.planes.clear();
  contours_only.contours = true;
  EXPECT_NO_THROW(validate_job(two_channels(), contours_only));
  for (const double tolerance : {0.0, 1e-12, 1.0}) {
    SliceJob tolerant = good_job();
    tolerant.channel_tolerance = tolerance;
    EXPECT_NO_THROW(validate_job(two_channels(), tolerant));
  }
  SliceJob ranged = good_job();
  ranged.planes[1].range = {0.2, 0.7};
  EXPECT_NO_THROW(validate_job(two_channels(), ranged));
}

TEST(ValidateJobOfGoodJobs, SaysThatASolidHasNoChannels) {
  try {
    validate_job(SolidSummary{}, good_job());
    FAIL() << "passed";
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "planes[1].channel.name: the mesh has no channel \"stiffness\"; it has none");
  }
}

TEST(ValidateJobOfGoodJobs, TakesTiffIfItIsBuiltIn) {
  SliceJob job = good_job();
  job.planes[0].encoding = Encoding::kTiff;
  if (image_files_available()) {
    EXPECT_NO_THROW(validate_job(two_channels(), job));
  } else {
    EXPECT_THROW(validate_job(two_channels(), job), Error);
  }
}

}  // namespace
}  // namespace ccslice
