// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Shares of a job, for workers that make one stack together: `slice --share I/N` slices one, `join` makes the job of
// all of them.
//
// Jobs are cut at multiples of 64 of the grid's layers; short ones, where a share would have fewer than four such
// blocks, at multiples of 16, so that shares are of about the same length. Servers work on 16 layers together, a slab,
// and slabs begin at multiples of 16, so none is worked on twice. The cuts follow from the job's layers and N alone:
// they are the same for everybody who asks.

#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "client/cli/base/messages.h"
#include "client/cli/base/text_values.h"

namespace ccslice::cli {

/// The layers of a share. Throws UsageError, which names --share, if there are fewer blocks than shares.
LayerRange layers_of_share(const Share& share, const LayerRange& job);

/// The number of the share that has this layer. REQUIRES: a layer of the job, no more shares than blocks.
std::uint32_t share_of_layer(std::uint32_t layer, std::uint32_t shares, const LayerRange& job);

/// What the manifest.json of a share says of it, so that `join` can write that of the job.
struct ShareRecord {
  Share share;
  LayerRange layers;               // The share's.
  std::string job_id;              // JobKey::id of the whole job,
  LayerRange job_layers;           // and its layers.
  std::string contact_sheet = {};  // SHA-256 of the job's sheet, if the share holds it: one of all shares does.
};

v1::JobPart document_of(const ShareRecord& record);
/// What such a document says; nothing if it can't be right.
std::optional<ShareRecord> share_record(const v1::JobPart& document);

/// "2/8".
std::string describe(const Share& share);
/// "layers 64 to 127".
std::string describe(const LayerRange& layers);
/// "share 2/8, layers 64 to 127 of 0 to 499".
std::string describe(const ShareRecord& record);

}  // namespace ccslice::cli
