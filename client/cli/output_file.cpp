// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include "core/base/error.h"

namespace ccslice::cli {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& why) {
  throw Error(ErrorCode::kFileUnwritable, "cannot write " + path.string() + ": " + why);
}

/// Removes the file it names unless told to keep it.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::filesystem::path& final_path)
      : path_(final_path.parent_path() / ("." + final_path.filename().string() + ".part")) {}
  ~TemporaryFile() {
    std::error_code ignored;
    if (!path_.empty()) std::filesystem::remove(path_, ignored);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::filesystem::path& path() const { return path_; }
  void keep() { path_.clear(); }

 private:
  std::filesystem::path path_;
};

}  // namespace

void write_file(const std::filesystem::path& path, std::string_view bytes) {
  TemporaryFile temporary(path);
  std::ofstream file(temporary.path(), std::ios::binary | std::ios::trunc);
  if (!file) fail(path, std::strerror(errno));
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) fail(path, std::strerror(errno));
  std::error_code status;
  std::filesystem::rename(temporary.path(), path, status);
  if (status) fail(path, status.message());
  temporary.keep();
}

void refuse_to_overwrite(const std::filesystem::path& path, bool force) {
  if (!force && std::filesystem::exists(path)) fail(path, "it is there already; --force overwrites it");
}

}  // namespace ccslice::cli
