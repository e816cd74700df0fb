// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/level.h"

#include <algorithm>
#include <utility>

namespace ccslice {
namespace {

std::uint32_t middle_of(const FaceSide& root) {
  return static_cast<std::uint32_t>((std::uint64_t{root.t_begin} + root.t_end) / 2);
}

}  // namespace

VertexId Level::vertex_of_point(std::uint32_t point) const {
  const VertexId number{point - names->point_base};
  if (numbers.empty()) return number;
  return VertexId{static_cast<std::uint32_t>(std::ranges::lower_bound(numbers, number) - numbers.begin())};
}

SurfaceKey Level::vertex_key(VertexId vertex) const {
  const VertexId here = number(vertex);
  if (names->parent == nullptr) return {SurfaceKey::Kind::kVertex, originals.empty() ? here : originals[here], 0, 0};
  const ChildOrigins& origins = *names->origins;
  if (here < origins.begins[0]) return names->parent->vertex_key(VertexId{origins.origin[here]});
  if (here < origins.begins[1]) {
    const FaceSide root = names->parent->root_of(EdgeId{origins.origin[here]});
    return {SurfaceKey::Kind::kEdge, root.edge, middle_of(root), 0};
  }
  return {SurfaceKey::Kind::kVertex, names->first_vertex + here, 0, 0};
}

FaceSide Level::root_of(EdgeId edge) const {
  const auto [a, b] = complex.edge_vertices(edge);
  return side(a, b);
}

FaceSide Level::side(VertexId from, VertexId to) const {
  FaceSide found;
  if (names->parent != nullptr) {
    found = side_of_child(std::min(from, to), std::max(from, to));
    if (from > to) std::swap(found.t_begin, found.t_end);
    return found;
  }
  const EdgeId edge = complex.find_edge(from, to);
  found = edge_roots.empty() ? FaceSide{edge, 0, kSurfaceOne} : edge_roots[edge];
  if (complex.edge_vertices(edge)[0] != from) std::swap(found.t_begin, found.t_end);
  return found;
}

/// Half an edge of the parent, from its end to its middle, or else from there to the middle of a face.
FaceSide Level::side_of_child(VertexId low, VertexId high) const {
  const ChildOrigins& origins = *names->origins;
  const VertexId a = number(low), b = number(high);
  const CellComplex& parent = names->parent->complex;
  if (b < origins.begins[1]) {
    const EdgeId whole{origins.origin[b]};
    const FaceSide root = names->parent->root_of(whole);
    const bool from_begin = parent.edge_vertices(whole)[0] == origins.origin[a];
    return {root.edge, from_begin ? root.t_begin : root.t_end, middle_of(root)};
  }
  const FaceId face{origins.origin[b]};
  const auto ring = parent.face_vertices(face);
  const auto [begin, end] = parent.edge_vertices(EdgeId{origins.origin[a]});
  const auto first = static_cast<std::uint32_t>(std::ranges::find(ring, begin) - ring.begin());
  const bool forward = ring[(first + 1) % ring.size()] == end;
  const auto side =
      forward ? first : (first + static_cast<std::uint32_t>(ring.size()) - 1) % static_cast<std::uint32_t>(ring.size());
  return {names->first_edge + 4 * face + side, 0, kSurfaceOne};
}

/// A child of a face has the face's point.
std::uint8_t Level::beyond(FaceId face) const {
  if (names->parent == nullptr) return regions_beyond.empty() ? kNoCellRegion : regions_beyond[face];
  const ChildOrigins& origins = *names->origins;
  for (const VertexId v : complex.face_vertices(face)) {
    const VertexId here = number(v);
    if (here >= origins.begins[1] && here < origins.begins[2]) {
      return names->parent->beyond(FaceId{origins.origin[here]});
    }
  }
  return kNoCellRegion;
}

}  // namespace ccslice
