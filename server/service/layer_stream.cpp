// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/layer_stream.h"

#include <algorithm>
#include <utility>

namespace ccslice::server {

StreamWindow choose_window(std::uint64_t layer_bytes, std::uint64_t window_bytes, std::size_t threads) {
  const std::uint64_t room = std::max<std::uint64_t>(1, window_bytes / std::max<std::uint64_t>(1, layer_bytes));
  const std::uint64_t wanted_slabs = threads + 2;
  StreamWindow window;
  while (window.slab_layers > 1 && window.slab_layers * wanted_slabs > room) window.slab_layers /= 2;
  window.window_slabs =
      static_cast<std::uint32_t>(std::min(wanted_slabs, std::max<std::uint64_t>(1, room / window.slab_layers)));
  return window;
}

std::shared_ptr<LayerStream> LayerStream::start(Executor& executor, LayerRange range, StreamWindow window,
                                                MakeCompute make, Notify notify) {
  std::shared_ptr<LayerStream> stream(new LayerStream(executor, range, window, std::move(make), std::move(notify)));
  stream->start_slabs();
  return stream;
}

LayerStream::LayerStream(Executor& executor, LayerRange range, StreamWindow window, MakeCompute make, Notify notify)
    : lane_(executor.make_lane()),
      window_(window),
      make_(std::move(make)),
      notify_(std::move(notify)),
      next_layer_(range.first),
      end_layer_(range.first + range.count) {}

/// Slabs begin at multiples of their size, whatever the range.
void LayerStream::start_slabs() {
  std::vector<SlabPtr> started;
  {
    std::lock_guard lock(mutex_);
    while (!cancelled_ && !failed_ && next_layer_ < end_layer_ && in_flight_.size() < window_.window_slabs) {
      const std::uint64_t slab_end = (next_layer_ / window_.slab_layers + std::uint64_t{1}) * window_.slab_layers;
      const auto count = static_cast<std::uint32_t>(std::min<std::uint64_t>(slab_end, end_layer_) - next_layer_);
      auto slab = std::make_shared<Slab>();
      slab->layers = {.first = next_layer_, .count = count};
      next_layer_ += count;
      in_flight_.push_back(slab);
      started.push_back(std::move(slab));
    }
  }
  for (const SlabPtr& slab : started) {
    lane_.post([self = shared_from_this(), slab] { self->compute_next(slab); });
  }
}

void LayerStream::compute_next(const SlabPtr& slab) {
  std::optional<Layer> layer;
  std::exception_ptr error;
  try {
    cancel_.throw_if_cancelled();
    if (!slab->compute) slab->compute = take_compute();
    layer = slab->compute(slab->layers.first + slab->computed, cancel_);
  } catch (...) {
    error = std::current_exception();
  }
  finish_layer(slab, std::move(layer), std::move(error));
}

LayerStream::ComputeLayer LayerStream::take_compute() {
  {
    std::lock_guard lock(mutex_);
    if (!idle_computes_.empty()) {
      ComputeLayer compute = std::move(idle_computes_.back());
      idle_computes_.pop_back();
      return compute;
    }
  }
  return make_();
}

void LayerStream::finish_layer(const SlabPtr& slab, std::optional<Layer> layer, std::exception_ptr error) {
  bool slab_done = false;
  Notify notify;
  {
    std::lock_guard lock(mutex_);
    if (error) {
      slab->error = std::move(error);
      failed_ = true;
    } else {
      ++slab->computed;
      if (!cancelled_) slab->ready.push_back(std::move(*layer));
    }
    slab_done = slab->done() || cancelled_;
    if (slab_done && !slab->error && !cancelled_) idle_computes_.push_back(std::move(slab->compute));
    if (slab_done) slab->compute = nullptr;
    if (waiting_ && worth_pulling_locked()) {
      waiting_ = false;
      notify = notify_;
    }
  }
  if (!slab_done) {
    lane_.post_front([self = shared_from_this(), slab] { self->compute_next(slab); });
  }
  if (notify) notify();
}

bool LayerStream::worth_pulling_locked() const {
  return cancelled_ || (!in_flight_.empty() && (!in_flight_.front()->ready.empty() || in_flight_.front()->error));
}

LayerStream::Pull LayerStream::pull(Layer& layer) {
  {
    std::lock_guard lock(mutex_);
    if (cancelled_) return Pull::kFailed;
    if (in_flight_.empty()) return Pull::kEnd;
    Slab& slab = *in_flight_.front();
    if (slab.ready.empty()) {
      if (slab.error) return Pull::kFailed;
      waiting_ = true;
      return Pull::kPending;
    }
    layer = std::move(slab.ready.front());
    slab.ready.pop_front();
    if (slab.ready.empty() && slab.computed == slab.layers.count) in_flight_.pop_front();
  }
  start_slabs();
  return Pull::kLayer;
}

std::exception_ptr LayerStream::error() {
  std::lock_guard lock(mutex_);
  if (!cancelled_ && !in_flight_.empty() && in_flight_.front()->error) return in_flight_.front()->error;
  return std::make_exception_ptr(Error(ErrorCode::kCancelled, "cancelled by the caller or by its deadline"));
}

void LayerStream::cancel() {
  std::deque<SlabPtr> dropped;
  std::vector<ComputeLayer> idle;
  Notify notify;
  {
    std::lock_guard lock(mutex_);
    if (cancelled_) return;
    cancelled_ = true;
    cancel_.cancel();
    dropped.swap(in_flight_);
    idle.swap(idle_computes_);
    for (const SlabPtr& slab : dropped) std::deque<Layer>().swap(slab->ready);
    if (waiting_) notify = notify_;
    waiting_ = false;
    notify_ = nullptr;
  }
  if (notify) notify();
}

}  // namespace ccslice::server
