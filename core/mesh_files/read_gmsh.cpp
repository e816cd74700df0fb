// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_gmsh.h"
#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>
#include "core/base/error.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/gmsh_cells.h"
#include "core/mesh_files/gmsh_element_data.h"
#include "core/mesh_files/gmsh_elements.h"
#include "core/mesh_files/gmsh_groups.h"
#include "core/mesh_files/gmsh_node_data.h"
#include "core/mesh_files/gmsh_scanner.h"
#include "core/mesh_import/collapsed_cells.h"
#include "core/mesh_import/node_numbers.h"
#include "core/mesh_import/used_vertices.h"

namespace ccslice {
namespace {

/// Sections that mean something, so that none may stand before the format.
constexpr std::string_view kKnownSections[] = {"Nodes",    "ParametricNodes",
                                               "Elements", "PhysicalNames",
                                               "Entities", "PartitionedEntities",
                                               "NodeData", "ElementData",
                                               "NOD",      "ELM"};

class GmshReader {
 public:
  GmshReader(std::string_view bytes, const MeshLimits& limits) : scanner_(bytes), limits_(limits) {}

  MeshFile read() {
    read_format();
    while (!scanner_.text().at_end()) read_section();
    refuse_pyramids();
    if (nodes_.size() == 0) throw Error(ErrorCode::kMeshEmpty, "the file has no $Nodes; save the mesh with Gmsh anew");
    if (cells_.size() == 0) {
      throw Error(ErrorCode::kMeshEmpty, "the file has no hexahedra, tetrahedra or prisms; " + kNeedsVolumeCells);
    }
    file_.numbers = {"node", "element", nodes_.all(), {}};
    cells_.connect(nodes_, scanner_.text(), file_);
    node_data_.finish(nodes_, scanner_.text(), limits_, file_);
    leave_out_unused_vertices(unfit_, scanner_.text(), file_);
    if (flat_ > 0) file_.warnings.push_back(std::to_string(flat_) + " points, lines and faces left out");
    groups_.finish(file_);
    element_data_.finish(file_);
    return std::move(file_);
  }

 private:
  struct Refused {
    std::uint64_t count = 0, mark = 0;
    std::uint16_t type = 0;
  };

  void read_format();
  void read_section();
  void read_entities(const std::string& name);
  void skip_section(const std::string& name);
  void read_nodes(const std::string& name);
  void read_nodes_2(bool parametric);
  void read_nodes_4();
  void add_node(std::uint64_t tag);
  void read_elements_2();
  void read_elements_4();
  const GmshElementType& element_type();
  bool read_element(const GmshElementType& type, std::uint64_t number, bool tags_are_sizes);
  void count_cells();
  void refuse_pyramids();

