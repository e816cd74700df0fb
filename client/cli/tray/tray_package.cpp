// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/tray_package.h"

#include <algorithm>
#include <map>
#include <utility>

#include "client/cli/tray/model_settings.h"
#include "client/cli/tray/package_model.h"
#include "client/cli/tray/zip_reader.h"
#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

constexpr const char* kRelations = "_rels/.rels";
constexpr const char* kModelRelation = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
constexpr const char* kUsualModel = "3D/3dmodel.model";
constexpr std::size_t kMostLevels = 32;       // Of components in components.
constexpr std::size_t kMostVisits = 1 << 20;  // Of objects on the way to meshes.

class PackageReader {
 public:
  PackageReader(const std::filesystem::path& path, std::uint64_t max_bytes)
      : path_(path.string()), zip_(path, max_bytes) {}

  TrayPackage read() {
    root_ = start_part();
    settings_ = settings();
    TrayPackage package;
    for (const PlateSettings& plate : settings_.plates) package.plates.push_back(plate.plate);
    const PackageModel& model = part(root_, path_);
    if (model.items.empty()) {
      fail(ErrorCode::kFileUnsupported,
           "nothing lies on its plate: there are no build items; place the parts and save "
           "it as a project");
    }
    std::map<std::uint32_t, std::uint32_t> copies;  // By object: of how many there are items so far.
    for (const ModelItem& item : model.items) add_item(item, copies[item.object.object_id]++, package);
    return package;
  }

 private:
  struct Ref {
    std::string part;
    std::uint32_t id = 0;
    bool operator==(const Ref&) const = default;
  };

  /// The part that the package starts with [3MF, 2.1].
  std::string start_part() {
    if (zip_.has(kRelations)) {
      const std::string where = path_ + ": " + kRelations;
      std::string xml = zip_.read(kRelations);
      pugi::xml_document document;
      load_xml(xml, where, document);
      for (const pugi::xml_node node : document.child("Relationships").children("Relationship")) {
        if (node.attribute("Type").value() == std::string_view(kModelRelation)) {
          return package_entry(node.attribute("Target").value(), where);
        }
      }
    }
    if (zip_.has(kUsualModel)) return kUsualModel;
    fail(ErrorCode::kFileSyntax, "it has no 3D model: neither " + std::string(kRelations) +
                                     " names one, nor is there " + kUsualModel + "; save the plate as a 3MF project");
  }

  /// [Bambu], [Prusa].
  ModelSettings settings() {
    for (const char* const name : {"Metadata/model_settings.config", "Metadata/Slic3r_PE_model.config"}) {
      if (zip_.has(name)) return parse_model_settings(zip_.read(name), path_ + ": " + name);
    }
    return {};
  }

  const PackageModel& part(const std::string& name, const std::string& asked_by) {
    if (const auto known = parts_.find(name); known != parts_.end()) return known->second;
    if (!zip_.has(name)) {
      throw Error(ErrorCode::kFileSyntax,
                  asked_by + ": the package has no part " + echoed(name, 2 * kMaxEchoBytes) + "; save the file again");
    }
    return parts_.emplace(name, parse_package_model(zip_.read(name), path_ + ": " + name)).first->second;
  }

  std::optional<std::uint32_t> plate_of(std::uint32_t object, std::uint32_t copy) const {
    if (settings_.plates.empty()) return std::nullopt;
    for (const PlateSettings& plate : settings_.plates) {
      if (plate.instances.contains({object, copy})) return plate.plate.number;
    }
    return 0;
  }

  std::string name_of(std::uint32_t object) const {
    const auto found = settings_.names.find(object);
    return found == settings_.names.end() ? "" : found->second;
  }

  void add_item(const ModelItem& item, std::uint32_t copy, TrayPackage& package) {
    item_ = item.object.object_id;
    copy_ = copy;
    printable_ = item.printable;
    item_name_ = name_of(item_);
    trail_.clear();
    walk(item.object, root_, Placement::Identity(), package);
  }

  std::string label(const std::string& name) const {
    return "object " + std::to_string(item_) + (name.empty() ? "" : " '" + echoed(name) + "'") +
           (copy_ > 0 ? " (copy " + std::to_string(copy_ + 1) + ")" : "");
  }

  void walk(const ModelComponent& component, const std::string& from, const Placement& outer, TrayPackage& package) {
    const Ref ref{component.path.empty() ? from : package_entry(component.path, path_ + ": " + label(item_name_)),
                  component.object_id};
    enter(ref);
    const PackageModel& model = part(ref.part, path_ + ": " + label(item_name_));
    const auto found = model.objects.find(ref.id);
    if (found == model.objects.end()) {
      fail(ErrorCode::kFileSyntax, label(item_name_) + " refers to object " + std::to_string(ref.id) + ", which " +
                                       echoed(ref.part) + " doesn't have; save the file again");
    }
    const ModelObject& object = found->second;
    if (item_name_.empty()) item_name_ = object.name;
    const Placement placement = outer * component.transform;
    if (object.points) add_instances(ref, object, placement, package);
    for (const ModelComponent& inner : object.components) walk(inner, ref.part, placement, package);
    trail_.pop_back();
  }

