// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/package_model.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

[[noreturn]] void fail(const std::string& where, const std::string& what) {
  throw Error(ErrorCode::kFileSyntax, where + ": " + what);
}

struct Unit {
  std::string_view name;
  double mm = 1;
};

/// [3MF, 3.4].
double unit_mm(std::string_view name, const std::string& where) {
  constexpr std::array<Unit, 6> kUnits = {
      {{"micron", 1e-3}, {"millimeter", 1}, {"centimeter", 10}, {"inch", 25.4}, {"foot", 304.8}, {"meter", 1000}}};
  if (name.empty()) return 1;
  for (const Unit& unit : kUnits) {
    if (unit.name == name) return unit.mm;
  }
  fail(where, "its unit '" + echoed(name) + "' is none of 3MF's; save it in millimeters");
}

/// A finite number, or nothing. Signs may be '+', as in XML's numbers.
bool take_number(std::string_view text, double& number) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(number);
}

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

/// The next word of the text, which loses it; empty at its end.
std::string_view next_word(std::string_view& text) {
  while (!text.empty() && is_blank(text.front())) text.remove_prefix(1);
  std::size_t length = 0;
  while (length < text.size() && !is_blank(text[length])) ++length;
  const std::string_view word = text.substr(0, length);
  text.remove_prefix(length);
  return word;
}

/// The attribute of this local name, or a null one.
pugi::xml_attribute attribute(pugi::xml_node node, std::string_view name) {
  for (const pugi::xml_attribute at : node.attributes()) {
    if (local_name(at.name()) == name) return at;
  }
  return {};
}

pugi::xml_node child(pugi::xml_node node, std::string_view name) {
  for (const pugi::xml_node at : node.children()) {
    if (local_name(at.name()) == name) return at;
  }
  return {};
}

class ModelParser {
 public:
  ModelParser(pugi::xml_node model, std::string where)
      : model_(model), where_(std::move(where)), unit_mm_(unit_mm(attribute(model, "unit").value(), where_)) {}

  PackageModel parse() {
    PackageModel parsed;
    for (const pugi::xml_node node : child(model_, "resources").children()) {
      if (local_name(node.name()) != "object") continue;
      const std::uint32_t id = package_number(attribute(node, "id").value(), where_, "an object's id");
      if (!parsed.objects.emplace(id, object(node, id)).second) {
        fail(where_, "object " + std::to_string(id) + " is there twice; save the file again");
      }
    }
    for (const pugi::xml_node node : child(model_, "build").children()) {
      if (local_name(node.name()) != "item") continue;
      const std::string_view printable = attribute(node, "printable").value();  // [Prusa], [Bambu]
      parsed.items.push_back({component(node, "a build item"), printable != "0" && printable != "false"});
    }
    return parsed;
  }

 private:
  ModelObject object(pugi::xml_node node, std::uint32_t id) const {
    ModelObject read;
    read.name = attribute(node, "name").value();
    if (const pugi::xml_attribute type = attribute(node, "type")) read.type = type.value();
    const std::string label =
        "object " + std::to_string(id) + (read.name.empty() ? "" : " '" + echoed(read.name) + "'");
    if (const pugi::xml_node mesh = child(node, "mesh")) {
      read.points = std::make_shared<std::vector<Vec3>>(points(child(mesh, "vertices"), label));
      read.triangles = triangles(child(mesh, "triangles"), label);
      return read;
    }
    for (const pugi::xml_node part : child(node, "components").children()) {
      if (local_name(part.name()) == "component") read.components.push_back(component(part, label));
    }
    return read;
  }

  std::vector<Vec3> points(pugi::xml_node vertices, const std::string& label) const {
    std::vector<Vec3> read;
    for (const pugi::xml_node vertex : vertices.children()) {
      if (local_name(vertex.name()) != "vertex") continue;
      Vec3 point;
      for (int axis = 0; axis < 3; ++axis) {
        constexpr std::array<const char*, 3> kNames = {"x", "y", "z"};
        const char* const text = vertex.attribute(kNames[static_cast<std::size_t>(axis)]).value();
        if (take_number(text, point[axis])) continue;
        fail(where_, label + ": " + kNames[static_cast<std::size_t>(axis)] + " of vertex " +
                         std::to_string(read.size()) + " is no number: '" + echoed(text) + "'; save the file again");
      }
      read.push_back(unit_mm_ * point);
    }
    return read;
  }

