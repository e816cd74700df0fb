// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/bfr_surface.h"

#include <opensubdiv/bfr/refinerSurfaceFactory.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyRefinerFactory.h>

#include <algorithm>
#include <map>
#include <stdexcept>

namespace ccslice::oracle {
namespace {

using OpenSubdiv::Bfr::Surface;
using Refiner = OpenSubdiv::Far::TopologyRefiner;
using Descriptor = OpenSubdiv::Far::TopologyDescriptor;
using RefinerFactory = OpenSubdiv::Far::TopologyRefinerFactory<Descriptor>;
using SurfaceFactory = OpenSubdiv::Bfr::RefinerSurfaceFactory<>;

constexpr int kApproximationLevel = 10;

/// The boundary as OpenSubdiv wants it, with vertices numbered anew.
struct Polygons {
  std::vector<int> corners_per_face, corners, crease_vertices, corner_vertices;
  std::vector<float> crease_weights, corner_weights;
  std::vector<double> points;
};

Polygons to_polygons(const BruteMesh& mesh, const std::vector<BfrSurface::Face>& faces) {
  Polygons result;
  std::map<std::uint32_t, int> ids;
  for (const BfrSurface::Face& face : faces) {
    result.corners_per_face.push_back(4);
    for (const std::uint32_t v : face.v) {
      const auto [it, added] = ids.try_emplace(v, static_cast<int>(ids.size()));
      result.corners.push_back(it->second);
      if (!added) continue;
      const Vec3 p = mesh.position(v);
      result.points.insert(result.points.end(), {p.x(), p.y(), p.z()});
    }
  }
  const float sharp = OpenSubdiv::Sdc::Crease::SHARPNESS_INFINITE;
  for (const auto& [a, b] : mesh.sharp_edges) {
    result.crease_vertices.insert(result.crease_vertices.end(), {ids.at(a), ids.at(b)});
    result.crease_weights.push_back(sharp);
  }
  for (const std::uint32_t v : mesh.sharp_vertices) {
    result.corner_vertices.push_back(ids.at(v));
    result.corner_weights.push_back(sharp);
  }
  return result;
}

std::unique_ptr<Refiner> make_refiner(const Polygons& polygons) {
  Descriptor descriptor;
  descriptor.numVertices = static_cast<int>(polygons.points.size() / 3);
  descriptor.numFaces = static_cast<int>(polygons.corners_per_face.size());
  descriptor.numVertsPerFace = polygons.corners_per_face.data();
  descriptor.vertIndicesPerFace = polygons.corners.data();
  descriptor.numCreases = static_cast<int>(polygons.crease_weights.size());
  descriptor.creaseVertexIndexPairs = polygons.crease_vertices.data();
  descriptor.creaseWeights = polygons.crease_weights.data();
  descriptor.numCorners = static_cast<int>(polygons.corner_weights.size());
  descriptor.cornerVertexIndices = polygons.corner_vertices.data();
  descriptor.cornerWeights = polygons.corner_weights.data();
  OpenSubdiv::Sdc::Options scheme;
  scheme.SetVtxBoundaryInterpolation(OpenSubdiv::Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
  std::unique_ptr<Refiner> refiner(
      RefinerFactory::Create(descriptor, RefinerFactory::Options(OpenSubdiv::Sdc::SCHEME_CATMARK, scheme)));
  if (!refiner) throw std::runtime_error("OpenSubdiv refuses the boundary");
  return refiner;
}

struct Patch {
  Surface<double> surface;
  std::vector<double> points;
};

}  // namespace

struct BfrSurface::State {
  std::vector<Face> faces;
  Polygons polygons;
  std::unique_ptr<Refiner> refiner;
  std::vector<Patch> patches;
};

BfrSurface::BfrSurface(const BruteMesh& mesh, const BruteTopology& topology) : state_(std::make_unique<State>()) {
  for (const BruteFace& face : topology.faces) {
    if (!face.boundary) continue;
    if (mesh.cells[face.cells[0]].kind != CellKind::kHex) throw std::logic_error("BfrSurface: hexes only");
    state_->faces.push_back({face.cells[0], face.first_local, face.v});
  }
  state_->polygons = to_polygons(mesh, state_->faces);
  state_->refiner = make_refiner(state_->polygons);
  SurfaceFactory::Options options;
  options.SetApproxLevelSmooth(kApproximationLevel).SetApproxLevelSharp(kApproximationLevel);
  const SurfaceFactory factory(*state_->refiner, options);
  for (std::size_t f = 0; f < state_->faces.size(); ++f) {
    Patch& patch = state_->patches.emplace_back();
    if (!factory.InitVertexSurface(static_cast<int>(f), &patch.surface)) throw std::runtime_error("no limit surface");
    patch.points.resize(3 * static_cast<std::size_t>(patch.surface.GetNumPatchPoints()));
    patch.surface.PreparePatchPoints(state_->polygons.points.data(), 3, patch.points.data(), 3);
  }
}

BfrSurface::~BfrSurface() = default;
BfrSurface::BfrSurface(BfrSurface&&) noexcept = default;

const std::vector<BfrSurface::Face>& BfrSurface::faces() const { return state_->faces; }

Vec3 BfrSurface::position(std::uint32_t face, double s, double t) const {
  const double st[2] = {s, t};
  Vec3 p;
  const Patch& patch = state_->patches[face];
  patch.surface.Evaluate(st, patch.points.data(), 3, p.data());
  return p;
}

BfrSurface::Derivatives BfrSurface::derivatives(std::uint32_t face, double s, double t) const {
  const double st[2] = {s, t};
  Derivatives d;
  const Patch& patch = state_->patches[face];
  patch.surface.Evaluate(st, patch.points.data(), 3, d.p.data(), d.s.data(), d.t.data(), d.ss.data(), d.st.data(),
                         d.tt.data());
  return d;
}

Vec3 BfrSurface::uvw(const Face& face, double s, double t) {
  const std::vector<int>& corners = tables(CellKind::kHex).faces[face.local];
  const auto corner = [&](int i) -> Vec3 {
    const int bits = kCornerBits[corners[i]];
    return {double(bits & 1), double(bits >> 1 & 1), double(bits >> 2 & 1)};
  };
  return corner(0) + s * (corner(1) - corner(0)) + t * (corner(3) - corner(0));
}

}  // namespace ccslice::oracle
