// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The lines of an Abaqus input file and of the files that it includes, in the order in which they apply. A keyword line
// begins with a star and goes on in the next one where it ends with a comma; a comment begins with two; all others are
// data, separated by commas [Abaqus, Input Syntax Rules].
//
// Failures name the line, and the file where it isn't the first one.

#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/mesh_import/find_file.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// A name as names are compared: in capitals, without blanks and quotes.
std::string abaqus_key(std::string_view text);

struct AbaqusKeyword {
  std::string name;                                             // In capitals, without star and blanks: "ENDPART".
  std::vector<std::pair<std::string, std::string>> parameters;  // Names likewise; values as written, without quotes.

  /// The parameter's value, or "" if it isn't there.
  std::string_view value_of(std::string_view parameter) const;
  /// Whether the parameter is there, with a value or without.
  bool has(std::string_view parameter) const;
};

class AbaqusLines {
 public:
  /// `bytes` must outlive the lines. Includes are relative to the folder of the file that has them. They have to be in
  /// the folder of origin.path, in origin.includes, or below: a file that somebody sent must not read others. All of
  /// them together may have origin.max_bytes.
  AbaqusLines(std::string_view bytes, const FileOrigin& origin);

  /// Goes on to the next line that isn't a comment. False behind the last one.
  bool next();
  bool is_keyword() const { return line_.starts_with('*'); }
  /// The keyword line, with those that continue it.
  AbaqusKeyword keyword();
  /// The entries of the data line, without blanks around them; the last one is empty where it ends with a comma.
  const std::vector<std::string_view>& entries();

  /// From the next line on: the lines of that file (find_file.h), then those that follow this one. Throws
  /// Error{kFileUnreadable, kFileUnsupported, kFileSyntax} if that can't be.
  void include(std::string_view name);

  /// An entry of a data line: a real, which may be nan or inf (0 if it is empty), or a whole number.
  double any_real(std::string_view entry, std::string_view expected) const;
  std::uint64_t count(std::string_view entry, std::string_view expected) const;

  /// Where the line is, for failures that show later.
  std::uint64_t mark() const;
  [[noreturn]] void fail(std::string_view expected, std::string_view found) const;
  [[noreturn]] void fail_at(std::uint64_t mark, ErrorCode code, const std::string& message) const;

 private:
  struct File {
    std::string path;  // "" if it isn't known.
    std::string owned;
    std::string_view bytes;
  };
  struct Place {
    std::size_t file, at, line;
  };
  bool next_raw();
  std::vector<std::filesystem::path> files_to_include(const std::filesystem::path& folder, std::string_view name) const;
  std::size_t open(const std::string& path);

  const NamedFiles named_files_;
  std::deque<File> files_;     // Each once, however often it is included.
  std::vector<Place> places_;  // The file that is being read is the last one.
  std::size_t includes_ = 0;
  const std::uint64_t max_bytes_;
  std::uint64_t read_bytes_;  // Of all files, each time counted.
  std::string_view line_;
  std::uint64_t mark_ = 0;
  std::vector<std::string_view> entries_;
};

}  // namespace ccslice
