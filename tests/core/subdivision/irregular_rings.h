// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The rings that operators are made of.

#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/mesh/cell_complex.h"
#include "core/mesh/control_mesh.h"
#include "core/subdivision/classify.h"
#include "core/subdivision/frame.h"
#include "core/subdivision/refine.h"
#include "core/subdivision/ring.h"
#include "core/subdivision/surface_ring.h"

namespace ccslice {

/// All cells of what results are limit-ready.
inline CellComplex refined_twice(const ControlMesh& mesh) {
  CellComplex complex = make_cell_complex(mesh);
  for (int level = 0; level < 2; ++level) complex = refine(complex, complex.cells().to_vector()).complex;
  return complex;
}

/// The irregular rings of a complex whose cells are limit-ready.
struct IrregularRings {
  struct Vertex {
    VertexStar star;
    VertexRing ring;
    CellId cell;
    Frame frame;
  };

  explicit IrregularRings(const CellComplex& complex) {
    Classifier classifier(complex);
    RingWalker walker(complex);
    SurfaceWalker surface(complex);
    for (const CellId c : complex.cells()) {
      const auto found = classifier.classify(c);
      if (found->cell_class == CellClass::kLine) {
        const auto along = static_cast<std::uint8_t>(found->anchor / 4);
        lines.push_back(walker.line(c, frame_at(cell_tables::kHexEdges[found->anchor][0], along)));
      } else if (found->cell_class == CellClass::kVertex) {
        const Frame frame = frame_at(found->anchor, 0);
        VertexStar star = walker.star(c, frame);
        VertexRing ring = walker.vertex(c, frame, star.points);
        vertices.push_back({std::move(star), std::move(ring), c, frame});
      }
    }
    for (const FaceId f : complex.faces()) {
      if (!complex.face_on_boundary(f)) continue;
      SurfaceRing ring = surface.walk(f);
      if (!ring.regular) surfaces.push_back(std::move(ring));
    }
  }

  std::vector<LineRing> lines;
  std::vector<Vertex> vertices;
  std::vector<SurfaceRing> surfaces;
};

}  // namespace ccslice
