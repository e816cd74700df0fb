// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_exodus.h"
#include <algorithm>
#include <initializer_list>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/exodus_types.h"
#include "core/mesh_files/netcdf_file.h"
#include "core/mesh_import/cell_numbers.h"
#include "core/mesh_import/channels.h"
#include "core/mesh_import/collapsed_cells.h"
#include "core/mesh_import/second_order_cells.h"
#include "core/mesh_import/set_members.h"
#include "core/mesh_import/text_scanner.h"
#include "core/mesh_import/used_vertices.h"

namespace ccslice {
namespace {

constexpr std::size_t kMostVariables = kMostCellNumbers - 1;  // Ids of blocks are numbers of cells, too.

class ExodusReader {
 public:
  ExodusReader(std::string_view bytes, const MeshLimits& limits) : netcdf_(bytes), limits_(limits) {}

  MeshFile read() {
    read_coordinates();
    read_blocks();
    if (file_.mesh.cell_kinds.empty()) {
      throw Error(ErrorCode::kMeshEmpty, "the file has no hexahedra, tetrahedra or wedges; " + kNeedsVolumeCells);
    }
    read_element_sets();
    for (CellSet& set : file_.cell_sets) sort_unique(set.cells);
    read_nodal_variables();
    read_element_variables();
    read_own_numbers();
    leave_out_unused_vertices(unfit_, netcdf_.place(), file_);
    warn();
    return std::move(file_);
  }

 private:
  struct Named {
    std::string name;
    double id = 0;
  };
  /// Consecutive elements of the file; `cells` tells whether they are cells of the mesh, from `first_cell` on.
  struct Block {
    std::uint64_t first_element = 0, count = 0;
    std::uint32_t first_cell = 0;
    bool cells = false;
  };

  std::uint64_t count_of(std::string_view dimension) const { return netcdf_.dimension(dimension).value_or(0); }
  const NetcdfVariable& require(const std::string& name) const;
  [[noreturn]] void fail(const NetcdfVariable& variable, const std::string& message) const;
  NetcdfNumbers numbers_of(const NetcdfVariable& variable, std::initializer_list<std::uint64_t> shape);
  std::vector<Named> names_of(const std::string& names, const std::string& ids);
  void read_coordinates();
  void read_blocks();
  void read_block(const NetcdfVariable& connect, const std::string& name, Block& block);
  void read_cells(const NetcdfVariable& connect, const ExodusElementType& type, Block& block);
  std::uint32_t vertex(const NetcdfNumbers& numbers, std::uint64_t i) const;
  void read_element_sets();
  void add_to_set(const std::string& name, std::vector<std::uint32_t> cells);
  std::optional<std::uint32_t> cell_of(double element) const;
  void read_own_numbers();
  std::vector<std::uint64_t> map_of(const std::string& name, std::uint64_t count);
  void read_nodal_variables();
  void add_channel(const std::string& name, const NetcdfNumbers& numbers, std::uint64_t first,
                   std::vector<NamedChannel>& channels);
  void read_element_variables();
  std::vector<double> numbers_of_cells(std::uint64_t variable, std::uint64_t& lacking);
  void warn();

