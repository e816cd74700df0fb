// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The files of client/web, compiled into the program.

#pragma once

#include <span>
#include <string_view>

namespace ccslice::cli {

struct WebFile {
  std::string_view path;  // "/view.js".
  std::string_view text;
};

std::span<const WebFile> web_files();

}  // namespace ccslice::cli
