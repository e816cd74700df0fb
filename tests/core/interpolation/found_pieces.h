// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The pieces of a slab together with what finds them.

#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "core/interpolation/pieces/piece_finder.h"
#include "core/interpolation/pieces/slab_pieces.h"

namespace ccslice {

class FoundPieces : public SlabPieces {
 public:
  FoundPieces(const std::shared_ptr<const LimitSolid>& solid, const InterpolationSpec& spec,
              std::shared_ptr<CellNodeStore> store)
      : SlabPieces(solid, spec, true), finder_(solid, spec, std::move(store)) {}

  void find(std::uint32_t layer, const CancellationToken& cancel) { finder_.find(layer, *this, cancel); }

 private:
  PieceFinder finder_;
};

}  // namespace ccslice
