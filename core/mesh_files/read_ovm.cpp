// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_ovm.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/similar_name.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/cell_numbers.h"
#include "core/mesh_import/channels.h"
#include "core/mesh_import/polyhedra.h"
#include "core/mesh_import/text_scanner.h"
#include "core/mesh_import/used_vertices.h"

namespace ccslice {
namespace {

constexpr std::uint64_t kMostSides =
    64;  // A face or a polyhedron may have so many; those that are read have six at most.
constexpr std::string_view kNumbers[] = {"int", "uint", "short", "ushort", "long", "ulong", "bool", "float", "double"};

/// How many numbers a value of a property's type is; 0 if it isn't numbers.
std::size_t component_count(std::string_view type) {
  for (const std::string_view number : kNumbers) {
    if (equals_ignoring_case(type, number)) return 1;
  }
  const std::string_view scalar = type.substr(std::min<std::size_t>(4, type.size()));
  const bool vector = equals_ignoring_case(type.substr(0, 3), "vec") && type.size() > 4 && type[3] >= '2' &&
                      type[3] <= '4' && (scalar == "f" || scalar == "d" || scalar == "i" || scalar == "ui");
  return vector ? static_cast<std::size_t>(type[3] - '0') : 0;
}

class OvmReader {
 public:
  OvmReader(std::string_view text, const MeshLimits& limits) : scanner_(text), limits_(limits) {}

  MeshFile read() {
    read_header();
    read_vertices();
    read_edges();
    read_faces();
    read_polyhedra();
    while (!scanner_.at_end()) read_property();
    append_file_channels(std::move(channels_), limits_, file_);
    leave_out_unused_vertices(unfit_, scanner_, file_);
    return std::move(file_);
  }

 private:
  void read_header() {
    const std::string_view magic = scanner_.next("'OVM'");
    if (equals_ignoring_case(magic.substr(0, 4), "OVMB")) refuse_binary("OpenVolumeMesh's binary format (.ovmb)");
    if (!equals_ignoring_case(magic, "OVM")) scanner_.fail("'OVM'", magic);
    // As OpenVolumeMesh's own reader: whatever else follows on the line, or nothing, stands for ASCII.
    TextScanner line(scanner_.rest_of_line());
    if (equals_ignoring_case(line.peek(), "BINARY")) refuse_binary("a binary OpenVolumeMesh file");
  }

  [[noreturn]] void refuse_binary(const std::string& what) const {
    scanner_.fail_with(ErrorCode::kFileUnsupported, "this is " + what + ", which is not read; save it as ASCII (.ovm)");
  }

  /// The keyword and the count of a section.
  std::uint64_t open_section(std::string_view keyword, std::uint64_t most) {
    const std::string_view token = scanner_.next(in_quotes(keyword));
    if (!equals_ignoring_case(token, keyword)) scanner_.fail(in_quotes(keyword), token);
    return scanner_.count_up_to("the number of entries of " + std::string(keyword), most);
  }

  std::uint32_t id_below(std::uint64_t end, std::string_view what) {
    const std::uint64_t id = scanner_.count(what);
    if (id >= end) {
      std::string message(what);
      message.append(" is ").append(std::to_string(id)).append(", but there are only ").append(std::to_string(end));
      scanner_.fail_with(ErrorCode::kMeshIndexOutOfRange, message);
    }
    return static_cast<std::uint32_t>(id);
  }

  void read_vertices() {
    const std::uint64_t count = open_section("Vertices", limits_.max_vertices);
    for (std::uint64_t i = 0; i < count; ++i) {
      file_.mesh.positions.push_back(unfit_.position(scanner_, i, scanner_));
      file_.numbers.vertices.push_back(i);
    }
    if (count == 0) scanner_.fail_with(ErrorCode::kMeshEmpty, "the file has no vertices");
  }

  void read_edges() {
    const std::uint64_t count = open_section("Edges", kMostHalves / 2);
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint32_t from = id_below(file_.mesh.vertex_count(), "a vertex id");
      const std::uint32_t to = id_below(file_.mesh.vertex_count(), "a vertex id");
      edges_.push_back({from, to});
    }
  }

  std::array<std::uint32_t, 2> half_edge(std::uint32_t id) const {
    const auto [from, to] = edges_[id / 2];
    return id % 2 == 0 ? std::array{from, to} : std::array{to, from};
  }

  void read_faces() {
    const std::uint64_t count = open_section("Faces", kMostHalves / 2);
    for (std::uint64_t face = 0; face < count; ++face) {
      const std::uint64_t sides = scanner_.count_up_to("the number of half-edges of a face", kMostSides);
      std::vector<std::array<std::uint32_t, 2>> loop;
      for (std::uint64_t i = 0; i < sides; ++i)
        loop.push_back(half_edge(id_below(2 * edges_.size(), "a half-edge id")));
      for (std::size_t i = 0; i < loop.size(); ++i) {
        if (loop[i][1] != loop[(i + 1) % loop.size()][0]) {
          scanner_.fail_with(ErrorCode::kFileSyntax,
                             "the half-edges of face " + std::to_string(face) + " (from 0) don't form a closed loop");
        }
        ring_vertices_.push_back(loop[i][0]);
      }
      ring_begin_.push_back(ring_vertices_.size());
    }
  }

