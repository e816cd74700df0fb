// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A lattice of 7 x 4 x 4 nodes, each joined to its neighbours by struts of one cell: 112 nodes and 272 struts. A node
// is a hexahedron with a core (7 cells), but the eight at the corners of the lattice are plain: 104 * 7 + 8 + 272 =
// 1000.

#include "core/models/model_builder.h"
#include "core/models/models.h"

namespace ccslice {
namespace {

constexpr std::array<int, 3> kNodes = {7, 4, 4};
constexpr double kNodeSize = 0.36;  // Length of a node's edge as a share of the distance between nodes.
constexpr double kCoreShare = 0.5;

using At = std::array<int, 3>;

class StrutLattice {
 public:
  StrutLattice() : builder_("stiffness") { add_vertices(); }

  ControlMesh build() && {
    for (int k = 0; k < kNodes[2]; ++k) {
      for (int j = 0; j < kNodes[1]; ++j) {
        for (int i = 0; i < kNodes[0]; ++i) add_node_and_struts({i, j, k});
      }
    }
    const Box3 limit(Vec3(-0.1768, -0.1768, -0.1768), Vec3(6.1768, 3.1768, 3.1768));
    return std::move(builder_).finish(limit, Vec3(1335 * 0.0423, 357 * 0.0846, 866 * 0.03));
  }

 private:
  /// The corner `bits` of a node.
  static ModelBuilder::Vertex corner(const At& node, int bits) {
    return static_cast<ModelBuilder::Vertex>(8 * (node[0] + kNodes[0] * (node[1] + kNodes[1] * node[2])) + bits);
  }

  /// From soft at one end to stiff at the other.
  static double value_at(double x) { return 0.8 * x / (kNodes[0] - 1); }

  void add_vertices() {
    for (int k = 0; k < kNodes[2]; ++k) {
      for (int j = 0; j < kNodes[1]; ++j) {
        for (int i = 0; i < kNodes[0]; ++i) {
          for (int bits = 0; bits < 8; ++bits) {
            const Vec3 offset(bits & 1, bits >> 1 & 1, bits >> 2);
            builder_.add_vertex(Vec3(i, j, k) + kNodeSize * (offset - Vec3::Constant(0.5)), value_at(i));
          }
        }
      }
    }
  }

  void add_node_and_struts(const At& at) {
    constexpr std::array<int, 8> kBits = {0, 1, 3, 2, 4, 5, 7, 6};
    ModelBuilder::Hex node{};
    for (std::size_t c = 0; c < node.size(); ++c) node[c] = corner(at, kBits[c]);
    bool at_corner = true;
    for (std::size_t d = 0; d < 3; ++d) at_corner = at_corner && (at[d] == 0 || at[d] == kNodes[d] - 1);
    if (at_corner) {
      builder_.add_hex(node);
    } else {
      builder_.add_hex_with_core(node, kCoreShare, value_at(at[0]) + 0.2);
    }
    for (int axis = 0; axis < 3; ++axis) add_strut(at, axis);
  }

  void add_strut(const At& at, int axis) {
    At next = at;
    const auto d = static_cast<std::size_t>(axis);
    if (++next[d] == kNodes[d]) return;
    const int along = 1 << axis, across = 1 << (axis + 1) % 3, up = 1 << (axis + 2) % 3;
    builder_.add_hex({corner(at, along), corner(next, 0), corner(next, across), corner(at, along | across),
                      corner(at, along | up), corner(next, up), corner(next, across | up),
                      corner(at, along | across | up)});
  }

  ModelBuilder builder_;
};

}  // namespace

ControlMesh make_grid() { return StrutLattice().build(); }

}  // namespace ccslice