  /// Refuses circles, and what is nested or branches without end.
  void enter(const Ref& ref) {
    if (std::ranges::find(trail_, ref) != trail_.end()) {
      fail(ErrorCode::kFileSyntax, label(item_name_) + " has components in a circle: object " + std::to_string(ref.id) +
                                       " is made of itself; save the file again");
    }
    if (trail_.size() == kMostLevels) {
      fail(ErrorCode::kFileUnsupported, label(item_name_) + " has components in components, more than " +
                                            std::to_string(kMostLevels) + " levels deep; ungroup them");
    }
    if (++visits_ > kMostVisits) {
      fail(ErrorCode::kFileUnsupported, label(item_name_) + " has components in components that are more than " +
                                            std::to_string(kMostVisits) +
                                            " in all; ungroup them, or save fewer copies");
    }
    trail_.push_back(ref);
  }

  /// An object's mesh, or each of the volumes that it is of.
  void add_instances(const Ref& ref, const ModelObject& object, const Placement& placement, TrayPackage& package) {
    const auto volumes = settings_.volumes.find(ref.id);
    if (volumes == settings_.volumes.end() || volumes->second.size() < 2) {
      const auto settings = settings_.parts.find({item_, ref.id});
      return add_instance(object.points, settings == settings_.parts.end() ? PartSettings() : settings->second, ref,
                          object, placement, package);
    }
    std::vector<TrayPoints>& points = volume_points_[ref.id];
    for (std::size_t v = points.size(); v < volumes->second.size(); ++v) {
      points.push_back(points_of_volume(object, volumes->second[v]));
    }
    for (std::size_t v = 0; v < points.size(); ++v) {
      const VolumeSettings& volume = volumes->second[v];
      add_instance(points[v], {volume.name, volume.type == "ModelPart" ? "" : volume.type}, ref, object, placement,
                   package);
    }
  }

  TrayPoints points_of_volume(const ModelObject& object, const VolumeSettings& volume) const {
    std::uint32_t first = 0xffffffff, last = 0;
    for (std::size_t t = volume.first_triangle; t <= volume.last_triangle && t < object.triangles.size(); ++t) {
      for (const std::uint32_t corner : object.triangles[t]) {
        first = std::min(first, corner);
        last = std::max(last, corner);
      }
    }
    if (first > last || last >= object.points->size()) {
      fail(ErrorCode::kFileSyntax, label(item_name_) + " has a volume '" + echoed(volume.name) +
                                       "' of triangles or vertices that its mesh doesn't have; save the file again");
    }
    return std::make_shared<std::vector<Vec3>>(object.points->begin() + first, object.points->begin() + last + 1);
  }

  void add_instance(const TrayPoints& points, const PartSettings& said, const Ref& ref, const ModelObject& object,
                    const Placement& placement, TrayPackage& package) {
    if (package.instances.size() == kMostTrayInstances) {
      fail(ErrorCode::kFileUnsupported, "it has more than " + std::to_string(kMostTrayInstances) +
                                            " objects with their copies, and a job takes 4096; save fewer");
    }
    TrayInstance instance;
    instance.points = points;
    instance.placement = placement;
    for (const std::string& name : {said.name, object.name, name_of(ref.id), item_name_}) {
      if (instance.name.empty()) instance.name = name;
    }
    instance.label = label(instance.name);
    instance.printable = printable_;
    if (said.subtype != "normal_part") instance.aid = said.subtype;
    if (instance.aid.empty() && object.type != "model") instance.aid = object.type;
    instance.plate = plate_of(item_, copy_);
    package.instances.push_back(std::move(instance));
  }

  [[noreturn]] void fail(ErrorCode code, const std::string& what) const { throw Error(code, path_ + ": " + what); }

  const std::string path_;
  ZipReader zip_;
  std::string root_;
  ModelSettings settings_;
  std::map<std::string, PackageModel> parts_;
  std::map<std::uint32_t, std::vector<TrayPoints>>
      volume_points_;  // By object, of the part that the package starts with.
  // The build item that is walked through:
  std::uint32_t item_ = 0, copy_ = 0;
  bool printable_ = true;
  std::string item_name_;
  std::vector<Ref> trail_;
  std::size_t visits_ = 0;
};

}  // namespace

TrayPackage read_tray_package(const std::filesystem::path& path, std::uint64_t max_bytes) {
  return PackageReader(path, max_bytes).read();
}

}  // namespace ccslice::cli
