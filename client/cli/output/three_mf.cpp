// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/three_mf.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/pictures/picture.h"
#include "client/cli/pictures/png_file.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

/// The namespace of properties that are channels, each in the channel's own unit.
constexpr const char* kChannels = "urn:ccslice:channels:1";
constexpr const char* kVolumetric = "http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01";
constexpr const char* kContentTypes = "http://schemas.openxmlformats.org/package/2006/content-types";
constexpr const char* kRelationships = "http://schemas.openxmlformats.org/package/2006/relationships";
constexpr const char* kModelRelation = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
constexpr const char* kTextureRelation = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dtexture";
constexpr const char* kModelType = "application/vnd.ms-package.3dmanufacturing-3dmodel+xml";
constexpr const char* kModelPath = "/3D/3dmodel.model";
constexpr int kMaterialsId = 1, kVolumeId = 2, kObjectId = 3, kFirstFreeId = 4;
/// Display colours, in the order of the materials.
constexpr std::array<const char*, 8> kColours = {"#F0E442", "#0072B2", "#D55E00", "#009E73",
                                                 "#CC79A7", "#56B4E9", "#E69F00", "#999999"};

/// A plane of the stack that holds ratios.
std::vector<std::size_t> ratio_planes(const LayerStack& stack) {
  std::vector<std::size_t> planes;
  for (std::size_t i = 0; i < stack.planes().size(); ++i) {
    const StackPlane& plane = stack.planes()[i];
    if (plane.content == "channel" && plane.encoding == "png" && plane.sample_type == "u8") planes.push_back(i);
  }
  return planes;
}

std::string sheet_path(const std::string& image, std::uint32_t layer) {
  std::string number = std::to_string(layer);
  number.insert(0, 5 - std::min<std::size_t>(5, number.size()), '0');
  return "/3D/volumetric/" + image + "/sheet" + number + ".png";
}

std::string ratio_name(std::size_t ratio) { return "ratio" + std::to_string(ratio); }
constexpr const char* kColourName = "colour";

/// The materials that ratios mix: one a plane, and with one plane a second one that takes what is left of 1.
std::vector<std::string> materials_of(const LayerStack& stack) {
  std::vector<std::string> materials;
  for (const std::size_t plane : ratio_planes(stack)) materials.push_back(stack.planes()[plane].channel);
  if (materials.size() == 1) materials.emplace_back("rest");
  return materials;
}

/// The channel as an XML name without a prefix: letters, digits, '-', '_' and '.' stay, all else becomes '_'.
std::string property_name(const std::string& channel, std::size_t number) {
  std::string name;
  bool plain = true;
  for (const char c : channel) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
    const bool kept = letter || (!name.empty() && ((c >= '0' && c <= '9') || c == '-' || c == '.'));
    name += kept ? c : '_';
    plain = plain && kept;
  }
  return plain ? name : name + "_" + std::to_string(number);
}

/// A display colour "#RRGGBB" in linear light, where 3MF's colours are mixed.
std::array<double, 3> linear_light(std::string_view colour) {
  std::array<double, 3> linear{};
  for (std::size_t i = 0; i < 3; ++i) {
    int byte = 0;
    std::from_chars(colour.data() + 1 + 2 * i, colour.data() + 3 + 2 * i, byte, 16);
    const double encoded = byte / 255.0;  // IEC 61966-2-1.
    linear[i] = encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
  }
  return linear;
}

