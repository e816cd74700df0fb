// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The job that all benches time: a part at 600 x 300 dpi and 30 um layers, the printer of [Luu19, 4], as occupancy and
// one material channel of 8 bits, both as raw samples + zstd.

#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"
#include "core/mesh/control_mesh.h"

namespace ccslice::bench {

inline constexpr VoxelPitch kPrinterPitch = {0.0423, 0.0846, 0.03};

struct PrinterJob {
  std::string name;
  ControlMesh mesh;
  std::shared_ptr<const LimitSolid> solid;
  SliceJob job;
  double prepare_ns = 0;  // CPU time.
};

/// The first channel is the one that is sliced. Throws Error, for a mesh without channels too.
PrinterJob make_printer_job(std::string name, ControlMesh mesh, const VoxelPitch& pitch = kPrinterPitch);

/// Of a sample (core/models/models.h). Throws std::runtime_error naming the samples if there is none of that name.
PrinterJob sample_printer_job(const std::string& name);

/// First layers of about `count` slabs, spread like places.
std::vector<std::uint32_t> spread_slabs(const Grid& grid, std::uint32_t count);

/// First layers of `runs` runs of consecutive slabs, spread like places: of all slabs, if there are no more than
/// `slabs_a_run`.
std::vector<std::vector<std::uint32_t>> spread_slab_runs(const Grid& grid, std::uint32_t runs,
                                                         std::uint32_t slabs_a_run);

/// `count` of `total` places (or all, if there are fewer), ascending, spread by the golden ratio: evenly, but out of
/// step with whatever repeats.
std::vector<std::uint32_t> spread(std::uint32_t total, std::uint32_t count);

}  // namespace ccslice::bench
