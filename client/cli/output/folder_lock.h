// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One job at a time in a folder of layers: two would delete or mix each other's files.

#pragma once

#include <sys/file.h>

#include <filesystem>

namespace ccslice::cli {

/// Held by the job that writes to a folder, as a lock on the file kName in it, which goes with the lock. It ends with
/// its process, however that ends.
class FolderLock {
 public:
  static constexpr const char* kName = ".ccslice.lock";

  using LockFile = int (*)(int descriptor, int how);  // flock(2), or as it answers elsewhere.

  /// REQUIRES: the folder is there. Throws Error{kFileUnwritable} if another job holds it.
  explicit FolderLock(std::filesystem::path folder, LockFile lock_file = &::flock);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

  /// Some file systems of networks have no locks: there nobody is excluded.
  bool excludes_others() const { return excludes_others_; }

 private:
  /// False if the file isn't there any more: who held it has just left.
  bool lock();

  const std::filesystem::path folder_, file_;
  const LockFile lock_file_;
  int descriptor_ = -1;
  bool excludes_others_ = false;
};

/// Throws Error{kFileUnwritable} if a job holds the folder's lock. The folder needn't be there.
void refuse_locked_folder(const std::filesystem::path& folder);

}  // namespace ccslice::cli
