// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Bytes that came in several pieces, for protobuf's readers.

#pragma once

#include <google/protobuf/io/zero_copy_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace ccslice::server {

/// Several blocks as one stream. The blocks outlive it.
class BlockStream {
 public:
  explicit BlockStream(const std::vector<std::string>& blocks) {
    for (const std::string& block : blocks) {
      size_ += block.size();
      parts_.push_back(
          std::make_unique<google::protobuf::io::ArrayInputStream>(block.data(), static_cast<int>(block.size())));
      pointers_.push_back(parts_.back().get());
    }
    whole_.emplace(pointers_.data(), static_cast<int>(pointers_.size()));
  }
  google::protobuf::io::ZeroCopyInputStream* stream() { return &*whole_; }
  std::size_t size() const { return size_; }

 private:
  std::size_t size_ = 0;
  std::vector<std::unique_ptr<google::protobuf::io::ZeroCopyInputStream>> parts_;
  std::vector<google::protobuf::io::ZeroCopyInputStream*> pointers_;
  std::optional<google::protobuf::io::ConcatenatingInputStream> whole_;
};

}  // namespace ccslice::server
