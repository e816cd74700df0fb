// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/volume_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <string>

#include "ccslice/v1/mesh.pb.h"
#include "core/base/error.h"
#include "core/volume/load_sample.h"
#include "tests/server/test_volumes.h"

namespace ccslice::server {
namespace {

using testing::HasSubstr;

std::vector<std::string> in_blocks(const std::string& bytes, std::size_t block_bytes) {
  std::vector<std::string> blocks;
  for (std::size_t at = 0; at < bytes.size(); at += block_bytes) blocks.push_back(bytes.substr(at, block_bytes));
  return blocks;
}

Volume read_whole(const std::string& bytes, const CancellationToken& cancel = {}) {
  return read_volume(
      {bytes}, [](std::uint64_t) {}, cancel);
}

/// 10 x 20 x 300 samples that don't pack well.
v1::Volume large() {
  std::mt19937 random(5);
  std::vector<std::int16_t> samples(60'000);
  for (std::int16_t& sample : samples) sample = static_cast<std::int16_t>(random());
  return volume_message(std::array{10u, 20u, 300u}, v1::VOLUME_SAMPLE_TYPE_INT16, samples);
}

void expect_refused(const std::string& bytes, const std::string& part) {
  try {
    (void)read_whole(bytes);
    ADD_FAILURE() << "no error, expected " << part;
  } catch (const Error& error) {
    EXPECT_EQ(reason(error.code()), "VOLUME_INVALID");
    EXPECT_THAT(error.what(), HasSubstr(part));
  }
}
void expect_refused(const std::function<void(v1::Volume&)>& change, const std::string& part) {
  v1::Volume volume = large();
  change(volume);
  expect_refused(volume.SerializeAsString(), part);
}

TEST(VolumeReader, ReadsWhatWasWrittenHoweverItIsCut) {
  const std::string bytes = large().SerializeAsString();
  const Volume whole = read_whole(bytes);
  EXPECT_EQ(whole.shape(), (VolumeShape{.samples = {10, 20, 300}, .type = VolumeSampleType::kInt16}));
  std::mt19937 random(5);
  for (std::uint64_t s = 0; s < 60'000; ++s) {
    ASSERT_EQ(load_sample<std::int16_t>(whole.bytes(), s), static_cast<std::int16_t>(random()));
  }
  for (const std::size_t block : {1u, 7u, 1000u, 100'000u}) {
    std::uint64_t reserved = 0;
    const Volume cut = read_volume(in_blocks(bytes, block), [&](std::uint64_t asked) { reserved += asked; });
    EXPECT_EQ(std::memcmp(cut.bytes(), whole.bytes(), 120'000), 0) << block;
    EXPECT_EQ(reserved, 120'000u);
  }
}

TEST(VolumeReader, ReadsEachType) {
  const auto type_of = [](v1::VolumeSampleType type) {
    return read_whole(
               volume_message<std::uint32_t>({1, 1,
                                              4u / static_cast<unsigned>(type == v1::VOLUME_SAMPLE_TYPE_UINT8     ? 1
                                                                         : type == v1::VOLUME_SAMPLE_TYPE_FLOAT32 ? 4
                                                                                                                  : 2)},
                                             type, {0})
                   .SerializeAsString())
        .shape()
        .type;
  };
  EXPECT_EQ(type_of(v1::VOLUME_SAMPLE_TYPE_UINT8), VolumeSampleType::kUint8);
  EXPECT_EQ(type_of(v1::VOLUME_SAMPLE_TYPE_INT16), VolumeSampleType::kInt16);
  EXPECT_EQ(type_of(v1::VOLUME_SAMPLE_TYPE_UINT16), VolumeSampleType::kUint16);
  EXPECT_EQ(type_of(v1::VOLUME_SAMPLE_TYPE_FLOAT32), VolumeSampleType::kFloat32);
}

TEST(VolumeReader, TellsVolumesFromMeshes) {
  EXPECT_TRUE(holds_volume(in_blocks(large().SerializeAsString(), 1)));
  v1::ControlMesh mesh;
  mesh.add_positions_mm(1);
  EXPECT_FALSE(holds_volume({mesh.SerializeAsString()}));
  EXPECT_FALSE(holds_volume({}));
  EXPECT_FALSE(holds_volume({"\xff"}));
}

TEST(VolumeReader, RefusesWhatIsNone) {
  expect_refused([](v1::Volume& volume) { volume.clear_samples_j(); }, "samples_j: none");
  expect_refused([](v1::Volume& volume) { volume.clear_samples_zstd(); }, "samples_zstd: none");
  expect_refused([](v1::Volume& volume) { volume.clear_sample_type(); }, "sample_type: 0");
  expect_refused([](v1::Volume& volume) { volume.set_sample_type(static_cast<v1::VolumeSampleType>(77)); },
                 "sample_type: 77");
  expect_refused([](v1::Volume& volume) { volume.set_channels(2); }, "holds 120000 bytes");
  expect_refused([](v1::Volume& volume) { volume.set_samples_k(299); }, "more samples than the volume has");
  expect_refused([](v1::Volume& volume) { volume.mutable_samples_zstd()->resize(1000); }, "send all of them");
  expect_refused([](v1::Volume& volume) { volume.set_samples_zstd("what else"); }, "not a zstd frame");
  expect_refused([](v1::Volume& volume) { *volume.mutable_samples_zstd() += volume.samples_zstd(); },
                 "more than one zstd frame");
  expect_refused([](v1::Volume& volume) { volume.set_channels(1000); }, "channels: 1000");
  const std::string bytes = large().SerializeAsString();
  expect_refused(bytes + bytes, "comes before other fields, or twice");
  expect_refused(bytes.substr(0, bytes.size() - 1), "don't add up");
  expect_refused(std::string("\xa8\x06"), "don't add up");
  expect_refused(std::string("\x08\x01") + bytes, "field 1 isn't one");
  std::string wrong_kind = bytes;
  wrong_kind[0] = '\xaa';
  expect_refused(wrong_kind, "don't add up");
}

TEST(VolumeReader, RefusesLargeWindows) {
  v1::Volume volume = large();
  const std::string zeros(64 << 20, '\0');
  volume.set_samples_k(static_cast<std::uint32_t>(zeros.size()) / 400);
  std::string packed(ZSTD_compressBound(zeros.size()), '\0');
  ZSTD_CCtx* context = ZSTD_createCCtx();
  ZSTD_CCtx_setParameter(context, ZSTD_c_windowLog, 25);
  packed.resize(ZSTD_compress2(context, packed.data(), packed.size(), zeros.data(), zeros.size()));
  ZSTD_freeCCtx(context);
  volume.set_samples_zstd(packed);
  expect_refused(volume.SerializeAsString(), "window of at most 8 MiB");
}

/// 2^40 samples are promised with some bytes, and then there aren't any.
TEST(VolumeReader, AsksForMemoryBeforeItTakesIt) {
  v1::Volume volume = large();
  volume.set_samples_i(1 << 20);
  volume.set_samples_j(1 << 10);
  volume.set_samples_k(1 << 10);
  struct TooMuch {};
  std::uint64_t asked = 0;
  const auto refuse = [&](std::uint64_t bytes) {
    asked = bytes;
    throw TooMuch();
  };
  EXPECT_THROW((void)read_volume({volume.SerializeAsString()}, refuse), TooMuch);
  EXPECT_EQ(asked, std::uint64_t{2} << 40);
}

TEST(VolumeReader, CanBeCancelled) {
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  try {
    (void)read_whole(large().SerializeAsString(), cancel);
    ADD_FAILURE();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kCancelled);
  }
}

TEST(VolumeReader, SurvivesAnyChange) {
  std::mt19937 random(7);
  const std::string bytes =
      volume_message(std::array{3u, 2u, 2u}, v1::VOLUME_SAMPLE_TYPE_UINT8, std::vector<std::uint8_t>(12, 5))
          .SerializeAsString();
  const auto reserve = [](std::uint64_t asked) {
    if (asked > 1 << 20) throw Error(ErrorCode::kMeshTooLarge, "");
  };
  for (int turn = 0; turn < 20'000; ++turn) {
    std::string changed = bytes;
    for (int change = 0; change < 2; ++change) changed[random() % changed.size()] = static_cast<char>(random());
    if (random() % 4 == 0) changed.resize(random() % changed.size());
    try {
      const Volume volume = read_volume({changed}, reserve);
      EXPECT_LE(volume.memory_bytes(), 2u << 20);
    } catch (const Error&) {
    }
  }
}

}  // namespace
}  // namespace ccslice::server
