// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/read_gmsh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/mesh/channels.h"
#include "core/mesh/gmsh_element_data.h"
#include "core/mesh/gmsh_elements.h"
#include "core/mesh/gmsh_groups.h"
#include "core/mesh/gmsh_scanner.h"
#include "core/mesh/node_numbers.h"
#include "core/mesh/used_vertices.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kNoRow = std::numeric_limits<std::uint32_t>::max();

/// A field at nodes; values that no channel can have count rows where the others count vertices.
struct Field {
  std::vector<NamedChannel> channels;
  std::vector<std::uint64_t> tags;  // Of the node of each row of values.
  std::string step;                 // As it is written.
  UnfitNumbers unfit;
};

class GmshReader {
 public:
  GmshReader(std::string_view bytes, const MeshLimits& limits) : scanner_(bytes), limits_(limits) {}

  MeshFile read() {
    read_format();
    while (!scanner_.text().at_end()) read_section();
    refuse_unsupported();
    if (nodes_.size() == 0) throw Error(ErrorCode::kMeshEmpty, "the file has no $Nodes; save the mesh with Gmsh anew");
    if (kinds_.empty()) {
      throw Error(ErrorCode::kMeshEmpty, "the file has no hexahedra, tetrahedra or prisms; " + kNeedsVolumeCells);
    }
    connect();
    const std::vector<bool> used = used_vertices(file_.mesh);
    for (const Field& field : fields_) add_field(field, used);
    leave_out_unused_vertices(unfit_, scanner_.text(), file_);
    warn();
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
  void read_nodes();
  void read_nodes_2();
  void read_nodes_4();
  void add_node(std::uint64_t tag);
  void read_elements_2();
  void read_elements_4();
  const GmshElementType& element_type();
  bool read_element(const GmshElementType& type, bool tags_are_sizes);
  bool is_last_cell_again(std::int64_t volume, std::int64_t group) const;
  void drop_last_cell(const GmshElementType& type);
  void count_cells();
  void read_node_data();
  void read_rows(std::uint64_t count, Field& field);
  void refuse_unsupported();
  void connect();
  void add_field(const Field& field, const std::vector<bool>& used);
  void warn();

  GmshScanner scanner_;
  const MeshLimits& limits_;
  bool version_4_ = false;
  NodeNumbers nodes_;
  UnfitNumbers unfit_;
  std::vector<CellKind> kinds_;
  std::vector<std::uint64_t> corners_, cell_marks_;  // Tags of nodes; a place in the file for each cell.
  std::vector<Field> fields_;
  std::uint64_t flat_ = 0, second_order_ = 0;
  Refused pyramids_, high_order_;
  GmshGroups groups_;
  GmshElementData element_data_;
  std::set<std::string> entity_sections_;  // Names of those that have come.
  bool entities_broken_ = false;
  MeshFile file_;
};

void GmshReader::read_format() {
  TextScanner& text = scanner_.text();
  const std::string_view magic = text.next("'$MeshFormat'");
  if (magic != "$MeshFormat") text.fail("'$MeshFormat'", magic);
  const std::string version(text.next("a format version"));
  version_4_ = version == "4.1";
  if (!version_4_ && version != "2" && !version.starts_with("2.")) {
    text.fail_with(ErrorCode::kFileUnsupported,
                   "MSH version " + printable(version) + " is not known: save it with `gmsh -format msh41`, or msh22");
  }
  const std::uint64_t is_binary = text.count_up_to("0 (ASCII) or 1 (binary)", 1);
  const std::uint64_t data_size = text.count("the size of numbers, 8");
  if (data_size != 8) {
    text.fail_with(ErrorCode::kFileUnsupported,
                   "numbers of " + std::to_string(data_size) + " bytes; 8 are read: save the mesh with Gmsh anew");
  }
  if (is_binary == 1) scanner_.set_binary();
  scanner_.close_section("MeshFormat");
}

void GmshReader::read_section() {
  const std::string_view token = scanner_.text().next("a section");
  if (token.size() < 2 || token.front() != '$') scanner_.text().fail("a section, as '$Nodes'", token);
  const std::string name(token.substr(1));
  if (name == "Nodes") {
    read_nodes();
  } else if (name == "Elements") {
    scanner_.open_section();
    version_4_ ? read_elements_4() : read_elements_2();
    scanner_.close_section(name);
  } else if (name == "PhysicalNames") {
    groups_.read_names(scanner_);
    scanner_.close_section(name);
  } else if (version_4_ && (name == "Entities" || name == "PartitionedEntities")) {
    read_entities(name);
  } else if (name == "NodeData") {
    read_node_data();
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

void GmshReader::read_nodes() {
  if (nodes_.size() > 0) scanner_.text().fail("only one $Nodes section", "$Nodes");
  scanner_.open_section();
  version_4_ ? read_nodes_4() : read_nodes_2();
  scanner_.close_section("Nodes");
  if (const auto twin = nodes_.sort()) {
    scanner_.text().fail_at(twin->mark, ErrorCode::kFileSyntax,
                            "node " + std::to_string(twin->number) + " comes twice; number the nodes anew");
  }
}

/// In version 2 the number of nodes and of elements is text in a binary file, too.
void GmshReader::read_nodes_2() {
  const std::uint64_t count = scanner_.text().count_up_to("the number of nodes", limits_.max_vertices);
  if (scanner_.binary()) scanner_.text().end_line();
  for (std::uint64_t i = 0; i < count; ++i) {
    add_node(scanner_.integer("a node's number"));
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
    scanner_.text().fail_with(ErrorCode::kMeshUnsupportedCell,
                              "element type " + std::to_string(number) +
                                  " is not known; hexahedra, tetrahedra and prisms of first and second order are read");
  }
  return *found;
}

/// Whether it is a cell.
bool GmshReader::read_element(const GmshElementType& type, bool tags_are_sizes) {
  Refused* refused = type.role == GmshRole::kPyramid     ? &pyramids_
                     : type.role == GmshRole::kHighOrder ? &high_order_
                                                         : nullptr;
  if (refused != nullptr && refused->count++ == 0) {
    refused->mark = scanner_.text().mark();
    refused->type = type.number;
  }
  const auto corners = type.role == GmshRole::kCell ? static_cast<std::size_t>(corner_count(type.kind)) : 0;
  for (std::size_t n = 0; n < type.nodes; ++n) {
    const std::uint64_t tag = tags_are_sizes ? scanner_.size("a node's tag") : scanner_.integer("a node's number");
    if (n < corners) corners_.push_back(tag);
  }
  flat_ += type.role == GmshRole::kFlat;
  if (type.role != GmshRole::kCell) return false;
  second_order_ += type.second_order;
  kinds_.push_back(type.kind);
  cell_marks_.push_back(scanner_.text().mark());
  return true;
}

/// Version 2 has one group an element: Gmsh writes a cell of several groups once for each, one after the other, with
/// numbers of their own [GModelIO_MSH2.cpp, writeElementMSH].
bool GmshReader::is_last_cell_again(std::int64_t volume, std::int64_t group) const {
  if (kinds_.size() < 2 || kinds_.back() != kinds_[kinds_.size() - 2]) return false;
  if (!groups_.may_take_last_cell(volume, group)) return false;
  const auto corners = static_cast<std::ptrdiff_t>(corner_count(kinds_.back()));
  return std::equal(corners_.end() - corners, corners_.end(), corners_.end() - 2 * corners);
}

void GmshReader::drop_last_cell(const GmshElementType& type) {
  second_order_ -= type.second_order;
  kinds_.pop_back();
  cell_marks_.pop_back();
  corners_.resize(corners_.size() - static_cast<std::size_t>(corner_count(type.kind)));
}

void GmshReader::count_cells() {
  if (kinds_.size() <= limits_.max_cells) return;
  scanner_.text().fail_with(ErrorCode::kMeshTooLarge,
                            "more than " + std::to_string(limits_.max_cells) + " volume cells");
}

/// In a binary file elements of a type come in groups under one header.
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
      if (!read_element(type, false)) continue;
      const auto [physical, volume] = group_and_volume;
      if (is_last_cell_again(volume, physical)) {
        drop_last_cell(type);
        groups_.add_last_cell_to(physical);
        continue;
      }
      groups_.add_cell(volume, physical);
      element_data_.add_cell(number);
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
      if (!read_element(type, true)) continue;
      groups_.add_cell(entity, 0);
      element_data_.add_cell(number);
      count_cells();
    }
  }
}

