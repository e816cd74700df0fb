// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/commands/reference.h"

#include <algorithm>
#include <cctype>
#include <string>
#include <vector>

#include "client/cli/base/text_values.h"
#include "client/cli/commands/help.h"
#include "core/base/roff.h"
#include "core/base/version.h"

namespace ccslice::cli {
namespace {

std::vector<const CLI::App*> commands_of(const CLI::App& app) { return app.get_subcommands({}); }

/// "--output" before "-o"; those of a flag that can be unset, too.
std::vector<std::string> names_of(const CLI::Option& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
  for (const std::string& name : option.get_snames()) names.push_back("-" + name);
  return names;
}

std::vector<const CLI::Option*> options_of(const CLI::App& app) {
  return app.get_options([](const CLI::Option* option) { return option->nonpositional(); });
}

bool takes_value(const CLI::Option& option) { return option.get_items_expected_max() > 0; }

/// What an option takes if that is one of a few words: CLI11 says "TEXT:{none,json,csv}".
std::vector<std::string> choices_of(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const std::size_t begin = type.find('{'), end = type.rfind('}');
  if (begin == std::string::npos || end == std::string::npos || end < begin) return {};
  return split(type.substr(begin + 1, end - begin - 1), ',');
}

/// Whether the option names a file or a folder.
bool takes_file(const CLI::Option& option) {
  const std::string name = option.get_name();
  return name == "--output" || name == "--mesh" || name == "--ca" || name == "--cert" || name == "--key" ||
         name.ends_with("-file");
}

std::string upper(std::string text) {
  std::ranges::transform(text, text.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

std::string bold(const std::string& text) { return "\\fB" + roff(text) + "\\fR"; }

/// "in 'single quotes'" for shells.
std::string shell_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

void add_manual_option(const CLI::Option& option, std::string& page) {
  std::string names;
  for (const std::string& name : names_of(option)) names += (names.empty() ? "" : ", ") + bold(name);
  if (option.get_positional()) names = "\\fI" + roff(option.get_name()) + "\\fR";
  const std::vector<std::string> choices = choices_of(option);
  if (takes_value(option) && !option.get_positional()) names += choices.empty() ? " \\fIVALUE\\fR" : "";
  std::string description = roff(option.get_description());
  if (!choices.empty()) description += (description.empty() ? "" : ". ") + roff("One of: " + joined(choices));
  if (!option.get_default_str().empty()) description += " (default: " + roff(option.get_default_str()) + ")";
  page += ".TP\n" + names + "\n" + description + "\n";
}

void add_manual_options(const CLI::App& app, std::string& page) {
  for (const std::string& group : app.get_groups()) {
    const auto options = app.get_options([&](const CLI::Option* option) { return option->get_group() == group; });
    if (group.empty() || options.empty()) continue;
    page += ".SS " + roff(group) + "\n";
    for (const CLI::Option* option : options) add_manual_option(*option, page);
  }
}

/// Prose for roff to fill, and examples that stay as they are.
std::string manual_notes(const std::string& footer) {
  constexpr std::size_t kExampleColumns = 72;
  std::string notes;
  bool after_prose = false, after_example = false;
  for (const std::string& line : split(footer, '\n')) {
    const bool example = line.starts_with("  ");
    if (example != after_example) notes += example ? ".nf\n" : ".fi\n";
    if (after_prose && !example && !line.empty()) notes += ".br\n";
    notes += line.empty() ? ".PP\n" : example ? roff(wrapped_footer(line, kExampleColumns)) : roff(line) + "\n";
    after_example = example;
    after_prose = !example && !line.empty();
  }
  return notes + (after_example ? ".fi\n" : "");
}

std::string zsh_text(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

/// What zsh's _arguments wants to know of an option, once for each of its names.
std::string zsh_option(const CLI::Option& option, const std::string& name) {
  std::string spec =
      (option.get_items_expected_max() > 1 ? "*" : "") + name + "[" + zsh_text(option.get_description()) + "]";
  if (!takes_value(option)) return shell_quoted(spec);
  const std::vector<std::string> choices = choices_of(option);
  spec += choices.empty() ? (takes_file(option) ? ":file:_files" : ":value:") : ":value:(" + joined(choices) + ")";
  return shell_quoted(spec);
}

/// "tray pack": a command's words behind the program's.
std::string words_of(const CLI::App& command) {
  const std::string name = full_name(command);
  return name.substr(std::min(name.find(' '), name.size() - 1) + 1);
}

/// Adds a command to a completion's `case`: to `values` the words of options that take some, to `options` those of the
/// command itself.
void add_bash_command(const CLI::App& command, std::string& values, std::string& options) {
  std::vector<std::string> all;
  for (const CLI::App* below : commands_of(command)) all.push_back(below->get_name());
  for (const CLI::Option* option : options_of(command)) {
    for (const std::string& name : names_of(*option)) {
      all.push_back(name);
      const std::vector<std::string> choices = choices_of(*option);
      if (choices.empty() || !takes_value(*option)) continue;
      values +=
          "    " + shell_quoted(words_of(command) + " " + name) + ") words=" + shell_quoted(joined(choices)) + " ;;\n";
    }
  }
  options += "      " + shell_quoted(words_of(command)) + ") words=" + shell_quoted(joined(all)) + " ;;\n";
}

/// Names and descriptions of commands, for zsh's _describe.
std::string zsh_names(const CLI::App& app) {
  std::string names;
  for (const CLI::App* command : commands_of(app)) {
    names += "    " + shell_quoted(zsh_text(command->get_name()) + ":" + command->get_description()) + "\n";
  }
  return names;
}

std::string zsh_case(const CLI::App& command) {
  std::string text = "    " + shell_quoted(words_of(command)) + ")\n";
  if (const std::string below = zsh_names(command); !below.empty()) {
    return text + "      local -a below=(\n" + below + "      )\n      _describe command below ;;\n";
  }
  text += "      _arguments \\\n";
  for (const CLI::Option* option : options_of(command)) {
    for (const std::string& name : names_of(*option)) text += "        " + zsh_option(*option, name) + " \\\n";
  }
  return text + "        '*:file:_files' ;;\n";
}

/// Names of the commands that have commands below them, as a pattern of a shell: "tray|other".
std::string groups_of(const CLI::App& app) {
  std::string pattern;
  for (const CLI::App* command : commands_of(app)) {
    if (!commands_of(*command).empty()) pattern += (pattern.empty() ? "" : "|") + command->get_name();
  }
  return pattern;
}

}  // namespace

std::vector<const CLI::App*> all_commands(const CLI::App& app) {
  std::vector<const CLI::App*> all;
  for (const CLI::App* command : commands_of(app)) {
    all.push_back(command);
    for (const CLI::App* below : all_commands(*command)) all.push_back(below);
  }
  return all;
}

std::string page_name(const CLI::App& command) {
  std::string name = full_name(command);
  std::ranges::replace(name, ' ', '-');
  return name;
}

std::string manual_page(const CLI::App& app) {
  const bool program = app.get_parent() == nullptr;
  const std::string name = page_name(app);
  std::string page = ".TH " + upper(name) + " 1 \"\" \"ccslice " + kVersion + "\" \"ccslice\"\n";
  page += ".SH NAME\n" + roff(name) + " \\- " + roff(app.get_description()) + "\n";
  page += ".SH SYNOPSIS\n" + bold(full_name(app));
  page += !commands_of(app).empty() ? " \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n" : " [\\fIOPTIONS\\fR]";
  for (const CLI::Option* option : app.get_options([](const CLI::Option* o) { return o->get_positional(); })) {
    page += " \\fI" + roff(option->get_name()) + "\\fR";
  }
  page += "\n.SH OPTIONS\n";
  add_manual_options(app, page);
  if (const std::vector<const CLI::App*> all = all_commands(app); !all.empty()) {
    page += ".SH COMMANDS\n";
    for (const CLI::App* command : all) {
      page += ".TP\n" + bold(page_name(*command)) + "(1)\n" + roff(command->get_description()) + "\n";
    }
  }
  if (!app.get_footer().empty()) page += ".SH NOTES\n" + manual_notes(app.get_footer());
  page += ".SH SEE ALSO\n" + (program ? std::string() : bold("ccslice") + "(1), ") + bold("ccsliced") + "(1)\n";
  return page;
}

std::string bash_completion(const CLI::App& app) {
  std::vector<std::string> names = {"help", "--help", "--version"};
  std::string values, options;
  for (const CLI::App* command : commands_of(app)) names.push_back(command->get_name());
  for (const CLI::App* command : all_commands(app)) add_bash_command(*command, values, options);
  return "# bash completion of ccslice, made of its --help\n"
         "_ccslice() {\n"
         "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} command=${COMP_WORDS[1]} words=\n"
         "  if ((COMP_CWORD == 1)) || [[ $command == help ]]; then\n"
         "    words=" +
         shell_quoted(joined(names)) +
         "\n"
         "    mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$word\")\n"
         "    return\n"
         "  fi\n"
         "  local group=\n"
         "  case $command in " +
         groups_of(app) +
         ")\n"
         "    if ((COMP_CWORD == 2)); then group=yes; else command=\"$command ${COMP_WORDS[2]}\"; fi ;;\n"
         "  esac\n"
         "  case \"$command $before\" in\n" +
         values +
         "  esac\n"
         "  if [[ -z $words && ($word == -* || -n $group) ]]; then\n"
         "    case $command in\n" +
         options +
         "    esac\n"
         "  fi\n"
         "  if [[ -n $words ]]; then\n"
         "    mapfile -t COMPREPLY < <(compgen -W \"$words\" -- \"$word\")\n"
         "  else\n"
         "    compopt -o filenames 2>/dev/null || true\n"
         "    mapfile -t COMPREPLY < <(compgen -f -- \"$word\")\n"
         "  fi\n"
         "}\n"
         "complete -F _ccslice ccslice\n";
}

std::string zsh_completion(const CLI::App& app) {
  std::string cases;
  for (const CLI::App* command : all_commands(app)) cases += zsh_case(*command);
  return "#compdef ccslice\n"
         "# zsh completion of ccslice, made of its --help\n"
         "local -a commands=(\n" +
         zsh_names(app) +
         "    'help:Explain a command'\n"
         ")\n"
         "if ((CURRENT == 2)); then\n"
         "  _describe command commands\n"
         "else\n"
         "  local command=$words[2]\n"
         "  shift words\n"
         "  ((CURRENT--))\n"
         "  case $command in " +
         groups_of(app) +
         ")\n"
         "    if ((CURRENT > 2)); then\n"
         "      command=\"$command $words[2]\"\n"
         "      shift words\n"
         "      ((CURRENT--))\n"
         "    fi ;;\n"
         "  esac\n"
         "  case $command in\n" +
         cases +
         "    help) _describe command commands ;;\n"
         "  esac\n"
         "fi\n";
}

}  // namespace ccslice::cli
