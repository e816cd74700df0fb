// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/gcvf.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "client/cli/base/json.h"
#include "client/cli/base/xml.h"
#include "client/cli/output/grabcad.h"
#include "client/cli/output/zip_file.h"
#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

constexpr std::uint32_t kBackground = 0x000000ff;

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

[[noreturn]] void refuse(const std::string& what) { throw Error(ErrorCode::kFileUnsupported, "a .gcvf file " + what); }

/// Whole dots an inch. The printer places voxels by this number, so a pitch between two of them would change the part's
/// size.
long dots_an_inch(const LayerStack& stack, std::size_t axis) {
  constexpr double kInchMm = 25.4, kMostOff = 2e-3;
  const double dots = kInchMm / stack.pitch_mm()[axis];
  const double whole = std::round(dots);
  if (whole < 1 || std::abs(dots - whole) > kMostOff * whole) {
    refuse("says its pitch in whole dots an inch, and " + shortest(stack.pitch_mm()[axis]) + " mm along " + "xy"[axis] +
           " is " + shortest(dots) + " of them; slice with --dpi or --printer");
  }
  return std::lround(whole);
}

void require_palette(const LayerStack& stack) {
  if (stack.background_rgba() != kBackground) refuse("has a black background; slice without --background");
  const auto printed =
      static_cast<std::size_t>(std::ranges::count(stack.materials(), false, &StackMaterial::leaves_empty));
  if (printed > kMostGrabcadMaterials) {
    refuse("holds at most " + std::to_string(kMostGrabcadMaterials) + " materials, and there are " +
           std::to_string(printed));
  }
  for (const StackMaterial& material : stack.materials()) {
    if (material.leaves_empty) {
      if (material.rgba == kBackground || material.rgba == kGrabcadVoid) continue;
      refuse("has void in its background's colour or as #00000000; slice with --material void");
    }
    if ((material.rgba & 0xff) != 0xff)
      refuse("has opaque colours only, and that of " + echoed(material.name) + " isn't");
  }
}

std::string four_numbers(std::uint32_t rgba) {
  return std::to_string(rgba >> 24) + ' ' + std::to_string(rgba >> 16 & 0xff) + ' ' + std::to_string(rgba >> 8 & 0xff) +
         ' ' + std::to_string(rgba & 0xff);
}

std::string config_of(const LayerStack& stack) {
  constexpr double kNanometres = 1e6;  // A millimetre has.
  XmlWriter xml;
  xml.begin("GCVF").element("Version", 2);
  xml.begin("Resolution").element("XDpi", dots_an_inch(stack, 0)).element("YDpi", dots_an_inch(stack, 1));
  xml.element("SliceThicknessNanoMeter", std::lround(kNanometres * stack.pitch_mm()[2])).end();
  xml.begin("SliceDimensions").element("SliceWidth", stack.columns()).element("SliceHeight", stack.rows()).end();
  xml.begin("SliceRange").element("StartIndex", 0).element("NumberOfSlices", stack.layers()).end();
  xml.element("BitDepth", 4).element("MaxNumberOfColors", kMostGrabcadMaterials);
  xml.element("DataSemantics", "Materials").element("CreationMode", "MODEL_ONLY");
  xml.element("ImageFilePrefix", "layer_");
  xml.begin("MaterialList").element("BackGroundMaterialRGBA", four_numbers(stack.background_rgba()));
  for (const StackMaterial& material : stack.materials()) {
    if (material.voxels == 0 || material.leaves_empty) continue;
    xml.begin("Material").element("Name", material.name).element("RGBA", four_numbers(material.rgba));
    xml.element("VoxelCount", material.voxels).end();
  }
  return xml.end().end().text();
}

}  // namespace

std::uint64_t write_gcvf(const LayerStack& stack, const std::filesystem::path& path) {
  const std::size_t plane = rgba_plane(stack);
  require_palette(stack);
  const std::string config = config_of(stack);
  ZipFile zip(path);
  zip.add_compressed("ConfigFile.xml", config);
  for (std::uint32_t layer = 0; layer < stack.layers(); ++layer) {
    zip.add_stored("layer_" + std::to_string(layer) + ".png", stack.picture(layer, plane));
  }
  return zip.finish();
}

}  // namespace ccslice::cli
