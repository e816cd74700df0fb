// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/view/view_previews.h"

#include <algorithm>
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

std::shared_ptr<const client::PreviewPicture> ViewPreviews::show(v1::PreviewRequest request) {
  std::unique_lock lock(mutex_);
  const std::string mesh_id = client::mesh_id_of(request);
  if (!stream_ || stream_->over || stream_->mesh_id != mesh_id) {
    const std::shared_ptr<Stream> before = open(mesh_id);
    lock.unlock();
    if (before) close(before);
    lock.lock();
  }
  const std::shared_ptr<Stream> stream = stream_;
  // The server keeps what it has made of a printing until another one comes.
  std::string printing = request.printing().SerializeAsString();
  if (request.has_printing() && printing == stream->printing_bytes) {
    request.clear_printing();
  } else if (request.has_printing()) {
    stream->printing_bytes = std::move(printing);
  }
  const std::uint64_t number = stream->call->ask(std::move(request));
  stream->asked = number;
  changed_.notify_all();
  const auto has_come = [&] { return stream->latest && stream->latest->number >= number; };
  changed_.wait(lock, [&] { return has_come() || stream->over || stream->asked > number; });
  if (has_come() && stream->latest->number == number) return stream->latest;
  if (stream->asked > number || stream != stream_) return nullptr;
  if (stream->error) std::rethrow_exception(stream->error);
  return nullptr;
}

std::shared_ptr<ViewPreviews> ViewPages::of(const std::string& page) {
  std::shared_ptr<ViewPreviews> oldest;  // Ends its call without the lock.
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find(pages_, page, [](const auto& entry) { return entry.first; });
  if (found != pages_.end()) {
    pages_.splice(pages_.begin(), pages_, found);
  } else {
    pages_.emplace_front(page, std::make_shared<ViewPreviews>(client_));
    if (pages_.size() > kMostPages) {
      oldest = std::move(pages_.back().second);
      pages_.pop_back();
    }
  }
  return pages_.front().second;
}

}  // namespace ccslice::cli
