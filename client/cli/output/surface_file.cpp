// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/surface_file.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace ccslice::cli {
namespace {

using Point = std::array<float, 3>;

void append_little_endian(std::string& bytes, std::uint32_t number) {
  for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(number >> shift & 0xff);
}

template <typename Integer>
void append_big_endian(std::string& bytes, Integer number) {
  for (int shift = 8 * sizeof(Integer) - 8; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift & 0xff);
}

void append(std::string& bytes, const Point& point) {
  for (const float x : point) append_little_endian(bytes, std::bit_cast<std::uint32_t>(x));
}

Point rounded(const std::array<double, 3>& point) {
  // + 0: there is one zero only, so that equal corners have equal bytes.
  return {static_cast<float>(point[0]) + 0.0f, static_cast<float>(point[1]) + 0.0f,
          static_cast<float>(point[2]) + 0.0f};
}

Point unit_normal(const Point& a, const Point& b, const Point& c) {
  std::array<double, 3> u, v;
  for (std::size_t i = 0; i < 3; ++i) {
    u[i] = double{b[i]} - a[i];
    v[i] = double{c[i]} - a[i];
  }
  const std::array<double, 3> n = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  const double length = std::hypot(n[0], n[1], n[2]);
  if (!(length > 0)) return {0, 0, 0};
  return rounded({n[0] / length, n[1] / length, n[2] / length});
}

/// A channel's name as VTK's legacy files have it: one word.
std::string vtk_name(std::string_view name) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  std::string word;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte > 32 && byte < 127 && c != '"' && c != '%') {
      word += c;
    } else {
      word += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
    }
  }
  return word;
}

void append_points(const client::Surface& surface, std::string& file) {
  file += "POINTS " + std::to_string(surface.points_mm.size()) + " double\n";
  for (const auto& point : surface.points_mm) {
    for (const double x : point) append_big_endian(file, std::bit_cast<std::uint64_t>(x));
  }
}

void append_triangles(const client::Surface& surface, std::string& file) {
  const std::size_t count = surface.triangles.size();
  file += "\nPOLYGONS " + std::to_string(count) + " " + std::to_string(4 * count) + "\n";
  for (const auto& triangle : surface.triangles) {
    append_big_endian(file, std::uint32_t{3});
    for (const std::uint32_t vertex : triangle) append_big_endian(file, vertex);
  }
}

void append_channels(const client::Surface& surface, std::string& file) {
  const auto channels = static_cast<std::size_t>(surface.header.channels_size());
  if (channels > 0) file += "\nPOINT_DATA " + std::to_string(surface.points_mm.size());
  for (std::size_t channel = 0; channel < channels; ++channel) {
    file += "\nSCALARS " + vtk_name(surface.header.channels(static_cast<int>(channel)).name()) + " float 1\n";
    file += "LOOKUP_TABLE default\n";
    for (std::size_t at = channel; at < surface.channel_values.size(); at += channels) {
      append_big_endian(file, std::bit_cast<std::uint32_t>(surface.channel_values[at]));
    }
  }
  file += "\n";
}

}  // namespace

std::string to_stl(const client::Surface& surface) {
  constexpr std::size_t kHeaderBytes = 80, kTriangleBytes = 50;
  std::string triangles;
  triangles.reserve(kTriangleBytes * surface.triangles.size());
  for (const auto& [i, j, k] : surface.triangles) {
    const Point a = rounded(surface.points_mm[i]), b = rounded(surface.points_mm[j]), c = rounded(surface.points_mm[k]);
    if (a == b || b == c || c == a) continue;
    append(triangles, unit_normal(a, b, c));
    append(triangles, a);
    append(triangles, b);
    append(triangles, c);
    triangles += {'\0', '\0'};
  }
  std::string file = "ccslice, binary STL, mm";  // Readers take a file that begins with "solid" for text.
  file.resize(kHeaderBytes, ' ');
  append_little_endian(file, static_cast<std::uint32_t>(triangles.size() / kTriangleBytes));
  return file + triangles;
}

std::string to_vtk(const client::Surface& surface) {
  std::string file =
      "# vtk DataFile Version 3.0\nccslice: boundary of a Catmull-Clark solid, mm\nBINARY\nDATASET POLYDATA\n";
  append_points(surface, file);
  append_triangles(surface, file);
  append_channels(surface, file);
  return file;
}

double volume_mm3(const client::Surface& surface) {
  double six_volumes = 0;
  for (const auto& [i, j, k] : surface.triangles) {
    const auto &a = surface.points_mm[i], &b = surface.points_mm[j], &c = surface.points_mm[k];
    six_volumes +=
        a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return six_volumes / 6;
}

}  // namespace ccslice::cli
