// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/zip_file.h"

#include <zlib.h>

#include <algorithm>
#include <cstddef>

#include "core/base/error.h"

namespace ccslice::cli {
namespace {

constexpr std::uint16_t kStored = 0, kDeflated = 8;
constexpr std::uint16_t kVersion = 20, kVersion64 = 45;
constexpr std::uint16_t kUtf8Names = 1 << 11;
constexpr std::uint32_t kFirstDay = (1 << 5 | 1) << 16;  // 1980-01-01, 00:00.
constexpr std::uint32_t kTooLarge = 0xffffffff;
constexpr std::uint16_t kTooMany = 0xffff;

template <class Number>
void put(std::string& out, Number number) {
  for (std::size_t i = 0; i < sizeof number; ++i) out += static_cast<char>(number >> 8 * i & 0xff);
}

/// What the local and the central header have in common.
void put_entry(std::string& out, std::uint16_t version, std::uint16_t method, std::string_view bytes,
               std::string_view packed, const std::string& name) {
  put(out, version);
  put(out, kUtf8Names);
  put(out, method);
  put(out, kFirstDay);
  put(out, static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size())));
  put(out, static_cast<std::uint32_t>(packed.size()));
  put(out, static_cast<std::uint32_t>(bytes.size()));
  put(out, static_cast<std::uint16_t>(name.size()));
}

std::string deflated(std::string_view bytes) {
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, -MAX_WBITS, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
    throw Error(ErrorCode::kInternal, "zlib can't start");
  }
  std::string packed(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  const int end = deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  if (end != Z_STREAM_END) throw Error(ErrorCode::kInternal, "zlib wrote more than its bound");
  return packed;
}

}  // namespace

void ZipFile::add_stored(const std::string& name, std::string_view bytes) { add(name, bytes, bytes, kStored); }

void ZipFile::add_compressed(const std::string& name, std::string_view bytes) {
  add(name, bytes, deflated(bytes), kDeflated);
}

void ZipFile::add(const std::string& name, std::string_view bytes, std::string_view packed, std::uint16_t method) {
  if (bytes.size() >= kTooLarge) throw Error(ErrorCode::kFileUnwritable, name + " is too large for an archive");
  const std::uint64_t offset = file_.size();
  const bool far = offset >= kTooLarge;
  std::string local = "PK\x03\x04";
  put_entry(local, kVersion, method, bytes, packed, name);
  put(local, std::uint16_t{0});  // No extra field.
  file_.write(local + name);
  file_.write(packed);

  directory_ += "PK\x01\x02";
  put(directory_, far ? kVersion64 : kVersion);
  put_entry(directory_, far ? kVersion64 : kVersion, method, bytes, packed, name);
  put(directory_, static_cast<std::uint16_t>(far ? 12 : 0));  // Extra field,
  put(directory_, std::uint16_t{0});                          // comment,
  put(directory_, std::uint16_t{0});                          // first disk,
  put(directory_, std::uint16_t{0});                          // attributes.
  put(directory_, std::uint32_t{0});
  put(directory_, static_cast<std::uint32_t>(std::min<std::uint64_t>(offset, kTooLarge)));
  directory_ += name;
  if (far) {
    put(directory_, std::uint16_t{1});  // ZIP64: the offset.
    put(directory_, std::uint16_t{8});
    put(directory_, offset);
  }
  ++entries_;
}

std::uint64_t ZipFile::finish() {
  const std::uint64_t begin = file_.size(), size = directory_.size();
  std::string end;
  if (entries_ >= kTooMany || begin + size >= kTooLarge) {
    end += "PK\x06\x06";
    put(end, std::uint64_t{44});
    put(end, kVersion64);
    put(end, kVersion64);
    put(end, std::uint64_t{0});  // Disks.
    for (const std::uint64_t number : {entries_, entries_, size, begin}) put(end, number);
    end += "PK\x06\x07";
    put(end, std::uint32_t{0});
    put(end, begin + size);
    put(end, std::uint32_t{1});
  }
  end += "PK\x05\x06";
  put(end, std::uint32_t{0});  // Disks.
  const auto count = static_cast<std::uint16_t>(std::min<std::uint64_t>(entries_, kTooMany));
  put(end, count);
  put(end, count);
  put(end, static_cast<std::uint32_t>(std::min<std::uint64_t>(size, kTooLarge)));
  put(end, static_cast<std::uint32_t>(std::min<std::uint64_t>(begin, kTooLarge)));
  put(end, std::uint16_t{0});  // No comment.
  file_.write(directory_);
  file_.write(end);
  file_.finish_on_disk();
  return file_.size();
}

}  // namespace ccslice::cli
