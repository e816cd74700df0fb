// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A range of layers, computed out of order by many workers, delivered in order to one consumer that pulls.
//
// The range is cut into SLABS of consecutive layers. At most `window_slabs` slabs are in flight: being computed, or
// computed and not yet taken. A slab is started only when the window has room, so memory is bounded by the window
// whatever the range, and a worker never waits for the consumer: one that reads slowly, or not at all, occupies memory
// but no thread. Within a slab each layer is a piece of work of its own.
//
// How large layers come out is known only when they are there: contours have no bound to speak of. So what is held is
// counted too, the layer that the consumer took last included, and a layer is begun only if as much as the largest one
// so far still fits into `window_bytes`; otherwise its slab is PARKED until there is room. The layer that the consumer
// waits for is always computed. The window is exceeded by the layers being computed at most.
//
// What computes layers may be large too, and scarce: a slab for which there is none is parked as well. One is always
// there.
//
// Pulling never blocks: when the next layer isn't ready, `pull` says so and `notify` is called once it is worth trying
// again.

#pragma once

#include <cstdint>
#include <deque>
#include <exception>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "core/base/cancellation.h"
#include "core/job/slice_job.h"
#include "server/service/scheduling/executor.h"

namespace ccslice::server {

/// Layers [first, first + count).
struct LayerRange {
  std::uint32_t first = 0;
  std::uint32_t count = 0;
};

/// How a stream uses its memory.
struct StreamWindow {
  std::uint32_t slab_layers = kSlabLayers;  // A divisor of kSlabLayers.
  std::uint32_t window_slabs = 4;
  std::uint64_t window_bytes = UINT64_MAX;
};

/// What bounds how many layers are computed at the same time, beyond the first. Asked under a lock, on any thread.
struct ComputeLimit {
  /// Whether one more function may be made; then it will be, unless the stream is cancelled. DEFAULT: always.
  std::function<bool()> may_add;
  /// Whether others need what functions hold: all but one go when their layers are done. DEFAULT: never.
  std::function<bool()> is_crowded;
};

/// What a layer occupies.
std::uint64_t memory_bytes(const Layer& layer);

/// The largest window whose layers, `layer_bytes` each, fit into `window_bytes`: at most a slab per thread and two
/// more; smaller slabs where layers are large; one single layer if there's no room for more.
StreamWindow choose_window(std::uint64_t layer_bytes, std::uint64_t window_bytes, std::size_t threads);

class LayerStream : public std::enable_shared_from_this<LayerStream> {
 public:
  /// Computes one layer. Used by one worker at a time; may keep scratch memory between layers. It computes the layers
  /// of one slab one after the other, as long as the window has room for them. May throw.
  using ComputeLayer = std::function<Layer(std::uint32_t layer, const CancellationToken& cancel)>;
  /// Makes such a function, on a worker thread. Called as often as layers are computed at the same time; one
  /// function at most is kept while none is. May throw; where one throws, the next that is wanted is tried anew.
  using MakeCompute = std::function<ComputeLayer(const CancellationToken& cancel)>;
  /// Called on a worker's thread or the canceller's, without locks held.
  using Notify = std::function<void()>;

  enum class Pull {
    kLayer,    // `layer` was written.
    kPending,  // Not ready: `notify` will be called once.
    kEnd,      // All layers were taken.
    kFailed,   // See error(). Layers before the failing one were delivered, unless cancelled.
  };

  /// Starts at once. The lane's executor outlives the stream.
  [[nodiscard]] static std::shared_ptr<LayerStream> start(const Executor::Lane& lane, LayerRange range,
                                                          StreamWindow window, MakeCompute make, Notify notify,
                                                          ComputeLimit limit = {});

  /// One consumer at a time.
  Pull pull(Layer& layer);
  /// Why pull() said kFailed: what a layer threw, or Error{kCancelled}.
  std::exception_ptr error();
  /// Stops the work: running layers see their token, nothing further is started, finished layers are freed, and pull()
  /// fails. Any thread, any number of times.
  void cancel();
  /// From now on so many slabs may be in flight.
  void set_window_slabs(std::uint32_t slabs);

 private:
  struct Slab {
    LayerRange layers;
    std::uint32_t computed = 0;
    std::deque<Layer> ready;
    std::exception_ptr error;
    bool parked = false;
    ComputeLayer compute;  // Between two layers that follow one another, and before one begins.
    bool done() const { return computed == layers.count || error; }
  };
  using SlabPtr = std::shared_ptr<Slab>;
  struct Consumer {
    Notify notify;         // Null once cancelled.
    bool waiting = false;  // The last pull() said kPending.
  };
  struct LayerMemory {
    std::uint64_t held_bytes = 0;   // All layers that are computed, the one taken last included.
    std::uint64_t taken_bytes = 0;  // The one taken last.
    std::uint64_t largest_bytes = 0;
  };
  struct IdleCompute {
    std::uint32_t first_layer;  // The first layer of the slab that it worked on.
    ComputeLayer compute;
  };

  LayerStream(const Executor::Lane& lane, LayerRange range, StreamWindow window, MakeCompute make, Notify notify,
              ComputeLimit limit);
  void start_slabs();
  void start_slabs_locked(std::vector<SlabPtr>& started);
  bool has_room_locked(const Slab& slab) const;
  void compute_next(const SlabPtr& slab);
  [[nodiscard]] bool begin_layer(Slab& slab);
  [[nodiscard]] bool claim_compute_locked(Slab& slab);
  bool gives_compute_back_locked(const Slab& slab) const;
  void post(const std::vector<SlabPtr>& slabs);
  void finish_layer(const SlabPtr& slab, std::optional<Layer> layer, std::exception_ptr error, ComputeLayer compute);
  void add_layer_locked(Slab& slab, Layer layer);
  void trim_computes_locked(std::vector<IdleCompute>& dropped);
  bool worth_pulling_locked() const;

  const Executor::Lane lane_;
  const MakeCompute make_;
  const ComputeLimit limit_;
  const CancellationToken cancel_ = Executor::make_token();

  std::mutex mutex_;
  StreamWindow window_;
  Consumer consumer_;
  bool cancelled_ = false;
  bool failed_ = false;       // A slab failed: no further ones are started.
  std::uint32_t next_layer_;  // First layer of the next slab to start.
  const std::uint32_t end_layer_;
  std::deque<SlabPtr> in_flight_;  // By layer.
  std::uint32_t active_ = 0;       // Slabs with a layer queued or being computed.
  std::uint32_t running_ = 0;      // Layers being computed.
  LayerMemory memory_;
  std::size_t computes_ = 0;  // Functions, those about to be made included.
  std::vector<IdleCompute> idle_computes_;
};

}  // namespace ccslice::server