/// A sheet of the colours that the mixed materials have, in linear light; black where nothing is mixed.
std::string colour_sheet(const LayerStack& stack, std::uint32_t layer) {
  const std::vector<std::size_t> planes = ratio_planes(stack);
  std::vector<std::string> ratios;
  for (const std::size_t plane : planes) ratios.push_back(stack.samples(layer, plane));
  const bool rest = planes.size() == 1;
  std::vector<std::array<double, 3>> colours;
  for (std::size_t i = 0; i < planes.size() + rest; ++i) colours.push_back(linear_light(kColours[i % kColours.size()]));
  Picture picture{static_cast<int>(stack.columns()), static_cast<int>(stack.rows()), {}};
  picture.rgb.resize(3 * ratios.front().size());
  for (std::size_t voxel = 0; voxel < ratios.front().size(); ++voxel) {
    std::array<double, 3> sum{};
    double weights = 0;
    for (std::size_t i = 0; i < colours.size(); ++i) {
      const auto sample = static_cast<unsigned char>(ratios[std::min(i, ratios.size() - 1)][voxel]);
      const double weight = i < ratios.size() ? sample : 255 - sample;
      weights += weight;
      for (std::size_t k = 0; k < 3; ++k) sum[k] += weight * colours[i][k];
    }
    for (std::size_t k = 0; k < 3; ++k) {
      picture.rgb[3 * voxel + k] = to_byte(weights > 0 ? sum[k] / weights : 0);
    }
  }
  constexpr int kFast = 1;  // There are as many as layers.
  return to_png(picture, kFast);
}

std::string content_types() {
  XmlWriter xml;
  xml.begin("Types").attribute("xmlns", kContentTypes);
  const std::array<std::array<const char*, 2>, 3> types = {
      {{"rels", "application/vnd.openxmlformats-package.relationships+xml"},
       {"model", kModelType},
       {"png", "image/png"}}};
  for (const auto& [extension, type] : types) {
    xml.begin("Default").attribute("Extension", extension).attribute("ContentType", type).end();
  }
  return xml.end().text();
}

void add_relation(XmlWriter& xml, const std::string& target, const std::string& id, const char* type) {
  xml.begin("Relationship").attribute("Target", target).attribute("Id", id).attribute("Type", type).end();
}

std::string package_relations() {
  XmlWriter xml;
  xml.begin("Relationships").attribute("xmlns", kRelationships);
  add_relation(xml, kModelPath, "model", kModelRelation);
  return xml.end().text();
}

std::string model_relations(const LayerStack& stack, std::size_t ratios) {
  XmlWriter xml;
  xml.begin("Relationships").attribute("xmlns", kRelationships);
  for (std::size_t ratio = 0; ratio < ratios; ++ratio) {
    for (std::uint32_t layer = 0; layer < stack.layers(); ++layer) {
      add_relation(xml, sheet_path(ratio_name(ratio), layer), "s" + std::to_string(ratio) + "-" + std::to_string(layer),
                   kTextureRelation);
    }
  }
  for (std::uint32_t layer = 0; layer < stack.layers(); ++layer) {
    add_relation(xml, sheet_path(kColourName, layer), "c" + std::to_string(layer), kTextureRelation);
  }
  return xml.end().text();
}

/// From the part's millimetres to the unit cube of a stack of sheets.
std::string to_unit_cube(const LayerStack& stack) {
  const std::array<double, 3> size = {stack.columns() * stack.pitch_mm()[0], stack.rows() * stack.pitch_mm()[1],
                                      stack.layers() * stack.pitch_mm()[2]};
  const std::array<double, 3>& origin = stack.origin_mm();
  // The sheets' first row is where v is 1.
  const std::array<bool, 3> turned = {stack.columns_descend(), !stack.rows_descend(), false};
  std::array<double, 3> scale{}, offset{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    scale[axis] = (turned[axis] ? -1 : 1) / size[axis];
    offset[axis] = (turned[axis] ? 1 : 0) - origin[axis] * scale[axis];
  }
  return shortest(scale[0]) + " 0 0 0 " + shortest(scale[1]) + " 0 0 0 " + shortest(scale[2]) + " " +
         shortest(offset[0]) + " " + shortest(offset[1]) + " " + shortest(offset[2]);
}

