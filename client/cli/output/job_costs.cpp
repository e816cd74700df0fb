// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/job_costs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "client/cli/base/console.h"
#include "client/cli/output/material_amounts.h"
#include "client/cli/output/part_amounts.h"

namespace ccslice::cli {
namespace {

constexpr std::uint32_t kSamples = 16, kMostLayersOfSample = 16, kOneIn = 4;

/// Anything below `end`, the same for the same part.
std::uint32_t anywhere(std::uint32_t part, std::uint32_t end) {
  std::uint64_t hash = (part + 1) * 0x9e3779b97f4a7c15ull;
  hash = (hash ^ hash >> 29) * 0xbf58476d1ce4e5b9ull;
  return static_cast<std::uint32_t>((hash >> 32) % end);
}

std::uint64_t scaled(std::uint64_t count, double factor) {
  return static_cast<std::uint64_t>(std::llround(factor * static_cast<double>(count)));
}

}  // namespace

std::vector<LayerSample> layers_to_sample(std::uint32_t first_layer, std::uint32_t layer_count) {
  const std::uint32_t parts = std::min(kSamples, layer_count);
  std::vector<LayerSample> samples;
  for (std::uint32_t part = 0; part < parts; ++part) {
    const auto begin = static_cast<std::uint32_t>(std::uint64_t{layer_count} * part / parts);
    const auto end = static_cast<std::uint32_t>(std::uint64_t{layer_count} * (part + 1) / parts);
    LayerSample sample{0, std::clamp((end - begin) / kOneIn, 1u, kMostLayersOfSample), end - begin};
    sample.first_layer = first_layer + begin + anywhere(part, sample.stands_for - sample.layer_count + 1);
    samples.push_back(sample);
  }
  return samples;
}

void JobCosts::add(const LayerSample& sample, const client::SliceOutcome& sliced) {
  const double factor = static_cast<double>(sample.stands_for) / sample.layer_count;
  client::SliceOutcome whole;
  whole.header = sliced.header;
  whole.voxel_count = scaled(sliced.voxel_count, factor);
  whole.encoded_bytes = scaled(sliced.encoded_bytes, factor);
  for (const std::uint64_t voxels : sliced.material_voxels) whole.material_voxels.push_back(scaled(voxels, factor));
  for (v1::PartVoxels part : sliced.parts) {
    part.set_voxel_count(scaled(part.voxel_count(), factor));
    for (std::uint64_t& voxels : *part.mutable_material_voxels()) voxels = scaled(voxels, factor);
    whole.parts.push_back(std::move(part));
  }
  if (layers_ == 0) total_.header = sliced.header;
  total_.add_counts(whole);
  sampled_ += sample.layer_count;
  layers_ += sample.stands_for;
}

v1::JobCosts JobCosts::document(const v1::SliceJob& job) const {
  v1::JobCosts document;
  document.set_sampled_layers(sampled_);
  document.set_voxel_count(total_.voxel_count);
  document.set_volume_cm3(cm3_of(total_.voxel_count, total_));
  for (v1::MaterialVoxels& material : materials_of(total_)) *document.add_materials() = std::move(material);
  for (v1::PartAmount& part : part_amounts(job, total_, cm3_of(1, total_), materials_of(total_))) {
    *document.add_parts() = std::move(part);
  }
  document.set_encoded_bytes(total_.encoded_bytes);
  return document;
}

std::string JobCosts::text(const v1::SliceJob& job) const {
  const std::string from =
      sampled_ == layers_ ? "all layers" : show_count(sampled_) + " of " + show_count(layers_, "layer");
  std::string text = "\n  costs      about " + show_cm3(cm3_of(total_.voxel_count, total_)) + " and " +
                     show_bytes(total_.encoded_bytes) + ", from " + from;
  if (const std::string materials = materials_text(total_); !materials.empty()) text += "\n  materials  " + materials;
  if (const std::string parts = part_amounts_text(job, total_, "  "); !parts.empty()) text += "\n" + parts;
  return text;
}

}  // namespace ccslice::cli
