// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/descriptor.h"

#include <unistd.h>

#include <filesystem>
#include <iterator>
#include <system_error>

namespace ccslice::server {

std::size_t open_descriptors() {
  std::error_code error;
  const std::filesystem::directory_iterator all("/proc/self/fd", error);
  return error ? 0 : static_cast<std::size_t>(std::distance(begin(all), end(all)));
}

void Descriptor::close() noexcept {
  if (number_ >= 0) ::close(release());
}

}  // namespace ccslice::server
