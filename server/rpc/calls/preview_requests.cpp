// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/preview_requests.h"

#include <algorithm>
#include <string>
#include <utility>

#include "server/service/base/service_error.h"

namespace ccslice::server {

void PreviewRequests::accept(ArrivedPreview request) {
  if (request.message.number() <= number_) {
    throw ServiceError(ServiceErrorCode::kRequestMalformed,
                       "number: " + std::to_string(request.message.number()) + " comes after " +
                           std::to_string(number_) + "; numbers of a call go up, from 1",
                       "number");
  }
  number_ = request.message.number();
  std::optional<ArrivedPreview> before = std::exchange(waiting_, std::move(request));
  if (before) hand_on_settings(*before);
  waiting_->bytes = waiting_->message.SpaceUsedLong();
}

void PreviewRequests::take_next() {
  at_hand_ = std::move(*waiting_);
  waiting_.reset();
  if (at_hand_.message.has_printing() || at_hand_.message.has_placement()) setting_bytes_ = at_hand_.bytes;
}

void PreviewRequests::drop_at_hand() {
  hand_on_settings(at_hand_);
  waiting_->bytes = waiting_->message.SpaceUsedLong();
}

void PreviewRequests::hand_on_settings(ArrivedPreview& dropped) {
  ++dropped_;
  for (const std::string& id : waiting_->mesh_ids) {
    if (std::ranges::find(dropped.mesh_ids, id) == dropped.mesh_ids.end()) dropped.mesh_ids.push_back(id);
  }
  waiting_->mesh_ids = std::move(dropped.mesh_ids);
  v1::PreviewRequest &next = waiting_->message, &before = dropped.message;
  if (!next.has_placement() && before.has_placement()) next.mutable_placement()->Swap(before.mutable_placement());
  if (!next.has_printing() && before.has_printing()) next.mutable_printing()->Swap(before.mutable_printing());
}

}  // namespace ccslice::server
