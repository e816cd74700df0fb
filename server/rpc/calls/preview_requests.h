// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The requests of a preview: the one AT HAND, whose pictures are made, and the latest one, which WAITS. Of those in
// between only their settings (meshes, placement, printing) live on, in the one that waits.

#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ccslice/v1/preview.pb.h"

namespace ccslice::server {

struct ArrivedPreview {
  v1::PreviewRequest message;
  std::chrono::steady_clock::time_point arrived;
  std::vector<std::string> mesh_ids = {};  // That it names, each once.
  std::uint64_t bytes = 0;                 // That it takes. PreviewRequests counts them.
};

class PreviewRequests {
 public:
  /// Takes it as the one that waits. Throws ServiceError{REQUEST_MALFORMED} if its number isn't above those before.
  void accept(ArrivedPreview request);
  bool waits() const { return waiting_.has_value(); }
  const ArrivedPreview& at_hand() const { return at_hand_; }
  /// The one that waits is at hand from here on. REQUIRES: waits().
  void take_next();
  /// Nothing will be sent of the one at hand: what it set counts for the one that waits. REQUIRES: waits().
  void drop_at_hand();
  /// All that it asked for has been sent.
  void forget_at_hand() { at_hand_ = {}; }

  /// What both take, and the settings that hold.
  std::uint64_t bytes() const { return (waiting_ ? waiting_->bytes : 0) + at_hand_.bytes + setting_bytes_; }
  /// Requests of which nothing was or will be sent.
  std::uint64_t dropped() const { return dropped_; }

 private:
  void hand_on_settings(ArrivedPreview& dropped);

  std::uint64_t number_ = 0;
  std::optional<ArrivedPreview> waiting_;
  ArrivedPreview at_hand_;
  std::uint64_t setting_bytes_ = 0;  // Of the request that the settings came with, at most.
  std::uint64_t dropped_ = 0;
};

}  // namespace ccslice::server