void add_triangles(const client::Surface& surface, XmlWriter& xml) {
  xml.begin("vertices");
  for (const auto& [x, y, z] : surface.points_mm) {
    xml.begin("vertex").attribute("x", x).attribute("y", y).attribute("z", z).end();
  }
  xml.end().begin("triangles");
  for (const auto& [a, b, c] : surface.triangles) {
    xml.begin("triangle").attribute("v1", a).attribute("v2", b).attribute("v3", c).end();
  }
  xml.end();
}

class ModelWriter {
 public:
  ModelWriter(const LayerStack& stack, const client::Surface& boundary)
      : stack_(stack), boundary_(boundary), ratios_(ratio_planes(stack)), materials_(materials_of(stack)) {}

  std::string write() {
    xml_.begin("model").attribute("unit", "millimeter").attribute("xml:lang", "en-US").attribute("xmlns", kThreeMfCore);
    xml_.attribute("xmlns:v", kVolumetric).attribute("xmlns:channel", kChannels);
    xml_.attribute("requiredextensions", "v").begin("resources");
    add_materials();
    for (std::size_t ratio = 0; ratio < ratios_.size(); ++ratio) add_image(image_id(ratio), ratio_name(ratio));
    add_image(colour_image_id(), kColourName);
    for (std::size_t material = 0; material < materials_.size(); ++material) add_ratio_function(material);
    for (std::size_t ratio = 0; ratio < ratios_.size(); ++ratio) add_channel_function(ratio);
    add_function(colour_function_id(), kColourName, colour_image_id(), 0, 1);
    add_volume_data();
    add_mesh();
    xml_.end().begin("build");
    xml_.begin("item").attribute("objectid", kObjectId).attribute("transform", into_the_octant()).end();
    return xml_.end().end().text();
  }

 private:
  int image_id(std::size_t ratio) const { return kFirstFreeId + static_cast<int>(ratio); }
  int colour_image_id() const { return image_id(ratios_.size()); }
  int function_id(std::size_t material) const { return colour_image_id() + 1 + static_cast<int>(material); }
  int channel_function_id(std::size_t ratio) const { return function_id(materials_.size() + ratio); }
  int colour_function_id() const { return channel_function_id(ratios_.size()); }

  void add_materials() {
    xml_.begin("basematerials").attribute("id", kMaterialsId);
    for (std::size_t i = 0; i < materials_.size(); ++i) {
      xml_.begin("base").attribute("name", materials_[i]).attribute("displaycolor", kColours[i % kColours.size()]);
      xml_.end();
    }
    xml_.end();
  }

  void add_image(int id, const std::string& name) {
    xml_.begin("v:image3d").attribute("id", id).attribute("name", name);
    xml_.begin("v:imagestack").attribute("rowcount", stack_.rows()).attribute("columncount", stack_.columns());
    xml_.attribute("sheetcount", stack_.layers());
    for (std::uint32_t layer = 0; layer < stack_.layers(); ++layer) {
      xml_.begin("v:imagesheet").attribute("path", sheet_path(name, layer)).end();
    }
    xml_.end().end();
  }

  void add_ratio_function(std::size_t material) {
    const bool rest = material >= ratios_.size();
    add_function(function_id(material), materials_[material], image_id(rest ? 0 : material), rest ? 1 : 0,
                 rest ? -1 : 1);
  }

  /// The channel's own values.
  void add_channel_function(std::size_t ratio) {
    const auto& [low, high] = stack_.planes()[ratios_[ratio]].value_range;
    add_function(channel_function_id(ratio), materials_[ratio], image_id(ratio), low, high - low);
  }

  /// `offset` and `scale`: of samples from 0 to 1.
  void add_function(int id, const std::string& name, int image, double offset, double scale) {
    xml_.begin("v:functionfromimage3d").attribute("id", id).attribute("displayname", name);
    xml_.attribute("image3did", image).attribute("valueoffset", offset).attribute("valuescale", scale);
    xml_.attribute("filter", "linear");
    for (const char* axis : {"tilestyleu", "tilestylev", "tilestylew"}) xml_.attribute(axis, "clamp");
    xml_.end();
  }

