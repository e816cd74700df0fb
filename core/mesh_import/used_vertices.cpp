// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/used_vertices.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "core/base/count_text.h"
#include "core/base/error.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh_import/mid_nodes.h"
#include "core/mesh_import/renumber_text.h"

namespace ccslice {

double UnfitNumbers::coordinate(double value, std::size_t vertex, std::string_view what, std::uint64_t mark,
                                std::string_view token) {
  if (!std::isfinite(value)) add({vertex, mark, token, what, "is not a finite number"});
  return value;
}

double UnfitNumbers::coordinate(double value, std::size_t vertex, std::string_view what, const TextScanner& scanner) {
  return coordinate(value, vertex, what, scanner.mark(), scanner.token());
}

float UnfitNumbers::value(double value, std::size_t vertex, std::string_view what, std::uint64_t mark,
                          std::string_view token) {
  const auto narrow = static_cast<float>(value);
  if (!std::isfinite(narrow)) add({vertex, mark, token, what, "is not finite, or too large for a float"});
  return narrow;
}

float UnfitNumbers::value(double value, std::size_t vertex, std::string_view what, const TextScanner& scanner) {
  return this->value(value, vertex, what, scanner.mark(), scanner.token());
}

void UnfitNumbers::add(const Number& number) {
  if (numbers_.empty() || numbers_.back().vertex != number.vertex) numbers_.push_back(number);
}

std::optional<UnfitNumbers::Complaint> UnfitNumbers::first_used(const std::vector<bool>& used,
                                                                const FileNumbers& numbers) const {
  const auto found = std::ranges::find_if(
      numbers_, [&](const Number& number) { return number.vertex < used.size() && used[number.vertex]; });
  if (found == numbers_.end()) return std::nullopt;
  std::string text = found->token.empty() ? "" : in_quotes(printable(found->token)) + ", ";
  text.append(found->what).append(" of ").append(numbers.vertex_noun).append(" ");
  text.append(std::to_string(file_vertex(numbers, found->vertex))).append(", ").append(found->why);
  return Complaint{found->mark, text};
}

void UnfitNumbers::throw_if_used(const std::vector<bool>& used, const FileNumbers& numbers,
                                 const TextScanner& scanner) const {
  if (const auto complaint = first_used(used, numbers)) {
    scanner.fail_at(complaint->mark, ErrorCode::kMeshNonFinite, complaint->message);
  }
}

std::vector<bool> used_vertices(const ControlMesh& mesh) {
  std::vector<bool> used(mesh.vertex_count(), false);
  for (const std::uint32_t vertex : mesh.cell_vertices) used[vertex] = true;
  return used;
}

std::vector<bool> used_nodes(const MeshFile& file) {
  std::vector<bool> used = used_vertices(file.mesh);
  for (const std::uint32_t node : file.second_order.nodes) {
    if (node != kNone) used[node] = true;
  }
  return used;
}

namespace {

void note_unused(std::vector<bool> known, MeshFile& file) {
  for (const std::uint32_t node : std::exchange(file.left_out_nodes, {})) known[node] = true;
  const auto unused = std::ranges::count(known, false);
  if (unused == 0) return;
  file.warnings.push_back(count_text(static_cast<std::uint64_t>(unused), "vertex") +
                          " that no cell uses left out; lists of vertices count the others");
}

}  // namespace

void leave_out_unused_vertices(const UnfitNumbers& unfit, const TextScanner& scanner, MeshFile& file) {
  ControlMesh& mesh = file.mesh;
  const std::vector<bool> used = used_vertices(mesh), known = used_nodes(file);
  unfit.throw_if_used(known, file.numbers, scanner);
  take_mid_nodes(file);
  if (std::ranges::all_of(used, std::identity())) return;
  const std::size_t channels = mesh.channel_count();
  std::vector<std::uint32_t> new_id(used.size(), kNone);
  std::size_t kept = 0;
  for (std::size_t vertex = 0; vertex < used.size(); ++vertex) {
    if (!used[vertex]) continue;
    mesh.positions[kept] = mesh.positions[vertex];
    std::copy_n(mesh.channel_values.begin() + static_cast<std::ptrdiff_t>(vertex * channels), channels,
                mesh.channel_values.begin() + static_cast<std::ptrdiff_t>(kept * channels));
    if (!file.numbers.vertices.empty()) file.numbers.vertices[kept] = file.numbers.vertices[vertex];
    new_id[vertex] = static_cast<std::uint32_t>(kept++);
  }
  mesh.positions.resize(kept);
  mesh.channel_values.resize(kept * channels);
  if (!file.numbers.vertices.empty()) file.numbers.vertices.resize(kept);
  for (std::uint32_t& vertex : mesh.cell_vertices) vertex = new_id[vertex];
  for (auto& edge : mesh.mid_nodes.edges) {
    for (std::uint32_t& vertex : edge) vertex = new_id[vertex];
  }
  for (auto& face : mesh.mid_nodes.faces) {
    for (std::uint32_t& vertex : face) vertex = new_id[vertex];
  }
  note_unused(known, file);
}

}  // namespace ccslice
