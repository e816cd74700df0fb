// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/convert_printing.h"

#include <string>
#include <utility>
#include <vector>

#include "core/base/choice_text.h"
#include "core/base/error.h"
#include "core/base/find_named.h"
#include "server/rpc/convert/contract_value.h"
#include "server/rpc/convert/convert.h"

namespace ccslice::server {
namespace {

// The parts of a map. Fields are those of the request.
class MapReader {
 public:
  MapReader(const Printing& printing, std::string path) : printing_(printing), path_(std::move(path)) {}

  MaterialMap read(const v1::MaterialMap& message) const {
    MaterialMap map;
    map.strict = message.strict();
    for (int i = 0; i < message.overrides_size(); ++i) {
      const v1::MapOverride& first = message.overrides(i);
      const std::string field = path_ + ".overrides[" + std::to_string(i) + "]";
      MapOverride& own = map.overrides.emplace_back();
      own = {first.channel(), first.below(), to_material(first.material(), printing_, field + ".material")};
      if (first.instead_of().empty()) continue;
      own.instead_of = to_material(first.instead_of(), printing_, field + ".instead_of");
    }
    switch (message.kind_case()) {
      case v1::MaterialMap::kDirect: map.kind = read(message.direct()); return map;
      case v1::MaterialMap::kBlend: map.kind = read(message.blend()); return map;
      case v1::MaterialMap::kCalibration: map.kind = read(message.calibration()); return map;
      case v1::MaterialMap::kColour: map.kind = read(message.colour()); return map;
      case v1::MaterialMap::kMaterial:
        map.kind = PureMap{to_material(message.material(), printing_, path_ + ".material")};
        return map;
      case v1::MaterialMap::KIND_NOT_SET: break;
    }
    throw Error(ErrorCode::kMaterialMapInvalid,
                path_ + ": has no kind; give direct, blend, calibration, colour or material", path_);
  }

 private:
  DirectMap read(const v1::DirectMap& message) const {
    const std::string path = path_ + ".direct";
    DirectMap map;
    for (int i = 0; i < message.shares_size(); ++i) {
      const std::string share = path + ".shares[" + std::to_string(i) + "]";
      map.shares.push_back(
          {message.shares(i).channel(), to_material(message.shares(i).material(), printing_, share + ".material")});
    }
    if (message.rest_material().empty()) return map;
    map.rest_material = to_material(message.rest_material(), printing_, path + ".rest_material");
    return map;
  }

  BlendMap read(const v1::BlendMap& message) const {
    const std::string path = path_ + ".blend";
    BlendMap map;
    map.channel = message.channel();
    for (int i = 0; i < message.stops_size(); ++i) {
      const std::string field = path + ".stops[" + std::to_string(i) + "].material";
      map.stops.push_back({message.stops(i).value(), to_material(message.stops(i).material(), printing_, field)});
    }
    return map;
  }

  CalibrationMap read(const v1::CalibrationMap& message) const {
    const std::string path = path_ + ".calibration";
    CalibrationMap map;
    map.channel = message.channel();
    map.material = to_material(message.material(), printing_, path + ".material");
    map.base = to_material(message.base(), printing_, path + ".base");
    for (const v1::CalibrationPoint& point : message.points())
      map.points.push_back({point.property(), point.fraction()});
    return map;
  }

  static ColourMap read(const v1::ColourMap& message) {
    ColourMap map;
    map.red = message.red_channel();
    map.green = message.green_channel();
    map.blue = message.blue_channel();
    if (message.full_value() != 0) map.full_value = message.full_value();
    return map;
  }

  const Printing& printing_;
  const std::string path_;
};

std::uint8_t to_cell_region(const std::string& name, const SolidSummary& solid, const std::string& field) {
  return static_cast<std::uint8_t>(find_named(solid.cell_regions, name, ErrorCode::kCellRegionUnknown,
                                              "there is no cell region", "the mesh", field));
}

constexpr std::string_view kMethodPrefix = "HALFTONE_METHOD_";

HalftoneMethod to_method(v1::HalftoneMethod method) {
  if (method == v1::HALFTONE_METHOD_UNSPECIFIED) return Halftone().method;
  if (const auto* traits = find_contract_row(kHalftoneMethods, kMethodPrefix, method)) return traits->method;
  const std::string field = "printing.halftone.method";
  throw Error(ErrorCode::kEnumValueUnknown,
              field + ": " + std::to_string(static_cast<int>(method)) +
                  " isn't a method that this server knows; ask for " + choice_text(kHalftoneMethods),
              field);
}

// The way back.
class MapWriter {
 public:
  MapWriter(const Printing& printing, v1::MaterialMap& message) : printing_(printing), message_(message) {}

