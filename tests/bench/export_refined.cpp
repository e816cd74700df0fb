// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// export_refined SAMPLE N FILE.vtk: what programs that know linear cells only need of a sample. Every limit cell
// becomes N x N x N linear hexahedra whose corners are exact limit points with exact values of the first channel;
// legacy VTK, binary. Prints as JSON the hexahedra and how far positions (mm) and values (share of the range) at their
// middles are off.

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/limit/limit_evaluator.h"
#include "tests/bench/printer_job.h"

namespace ccslice::bench {
namespace {

struct Refined {
  std::vector<Vec3> points;
  std::vector<double> values;
  std::vector<std::array<std::uint32_t, 8>> hexahedra;  // Corners in VTK's order.
  double position_error_mm = 0, value_error = 0;
};

class Refiner {
 public:
  Refiner(const LimitSolid& solid, std::uint32_t n) : evaluator_(solid), n_(n), channels_(solid.channel_count()) {
    for (const LimitCellId cell : solid.cells()) refine(cell);
    const ChannelRange& channel = solid.summary().channels[0];
    result_.value_error /= channel.max - channel.min;
  }
  Refined take() { return std::move(result_); }

 private:
  struct Sample {
    Vec3 position;
    double value;
  };

  Sample sample(LimitCellId cell, const Vec3& place) {
    const CellParam at{cell, place / n_};
    evaluator_.mat(at, channels_);
    return {evaluator_.geo(at), channels_[0]};
  }

  void refine(LimitCellId cell) {
    const auto first = static_cast<std::uint32_t>(result_.points.size());
    for_each(n_ + 1, [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
      const Sample corner = sample(cell, Vec3(i, j, k));
      result_.points.push_back(corner.position);
      result_.values.push_back(corner.value);
    });
    const std::uint32_t row = n_ + 1, layer = row * row;
    for_each(n_, [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
      const std::uint32_t a = first + i + row * j + layer * k, b = a + layer;
      result_.hexahedra.push_back({a, a + 1, a + row + 1, a + row, b, b + 1, b + row + 1, b + row});
      measure(result_.hexahedra.back(), sample(cell, Vec3(i + 0.5, j + 0.5, k + 0.5)));
    });
  }

  void measure(const std::array<std::uint32_t, 8>& hexahedron, const Sample& exact) {
    Vec3 position = Vec3::Zero();
    double value = 0;
    for (const std::uint32_t corner : hexahedron) {
      position += result_.points[corner] / 8;
      value += result_.values[corner] / 8;
    }
    result_.position_error_mm = std::max(result_.position_error_mm, (position - exact.position).norm());
    result_.value_error = std::max(result_.value_error, std::abs(value - exact.value));
  }

  template <typename Visit>
  static void for_each(std::uint32_t count, Visit visit) {
    for (std::uint32_t k = 0; k < count; ++k) {
      for (std::uint32_t j = 0; j < count; ++j) {
        for (std::uint32_t i = 0; i < count; ++i) visit(i, j, k);
      }
    }
  }

  LimitEvaluator evaluator_;
  std::uint32_t n_;
  std::vector<double> channels_;
  Refined result_;
};

class BigEndianFile {
 public:
  explicit BigEndianFile(const std::string& path) : file_(path, std::ios::binary), path_(path) {}
  void text(const std::string& line) { file_ << line << "\n"; }
  void number(std::uint32_t bits) {
    const std::uint32_t swapped = __builtin_bswap32(bits);
    file_.write(reinterpret_cast<const char*>(&swapped), sizeof swapped);
  }
  void number(double value) { number(std::bit_cast<std::uint32_t>(static_cast<float>(value))); }
  void close() {
    file_.close();
    if (!file_) throw std::runtime_error("can't write " + path_);
  }

 private:
  std::ofstream file_;
  std::string path_;
};

void write(const Refined& refined, const std::string& channel, const std::string& path) {
  constexpr std::uint32_t kHexahedron = 12;  // VTK_HEXAHEDRON.
  const std::string points = std::to_string(refined.points.size());
  const std::string cells = std::to_string(refined.hexahedra.size());
  BigEndianFile file(path);
  file.text("# vtk DataFile Version 2.0\nlinear hexahedra\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS " + points +
            " float");
  for (const Vec3& point : refined.points) {
    for (const double x : point) file.number(x);
  }
  file.text("\nCELLS " + cells + " " + std::to_string(9 * refined.hexahedra.size()));
  for (const auto& hexahedron : refined.hexahedra) {
    file.number(8u);
    for (const std::uint32_t corner : hexahedron) file.number(corner);
  }
  file.text("\nCELL_TYPES " + cells);
  for (std::size_t i = 0; i < refined.hexahedra.size(); ++i) file.number(kHexahedron);
  file.text("\nPOINT_DATA " + points + "\nSCALARS " + channel + " float 1\nLOOKUP_TABLE default");
  for (const double value : refined.values) file.number(value);
  file.close();
}

void run(const std::string& sample, std::uint32_t n, const std::string& path) {
  const PrinterJob job = sample_printer_job(sample);
  const Refined refined = Refiner(*job.solid, n).take();
  write(refined, job.solid->summary().channels[0].name, path);
  std::printf("{\"hexahedra\": %zu, \"position_error_mm\": %.3g, \"value_error\": %.3g}\n", refined.hexahedra.size(),
              refined.position_error_mm, refined.value_error);
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  const int n = argc == 4 ? std::atoi(argv[2]) : 0;
  if (n < 1 || n > 64) {
    std::fprintf(stderr, "usage: export_refined SAMPLE N FILE.vtk, N from 1 to 64\n");
    return 2;
  }
  try {
    ccslice::bench::run(argv[1], static_cast<std::uint32_t>(n), argv[3]);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "export_refined: %s\n", error.what());
    return 1;
  }
}
