// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "core/base/error.h"

namespace ccslice::cli {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& why) {
  throw Error(ErrorCode::kFileUnwritable, "cannot write " + path.string() + ": " + why);
}

/// Calls sync(descriptor) for what is at `path`.
template <typename Sync>
void sync_path(const std::filesystem::path& path, const Sync& sync) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) fail(path, std::strerror(errno));
  const int error = sync(descriptor) == 0 ? 0 : errno;
  ::close(descriptor);
  if (error != 0) fail(path, std::strerror(error));
}

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : ".";
}

}  // namespace

NewFile::NewFile(const std::filesystem::path& path)
    : path_(path),
      temporary_(path.parent_path() / ("." + path.filename().string() + ".part")),
      file_(temporary_, std::ios::binary | std::ios::trunc) {
  if (!file_) fail(path_, std::strerror(errno));
}

NewFile::~NewFile() {
  std::error_code ignored;
  std::filesystem::remove(temporary_, ignored);
}

void NewFile::write(std::string_view bytes) {
  file_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file_) fail(path_, std::strerror(errno));
}

void NewFile::finish() {
  if (file_.is_open()) file_.close();
  if (!file_) fail(path_, std::strerror(errno));
  std::error_code status;
  std::filesystem::rename(temporary_, path_, status);
  if (status) fail(path_, status.message());
}

void NewFile::finish_on_disk() {
  file_.close();
  if (!file_) fail(path_, std::strerror(errno));
  sync_path(temporary_, ::fsync);
  finish();
  sync_path(folder_of(path_), ::fsync);
}

void write_file(const std::filesystem::path& path, std::string_view bytes) {
  NewFile file(path);
  file.write(bytes);
  file.finish();
}

void write_file_on_disk(const std::filesystem::path& path, std::string_view bytes) {
  NewFile file(path);
  file.write(bytes);
  file.finish_on_disk();
}

void sync_folder(const std::filesystem::path& folder) { sync_path(folder, ::syncfs); }

void refuse_to_overwrite(const std::filesystem::path& path, bool force) {
  if (!force && std::filesystem::exists(path)) fail(path, "it is there already; --force overwrites it");
}

}  // namespace ccslice::cli
