// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Writes the manual pages and the completions of ccslice: ccslice_reference FOLDER. Part of the build.

#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>

#include "client/cli/commands/program.h"
#include "client/cli/commands/reference.h"

namespace {

void write(const std::filesystem::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) throw std::runtime_error("can't write " + path.string());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: ccslice_reference FOLDER\n";
    return 2;
  }
  try {
    const std::filesystem::path folder = argv[1];
    const ccslice::cli::Program program;
    std::filesystem::create_directories(folder / "man1");
    for (const CLI::App* command : ccslice::cli::all_commands(program.app)) {
      write(folder / "man1" / (ccslice::cli::page_name(*command) + ".1"), ccslice::cli::manual_page(*command));
    }
    write(folder / "ccslice", ccslice::cli::bash_completion(program.app));
    write(folder / "_ccslice", ccslice::cli::zsh_completion(program.app));
    write(folder / "man1" / "ccslice.1", ccslice::cli::manual_page(program.app));
    return 0;
  } catch (const std::exception& exception) {
    std::cerr << "ccslice_reference: " << exception.what() << "\n";
    return 1;
  }
}
