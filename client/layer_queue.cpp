// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/layer_queue.h"

#include <algorithm>

namespace ccslice::client {
namespace {

std::uint64_t bytes_of(const Layer& layer) {
  std::uint64_t bytes = sizeof(Layer);
  for (const Plane& plane : layer.planes) bytes += plane.encoded.size() + plane.samples.size();
  for (const ContourLoop& loop : layer.contours) {
    bytes +=
        sizeof(double) * (loop.points_mm.size() + loop.parameters.size()) + sizeof(loop.faces[0]) * loop.faces.size();
  }
  return bytes;
}

}  // namespace

LayerQueue::LayerQueue(const LayerBlock& whole, std::uint32_t streams, std::uint64_t most_bytes)
    : streams_(streams), most_bytes_(most_bytes), left_(whole), due_(whole.first), end_(whole.first + whole.count) {}

std::optional<LayerBlock> LayerQueue::take() {
  constexpr std::uint32_t kMost = 64, kFewest = 16;  // A block's first layer takes the time of ten, or more.
  const std::lock_guard lock(mutex_);
  if (stopped_ || left_.count == 0) return std::nullopt;
  // Towards the end blocks get smaller, so that all streams end at about the same time.
  std::uint32_t count = std::clamp(left_.count / streams_, kFewest, kMost);
  // Where layers are so large that blocks don't fit, streams would wait for each other.
  if (largest_bytes_ > 0) {
    const std::uint64_t fit = std::max<std::uint64_t>(1, most_bytes_ / (streams_ * largest_bytes_));
    count = static_cast<std::uint32_t>(std::min<std::uint64_t>(count, fit));
  }
  const LayerBlock block = {left_.first, std::min(count, left_.count)};
  left_.first += block.count;
  left_.count -= block.count;
  return block;
}

bool LayerQueue::put(const v1::SliceHeader& header, Layer layer) {
  const std::uint64_t bytes = bytes_of(layer);
  const std::uint32_t index = layer.index;
  std::unique_lock lock(mutex_);
  largest_bytes_ = std::max(largest_bytes_, bytes);
  changed_.wait(lock, [&] { return stopped_ || index == due_ || kept_bytes_ + bytes <= most_bytes_; });
  if (stopped_) return false;
  kept_.emplace(index, Item{header, std::move(layer)});
  kept_bytes_ += bytes;
  changed_.notify_all();
  return true;
}

void LayerQueue::fail(std::exception_ptr error) {
  const std::lock_guard lock(mutex_);
  if (!stopped_) error_ = std::move(error);
  stopped_ = true;
  changed_.notify_all();
}

void LayerQueue::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  changed_.notify_all();
}

bool LayerQueue::done() const {
  const std::lock_guard lock(mutex_);
  return due_ == end_;
}

std::optional<LayerQueue::Item> LayerQueue::next(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  const auto has_come = [&] { return !kept_.empty() && kept_.begin()->first == due_; };
  changed_.wait_for(lock, patience, [&] { return error_ || has_come(); });
  if (has_come()) {
    Item item = std::move(kept_.extract(kept_.begin()).mapped());
    kept_bytes_ -= bytes_of(item.layer);
    ++due_;
    changed_.notify_all();
    return item;
  }
  if (error_) std::rethrow_exception(error_);
  return std::nullopt;
}

}  // namespace ccslice::client
