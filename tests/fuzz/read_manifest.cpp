// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// manifest.json and journal.jsonl from arbitrary bytes, beside a picture that they may name: layers or an Error,
// nothing else.

#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

#include "client/cli/base/output_file.h"
#include "client/cli/output/job_journal.h"
#include "client/cli/output/joined_job.h"
#include "client/cli/output/layer_stack.h"
#include "core/base/error.h"
#include "core/output/png.h"
#include "tests/client/process.h"

namespace {

namespace cli = ccslice::cli;
using ccslice::Error;

const cli::JobKey kJob = {.id = "job", .layers = 3};

void read_layers(const std::filesystem::path& folder) {
  const cli::LayerStack stack(folder);
  for (std::uint32_t layer = 0; layer < stack.layers(); ++layer) {
    for (std::size_t plane = 0; plane < stack.planes().size(); ++plane) stack.samples(layer, plane);
  }
}

template <typename Read>
void expect_error_at_most(Read&& read) {
  try {
    read();
  } catch (const Error&) {
  }
}

/// A folder with the picture layer_0.png, which is grey and 2 x 2.
class Folder {
 public:
  Folder() {
    constexpr std::array<std::uint8_t, 4> kSamples = {0, 100, 200, 255};
    const std::vector<std::uint8_t> png = ccslice::PngEncoder().grey({ccslice::SampleType::kUint8, 2, 2, kSamples}, {});
    cli::write_file(path() / "layer_0.png", {reinterpret_cast<const char*>(png.data()), png.size()});
  }
  const std::filesystem::path& path() const { return folder_.path(); }

 private:
  ccslice::client::TemporaryFolder folder_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Folder folder;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  cli::write_file(folder.path() / "manifest.json", bytes);
  cli::write_file(folder.path() / cli::JobJournal::kName, bytes);
  expect_error_at_most([] { cli::read_journal(folder.path(), kJob); });
  expect_error_at_most([] { cli::holds_whole_job(folder.path(), kJob); });
  expect_error_at_most([] { read_layers(folder.path()); });
  expect_error_at_most([] { cli::JoinedJob({cli::read_share_folder(folder.path())}).manifest(); });
  return 0;
}
