// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Runs a fuzz target without libFuzzer: every file of the folders named, each cut short at sixteen places, and each
// with seeded random changes. A crash, an unexpected exception or a sanitizer's report fails the test.

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr int kCuts = 16;
constexpr int kVariations = 64;
constexpr std::uint32_t kSeed = 20190528;

Bytes read_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return Bytes(std::istreambuf_iterator<char>(file), {});
}

void run(const Bytes& bytes) { LLVMFuzzerTestOneInput(bytes.data(), bytes.size()); }

void replay(const Bytes& bytes) {
  run(bytes);
  for (int cut = 0; cut < kCuts; ++cut) {
    run(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() * cut / kCuts)));
  }
  std::mt19937 random(kSeed);
  for (int variation = 0; variation < kVariations && !bytes.empty(); ++variation) {
    Bytes changed = bytes;
    for (int changes = 0; changes <= variation % 4; ++changes) {
      changed[random() % changed.size()] = static_cast<std::uint8_t>(random());
    }
    run(changed);
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::filesystem::path> paths;
  for (int argument = 1; argument < argc; ++argument) {
    for (const auto& entry : std::filesystem::directory_iterator(argv[argument])) paths.push_back(entry.path());
  }
  std::sort(paths.begin(), paths.end());
  for (const auto& path : paths) replay(read_bytes(path));
  std::printf("%zu files replayed\n", paths.size());
  return paths.empty() ? 1 : 0;
}
