// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The content of a plane of runs from arbitrary bytes: its samples or a ClientError, nothing else. Three bytes choose
// type, columns and rows.

#include "client/runs_frame.h"

#include <cstdint>
#include <cstdlib>
#include <string>

#include "client/client_error.h"
#include "client/layer.h"
#include "tests/fuzz/byte_reader.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace client = ccslice::client;
  ccslice::fuzz::ByteReader bytes(data, size);
  ccslice::v1::PlaneSpec spec;
  const unsigned kind = bytes.next() % 8;
  spec.set_sample_type(static_cast<ccslice::v1::SampleType>(1 + kind % 6));
  if (kind > 5) {
    spec.set_sample_type(ccslice::v1::SAMPLE_TYPE_FLOAT32);
    for (unsigned channel = 4; channel < kind; ++channel) spec.mutable_channels()->add_names(std::to_string(channel));
  }
  ccslice::v1::GridExtent extent;
  extent.set_columns(1u + bytes.next());
  extent.set_rows(1u + bytes.next());
  const std::uint64_t samples = client::sample_bytes(spec, extent);
  try {
    if (client::expand_runs(spec, extent, bytes.rest(), samples).size() != samples) std::abort();
  } catch (const client::ClientError&) {
  }
  return 0;
}
