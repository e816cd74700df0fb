// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/bezier_nodes.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <vector>

#include "core/base/contains.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh_import/mid_nodes.h"
#include "core/mesh_import/used_vertices.h"

namespace ccslice {
namespace {

class NodeMaker {
 public:
  NodeMaker(std::span<const std::size_t> places, MeshFile& file)
      : file_(file), control_(file.mesh.positions), control_values_(file.mesh.channel_values) {
    taken_ = used_vertices(file.mesh);
    std::vector<bool> bezier(file.second_order.cells.size());
    for (const std::size_t place : places) bezier[place] = true;
    for (std::size_t place = 0; place < bezier.size(); ++place) {
      if (bezier[place]) continue;
      for (const std::uint32_t node : nodes_of(place)) {
        if (node != kNone) taken_[node] = true;
      }
    }
    made_.resize(taken_.size());
  }

  void convert(std::size_t place, CellKind kind, std::span<const std::uint32_t> corners) {
    const std::span<std::uint32_t> nodes = nodes_of(place);
    const std::vector<std::uint32_t> control(nodes.begin(), nodes.end());
    const auto edges = mid_edges(kind);
    const auto faces = mid_faces(kind);
    for (std::size_t i = 0; i < edges.size(); ++i) {
      weigh(corners[edges[i][0]], 0.25);
      weigh(corners[edges[i][1]], 0.25);
      nodes[i] = node_for(control[i], 0.5);
    }
    if (control.size() == edges.size()) return;
    for (std::size_t i = 0; i < faces.size(); ++i) {
      for (const std::uint8_t corner : faces[i]) weigh(corners[corner], 1.0 / 16);
      for (std::size_t edge = 0; edge < edges.size(); ++edge) {
        const bool on_face = contains(faces[i], edges[edge][0]) && contains(faces[i], edges[edge][1]);
        if (on_face) weigh(control[edge], 1.0 / 8);
      }
      nodes[edges.size() + i] = node_for(control[edges.size() + i], 0.25);
    }
    if (kind != CellKind::kHex) return;
    for (const std::uint32_t corner : corners) weigh(corner, 1.0 / 64);
    for (std::size_t i = 0; i < edges.size(); ++i) weigh(control[i], 1.0 / 32);
    for (std::size_t i = 0; i < faces.size(); ++i) weigh(control[edges.size() + i], 1.0 / 16);
    nodes.back() = node_for(control.back(), 1.0 / 8);
  }

 private:
  struct Term {
    std::array<std::uint64_t, 3> key;  // The position's bits: a sum has the same order in every cell.
    std::uint32_t point;
    double weight;
  };

  std::span<std::uint32_t> nodes_of(std::size_t place) {
    SecondOrderCells& curved = file_.second_order;
    const std::uint64_t begin = curved.first_nodes[place];
    const std::uint64_t end = place + 1 < curved.cells.size() ? curved.first_nodes[place + 1] : curved.nodes.size();
    return std::span(curved.nodes).subspan(begin, end - begin);
  }

  void weigh(std::uint32_t point, double weight) {
    Term& term = terms_.emplace_back(Term{{}, point, weight});
    for (std::size_t axis = 0; axis < 3; ++axis) {
      term.key[axis] = std::bit_cast<std::uint64_t>(control_[point][static_cast<Eigen::Index>(axis)]);
    }
  }

  /// The vertex that has the weighted sum: the control point's own, or a new one if others need that.
  std::uint32_t node_for(std::uint32_t point, double weight) {
    weigh(point, weight);
    std::ranges::sort(terms_, {}, &Term::key);
    ControlMesh& mesh = file_.mesh;
    const std::size_t channels = mesh.channel_count();
    Vec3 position = Vec3::Zero();
    std::vector<float> values(channels);
    for (const Term& term : terms_) position += term.weight * control_[term.point];
    for (std::size_t channel = 0; channel < channels; ++channel) {
      double value = 0;
      for (const Term& term : terms_) value += term.weight * control_values_[term.point * channels + channel];
      values[channel] = static_cast<float>(value);
    }
    terms_.clear();
    const bool is_made = made_[point] && mesh.positions[point] == position;
    if (is_made) return point;
    if (taken_[point]) {
      mesh.positions.push_back(position);
      mesh.channel_values.insert(mesh.channel_values.end(), values.begin(), values.end());
      if (!file_.numbers.vertices.empty()) file_.numbers.vertices.push_back(file_.numbers.vertices[point]);
      return static_cast<std::uint32_t>(mesh.positions.size() - 1);
    }
    taken_[point] = made_[point] = true;
    mesh.positions[point] = position;
    std::ranges::copy(values, mesh.channel_values.begin() + static_cast<std::ptrdiff_t>(point * channels));
    return point;
  }

  MeshFile& file_;
  const std::vector<Vec3> control_;
  const std::vector<float> control_values_;
  std::vector<bool> taken_, made_;  // By control point: whether its vertex is needed as it is; or has become a node.
  std::vector<Term> terms_;
};

}  // namespace

void make_nodes_of_control_points(std::span<const std::size_t> places, MeshFile& file) {
  if (places.empty()) return;
  NodeMaker maker(places, file);
  const ControlMesh& mesh = file.mesh;
  std::size_t corner = 0;
  auto next = places.begin();
  for (std::size_t cell = 0; cell < mesh.cell_count() && next != places.end(); ++cell) {
    const auto corners = static_cast<std::size_t>(corner_count(mesh.cell_kinds[cell]));
    if (file.second_order.cells[*next] == cell) {
      maker.convert(*next++, mesh.cell_kinds[cell], std::span(mesh.cell_vertices).subspan(corner, corners));
    }
    corner += corners;
  }
}

}  // namespace ccslice
