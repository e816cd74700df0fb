// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Writes the manual page of ccsliced, from the text of --help: ccsliced_reference FILE. Part of the build.

#include <fstream>
#include <iostream>
#include <string>

#include "core/base/roff.h"
#include "core/base/version.h"
#include "server/service/options/options.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: ccsliced_reference FILE\n";
    return 2;
  }
  // Defaults follow the machine; the page shall not follow the one that it is built on.
  ccslice::server::Resources machine;
  machine.cpus = 4;
  machine.memory_bytes = 16ull << 30;
  std::ofstream page(argv[1], std::ios::binary);
  page << ".TH CCSLICED 1 \"\" \"ccslice " << ccslice::kVersion << "\" \"ccslice\"\n"
       << ".SH NAME\nccsliced \\- slices Catmull-Clark solids into voxel layers, over gRPC\n"
       << ".SH DESCRIPTION\nWhat ccsliced \\-\\-help says on a machine with 4 CPUs and 16 GiB of memory.\n.PP\n.nf\n"
       << ccslice::roff(ccslice::server::help_text(machine)) << ".fi\n.SH SEE ALSO\n\\fBccslice\\fR(1)\n";
  if (page.flush()) return 0;
  std::cerr << "ccsliced_reference: can't write " << argv[1] << "\n";
  return 1;
}