void GmshReader::read_node_data() {
  const GmshFieldHeader header = read_field_header(scanner_, limits_.max_vertices);
  Field field{open_channels(header.name, header.components), {}, header.step, {}};
  const auto known = std::ranges::find_if(fields_, [&](const Field& other) {
    return !other.channels.empty() && !field.channels.empty() && other.channels[0].name == field.channels[0].name;
  });
  if (known == fields_.end()) {
    read_rows(header.count, field);
    fields_.push_back(std::move(field));
  } else if (header.partition > 0 && known->step == header.step && known->channels.size() == header.components) {
    read_rows(header.count, *known);
  } else {
    read_rows(header.count, field);
    file_.warnings.push_back("field '" + printable(header.name) + "' comes again for another time: left out");
  }
}

void GmshReader::read_rows(std::uint64_t count, Field& field) {
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::uint64_t tag = scanner_.integer("a node's number");
    for (NamedChannel& channel : field.channels) {
      const double value = scanner_.any_real("a value");
      channel.values.push_back(field.unfit.value(value, field.tags.size(), "a value", scanner_.text()));
    }
    field.tags.push_back(tag);
  }
}

void GmshReader::refuse_unsupported() {
  const auto refuse = [&](const Refused& refused, const std::string& what, const std::string& remedy) {
    if (refused.count == 0) return;
    scanner_.text().fail_at(refused.mark, ErrorCode::kMeshUnsupportedCell,
                            std::to_string(refused.count) + " " + what + (refused.count == 1 ? "" : "s") +
                                " (the first is of element type " + std::to_string(refused.type) + "); " + remedy);
  };
  refuse(pyramids_, "pyramid", "a pyramid never refines to hexahedra: split it into tetrahedra");
  refuse(high_order_, "cell", "cells of third order or higher aren't read: save the mesh with `gmsh -order 1`");
}

