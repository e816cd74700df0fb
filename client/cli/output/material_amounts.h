// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How much there is of a job's solids and materials, as people read it.

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/cli/base/messages.h"
#include "client/client.h"

namespace ccslice::cli {

double cm3_of(std::uint64_t voxels, const client::SliceOutcome& outcome);
std::string show_cm3(double cm3);
/// Sets the name, the colour and whether the material leaves voxels empty.
void describe_material(const v1::PrintMaterial& material, v1::MaterialVoxels& described);
/// Sets how much of a material there is, voxels of so many cm3 each.
void set_amount(std::uint64_t voxels, double voxel_cm3, const v1::PrintMaterial& material, v1::MaterialVoxels& amount);
/// In the printing's order; none if no materials are chosen.
std::vector<v1::MaterialVoxels> materials_of(const client::SliceOutcome& outcome);
/// Names, volumes and shares of so many voxels that are printed, in one line.
std::string materials_text(const std::vector<v1::MaterialVoxels>& materials, std::uint64_t voxel_count);
/// The same of all that was sliced.
std::string materials_text(const client::SliceOutcome& outcome);

}  // namespace ccslice::cli
