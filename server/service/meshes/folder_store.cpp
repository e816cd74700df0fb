// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/meshes/folder_store.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "server/service/base/descriptor.h"
#include "server/service/meshes/mesh_id.h"

namespace ccslice::server {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr std::string_view kDigest = "sha256:";
constexpr std::string_view kTemporaryEnd = ".tmp";
constexpr auto kScanEvery = 60s;
constexpr auto kAbandonedAfter = 1h;  // Nobody writes a mesh for so long.
constexpr std::size_t kReadBytes = 1 << 20;

[[noreturn]] void fail(const std::string& what, const fs::path& path, int error) {
  throw StoreError(error == ENOSPC || error == EDQUOT || error == EACCES ? StoreFault::kRefuses : StoreFault::kFails,
                   "the mesh store can't " + what + " " + path.string() + ": " + std::strerror(error));
}

/// No link is followed, no FIFO waited for.
int open_entry(const fs::path& path) { return ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC); }

bool is_absent(int error) { return error == ENOENT || error == ENOTDIR; }

/// Files of others', links and folders under a mesh's name aren't there for us.
bool is_stranger(int error) { return error == ELOOP; }

/// Brings it to the disk as it goes: at the end that would take long without a sign of progress.
void write_blocks(int descriptor, const std::vector<std::string>& blocks, const MeshStore::Progress& progress,
                  const fs::path& path) {
  constexpr std::size_t kSyncEvery = 8 << 20;
  std::size_t unsynced = 0;
  for (const std::string& block : blocks) {
    std::string_view rest = block;
    while (!rest.empty()) {
      const ssize_t written = ::write(descriptor, rest.data(), std::min(rest.size(), kSyncEvery));
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail("write", path, errno);
      rest.remove_prefix(static_cast<std::size_t>(written));
      unsynced += static_cast<std::size_t>(written);
      if (unsynced < kSyncEvery) continue;
      if (::fdatasync(descriptor) != 0) fail("write", path, errno);
      unsynced = 0;
      progress();
    }
  }
  if (::fsync(descriptor) != 0) fail("write", path, errno);
  progress();
}

/// Replicas may run as other users of a group.
void make_group_folder(const fs::path& path) {
  if (::mkdir(path.c_str(), 0770) == 0) {
    (void)::chmod(path.c_str(), 02770);  // Whatever the mask of this process is.
  } else if (errno != EEXIST) {
    fail("make", path, errno);
  }
}

bool is_name_of_mesh(const fs::path& path) {
  const std::string name = path.filename(), folder = path.parent_path().filename(),
                    above = path.parent_path().parent_path().filename();
  return is_mesh_id(std::string(kDigest) + name) && name.starts_with(above) && name.substr(2).starts_with(folder) &&
         above.size() == 2 && folder.size() == 2;
}

/// Of one that put() makes: a dot, the mesh's name, six characters at random, .tmp.
bool is_name_of_temporary(const fs::path& path) {
  constexpr std::size_t kDigits = 64, kRandom = 1 + 6;
  const std::string name = path.filename();
  return name.size() == 1 + kDigits + kRandom + kTemporaryEnd.size() && name.starts_with('.') &&
         name.ends_with(kTemporaryEnd) && is_name_of_mesh(path.parent_path() / name.substr(1, kDigits));
}

/// 0, or why not.
int try_to_make_a_file(const fs::path& folder) {
  const fs::path probe = folder / (".probe." + std::to_string(::getpid()));
  const Descriptor made(::open(probe.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600));
  if (!made && errno != EEXIST) return errno;
  if (made) ::unlink(probe.c_str());
  return 0;
}

void mark_used(int descriptor) {
  (void)::futimens(descriptor, nullptr);  // Where we may not, others' uses keep it.
}

}  // namespace

FolderStore::FolderStore(fs::path folder, std::uint64_t most_bytes)
    : folder_(std::move(folder)), most_bytes_(most_bytes) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (const int why = try_to_make_a_file(folder_); why != 0) {
    throw std::runtime_error("--mesh-store: files can't be made in " + folder_.string() + ": " + std::strerror(why) +
                             ". Give the server's user the folder, or name another one");
  }
}

void FolderStore::check() {
  if (const int why = try_to_make_a_file(folder_); why != 0) fail("make files in", folder_, why);
}

fs::path FolderStore::path_of(const std::string& mesh_id) const {
  const std::string digits = mesh_id.substr(kDigest.size());
  return folder_ / digits.substr(0, 2) / digits.substr(2, 2) / digits;
}

