// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/job_share.h"

#include <algorithm>
#include <limits>

#include "client/cli/base/json_fields.h"

namespace ccslice::cli {
namespace {

constexpr std::uint32_t kLongBlock = 64, kShortBlock = 16;  // Layers.
constexpr std::uint64_t kBlocksOfLongShares = 4;

std::uint64_t blocks_of(const LayerRange& layers, std::uint32_t block) {
  return layers.last / block - layers.first / block + std::uint64_t{1};
}

std::uint32_t block_of(const LayerRange& job, std::uint32_t shares) {
  return blocks_of(job, kLongBlock) >= kBlocksOfLongShares * shares ? kLongBlock : kShortBlock;
}

void add_range(const LayerRange& layers, JsonWriter& json) {
  json.member("first_layer", layers.first).member("layers", layers.last - layers.first + 1);
}

std::optional<LayerRange> range_of(const google::protobuf::Struct& object) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
  const std::uint64_t first = count(object, "first_layer", kMost), layers = count(object, "layers", kMost);
  if (layers == 0 || first + layers > kMost) return std::nullopt;
  return LayerRange{static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(first + layers - 1)};
}

}  // namespace

LayerRange layers_of_share(const Share& share, const LayerRange& job) {
  const std::uint32_t block = block_of(job, share.count);
  const std::uint64_t blocks = blocks_of(job, block);
  if (blocks < share.count) {
    throw UsageError("--share " + describe(share) + ": " + describe(job) + " make no more than " +
                     std::to_string(blocks) + " shares, since they are cut at multiples of " + std::to_string(block) +
                     "; take fewer");
  }
  const auto cut = [&](std::uint64_t number) { return (job.first / block + blocks * number / share.count) * block; };
  return {static_cast<std::uint32_t>(std::max<std::uint64_t>(job.first, cut(share.number - 1))),
          static_cast<std::uint32_t>(std::min<std::uint64_t>(job.last, cut(share.number) - 1))};
}

std::uint32_t share_of_layer(std::uint32_t layer, std::uint32_t shares, const LayerRange& job) {
  std::uint32_t low = 1, high = shares;
  while (low < high) {
    const std::uint32_t middle = low + (high - low) / 2;
    layers_of_share({middle, shares}, job).last < layer ? low = middle + 1 : high = middle;
  }
  return low;
}

void add_json(const ShareRecord& record, JsonWriter& json) {
  json.begin_object().member("number", record.share.number).member("count", record.share.count);
  add_range(record.layers, json);
  json.key("job").begin_object().member("id", record.job_id);
  add_range(record.job_layers, json);
  json.end_object();
  if (!record.contact_sheet.empty()) json.member("contact_sheet_sha256", record.contact_sheet);
  json.end_object();
}

std::optional<ShareRecord> share_record(const google::protobuf::Struct& object) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
  const google::protobuf::Struct& job = field(object, "job").struct_value();
  const Share share = {static_cast<std::uint32_t>(count(object, "number", kMost)),
                       static_cast<std::uint32_t>(count(object, "count", kMost))};
  const std::optional<LayerRange> layers = range_of(object), job_layers = range_of(job);
  const bool right = share.number > 0 && share.number <= share.count && layers && job_layers &&
                     layers->first >= job_layers->first && layers->last <= job_layers->last &&
                     share.count <= blocks_of(*job_layers, kShortBlock);
  if (!right) return std::nullopt;
  return ShareRecord{share, *layers, text(job, "id"), *job_layers, text(object, "contact_sheet_sha256")};
}

std::string describe(const Share& share) { return std::to_string(share.number) + "/" + std::to_string(share.count); }

std::string describe(const LayerRange& layers) {
  return "layers " + std::to_string(layers.first) + " to " + std::to_string(layers.last);
}

std::string describe(const ShareRecord& record) {
  return "share " + describe(record.share) + ", " + describe(record.layers) + " of " +
         std::to_string(record.job_layers.first) + " to " + std::to_string(record.job_layers.last);
}

}  // namespace ccslice::cli
