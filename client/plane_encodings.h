// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The table of encodings: all that the client asks of one.

#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "ccslice/v1/job.pb.h"

namespace ccslice::client {

struct PlaneEncoding {
  v1::PlaneEncoding value;
  std::string_view name;       // In manifests. --encoding takes it with '-' for '_'.
  std::string_view extension;  // Of its files.
  std::string_view note = {};  // On the name, in the help of --encoding.

  /// Whether it is for planes of materials and cell regions alone: --encoding means the default for others then.
  bool only_materials = false;
  /// Without alpha, which the command line asks for on its own, this is that encoding; UNSPECIFIED if there is none.
  v1::PlaneEncoding without_alpha = v1::PLANE_ENCODING_UNSPECIFIED;
  /// How many numbers a picture file has for each sample, at most: with alpha, or as colours.
  unsigned numbers_a_sample = 1;
  /// Why the command line doesn't ask for such a plane so; empty if it does. Null: it always does.
  std::string_view (*objection)(const v1::PlaneSpec& plane) = nullptr;
  /// Whether it may take a byte for each voxel where samples take less.
  bool widens = false;
  /// The samples, `bytes` of them. Throws ClientError{DATA_LOSS, ANSWER_CORRUPT}. Null for picture files.
  std::string (*decode)(const std::string& encoded, const v1::PlaneSpec& spec, const v1::GridExtent& extent,
                        std::uint64_t bytes) = nullptr;
  /// Checks a picture file: throws the same error unless it looks like a whole one.
  void (*check)(const std::string& encoded) = nullptr;
};

/// All of them, in the order in which the help names them.
std::span<const PlaneEncoding> plane_encodings();

/// Null for values that this client doesn't know.
const PlaneEncoding* find_encoding(v1::PlaneEncoding value);

}  // namespace ccslice::client