bool FolderStore::read(const std::string& mesh_id, const Sink& sink) {
  const fs::path path = path_of(mesh_id);
  const Descriptor file(open_entry(path));
  if (!file && (is_absent(errno) || is_stranger(errno))) return false;
  if (!file) fail("read", path, errno);
  struct stat status = {};
  if (::fstat(file.get(), &status) != 0) fail("read", path, errno);
  if (!S_ISREG(status.st_mode)) return false;
  mark_used(file.get());
  sink.begin(static_cast<std::uint64_t>(status.st_size));
  std::string piece(kReadBytes, '\0');
  while (true) {
    const ssize_t count = ::read(file.get(), piece.data(), piece.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail("read", path, errno);
    if (count == 0) return true;
    sink.append(std::string_view(piece).substr(0, static_cast<std::size_t>(count)));
  }
}

void FolderStore::write(const std::string& mesh_id, const std::vector<std::string>& blocks, const Progress& progress) {
  std::uint64_t bytes = 0;
  for (const std::string& block : blocks) bytes += block.size();
  if (bytes > most_bytes_) {
    throw StoreError(StoreFault::kRefuses, "the mesh store takes " + std::to_string(most_bytes_) +
                                               " bytes in all (--mesh-store-bytes), the " + "mesh has " +
                                               std::to_string(bytes));
  }
  make_room(bytes, progress);
  const fs::path path = path_of(mesh_id);
  make_group_folder(path.parent_path().parent_path());
  make_group_folder(path.parent_path());
  put(path, blocks, progress);
  held_bytes_ += bytes;
}

/// The folder is brought to the disk too, so that the name outlives a crash.
void FolderStore::put(const fs::path& place, const std::vector<std::string>& blocks, const Progress& progress) {
  // mkostemps wants six of them before the end.
  const std::string name = "." + place.filename().string() + "." + std::string(6, 'X') + std::string(kTemporaryEnd);
  std::string temporary = place.parent_path() / name;
  const Descriptor file(::mkostemps(temporary.data(), static_cast<int>(kTemporaryEnd.size()), O_CLOEXEC));
  if (!file) fail("make", temporary, errno);
  try {
    (void)::fchmod(file.get(), 0640);  // Replicas may run as other users of a group.
    write_blocks(file.get(), blocks, progress, temporary);
    if (::rename(temporary.c_str(), place.c_str()) != 0) fail("put a file at", place, errno);
  } catch (...) {
    ::unlink(temporary.c_str());
    throw;
  }
  const Descriptor folder(::open(place.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (folder) (void)::fsync(folder.get());  // Some file systems can't: the file is there all the same.
}

bool FolderStore::contains(const std::string& mesh_id) {
  const fs::path path = path_of(mesh_id);
  const Descriptor file(open_entry(path));
  if (!file && (is_absent(errno) || is_stranger(errno))) return false;
  struct stat status = {};
  if (!file || ::fstat(file.get(), &status) != 0) fail("read", path, errno);
  if (!S_ISREG(status.st_mode)) return false;
  mark_used(file.get());
  return true;
}

bool FolderStore::erase(const std::string& mesh_id) {
  const fs::path path = path_of(mesh_id);
  if (::unlink(path.c_str()) == 0) return true;
  if (is_absent(errno) || errno == EISDIR || errno == EPERM) return false;
  fail("delete", path, errno);
}

std::vector<std::string> FolderStore::last_used(std::size_t count, const Progress& progress) {
  std::vector<Entry> entries = scan(progress);
  std::reverse(entries.begin(), entries.end());
  entries.resize(std::min(count, entries.size()));
  std::vector<std::string> ids;
  for (const Entry& entry : entries) ids.push_back(std::string(kDigest) + entry.path.filename().string());
  return ids;
}

/// What vanishes in between was another replica's to drop.
std::vector<FolderStore::Entry> FolderStore::scan(const Progress& progress) const {
  std::vector<Entry> entries;
  const auto now = fs::file_time_type::clock::now();
  const auto options = fs::directory_options::skip_permission_denied;
  std::error_code error;
  for (fs::recursive_directory_iterator at(folder_, options, error), end; !error && at != end; at.increment(error)) {
    progress();
    if (at.depth() >= 2) at.disable_recursion_pending();
    std::error_code gone;
    if (at.depth() != 2 || !at->is_regular_file(gone) || at->is_symlink(gone)) continue;
    Entry entry{.path = at->path(), .last_use = at->last_write_time(gone), .bytes = 0};
    if (gone) continue;
    entry.bytes = at->file_size(gone);
    if (is_name_of_temporary(entry.path)) {
      if (now - entry.last_use > kAbandonedAfter) fs::remove(entry.path, gone);
    } else if (!gone && is_name_of_mesh(entry.path)) {
      entries.push_back(std::move(entry));
    }
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.last_use < b.last_use; });
  return entries;
}

void FolderStore::make_room(std::uint64_t bytes, const Progress& progress) {
  const auto now = std::chrono::steady_clock::now();
  if (held_bytes_ + bytes <= most_bytes_ && now < next_scan_) return;
  const std::vector<Entry> entries = scan(progress);
  next_scan_ = now + kScanEvery;
  held_bytes_ = 0;
  for (const Entry& entry : entries) held_bytes_ += entry.bytes;
  for (auto entry = entries.begin(); entry != entries.end() && held_bytes_ + bytes > most_bytes_; ++entry) {
    std::error_code error;
    fs::remove(entry->path, error);
    held_bytes_ -= entry->bytes;
    progress();
  }
}

}  // namespace ccslice::server
