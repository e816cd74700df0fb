// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where sliced layers go: a folder (layer_folder.h), or standard output (layer_stream.h).

#pragma once

#include <cstdint>
#include <string>

#include "client/client.h"

namespace ccslice::cli {

/// All that write throw Error{kFileUnwritable}.
class LayerSink {
 public:
  LayerSink() = default;
  virtual ~LayerSink() = default;
  LayerSink(const LayerSink&) = delete;
  LayerSink& operator=(const LayerSink&) = delete;

  /// Counts of the layers that are there already: the first ones of the job.
  virtual const client::SliceOutcome& finished() const = 0;
  virtual void write(const client::Layer& layer) = 0;
  virtual bool takes_contact_sheet() const { return true; }
  /// `png`: the file's bytes. Returns its path. REQUIRES: takes_contact_sheet().
  virtual std::string write_contact_sheet(const std::string& png) = 0;
  /// Writes what says that the job is complete, with the warnings of its plan.
  virtual void finish(const client::SliceOutcome& outcome, const v1::SliceJob& sliced,
                      const v1::PlanSlicesResponse& plan) = 0;
  virtual std::uint64_t written_bytes() const = 0;
};

}  // namespace ccslice::cli
