// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How the command line explains itself: help as wide as the terminal, and what was probably meant by a typo.

#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace ccslice::cli {

/// Columns of the terminal on standard output, or of the environment variable COLUMNS; 100 if neither says. Between 60
/// and 140, which people can read.
std::size_t help_columns();

/// The help of commands and options, wrapped at so many columns.
class HelpFormatter : public CLI::Formatter {
 public:
  explicit HelpFormatter(std::size_t columns);

  std::string make_description(const CLI::App* app) const override;
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* command) const override;
  std::string make_footer(const CLI::App* app) const override;

 private:
  std::string entry(const std::string& name, const std::string& description) const;

  const std::size_t columns_;
};

/// A text that ends a command's help: lines of prose, and lines that begin with two spaces for examples. Prose is
/// wrapped. An example that is too long goes on with an option on another line, as a shell has it.
std::string wrapped_footer(const std::string& footer, std::size_t columns);

/// The name that is most like `word`, if one is like it: "pich" means "pitch". Empty if none is.
std::string closest_name(std::string_view word, const std::vector<std::string>& names);

/// "ccslice tray pack": the command with those that it is below.
std::string full_name(const CLI::App& command);

/// What is wrong with a command line that `app` couldn't parse, what may have been meant, and where help is.
std::string describe_parse_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace ccslice::cli
