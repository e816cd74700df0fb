// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/commands/help.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string>

#include "core/base/echo.h"
#include "core/base/similar_name.h"

namespace ccslice::cli {
namespace {

constexpr std::size_t kNameColumns = 28;

/// Lines of words, each but the first after `indent` spaces. Line breaks and words that are too long stay.
std::string wrapped(const std::string& text, std::size_t columns, std::size_t indent) {
  std::string out;
  std::size_t used = indent;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find_first_of(" \n", at), text.size());
    const std::size_t length = end - at;
    const bool first = used == indent;
    if (!first && used + 1 + length > columns) {
      out += "\n" + std::string(indent, ' ');
      used = indent;
    } else if (!first) {
      out += ' ';
      ++used;
    }
    out.append(text, at, length);
    used += length;
    at = end + 1;
    if (end < text.size() && text[end] == '\n') {
      out += "\n" + std::string(indent, ' ');
      used = indent;
    }
  }
  return out;
}

/// An option's name and what it takes, on more lines if its choices, which commas part, are too many for one.
std::string wrapped_choices(std::string rest, std::size_t columns) {
  constexpr std::size_t kIndent = 6;
  std::string out;
  while (rest.size() > columns) {
    const std::size_t comma = rest.rfind(',', columns - 1);
    if (comma == std::string::npos || comma < kIndent) break;
    out += rest.substr(0, comma + 1) + "\n";
    rest = std::string(kIndent, ' ') + rest.substr(comma + 1);
  }
  return out + rest;
}

/// Where the last option begins that a line can go on with: before column `end`, or else the first one after `begin`.
std::size_t next_line_at(const std::string& line, std::size_t begin, std::size_t end) {
  std::size_t found = std::string::npos;
  for (std::size_t at = line.find(" -", begin); at != std::string::npos; at = line.find(" -", at + 1)) {
    const bool option = at + 2 < line.size() && line[at + 2] != ' ';
    if (!option) continue;
    if (at > end && found != std::string::npos) break;
    found = at;
    if (at > end) break;
  }
  return found;
}

/// A command for a shell, on more lines if it is too long for one: each goes on with an option.
std::string wrapped_example(const std::string& line, std::size_t columns) {
  const std::string goes_on = " \\", indent(6, ' ');
  std::string out, rest = line;
  while (rest.size() > columns) {
    const std::size_t words = rest.find_first_not_of(' ') + 1;
    const std::size_t at = next_line_at(rest, words, columns - goes_on.size());
    if (at == std::string::npos) break;
    out += rest.substr(0, at) + goes_on + "\n";
    rest = indent + rest.substr(at + 1);
  }
  return out + rest;
}

/// "--pitch", "-o", "slice": what a command understands.
std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  return names;
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

std::string meant(const std::string& word, const std::vector<std::string>& names) {
  const std::string closest = closest_name(word, names);
  return closest.empty() ? "" : "; did you mean " + closest + "?";
}

/// The command that was being parsed: the innermost one of the command line, or the program.
const CLI::App& parsed_command(const CLI::App& app) {
  const std::vector<CLI::App*> commands = app.get_subcommands();
  return commands.empty() ? app : parsed_command(*commands.front());
}

/// What of the command line belongs to nothing; empty if all does.
std::string describe_rest(const CLI::App& app, const CLI::App& command) {
  std::vector<std::string> rest = app.remaining(true);
  const auto option = std::ranges::find_if(rest, [](const std::string& word) { return word.starts_with("--"); });
  if (option != rest.end()) {
    const std::string name = option->substr(0, option->find('='));
    const std::vector<std::string> names = option_names(command);
    if (&command != &app && std::ranges::find(names, name) != names.end()) {
      return name + " stands behind its command, as in " + full_name(command) + " " + name;
    }
    return "unknown option " + echoed(name) + meant(name, names);
  }
  if (rest.empty()) return "";
  if (const std::vector<std::string> names = command_names(command); !names.empty()) {
    return "unknown command " + echoed(rest.front()) + meant(rest.front(), names);
  }
  return "unexpected argument " + echoed(rest.front());
}

