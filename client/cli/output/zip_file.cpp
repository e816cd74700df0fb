// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/zip_file.h"

#include <zip.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <limits>
#include <utility>

#include "core/base/error.h"

namespace ccslice::cli {
namespace {

constexpr uLong kUtf8Names = 1 << 11;
constexpr uLong kMadeBy = 45;  // Version 4.5 of the format, the first with 64-bit sizes.

/// minizip's functions for a stream that the caller opens and closes: minizip itself doesn't report a disk that is full
/// on closing.
zlib_filefunc64_def functions_on(std::FILE* stream) {
  zlib_filefunc64_def functions{};
  functions.opaque = stream;
  functions.zopen64_file = [](void* opaque, const void*, int) { return opaque; };
  functions.zread_file = [](void*, void* stream, void* bytes, uLong size) -> uLong {
    return std::fread(bytes, 1, size, static_cast<std::FILE*>(stream));
  };
  functions.zwrite_file = [](void*, void* stream, const void* bytes, uLong size) -> uLong {
    return std::fwrite(bytes, 1, size, static_cast<std::FILE*>(stream));
  };
  functions.ztell64_file = [](void*, void* stream) -> ZPOS64_T {
    return static_cast<ZPOS64_T>(ftello(static_cast<std::FILE*>(stream)));
  };
  functions.zseek64_file = [](void*, void* stream, ZPOS64_T offset, int origin) -> long {
    return fseeko(static_cast<std::FILE*>(stream), static_cast<off_t>(offset), origin);
  };
  functions.zclose_file = [](void*, void*) { return 0; };
  functions.zerror_file = [](void*, void* stream) { return std::ferror(static_cast<std::FILE*>(stream)); };
  return functions;
}

}  // namespace

ZipFile::ZipFile(const std::filesystem::path& path) : path_(path), file_(path) {
  zlib_filefunc64_def functions = functions_on(file_.stream());
  zip_ = zipOpen2_64(nullptr, APPEND_STATUS_CREATE, nullptr, &functions);
  if (zip_ == nullptr) fail();
}

ZipFile::~ZipFile() {
  if (zip_ != nullptr) zipClose(zip_, nullptr);
}

void ZipFile::add_stored(const std::string& name, std::string_view bytes) { add(name, bytes, Method::kStored); }

void ZipFile::add_compressed(const std::string& name, std::string_view bytes) { add(name, bytes, Method::kDeflated); }

void ZipFile::add(const std::string& name, std::string_view bytes, Method method) {
  if (bytes.size() > std::numeric_limits<std::uint32_t>::max()) {
    throw Error(ErrorCode::kFileUnwritable, name + " is too large for an archive");
  }
  zip_fileinfo info{};
  info.tmz_date.tm_year = 1980;
  info.tmz_date.tm_mday = 1;
  const int opened = zipOpenNewFileInZip4_64(
      zip_, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, method == Method::kStored ? 0 : Z_DEFLATED,
      Z_DEFAULT_COMPRESSION, /*raw=*/0, -MAX_WBITS, DEF_MEM_LEVEL, Z_DEFAULT_STRATEGY, nullptr, 0, kMadeBy, kUtf8Names,
      /*zip64=*/0);
  if (opened != ZIP_OK) fail();
  if (zipWriteInFileInZip(zip_, bytes.data(), static_cast<unsigned>(bytes.size())) != ZIP_OK) fail();
  if (zipCloseFileInZip(zip_) != ZIP_OK) fail();
}

std::uint64_t ZipFile::finish() {
  void* zip = std::exchange(zip_, nullptr);
  if (zipClose(zip, nullptr) != ZIP_OK) fail();
  file_.finish_on_disk();
  return std::filesystem::file_size(path_);
}

void ZipFile::fail() const {
  throw Error(ErrorCode::kFileUnwritable, "cannot write " + path_.string() + ": " + std::strerror(errno));
}

}  // namespace ccslice::cli
