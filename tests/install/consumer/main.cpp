// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Somebody else's program: uploads a mesh file, slices it, and prints how many voxels are inside.
//
//   consumer ADDRESS MESH.ccmesh PITCH_MM

#include <client/client.h>

#include <cstdint>
#include <exception>
#include <fstream>
#include <iostream>
#include <iterator>
#include <memory>
#include <string>

int main(int argc, char** argv) {
  if (argc != 4) return 2;
  namespace client = ccslice::client;
  namespace v1 = ccslice::v1;
  try {
    std::ifstream file(argv[2], std::ios::binary);
    v1::ControlMesh control_mesh;
    if (!control_mesh.ParseFromIstream(&file)) return 3;
    client::Client client({.address = argv[1]});
    const auto mesh = std::make_shared<const client::MeshBytes>(control_mesh);
    client.ensure_uploaded(mesh);
    v1::PlanSlicesRequest plan;
    plan.mutable_job()->add_parts()->set_mesh_id(mesh->id());
    v1::VoxelPitch& pitch = *plan.mutable_job()->mutable_grid()->mutable_pitch();
    pitch.set_x_mm(std::stod(argv[3]));
    pitch.set_y_mm(pitch.x_mm());
    pitch.set_z_mm(pitch.x_mm());
    plan.mutable_job()->add_planes()->mutable_occupancy();
    plan.mutable_job()->mutable_planes(0)->set_sample_type(v1::SAMPLE_TYPE_BIT);
    plan.mutable_job()->mutable_planes(0)->set_encoding(v1::PLANE_ENCODING_RAW_ZSTD);
    v1::SliceRangeRequest request;
    request.mutable_job()->add_parts()->set_mesh_id(plan.job().parts(0).mesh_id());
    *request.mutable_job()->mutable_grid() = plan.job().grid();
    *request.mutable_job()->mutable_planes() = plan.job().planes();
    request.set_layer_count(client.plan(plan).layer_count());
    std::uint64_t voxels = 0;
    client.slice(request,
                 [&](const v1::SliceHeader&, const client::Layer& layer) { voxels += layer.end.voxel_count(); });
    std::cout << voxels << "\n";
    return 0;
  } catch (const std::exception& exception) {
    std::cerr << exception.what() << "\n";
    return 1;
  }
}
