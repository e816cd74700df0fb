// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/bench/hostile_report.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <stdexcept>

namespace ccslice::bench {
namespace {

using oracle::HostileFinding;
using oracle::HostileResult;

unsigned long long big(std::uint64_t value) { return value; }

/// Of one check, over all seeds.
struct CheckSum {
  HostileFinding all;
  std::uint64_t seeds_failed = 0, worst_seed = 0;

  void add(const HostileResult& result, const HostileFinding& finding) {
    all.compared += finding.compared;
    all.failed += finding.failed;
    all.excused += finding.excused;
    all.overlapped += finding.overlapped;
    seeds_failed += finding.failed > 0;
    for (std::size_t i = 0; i < all.failed_at.size(); ++i) all.failed_at[i] += finding.failed_at[i];
    if (finding.worst <= all.worst) return;
    all.worst = finding.worst;
    worst_seed = result.seed;
  }
};

void print_check(const std::string& name, const CheckSum& sum) {
  std::printf("%-10s %12llu compared, %9llu failed in %llu seeds, %llu excused, worst %.4g (seed %llu)", name.c_str(),
              big(sum.all.compared), big(sum.all.failed), big(sum.seeds_failed), big(sum.all.excused), sum.all.worst,
              big(sum.worst_seed));
  if (sum.all.overlapped > 0) std::printf(", %llu of the excused where cells overlap", big(sum.all.overlapped));
  for (std::size_t i = 0; i < sum.all.failed_at.size(); ++i) {
    if (sum.all.failed_at[i] == 0) continue;
    std::printf(", %llu %s", big(sum.all.failed_at[i]), to_text(static_cast<oracle::VoxelPlace>(i)));
  }
  std::printf("\n");
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return result + '"';
}

/// JSON has no infinity.
std::string finite(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", std::isfinite(value) ? value : 1e300);
  return text;
}

std::string finding_json(const HostileFinding& finding) {
  std::string text =
      "{\"compared\": " + std::to_string(finding.compared) + ", \"failed\": " + std::to_string(finding.failed) +
      ", \"excused\": " + std::to_string(finding.excused) + ", \"overlapped\": " + std::to_string(finding.overlapped) +
      ", \"worst\": " + finite(finding.worst) + ", \"where\": " + quoted(finding.where) + ", \"failed_at\": [";
  for (std::size_t i = 0; i < finding.failed_at.size(); ++i) {
    text += (i == 0 ? "" : ", ") + std::to_string(finding.failed_at[i]);
  }
  return text + "]}";
}

std::string result_json(const HostileResult& result) {
  std::string text =
      "{\"seed\": " + std::to_string(result.seed) + ", \"failed\": " + (result.failed() ? "true" : "false") +
      ", \"description\": " + quoted(result.description) + ", \"refused\": " + quoted(result.refused) +
      ", \"broken\": " + quoted(result.broken) + ", \"voxels\": " + std::to_string(result.voxels) +
      ", \"every_voxel\": " + (result.every_voxel ? "true" : "false") +
      ", \"interpolated\": " + std::to_string(result.interpolated) + ", \"seconds\": " + finite(result.seconds);
  for (std::size_t i = 0; i < oracle::kHostileChecks; ++i) {
    text += ", " + quoted(std::string(to_text(static_cast<oracle::HostileCheck>(i)))) + ": " +
            finding_json(result.findings[i]);
  }
  return text + "}";
}

}  // namespace

bool print_summary(std::span<const HostileResult> results) {
  std::uint64_t refused = 0, broken = 0, failed = 0, voxels = 0, interpolated = 0, whole = 0, slowest_seed = 0;
  double seconds = 0, slowest = 0;
  std::array<CheckSum, oracle::kHostileChecks> sums;
  for (const HostileResult& result : results) {
    refused += !result.refused.empty();
    broken += !result.broken.empty();
    failed += result.failed();
    whole += result.every_voxel;
    voxels += result.voxels;
    interpolated += result.interpolated;
    seconds += result.seconds;
    if (result.seconds > slowest) slowest_seed = result.seed;
    slowest = std::max(slowest, result.seconds);
    for (std::size_t i = 0; i < sums.size(); ++i) sums[i].add(result, result.findings[i]);
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    print_check(std::string(to_text(static_cast<oracle::HostileCheck>(i))), sums[i]);
  }
  std::printf(
      "%zu seeds, %llu refused, %llu broken, %llu FAILED; every voxel of %llu compared; %llu voxels, %.1f %% "
      "interpolated; "
      "%.3f s a seed, slowest %.1f s (seed %llu)\n",
      results.size(), big(refused), big(broken), big(failed), big(whole), big(voxels),
      100.0 * static_cast<double>(interpolated) / static_cast<double>(std::max<std::uint64_t>(voxels, 1)),
      seconds / static_cast<double>(std::max<std::size_t>(results.size(), 1)), slowest, big(slowest_seed));
  return failed == 0;
}

void write_json(const std::string& path, std::span<const HostileResult> results) {
  std::ofstream file(path);
  file << "[";
  for (std::size_t i = 0; i < results.size(); ++i) file << (i == 0 ? "\n" : ",\n") << result_json(results[i]);
  file << "\n]\n";
  if (!file.flush()) throw std::runtime_error("can't write " + path);
}

}  // namespace ccslice::bench
