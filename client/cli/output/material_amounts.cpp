// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/material_amounts.h"

#include <algorithm>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "core/base/echo.h"
#include "core/base/number_text.h"

namespace ccslice::cli {

double cm3_of(std::uint64_t voxels, const client::SliceOutcome& outcome) {
  constexpr double kMm3 = 1000;
  const v1::VoxelPitch& pitch = outcome.header.grid().pitch();
  return static_cast<double>(voxels) * pitch.x_mm() * pitch.y_mm() * pitch.z_mm() / kMm3;
}

void describe_material(const v1::PrintMaterial& material, v1::MaterialVoxels& described) {
  described.set_name(material.name());
  described.set_rgba(colour_text(material.rgba()));
  if (material.leaves_empty()) described.set_leaves_empty(true);
}

void set_amount(std::uint64_t voxels, double voxel_cm3, const v1::PrintMaterial& material, v1::MaterialVoxels& amount) {
  const double cm3 = voxel_cm3 * static_cast<double>(voxels);
  amount.set_voxel_count(voxels);
  amount.set_volume_cm3(cm3);
  if (material.density_g_per_cm3() > 0 && !material.leaves_empty())
    amount.set_grams(cm3 * material.density_g_per_cm3());
}

std::vector<v1::MaterialVoxels> materials_of(const client::SliceOutcome& outcome) {
  std::vector<v1::MaterialVoxels> materials;
  for (const v1::PrintMaterial& material : outcome.header.printing().materials()) {
    if (materials.size() == outcome.material_voxels.size()) break;
    const std::uint64_t voxels = outcome.material_voxels[materials.size()];
    v1::MaterialVoxels& counted = materials.emplace_back();
    describe_material(material, counted);
    set_amount(voxels, cm3_of(1, outcome), material, counted);
  }
  return materials;
}

std::string show_cm3(double cm3) {
  constexpr int kDigits = 4;
  return number_text(cm3, kDigits) + " cm3";
}

std::string materials_text(const std::vector<v1::MaterialVoxels>& materials, std::uint64_t voxel_count) {
  constexpr int kDigits = 3, kGramDigits = 4;
  double grams = 0;
  std::size_t weighed = 0, printed = 0;
  const double all = static_cast<double>(std::max<std::uint64_t>(1, voxel_count));
  std::string text;
  for (const v1::MaterialVoxels& material : materials) {
    text += (text.empty() ? "" : ", ") + echoed(material.name()) + " " + show_cm3(material.volume_cm3());
    if (material.leaves_empty()) {
      text += " left empty";
      continue;
    }
    ++printed;
    text += " (" + number_text(100 * static_cast<double>(material.voxel_count()) / all, kDigits) + " %)";
    if (material.has_grams()) text += " " + number_text(material.grams(), kGramDigits) + " g";
    grams += material.grams();
    weighed += material.has_grams() ? 1 : 0;
  }
  if (weighed > 1 && weighed == printed) text += ", in all " + number_text(grams, kGramDigits) + " g";
  return text;
}

std::string materials_text(const client::SliceOutcome& outcome) {
  return materials_text(materials_of(outcome), outcome.voxel_count);
}

}  // namespace ccslice::cli
