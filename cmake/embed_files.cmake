# SPDX-FileCopyrightText: The ccslice authors
# SPDX-License-Identifier: Apache-2.0
#
# Run with -P: writes files as a C++ source, web_files.cpp, that has them as texts.
#
#   cmake -D OUTPUT=web_files.cpp -D "FILES=a.html;b.js" -P embed_files.cmake

set(text "// Made by cmake/embed_files.cmake.\n\n#include \"client/cli/view/web_files.h\"\n\nnamespace ccslice::cli {\n\n")
string(APPEND text "std::span<const WebFile> web_files() {\n  static const WebFile kFiles[] = {\n")
foreach(file IN LISTS FILES)
  cmake_path(GET file FILENAME name)
  file(READ "${file}" content)
  # A literal has 64 KiB at most; these pages are far below.
  string(APPEND text "      {\"/${name}\", R\"ccslice(${content})ccslice\"},\n")
endforeach()
string(APPEND text "  };\n  return kFiles;\n}\n\n}  // namespace ccslice::cli\n")
file(WRITE "${OUTPUT}" "${text}")
