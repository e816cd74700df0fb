// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/preview_requests.h"

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
  if (before) hand_on_settings(before->message);
  waiting_->bytes = waiting_->message.SpaceUsedLong();
}

void PreviewRequests::take_next() {
  at_hand_ = std::move(*waiting_);
  waiting_.reset();
  if (at_hand_.message.has_printing() || at_hand_.message.has_placement()) setting_bytes_ = at_hand_.bytes;
}

void PreviewRequests::drop_at_hand() {
  hand_on_settings(at_hand_.message);
  waiting_->bytes = waiting_->message.SpaceUsedLong();
}

void PreviewRequests::hand_on_settings(v1::PreviewRequest& dropped) {
  ++dropped_;
  v1::PreviewRequest& next = waiting_->message;
  if (next.mesh_id().empty()) next.set_mesh_id(dropped.mesh_id());
  if (!next.has_placement() && dropped.has_placement()) next.mutable_placement()->Swap(dropped.mutable_placement());
  if (!next.has_printing() && dropped.has_printing()) next.mutable_printing()->Swap(dropped.mutable_printing());
}

}  // namespace ccslice::server
