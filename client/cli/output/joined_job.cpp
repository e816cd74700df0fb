// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/joined_job.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <utility>

#include "client/cli/base/json_fields.h"
#include "client/cli/base/json_scanner.h"
#include "client/cli/output/manifest.h"
#include "client/client_error.h"
#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

using google::protobuf::Struct;

[[noreturn]] void refuse_shares(const std::string& what) { throw Error(ErrorCode::kFileSyntax, what); }

/// "a and b".
std::string both(const ShareFolder& a, const ShareFolder& b) { return a.path.string() + " and " + b.path.string(); }

[[noreturn]] void refuse_mixture(const char* reason, const std::string& what) {
  throw client::ClientError(grpc::StatusCode::ABORTED, reason, what);
}

void require_one_engine_and_grid(const ShareFolder& a, const ShareFolder& b) {
  const std::string engine = a.member("engine_version"), other = b.member("engine_version");
  if (engine != other) {
    refuse_mixture(client::local_reason::kEngineMixed, both(a, b) + " are of two engines, " + echoed(engine) + " and " +
                                                           echoed(other) +
                                                           "; slice all shares with servers of one version");
  }
  if (a.member("grid") != b.member("grid")) {
    refuse_mixture(client::local_reason::kGridMixed,
                   both(a, b) + " have different grids; slice all shares with the same mesh, pitch and placement");
  }
}

void require_same_job(const ShareFolder& a, const ShareFolder& b) {
  struct Part {
    const char* member;
    const char* name;
  };
  static constexpr std::array<Part, 8> kParts = {{{"mesh_id", "meshes"},
                                                  {"parts", "parts"},
                                                  {"placement", "placements"},
                                                  {"region", "regions"},
                                                  {"layout", "layouts"},
                                                  {"planes", "planes"},
                                                  {"printing", "materials, maps or halftones"},
                                                  {"cell_regions", "cell regions"}}};
  constexpr const char* kRemedy = "; slice all shares with the same options";
  require_one_engine_and_grid(a, b);
  for (const Part& part : kParts) {
    if (a.member(part.member) != b.member(part.member)) {
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

/// The materials of a share's manifest, with the voxels of the whole job.
std::string joined_materials(const std::string& materials, const client::SliceOutcome& counts) {
  JsonWriter json;
  json.begin_array();
  std::size_t index = 0;
  JsonScanner scanner(materials);
  for_each_item(scanner, [&] {
    const Struct material = parse_object(std::string(scanner.as_written("a material"))).value_or(Struct());
    const bool counted = index < counts.material_voxels.size();
    add_material(text(material, "name"), text(material, "rgba"), counted ? counts.material_voxels[index] : 0, json);
    ++index;
  });
  return json.end_array().text();
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
      if (other.layers[there].entry == shares_[s].layers[i].entry) continue;
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

std::string JoinedJob::manifest() const {
  client::SliceOutcome counts;
  JsonWriter layers;
  layers.begin_array();
  for (std::size_t s = 0; s < shares_.size(); ++s) {
    for (std::size_t i = 0; i < shares_[s].layers.size(); ++i) {
      if (!takes(s, i)) continue;
      const std::string& entry = shares_[s].layers[i].entry;
      layers.raw(entry);
      counts.add_counts(counts_of_entry(parse_object(entry).value_or(Struct())));
    }
  }
  layers.end_array();
  const ShareFolder& like = shares_.front();
  // All that the manifests of a job and of its share don't have in common.
  std::map<std::string, std::string> members = {{"job", JsonWriter().value(like.record.job_id).text()},
                                                {"voxel_count", std::to_string(counts.voxel_count)},
                                                {"voxels_interpolated", std::to_string(counts.voxels_interpolated)},
                                                {"voxels_unresolved", std::to_string(counts.voxels_unresolved)},
                                                {"voxels_repainted", std::to_string(counts.voxels_repainted)},
                                                {"voxels_off_map", std::to_string(counts.voxels_off_map)},
                                                {"voxels_scaled_up", std::to_string(counts.voxels_scaled_up)},
                                                {"least_fraction_sum", shortest(counts.least_fraction_sum)},
                                                {"max_residual_mm", shortest(counts.max_residual_mm)},
                                                {"layers", layers.text()}};
  JsonWriter json;
  json.begin_object();
  for (const auto& [name, value] : like.members) {
    if (name == "share") continue;
    if (name == "materials") members.emplace(name, joined_materials(value, counts));
    const auto own = members.find(name);
    json.key(name).raw(own == members.end() ? value : own->second);
  }
  return json.end_object().text() + "\n";
}

}  // namespace ccslice::cli
