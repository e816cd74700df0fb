// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The boundary of a mesh of hexes as OpenSubdiv sees it: the Catmull-Clark limit surface of the boundary faces,
// evaluated by OpenSubdiv's Bfr with both approximation levels at 10 (its defaults are 1e-3 off on a cube). Sharp edges
// are infinitely sharp creases, tagged vertices infinitely sharp corners. Good to about 1e-7 at parameters of 2^-10 and
// more from an irregular vertex.

#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "tests/support/brute_force.h"

namespace ccslice::oracle {

class BfrSurface {
 public:
  /// REQUIRES: hexes only (refine a mesh with tets or wedges once).
  BfrSurface(const BruteMesh& mesh, const BruteTopology& topology);
  ~BfrSurface();
  BfrSurface(BfrSurface&&) noexcept;

  /// One boundary face: corners at (0,0), (1,0), (1,1), (0,1), counter-clockwise seen from outside.
  struct Face {
    std::uint32_t cell = 0;  // In the mesh.
    int local = 0;           // Local face of that cell: u=0, u=1, v=0, v=1, w=0, w=1.
    std::array<std::uint32_t, 4> v{};
  };
  const std::vector<Face>& faces() const;

  Vec3 position(std::uint32_t face, double s, double t) const;
  struct Derivatives {
    Vec3 p, s, t, ss, st, tt;
  };
  Derivatives derivatives(std::uint32_t face, double s, double t) const;

  /// The (u,v,w) of the face's cell at (s,t).
  static Vec3 uvw(const Face& face, double s, double t);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Finds the nearest point of a BfrSurface: dense samples, then Newton from the nearest ones.
class NearestOnSurface {
 public:
  /// (samples + 1)^2 samples a face.
  NearestOnSurface(const BfrSurface& surface, int samples);
  ~NearestOnSurface();

  double distance(const Vec3& point) const;

 private:
  struct Grid;
  std::unique_ptr<Grid> grid_;
};

}  // namespace ccslice::oracle