  NetcdfFile netcdf_;
  const MeshLimits& limits_;
  UnfitNumbers unfit_;
  std::vector<Block> blocks_;
  std::map<std::string, std::size_t> set_of_;
  std::vector<double> block_ids_;  // By cell.
  std::uint64_t flat_ = 0, crooked_ = 0, with_other_nodes_ = 0;
  MeshFile file_;
};

const NetcdfVariable& ExodusReader::require(const std::string& name) const {
  const NetcdfVariable* variable = netcdf_.variable(name);
  if (variable == nullptr)
    throw Error(ErrorCode::kFileSyntax, "the file has no variable '" + name + "'; write the file anew");
  return *variable;
}

void ExodusReader::fail(const NetcdfVariable& variable, const std::string& message) const {
  netcdf_.place().fail_at(variable.begin, ErrorCode::kFileSyntax,
                          "variable '" + printable(variable.name) + "' " + message);
}

NetcdfNumbers ExodusReader::numbers_of(const NetcdfVariable& variable, std::initializer_list<std::uint64_t> shape) {
  if (!std::ranges::equal(variable.shape, shape)) fail(variable, "has another shape than its dimensions ask for");
  return netcdf_.numbers(variable);
}

/// What the blocks, sets or variables of the file are called. Those without names go by their ids, those without ids
/// by their numbers from 1.
std::vector<ExodusReader::Named> ExodusReader::names_of(const std::string& names, const std::string& ids) {
  std::vector<Named> found;
  if (const NetcdfVariable* const texts = netcdf_.variable(names)) {
    for (std::string& name : netcdf_.texts(*texts)) found.push_back({std::move(name)});
  }
  std::uint64_t known_ids = 0;
  if (const NetcdfVariable* const numbers = netcdf_.variable(ids)) {
    const NetcdfNumbers id = netcdf_.numbers(*numbers);
    known_ids = id.size();
    found.resize(std::max<std::uint64_t>(found.size(), known_ids));
    for (std::uint64_t i = 0; i < known_ids; ++i) found[i].id = id[i];
  }
  for (std::uint64_t i = 0; i < found.size(); ++i) {
    if (i >= known_ids) found[i].id = static_cast<double>(i + 1);
    if (found[i].name.empty()) found[i].name = number_text(found[i].id);
  }
  return found;
}

void ExodusReader::read_coordinates() {
  const std::optional<std::uint64_t> nodes = netcdf_.dimension("num_nodes"), axes = netcdf_.dimension("num_dim");
  if (!nodes || !axes) {
    throw Error(ErrorCode::kFileUnsupported,
                "this netCDF file is no Exodus file: it has no dimensions 'num_nodes' and 'num_dim'");
  }
  if (*axes != 3) {
    throw Error(ErrorCode::kMeshEmpty,
                "the file's mesh has " + std::to_string(*axes) + " dimensions; " + kNeedsVolumeCells);
  }
  if (*nodes > limits_.max_vertices) {
    throw Error(ErrorCode::kMeshTooLarge, "the file has " + std::to_string(*nodes) + " nodes, at most " +
                                              std::to_string(limits_.max_vertices) + " are allowed");
  }
  const NetcdfVariable* const packed = netcdf_.variable("coord");
  std::vector<NetcdfNumbers> columns;
  if (packed != nullptr) {
    columns.assign(3, numbers_of(*packed, {3, *nodes}));
  } else {
    for (const char* name : {"coordx", "coordy", "coordz"}) columns.push_back(numbers_of(require(name), {*nodes}));
  }
  for (std::uint64_t node = 0; node < *nodes; ++node) {
    Vec3 position;
    for (std::uint64_t axis = 0; axis < 3; ++axis) {
      const std::uint64_t i = packed != nullptr ? axis * *nodes + node : node;
      position[static_cast<Eigen::Index>(axis)] =
          unfit_.coordinate(columns[axis][i], node, "a coordinate", columns[axis].byte(i), {});
    }
    file_.mesh.positions.push_back(position);
  }
}

void ExodusReader::read_blocks() {
  std::vector<Named> names = names_of("eb_names", "eb_prop1");
  // Some files number their blocks nowhere.
  for (std::size_t number = names.size() + 1; number <= count_of("num_el_blk"); ++number) {
    if (netcdf_.variable("connect" + std::to_string(number)) == nullptr) break;
    names.push_back({std::to_string(number), static_cast<double>(number)});
  }
  std::uint64_t elements = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string number = std::to_string(i + 1);
    const std::size_t first_cell = file_.mesh.cell_count();
    Block block{elements, count_of("num_el_in_blk" + number), static_cast<std::uint32_t>(first_cell)};
    if (block.count > 0) read_block(require("connect" + number), names[i].name, block);
    if (elements + block.count < elements) throw Error(ErrorCode::kMeshTooLarge, "the blocks have too many elements");
    elements += block.count;
    blocks_.push_back(block);
    block_ids_.resize(file_.mesh.cell_count(), names[i].id);
    std::vector<std::uint32_t> cells(file_.mesh.cell_count() - first_cell);
    std::iota(cells.begin(), cells.end(), block.first_cell);
    add_to_set(names[i].name, std::move(cells));
  }
}

void ExodusReader::read_block(const NetcdfVariable& connect, const std::string& name, Block& block) {
  const ExodusElementType* const type = exodus_element_type(connect.elem_type);
  const std::string what = "block '" + echoed(name) + "' has " + std::to_string(block.count) + " elements of type '" +
                           printable(connect.elem_type) + "', ";
  const bool is_linear_pyramid = connect.shape.size() == 2 && connect.shape[1] == kPyramidCorners;
  if (type == nullptr || (type->role == ExodusRole::kPyramid && !is_linear_pyramid)) {
    throw Error(ErrorCode::kMeshUnsupportedCell,
                what + (type == nullptr ? "which isn't read: save the part with hexahedra, tetrahedra or wedges"
                                        : "pyramids, of which only those of 5 nodes are read: save the mesh in first "
                                          "order, or without pyramids"));
  }
  if (type->role == ExodusRole::kFlat) {
    flat_ += block.count;
    return;
  }
  read_cells(connect, *type, block);
}

void ExodusReader::read_cells(const NetcdfVariable& connect, const ExodusElementType& type, Block& block) {
  ControlMesh& mesh = file_.mesh;
  const bool pyramids = type.role == ExodusRole::kPyramid;
  const auto corners = pyramids ? kPyramidCorners : static_cast<std::uint64_t>(corner_count(type.kind));
  const std::uint64_t nodes = connect.shape.size() == 2 ? connect.shape[1] : 0;
  if (nodes < corners) fail(connect, "has too few nodes for elements of type '" + printable(connect.elem_type) + "'");
  const NetcdfNumbers numbers = numbers_of(connect, {block.count, nodes});
  if (block.count > limits_.max_cells - mesh.cell_count()) {
    throw Error(ErrorCode::kMeshTooLarge,
                "the file has more than " + std::to_string(limits_.max_cells) + " cells, the most that are allowed");
  }
  block.cells = true;
  const std::span<const std::uint8_t> places = exodus_mid_nodes(type.kind, nodes);
  if (nodes > corners && places.empty()) crooked_ += block.count;
  std::vector<std::uint32_t> mid_nodes(places.size());
  std::vector<std::uint64_t> others;  // Places of nodes that are left out.
  for (std::uint64_t i = corners; i < nodes; ++i) {
    if (std::ranges::find(places, i) == places.end()) others.push_back(i);
  }
  if (!places.empty() && !others.empty()) with_other_nodes_ += block.count;
  for (std::uint64_t cell = 0; cell < block.count; ++cell) {
    const std::uint64_t first = cell * nodes;
    for (std::uint64_t corner = 0; corner < corners; ++corner) {
      mesh.cell_vertices.push_back(vertex(numbers, first + corner));
    }
    if (pyramids) mesh.cell_vertices.insert(mesh.cell_vertices.end(), 3, mesh.cell_vertices.back());
    std::ranges::transform(places, mid_nodes.begin(), [&](std::uint8_t place) {
      return place == exodus_tables::kNo ? kNone : vertex(numbers, first + place);
    });
    if (!places.empty()) {
      add_second_order_cell(static_cast<std::uint32_t>(mesh.cell_count()), mid_nodes, file_.second_order);
    }
    for (const std::uint64_t place : others) file_.left_out_nodes.push_back(vertex(numbers, first + place));
    mesh.cell_kinds.push_back(type.kind);
  }
}

/// The vertex that number i of an element block names.
std::uint32_t ExodusReader::vertex(const NetcdfNumbers& numbers, std::uint64_t i) const {
  const double node = numbers[i];
  if (!(node >= 1 && node <= static_cast<double>(file_.mesh.vertex_count()))) {
    netcdf_.place().fail_at(numbers.byte(i), ErrorCode::kMeshIndexOutOfRange,
                            "a cell uses node " + number_text(node) + "; the file has nodes 1 to " +
                                std::to_string(file_.mesh.vertex_count()));
  }
  return static_cast<std::uint32_t>(node) - 1;
}

void ExodusReader::read_element_sets() {
  SetMembers members(file_.mesh.cell_count(), "element sets");
  const std::vector<Named> names = names_of("els_names", "els_prop1");
  for (std::size_t i = 0; i < names.size(); ++i) {
    const NetcdfVariable* const elements = netcdf_.variable("elem_els" + std::to_string(i + 1));
    if (elements == nullptr) continue;
    const NetcdfNumbers numbers = netcdf_.numbers(*elements);
    std::vector<std::uint32_t> cells;
    for (std::uint64_t k = 0; k < numbers.size(); ++k) {
      if (const std::optional<std::uint32_t> cell = cell_of(numbers[k])) members.add(*cell, cells);
    }
    add_to_set(names[i].name, std::move(cells));
  }
}

/// Blocks and sets of the same name are one set.
void ExodusReader::add_to_set(const std::string& name, std::vector<std::uint32_t> cells) {
  if (cells.empty()) return;
  const auto [place, is_new] = set_of_.try_emplace(name, file_.cell_sets.size());
  if (is_new) file_.cell_sets.push_back({name, {}});
  std::vector<std::uint32_t>& all = file_.cell_sets[place->second].cells;
  all.insert(all.end(), cells.begin(), cells.end());
}

/// The cell that an element is, counted from 1 through all blocks.
std::optional<std::uint32_t> ExodusReader::cell_of(double element) const {
  const std::optional<std::int64_t> number = exact_integer(element);
  if (!number || *number < 1) return std::nullopt;
  const auto index = static_cast<std::uint64_t>(*number) - 1;
  const auto after = std::ranges::upper_bound(blocks_, index, {}, &Block::first_element);
  if (after == blocks_.begin()) return std::nullopt;
  const Block& block = *(after - 1);
  const std::uint64_t offset = index - block.first_element;
  if (!block.cells || offset >= block.count) return std::nullopt;
  return block.first_cell + static_cast<std::uint32_t>(offset);
}

void ExodusReader::read_own_numbers() {
  const std::uint64_t elements = blocks_.empty() ? 0 : blocks_.back().first_element + blocks_.back().count;
  const std::vector<std::uint64_t> map = map_of("elem_num_map", elements);
  file_.numbers = {"node", "element", map_of("node_num_map", file_.mesh.vertex_count()), {}};
  for (const Block& block : blocks_) {
    for (std::uint64_t i = block.first_element; block.cells && i < block.first_element + block.count; ++i) {
      file_.numbers.cells.push_back(map.empty() ? i + 1 : map[i]);
    }
  }
  if (!file_.numbers.vertices.empty()) return;
  file_.numbers.vertices.resize(file_.mesh.vertex_count());
  std::iota(file_.numbers.vertices.begin(), file_.numbers.vertices.end(), std::uint64_t{1});
}

/// The numbers that the file gives its nodes or elements; none if it doesn't, or if they are no such numbers.
std::vector<std::uint64_t> ExodusReader::map_of(const std::string& name, std::uint64_t count) {
  std::vector<std::uint64_t> map;
  const NetcdfVariable* const variable = netcdf_.variable(name);
  if (variable == nullptr || count == 0) return map;
  if (std::ranges::equal(variable->shape, std::initializer_list<std::uint64_t>{count})) {
    const NetcdfNumbers numbers = netcdf_.numbers(*variable);
    for (std::uint64_t i = 0; i < numbers.size(); ++i) {
      const std::optional<std::int64_t> number = exact_integer(numbers[i]);
      if (!number || *number < 1) break;
      map.push_back(static_cast<std::uint64_t>(*number));
    }
  }
  if (map.size() == count) return map;
  file_.warnings.push_back("numbers in '" + name + "' left out, messages count from 1: they aren't " +
                           std::to_string(count) + " whole numbers from 1 to 2^53");
  return {};
}

/// In old files one array holds all variables.
void ExodusReader::read_nodal_variables() {
  const std::uint64_t nodes = file_.mesh.vertex_count();
  std::vector<NamedChannel> channels;
  const std::vector<Named> names = names_of("name_nod_var", {});
  const NetcdfVariable* const packed = netcdf_.variable("vals_nod_var");
  std::optional<NetcdfNumbers> all;
  if (packed != nullptr && packed->has_records) all = numbers_of(*packed, {names.size(), nodes});
  for (std::size_t i = 0; i < names.size(); ++i) {
    const NetcdfVariable* const own = netcdf_.variable("vals_nod_var" + std::to_string(i + 1));
    if (own != nullptr && own->has_records) {
      add_channel(names[i].name, numbers_of(*own, {nodes}), 0, channels);
    } else if (all) {
      add_channel(names[i].name, *all, i * nodes, channels);
    }
  }
  append_file_channels(std::move(channels), limits_, file_);
}

void ExodusReader::add_channel(const std::string& name, const NetcdfNumbers& numbers, std::uint64_t first,
                               std::vector<NamedChannel>& channels) {
  if (numbers.size() == 0) return;  // No time step.
  NamedChannel channel{name, {}};
  for (std::uint64_t node = 0; node < file_.mesh.vertex_count(); ++node) {
    const std::uint64_t i = first + node;
    channel.values.push_back(unfit_.value(numbers[i], node, "a value", numbers.byte(i), {}));
  }
  channels.push_back(std::move(channel));
}

void ExodusReader::read_element_variables() {
  file_.cell_numbers.push_back({"block", std::move(block_ids_)});
  const std::vector<Named> names = names_of("name_elem_var", {});
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::string what = "variable '" + echoed(names[i].name) + "' at elements left out: ";
    if (i >= kMostVariables) {
      file_.warnings.push_back(what + "more than " + std::to_string(kMostVariables) + " of them");
      continue;
    }
    std::uint64_t lacking = 0;
    std::vector<double> numbers = numbers_of_cells(i + 1, lacking);
    if (lacking == 0) {
      file_.cell_numbers.push_back({names[i].name, std::move(numbers)});
    } else {
      file_.warnings.push_back(what + std::to_string(lacking) + " cells have no value in it");
    }
  }
}

