// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/gcvf.h"

#include <algorithm>
#include <string>

#include "client/cli/xml.h"
#include "client/cli/zip_file.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

std::size_t rgba_plane(const LayerStack& stack) {
  const auto found = std::ranges::find(stack.planes(), "png_rgba", &StackPlane::encoding);
  if (found == stack.planes().end()) {
    throw Error(
        ErrorCode::kFileUnsupported,
        "a .gcvf file is made of RGBA pictures of materials, and there are none here; slice with --material and "
        "--encoding png-rgba");
  }
  return static_cast<std::size_t>(found - stack.planes().begin());
}

std::string config_of(const LayerStack& stack) {
  XmlWriter xml;
  xml.begin("VoxelPrint");
  xml.element("Width", stack.columns()).element("Height", stack.rows()).element("SliceCount", stack.layers());
  xml.element("PitchX", stack.pitch_mm()[0]).element("PitchY", stack.pitch_mm()[1]);
  xml.element("SliceThickness", stack.pitch_mm()[2]).element("Unit", "mm");
  xml.begin("Materials");
  for (const StackMaterial& material : stack.materials()) {
    xml.begin("Material").attribute("Name", material.name);
    xml.element("Red", material.rgba >> 24).element("Green", material.rgba >> 16 & 0xff);
    xml.element("Blue", material.rgba >> 8 & 0xff).element("Alpha", material.rgba & 0xff);
    xml.element("VoxelCount", material.voxels).end();
  }
  return xml.end().end().text();
}

}  // namespace

std::uint64_t write_gcvf(const LayerStack& stack, const std::filesystem::path& path) {
  const std::size_t plane = rgba_plane(stack);
  ZipFile zip(path);
  zip.add_compressed("ConfigFile.xml", config_of(stack));
  for (std::uint32_t layer = 0; layer < stack.layers(); ++layer) {
    zip.add_stored("layer_" + std::to_string(layer) + ".png", stack.picture(layer, plane));
  }
  return zip.finish();
}

}  // namespace ccslice::cli
