// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/part_amounts.h"

#include <algorithm>
#include <cstddef>

#include "client/cli/base/console.h"
#include "client/cli/output/material_amounts.h"
#include "core/base/echo.h"
#include "core/base/place_text.h"

namespace ccslice::cli {

std::string name_of_placed(const v1::SliceJob& job, std::uint32_t placed) {
  for (const v1::Part& part : job.parts()) {
    const auto copies = static_cast<std::uint32_t>(std::max(part.placements_size(), 1));
    if (placed < copies) {
      const std::string name = part.name().empty() ? "part" : part.name();
      return copies == 1 ? name : name + ", copy " + std::to_string(placed + 1);
    }
    placed -= copies;
  }
  return "part";
}

std::vector<v1::PartAmount> part_amounts(const v1::SliceJob& job, const client::SliceOutcome& counts, double voxel_cm3,
                                         const std::vector<v1::MaterialVoxels>& materials) {
  std::vector<v1::PartAmount> amounts;
  for (const v1::PartVoxels& part : counts.parts) {
    v1::PartAmount& amount = amounts.emplace_back();
    const auto p = static_cast<int>(amounts.size()) - 1;
    if (p < job.parts_size()) amount.set_name(job.parts(p).name().empty() ? "part" : job.parts(p).name());
    amount.set_voxel_count(part.voxel_count());
    amount.set_volume_cm3(voxel_cm3 * static_cast<double>(part.voxel_count()));
    const std::size_t known = std::min(materials.size(), static_cast<std::size_t>(job.printing().materials_size()));
    const std::size_t count = std::min(known, static_cast<std::size_t>(part.material_voxels_size()));
    for (std::size_t m = 0; m < count; ++m) {
      const std::uint64_t voxels = part.material_voxels(static_cast<int>(m));
      v1::MaterialVoxels& counted = *amount.add_materials() = materials[m];
      counted.clear_grams();
      set_amount(voxels, voxel_cm3, job.printing().materials(static_cast<int>(m)), counted);
    }
  }
  return amounts;
}

std::vector<v1::PartPair> part_pairs(const v1::SliceJob& job, const client::SliceOutcome& counts, double voxel_cm3) {
  std::vector<v1::PartPair> pairs;
  for (const v1::PartOverlap& overlap : counts.overlaps) {
    v1::PartPair& pair = pairs.emplace_back();
    pair.set_owner(name_of_placed(job, overlap.owner()));
    pair.set_covered(name_of_placed(job, overlap.covered()));
    pair.set_voxel_count(overlap.voxel_count());
    pair.set_volume_cm3(voxel_cm3 * static_cast<double>(overlap.voxel_count()));
    const v1::Vector3& at = overlap.place_mm();
    for (const double mm : {at.x(), at.y(), at.z()}) pair.add_place_mm(mm);
  }
  return pairs;
}

std::string part_amounts_text(const v1::SliceJob& job, const client::SliceOutcome& outcome, const std::string& indent) {
  constexpr std::size_t kMostLines = 12;
  const std::vector<v1::PartAmount> amounts = part_amounts(job, outcome, cm3_of(1, outcome), materials_of(outcome));
  if (amounts.size() < 2 || amounts.size() > static_cast<std::size_t>(job.parts_size())) return "";
  std::string text;
  for (std::size_t p = 0; p < std::min(amounts.size(), kMostLines); ++p) {
    const v1::PartAmount& part = amounts[p];
    const int copies = job.parts(static_cast<int>(p)).placements_size();
    text += (p == 0 ? "" : "\n") + indent + "part " + echoed(part.name()) +
            (copies > 1 ? " (" + show_count(static_cast<std::uint64_t>(copies)) + " copies)" : "") + ": " +
            show_cm3(part.volume_cm3());
    const std::string materials =
        materials_text({part.materials().begin(), part.materials().end()}, part.voxel_count());
    if (!materials.empty()) text += "; " + materials;
  }
  if (amounts.size() > kMostLines) {
    text +=
        "\n" + indent + show_count(amounts.size() - kMostLines, "more part") + ": manifest.json and --json have all";
  }
  return text;
}

std::string part_pairs_text(const v1::SliceJob& job, const client::SliceOutcome& outcome) {
  constexpr std::size_t kMostPairs = 4;
  constexpr int kDigits = 6;
  std::vector<v1::PartPair> pairs = part_pairs(job, outcome, cm3_of(1, outcome));
  std::ranges::stable_sort(pairs, std::greater<>(), &v1::PartPair::voxel_count);
  std::string text;
  for (std::size_t i = 0; i < std::min(pairs.size(), kMostPairs); ++i) {
    const v1::PartPair& pair = pairs[i];
    const auto& at = pair.place_mm();
    text += (i == 0 ? "" : ", ") + std::string("'") + echoed(pair.owner()) + "' takes " +
            show_count(pair.voxel_count(), "voxel") + " (" + show_cm3(pair.volume_cm3()) + ") of '" +
            echoed(pair.covered()) + "', one at " + place_text(Vec3(at[0], at[1], at[2]), kDigits);
  }
  if (pairs.size() > kMostPairs) text += ", and there are " + show_count(pairs.size() - kMostPairs, "more pair");
  return text;
}

}  // namespace ccslice::cli
