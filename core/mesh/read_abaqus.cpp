// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/read_abaqus.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/mesh/abaqus_lines.h"
#include "core/mesh/abaqus_sets.h"
#include "core/mesh/abaqus_types.h"
#include "core/mesh/node_numbers.h"
#include "core/mesh/text_scanner.h"
#include "core/mesh/used_vertices.h"

namespace ccslice {
namespace {

/// What Abaqus makes nodes and elements of, or moves them by, when it runs.
constexpr std::string_view kGenerators[] = {"NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM"};
constexpr std::string_view kSets[] = {"NSET", "SURFACE"};
/// Without a note: they hold no data of their own.
constexpr std::string_view kSilent[] = {"HEADING", "PREPRINT", "ENDPART", "ENDINSTANCE", "ENDASSEMBLY", "ENDSTEP"};

bool is_one_of(std::span<const std::string_view> names, std::string_view name) {
  return std::ranges::find(names, name) != names.end();
}

struct Part {
  std::string name;
  NodeNumbers nodes;
  std::vector<Vec3> positions;
  UnfitNumbers unfit;
  std::vector<CellKind> kinds;
  std::vector<std::uint64_t> numbers, cell_marks;  // Of each cell: its number, and its place in the file.
  std::vector<std::uint64_t> corners;              // Numbers of nodes.
};

struct Instance {
  std::string name;  // As names are compared.
  std::size_t part = 0;
  Placement placement = Placement::Identity();
  int lines = 0;  // Of the placement that have come.
};

class AbaqusReader {
 public:
  AbaqusReader(std::string_view bytes, const MeshLimits& limits, const std::string& path)
      : lines_(bytes, path), limits_(limits) {}

  MeshFile read();

 private:
  enum class Data { kSkipped, kNodes, kCells, kPlacement, kSet };

  Part& part() { return parts_[current_]; }
  void read_keyword();
  void open_node(const AbaqusKeyword& keyword);
  void open_elements(const AbaqusKeyword& keyword);
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
  void read_placement();
  void place_all();
  void add_instance(std::size_t number, const Instance& instance);
  void warn();

