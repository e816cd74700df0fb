// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The job that shares make together, as their manifests say: the same layers and the same manifest.json as if it had
// been sliced at once.

#pragma once

#include <cstddef>
#include <vector>

#include "client/cli/output/share_folder.h"

namespace ccslice::cli {

class JoinedJob {
 public:
  /// Throws ClientError{ENGINE_MIXED, GRID_MIXED} for shares of several engines or grids, and Error{kFileSyntax} if
  /// they differ in something else, if layers are missing, or if two shares say different things of a layer.
  /// REQUIRES: shares.
  explicit JoinedJob(std::vector<ShareFolder> shares);

  const std::vector<ShareFolder>& shares() const { return shares_; }
  std::size_t layers() const { return sources_.size(); }
  /// Whether the job's layer is taken from this share: some may be in several. `layer`: of the share, from 0.
  bool takes(std::size_t share, std::size_t layer) const;
  /// The share that has the contact sheet, or null.
  const ShareFolder* with_contact_sheet() const;
  v1::Manifest manifest() const;

 private:
  void require_one_job() const;
  void require_no_gap() const;
  void find_sources();

  const std::vector<ShareFolder> shares_;  // By their first layers.
  std::vector<std::size_t> sources_;       // The share of each layer.
};

}  // namespace ccslice::cli