  std::vector<std::array<std::uint32_t, 3>> triangles(pugi::xml_node triangles, const std::string& label) const {
    std::vector<std::array<std::uint32_t, 3>> read;
    for (const pugi::xml_node triangle : triangles.children()) {
      if (local_name(triangle.name()) != "triangle") continue;
      constexpr std::array<const char*, 3> kNames = {"v1", "v2", "v3"};
      std::array<std::uint32_t, 3>& corners = read.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        corners[k] =
            package_number(triangle.attribute(kNames[k]).value(), where_ + ": " + label, "a triangle's corner");
      }
    }
    return read;
  }

  ModelComponent component(pugi::xml_node node, const std::string& label) const {
    ModelComponent read;
    read.object_id = package_number(attribute(node, "objectid").value(), where_, "the objectid of " + label);
    read.path = attribute(node, "path").value();
    if (const pugi::xml_attribute text = attribute(node, "transform")) {
      read.transform = transform(text.value(), label + ", which refers to object " + std::to_string(read.object_id));
    }
    return read;
  }

  /// "m00 m01 m02 m10 ... m32", for row vectors: the translation comes last [3MF, 3.3].
  Placement transform(std::string_view text, const std::string& label) const {
    Placement read;
    std::string_view rest = text;
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 3; ++column) {
        double number = 0;
        if (!take_number(next_word(rest), number)) {
          fail(where_, label + ": its transform isn't 12 numbers: '" + echoed(text) + "'; save the file again");
        }
        read.matrix()(column, row) = row < 3 ? number : unit_mm_ * number;
      }
    }
    if (!next_word(rest).empty()) fail(where_, label + ": its transform has more than 12 numbers; save the file again");
    if (std::abs(read.linear().determinant()) < 1e-18) {
      fail(where_, label + ": its transform flattens it; undo its scaling to nothing");
    }
    return read;
  }

  const pugi::xml_node model_;
  const std::string where_;
  const double unit_mm_;
};

}  // namespace

PackageModel parse_package_model(std::string xml, const std::string& where) {
  pugi::xml_document document;
  load_xml(xml, where, document);
  const pugi::xml_node model = child(document, "model");
  if (!model) fail(where, "it has no model element; save the file as .3mf again");
  return ModelParser(model, where).parse();
}

void load_xml(std::string& xml, const std::string& where, pugi::xml_document& document) {
  const pugi::xml_parse_result result =
      document.load_buffer_inplace(xml.data(), xml.size(), pugi::parse_minimal | pugi::parse_escapes);
  if (result) return;
  fail(where, "it is no XML that can be read: " + std::string(result.description()) + " at byte " +
                  std::to_string(result.offset) + "; save the file again");
}

std::string_view local_name(std::string_view name) {
  const std::size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

std::uint32_t package_number(std::string_view text, const std::string& where, const std::string& what) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error == std::errc() && end == text.data() + text.size()) return number;
  fail(where, what + " is no whole number: '" + echoed(text) + "'; save the file again");
}

std::string package_entry(std::string_view path, const std::string& where) {
  std::string entry(path.starts_with('/') ? path.substr(1) : path);
  for (std::size_t at = 0; at <= entry.size();) {
    const std::size_t end = std::min(entry.find('/', at), entry.size());
    const std::string_view segment = std::string_view(entry).substr(at, end - at);
    if (segment.empty() || segment == "." || segment == ".." || segment.find('\\') != std::string_view::npos) {
      fail(where, "'" + echoed(path) +
                      "' is no path of a part in the package, such as /3D/Objects/object_1.model; save "
                      "the file again");
    }
    at = end + 1;
  }
  return entry;
}

}  // namespace ccslice::cli
