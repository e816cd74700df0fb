// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/joined_job.h"

#include <google/protobuf/field_mask.pb.h>
#include <google/protobuf/util/field_mask_util.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>

#include "client/cli/output/layer_entry.h"
#include "client/cli/output/manifest.h"
#include "client/client_error.h"
#include "client/job.h"
#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

[[noreturn]] void refuse_shares(const std::string& what) { throw Error(ErrorCode::kFileSyntax, what); }

/// "a and b".
std::string both(const ShareFolder& a, const ShareFolder& b) { return a.path.string() + " and " + b.path.string(); }

[[noreturn]] void refuse_mixture(const char* reason, const std::string& what) {
  throw client::ClientError(grpc::StatusCode::ABORTED, reason, what);
}

/// What a manifest says under this name, to be compared.
std::string member_of(const ShareFolder& share, const char* name) {
  google::protobuf::FieldMask mask;
  mask.add_paths(name);
  v1::Manifest alone;
  google::protobuf::util::FieldMaskUtil::MergeMessageTo(share.manifest, mask, {}, &alone);
  return alone.SerializeAsString();
}

void require_one_engine_and_grid(const ShareFolder& a, const ShareFolder& b) {
  const std::string &engine = a.manifest.engine_version(), &other = b.manifest.engine_version();
  if (engine != other) {
    refuse_mixture(client::local_reason::kEngineMixed, both(a, b) + " are of two engines, " + echoed(engine) + " and " +
                                                           echoed(other) +
                                                           "; slice all shares with servers of one version");
  }
  if (member_of(a, "grid") != member_of(b, "grid")) {
    refuse_mixture(client::local_reason::kGridMixed,
                   both(a, b) + " have different grids; slice all shares with the same mesh, pitch and placement");
  }
}

void require_same_job(const ShareFolder& a, const ShareFolder& b) {
  struct Part {
    const char* member;
    const char* name;
  };
  static constexpr std::array<Part, 6> kParts = {{{"slice_job.parts", "parts, or their placements,"},
                                                  {"region", "regions"},
                                                  {"layout", "layouts"},
                                                  {"planes", "planes"},
                                                  {"slice_job.printing", "materials, maps or halftones"},
                                                  {"cell_regions", "cell regions"}}};
  constexpr const char* kRemedy = "; slice all shares with the same options";
  require_one_engine_and_grid(a, b);
  if (client::mesh_ids_of(a.manifest.slice_job()) != client::mesh_ids_of(b.manifest.slice_job())) {
    refuse_shares(both(a, b) + " are of different jobs: their meshes differ" + kRemedy);
  }
  for (const Part& part : kParts) {
    if (member_of(a, part.member) != member_of(b, part.member)) {
      refuse_shares(both(a, b) + " are of different jobs: their " + part.name + " differ" + kRemedy);
    }
  }
  const LayerRange &layers = a.record.job_layers, &others = b.record.job_layers;
  if (layers.first != others.first || layers.last != others.last) {
    refuse_shares(both(a, b) + " are of different jobs: one has " + describe(layers) + ", the other " +
                  describe(others) + kRemedy);
  }
  if (a.record.job_id != b.record.job_id) {
    refuse_shares(both(a, b) + " are of different jobs: their tolerances, contours or other options differ" + kRemedy);
  }
  const std::string &sheet = a.record.contact_sheet, &other_sheet = b.record.contact_sheet;
  if (!sheet.empty() && !other_sheet.empty() && sheet != other_sheet) {
    refuse_shares(both(a, b) + " have different contact sheets" + kRemedy);
  }
}

struct MissingShares {
  std::vector<std::string> names;  // Of the first ones.
  std::size_t total = 0;
  std::uint32_t last = 0;  // The number of the last one.
};

