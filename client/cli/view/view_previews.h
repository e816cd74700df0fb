// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures for whoever asks one by one, from one call of Preview: the latest request wins. A call that has ended, since
// it broke or another mesh is asked for, is made anew. Each page has a call of its own, so that two don't win against
// each other.

#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "client/client.h"
#include "client/preview.h"

namespace ccslice::cli {

/// Thread-safe.
class ViewPreviews {
 public:
  /// `client` outlives this.
  explicit ViewPreviews(client::Client& client) : client_(client) {}
  ~ViewPreviews();
  ViewPreviews(const ViewPreviews&) = delete;
  ViewPreviews& operator=(const ViewPreviews&) = delete;

  /// The first picture of the request, coarse if it asks for that. Nothing if a newer request has come meanwhile.
  /// Throws ClientError.
  std::shared_ptr<const client::PreviewPicture> show(v1::PreviewRequest request);

 private:
  struct Stream {
    client::Cancellation cancellation;
    std::unique_ptr<client::PreviewStream> call;
    std::string mesh_id, printing_bytes;
    std::thread reader;
    // Guarded by the owner's mutex:
    std::uint64_t asked = 0;
    std::shared_ptr<const client::PreviewPicture> latest;
    bool over = false;
    std::exception_ptr error;
  };

  /// Makes a new call; the one before is still to be closed, without the lock.
  std::shared_ptr<Stream> open(const std::string& mesh_id);
  void read(const std::shared_ptr<Stream>& stream);
  static void close(const std::shared_ptr<Stream>& stream);

  client::Client& client_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::shared_ptr<Stream> stream_;
};

/// The calls of the pages that asked last. Thread-safe.
class ViewPages {
 public:
  static constexpr std::size_t kMostPages = 8;

  explicit ViewPages(client::Client& client) : client_(client) {}

  /// That of a page, whatever it calls itself. One page more than kMostPages ends the call of the page that hasn't
  /// asked for the longest time; if that asks again, it gets another one.
  std::shared_ptr<ViewPreviews> of(const std::string& page);

 private:
  client::Client& client_;
  std::mutex mutex_;
  std::list<std::pair<std::string, std::shared_ptr<ViewPreviews>>> pages_;  // The one that asked last first.
};

}  // namespace ccslice::cli
