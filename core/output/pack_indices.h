// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Materials' numbers, a byte each, packed into fewer bits: the first voxel of a row in the most significant bits of its
// first byte, as in PNG; rows padded to whole bytes with zeros.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/ids.h"
#include "core/output/plane.h"

namespace ccslice {

/// 1, 2, 4 or 8; 0 for types that don't hold numbers of materials.
std::uint32_t bits_per_index(SampleType type);

/// The type of the fewest bits that holds 0..materials. REQUIRES: materials < 256.
SampleType smallest_index_type(std::size_t materials);

/// Throws Error{kInternal} if there is a number beyond the palette.
void require_known_materials(const IndexImage& image);

/// Voxels of each number, from the background's on. Throws as above, and Error{kCancelled}.
std::vector<std::uint64_t> count_materials(const IndexImage& image, const CancellationToken& cancel);

/// One bit a voxel of the image's window: which are of these materials. Throws Error{kCancelled}.
void pack_mask(const IndexImage& image, MaterialSet materials, std::vector<std::uint8_t>& packed,
               const CancellationToken& cancel);

/// Numbers one after the other; what is left of the last byte is 0. REQUIRES: bits 1, 2, 4 or 8; all numbers below
/// 2^bits; room for ceil(count * bits / 8) bytes.
void pack_numbers(const std::uint8_t* numbers, std::size_t count, std::uint32_t bits, std::uint8_t* packed);

/// Copies bits [from, from + count) of `in` to those of `out` from `to` on. The first bit of a byte is its most
/// significant one. REQUIRES: bits of `out` that are in bytes it shares with others are 0.
void copy_bits(const std::uint8_t* in, std::size_t from, std::size_t count, std::uint8_t* out, std::size_t to);

/// REQUIRES: bits 1, 2, 4 or 8; all numbers below 2^bits. Throws Error{kCancelled}.
void pack_indices(const IndexImage& image, std::uint32_t bits, std::vector<std::uint8_t>& packed,
                  const CancellationToken& cancel);

}  // namespace ccslice