/// Adds the shares that have these layers. Shares of several sizes may leave two gaps in one.
void add_gap(const LayerRange& gap, const ShareRecord& like, MissingShares& missing) {
  const std::uint32_t shares = like.share.count, last = share_of_layer(gap.last, shares, like.job_layers),
                      first = std::max(missing.last + 1, share_of_layer(gap.first, shares, like.job_layers));
  missing.total += last - first + 1;
  missing.last = last;
  for (std::uint32_t number = first; number <= last && missing.names.size() < kMaxEchoItems; ++number) {
    missing.names.push_back(describe(Share{number, shares}));
  }
}

std::vector<ShareFolder> by_first_layer(std::vector<ShareFolder> shares) {
  std::ranges::stable_sort(shares, {}, [](const ShareFolder& share) { return share.record.layers.first; });
  return shares;
}

}  // namespace

JoinedJob::JoinedJob(std::vector<ShareFolder> shares) : shares_(by_first_layer(std::move(shares))) {
  require_one_job();
  require_no_gap();
  find_sources();
}

void JoinedJob::require_one_job() const {
  for (const ShareFolder& share : shares_) require_same_job(shares_.front(), share);
}

void JoinedJob::require_no_gap() const {
  const ShareRecord& like = shares_.front().record;
  MissingShares missing;
  std::uint64_t next = like.job_layers.first;
  const auto reach = [&](std::uint64_t layer) {
    if (layer <= next) return;
    add_gap({static_cast<std::uint32_t>(next), static_cast<std::uint32_t>(layer - 1)}, like, missing);
  };
  for (const ShareFolder& share : shares_) {
    reach(share.record.layers.first);
    next = std::max(next, share.record.layers.last + std::uint64_t{1});
  }
  reach(like.job_layers.last + std::uint64_t{1});
  if (missing.total == 0) return;
  const bool one = missing.total == 1;
  refuse_shares("share" + std::string(one ? " " : "s ") + echoed_list(missing.names, missing.total) +
                (one ? " is" : " are") + " missing: slice with --share " + missing.names.front() +
                (one ? "" : " and so on") + ", and name the folder too");
}

void JoinedJob::find_sources() {
  const std::uint32_t job_first = shares_.front().record.job_layers.first;
  for (std::size_t s = 0; s < shares_.size(); ++s) {
    const std::uint32_t first = shares_[s].record.layers.first - job_first;
    for (std::size_t i = 0; i < shares_[s].layers.size(); ++i) {
      if (first + i == sources_.size()) {
        sources_.push_back(s);
        continue;
      }
      const ShareFolder& other = shares_[sources_[first + i]];
      const std::size_t there = first + i - (other.record.layers.first - job_first);
      if (other.layers[there].SerializeAsString() == shares_[s].layers[i].SerializeAsString()) continue;
      refuse_shares(both(other, shares_[s]) + " both have layer " + std::to_string(job_first + first + i) +
                    ", and with different bytes; slice that share anew, and name one folder of it");
    }
  }
}

bool JoinedJob::takes(std::size_t share, std::size_t layer) const {
  const std::uint32_t job_first = shares_.front().record.job_layers.first;
  return sources_[shares_[share].record.layers.first - job_first + layer] == share;
}

const ShareFolder* JoinedJob::with_contact_sheet() const {
  const auto found =
      std::ranges::find_if(shares_, [](const ShareFolder& share) { return !share.record.contact_sheet.empty(); });
  return found == shares_.end() ? nullptr : &*found;
}

v1::Manifest JoinedJob::manifest() const {
  v1::Manifest joined = shares_.front().manifest;
  joined.set_job(shares_.front().record.job_id);
  joined.clear_share();
  client::SliceOutcome counts;
  for (std::size_t s = 0; s < shares_.size(); ++s) {
    for (std::size_t i = 0; i < shares_[s].layers.size(); ++i) {
      if (!takes(s, i)) continue;
      *joined.add_layers() = shares_[s].layers[i];
      counts.add_counts(counts_of_entry(shares_[s].layers[i]));
    }
  }
  count_voxels(counts, joined);
  return joined;
}

}  // namespace ccslice::cli
