// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The file in which programs describe a package's objects: names, which parts aren't printed, and plates.
//
// Bambu Studio and OrcaSlicer write Metadata/model_settings.config (_add_model_config_file_to_archive() of [Bambu]):
//   <config>
//     <object id="2"> <metadata key="name" value="ring"/>
//       <part id="1" subtype="normal_part"> <metadata key="name" value="ring"/> </part> </object>
//     <plate> <metadata key="plater_id" value="1"/> <metadata key="plater_name" value=""/>
//       <model_instance>
//         <metadata key="object_id" value="2"/> <metadata key="instance_id" value="0"/> </model_instance> </plate>
//   </config>
// Objects and parts go by the ids that the model part has; instances of an object are counted from 0 as its build items
// come. PrusaSlicer writes names alike into Metadata/Slic3r_PE_model.config, and has no plates there. All volumes of
// an object, modifiers too, are one mesh there, which is told apart by triangles; vertices from the lowest to the
// highest of its triangles are a volume's [Prusa, _generate_volumes()]:
//   <object id="1"> <metadata type="object" key="name" value="ring"/>
//     <volume firstid="0" lastid="99"> <metadata type="volume" key="volume_type" value="ModelPart"/> </volume>
//   </object>

#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/tray/tray_package.h"

namespace ccslice::cli {

struct PartSettings {
  std::string name, subtype;
};

/// One of the volumes that PrusaSlicer keeps in an object's mesh.
struct VolumeSettings {
  std::string name, type;                               // "ModelPart", "ParameterModifier", ...
  std::uint32_t first_triangle = 0, last_triangle = 0;  // Both included.
};

struct PlateSettings {
  TrayPlate plate;
  std::set<std::pair<std::uint32_t, std::uint32_t>> instances;  // Object and instance.
};

struct ModelSettings {
  std::map<std::uint32_t, std::string> names;                             // By object.
  std::map<std::pair<std::uint32_t, std::uint32_t>, PartSettings> parts;  // By object and part.
  std::map<std::uint32_t, std::vector<VolumeSettings>> volumes;           // By object.
  std::vector<PlateSettings> plates;
};

/// `where`: the file and the part, for messages. Throws Error{kFileSyntax}.
ModelSettings parse_model_settings(std::string xml, const std::string& where);

}  // namespace ccslice::cli