  void operator()(std::monostate) const {}
  void operator()(const PureMap& map) const { message_.set_material(material(map.material)); }

  void operator()(const DirectMap& map) const {
    v1::DirectMap& direct = *message_.mutable_direct();
    for (const DirectMap::Share& share : map.shares) {
      v1::DirectShare& written = *direct.add_shares();
      written.set_channel(share.channel);
      written.set_material(material(share.material));
    }
    if (map.rest_material != 0) direct.set_rest_material(material(map.rest_material));
  }

  void operator()(const BlendMap& map) const {
    v1::BlendMap& blend = *message_.mutable_blend();
    blend.set_channel(map.channel);
    for (const BlendMap::Stop& stop : map.stops) {
      v1::BlendStop& written = *blend.add_stops();
      written.set_value(stop.value);
      written.set_material(material(stop.material));
    }
  }

  void operator()(const CalibrationMap& map) const {
    v1::CalibrationMap& curve = *message_.mutable_calibration();
    curve.set_channel(map.channel);
    curve.set_material(material(map.material));
    curve.set_base(material(map.base));
    for (const CalibrationMap::Point& point : map.points) {
      v1::CalibrationPoint& written = *curve.add_points();
      written.set_property(point.property);
      written.set_fraction(point.fraction);
    }
  }

  void operator()(const ColourMap& map) const {
    v1::ColourMap& colour = *message_.mutable_colour();
    colour.set_red_channel(map.red);
    colour.set_green_channel(map.green);
    colour.set_blue_channel(map.blue);
    colour.set_full_value(map.full_value);
  }

 private:
  const std::string& material(std::uint32_t number) const { return printing_.materials[number - 1].name; }

  const Printing& printing_;
  v1::MaterialMap& message_;
};

}  // namespace

std::uint32_t to_material(const std::string& name, const Printing& printing, const std::string& field) {
  return 1 + find_named(printing.materials, name, ErrorCode::kMaterialUnknown, "there is no material",
                        "printing.materials", field);
}

Printing to_printing(const v1::Printing& message, const SolidSummary& solid) {
  Printing printing;
  for (const v1::PrintMaterial& material : message.materials()) {
    printing.materials.push_back({material.name(), material.rgba(), material.leaves_empty()});
  }
  if (message.has_background_rgba()) printing.background_rgba = message.background_rgba();
  validate_materials(printing);
  if (message.has_map()) printing.map = MapReader(printing, "printing.map").read(message.map());
  for (int i = 0; i < message.cell_region_maps_size(); ++i) {
    const v1::CellRegionMap& own = message.cell_region_maps(i);
    const std::string path = "printing.cell_region_maps[" + std::to_string(i) + "]";
    printing.cell_region_maps.push_back({to_cell_region(own.cell_region(), solid, path + ".cell_region"),
                                         MapReader(printing, path + ".map").read(own.map())});
  }
  printing.halftone = {to_method(message.halftone().method()), message.halftone().seed()};
  return printing;
}

v1::Printing to_message(const Printing& value, const SolidSummary& solid) {
  v1::Printing message;
  for (const PrintMaterial& material : value.materials) {
    v1::PrintMaterial& written = *message.add_materials();
    written.set_name(material.name);
    written.set_rgba(material.rgba);
    written.set_leaves_empty(material.leaves_empty);
  }
  const auto write = [&](const MaterialMap& map, v1::MaterialMap& written) {
    std::visit(MapWriter(value, written), map.kind);
    written.set_strict(map.strict);
    for (const MapOverride& first : map.overrides) {
      v1::MapOverride& own = *written.add_overrides();
      own.set_channel(first.channel);
      own.set_below(first.below);
      own.set_material(value.materials[first.material - 1].name);
      if (first.instead_of != 0) own.set_instead_of(value.materials[first.instead_of - 1].name);
    }
  };
  if (!std::holds_alternative<std::monostate>(value.map.kind)) write(value.map, *message.mutable_map());
  for (const CellRegionMap& own : value.cell_region_maps) {
    v1::CellRegionMap& written = *message.add_cell_region_maps();
    written.set_cell_region(solid.cell_regions[own.cell_region].name);
    write(own.map, *written.mutable_map());
  }
  message.mutable_halftone()->set_method(
      contract_value<v1::HalftoneMethod>(kMethodPrefix, value.halftone.traits().name));
  message.mutable_halftone()->set_seed(value.halftone.seed);
  message.set_background_rgba(value.background_rgba);
  return message;
}

}  // namespace ccslice::server
