// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/unzip.h"

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <new>

#include "core/base/error.h"

namespace ccslice {
namespace {

struct EndInflate {
  void operator()(z_stream* stream) const noexcept { inflateEnd(stream); }
};

[[noreturn]] void refuse(const std::string& what, const std::string& why) {
  throw Error(ErrorCode::kFileSyntax, what + " can't be unpacked: " + why);
}

}  // namespace

bool is_gzip(std::string_view bytes) noexcept { return bytes.starts_with("\x1f\x8b"); }

std::string unzip(std::string_view bytes, std::uint64_t most_bytes, const std::string& what) {
  constexpr int kGzipOrZlib = 15 + 32;
  constexpr std::size_t kPiece = 1 << 20;
  z_stream stream{};
  if (inflateInit2(&stream, kGzipOrZlib) != Z_OK) throw std::bad_alloc();
  const std::unique_ptr<z_stream, EndInflate> ended(&stream);
  std::string unpacked;
  std::size_t fed = 0, size = 0;
  while (size < most_bytes) {
    if (stream.avail_in == 0) {
      const std::size_t more = std::min<std::size_t>(bytes.size() - fed, std::numeric_limits<uInt>::max());
      stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data() + fed));
      stream.avail_in = static_cast<uInt>(more);
      fed += more;
    }
    if (size == unpacked.size()) unpacked.resize(std::min<std::uint64_t>(std::max(kPiece, 2 * size), most_bytes));
    const std::size_t before = size;
    const std::size_t room = std::min<std::size_t>(unpacked.size() - size, std::numeric_limits<uInt>::max());
    stream.next_out = reinterpret_cast<Bytef*>(unpacked.data() + size);
    stream.avail_out = static_cast<uInt>(room);
    const int result = inflate(&stream, Z_NO_FLUSH);
    size += room - stream.avail_out;
    if (result == Z_STREAM_END) {
      if (!is_gzip(bytes.substr(fed - stream.avail_in))) break;  // It was the last member.
      if (inflateReset(&stream) != Z_OK) refuse(what, "the next member can't be begun");
      continue;
    }
    const bool is_starved = stream.avail_in == 0 && fed == bytes.size() && size == before;
    if (result == Z_BUF_ERROR || (result == Z_OK && is_starved)) refuse(what, "it ends too early");
    if (result != Z_OK) refuse(what, stream.msg != nullptr ? stream.msg : "it isn't what gzip or zlib write");
  }
  unpacked.resize(size);
  return unpacked;
}

}  // namespace ccslice
