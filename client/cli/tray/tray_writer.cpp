// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/tray_writer.h"

#include <cstddef>

#include "client/cli/base/xml.h"
#include "client/cli/output/three_mf.h"
#include "client/cli/output/zip_file.h"

namespace ccslice::cli {
namespace {

/// Twelve numbers for row vectors: the matrix's columns one after the other, the translation last [3MF, 3.3].
std::string transform_text(const Placement& placement) {
  std::string text;
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) {
      text += (text.empty() ? "" : " ") + shortest(placement.matrix()(row, column));
    }
  }
  return text;
}

void add_object(const TrayObject& object, std::size_t id, XmlWriter& xml) {
  xml.begin("object").attribute("id", id).attribute("type", "model").attribute("name", object.name);
  add_three_mf_mesh(object.surface, xml);
  xml.end();
}

std::string model_of(const std::vector<TrayObject>& objects) {
  XmlWriter xml;
  xml.begin("model").attribute("unit", "millimeter").attribute("xml:lang", "en-US");
  xml.attribute("xmlns", kThreeMfCore);
  xml.begin("metadata").attribute("name", "Application").text("ccslice").end();
  xml.begin("resources");
  for (std::size_t i = 0; i < objects.size(); ++i) add_object(objects[i], i + 1, xml);
  xml.end().begin("build");
  for (std::size_t i = 0; i < objects.size(); ++i) {
    for (const Placement& placement : objects[i].placements) {
      xml.begin("item").attribute("objectid", i + 1).attribute("transform", transform_text(placement)).end();
    }
  }
  return xml.end().end().text();
}

}  // namespace

std::uint64_t write_tray(const std::vector<TrayObject>& objects, const std::filesystem::path& path) {
  ZipFile zip(path);
  add_three_mf_start(zip, model_of(objects));
  return zip.finish();
}

}  // namespace ccslice::cli
