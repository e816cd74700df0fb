// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/find_file.h"

#include <algorithm>
#include <climits>
#include <string>
#include <system_error>

#include "core/base/similar_name.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {
namespace {

namespace fs = std::filesystem;

bool is_file(const fs::path& path) {
  std::error_code status;
  return fs::is_regular_file(path, status);
}

/// What the folder has of that name, but for the case of letters.
std::vector<fs::path> entries_called(const fs::path& folder, const std::string& name) {
  std::vector<fs::path> found;
  std::error_code status;
  for (fs::directory_iterator entry(folder.empty() ? fs::path(".") : folder, status), end; !status && entry != end;
       entry.increment(status)) {
    const std::string other = entry->path().filename().string();
    if (equals_ignoring_case(other, name)) found.push_back(folder / other);
  }
  return found;
}

}  // namespace

std::vector<fs::path> find_files(const fs::path& folder, std::string_view name) {
  constexpr std::size_t kMostFolders = 100;  // On the way there, of names that are the same but for case.
  if (name.size() > PATH_MAX) return {};
  if (is_file(folder / std::string(name))) return {folder / std::string(name)};
  std::string slashed(name);
  std::ranges::replace(slashed, '\\', '/');
  const fs::path relative(slashed);
  if (is_file(folder / relative)) return {folder / relative};
  std::vector<fs::path> paths = {relative.is_absolute() ? fs::path("/") : folder};
  for (const fs::path& step : relative.relative_path()) {
    std::vector<fs::path> next;
    for (const fs::path& path : paths) {
      std::error_code status;
      if (step == "." || step == ".." || step.empty() || fs::exists(path / step, status)) {
        next.push_back(path / step);
        continue;
      }
      for (fs::path& entry : entries_called(path, step.string())) next.push_back(std::move(entry));
    }
    if (next.size() > kMostFolders) return {};
    paths = std::move(next);
  }
  std::erase_if(paths, [](const fs::path& path) { return !is_file(path); });
  std::ranges::sort(paths);
  return paths;
}

}  // namespace ccslice
