// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Options that help shows under one heading.

#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace ccslice::cli {

/// Options that are added while this lives are in the group.
class OptionGroup {
 public:
  OptionGroup(CLI::App& command, const char* name)
      : defaults_(*command.option_defaults()), before_(defaults_.get_group()) {
    defaults_.group(name);
  }
  ~OptionGroup() { defaults_.group(before_); }
  OptionGroup(const OptionGroup&) = delete;
  OptionGroup& operator=(const OptionGroup&) = delete;

 private:
  CLI::OptionDefaults& defaults_;
  const std::string before_;
};

}  // namespace ccslice::cli
