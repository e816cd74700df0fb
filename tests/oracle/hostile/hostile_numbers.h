// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Planes of numbers, of materials or of cell regions, and what is drawn of them: packed samples, indexed and coloured
// pictures, read without the code that wrote them.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/job/slice_job.h"

namespace ccslice::oracle {

/// The plane shows a number a voxel: materials, a mask of one, cell regions, or the occupancy.
bool shows_numbers(const PlaneSpec& plane);

/// A number a voxel, rows from 0 up; of masks and the occupancy 0 or 1. `palette`: colours by number, 0xRRGGBBAA; of
/// planes of materials or cell regions. Throws std::runtime_error for files that can't be read, or have other colours.
std::vector<std::uint8_t> numbers_of(const PlaneSpec& plane, const EncodedPlane& encoded, const GridExtent& extent,
                                     std::span<const std::uint32_t> palette);

/// The other way: a number a voxel as kRaw has the samples.
std::vector<std::uint8_t> packed_numbers(std::span<const std::uint8_t> numbers, SampleType type,
                                         const GridExtent& extent);

/// What `plane` of a job is drawn with.
std::vector<std::uint32_t> palette_of_plane(const SliceJob& job, const PlaneSpec& plane, std::size_t cell_regions);

}  // namespace ccslice::oracle
