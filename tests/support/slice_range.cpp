// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/slice_range.h"

#include <algorithm>
#include <exception>
#include <semaphore>
#include <thread>
#include <utility>

#include "core/slicer/layer_slicer.h"
#include "server/service/scheduling/executor.h"
#include "server/service/scheduling/layer_stream.h"

namespace ccslice {
namespace {

/// Layers that nobody takes any more aren't computed.
class StreamGuard {
 public:
  explicit StreamGuard(server::LayerStream& stream) : stream_(stream) {}
  ~StreamGuard() { stream_.cancel(); }
  StreamGuard(const StreamGuard&) = delete;
  StreamGuard& operator=(const StreamGuard&) = delete;

 private:
  server::LayerStream& stream_;
};

}  // namespace

void slice_range(const PlacedParts& parts, std::uint32_t first, std::uint32_t count,
                 const std::function<void(Layer&&)>& on_layer, const SliceRangeOptions& options) {
  using server::LayerStream;
  validate_layer_range(parts.front().job, first, count);
  const std::uint32_t threads = options.threads > 0 ? static_cast<std::uint32_t>(options.threads)
                                                    : std::max(1U, std::thread::hardware_concurrency());
  const LayerSlicer prototype(parts, options.cancel);
  std::counting_semaphore<> worth_pulling(0);
  server::Executor executor(threads);
  const auto make = [&](const CancellationToken&) {
    return [&options, slicer = std::make_shared<LayerSlicer>(prototype.twin())](
               std::uint32_t layer, const CancellationToken&) { return slicer->slice(layer, options.cancel); };
  };
  const std::shared_ptr<LayerStream> stream =
      LayerStream::start(executor.make_lane("", server::Pieces::kBatch), {first, count}, {.window_slabs = threads + 1},
                         make, [&] { worth_pulling.release(); });
  const StreamGuard guard(*stream);
  for (;;) {
    Layer layer;
    switch (stream->pull(layer)) {
      case LayerStream::Pull::kLayer: on_layer(std::move(layer)); break;
      case LayerStream::Pull::kPending: worth_pulling.acquire(); break;
      case LayerStream::Pull::kFailed: std::rethrow_exception(stream->error());
      case LayerStream::Pull::kEnd: return;
    }
  }
}

void slice_range(const std::shared_ptr<const LimitSolid>& solid, const SliceJob& job, std::uint32_t first,
                 std::uint32_t count, const std::function<void(Layer&&)>& on_layer, const SliceRangeOptions& options) {
  slice_range(PlacedParts{{"", solid, job}}, first, count, on_layer, options);
}

}  // namespace ccslice
