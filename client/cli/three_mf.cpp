// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/three_mf.h"

#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "client/cli/xml.h"
#include "client/cli/zip_file.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

constexpr const char* kCore = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02";
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

std::string sheet_path(std::size_t ratio, std::uint32_t layer) {
  std::string number = std::to_string(layer);
  number.insert(0, 5 - std::min<std::size_t>(5, number.size()), '0');
  return "/3D/volumetric/ratio" + std::to_string(ratio) + "/sheet" + number + ".png";
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
      add_relation(xml, sheet_path(ratio, layer), "s" + std::to_string(ratio) + "-" + std::to_string(layer),
                   kTextureRelation);
    }
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

class ModelWriter {
 public:
  ModelWriter(const LayerStack& stack, const client::Surface& boundary)
      : stack_(stack), boundary_(boundary), ratios_(ratio_planes(stack)) {
    for (const std::size_t plane : ratios_) materials_.push_back(stack.planes()[plane].channel);
    if (ratios_.size() == 1) materials_.emplace_back("rest");
  }

  std::string write() {
    xml_.begin("model").attribute("unit", "millimeter").attribute("xml:lang", "en-US").attribute("xmlns", kCore);
    xml_.attribute("xmlns:v", kVolumetric).attribute("requiredextensions", "v").begin("resources");
    add_materials();
    for (std::size_t ratio = 0; ratio < ratios_.size(); ++ratio) add_image(ratio);
    for (std::size_t material = 0; material < materials_.size(); ++material) add_function(material);
    add_composite();
    add_mesh();
    xml_.end().begin("build");
    xml_.begin("item").attribute("objectid", kObjectId).attribute("transform", into_the_octant()).end();
    return xml_.end().end().text();
  }

 private:
  int image_id(std::size_t ratio) const { return kFirstFreeId + static_cast<int>(ratio); }
  int function_id(std::size_t material) const { return image_id(ratios_.size() + material); }

  void add_materials() {
    xml_.begin("basematerials").attribute("id", kMaterialsId);
    for (std::size_t i = 0; i < materials_.size(); ++i) {
      xml_.begin("base").attribute("name", materials_[i]).attribute("displaycolor", kColours[i % kColours.size()]);
      xml_.end();
    }
    xml_.end();
  }

  void add_image(std::size_t ratio) {
    xml_.begin("v:image3d").attribute("id", image_id(ratio)).attribute("name", "ratio" + std::to_string(ratio));
    xml_.begin("v:imagestack").attribute("rowcount", stack_.rows()).attribute("columncount", stack_.columns());
    xml_.attribute("sheetcount", stack_.layers());
    for (std::uint32_t layer = 0; layer < stack_.layers(); ++layer) {
      xml_.begin("v:imagesheet").attribute("path", sheet_path(ratio, layer)).end();
    }
    xml_.end().end();
  }

  void add_function(std::size_t material) {
    const bool rest = material >= ratios_.size();
    xml_.begin("v:functionfromimage3d").attribute("id", function_id(material));
    xml_.attribute("displayname", materials_[material]).attribute("image3did", image_id(rest ? 0 : material));
    xml_.attribute("valueoffset", rest ? 1 : 0).attribute("valuescale", rest ? -1 : 1).attribute("filter", "linear");
    for (const char* axis : {"tilestyleu", "tilestylev", "tilestylew"}) xml_.attribute(axis, "clamp");
    xml_.end();
  }

  void add_composite() {
    xml_.begin("v:volumedata").attribute("id", kVolumeId);
    xml_.begin("v:composite").attribute("basematerialid", kMaterialsId);
    const std::string transform = to_unit_cube(stack_);
    for (std::size_t material = 0; material < materials_.size(); ++material) {
      xml_.begin("v:materialmapping").attribute("functionid", function_id(material)).attribute("channel", "red");
      xml_.attribute("transform", transform).end();
    }
    xml_.end().end();
  }

  void add_mesh() {
    xml_.begin("object").attribute("id", kObjectId).attribute("type", "model");
    xml_.begin("mesh").attribute("v:volumeid", kVolumeId).begin("vertices");
    for (const auto& [x, y, z] : boundary_.points_mm) {
      xml_.begin("vertex").attribute("x", x).attribute("y", y).attribute("z", z).end();
    }
    xml_.end().begin("triangles");
    for (const auto& [a, b, c] : boundary_.triangles) {
      xml_.begin("triangle").attribute("v1", a).attribute("v2", b).attribute("v3", c).end();
    }
    xml_.end().end().end();
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
  std::vector<std::string> materials_;
  XmlWriter xml_;
};

}  // namespace

void require_three_mf_stack(const LayerStack& stack) {
  if (stack.is_region()) {
    throw Error(ErrorCode::kFileUnsupported,
                "a .3mf file holds the whole boundary, and these layers are a region of the grid; slice without "
                "--region and --region-voxels");
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
  zip.add_compressed("[Content_Types].xml", content_types());
  zip.add_compressed("_rels/.rels", package_relations());
  zip.add_compressed(std::string(kModelPath).substr(1), ModelWriter(stack, boundary).write());
  zip.add_compressed("3D/_rels/3dmodel.model.rels", model_relations(stack, planes.size()));
  for (std::size_t ratio = 0; ratio < planes.size(); ++ratio) {
    for (std::uint32_t layer = 0; layer < stack.layers(); ++layer) {
      zip.add_stored(sheet_path(ratio, layer).substr(1), stack.picture(layer, planes[ratio]));
    }
  }
  return zip.finish();
}

}  // namespace ccslice::cli