  void add_volume_data() {
    xml_.begin("v:volumedata").attribute("id", kVolumeId);
    xml_.begin("v:composite").attribute("basematerialid", kMaterialsId);
    const std::string transform = to_unit_cube(stack_);
    for (std::size_t material = 0; material < materials_.size(); ++material) {
      xml_.begin("v:materialmapping").attribute("functionid", function_id(material)).attribute("channel", "red");
      xml_.attribute("transform", transform).end();
    }
    xml_.end();
    xml_.begin("v:color").attribute("functionid", colour_function_id()).attribute("transform", transform);
    xml_.attribute("channel", "color").end();
    for (std::size_t ratio = 0; ratio < ratios_.size(); ++ratio) {
      xml_.begin("v:property").attribute("functionid", channel_function_id(ratio)).attribute("transform", transform);
      xml_.attribute("channel", "red").attribute("name", "channel:" + property_name(materials_[ratio], ratio));
      xml_.attribute("required", "false").end();
    }
    xml_.end();
  }

  void add_mesh() {
    xml_.begin("object").attribute("id", kObjectId).attribute("type", "model");
    xml_.begin("mesh").attribute("v:volumeid", kVolumeId);
    add_triangles(boundary_, xml_);
    xml_.end().end();
  }

  /// Readers want parts where all coordinates are positive.
  std::string into_the_octant() const {
    std::array<double, 3> lowest;
    lowest.fill(std::numeric_limits<double>::infinity());
    for (const auto& point : boundary_.points_mm) {
      for (std::size_t axis = 0; axis < 3; ++axis) lowest[axis] = std::min(lowest[axis], point[axis]);
    }
    std::string transform = "1 0 0 0 1 0 0 0 1";
    for (const double low : lowest) transform += " " + shortest(0 - low);
    return transform;
  }

  const LayerStack& stack_;
  const client::Surface& boundary_;
  const std::vector<std::size_t> ratios_;
  const std::vector<std::string> materials_;
  XmlWriter xml_;
};

}  // namespace

void add_three_mf_mesh(const client::Surface& surface, XmlWriter& xml) {
  xml.begin("mesh");
  add_triangles(surface, xml);
  xml.end();
}

void add_three_mf_start(ZipFile& zip, const std::string& model) {
  zip.add_compressed("[Content_Types].xml", content_types());
  zip.add_compressed("_rels/.rels", package_relations());
  zip.add_compressed(std::string(kModelPath).substr(1), model);
}

void require_three_mf_stack(const LayerStack& stack) {
  if (stack.is_region()) {
    throw Error(ErrorCode::kFileUnsupported,
                "a .3mf file holds the whole boundary, and these layers are a part of the grid; slice without "
                "--box, --box-voxels and --layers");
  }
  if (!ratio_planes(stack).empty()) return;
  throw Error(ErrorCode::kFileUnsupported,
              "a .3mf file is made of 8-bit PNG pictures of channels, and there are none here; slice with --channel "
              "NAME:u8 and --encoding png");
}

std::uint64_t write_three_mf(const LayerStack& stack, const client::Surface& boundary,
                             const std::filesystem::path& path) {
  require_three_mf_stack(stack);
  const std::vector<std::size_t> planes = ratio_planes(stack);
  ZipFile zip(path);
  add_three_mf_start(zip, ModelWriter(stack, boundary).write());
  zip.add_compressed("3D/_rels/3dmodel.model.rels", model_relations(stack, planes.size()));
  for (std::size_t ratio = 0; ratio < planes.size(); ++ratio) {
    for (std::uint32_t layer = 0; layer < stack.layers(); ++layer) {
      zip.add_stored(sheet_path(ratio_name(ratio), layer).substr(1), stack.picture(layer, planes[ratio]));
    }
  }
  for (std::uint32_t layer = 0; layer < stack.layers(); ++layer) {
    zip.add_stored(sheet_path(kColourName, layer).substr(1), colour_sheet(stack, layer));
  }
  return zip.finish();
}

}  // namespace ccslice::cli
