// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Layers that several servers slice at once, put back into order within a bound of memory. Each stream takes a block of
// consecutive layers, and another one when it is done, so that none waits for a slower one. What comes too early is
// kept; where there is no room, its stream waits. The layer that is due next always has room, so somebody can always go
// on.

#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "client/layer.h"

namespace ccslice::client {

/// Consecutive layers.
struct LayerBlock {
  std::uint32_t first = 0, count = 0;
};

/// Thread-safe.
class LayerQueue {
 public:
  struct Item {
    v1::SliceHeader header;  // Of the block that the layer belongs to.
    Layer layer;
  };

  /// Of the layers of `whole`, for so many streams; keeps no more than about `most_bytes`.
  LayerQueue(const LayerBlock& whole, std::uint32_t streams, std::uint64_t most_bytes);

  /// The next block to be sliced. Nothing if none is left, or stopped.
  std::optional<LayerBlock> take();
  /// Puts a layer in its place; waits until there is room. False if stopped.
  bool put(const v1::SliceHeader& header, Layer layer);
  /// A stream has failed for good: the first one that does stops all.
  void fail(std::exception_ptr error);
  void stop();

  /// Whether all layers have been taken out.
  bool done() const;
  /// The layer that is due next; nothing if it doesn't come within `patience`. Throws what a stream has failed with.
  std::optional<Item> next(std::chrono::milliseconds patience);

 private:
  const std::uint32_t streams_;
  const std::uint64_t most_bytes_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  LayerBlock left_;          // What nobody has taken yet.
  std::uint32_t due_, end_;  // The next layer to be taken out, and the one after the last.
  std::map<std::uint32_t, Item> kept_;
  std::uint64_t kept_bytes_ = 0;
  std::uint64_t largest_bytes_ = 0;
  bool stopped_ = false;
  std::exception_ptr error_;
};

}  // namespace ccslice::client
