// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Files of volumes from arbitrary bytes: a volume or an Error, nothing else. The first byte says which reader takes the
// rest.

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "core/base/error.h"
#include "core/volume_files/read_meta_image.h"
#include "core/volume_files/read_nifti.h"
#include "core/volume_files/read_npy.h"
#include "core/volume_files/read_nrrd.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto read = [&] {
    switch (data[0] % 5) {
      case 0: return ccslice::read_nrrd(bytes, "");
      case 1: return ccslice::read_meta_image(bytes, "");
      case 2: return ccslice::read_nifti(bytes);
      case 3: return ccslice::read_npy(bytes, false);
      default: return ccslice::read_npy(bytes, true);
    }
  };
  try {
    const ccslice::VolumeFile file = read();
    if (file.samples.size() != file.shape.bytes()) std::abort();
  } catch (const ccslice::Error&) {
  }
  return 0;
}
