// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/options/job_share.h"

#include <algorithm>
#include <limits>

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

template <class Document>
void set_range(const LayerRange& layers, Document& document) {
  document.set_first_layer(layers.first);
  document.set_layers(layers.last - layers.first + 1);
}

template <class Document>
std::optional<LayerRange> range_of(const Document& document) {
  const std::uint32_t first = document.first_layer(), layers = document.layers();
  if (layers == 0 || first > std::numeric_limits<std::uint32_t>::max() - layers) return std::nullopt;
  return LayerRange{first, first + layers - 1};
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

v1::JobPart document_of(const ShareRecord& record) {
  v1::JobPart document;
  document.set_number(record.share.number);
  document.set_count(record.share.count);
  set_range(record.layers, document);
  document.mutable_job()->set_id(record.job_id);
  set_range(record.job_layers, *document.mutable_job());
  if (!record.contact_sheet.empty()) document.set_contact_sheet_sha256(record.contact_sheet);
  return document;
}

std::optional<ShareRecord> share_record(const v1::JobPart& document) {
  const Share share = {document.number(), document.count()};
  const std::optional<LayerRange> layers = range_of(document), job_layers = range_of(document.job());
  const bool right = share.number > 0 && share.number <= share.count && layers && job_layers &&
                     layers->first >= job_layers->first && layers->last <= job_layers->last &&
                     share.count <= blocks_of(*job_layers, kShortBlock);
  if (!right) return std::nullopt;
  return ShareRecord{share, *layers, document.job().id(), *job_layers, document.contact_sheet_sha256()};
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
