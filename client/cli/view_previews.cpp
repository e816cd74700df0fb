// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/view_previews.h"

#include <utility>

namespace ccslice::cli {

ViewPreviews::~ViewPreviews() {
  std::unique_lock lock(mutex_);
  const std::shared_ptr<Stream> last = std::move(stream_);
  lock.unlock();
  if (last) close(last);
}

void ViewPreviews::close(const std::shared_ptr<Stream>& stream) {
  stream->cancellation.cancel();
  stream->reader.join();
}

std::shared_ptr<ViewPreviews::Stream> ViewPreviews::open(const std::string& mesh_id) {
  std::shared_ptr<Stream> before = std::exchange(stream_, std::make_shared<Stream>());
  if (before) before->over = true;
  changed_.notify_all();
  stream_->mesh_id = mesh_id;
  stream_->call = std::make_unique<client::PreviewStream>(client_, mesh_id,
                                                          client::CallOptions{.cancellation = &stream_->cancellation});
  stream_->reader = std::thread([this, stream = stream_] { read(stream); });
  return before;
}

void ViewPreviews::read(const std::shared_ptr<Stream>& stream) {
  std::exception_ptr error;
  try {
    while (auto picture = stream->call->next()) {
      const std::lock_guard lock(mutex_);
      // Of each request the first: whoever asked for a coarse one may not have taken it yet when the full one comes.
      if (stream->latest && stream->latest->number == picture->number) continue;
      stream->latest = std::make_shared<const client::PreviewPicture>(std::move(*picture));
      changed_.notify_all();
    }
  } catch (...) {
    error = std::current_exception();
  }
  const std::lock_guard lock(mutex_);
  stream->over = true;
  stream->error = error;
  changed_.notify_all();
}

std::shared_ptr<const client::PreviewPicture> ViewPreviews::show(const v1::PreviewRequest& request) {
  std::unique_lock lock(mutex_);
  if (!stream_ || stream_->over || stream_->mesh_id != request.mesh_id()) {
    const std::shared_ptr<Stream> before = open(request.mesh_id());
    lock.unlock();
    if (before) close(before);
    lock.lock();
  }
  const std::shared_ptr<Stream> stream = stream_;
  const std::uint64_t number = stream->call->ask(request);
  stream->asked = number;
  changed_.notify_all();
  const auto has_come = [&] { return stream->latest && stream->latest->number >= number; };
  changed_.wait(lock, [&] { return has_come() || stream->over || stream->asked > number; });
  if (has_come() && stream->latest->number == number) return stream->latest;
  if (stream->asked > number || stream != stream_) return nullptr;
  if (stream->error) std::rethrow_exception(stream->error);
  return nullptr;
}

}  // namespace ccslice::cli
