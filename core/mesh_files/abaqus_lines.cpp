// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/abaqus_lines.h"

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "core/base/read_file.h"
#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {
namespace {

constexpr std::size_t kMostIncludes = 1000;  // A few files that include each other twice could go on for ever.
constexpr unsigned kLineBits = 40;

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\v\f";
  const std::size_t first = text.find_first_not_of(kBlanks);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlanks) - first + 1);
}

std::string unquoted(std::string_view value) {
  value = trimmed(value);
  if (value.size() >= 2 && value.front() == '"' && value.back() == '"') value = value.substr(1, value.size() - 2);
  return std::string(value);
}

/// Up to the next comma outside of quotes, which is taken, too.
std::string_view take_entry(std::string_view& text) {
  bool quoted = false;
  std::size_t end = 0;
  for (; end < text.size() && (quoted || text[end] != ','); ++end) quoted ^= text[end] == '"';
  const std::string_view entry = text.substr(0, end);
  text.remove_prefix(std::min(end + 1, text.size()));
  return entry;
}

}  // namespace

std::string abaqus_key(std::string_view text) {
  std::string key;
  for (const char c : text) {
    if (c != ' ' && c != '\t' && c != '"') key += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  }
  return key;
}

std::string_view AbaqusKeyword::value_of(std::string_view parameter) const {
  for (const auto& [name, value] : parameters) {
    if (name == parameter) return value;
  }
  return {};
}

bool AbaqusKeyword::has(std::string_view parameter) const {
  return std::ranges::any_of(parameters, [&](const auto& known) { return known.first == parameter; });
}

AbaqusLines::AbaqusLines(std::string_view bytes, const FileOrigin& origin)
    : named_files_(origin), max_bytes_(origin.max_bytes), read_bytes_(bytes.size()) {
  files_.push_back({origin.path, {}, bytes});
  places_.push_back({0, 0, 0});
}

/// The next line, blank or not, of this file only.
bool AbaqusLines::next_raw() {
  Place& place = places_.back();
  const std::string_view bytes = files_[place.file].bytes;
  if (place.at >= bytes.size()) return false;
  const std::size_t end = std::min(bytes.find('\n', place.at), bytes.size());
  line_ = trimmed(bytes.substr(place.at, end - place.at));
  place.at = end + 1;
  ++place.line;
  mark_ = std::uint64_t{place.file} << kLineBits | place.line;
  return true;
}

bool AbaqusLines::next() {
  while (true) {
    while (!next_raw()) {
      if (places_.size() == 1) return false;
      places_.pop_back();
    }
    if (!line_.starts_with("**")) return true;
  }
}

AbaqusKeyword AbaqusLines::keyword() {
  // A comma at the end goes on in the next line. Some programs write one with nothing to follow: no parameter begins as
  // numbers and keywords do.
  constexpr std::string_view kBeginsOtherLines = "0123456789+-.*";
  std::string text(line_.substr(1));
  bool goes_on = line_.ends_with(',');
  while (goes_on) {
    const Place before = places_.back();
    const std::uint64_t mark = mark_;
    if (!next_raw()) break;
    if (line_.starts_with("**")) continue;
    if (!line_.empty() && kBeginsOtherLines.find(line_.front()) != std::string_view::npos) {
      places_.back() = before;
      mark_ = mark;
      break;
    }
    text += line_;
    goes_on = line_.ends_with(',');
  }
  AbaqusKeyword keyword;
  std::string_view rest = text;
  keyword.name = abaqus_key(take_entry(rest));
  while (!rest.empty()) {
    const std::string_view entry = take_entry(rest);
    const std::size_t sign = std::min(entry.find('='), entry.size());
    keyword.parameters.emplace_back(abaqus_key(entry.substr(0, sign)),
                                    unquoted(entry.substr(std::min(sign + 1, entry.size()))));
  }
  return keyword;
}

const std::vector<std::string_view>& AbaqusLines::entries() {
  entries_.clear();
  std::string_view rest = line_;
  bool more = true;
  while (more) {
    const std::size_t comma = rest.find(',');
    more = comma != std::string_view::npos;
    entries_.push_back(trimmed(rest.substr(0, comma)));
    rest.remove_prefix(more ? comma + 1 : rest.size());
  }
  return entries_;
}

