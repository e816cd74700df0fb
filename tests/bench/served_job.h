// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Whole jobs through a real server process on this machine and the client library: every layer received, decoded and
// checked.

#pragma once

#include <cstdint>
#include <string>

#include "client/client.h"
#include "tests/bench/printer_job.h"
#include "tests/integration/running_server.h"

namespace ccslice::bench {

struct LayerRange {
  std::uint32_t first = 0, count = 0;
};

/// What is asked for of every layer.
enum class JobPictures {
  kContone,  // The occupancy and one channel of 8 bits, as runs.
  kIndexed,  // Three materials mixed along the channel by blue noise, as indexed PNG pictures of 2 bits,
  kRgba,     // or as RGBA ones.
};

/// What a job took. Wall time.
struct ServedCost {
  double upload_seconds = 0;  // Preparation included.
  double slice_seconds = 0;   // From the call to the last layer.
  std::uint64_t layers = 0, voxels = 0, encoded_bytes = 0;
};

class JobServer {
 public:
  explicit JobServer(int threads);

  void upload(const PrinterJob& job);
  /// Uploads the part, unless the server holds it, and slices the range.
  ServedCost run(const PrinterJob& job, const LayerRange& range, JobPictures pictures = JobPictures::kContone);
  /// From the call for all layers from `first` on to the first one's arrival; the call is cancelled then. REQUIRES: the
  /// server holds the part.
  double first_layer_seconds(const PrinterJob& job, std::uint32_t first);

 private:
  server::RunningServer server_;
  client::Client client_;
};

}  // namespace ccslice::bench
