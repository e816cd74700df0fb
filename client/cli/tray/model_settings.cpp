// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/model_settings.h"

#include <string_view>

#include "client/cli/tray/package_model.h"

namespace ccslice::cli {
namespace {

/// The value of a key among the element's own metadata; empty if there is none.
std::string_view metadata(pugi::xml_node node, std::string_view key) {
  for (const pugi::xml_node entry : node.children("metadata")) {
    if (entry.attribute("key").value() == key) return entry.attribute("value").value();
  }
  return {};
}

void add_object(pugi::xml_node node, const std::string& where, ModelSettings& settings) {
  const std::uint32_t id = package_number(node.attribute("id").value(), where, "an object's id");
  settings.names[id] = metadata(node, "name");
  for (const pugi::xml_node part : node.children("part")) {
    const std::uint32_t number = package_number(part.attribute("id").value(), where, "a part's id");
    settings.parts[{id, number}] = {std::string(metadata(part, "name")), part.attribute("subtype").value()};
  }
  for (const pugi::xml_node volume : node.children("volume")) {
    settings.volumes[id].push_back(
        {std::string(metadata(volume, "name")), std::string(metadata(volume, "volume_type")),
         package_number(volume.attribute("firstid").value(), where, "the firstid of a volume"),
         package_number(volume.attribute("lastid").value(), where, "the lastid of a volume")});
  }
}

void add_plate(pugi::xml_node node, const std::string& where, ModelSettings& settings) {
  PlateSettings read;
  read.plate.number = package_number(metadata(node, "plater_id"), where, "a plate's plater_id");
  read.plate.name = metadata(node, "plater_name");
  for (const pugi::xml_node instance : node.children("model_instance")) {
    read.instances.emplace(
        package_number(metadata(instance, "object_id"), where, "the object_id of a model_instance"),
        package_number(metadata(instance, "instance_id"), where, "the instance_id of a model_instance"));
  }
  settings.plates.push_back(std::move(read));
}

}  // namespace

ModelSettings parse_model_settings(std::string xml, const std::string& where) {
  pugi::xml_document document;
  load_xml(xml, where, document);
  ModelSettings settings;
  const pugi::xml_node config = document.child("config");
  for (const pugi::xml_node node : config.children("object")) add_object(node, where, settings);
  for (const pugi::xml_node node : config.children("plate")) add_plate(node, where, settings);
  return settings;
}

}  // namespace ccslice::cli
