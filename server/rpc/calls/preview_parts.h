// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The pictures of one request on their way to the client, message by message. They may be dropped in their middle, to
// be painted again when the client reads on: what it has already is left out then.

#pragma once

#include <array>
#include <cstddef>
#include <deque>
#include <vector>

#include "ccslice/v1/preview.pb.h"

namespace ccslice::server {

class PreviewParts {
 public:
  /// Another request's: nothing of them has been sent.
  void begin();
  /// The same request's pictures are painted again, as far as they are still wanted.
  void begin_again() { lacks_any_ = false; }
  /// A picture's, in order; the same ones as before if it is painted again. Whether it wasn't there before.
  bool add(v1::PreviewStage stage, std::vector<v1::PreviewResponse> parts);
  bool empty() const { return waiting_.empty(); }
  /// The next one, which counts as sent. REQUIRES: !empty().
  v1::PreviewResponse take();
  /// Forgets those that wait, which have to be added again.
  void drop();
  /// Whether some were dropped since then.
  bool lacks_any() const { return lacks_any_; }
  bool has_sent_any() const { return pictures_[0].sent + pictures_[1].sent > 0; }
  bool has_sent_any(v1::PreviewStage stage) const { return of(stage).sent > 0; }
  bool has_sent_all(v1::PreviewStage stage) const { return of(stage).sent > 0 && of(stage).sent == of(stage).all; }

 private:
  struct Picture {
    std::size_t sent = 0, all = 0;  // Parts; all: once they are known.
  };
  static std::size_t index(v1::PreviewStage stage) { return stage == v1::PREVIEW_STAGE_FULL ? 1 : 0; }
  const Picture& of(v1::PreviewStage stage) const { return pictures_[index(stage)]; }

  std::array<Picture, 2> pictures_;  // Coarse, full.
  std::deque<v1::PreviewResponse> waiting_;
  bool lacks_any_ = false;
};

}  // namespace ccslice::server
