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

NamedFiles::NamedFiles(const FileOrigin& origin) {
  std::error_code unknown;
  if (!origin.path.empty()) folders_.push_back(fs::weakly_canonical(fs::absolute(origin.path).parent_path(), unknown));
  if (!origin.includes.empty()) folders_.push_back(fs::weakly_canonical(fs::absolute(origin.includes), unknown));
}

NamedFiles::Found NamedFiles::find(const fs::path& folder, std::string_view name) const {
  std::error_code unknown;
  Found found{find_files(folder, name)};
  std::string slashed(name);
  std::ranges::replace(slashed, '\\', '/');
  const fs::path named = folder / slashed;
  found.is_outside =
      found.files.empty() && (fs::is_symlink(named, unknown) || !may_name(fs::weakly_canonical(named, unknown)));
  for (fs::path& path : found.files) path = fs::weakly_canonical(path, unknown);
  found.is_outside |=
      std::erase_if(found.files, [&](const fs::path& path) { return !may_name(path); }) > 0 && found.files.empty();
  return found;
}

bool NamedFiles::may_name(const fs::path& target) const {
  return std::ranges::any_of(folders_, [&](const fs::path& folder) {
    return std::mismatch(folder.begin(), folder.end(), target.begin(), target.end()).first == folder.end();
  });
}

}  // namespace ccslice
