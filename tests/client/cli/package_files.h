// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// 3MF packages as other programs write them, for tests of what reads them.

#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/output/zip_file.h"
#include "core/base/types.h"

namespace ccslice::cli {

using PackageEntries = std::vector<std::pair<std::string, std::string>>;

inline std::string write_package(const std::filesystem::path& path, const PackageEntries& entries) {
  ZipFile zip(path);
  for (const auto& [name, bytes] : entries) zip.add_compressed(name, bytes);
  zip.finish();
  return path.string();
}

/// `<model>` with these resources and items.
inline std::string model_text(const std::string& resources, const std::string& items,
                              const std::string& unit = "millimeter") {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<model unit=\"" + unit +
         "\" xml:lang=\"en-US\" xmlns=\"http://schemas.microsoft.com/3dmanufacturing/core/2015/02\" "
         "xmlns:p=\"http://schemas.microsoft.com/3dmanufacturing/production/2015/06\">\n <resources>\n" +
         resources + " </resources>\n <build>\n" + items + " </build>\n</model>\n";
}

/// A number in the 9 digits that PrusaSlicer and Bambu Studio write.
inline std::string nine_digits(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", number);
  return text;
}

/// The mesh of an object, its vertices as floats in 9 digits.
inline std::string mesh_text(const std::vector<Vec3>& points) {
  std::string text = "<mesh><vertices>\n";
  for (const Vec3& point : points) {
    text += "<vertex";
    for (int axis = 0; axis < 3; ++axis) {
      text += std::string(" ") + "xyz"[axis] + "=\"" + nine_digits(static_cast<float>(point[axis])) + "\"";
    }
    text += "/>\n";
  }
  return text + "</vertices><triangles><triangle v1=\"0\" v2=\"1\" v3=\"2\"/></triangles></mesh>\n";
}

inline std::string object_text(int id, const std::string& inside, const std::string& attributes = "type=\"model\"") {
  return "<object id=\"" + std::to_string(id) + "\" " + attributes + ">" + inside + "</object>\n";
}

inline std::string components_text(const std::string& components) {
  return "<components>" + components + "</components>";
}

/// Twelve numbers for row vectors.
inline std::string twelve_numbers(const Placement& placement) {
  std::string text;
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) text += (text.empty() ? "" : " ") + nine_digits(placement.matrix()(row, column));
  }
  return text;
}

inline std::string item_text(int object, const Placement& placement, const std::string& attributes = "") {
  return "<item objectid=\"" + std::to_string(object) + "\" transform=\"" + twelve_numbers(placement) + "\" " +
         attributes + "/>\n";
}

/// Turned about an axis, in degrees, and moved.
inline Placement motion(const Vec3& axis, double degrees, const Vec3& by) {
  Placement placement = Placement::Identity();
  placement.linear() = Eigen::AngleAxisd(degrees * 3.14159265358979323846 / 180, axis.normalized()).toRotationMatrix();
  placement.translation() = by;
  return placement;
}

}  // namespace ccslice::cli
