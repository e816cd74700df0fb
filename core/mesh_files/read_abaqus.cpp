// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_abaqus.h"
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/similar_name.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/abaqus_lines.h"
#include "core/mesh_files/abaqus_parts.h"
#include "core/mesh_files/abaqus_sets.h"
#include "core/mesh_files/abaqus_types.h"
#include "core/mesh_import/collapsed_cells.h"
#include "core/mesh_import/text_scanner.h"
#include "core/mesh_import/used_vertices.h"

namespace ccslice {
namespace {

/// What Abaqus makes nodes and elements of, or moves them by, when it runs.
constexpr std::string_view kGenerators[] = {"NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM"};
constexpr std::string_view kSets[] = {"NSET", "SURFACE"};
constexpr std::string_view kSections[] = {"SOLIDSECTION", "COHESIVESECTION", "GASKETSECTION", "SHELLSECTION",
                                          "FLUIDSECTION"};
/// Without a note: they hold no data of their own.
constexpr std::string_view kSilent[] = {"HEADING", "PREPRINT", "ENDPART", "ENDINSTANCE", "ENDASSEMBLY", "ENDSTEP"};

bool is_one_of(std::span<const std::string_view> names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

class AbaqusReader {
 public:
  AbaqusReader(std::string_view bytes, const MeshLimits& limits, const FileOrigin& origin)
      : lines_(bytes, origin), limits_(limits) {}

  MeshFile read();

 private:
  enum class Data { kSkipped, kNodes, kCells, kCounted, kPlacement, kSet };

  AbaqusPart& part() { return parts_[current_]; }
  void read_keyword();
  void open_node(const AbaqusKeyword& keyword);
  void open_elements(const AbaqusKeyword& keyword);
  void count_elements(const AbaqusKeyword& keyword, const std::string& why);
  void open_set(const AbaqusKeyword& keyword);
  void read_section(const AbaqusKeyword& keyword);
  AbaqusScope scope() const;
  void open_part(const AbaqusKeyword& keyword);
  void open_instance(const AbaqusKeyword& keyword);
  void own_part();
  void read_data();
  void read_node();
  void read_cell();
  void finish_cell();
  void require_whole_cell();
  void count_cell();
  void require_solids(std::uint64_t cells) const;
  void warn();

  AbaqusLines lines_;
  const MeshLimits& limits_;
  std::vector<AbaqusPart> parts_ = std::vector<AbaqusPart>(1);  // The first one is what stands outside of parts.
  std::vector<AbaqusInstance> instances_;
  std::size_t current_ = 0;
  bool in_instance_ = false;  // One without a mesh of its own so far.
  Data data_ = Data::kSkipped;
  AbaqusSolidType type_{};
  std::string type_name_;
  std::set<std::string> flat_names_;  // Of types whose cells may be flat.
  std::vector<std::uint64_t> cell_;   // An element's number and its nodes, as far as they have come.
  std::uint64_t cell_mark_ = 0;       // Of the last line that has come of it.
  std::uint64_t* counted_ = nullptr;  // Elements of the type at hand that are left out.
  bool goes_on_ = false;              // The line before ends with a comma.
  std::uint64_t cells_ = 0, nodes_ = 0;
  AbaqusSets sets_;
  std::optional<std::size_t> set_;  // That of the elements or data lines at hand.
  AbaqusScope members_;             // Of the data lines.
  bool generates_ = false;
  std::set<std::string> other_sets_, unknown_sets_, other_keywords_;
  /// How many elements are left out, by their types, and by why if they may hold volume.
  std::map<std::string, std::uint64_t> other_types_;
  std::map<std::pair<std::string, std::string>, std::uint64_t> missing_;
  MeshFile file_;
};

MeshFile AbaqusReader::read() {
  while (lines_.next()) lines_.is_keyword() ? read_keyword() : read_data();
  require_whole_cell();
  if (nodes_ == 0) throw Error(ErrorCode::kMeshEmpty, "the file has no *NODE; write the nodes into it");
  require_solids(cells_);
  file_.numbers = {"node", "element", {}, {}};
  AbaqusPlacer placer(lines_, limits_, file_);
  placer.place(parts_, instances_);
  require_solids(file_.mesh.cell_count());
  const AbaqusSets::LeftOut left_out = sets_.finish(placer.placed(), file_);
  for (const std::string& name : left_out.empty) other_sets_.insert(printable(name));
  for (const std::string& name : left_out.unknown) unknown_sets_.insert(printable(name));
  leave_out_unused_vertices({}, TextScanner(""), file_);
  warn();
  return std::move(file_);
}

/// Throws if there are none, with what there is instead.
void AbaqusReader::require_solids(std::uint64_t cells) const {
  if (cells > 0) return;
  std::vector<std::string> others;
  for (const auto& [type, count] : other_types_) others.push_back(type);
  for (const auto& [type_and_why, count] : missing_) others.push_back(type_and_why.first);
  std::string what = "the file has no solid elements (C3D4, C3D6, C3D8, ...)";
  if (!others.empty()) what += ", but elements of types " + echoed_list(others, others.size());
  for (const std::string& warning : file_.warnings) what += "; " + warning;
  throw Error(ErrorCode::kMeshEmpty, what + "; " + kNeedsVolumeCells);
}

void AbaqusReader::read_keyword() {
  require_whole_cell();
  data_ = Data::kSkipped;
  const AbaqusKeyword keyword = lines_.keyword();
  if (keyword.name == "NODE") return open_node(keyword);
  if (keyword.name == "ELEMENT") return open_elements(keyword);
  if (keyword.name == "INCLUDE") return lines_.include(keyword.value_of("INPUT"));
  if (keyword.name == "PART") return open_part(keyword);
  if (keyword.name == "INSTANCE") return open_instance(keyword);
  if (keyword.name == "ASSEMBLY" || keyword.name == "ENDPART" || keyword.name == "ENDINSTANCE") {
    current_ = 0;
    in_instance_ = false;
    return;
  }
  if (is_one_of(kGenerators, keyword.name)) {
    lines_.fail_at(lines_.mark(), ErrorCode::kFileUnsupported,
                   "*" + keyword.name +
                       " makes or moves nodes or elements when Abaqus runs, which is not read; write "
                       "the whole mesh into the file, as Abaqus/CAE does");
  }
  if (keyword.name == "ELSET") return open_set(keyword);
  if (is_one_of(kSections, keyword.name)) return read_section(keyword);
  if (is_one_of(kSets, keyword.name)) {
    for (const char* parameter : {"NSET", "NAME"}) other_sets_.insert(printable(keyword.value_of(parameter)));
  } else if (!is_one_of(kSilent, keyword.name)) {
    other_keywords_.insert(std::string(1, '*').append(printable(keyword.name)));
  }
}

void AbaqusReader::open_node(const AbaqusKeyword& keyword) {
  const std::string_view system = keyword.value_of("SYSTEM");
  if (!system.empty() && !equals_ignoring_case(system, "R")) {
    lines_.fail_at(lines_.mark(), ErrorCode::kFileUnsupported,
                   "coordinates in SYSTEM=" + printable(system) + " are not read; write rectangular ones");
  }
  own_part();
  data_ = Data::kNodes;
  other_sets_.insert(printable(keyword.value_of("NSET")));
  if (const std::string_view input = keyword.value_of("INPUT"); !input.empty()) lines_.include(input);
}

void AbaqusReader::open_elements(const AbaqusKeyword& keyword) {
  type_name_.clear();
  for (const char c : keyword.value_of("TYPE"))
    type_name_ += c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  if (type_name_.empty()) lines_.fail("the type of the elements (TYPE=...)", "none");
  if (const std::string_view input = keyword.value_of("INPUT"); !input.empty()) lines_.include(input);
  const AbaqusElementType element = abaqus_element_type(type_name_);
  if (element.role == AbaqusRole::kFlat) return count_elements(keyword, {});
  if (element.role == AbaqusRole::kAmbiguous) {
    return count_elements(keyword, "they are tetrahedra in CalculiX, and surfaces in Abaqus; write tetrahedra as C3D4");
  }
  if (element.role == AbaqusRole::kUnread) {
    return count_elements(keyword, "cells of that kind aren't read, so the volume that they hold is missing");
  }
  if (keyword.has("OFFSET")) {
    return count_elements(keyword,
                          "half of their nodes come of OFFSET, which isn't read, so the volume that they hold "
                          "is missing; write all of their nodes");
  }
  const std::optional<AbaqusSolidType> solid = abaqus_solid(element);
  const bool is_linear_pyramid = solid && solid->nodes == kPyramidCorners;
  if (!solid || (!solid->kind && !is_linear_pyramid)) {
    lines_.fail_at(lines_.mark(), ErrorCode::kMeshUnsupportedCell,
                   "elements of type " + printable(type_name_) +
                       (solid ? " are pyramids, of which only those of 5 nodes are read"
                              : " are not known; hexahedra, tetrahedra and wedges of first and second order are read"));
  }
  own_part();
  data_ = Data::kCells;
  type_ = *solid;
  if (is_linear_pyramid) type_.kind = CellKind::kHex;
  if (type_.may_be_flat) flat_names_.insert(type_name_);
  const std::string_view set = keyword.value_of("ELSET");
  set_.reset();
  if (!set.empty()) set_ = sets_.open(scope(), set);
}

/// Of what they are the file says no more than their type, unless there is a reason why they aren't cells.
void AbaqusReader::count_elements(const AbaqusKeyword& keyword, const std::string& why) {
  data_ = Data::kCounted;
  goes_on_ = false;
  const std::string type = printable(type_name_);
  counted_ = why.empty() ? &other_types_[type] : &missing_[{type, why}];
  other_sets_.insert(printable(keyword.value_of("ELSET")));
}

void AbaqusReader::count_cell() {
  const bool is_blank = lines_.entries().size() == 1 && lines_.entries()[0].empty();
  *counted_ += !goes_on_ && !is_blank;
  goes_on_ = lines_.entries().back().empty() && !is_blank;
}

/// Sets that Abaqus/CAE makes for itself (INTERNAL) are what its sections name; nobody else wants them.
void AbaqusReader::open_set(const AbaqusKeyword& keyword) {
  const std::string_view name = keyword.value_of("ELSET");
  if (name.empty()) lines_.fail("the name of the set (ELSET=...)", "none");
  const std::string instance = abaqus_key(keyword.value_of("INSTANCE"));
  set_ = keyword.has("INTERNAL") ? sets_.open_internal(scope(), name) : sets_.open(scope(), name);
  members_ = instance.empty() ? scope() : AbaqusScope{0, instance};
  generates_ = keyword.has("GENERATE");
  data_ = Data::kSet;
}

/// Its data line, the thickness of some elements, is nothing to a solid.
void AbaqusReader::read_section(const AbaqusKeyword& keyword) {
  const std::string_view set = keyword.value_of("ELSET"), material = keyword.value_of("MATERIAL");
  if (!set.empty() && !material.empty()) sets_.add_section(scope(), set, material);
}

/// The scope of a set that is opened here: in a part, in an instance, or outside of both.
AbaqusScope AbaqusReader::scope() const {
  if (in_instance_) return {0, instances_.back().name};
  return {current_, {}};
}

void AbaqusReader::open_part(const AbaqusKeyword& keyword) {
  const std::string_view name = keyword.value_of("NAME");
  if (name.empty()) lines_.fail("the name of the part (NAME=...)", "none");
  const auto same = [&](const AbaqusPart& part) { return equals_ignoring_case(part.name, name); };
  if (std::any_of(parts_.begin() + 1, parts_.end(), same)) {
    lines_.fail_at(lines_.mark(), ErrorCode::kFileSyntax,
                   "a second part " + in_quotes(printable(name)) + "; rename one of them");
  }
  current_ = parts_.size();
  in_instance_ = false;
  parts_.emplace_back().name = name;
}

void AbaqusReader::open_instance(const AbaqusKeyword& keyword) {
  const std::string_view name = keyword.value_of("PART");
  if (name.empty()) {
    lines_.fail_at(lines_.mark(), ErrorCode::kFileUnsupported,
                   "an instance without PART=..., from another analysis, is not read; write its part into this file");
  }
  const auto found = std::find_if(parts_.begin() + 1, parts_.end(),
                                  [&](const AbaqusPart& part) { return equals_ignoring_case(part.name, name); });
  if (found == parts_.end()) {
    lines_.fail_at(lines_.mark(), ErrorCode::kFileSyntax,
                   "an instance of part " + in_quotes(printable(name)) + ", which hasn't come: put *PART before it");
  }
  current_ = static_cast<std::size_t>(found - parts_.begin());
  in_instance_ = true;
  instances_.push_back({abaqus_key(keyword.value_of("NAME")), current_});
  data_ = Data::kPlacement;
  const std::string_view all = keyword.value_of("ELSET");
  if (!all.empty() && !instances_.back().name.empty()) {
    sets_.add_instance(sets_.open(AbaqusScope{}, all), instances_.back().name);
  }
}

/// An instance may have a mesh of its own, in the part's coordinates and with numbers of its own.
void AbaqusReader::own_part() {
  if (!in_instance_) return;
  in_instance_ = false;
  current_ = parts_.size();
  parts_.emplace_back();
  instances_.push_back({instances_.back().name, current_, instances_.back().placement});
}

void AbaqusReader::read_data() {
  switch (data_) {
    case Data::kNodes: return read_node();
    case Data::kCells: return read_cell();
    case Data::kCounted: return count_cell();
    case Data::kPlacement: return read_placement(lines_, instances_.back());
    case Data::kSet: return sets_.add_entries(*set_, members_, generates_, lines_);
    case Data::kSkipped: return;
  }
}

/// The line has the number and the coordinates; the direction of a normal may follow.
void AbaqusReader::read_node() {
  const std::vector<std::string_view>& entries = lines_.entries();
  if (entries.size() == 1 && entries[0].empty()) return;
  const std::uint64_t number = lines_.count(entries[0], "a node's number");
  if (++nodes_ > limits_.max_vertices) {
    lines_.fail_at(lines_.mark(), ErrorCode::kMeshTooLarge,
                   "more than " + std::to_string(limits_.max_vertices) + " nodes");
  }
  Vec3 position = Vec3::Zero();
  for (std::size_t axis = 0; axis < 3 && axis + 1 < entries.size(); ++axis) {
    constexpr std::string_view kWhat = "a coordinate";
    const std::string_view entry = entries[axis + 1];
    position[static_cast<Eigen::Index>(axis)] =
        part().unfit.coordinate(lines_.any_real(entry, kWhat), part().positions.size(), kWhat, lines_.mark(), entry);
  }
  part().nodes.add(number, lines_.mark());
  part().positions.push_back(position);
}

/// The line has the number and the nodes, which go on in the next line if they don't fit into one. A comma may stand
/// behind the last one, too; only elements that may have more nodes wait for the next line then.
void AbaqusReader::read_cell() {
  const std::vector<std::string_view>& entries = lines_.entries();
  std::size_t count = entries.size();
  while (count > 0 && entries[count - 1].empty()) --count;
  if (cell_.size() > type_.nodes && cell_.size() + count > type_.most_nodes + 1) finish_cell();
  for (std::size_t i = 0; i < count; ++i) {
    if (cell_.size() == type_.most_nodes + 1) {
      lines_.fail_at(lines_.mark(), ErrorCode::kFileSyntax,
                     "element " + std::to_string(cell_[0]) + " of type " + printable(type_name_) + " has more than " +
                         std::to_string(type_.most_nodes) +
                         " nodes; leave out the others, or name the type that has them");
    }
    const bool lacks_node = entries[i].empty() && cell_.size() > type_.nodes;  // Such a node of a face isn't there.
    cell_.push_back(lacks_node ? 0
                               : lines_.count(entries[i], cell_.empty() ? "an element's number" : "a node's number"));
  }
  cell_mark_ = lines_.mark();
  const bool may_end = cell_.size() > type_.nodes && count == entries.size();
  if (may_end || cell_.size() == type_.most_nodes + 1) finish_cell();
}

void AbaqusReader::finish_cell() {
  if (++cells_ > limits_.max_cells) {
    lines_.fail_at(cell_mark_, ErrorCode::kMeshTooLarge, "more than " + std::to_string(limits_.max_cells) + " cells");
  }
  if (type_.nodes == kPyramidCorners) cell_.insert(cell_.end(), 3, cell_.back());
  if (set_) sets_.add(*set_, cell_[0]);
  const std::string_view name = type_.may_be_flat ? std::string_view(*flat_names_.find(type_name_)) : "";
  part().cells.add(type_, name, cell_[0], std::span(cell_).subspan(1), cell_mark_);
  cell_.clear();
}

void AbaqusReader::require_whole_cell() {
  if (cell_.size() > type_.nodes) finish_cell();
  if (cell_.empty()) return;
  lines_.fail_at(lines_.mark(), ErrorCode::kFileSyntax,
                 "element " + std::to_string(cell_[0]) + " of type " + printable(type_name_) + " has " +
                     std::to_string(cell_.size() - 1) + " nodes instead of " + std::to_string(type_.nodes));
}

void AbaqusReader::warn() {
  const auto note = [&](const std::string& what, std::set<std::string>& names) {
    names.erase("");
    if (names.empty()) return;
    const std::vector<std::string> all(names.begin(), names.end());
    file_.warnings.push_back(what + " left out: " + echoed_list(all, all.size()));
  };
  const auto solids = std::ranges::count_if(
      instances_, [&](const AbaqusInstance& instance) { return !parts_[instance.part].cells.kinds.empty(); });
  if (solids > 1) {
    file_.warnings.push_back(std::to_string(solids) + " instances placed");
  }
  std::set<std::string> other_types;
  for (const auto& [type, count] : other_types_) other_types.insert(type + " (" + std::to_string(count) + ")");
  note("elements of types", other_types);
  for (const auto& [type_and_why, count] : missing_) {
    file_.warnings.push_back(std::to_string(count) + (count == 1 ? " element of type " : " elements of type ") +
                             type_and_why.first + " left out: " + type_and_why.second);
  }
  note("sets", other_sets_);
  note("members of sets, for no set of that name stands before them,", unknown_sets_);
  note("keywords", other_keywords_);
}

}  // namespace

MeshFile read_abaqus(std::string_view bytes, const MeshLimits& limits, const FileOrigin& origin) {
  return AbaqusReader(bytes, limits, origin).read();
}

}  // namespace ccslice