  FaceRing half_face(std::uint32_t id) const {
    const auto begin = ring_vertices_.begin();
    FaceRing ring(begin + static_cast<std::ptrdiff_t>(ring_begin_[id / 2]),
                  begin + static_cast<std::ptrdiff_t>(ring_begin_[id / 2 + 1]));
    if (id % 2 != 0) std::reverse(ring.begin(), ring.end());
    return ring;
  }

  void read_polyhedra() {
    const std::uint64_t count = open_section("Polyhedra", limits_.max_cells);
    std::vector<FaceRing> rings;
    for (std::uint64_t cell = 0; cell < count; ++cell) {
      const std::uint64_t sides = scanner_.count_up_to("the number of half-faces of a polyhedron", kMostSides);
      rings.clear();
      for (std::uint64_t i = 0; i < sides; ++i) {
        rings.push_back(half_face(id_below(2 * (ring_begin_.size() - 1), "a half-face id")));
      }
      const std::optional<CornersOfPolyhedron> found = corners_of_polyhedron(rings);
      if (!found) {
        scanner_.fail_with(ErrorCode::kMeshUnsupportedCell,
                           "cell " + std::to_string(cell) + " (from 0) is " + describe_polyhedron(rings) +
                               "; remesh the part with hexahedra, tetrahedra, wedges or pyramids",
                           "cells", {static_cast<std::int64_t>(cell)});
      }
      file_.mesh.cell_kinds.push_back(found->kind);
      file_.numbers.cells.push_back(cell);
      file_.mesh.cell_vertices.insert(file_.mesh.cell_vertices.end(), found->corners.begin(), found->corners.end());
    }
    if (count == 0) scanner_.fail_with(ErrorCode::kMeshEmpty, "the file has no polyhedra; " + kNeedsVolumeCells);
  }

  /// "VProp", and the like for edges, half-edges, faces, half-faces, cells and the mesh.
  static bool opens_property(std::string_view token) {
    constexpr std::string_view kEntities[] = {"VProp", "EProp", "HEProp", "FProp", "HFProp", "CProp", "MProp"};
    return std::any_of(std::begin(kEntities), std::end(kEntities),
                       [&](std::string_view entity) { return equals_ignoring_case(token, entity); });
  }

  void read_property() {
    const std::string_view entity = scanner_.next("a property");
    if (!opens_property(entity)) scanner_.fail("a property (VProp, EProp, FProp, CProp, ...)", entity);
    const std::string_view type = scanner_.next("a type");
    const std::string_view rest = scanner_.rest_of_line();
    const std::optional<std::string_view> quoted = between_quotes(rest);
    if (!quoted) scanner_.fail("a name in quotation marks", rest);
    const std::string name(*quoted);
    const std::size_t components = component_count(type);
    if (equals_ignoring_case(entity, "VProp") && components > 0) return read_channels(name, components);
    if (equals_ignoring_case(entity, "CProp") && keeps_numbers(name, components)) return read_numbers(name, components);
    while (!scanner_.at_end() && !opens_property(scanner_.peek())) scanner_.rest_of_line();
    file_.warnings.push_back("property '" + printable(name) + "' (" + printable(entity) + " " + printable(type) +
                             ") left out");
  }

  void read_channels(const std::string& name, std::size_t components) {
    std::vector<NamedChannel> channels = open_channels(name, components);
    if (channels_.size() + components > limits_.max_channels) {
      scanner_.fail_with(ErrorCode::kMeshTooLarge, "property '" + printable(name) + "' makes more than " +
                                                       std::to_string(limits_.max_channels) +
                                                       " channels; save fewer arrays");
    }
    for (std::size_t vertex = 0; vertex < file_.mesh.vertex_count(); ++vertex) {
      for (NamedChannel& channel : channels) {
        channel.values.push_back(unfit_.value(scanner_.any_real("a value"), vertex, "a value", scanner_));
      }
    }
    std::move(channels.begin(), channels.end(), std::back_inserter(channels_));
  }

  bool keeps_numbers(const std::string& name, std::size_t components) const {
    const std::vector<CellNumbers>& all = file_.cell_numbers;
    const std::string first = component_name(name, components, 0);
    return components > 0 && components <= kMostCellNumbers - all.size() && !name.empty() &&
           std::ranges::find(all, first, &CellNumbers::name) == all.end();
  }

  void read_numbers(const std::string& name, std::size_t components) {
    const std::size_t first = file_.cell_numbers.size();
    for (std::size_t i = 0; i < components; ++i) {
      file_.cell_numbers.push_back({component_name(name, components, i), {}});
    }
    for (std::size_t cell = 0; cell < file_.mesh.cell_count(); ++cell) {
      for (std::size_t i = 0; i < components; ++i) {
        file_.cell_numbers[first + i].of_cells.push_back(scanner_.any_real("a value"));
      }
    }
  }

  static constexpr std::uint64_t kMostHalves = std::uint64_t{1} << 32;  // Half-edges or half-faces.

  TextScanner scanner_;
  const MeshLimits& limits_;
  std::vector<std::array<std::uint32_t, 2>> edges_;
  std::vector<std::uint32_t> ring_vertices_;  // All faces' vertices, one face after the other.
  std::vector<std::size_t> ring_begin_ = {0};
  std::vector<NamedChannel> channels_;
  UnfitNumbers unfit_;
  MeshFile file_;
};

}  // namespace

MeshFile read_ovm(std::string_view text, const MeshLimits& limits) { return OvmReader(text, limits).read(); }

}  // namespace ccslice
