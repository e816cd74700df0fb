// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// 3MF packages of other programs: whole archives, and the XML of their parts.

#include <sys/mman.h>
#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "client/cli/tray/model_settings.h"
#include "client/cli/tray/package_model.h"
#include "client/cli/tray/tray_package.h"
#include "core/base/error.h"

namespace {

/// Runs `action`; it may refuse what it reads, and nothing else.
template <typename Action>
void refusing(const Action& action) {
  try {
    action();
  } catch (const ccslice::Error&) {
  }
}

void read_archive(std::string_view bytes) {
  const int file = memfd_create("plate.3mf", MFD_CLOEXEC);
  if (file < 0) return;
  if (write(file, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size())) {
    constexpr std::uint64_t kMostBytes = 16 << 20;
    refusing([&] { ccslice::cli::read_tray_package("/proc/self/fd/" + std::to_string(file), kMostBytes); });
  }
  close(file);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (bytes.starts_with("PK")) {
    read_archive(bytes);
    return 0;
  }
  refusing([&] { ccslice::cli::parse_package_model(std::string(bytes), "part"); });
  refusing([&] { ccslice::cli::parse_model_settings(std::string(bytes), "part"); });
  return 0;
}
