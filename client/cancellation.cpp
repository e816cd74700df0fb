// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cancellation.h"

namespace ccslice::client {

void Cancellation::cancel() {
  const std::lock_guard lock(mutex_);
  cancelled_ = true;
  for (grpc::ClientContext* context : running_) context->TryCancel();
  changed_.notify_all();
}

bool Cancellation::cancelled() const {
  const std::lock_guard lock(mutex_);
  return cancelled_;
}

bool Cancellation::wait_for(std::chrono::milliseconds duration) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, duration, [this] { return cancelled_; });
}

Cancellation::Scope::Scope(Cancellation* cancellation, grpc::ClientContext& context)
    : cancellation_(cancellation), context_(context) {
  if (!cancellation_) return;
  const std::lock_guard lock(cancellation_->mutex_);
  cancellation_->running_.insert(&context_);
  if (cancellation_->cancelled_) context_.TryCancel();
}

Cancellation::Scope::~Scope() {
  if (!cancellation_) return;
  const std::lock_guard lock(cancellation_->mutex_);
  cancellation_->running_.erase(&context_);
}

}  // namespace ccslice::client
