// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/real_meshes.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "core/base/read_file.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/mesh_file.h"
#include "core/models/models.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {

const std::vector<std::string>& real_mesh_names() {
  static const std::vector<std::string> names = {
      "bone_octree.vtk",        "cylinder.ovm",  "ellipsoid.mesh",  "fertility_cmu.vtk",
      "joint_limit_folds.vtk",  "lower_arm.vtk", "mixed_small.vtk", "mountwithhole.vtk",
      "rockerarm_cinolib.mesh", "rod.vtk",       "screw2.mesh"};
  return names;
}

const std::vector<std::string>& small_real_mesh_names() {
  static const std::vector<std::string> names = {"cylinder.ovm", "mixed_small.vtk"};
  return names;
}

const std::vector<std::string>& real_meshes_with_convex_edges() {
  static const std::vector<std::string> names = {"cylinder.ovm",    "joint_limit_folds.vtk", "lower_arm.vtk",
                                                 "mixed_small.vtk", "mountwithhole.vtk",     "rockerarm_cinolib.mesh",
                                                 "rod.vtk"};
  return names;
}

const std::vector<std::string>& sample_names() {
  static const std::vector<std::string> names = {"bracket", "coyote", "engine", "grid", "ring"};
  return names;
}

const std::vector<std::string>& fixture_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all = {"gmsh_plate.msh"};
    const char* made = std::getenv("CCSLICE_TETRAHEDRA");
    std::istringstream paths(made == nullptr ? "" : made);
    for (std::string path; std::getline(paths, path, ':');) all.push_back(path);
    return all;
  }();
  return names;
}

std::optional<ControlMesh> read_real_mesh_ungraded(const std::string& name) {
  if (const SampleModel* sample = find_sample_model(name)) return sample->make();
  const bool fixture = std::ranges::find(fixture_names(), name) != fixture_names().end();
  // A path that isn't relative stays as it is.
  const auto path = std::filesystem::path(fixture ? CCSLICE_TEST_DATA_DIR "/meshes" : CCSLICE_SHARED_MESHES_DIR) / name;
  if (!fixture && !std::filesystem::exists(path)) return std::nullopt;
  return read_mesh(read_file_bytes(path.string(), std::uint64_t{1} << 30)).mesh;
}

std::optional<ControlMesh> read_real_mesh(const std::string& name) {
  std::optional<ControlMesh> mesh = read_real_mesh_ungraded(name);
  if (!mesh || mesh->channel_count() > 0) return mesh;
  Box3 box;
  for (const Vec3& p : mesh->positions) box.extend(p);
  mesh->channel_names = {"x", "y", "z", "radius"};
  for (const Vec3& p : mesh->positions) {
    for (int d = 0; d < 3; ++d) mesh->channel_values.push_back(static_cast<float>(p[d]));
    mesh->channel_values.push_back(static_cast<float>((p - box.center()).norm()));
  }
  return mesh;
}

void scale_to(double longest_mm, ControlMesh& mesh) {
  Box3 box;
  for (const Vec3& p : mesh.positions) box.extend(p);
  const double factor = longest_mm / box.sizes().maxCoeff();
  for (Vec3& p : mesh.positions) p *= factor;
}

std::string case_name(const std::string& mesh_name) {
  std::string result = mesh_name;
  for (char& c : result) {
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  }
  return result;
}

}  // namespace ccslice::oracle