/// What CLI11 says of a number that it can't read, with what the option takes.
std::string describe_conversion(const CLI::App& command, const std::string& what) {
  const std::string_view begin = "Could not convert: ", middle = " = ";
  const std::size_t end = what.find(middle);
  if (!what.starts_with(begin) || end == std::string::npos) return what;
  const std::string name = what.substr(begin.size(), end - begin.size());
  const CLI::Option* const option = command.get_option_no_throw(name);
  const std::string type = option == nullptr ? "" : option->get_type_name();
  std::string number = "a number";
  if (type.starts_with("INT")) number = "a whole number";
  if (type.starts_with("UINT")) number = "a whole number from 0 on";
  return name + " takes " + number + ", not '" + echoed(what.substr(end + middle.size())) + "'";
}

}  // namespace

std::size_t help_columns() {
  constexpr std::size_t kUsual = 100, kFewest = 60, kMost = 140;
  std::size_t columns = kUsual;
  winsize size = {};
  if (isatty(STDOUT_FILENO) == 1 && ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) {
    columns = size.ws_col;
  } else if (const char* const variable = std::getenv("COLUMNS")) {
    const int said = std::atoi(variable);
    if (said > 0) columns = static_cast<std::size_t>(said);
  }
  return std::clamp(columns, kFewest, kMost);
}

HelpFormatter::HelpFormatter(std::size_t columns) : columns_(columns) { column_width(kNameColumns); }

std::string HelpFormatter::entry(const std::string& name, const std::string& description) const {
  std::string text = "  " + name;
  if (description.empty()) return text + "\n";
  if (text.size() + 2 > kNameColumns) {
    text = wrapped_choices(text, columns_) + "\n" + std::string(kNameColumns, ' ');
  } else {
    text.resize(kNameColumns, ' ');
  }
  return text + wrapped(description, columns_, kNameColumns) + "\n";
}

std::string HelpFormatter::make_description(const CLI::App* app) const {
  return wrapped(Formatter::make_description(app), columns_, 0);
}

std::string HelpFormatter::make_option(const CLI::Option* option, bool is_positional) const {
  return entry(make_option_name(option, is_positional) + make_option_opts(option), make_option_desc(option));
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
  return entry(command->get_name(), command->get_description());
}

std::string HelpFormatter::make_footer(const CLI::App* app) const {
  const std::string footer = app->get_footer();
  return footer.empty() ? "" : wrapped_footer(footer, columns_);
}

std::string wrapped_footer(const std::string& footer, std::size_t columns) {
  std::string out;
  for (std::size_t begin = 0; begin <= footer.size();) {
    const std::size_t end = std::min(footer.find('\n', begin), footer.size());
    const std::string line = footer.substr(begin, end - begin);
    out += (line.starts_with("  ") ? wrapped_example(line, columns) : wrapped(line, columns, 0)) + "\n";
    begin = end + 1;
  }
  return out;
}

std::string closest_name(std::string_view word, const std::vector<std::string>& names) {
  std::string closest;
  std::size_t least = std::max<std::size_t>(1, word.size() / 3) + 1;
  for (const std::string& name : names) {
    // A word that was cut short is the name's beginning, however long the rest is.
    constexpr std::size_t kShortest = 4;
    const bool begins = word.size() >= kShortest && name.starts_with(word);
    const std::size_t distance = begins ? 1 : edit_distance(word, name);
    if (distance >= least) continue;
    least = distance;
    closest = name;
  }
  return closest;
}

std::string full_name(const CLI::App& command) {
  const CLI::App* const parent = command.get_parent();
  return parent == nullptr ? command.get_name() : full_name(*parent) + " " + command.get_name();
}

std::string describe_parse_error(const CLI::App& app, const CLI::ParseError& error) {
  const CLI::App& command = parsed_command(app);
  const std::string rest = describe_rest(app, command);
  const std::string what = rest.empty() ? describe_conversion(command, error.what()) : rest;
  return what + "\n" + full_name(command) + " --help shows what there is";
}

}  // namespace ccslice::cli
