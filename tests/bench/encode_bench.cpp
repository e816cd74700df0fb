// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Encoders beside each other: dithered layers of 4096 x 2048 voxels, one thread, one run (docs/benchmarks.md).

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "client/cli/base/json.h"
#include "core/output/encode.h"
#include "tests/bench/bars.h"
#include "tests/bench/clocks.h"

namespace ccslice::bench {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint32_t kWidth = 4096, kHeight = 2048;
constexpr std::size_t kMaterials = 3;
const std::vector<std::uint32_t> kPalette = {0x000000ff, 0x00ffffff, 0xff00ffff, 0xffff00ff};

struct Options {
  int runs = 5;
  std::string json;
};

struct Figure {
  double ms = 0;
  std::size_t bytes = 0;
};

/// Fractions of three materials that change along x, and the error diffused over the row and the next (Floyd,
/// Steinberg): no patterns that repeat, so nothing that a compressor could profit from. Inside a ring.
Bytes dithered_ring() {
  Bytes indices(std::size_t{kWidth} * kHeight);
  std::vector<std::array<double, kMaterials>> here(kWidth + 2), next(kWidth + 2);
  for (std::uint32_t y = 0; y < kHeight; ++y) {
    std::swap(here, next);
    std::fill(next.begin(), next.end(), std::array<double, kMaterials>{});
    for (std::uint32_t x = 0; x < kWidth; ++x) {
      const double radius = std::hypot(2.0 * x / kWidth - 1, 2.0 * y / kHeight - 1), along = 1.0 * x / kWidth;
      if (radius < 0.3 || radius > 0.95) continue;
      std::array<double, kMaterials> wanted = here[x + 1];
      wanted[0] += std::max(0.0, 1 - 2 * along);
      wanted[1] += 1 - std::abs(1 - 2 * along);
      wanted[2] += std::max(0.0, 2 * along - 1);
      const std::size_t chosen = static_cast<std::size_t>(std::ranges::max_element(wanted) - wanted.begin());
      indices[std::size_t{kWidth} * y + x] = static_cast<std::uint8_t>(chosen + 1);
      for (std::size_t m = 0; m < kMaterials; ++m) {
        const double error = (wanted[m] - (m == chosen)) / 16;
        here[x + 2][m] += 7 * error;
        next[x][m] += 3 * error;
        next[x + 1][m] += 5 * error;
        next[x + 2][m] += error;
      }
    }
  }
  return indices;
}

/// The fastest of some runs, in CPU time of this thread.
Figure measure(int runs, const std::function<std::size_t()>& encode) {
  Figure figure;
  for (int run = 0; run < runs; ++run) {
    double ns = 0;
    figure.bytes = timed(ns, encode);
    figure.ms = run == 0 ? 1e-6 * ns : std::min(figure.ms, 1e-6 * ns);
  }
  return figure;
}

/// What a caller who asks for nothing else gets.
std::size_t openimageio_png(const Bytes& rgba) {
  Bytes file;
  OIIO::Filesystem::IOVecOutput sink(file);
  const auto output = OIIO::ImageOutput::create("png");
  OIIO::ImageSpec spec(kWidth, kHeight, 4, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:UnassociatedAlpha", 1);  // Otherwise colours may change.
  if (!output || !output->set_ioproxy(&sink) || !output->open("layer.png", spec) ||
      !output->write_image(OIIO::TypeDesc::UINT8, rgba.data()) || !output->close()) {
    throw std::runtime_error("OpenImageIO writes no PNG");
  }
  return file.size();
}

Bytes spelled_out(const Bytes& indices) {
  Bytes rgba;
  rgba.reserve(4 * indices.size());
  for (const std::uint8_t index : indices) {
    for (int shift = 24; shift >= 0; shift -= 8) rgba.push_back(static_cast<std::uint8_t>(kPalette[index] >> shift));
  }
  return rgba;
}

struct Row {
  std::string name;
  Figure figure;
  double bar = 0;      // Times as fast as OpenImageIO; 0: none.
  double most_ms = 0;  // 0: no bar.
};

/// A layer of a tray as RGBA PNG, dithered in a square that holds a share of it: of the largest tray, 490 x 390 mm at
/// 600 x 300 dpi.
Figure measure_tray(int runs, double share) {
  constexpr std::uint32_t kColumns = 11575, kRows = 4606;
  const std::vector<std::uint32_t> palette = {0, 0xff00ffff, 0xffff00ff};
  const auto columns = static_cast<std::uint32_t>(std::sqrt(share) * kColumns);
  const auto rows = static_cast<std::uint32_t>(std::sqrt(share) * kRows);
  const LayerWindow window{columns, rows, columns, rows};
  Bytes indices(std::size_t{columns} * rows);
  for (std::size_t i = 0; i < indices.size(); ++i) indices[i] = static_cast<std::uint8_t>(1 + (i * i / 7) % 2);
  const IndexImage image{.width = kColumns, .height = kRows, .indices = indices, .palette = palette, .window = window};
  PlaneEncoder encoder;
  return measure(runs, [&] { return encoder.encode(image, SampleType::kUint2, Encoding::kPngRgba).bytes.size(); });
}

std::vector<Row> measure_all(const Options& options) {
  const Bytes indices = dithered_ring(), rgba = spelled_out(indices);
  const IndexImage image{kWidth, kHeight, indices, kPalette};
  PlaneEncoder encoder;
  const auto ours = [&](SampleType type, Encoding encoding) {
    return measure(options.runs, [&] { return encoder.encode(image, type, encoding).bytes.size(); });
  };
  Bytes grey(indices.size());
  for (std::size_t i = 0; i < grey.size(); ++i) grey[i] = indices[i] ? static_cast<std::uint8_t>(i % kWidth / 17) : 0;
  const SampleImage contone{SampleType::kUint8, kWidth, kHeight, grey};
  const auto graded = [&](Encoding encoding) {
    return measure(options.runs, [&] { return encoder.encode(contone, encoding).bytes.size(); });
  };
  OIIO::attribute("threads", 1);
  return {{"OpenImageIO RGBA PNG", measure(options.runs, [&] { return openimageio_png(rgba); })},
          {"RGBA PNG", ours(SampleType::kUint2, Encoding::kPngRgba), 20},
          {"indexed PNG, 2 bits", ours(SampleType::kUint2, Encoding::kPng), 100},
          {"indexed PNG, 4 bits", ours(SampleType::kUint4, Encoding::kPng)},
          {"indexed PNG, 8 bits", ours(SampleType::kUint8, Encoding::kPng)},
          {"bitmap PNG of one material",
           measure(options.runs, [&] { return encoder.encode_mask(image, 1U << 2, Encoding::kPng).bytes.size(); })},
          {"2 bits, zstd", ours(SampleType::kUint2, Encoding::kRawZstd)},
          {"2 bits, raw", ours(SampleType::kUint2, Encoding::kRaw)},
          {"graded grey PNG, 8 bits", graded(Encoding::kPng)},
          {"graded, zstd", graded(Encoding::kRawZstd)},
          {"empty tray, RGBA PNG", measure_tray(options.runs, 0), 0, 2},
          {"tray with 1 % inside, RGBA PNG", measure_tray(options.runs, 0.01), 0, 4}};
}

void write_json(const std::string& path, const std::vector<Row>& rows) {
  cli::JsonWriter json;
  json.begin_object().member("columns", kWidth).member("rows", kHeight).key("encoders").begin_array();
  for (const Row& row : rows) {
    json.begin_object().member("name", row.name).member("milliseconds", row.figure.ms);
    json.member("bytes", row.figure.bytes).member("times_openimageio", rows.front().figure.ms / row.figure.ms);
    json.end_object();
  }
  json.end_array().end_object();
  std::ofstream file(path);
  file << json.text() << '\n';
  if (!file.flush()) throw std::runtime_error("cannot write " + path);
}

int run(const Options& options) {
  const std::vector<Row> rows = measure_all(options);
  BarTable table;
  for (const Row& row : rows) {
    const double times = rows.front().figure.ms / row.figure.ms;
    if (row.most_ms > 0) {
      table.add(row.name, row.figure.ms, "ms", Bound::kAtMost, row.most_ms);
    } else {
      table.note(row.name, row.figure.ms, "ms");
    }
    table.note(row.name + ", file", 1e-6 * static_cast<double>(row.figure.bytes), "MB");
    if (row.bar > 0) table.add(row.name + " against OpenImageIO", times, "times", Bound::kAtLeast, row.bar);
  }
  if (!options.json.empty()) write_json(options.json, rows);
  std::printf("%d bars missed\n", table.missed());
  return table.missed() > 0 ? 1 : 0;
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  using namespace ccslice::bench;
  CLI::App app("Encoders of dithered layers beside each other and beside OpenImageIO, one thread");
  Options options;
  app.add_option("--runs", options.runs, "The fastest of so many")->check(CLI::Range(1, 99))->capture_default_str();
  app.add_option("--json", options.json, "Write the figures to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "encode_bench: %s\n", error.what());
    return 2;
  }
}
