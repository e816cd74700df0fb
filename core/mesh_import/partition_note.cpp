// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/partition_note.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "core/base/echo.h"

namespace ccslice {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostFiles = 10'000, kMostPvtu = 20, kMostPvtuBytes = 1 << 20;

/// The first files of a folder, by name. Nothing where it can't be listed.
std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code status;
  for (fs::directory_iterator entry(folder, status), end; !status && entry != end && files.size() < kMostFiles;
       entry.increment(status)) {
    std::error_code unknown;  // A pipe would wait for its other end.
    if (entry->is_regular_file(unknown)) files.push_back(entry->path());
  }
  std::ranges::sort(files);
  return files;
}

/// Whether the .pvtu names the file, and others.
bool names_among_others(const fs::path& pvtu, const std::string& name) {
  std::ifstream stream(pvtu, std::ios::binary);
  std::string text(kMostPvtuBytes, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(stream.gcount()));
  constexpr std::string_view kSource = "Source=\"";
  bool named = false;
  std::size_t sources = 0;
  for (std::size_t at = text.find(kSource); at != std::string::npos; at = text.find(kSource, at + 1)) {
    const std::size_t begin = at + kSource.size();
    named |= fs::path(text.substr(begin, text.find('"', begin) - begin)).filename() == name;
    ++sources;
  }
  return named && sources > 1;
}

/// What stands before a number at the end, if that is "_" or "_p" at its own end.
std::optional<std::string> name_without_number(const fs::path& path) {
  std::string stem = path.stem().string();
  const std::size_t end = stem.find_last_not_of("0123456789");
  if (path.extension() != ".vtu" || end == std::string::npos || end + 1 == stem.size()) return std::nullopt;
  stem.resize(end + 1);
  return stem.ends_with('_') || stem.ends_with("_p") ? std::optional(stem) : std::nullopt;
}

}  // namespace

void add_partition_note(const std::string& path, MeshFile& file) {
  const fs::path own(path);
  const std::string name = own.filename().string();
  const fs::path folder = own.has_parent_path() ? own.parent_path() : fs::path(".");
  std::size_t looked_at = 0;
  for (const fs::path& place : {folder, folder / ".."}) {
    for (const fs::path& other : files_in(place)) {
      if (other.extension() != ".pvtu" || ++looked_at > kMostPvtu) continue;
      if (!names_among_others(other, name)) continue;
      file.warnings.push_back("this is one piece of '" + echoed(other.filename().string()) +
                              "' only, and not the whole part: give that file instead");
      return;
    }
  }
  const std::optional<std::string> common = name_without_number(own);
  if (!common) return;
  for (const fs::path& other : files_in(folder)) {
    if (other.filename() == own.filename() || name_without_number(other) != common) continue;
    file.warnings.push_back(
        "'" + echoed(other.filename().string()) +
        "' stands beside it: if these are pieces of one part, rather than steps in time, merge them "
        "into one .vtu, as ParaView does when it saves a data set");
    return;
  }
}

}  // namespace ccslice
