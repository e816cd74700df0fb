// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <stdexcept>

#include "tests/oracle/hostile/hostile_image_file.h"

namespace ccslice::oracle {

ImageFile read_image_file(std::span<const std::uint8_t>, const PlaneSpec&, std::span<const std::string>,
                          const GridExtent&) {
  throw std::runtime_error("an image file, although none can be written");
}

}  // namespace ccslice::oracle
