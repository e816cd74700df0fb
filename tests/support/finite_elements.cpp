// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/finite_elements.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "core/mesh_import/mid_nodes.h"

namespace ccslice::oracle {
namespace {

constexpr double kHexCorner[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                     {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
constexpr double kHexEdge[12][3] = {{0, -1, -1}, {1, 0, -1}, {0, 1, -1},  {-1, 0, -1}, {0, -1, 1}, {1, 0, 1},
                                    {0, 1, 1},   {-1, 0, 1}, {-1, -1, 0}, {1, -1, 0},  {1, 1, 0},  {-1, 1, 0}};
constexpr double kHexFace[7][3] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}, {0, 0, 0}};

/// The quadratic polynomial that is 1 at one of -1, 0, 1 and 0 at the others.
double lagrange(double at, double x) {
  if (at == 0) return 1 - x * x;
  return 0.5 * x * (x + at);
}

std::vector<double> hex_functions(std::size_t nodes, const Vec3& x) {
  std::vector<double> n;
  if (nodes == 27) {
    const auto product = [&](const double(&at)[3]) {
      return lagrange(at[0], x[0]) * lagrange(at[1], x[1]) * lagrange(at[2], x[2]);
    };
    for (const auto& at : kHexCorner) n.push_back(product(at));
    for (const auto& at : kHexEdge) n.push_back(product(at));
    for (const auto& at : kHexFace) n.push_back(product(at));
    return n;
  }
  for (const auto& [a, b, c] : kHexCorner) {
    const double linear = 0.125 * (1 + a * x[0]) * (1 + b * x[1]) * (1 + c * x[2]);
    n.push_back(nodes == 8 ? linear : linear * (a * x[0] + b * x[1] + c * x[2] - 2));
  }
  if (nodes == 8) return n;
  for (const auto& at : kHexEdge) {
    double product = 0.25;
    for (int axis = 0; axis < 3; ++axis) product *= at[axis] == 0 ? 1 - x[axis] * x[axis] : 1 + at[axis] * x[axis];
    n.push_back(product);
  }
  return n;
}

std::vector<double> tet_functions(std::size_t nodes, const Vec3& x) {
  const std::array<double, 4> l = {1 - x[0] - x[1] - x[2], x[0], x[1], x[2]};
  if (nodes == 4) return {l.begin(), l.end()};
  std::vector<double> n;
  for (const double share : l) n.push_back((2 * share - 1) * share);
  for (const auto& [i, j] : {std::array{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}}) {
    n.push_back(4 * l[static_cast<std::size_t>(i)] * l[static_cast<std::size_t>(j)]);
  }
  return n;
}

std::vector<double> wedge_functions(std::size_t nodes, const Vec3& x) {
  const std::array<double, 3> l = {1 - x[0] - x[1], x[0], x[1]};
  const double t = x[2];
  std::vector<double> n;
  if (nodes == 6) {
    for (const double end : {-1.0, 1.0}) {
      for (const double share : l) n.push_back(0.5 * share * (1 + end * t));
    }
    return n;
  }
  const auto next = [&](std::size_t i) { return l[(i + 1) % 3]; };
  for (const double end : {-1.0, 1.0}) {
    for (const double share : l) {
      n.push_back(nodes == 18 ? share * (2 * share - 1) * lagrange(end, t)
                              : 0.5 * share * ((2 * share - 1) * (1 + end * t) - (1 - t * t)));
    }
  }
  for (const double end : {-1.0, 1.0}) {
    for (std::size_t i = 0; i < 3; ++i) {
      n.push_back(nodes == 18 ? 4 * l[i] * next(i) * lagrange(end, t) : 2 * l[i] * next(i) * (1 + end * t));
    }
  }
  for (const double share : l) n.push_back(nodes == 18 ? share * (2 * share - 1) * (1 - t * t) : share * (1 - t * t));
  if (nodes == 18) {
    for (std::size_t i = 0; i < 3; ++i) n.push_back(4 * l[i] * next(i) * (1 - t * t));
  }
  return n;
}

std::vector<double> functions(CellKind kind, std::size_t nodes, const Vec3& natural) {
  if (kind == CellKind::kHex) return hex_functions(nodes, natural);
  return kind == CellKind::kTet ? tet_functions(nodes, natural) : wedge_functions(nodes, natural);
}

template <typename Key>
std::size_t place_of(const std::vector<Key>& keys, Key key) {
  std::ranges::sort(key);
  const auto found = std::ranges::find(keys, key);
  return found == keys.end() ? keys.size() : static_cast<std::size_t>(found - keys.begin());
}

/// Points and weights of Gauss over 0..1.
constexpr double kGauss[4][2] = {{0.06943184420297371, 0.17392742256872693},
                                 {0.33000947820757187, 0.32607257743127307},
                                 {0.6699905217924281, 0.32607257743127307},
                                 {0.9305681557970263, 0.17392742256872693}};

/// How far outside of a cell natural coordinates may be.
constexpr double kRounding = 1e-9;

double least_inside(CellKind kind, const Vec3& x) {
  if (kind == CellKind::kHex) return 1 - x.cwiseAbs().maxCoeff();
  if (kind == CellKind::kTet) return std::min(x.minCoeff(), 1 - x.sum());
  return std::min({x[0], x[1], 1 - x[0] - x[1], 1 - std::abs(x[2])});
}

}  // namespace

FiniteElements::FiniteElements(const ControlMesh& mesh) : mesh_(mesh), dimension_(3 + mesh.channel_count()) {
  const std::size_t channels = mesh.channel_count();
  const MidNodes& mid = mesh.mid_nodes;
  std::size_t begin = 0;
  for (std::uint32_t cell = 0; cell < mesh.cell_count(); ++cell) {
    const CellKind kind = mesh.cell_kinds[cell];
    const auto corners = std::span(mesh.cell_vertices).subspan(begin, static_cast<std::size_t>(corner_count(kind)));
    begin += corners.size();
    std::vector<double>& values = nodes_.emplace_back();
    const auto add = [&](const Vec3& position, const float* of_channels) {
      values.insert(values.end(), position.begin(), position.end());
      values.insert(values.end(), of_channels, of_channels + channels);
    };
    const auto add_node = [&](std::size_t node) { add(mid.positions[node], mid.values.data() + node * channels); };
    for (const std::uint32_t v : corners) add(mesh.positions[v], mesh.channel_values.data() + v * channels);
    if (mid.empty()) continue;
    for (const auto& [a, b] : mid_edges(kind)) {
      const std::size_t node = place_of(mid.edges, {corners[a], corners[b]});
      if (node == mid.edges.size()) throw std::logic_error("an edge without a node");
      add_node(node);
    }
    if (mid.faces.empty()) continue;
    for (const auto& [a, b, c, d] : mid_faces(kind)) {
      add_node(mid.edges.size() + place_of(mid.faces, {corners[a], corners[b], corners[c], corners[d]}));
    }
    if (kind != CellKind::kHex) continue;
    const auto found = std::ranges::find(mid.cells, cell);
    add_node(mid.edges.size() + mid.faces.size() + static_cast<std::size_t>(found - mid.cells.begin()));
  }
}

std::vector<double> FiniteElements::value(std::uint32_t cell, const Vec3& natural) const {
  const std::vector<double>& nodes = nodes_[cell];
  const std::vector<double> weights = functions(mesh_.cell_kinds[cell], nodes.size() / dimension_, natural);
  std::vector<double> sum(dimension_, 0.0);
  for (std::size_t n = 0; n < weights.size(); ++n) {
    for (std::size_t d = 0; d < dimension_; ++d) sum[d] += weights[n] * nodes[n * dimension_ + d];
  }
  return sum;
}

Vec3 FiniteElements::position(std::uint32_t cell, const Vec3& natural) const {
  return Vec3::Map(value(cell, natural).data());
}

/// By central differences, which are exact for polynomials of degree 2 but for rounding.
Mat3 FiniteElements::jacobian(std::uint32_t cell, const Vec3& natural) const {
  constexpr double kStep = 0.125;
  Mat3 jacobian;
  for (int axis = 0; axis < 3; ++axis) {
    const Vec3 step = kStep * Vec3::Unit(axis);
    jacobian.col(axis) = (position(cell, natural + step) - position(cell, natural - step)) / (2 * kStep);
  }
  return jacobian;
}

std::optional<Vec3> FiniteElements::find(std::uint32_t cell, const Vec3& point) const {
  const CellKind kind = mesh_.cell_kinds[cell];
  Vec3 at = kind == CellKind::kHex   ? Vec3::Zero()
            : kind == CellKind::kTet ? Vec3(Vec3::Constant(0.25))
                                     : Vec3(1.0 / 3, 1.0 / 3, 0);
  for (int step = 0; step < 40; ++step) {
    const Vec3 move = jacobian(cell, at).inverse() * (point - position(cell, at));
    if (!move.allFinite()) return std::nullopt;
    at += move / std::max(1.0, move.norm());
    if (at.norm() > 4) return std::nullopt;
  }
  if (!((position(cell, at) - point).norm() < 1e-9) || least_inside(kind, at) < -kRounding) return std::nullopt;
  return at;
}

double FiniteElements::volume_mm3(std::uint32_t cell) const {
  const CellKind kind = mesh_.cell_kinds[cell];
  double volume = 0;
  for (const auto& [u, wu] : kGauss) {
    for (const auto& [v, wv] : kGauss) {
      for (const auto& [w, ww] : kGauss) {
        // A square becomes a triangle, and a cube a tetrahedron, by drawing sides together.
        Vec3 at(2 * u - 1, 2 * v - 1, 2 * w - 1);
        double factor = 8;
        if (kind == CellKind::kWedge) at = Vec3(u * (1 - v), v, 2 * w - 1), factor = 2 * (1 - v);
        if (kind == CellKind::kTet) {
          at = Vec3(u * (1 - v) * (1 - w), v * (1 - w), w);
          factor = (1 - v) * (1 - w) * (1 - w);
        }
        volume += wu * wv * ww * factor * jacobian(cell, at).determinant();
      }
    }
  }
  return volume;
}

Vec3 FiniteElements::random_place(std::uint32_t cell, std::mt19937& random) const {
  std::uniform_real_distribution<double> unit(0, 1);
  const CellKind kind = mesh_.cell_kinds[cell];
  while (true) {
    const double u = unit(random), v = unit(random), w = unit(random);
    const Vec3 at = kind == CellKind::kHex   ? Vec3(2 * u - 1, 2 * v - 1, 2 * w - 1)
                    : kind == CellKind::kTet ? Vec3(u, v, w)
                                             : Vec3(u, v, 2 * w - 1);
    if (least_inside(kind, at) >= 0) return at;
  }
}

void add_random_mid_nodes(double share, bool of_faces, std::uint32_t seed, ControlMesh& mesh) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  const std::size_t channels = mesh.channel_count();
  MidNodeList list(channels);
  std::vector<float> values(channels);
  const auto place = [&](std::span<const std::uint32_t> vertices) {
    Vec3 middle = Vec3::Zero();
    std::ranges::fill(values, 0.0f);
    for (const std::uint32_t v : vertices) {
      middle += mesh.positions[v] / static_cast<double>(vertices.size());
      for (std::size_t c = 0; c < channels; ++c) {
        values[c] += mesh.channel_values[v * channels + c] / static_cast<float>(vertices.size());
      }
    }
    const double size = (mesh.positions[vertices[0]] - mesh.positions[vertices[1]]).norm();
    for (float& value : values) value += static_cast<float>(0.1 * unit(random));
    return Vec3(middle + share * size * Vec3(unit(random), unit(random), unit(random)));
  };
  std::size_t begin = 0;
  for (std::uint32_t cell = 0; cell < mesh.cell_count(); ++cell) {
    const CellKind kind = mesh.cell_kinds[cell];
    const auto corners = std::span(mesh.cell_vertices).subspan(begin, static_cast<std::size_t>(corner_count(kind)));
    begin += corners.size();
    for (const auto& [a, b] : mid_edges(kind)) {
      const std::array<std::uint32_t, 2> edge = {corners[a], corners[b]};
      const Vec3 at = place(edge);
      list.add_edge(edge, {at, values});
    }
    if (!of_faces) continue;
    for (const auto& [a, b, c, d] : mid_faces(kind)) {
      const std::array<std::uint32_t, 4> face = {corners[a], corners[b], corners[c], corners[d]};
      const Vec3 at = place(face);
      list.add_face(face, {at, values});
    }
    if (kind != CellKind::kHex) continue;
    const Vec3 at = place(corners);
    list.add_cell(cell, {at, values});
  }
  mesh.mid_nodes = list.finish().nodes;
}

}  // namespace ccslice::oracle