  AbaqusLines lines_;
  const MeshLimits& limits_;
  std::vector<Part> parts_ = std::vector<Part>(1);  // The first one is what stands outside of parts.
  std::vector<Instance> instances_;
  std::size_t current_ = 0;
  bool in_instance_ = false;  // One without a mesh of its own so far.
  Data data_ = Data::kSkipped;
  AbaqusSolidType type_{};
  std::string type_name_;
  std::vector<std::uint64_t> cell_;  // An element's number and its nodes, as far as they have come.
  std::uint64_t second_order_ = 0, cells_ = 0, nodes_ = 0;
  AbaqusSets sets_;
  std::optional<std::size_t> set_;  // That of the elements or data lines at hand.
  AbaqusScope members_;             // Of the data lines.
  bool generates_ = false;
  std::vector<PlacedElements> placed_;
  std::set<std::string> other_sets_, unknown_sets_, other_types_, other_keywords_;
  MeshFile file_;
};

MeshFile AbaqusReader::read() {
  while (lines_.next()) lines_.is_keyword() ? read_keyword() : read_data();
  require_whole_cell();
  if (nodes_ == 0) throw Error(ErrorCode::kMeshEmpty, "the file has no *NODE; write the nodes into it");
  if (cells_ == 0) {
    throw Error(ErrorCode::kMeshEmpty, "the file has no solid elements (C3D4, C3D6, C3D8, ...); " + kNeedsVolumeCells);
  }
  place_all();
  const AbaqusSets::LeftOut left_out = sets_.finish(placed_, file_);
  for (const std::string& name : left_out.empty) other_sets_.insert(printable(name));
  for (const std::string& name : left_out.unknown) unknown_sets_.insert(printable(name));
  leave_out_unused_vertices({}, TextScanner(""), file_);
  warn();
  return std::move(file_);
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
  if (keyword.name == "SOLIDSECTION") return read_section(keyword);
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
  const std::optional<std::size_t> nodes = abaqus_solid_nodes(type_name_);
  if (!nodes) {
    other_types_.insert(printable(type_name_));
    other_sets_.insert(printable(keyword.value_of("ELSET")));
    return;
  }
  const auto* found = std::ranges::find_if(kAbaqusSolidTypes, [&](const AbaqusSolidType& type) {
    return *nodes >= type.nodes && *nodes <= type.most_nodes;
  });
  if (found == std::end(kAbaqusSolidTypes) || !found->kind) {
    const bool pyramid = found != std::end(kAbaqusSolidTypes);
    lines_.fail_at(
        lines_.mark(), ErrorCode::kMeshUnsupportedCell,
        "elements of type " + printable(type_name_) +
            (pyramid ? " are pyramids; a pyramid never refines to hexahedra: split it into tetrahedra"
                     : " are not known; hexahedra, tetrahedra and wedges of first and second order are read"));
  }
  own_part();
  data_ = Data::kCells;
  type_ = *found;
  const std::string_view set = keyword.value_of("ELSET");
  set_.reset();
  if (!set.empty()) set_ = sets_.open(scope(), set);
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
  const auto same = [&](const Part& part) { return equals_ignoring_case(part.name, name); };
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
                                  [&](const Part& part) { return equals_ignoring_case(part.name, name); });
  if (found == parts_.end()) {
    lines_.fail_at(lines_.mark(), ErrorCode::kFileSyntax,
                   "an instance of part " + in_quotes(printable(name)) + ", which hasn't come: put *PART before it");
  }
  current_ = static_cast<std::size_t>(found - parts_.begin());
  in_instance_ = true;
  instances_.push_back({abaqus_key(keyword.value_of("NAME")), current_});
  data_ = Data::kPlacement;
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
    case Data::kPlacement: return read_placement();
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

/// The line has the number and the nodes, which go on in the next line if they don't fit into one.
void AbaqusReader::read_cell() {
  const std::vector<std::string_view>& entries = lines_.entries();
  const bool goes_on = entries.back().empty();
  for (std::size_t i = 0; i + (goes_on ? 1 : 0) < entries.size(); ++i) {
    if (cell_.size() == type_.most_nodes + 1) {
      lines_.fail_at(lines_.mark(), ErrorCode::kFileSyntax,
                     "element " + std::to_string(cell_[0]) + " of type " + printable(type_name_) + " has more than " +
                         std::to_string(type_.most_nodes) + " nodes");
    }
    cell_.push_back(lines_.count(entries[i], cell_.empty() ? "an element's number" : "a node's number"));
  }
  const bool may_end = cell_.size() > type_.nodes && !goes_on;
  if (may_end || cell_.size() == type_.most_nodes + 1) finish_cell();
}

void AbaqusReader::finish_cell() {
  if (++cells_ > limits_.max_cells) {
    lines_.fail_at(lines_.mark(), ErrorCode::kMeshTooLarge,
                   "more than " + std::to_string(limits_.max_cells) + " cells");
  }
  if (set_) sets_.add(*set_, cell_[0]);
  part().kinds.push_back(*type_.kind);
  part().numbers.push_back(cell_[0]);
  part().corners.insert(part().corners.end(), cell_.begin() + 1, cell_.begin() + 1 + corner_count(*type_.kind));
  part().cell_marks.push_back(lines_.mark());
  second_order_ += type_.second_order;
  cell_.clear();
}

void AbaqusReader::require_whole_cell() {
  if (cell_.empty()) return;
  lines_.fail_at(lines_.mark(), ErrorCode::kFileSyntax,
                 "element " + std::to_string(cell_[0]) + " of type " + printable(type_name_) + " has " +
                     std::to_string(cell_.size() - 1) + " nodes instead of " + std::to_string(type_.nodes));
}

/// A translation; then two points of an axis and an angle in degrees.
void AbaqusReader::read_placement() {
  const std::vector<std::string_view>& entries = lines_.entries();
  std::array<double, 7> numbers{};
  for (std::size_t i = 0; i < numbers.size() && i < entries.size(); ++i) {
    numbers[i] = lines_.any_real(entries[i], "a number of the instance's placement");
    if (!std::isfinite(numbers[i])) {
      lines_.fail_at(lines_.mark(), ErrorCode::kMeshNonFinite,
                     in_quotes(printable(entries[i])) + " is not a finite number; give the instance a place");
    }
  }
  Instance& instance = instances_.back();
  const Vec3 a(numbers[0], numbers[1], numbers[2]), b(numbers[3], numbers[4], numbers[5]);
  if (++instance.lines == 1) {
    instance.placement = Eigen::Translation3d(a);
    return;
  }
  if (instance.lines > 2) lines_.fail("a keyword behind the instance's translation and rotation", entries[0]);
  if (numbers[6] == 0) return;
  if (a == b) lines_.fail("two different points of the axis of rotation", "the same");
  const Eigen::AngleAxisd turn(numbers[6] * std::numbers::pi / 180, (b - a).normalized());
  instance.placement = Eigen::Translation3d(a) * turn * Eigen::Translation3d(-a) * instance.placement;
}

void AbaqusReader::place_all() {
  for (Part& part : parts_) {
    if (const auto twin = part.nodes.sort()) {
      lines_.fail_at(twin->mark, ErrorCode::kFileSyntax,
                     "node " + std::to_string(twin->number) + " comes twice; number the nodes anew");
    }
  }
  add_instance(0, {});
  std::vector<bool> placed(parts_.size(), false);
  for (const Instance& instance : instances_) {
    add_instance(instance.part, instance);
    placed[instance.part] = true;
  }
  for (std::size_t i = 1; i < parts_.size(); ++i) {
    if (placed[i] || parts_[i].kinds.empty()) continue;
    if (instances_.empty()) {
      add_instance(i, {});
    } else {
      file_.warnings.push_back("part " + in_quotes(printable(parts_[i].name)) + " left out: it has no instance");
    }
  }
}

void AbaqusReader::add_instance(std::size_t number, const Instance& instance) {
  const Part& part = parts_[number];
  ControlMesh& mesh = file_.mesh;
  placed_.push_back({{number, instance.name}, part.numbers, static_cast<std::uint32_t>(mesh.cell_count())});
  const std::size_t base = mesh.vertex_count();
  if (base + part.positions.size() > limits_.max_vertices ||
      mesh.cell_count() + part.kinds.size() > limits_.max_cells) {
    throw Error(ErrorCode::kMeshTooLarge, "the instances have more than " + std::to_string(limits_.max_vertices) +
                                              " nodes or " + std::to_string(limits_.max_cells) + " cells together");
  }
  for (const Vec3& position : part.positions) mesh.positions.push_back(instance.placement * position);
  std::vector<bool> used(part.positions.size(), false);
  std::size_t corner = 0;
  for (std::size_t cell = 0; cell < part.kinds.size(); ++cell) {
    for (int i = 0; i < corner_count(part.kinds[cell]); ++i) {
      const std::uint64_t number = part.corners[corner++];
      const std::optional<std::uint32_t> node = part.nodes.index_of(number);
      if (!node) {
        lines_.fail_at(part.cell_marks[cell], ErrorCode::kMeshIndexOutOfRange,
                       "an element uses node " + std::to_string(number) + ", which its part doesn't have");
      }
      used[*node] = true;
      mesh.cell_vertices.push_back(static_cast<std::uint32_t>(base + *node));
    }
  }
  if (const auto complaint = part.unfit.first_used(used)) {
    lines_.fail_at(complaint->mark, ErrorCode::kMeshNonFinite, complaint->message);
  }
  mesh.cell_kinds.insert(mesh.cell_kinds.end(), part.kinds.begin(), part.kinds.end());
}

void AbaqusReader::warn() {
  const auto note = [&](const std::string& what, std::set<std::string>& names) {
    names.erase("");
    if (names.empty()) return;
    const std::vector<std::string> all(names.begin(), names.end());
    file_.warnings.push_back(what + " left out: " + echoed_list(all, all.size()));
  };
  const auto solids =
      std::ranges::count_if(instances_, [&](const Instance& instance) { return !parts_[instance.part].kinds.empty(); });
  if (solids > 1) {
    file_.warnings.push_back(std::to_string(solids) +
                             " instances placed; they stay separate parts, also where they touch");
  }
  if (second_order_ > 0) {
    file_.warnings.push_back(std::to_string(second_order_) +
                             " cells of second order taken by their corners: curved edges become straight");
  }
  note("elements of types", other_types_);
  note("sets", other_sets_);
  note("members of sets, for no set of that name stands before them,", unknown_sets_);
  note("keywords", other_keywords_);
}

}  // namespace

MeshFile read_abaqus(std::string_view bytes, const MeshLimits& limits, const std::string& path) {
  return AbaqusReader(bytes, limits, path).read();
}

}  // namespace ccslice