std::vector<double> ExodusReader::numbers_of_cells(std::uint64_t variable, std::uint64_t& lacking) {
  std::vector<double> of_cells;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    if (!blocks_[i].cells) continue;
    const std::string name = "vals_elem_var" + std::to_string(variable) + "eb" + std::to_string(i + 1);
    const NetcdfVariable* const values = netcdf_.variable(name);
    const bool has_step = values != nullptr && values->has_records && netcdf_.record_count() > 0;
    if (!has_step) {
      lacking += blocks_[i].count;
      continue;
    }
    const NetcdfNumbers numbers = numbers_of(*values, {blocks_[i].count});
    for (std::uint64_t k = 0; k < numbers.size(); ++k) of_cells.push_back(numbers[k]);
  }
  return of_cells;
}

void ExodusReader::warn() {
  const auto note = [&](std::uint64_t count, const std::string& text) {
    if (count > 0) file_.warnings.push_back(std::to_string(count) + " " + text);
  };
  note(flat_, "points, lines, faces and shells left out");
  note(with_other_nodes_, "cells have nodes in the middle of triangles or of themselves, which are left out");
  note(crooked_, "cells with more nodes than corners taken by their corners: curved edges become straight");
  note(count_of("num_node_sets"), "sets of nodes left out");
  note(count_of("num_side_sets"), "sets of sides left out");
  const bool has_values = file_.mesh.channel_count() > 0 || file_.cell_numbers.size() > 1;
  if (has_values && netcdf_.record_count() > 1) {
    file_.warnings.push_back("the last of " + std::to_string(netcdf_.record_count()) +
                             " time steps taken, the others left out");
  }
}

}  // namespace

MeshFile read_exodus(std::string_view bytes, const MeshLimits& limits) { return ExodusReader(bytes, limits).read(); }

}  // namespace ccslice
