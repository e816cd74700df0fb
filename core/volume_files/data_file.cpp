// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/data_file.h"

#include <filesystem>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/mesh_import/find_file.h"

namespace ccslice {

std::string read_data_file(const std::string& path, const std::string& name, std::uint64_t max_bytes) {
  if (path.empty()) throw Error(ErrorCode::kFileUnsupported, "the samples are in another file; give all in one");
  const NamedFiles::Found found =
      NamedFiles(FileOrigin{.path = path}).find(std::filesystem::path(path).parent_path(), name);
  const std::string named = "the header names " + echoed(name) + " as the file of its samples";
  if (found.is_outside) {
    throw Error(
        ErrorCode::kFileUnsupported,
        named + ", which isn't in the header's folder; put it there, and its name without folders in the header");
  }
  if (found.files.empty()) {
    throw Error(ErrorCode::kFileUnreadable, named + ", and there is none of that name beside the header; put it there");
  }
  return read_file_bytes(found.files.front().string(), max_bytes);
}

}  // namespace ccslice