  GmshScanner scanner_;
  const MeshLimits& limits_;
  bool version_4_ = false, version_2_0_ = false;
  NodeNumbers nodes_;
  UnfitNumbers unfit_;
  GmshCells cells_;
  std::vector<std::uint64_t> tags_;  // Of the nodes of an element.
  GmshNodeData node_data_;
  std::uint64_t flat_ = 0;
  Refused pyramids_;
  GmshGroups groups_;
  GmshElementData element_data_;
  std::set<std::string> entity_sections_;  // Names of those that have come.
  bool entities_broken_ = false;
  MeshFile file_;
};

/// Sections that nobody knows may stand before it, as they may behind it.
void GmshReader::read_format() {
  TextScanner& text = scanner_.text();
  constexpr std::string_view kMagic = "$MeshFormat";
  std::string_view magic = text.next(in_quotes(kMagic));
  while (magic != kMagic) {
    if (magic.size() < 2 || magic.front() != '$' ||
        std::ranges::find(kKnownSections, magic.substr(1)) != std::end(kKnownSections)) {
      text.fail(in_quotes(kMagic), magic);
    }
    skip_section(std::string(magic.substr(1)));
    magic = text.next(in_quotes(kMagic));
  }
  const std::string version(text.next("a format version"));
  version_4_ = version == "4.1";
  version_2_0_ = version == "2" || version == "2.0";
  if (!version_4_ && version != "2" && !version.starts_with("2.")) {
    text.fail_with(ErrorCode::kFileUnsupported,
                   "MSH version " + printable(version) + " is not known: save it with `gmsh -format msh41`, or msh22");
  }
  const std::uint64_t is_binary = text.count_up_to("0 (ASCII) or 1 (binary)", 1);
  const std::uint64_t data_size = text.count("the size of numbers, 8");
  if (is_binary == 1 && data_size != 8) {
    text.fail_with(ErrorCode::kFileUnsupported,
                   "a binary file with numbers of " + std::to_string(data_size) +
                       " bytes; 8 are read: save it as text with the program that wrote it");
  }
  if (is_binary == 1) scanner_.set_binary();
  scanner_.close_section("MeshFormat");
}

void GmshReader::read_section() {
  const std::string_view token = scanner_.text().next("a section");
  if (token.size() < 2 || token.front() != '$') scanner_.text().fail("a section, as '$Nodes'", token);
  const std::string name(token.substr(1));
  if (name == "Nodes" || (!version_4_ && name == "ParametricNodes")) {
    read_nodes(name);
  } else if (name == "Elements") {
    scanner_.open_section();
    version_4_ ? read_elements_4() : read_elements_2();
    scanner_.close_section(name);
  } else if (name == "PhysicalNames") {
    groups_.read_names(scanner_, !version_2_0_);
    scanner_.close_section(name);
  } else if (version_4_ && (name == "Entities" || name == "PartitionedEntities")) {
    read_entities(name);
  } else if (name == "NodeData") {
    node_data_.read(scanner_, limits_);
    scanner_.close_section(name);
  } else if (name == "ElementData") {
    element_data_.read(scanner_);
    scanner_.close_section(name);
  } else {
    skip_section(name);
  }
}

/// A mesh doesn't need them, so one goes on without them where a program has written them in its own way. A second
/// section of that kind, or one after a broken one, is passed over: a file of thousands that each run to its end would
/// take quadratic time.
void GmshReader::read_entities(const std::string& name) {
  if (!entity_sections_.insert(name).second || entities_broken_) return skip_section(name);
  const GmshScanner begin = scanner_;
  try {
    scanner_.open_section();
    groups_.read_entities(scanner_, name == "PartitionedEntities");
    scanner_.close_section(name);
  } catch (const Error& error) {
    file_.warnings.push_back("physical groups may be incomplete, $" + name +
                             " isn't as Gmsh writes it: " + error.what());
    entities_broken_ = true;
    scanner_ = begin;
    skip_section(name);
  }
}

/// What it holds may be bytes; its end stands at the beginning of a line.
void GmshReader::skip_section(const std::string& name) {
  const std::string end = "$End" + name;
  (void)scanner_.text().rest_of_line();
  while (!scanner_.text().at_end()) {
    std::string_view line = scanner_.text().rest_of_line();
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
    if (line.ends_with(end)) {
      if (name == "ElementNodeData") {
        file_.warnings.push_back("a field at the nodes of each element ($" + name +
                                 ") left out; $NodeData and $ElementData are read");
      }
      return;
    }
  }
  scanner_.text().fail(in_quotes(end), "the end of the file");
}

void GmshReader::read_nodes(const std::string& name) {
  if (nodes_.size() > 0) scanner_.text().fail("only one $Nodes section", "$" + name);
  scanner_.open_section();
  version_4_ ? read_nodes_4() : read_nodes_2(name != "Nodes");
  scanner_.close_section(name);
  if (const auto twin = nodes_.sort()) {
    scanner_.text().fail_at(twin->mark, ErrorCode::kFileSyntax,
                            "node " + std::to_string(twin->number) + " comes twice; number the nodes anew");
  }
}

/// In version 2 the number of nodes and of elements is text in a binary file, too. Parametric nodes have the dimension
/// and the number of the curve or surface that they lie on, and their one or two parameters there [MVertex.cpp,
/// writeMSH2].
void GmshReader::read_nodes_2(bool parametric) {
  const std::uint64_t count = scanner_.text().count_up_to("the number of nodes", limits_.max_vertices);
  if (scanner_.binary()) scanner_.text().end_line();
  for (std::uint64_t i = 0; i < count; ++i) {
    add_node(scanner_.integer("a node's number"));
    if (!parametric) continue;
    const std::uint64_t dimension = scanner_.integer("an entity's dimension");
    scanner_.skip_integer("an entity's tag");
    const std::uint64_t parameters = dimension == 1 || dimension == 2 ? dimension : 0;
    for (std::uint64_t d = 0; d < parameters; ++d) (void)scanner_.any_real("a parameter");
  }
}

void GmshReader::read_nodes_4() {
  const std::uint64_t blocks = scanner_.size("the number of entity blocks");
  for (const char* expected : {"the number of nodes", "the smallest tag", "the largest tag"}) {
    (void)scanner_.size(expected);
  }
  std::vector<std::uint64_t> tags;
  for (std::uint64_t block = 0; block < blocks; ++block) {
    const std::uint64_t dimension = scanner_.integer("an entity's dimension");
    scanner_.skip_integer("an entity's tag");
    const bool parametric = scanner_.integer("0, or 1 where parameters follow") != 0;
    const std::uint64_t count = scanner_.size("the number of nodes in the block");
    if (count > limits_.max_vertices - std::min(limits_.max_vertices, nodes_.size())) {
      scanner_.text().fail_with(ErrorCode::kMeshTooLarge,
                                "more than " + std::to_string(limits_.max_vertices) + " nodes");
    }
    tags.clear();
    for (std::uint64_t i = 0; i < count; ++i) tags.push_back(scanner_.size("a node's tag"));
    for (const std::uint64_t tag : tags) {
      add_node(tag);
      for (std::uint64_t d = 0; parametric && d < std::min<std::uint64_t>(dimension, 3); ++d) {
        (void)scanner_.any_real("a parameter");
      }
    }
  }
}

/// REQUIRES: the node's coordinates come next.
void GmshReader::add_node(std::uint64_t tag) {
  const std::uint64_t mark = scanner_.text().mark();
  file_.mesh.positions.push_back(unfit_.position(scanner_, nodes_.size(), scanner_.text()));
  nodes_.add(tag, mark);
}

const GmshElementType& GmshReader::element_type() {
  const std::uint64_t number = scanner_.integer("an element type");
  const auto found = std::ranges::find(kGmshElementTypes, number, &GmshElementType::number);
  if (found == std::end(kGmshElementTypes)) {
    scanner_.text().fail_with(
        ErrorCode::kMeshUnsupportedCell,
        "element type " + std::to_string(number) + " is not known; hexahedra, tetrahedra and prisms are read");
  }
  return *found;
}

/// Whether it is a cell.
bool GmshReader::read_element(const GmshElementType& type, std::uint64_t number, bool tags_are_sizes) {
  const bool is_linear_pyramid = type.role == GmshRole::kPyramid && type.nodes == kPyramidCorners;
  if (type.role == GmshRole::kPyramid && !is_linear_pyramid && pyramids_.count++ == 0) {
    pyramids_.mark = scanner_.text().mark();
    pyramids_.type = type.number;
  }
  tags_.clear();
  for (std::size_t n = 0; n < type.nodes; ++n) {
    tags_.push_back(tags_are_sizes ? scanner_.size("a node's tag") : scanner_.integer("a node's number"));
  }
  flat_ += type.role == GmshRole::kFlat;
  if (type.role != GmshRole::kCell && !is_linear_pyramid) return false;
  constexpr GmshElementType kHexahedron = {5, 8, GmshRole::kCell, CellKind::kHex};
  if (is_linear_pyramid) tags_.insert(tags_.end(), 3, tags_.back());
  cells_.add(is_linear_pyramid ? kHexahedron : type, number, tags_, scanner_.text().mark());
  return true;
}

void GmshReader::count_cells() {
  if (cells_.size() <= limits_.max_cells) return;
  scanner_.text().fail_with(ErrorCode::kMeshTooLarge,
                            "more than " + std::to_string(limits_.max_cells) + " volume cells");
}

/// In a binary file elements of a type come in groups under one header. An element has one group: Gmsh writes a cell of
/// several groups once for each, one after the other, with numbers of their own [GModelIO_MSH2.cpp, writeElementMSH].
void GmshReader::read_elements_2() {
  const std::uint64_t count = scanner_.text().count("the number of elements");
  if (scanner_.binary()) scanner_.text().end_line();
  for (std::uint64_t i = 0; i < count;) {
    std::uint64_t number = scanner_.binary() ? 0 : scanner_.integer("an element's number");
    const GmshElementType& type = element_type();
    const std::uint64_t group = scanner_.binary() ? scanner_.integer("the number of elements that follow") : 1;
    const std::uint64_t tags = scanner_.integer("the number of tags");
    if (group == 0 || group > count - i) {
      scanner_.text().fail("at most " + std::to_string(count - i) + " elements", std::to_string(group));
    }
    for (std::uint64_t k = 0; k < group; ++k, ++i) {
      if (scanner_.binary()) number = scanner_.integer("an element's number");
      std::array<std::int64_t, 2> group_and_volume{};  // Others may follow: partitions.
      for (std::uint64_t t = 0; t < tags; ++t) {
        const std::int64_t tag = scanner_.signed_integer("a tag");
        if (t < group_and_volume.size()) group_and_volume[t] = tag;
      }
      if (!read_element(type, number, false)) continue;
      const auto [physical, volume] = group_and_volume;
      if (cells_.last_is_twin() && groups_.may_take_last_cell(volume, physical)) {
        cells_.drop_last();
        groups_.add_last_cell_to(physical);
        continue;
      }
      groups_.add_cell(volume, physical);
      count_cells();
    }
  }
}

void GmshReader::read_elements_4() {
  const std::uint64_t blocks = scanner_.size("the number of entity blocks");
  for (const char* expected : {"the number of elements", "the smallest tag", "the largest tag"}) {
    (void)scanner_.size(expected);
  }
  for (std::uint64_t block = 0; block < blocks; ++block) {
    scanner_.skip_integer("an entity's dimension");
    const std::int64_t entity = scanner_.signed_integer("an entity's tag");
    const GmshElementType& type = element_type();
    const std::uint64_t count = scanner_.size("the number of elements in the block");
    for (std::uint64_t i = 0; i < count; ++i) {
      const std::uint64_t number = scanner_.size("an element's tag");
      if (!read_element(type, number, true)) continue;
      groups_.add_cell(entity, 0);
      count_cells();
    }
  }
}

void GmshReader::refuse_pyramids() {
  if (pyramids_.count == 0) return;
  scanner_.text().fail_at(pyramids_.mark, ErrorCode::kMeshUnsupportedCell,
                          std::to_string(pyramids_.count) + (pyramids_.count == 1 ? " pyramid" : " pyramids") +
                              " (the first is of element type " + std::to_string(pyramids_.type) +
                              "); of pyramids only those of first order are read: save the mesh with `gmsh -order 1`");
}

}  // namespace

MeshFile read_gmsh(std::string_view bytes, const MeshLimits& limits) { return GmshReader(bytes, limits).read(); }

}  // namespace ccslice