void GmshReader::connect() {
  ControlMesh& mesh = file_.mesh;
  std::size_t corner = 0;
  for (std::size_t cell = 0; cell < kinds_.size(); ++cell) {
    for (int i = 0; i < corner_count(kinds_[cell]); ++i) {
      const std::uint64_t tag = corners_[corner++];
      const std::optional<std::uint32_t> vertex = nodes_.index_of(tag);
      if (!vertex) {
        scanner_.text().fail_at(cell_marks_[cell], ErrorCode::kMeshIndexOutOfRange,
                                "a cell uses node " + std::to_string(tag) + ", which the file doesn't have");
      }
      mesh.cell_vertices.push_back(*vertex);
    }
  }
  mesh.cell_kinds = std::move(kinds_);
}

/// Left out where a vertex has no value. Vertices that no cell uses need none.
void GmshReader::add_field(const Field& field, const std::vector<bool>& used) {
  std::vector<std::uint32_t> row_of(used.size(), kNoRow);
  std::vector<bool> used_rows(field.tags.size(), false);
  for (std::size_t row = 0; row < field.tags.size(); ++row) {
    const std::optional<std::uint32_t> vertex = nodes_.index_of(field.tags[row]);
    if (!vertex) continue;
    row_of[*vertex] = static_cast<std::uint32_t>(row);
    used_rows[row] = used[*vertex];
  }
  std::size_t lacking = 0;
  for (std::size_t vertex = 0; vertex < used.size(); ++vertex) lacking += used[vertex] && row_of[vertex] == kNoRow;
  if (lacking > 0) {
    file_.warnings.push_back("field '" + printable(field.channels.empty() ? "" : field.channels[0].name) +
                             "' left out: " + std::to_string(lacking) + " vertices have no value in it");
    return;
  }
  field.unfit.throw_if_used(used_rows, scanner_.text());
  std::vector<NamedChannel> channels;
  for (const NamedChannel& channel : field.channels) {
    NamedChannel& made = channels.emplace_back(NamedChannel{channel.name, {}});
    for (const std::uint32_t row : row_of) made.values.push_back(row == kNoRow ? 0.0f : channel.values[row]);
  }
  append_file_channels(std::move(channels), limits_, file_);
}

void GmshReader::warn() {
  const auto note = [&](std::uint64_t count, const std::string& text) {
    if (count > 0) file_.warnings.push_back(std::to_string(count) + " " + text);
  };
  note(flat_, "points, lines and faces left out");
  note(second_order_, "cells of second order taken by their corners: curved edges become straight");
  groups_.finish(file_);
  element_data_.finish(file_);
}

}  // namespace

MeshFile read_gmsh(std::string_view bytes, const MeshLimits& limits) { return GmshReader(bytes, limits).read(); }

}  // namespace ccslice
