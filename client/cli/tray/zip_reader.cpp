// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/zip_reader.h"

#include <unzip.h>

#include <algorithm>
#include <array>
#include <system_error>

#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

std::string lower_case(std::string name) {
  for (char& c : name) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return name;
}

/// The size of a file that can be opened as an archive. Throws Error{kFileUnreadable}.
std::uint64_t size_of(const std::filesystem::path& path) {
  std::error_code error;
  const bool is_file = std::filesystem::is_regular_file(path, error);
  const std::uint64_t bytes = is_file ? std::filesystem::file_size(path, error) : 0;
  if (is_file && !error) return bytes;
  throw Error(ErrorCode::kFileUnreadable, echoed(path.string(), kMaxEchoBytes * 4) + ": there is no such file to read");
}

}  // namespace

ZipReader::ZipReader(const std::filesystem::path& path, std::uint64_t max_bytes)
    : path_(path.string()), max_bytes_(max_bytes) {
  if (size_of(path) > max_bytes_) {
    throw Error(ErrorCode::kMeshTooLarge,
                path_ + " has more than " + std::to_string(max_bytes_) + " bytes (--max-file-bytes)");
  }
  zip_ = unzOpen64(path_.c_str());
  if (zip_ == nullptr) fail("is no 3MF package, which is a ZIP archive; save it as .3mf again");
  try {
    list();
  } catch (...) {
    unzClose(zip_);
    throw;
  }
}

ZipReader::~ZipReader() { unzClose(zip_); }

void ZipReader::list() {
  constexpr std::size_t kMostEntries = 1 << 20;
  int at = unzGoToFirstFile(zip_);
  for (; at == UNZ_OK; at = unzGoToNextFile(zip_)) {
    if (entries_.size() == kMostEntries) fail("has more than a million entries, which no package of a plate needs");
    add_entry();
  }
  if (at != UNZ_END_OF_LIST_OF_FILE && !entries_.empty()) fail("is damaged: its list of entries can't be read");
}

void ZipReader::add_entry() {
  std::array<char, 1024> name{};
  unz_file_info64 info{};
  unz64_file_pos position{};
  if (unzGetCurrentFileInfo64(zip_, &info, name.data(), name.size() - 1, nullptr, 0, nullptr, 0) != UNZ_OK ||
      unzGetFilePos64(zip_, &position) != UNZ_OK) {
    fail("is damaged: its list of entries can't be read");
  }
  entries_.try_emplace(lower_case(name.data()),
                       Entry{position.pos_in_zip_directory, position.num_of_file, info.uncompressed_size});
}

bool ZipReader::has(const std::string& name) const { return entries_.contains(lower_case(name)); }

std::string ZipReader::read(const std::string& name) {
  const Entry& entry = entries_.at(lower_case(name));
  const std::string shown = echoed(name, kMaxEchoBytes * 2);
  if (entry.bytes > max_bytes_ - unpacked_) {
    throw Error(ErrorCode::kMeshTooLarge, path_ + ": with " + shown + ", which unpacks to " +
                                              std::to_string(entry.bytes) + " bytes, it has more than " +
                                              std::to_string(max_bytes_) + " bytes (--max-file-bytes)");
  }
  const unz64_file_pos position{entry.at, entry.number};
  if (unzGoToFilePos64(zip_, &position) != UNZ_OK || unzOpenCurrentFile(zip_) != UNZ_OK) {
    fail("is damaged: " + shown + " can't be opened; save the file again");
  }
  // The archive's word isn't taken for what is to come: memory grows with what does.
  constexpr std::size_t kBlock = 1 << 20;
  std::string bytes;
  int got = 1;
  while (got > 0 && bytes.size() <= entry.bytes) {
    const std::size_t before = bytes.size();
    bytes.resize(before + kBlock);
    got = unzReadCurrentFile(zip_, bytes.data() + before, kBlock);
    bytes.resize(before + static_cast<std::size_t>(std::max(got, 0)));
  }
  const bool whole = unzCloseCurrentFile(zip_) == UNZ_OK && got == 0 && bytes.size() == entry.bytes;  // And its CRC.
  if (!whole) fail("is damaged: " + shown + " doesn't hold what the archive says; save the file again");
  unpacked_ += bytes.size();
  return bytes;
}

void ZipReader::fail(const std::string& what) const { throw Error(ErrorCode::kFileSyntax, path_ + " " + what); }

}  // namespace ccslice::cli
