// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One model part of a 3MF package: the XML of its objects and build items [3MF, 3.4, 4.1, 4.2; 3MF-P, 3.1], in mm.
// Elements go by their local names, as other namespaces' have none of these.

#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/types.h"

namespace ccslice::cli {

struct ModelComponent {
  std::uint32_t object_id = 0;
  std::string path;  // Of the part that has the object; empty: this one.
  Placement transform = Placement::Identity();
};

struct ModelObject {
  std::string name;                           // Empty: none.
  std::string type = "model";                 // Or "support", "other" and the like, which isn't printed.
  std::shared_ptr<std::vector<Vec3>> points;  // Null: an object of components.
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<ModelComponent> components;
};

struct ModelItem {
  ModelComponent object;
  bool printable = true;
};

struct PackageModel {
  std::map<std::uint32_t, ModelObject> objects;
  std::vector<ModelItem> items;
};

/// `where`: the file and the part, for messages. Throws Error{kFileSyntax, kFileUnsupported}.
PackageModel parse_package_model(std::string xml, const std::string& where);

/// Parses an XML text in place. Throws Error{kFileSyntax}.
void load_xml(std::string& xml, const std::string& where, pugi::xml_document& document);

/// "path" of "p:path".
std::string_view local_name(std::string_view name);

/// A whole number from 0 on. Throws Error{kFileSyntax}, which says `what` it is of.
std::uint32_t package_number(std::string_view text, const std::string& where, const std::string& what);

/// The name of an entry in the package for a path in it, which is absolute [3MF-P, 3.1]. Throws Error{kFileSyntax} for
/// one that leaves the package.
std::string package_entry(std::string_view path, const std::string& where);

}  // namespace ccslice::cli
