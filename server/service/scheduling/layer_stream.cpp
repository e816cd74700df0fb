// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/layer_stream.h"

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
  window.window_bytes = window_bytes;
  return window;
}

std::uint64_t memory_bytes(const Layer& layer) {
  std::uint64_t bytes = sizeof layer;
  for (const EncodedPlane& plane : layer.planes) bytes += sizeof plane + plane.bytes.capacity();
  for (const ContourLoop& loop : layer.contours.loops)
    bytes += sizeof loop + loop.points.capacity() * sizeof(ContourPoint);
  return bytes;
}

std::shared_ptr<LayerStream> LayerStream::start(const Executor::Lane& lane, LayerRange range, StreamWindow window,
                                                MakeCompute make, Notify notify, ComputeLimit limit) {
  std::shared_ptr<LayerStream> stream(
      new LayerStream(lane, range, window, std::move(make), std::move(notify), std::move(limit)));
  stream->start_slabs();
  return stream;
}

LayerStream::LayerStream(const Executor::Lane& lane, LayerRange range, StreamWindow window, MakeCompute make,
                         Notify notify, ComputeLimit limit)
    : lane_(lane),
      make_(std::move(make)),
      limit_(std::move(limit)),
      window_(window),
      consumer_{.notify = std::move(notify)},
      next_layer_(range.first),
      end_layer_(range.first + range.count) {}

void LayerStream::start_slabs() {
  std::vector<SlabPtr> started;
  {
    std::lock_guard lock(mutex_);
    start_slabs_locked(started);
  }
  post(started);
}

void LayerStream::post(const std::vector<SlabPtr>& slabs) {
  for (const SlabPtr& slab : slabs) {
    lane_.post([self = shared_from_this(), slab] { self->compute_next(slab); });
  }
}

/// Those that were parked, then new ones. Slabs begin at multiples of their size, whatever the range.
void LayerStream::start_slabs_locked(std::vector<SlabPtr>& started) {
  if (cancelled_) return;
  for (const SlabPtr& slab : in_flight_) {
    if (!slab->parked || !has_room_locked(*slab)) continue;
    slab->parked = false;
    started.push_back(slab);
  }
  while (!failed_ && next_layer_ < end_layer_ && in_flight_.size() < window_.window_slabs) {
    const std::uint64_t slab_end = (next_layer_ / window_.slab_layers + std::uint64_t{1}) * window_.slab_layers;
    const auto count = static_cast<std::uint32_t>(std::min<std::uint64_t>(slab_end, end_layer_) - next_layer_);
    auto slab = std::make_shared<Slab>();
    slab->layers = {.first = next_layer_, .count = count};
    next_layer_ += count;
    in_flight_.push_back(slab);
    started.push_back(std::move(slab));
  }
  active_ += static_cast<std::uint32_t>(started.size());
}

/// For the next layer of a slab in flight.
bool LayerStream::has_room_locked(const Slab& slab) const {
  const bool awaited = !in_flight_.empty() && &slab == in_flight_.front().get() && slab.ready.empty();
  return awaited || memory_.held_bytes + (running_ + std::uint64_t{1}) * memory_.largest_bytes <= window_.window_bytes;
}

void LayerStream::compute_next(const SlabPtr& slab) {
  if (!begin_layer(*slab)) return;
  std::optional<Layer> layer;
  std::exception_ptr error;
  ComputeLayer compute = std::exchange(slab->compute, nullptr);
  try {
    cancel_.throw_if_cancelled();
    if (!compute) compute = make_(cancel_);
    layer = compute(slab->layers.first + slab->computed, cancel_);
  } catch (...) {
    error = std::current_exception();
  }
  finish_layer(slab, std::move(layer), std::move(error), std::move(compute));
}

/// False if the slab has to wait for room or for a function, which other layers took meanwhile.
bool LayerStream::begin_layer(Slab& slab) {
  std::vector<IdleCompute> dropped;
  std::lock_guard lock(mutex_);
  slab.parked = !cancelled_ && !(has_room_locked(slab) && claim_compute_locked(slab));
  if (slab.parked) {
    --active_;
    if (slab.compute) idle_computes_.push_back({slab.layers.first, std::exchange(slab.compute, nullptr)});
    trim_computes_locked(dropped);
  } else {
    ++running_;
  }
  return !slab.parked;
}

