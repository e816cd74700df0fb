// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/boundary_surface.h"

#include "core/limit/patch.h"
#include "core/limit/solid_data.h"

namespace ccslice {

namespace {

/// A child's points, from bare positions.
void make_child(const PlanarOperator& op, std::size_t child, const std::vector<PaddedPoint>& ring, PaddedPoint* out) {
  op.stencils.apply(op.rows_of(op.children[child]), ring.front().data(), 4, out->data());
}

PaddedPoint padded(const Vec3& p) { return {p.x(), p.y(), p.z(), 0}; }

Vec3 corner_uvw(std::uint8_t bits) { return {double(bits & 1), double(bits >> 1 & 1), double(bits >> 2 & 1)}; }

/// B-spline -> Bezier.
void finish_patch(BezierPatch& net, PhantomMask phantoms) {
  fill_phantoms(net.b.front().data(), 2, 4, phantoms);
  bspline_to_bezier(net.b.front().data(), 2, 4);
}

/// begin + (end - begin) * fraction, exact for dyadic fractions.
std::uint32_t along(std::uint32_t begin, std::uint32_t end, std::uint32_t fraction) {
  const std::int64_t step = (static_cast<std::int64_t>(end) - begin) * static_cast<std::int64_t>(fraction);
  return static_cast<std::uint32_t>(begin + step / static_cast<std::int64_t>(kSurfaceOne));
}

}  // namespace

std::span<const BoundaryFace> BoundarySurface::faces() const noexcept {
  return std::span(data_->faces).first(data_->boundary_face_count);
}

std::span<const BoundaryFace> BoundarySurface::faces_and_interfaces() const noexcept { return data_->faces; }

IdRange<BoundaryFaceId> BoundarySurface::interface_ids() const noexcept {
  return {BoundaryFaceId{data_->boundary_face_count}, BoundaryFaceId{static_cast<std::uint32_t>(data_->faces.size())}};
}

BezierPatch BoundarySurface::regular_patch(BoundaryFaceId face) const noexcept {
  const SurfaceFaceRing& record = data_->face_rings[face];
  const auto ring = data_->ring(record);
  BezierPatch net;
  for (std::size_t i = 0; i < 16; ++i) net.b[i] = padded(ring[i] == kNone ? Vec3::Zero() : data_->position(ring[i]));
  finish_patch(net, record.phantoms);
  return net;
}

const Box3& BoundarySurface::hull_box(BoundaryFaceId face) const noexcept { return data_->face_hulls[face]; }

void BoundarySurface::irregular_corner(BoundaryFaceId face, IrregularCorner& corner) const {
  const SurfaceFaceRing& record = data_->face_rings[face];
  corner.op = record.op;
  corner.level = 0;
  corner.ring.clear();
  for (const std::uint32_t p : data_->ring(record)) corner.ring.push_back(padded(data_->position(p)));
}

void BoundarySurface::split(IrregularCorner& corner, std::array<BezierPatch, 3>& patches) const {
  const PlanarOperator& op = data_->operators.surfaces()[corner.op];
  for (std::size_t c = 1; c < 4; ++c) {
    make_child(op, c, corner.ring, patches[c - 1].b.data());
    finish_patch(patches[c - 1], op.children[c].phantoms);
  }
  corner.spare.resize(op.children[0].count);
  make_child(op, 0, corner.ring, corner.spare.data());
  corner.ring.swap(corner.spare);
  corner.op = op.children[0].op;
  ++corner.level;
}

Vec3 BoundarySurface::corner_position(const IrregularCorner& corner) const noexcept {
  const auto& limit = data_->operators.surfaces()[corner.op].limit;
  PaddedPoint position = PaddedPoint::Zero();
  for (std::size_t i = 0; i < limit.size(); ++i) position += limit[i] * corner.ring[i];
  return position.head<3>();
}

SurfaceKey BoundarySurface::key(BoundaryFaceId face, std::uint32_t s, std::uint32_t t) const noexcept {
  const BoundaryFace& f = data_->faces[face];
  const bool s_end = s == 0 || s == kSurfaceOne, t_end = t == 0 || t == kSurfaceOne;
  if (s_end && t_end) return f.corners[t == 0 ? (s == 0 ? 0 : 1) : (s == 0 ? 3 : 2)];
  if (!s_end && !t_end) return {SurfaceKey::Kind::kFace, face, s, t};
  // Sides 0 and 1 run with s and t, sides 2 and 3 against them.
  const std::size_t side = t_end ? (t == 0 ? 0 : 2) : (s == 0 ? 3 : 1);
  const std::uint32_t forward = t_end ? s : t;
  const FaceSide& interval = f.sides[side];
  return {SurfaceKey::Kind::kEdge, interval.edge,
          along(interval.t_begin, interval.t_end, side < 2 ? forward : kSurfaceOne - forward), 0};
}

CellParam BoundarySurface::cell_param(BoundaryFaceId face, double s, double t) const noexcept {
  const BoundaryFace& f = data_->faces[face];
  const Vec3 origin = corner_uvw(f.cell_corner[0]);
  return {f.cell, origin + s * (corner_uvw(f.cell_corner[1]) - origin) + t * (corner_uvw(f.cell_corner[3]) - origin)};
}

}  // namespace ccslice