void AbaqusLines::include(std::string_view name) {
  namespace fs = std::filesystem;
  const std::string shown = in_quotes(printable(name));
  if (name.empty()) fail("the name of a file (INPUT=...)", "none");
  const std::string& path = files_[places_.back().file].path;
  if (path.empty()) {
    fail_at(mark_, ErrorCode::kFileUnsupported,
            "the file includes " + shown + ", which can't be told from its bytes alone: put its lines here instead");
  }
  const std::vector<fs::path> found = files_to_include(fs::path(path).parent_path(), name);
  if (found.size() != 1) {
    fail_at(
        mark_, ErrorCode::kFileUnreadable,
        (found.empty() ? "there is no file " + shown
                       : std::to_string(found.size()) + " files are called " + shown + " but for the case of letters") +
            " in the folder of " + path + ", which includes it");
  }
  if (++includes_ > kMostIncludes) {
    fail_at(mark_, ErrorCode::kMeshTooLarge, "more than " + std::to_string(kMostIncludes) + " includes");
  }
  const std::size_t file = open(found.front().string());
  const auto is_open = [&](const Place& place) {
    std::error_code ignored;
    return place.file == file || fs::equivalent(files_[place.file].path, found.front(), ignored);
  };
  if (std::any_of(places_.begin(), places_.end(), is_open)) {
    fail_at(mark_, ErrorCode::kFileSyntax, shown + " includes itself: take one of the includes out");
  }
  places_.push_back({file, 0, 0});
}

/// Files that `name` may stand for, canonical.
std::vector<std::filesystem::path> AbaqusLines::files_to_include(const std::filesystem::path& folder,
                                                                 std::string_view name) const {
  NamedFiles::Found found = named_files_.find(folder, name);
  if (!found.is_outside) return std::move(found.files);
  fail_at(mark_, ErrorCode::kFileUnreadable,
          in_quotes(printable(name)) + " is outside of the folder of " + files_.front().path +
              ": allow the folder that it is in (--allow-includes), or put the file beside this one");
}

std::size_t AbaqusLines::open(const std::string& path) {
  const auto known =
      std::find_if(files_.begin() + 1, files_.end(), [&](const File& file) { return file.path == path; });
  const auto file = static_cast<std::size_t>(known - files_.begin());
  if (known == files_.end()) {
    File& opened = files_.emplace_back(File{path, read_file_bytes(path, max_bytes_), {}});
    opened.bytes = opened.owned;
  }
  read_bytes_ += files_[file].bytes.size();
  if (read_bytes_ <= max_bytes_) return file;
  fail_at(mark_, ErrorCode::kMeshTooLarge,
          "with the files that it includes, each time counted, the file has more than " + std::to_string(max_bytes_) +
              " bytes (--max-file-bytes)");
}

double AbaqusLines::any_real(std::string_view entry, std::string_view expected) const {
  if (entry.empty()) return 0;
  std::string text(entry);
  // Fortran's double precision.
  std::replace_if(
      text.begin(), text.end(), [](char c) { return c == 'd' || c == 'D'; }, 'e');
  const std::optional<double> value = parse_real(text);
  if (!value) fail(expected, entry);
  return *value;
}

std::uint64_t AbaqusLines::count(std::string_view entry, std::string_view expected) const {
  const std::optional<std::uint64_t> value = parse_count(entry);
  if (!value) {
    fail_at(mark_, ErrorCode::kFileSyntax,
            "expected " + std::string(expected) + ", found " + no_count(entry.empty() ? "nothing" : entry));
  }
  return *value;
}

std::uint64_t AbaqusLines::mark() const { return mark_; }

void AbaqusLines::fail(std::string_view expected, std::string_view found) const {
  fail_at(mark_, ErrorCode::kFileSyntax,
          "expected " + std::string(expected) + ", found " + in_quotes(printable(found)));
}

void AbaqusLines::fail_at(std::uint64_t mark, ErrorCode code, const std::string& message) const {
  const std::size_t file = mark >> kLineBits;
  const std::uint64_t line = mark & ((std::uint64_t{1} << kLineBits) - 1);
  const std::string where = file == 0 ? "" : files_[file].path + ": ";
  throw Error(code, where + "line " + std::to_string(line) + ": " + message);
}

}  // namespace ccslice