/// The slab's own while it is being computed; of idle ones rather that which it had before it was parked; or else one
/// that will be made.
bool LayerStream::claim_compute_locked(Slab& slab) {
  if (slab.compute) return true;
  if (idle_computes_.empty()) {
    if (computes_ > 0 && limit_.may_add && !limit_.may_add()) return false;
    ++computes_;
    return true;
  }
  const auto own = std::find_if(idle_computes_.begin(), idle_computes_.end(),
                                [&](const IdleCompute& idle) { return idle.first_layer == slab.layers.first; });
  if (own != idle_computes_.end()) std::swap(*own, idle_computes_.back());
  slab.compute = std::move(idle_computes_.back().compute);
  idle_computes_.pop_back();
  return true;
}

/// The one that works on the layer that is awaited stays.
bool LayerStream::gives_compute_back_locked(const Slab& slab) const {
  if (computes_ < 2 || !limit_.is_crowded || !limit_.is_crowded()) return false;
  return in_flight_.empty() || &slab != in_flight_.front().get();
}

void LayerStream::finish_layer(const SlabPtr& slab, std::optional<Layer> layer, std::exception_ptr error,
                               ComputeLayer compute) {
  bool goes_on = false;
  Notify notify;
  std::vector<SlabPtr> started;
  std::vector<IdleCompute> dropped;
  {
    std::lock_guard lock(mutex_);
    --running_;
    failed_ = failed_ || error;
    slab->error = std::move(error);
    if (layer) add_layer_locked(*slab, std::move(*layer));
    if (compute && gives_compute_back_locked(*slab))
      dropped.push_back({slab->layers.first, std::exchange(compute, {})});
    if (!compute) --computes_;
    goes_on = compute && !slab->done() && !cancelled_ && has_room_locked(*slab);
    if (goes_on) {
      slab->compute = std::move(compute);
    } else if (compute) {
      idle_computes_.push_back({slab->layers.first, std::move(compute)});
    }
    slab->parked = !slab->done() && !goes_on;
    if (!goes_on) --active_;
    start_slabs_locked(started);  // Less is being computed now, so there may be room.
    trim_computes_locked(dropped);
    if (consumer_.waiting && worth_pulling_locked()) {
      consumer_.waiting = false;
      notify = consumer_.notify;
    }
  }
  if (goes_on) {
    lane_.post_front([self = shared_from_this(), slab] { self->compute_next(slab); });
  }
  post(started);
  if (notify) notify();
}

void LayerStream::add_layer_locked(Slab& slab, Layer layer) {
  ++slab.computed;
  if (cancelled_) return;
  const std::uint64_t bytes = memory_bytes(layer);
  memory_.held_bytes += bytes;
  memory_.largest_bytes = std::max(memory_.largest_bytes, bytes);
  slab.ready.push_back(std::move(layer));
}

/// Their scratch memory may be large: a stream that has come to a stop keeps one, a cancelled one none.
void LayerStream::trim_computes_locked(std::vector<IdleCompute>& dropped) {
  std::size_t kept = idle_computes_.size();
  if (limit_.is_crowded && limit_.is_crowded()) kept = std::min<std::size_t>(kept, computes_ > kept ? 0 : 1);
  if (active_ == 0) kept = std::min<std::size_t>(kept, 1);
  if (cancelled_) kept = 0;
  while (idle_computes_.size() > kept) {
    dropped.push_back(std::move(idle_computes_.back()));
    idle_computes_.pop_back();
    --computes_;
  }
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
      consumer_.waiting = true;
      return Pull::kPending;
    }
    layer = std::move(slab.ready.front());
    slab.ready.pop_front();
    memory_.held_bytes -= memory_.taken_bytes;
    memory_.taken_bytes = memory_bytes(layer);
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

void LayerStream::set_window_slabs(std::uint32_t slabs) {
  {
    const std::lock_guard lock(mutex_);
    window_.window_slabs = slabs;
  }
  start_slabs();
}

void LayerStream::cancel() {
  std::deque<SlabPtr> dropped;
  std::vector<IdleCompute> idle;
  Notify notify;
  {
    std::lock_guard lock(mutex_);
    if (cancelled_) return;
    cancelled_ = true;
    cancel_.cancel();
    dropped.swap(in_flight_);
    idle.swap(idle_computes_);
    computes_ -= idle.size();
    for (const SlabPtr& slab : dropped) std::deque<Layer>().swap(slab->ready);
    if (consumer_.waiting) notify = consumer_.notify;
    consumer_.waiting = false;
    consumer_.notify = nullptr;
  }
  if (notify) notify();
}

}  // namespace ccslice::server
