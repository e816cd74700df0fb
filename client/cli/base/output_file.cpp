// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <random>
#include <set>
#include <string>
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

constexpr std::string_view kTemporaryPrefix = ".", kTemporarySuffix = ".part";
constexpr std::size_t kNumberBytes = 9;  // ".1f0c93ab".

/// ".NAME.1f0c93ab.part".
std::filesystem::path temporary_beside(const std::filesystem::path& path) {
  std::array<char, kNumberBytes + 1> number{};
  std::snprintf(number.data(), number.size(), ".%08x", std::random_device{}());
  return path.parent_path() /
         (std::string(kTemporaryPrefix) + path.filename().string() + number.data() + std::string(kTemporarySuffix));
}

/// The temporary files that there are.
class Unfinished {
 public:
  void add(const std::filesystem::path& file) {
    const std::lock_guard lock(mutex_);
    files_.insert(file);
  }
  void remove(const std::filesystem::path& file) {
    const std::lock_guard lock(mutex_);
    unlink_quietly(file);
    files_.erase(file);
  }
  void remove_all() {
    const std::lock_guard lock(mutex_);
    for (const std::filesystem::path& file : files_) unlink_quietly(file);
  }

 private:
  static void unlink_quietly(const std::filesystem::path& file) {
    std::error_code ignored;
    std::filesystem::remove(file, ignored);
  }

  std::mutex mutex_;
  std::set<std::filesystem::path> files_;
};

Unfinished& unfinished() {
  static Unfinished files;
  return files;
}

Stream stream_of(const std::filesystem::path& path, int descriptor, const char* mode) {
  std::FILE* const stream = descriptor < 0 ? nullptr : ::fdopen(descriptor, mode);
  if (stream == nullptr) fail(path, std::strerror(errno));
  return {stream, std::fclose};
}

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : ".";
}

}  // namespace

NewFile::NewFile(const std::filesystem::path& path) : path_(path), stream_(nullptr, std::fclose) {
  constexpr mode_t kAsTheUmaskSays = 0666;
  int descriptor = -1;
  do {
    temporary_ = temporary_beside(path);
    descriptor = ::open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, kAsTheUmaskSays);
  } while (descriptor < 0 && errno == EEXIST);
  if (descriptor >= 0) unfinished().add(temporary_);
  stream_ = stream_of(path, descriptor, "w+b");
}

NewFile::~NewFile() { unfinished().remove(temporary_); }

void NewFile::write(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), stream_.get()) != bytes.size()) fail(path_, std::strerror(errno));
}

void NewFile::finish() {
  if (std::fclose(stream_.release()) != 0) fail(path_, std::strerror(errno));
  std::error_code status;
  std::filesystem::rename(temporary_, path_, status);
  if (status) fail(path_, status.message());
}

void NewFile::finish_on_disk() {
  if (std::fflush(stream_.get()) != 0 || ::fsync(::fileno(stream_.get())) != 0) fail(path_, std::strerror(errno));
  finish();
  sync_path(folder_of(path_), ::fsync);
}

void remove_unfinished_files() noexcept { unfinished().remove_all(); }

std::string_view final_name_of_temporary(std::string_view name) {
  constexpr std::size_t kAround = kTemporaryPrefix.size() + kNumberBytes + kTemporarySuffix.size();
  if (name.size() <= kAround || !name.starts_with(kTemporaryPrefix) || !name.ends_with(kTemporarySuffix)) return {};
  return name.substr(kTemporaryPrefix.size(), name.size() - kAround);
}

Stream open_to_append(const std::filesystem::path& path) {
  return stream_of(path, ::open(path.c_str(), O_WRONLY | O_APPEND | O_NOFOLLOW | O_CLOEXEC), "ab");
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
