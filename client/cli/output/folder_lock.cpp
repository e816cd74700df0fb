// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/folder_lock.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "core/base/error.h"

namespace ccslice::cli {

FolderLock::FolderLock(std::filesystem::path folder, LockFile lock_file)
    : folder_(std::move(folder)), file_(folder_ / kName), lock_file_(lock_file) {
  constexpr int kMostTries = 100;  // Where files have no numbers that last, it seems gone each time.
  for (int tries = 1; !lock() && tries < kMostTries; ++tries) ::close(descriptor_);
}

bool FolderLock::lock() {
  constexpr mode_t kAsTheUmaskSays = 0666;
  descriptor_ = ::open(file_.c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, kAsTheUmaskSays);
  if (descriptor_ < 0) {
    throw Error(ErrorCode::kFileUnwritable, "cannot write " + file_.string() + ": " + std::strerror(errno));
  }
  excludes_others_ = lock_file_(descriptor_, LOCK_EX | LOCK_NB) == 0;
  if (!excludes_others_ && errno == EWOULDBLOCK) {
    ::close(descriptor_);
    throw Error(ErrorCode::kFileUnwritable,
                "another job is writing to " + folder_.string() + "; wait for its end, or take another folder");
  }
  struct stat held {
  }, there{};
  return ::fstat(descriptor_, &held) == 0 && ::lstat(file_.c_str(), &there) == 0 && held.st_dev == there.st_dev &&
         held.st_ino == there.st_ino;
}

FolderLock::~FolderLock() {
  ::unlink(file_.c_str());
  ::close(descriptor_);
}

void refuse_locked_folder(const std::filesystem::path& folder) {
  std::error_code status;
  if (std::filesystem::exists(folder / FolderLock::kName, status)) const FolderLock held_for_a_moment(folder);
}

}  // namespace ccslice::cli
