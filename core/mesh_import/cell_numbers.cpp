// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/cell_numbers.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/contains.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/base/similar_name.h"
#include "core/mesh/offenders.h"
#include "core/mesh/validate.h"

namespace ccslice {

namespace {

constexpr std::string_view kAllSets = "sets", kAllMaterials = "materials";
constexpr std::uint8_t kInNone = 255;

constexpr const char* kNameSets = "name those that matter, and the rest becomes one region";

/// `cells`: those that the message names.
[[noreturn]] void refuse(const std::string& message, std::vector<std::int64_t> cells = {}) {
  throw Error(ErrorCode::kMeshBadCellRegion, message, "cell_regions", std::move(cells));
}

void check_count(const std::string& what, std::size_t count, const MeshLimits& limits, const char* remedy) {
  if (count <= limits.max_cell_regions) return;
  refuse(what + " more than " + std::to_string(limits.max_cell_regions) + ", which is the limit of cell regions; " +
         remedy);
}

void make_regions_of_numbers(const CellNumbers& numbers, ControlMesh& mesh, const MeshLimits& limits) {
  std::map<std::int64_t, std::uint8_t> regions;
  std::vector<std::int64_t> whole;
  for (const double number : numbers.of_cells) {
    const std::optional<std::int64_t> integer = exact_integer(number);
    if (!integer) {
      const auto cell = static_cast<std::int64_t>(whole.size());
      refuse("'" + echoed(numbers.name) + "' is " + number_text(number) + " in " + named_ids(kCells, {cell}) +
                 "; regions are made of whole numbers only",
             {cell});
    }
    whole.push_back(*integer);
    regions.try_emplace(*integer);
    check_count("'" + echoed(numbers.name) + "' has different numbers,", regions.size(), limits, "give the file fewer");
  }
  for (auto& [number, region] : regions) {
    region = static_cast<std::uint8_t>(mesh.cell_region_names.size());
    const auto name = numbers.number_names.find(number);
    mesh.cell_region_names.push_back(name == numbers.number_names.end() ? std::to_string(number) : name->second);
  }
  for (const std::int64_t number : whole) mesh.cell_regions.push_back(regions.at(number));
}

using SetsByName = std::map<std::string_view, const CellSet*>;

/// A set goes before a material of its name.
SetsByName sets_by_name(const MeshFile& file) {
  SetsByName sets;
  for (const std::vector<CellSet>* all : {&file.cell_sets, &file.cell_materials}) {
    for (const CellSet& set : *all) sets.emplace(set.name, &set);
  }
  return sets;
}

/// Parts the text at commas into names of sets, which may have commas themselves; none if there is no way. Of several
/// ways the one with the longest first name, then the longest second one, and so on.
std::vector<const CellSet*> part_into_sets(std::string_view names, const SetsByName& sets) {
  std::size_t longest = 0;
  for (const auto& [name, set] : sets) longest = std::max(longest, name.size());
  // By where a name may begin, from the end on: the longest set there after which there is a way to the end.
  std::map<std::size_t, const CellSet*> chosen;
  for (std::size_t begin = names.size() + 1; begin-- > 0;) {
    if (begin > 0 && names[begin - 1] != ',') continue;
    for (std::size_t end = begin; end <= names.size() && end - begin <= longest; ++end) {
      if (end < names.size() && names[end] != ',') continue;
      const auto found = sets.find(names.substr(begin, end - begin));
      if (found != sets.end() && (end == names.size() || chosen.contains(end + 1))) chosen[begin] = found->second;
    }
  }
  std::vector<const CellSet*> parts;
  for (std::size_t begin = 0; begin <= names.size();) {
    const auto next = chosen.find(begin);
    if (next == chosen.end()) return {};
    if (!contains(parts, next->second)) parts.push_back(next->second);
    begin += next->second->name.size() + 1;
  }
  return parts;
}

/// The sets that are meant, none if one of the names is nobody's.
std::vector<const CellSet*> find_sets(const std::string& names, const MeshFile& file) {
  const SetsByName known = sets_by_name(file);
  if (!known.contains(names) && (names == kAllSets || names == kAllMaterials)) {
    std::vector<const CellSet*> all;
    for (const CellSet& set : names == kAllSets ? file.cell_sets : file.cell_materials) all.push_back(&set);
    return all;
  }
  return part_into_sets(names, known);
}

/// "'a,b'": some of the sets that have no cells in common, the smallest first.
std::string some_apart(std::vector<const CellSet*> sets, std::size_t cells) {
  std::ranges::stable_sort(sets, {}, [](const CellSet* set) { return set->cells.size(); });
  std::vector<bool> taken(cells, false);
  std::string names;
  std::size_t count = 0;
  for (const CellSet* set : sets) {
    const auto is_taken = [&](std::uint32_t cell) { return taken[cell]; };
    if (set->cells.empty() || std::ranges::any_of(set->cells, is_taken)) continue;
    for (const std::uint32_t cell : set->cells) taken[cell] = true;
    names += (count > 0 ? "," : "") + echoed(set->name);
    if (++count == kMaxEchoItems) break;
  }
  return "'" + names + "'";
}

void make_regions_of_sets(const std::vector<const CellSet*>& sets, ControlMesh& mesh, const MeshLimits& limits) {
  check_count("the sets are", sets.size(), limits, kNameSets);
  mesh.cell_regions.assign(mesh.cell_count(), kInNone);
  for (std::size_t set = 0; set < sets.size(); ++set) {
    for (const std::uint32_t cell : sets[set]->cells) {
      std::uint8_t& region = mesh.cell_regions[cell];
      if (region != kInNone) {
        refuse(named_ids(kCells, {cell}) + " is in both '" + echoed(sets[region]->name) + "' and '" +
                   echoed(sets[set]->name) + "'; name sets that have no cells in common, such as " +
                   some_apart(sets, mesh.cell_count()) + ", and the rest becomes one region",
               {cell});
      }
      region = static_cast<std::uint8_t>(set);
    }
    mesh.cell_region_names.push_back(sets[set]->name);
  }
  if (!contains(mesh.cell_regions, kInNone)) return;
  check_count("the sets and the rest are", sets.size() + 1, limits, "name one less");
  std::ranges::replace(mesh.cell_regions, kInNone, static_cast<std::uint8_t>(sets.size()));
  std::string rest = "rest";
  while (contains(mesh.cell_region_names, rest)) rest += '_';
  mesh.cell_region_names.push_back(rest);
}

}  // namespace

std::string known_cell_numbers(const MeshFile& file) {
  std::string text;
  const auto add = [&](const std::string& what, const auto& named) {
    if (!named.empty()) text += (text.empty() ? "it has " : ", and ") + what + " " + echoed_names(named, '\'');
  };
  add("numbers called", file.cell_numbers);
  add("sets", file.cell_sets);
  add("materials", file.cell_materials);
  return text.empty() ? "it has none" : text;
}

std::string known_by_another_case(std::string_view names, const MeshFile& file) {
  const auto hint_of = [&](std::string_view name) {
    std::string hint = hint_of_case(file.cell_numbers, name, '\'');
    if (hint.empty()) hint = hint_of_case(file.cell_sets, name, '\'');
    return hint.empty() ? hint_of_case(file.cell_materials, name, '\'') : hint;
  };
  std::string hint = hint_of(names);
  for (std::size_t begin = 0; begin <= names.size() && hint.empty();) {
    const std::size_t end = std::min(names.find(',', begin), names.size());
    const std::string_view name = names.substr(begin, end - begin);
    const auto is_known = [&](const CellSet& set) { return set.name == name; };
    if (std::ranges::none_of(file.cell_sets, is_known) && std::ranges::none_of(file.cell_materials, is_known)) {
      hint = hint_of(name);
    }
    begin = end + 1;
  }
  return hint;
}

std::optional<std::int64_t> exact_integer(double value) {
  constexpr double kMostExact = 1ll << 53;
  if (!(std::abs(value) <= kMostExact) || std::nearbyint(value) != value) return std::nullopt;
  return static_cast<std::int64_t>(value);
}

void make_cell_regions(const std::string& names, MeshFile& file, const MeshLimits& limits) {
  ControlMesh& mesh = file.mesh;
  mesh.cell_region_names.clear();
  mesh.cell_regions.clear();
  const auto numbers = std::ranges::find(file.cell_numbers, names, &CellNumbers::name);
  if (numbers != file.cell_numbers.end()) return make_regions_of_numbers(*numbers, mesh, limits);
  const std::vector<const CellSet*> sets = find_sets(names, file);
  if (sets.empty()) {
    refuse("the file has no numbers or sets called '" + echoed(names) + "' for its cells; " + known_cell_numbers(file) +
           known_by_another_case(names, file));
  }
  make_regions_of_sets(sets, mesh, limits);
}

}  // namespace ccslice
