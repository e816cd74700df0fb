// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/preview_parts.h"

#include <utility>

namespace ccslice::server {

void PreviewParts::begin() { *this = {}; }

bool PreviewParts::add(v1::PreviewStage stage, std::vector<v1::PreviewResponse> parts) {
  Picture& picture = pictures_[index(stage)];
  const bool is_new = std::exchange(picture.all, parts.size()) == 0;
  for (std::size_t k = picture.sent; k < parts.size(); ++k) waiting_.push_back(std::move(parts[k]));
  return is_new;
}

v1::PreviewResponse PreviewParts::take() {
  v1::PreviewResponse part = std::move(waiting_.front());
  waiting_.pop_front();
  ++pictures_[index(part.stage())].sent;
  return part;
}

void PreviewParts::drop() {
  lacks_any_ = lacks_any_ || !waiting_.empty();
  waiting_.clear();
}

}  // namespace ccslice::server
