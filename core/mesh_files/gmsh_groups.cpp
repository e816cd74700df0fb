// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/gmsh_groups.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string_view>
#include <utility>

#include "core/base/echo.h"
#include "core/mesh_import/set_members.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {
namespace {

constexpr int kVolume = 3;
constexpr int kBoxReals = 6, kPointReals = 3;

}  // namespace

/// The names are text in binary files, too.
void GmshGroups::read_names(GmshScanner& scanner, bool with_dimensions) {
  TextScanner& text = scanner.text();
  const std::uint64_t count = text.count("the number of physical names");
  if (!with_dimensions) text.end_line();
  for (std::uint64_t i = 0; i < count; ++i) {
    if (!with_dimensions) {
      read_name_of_version_2_0(text);
      continue;
    }
    const auto dimension = text.integer("a physical group's dimension");
    const std::int64_t tag = text.integer("a physical group's tag");
    const std::string_view line = text.rest_of_line();
    const std::optional<std::string_view> name = between_quotes(line);
    if (!name) text.fail("a name in quotes", printable(line));
    groups_.push_back({dimension, std::abs(tag), std::string(*name)});
  }
}

/// A tag and a name, or a dimension before them: programs that write version 2.0 do either, with a blank before the
/// name or without. A name without a dimension goes to the volumes of that tag.
void GmshGroups::read_name_of_version_2_0(TextScanner& text) {
  const std::string_view line = text.rest_of_line();
  const std::optional<std::string_view> name = between_quotes(line);
  std::vector<std::int64_t> numbers;
  std::string_view rest = line.substr(0, line.find('"'));
  while (!(rest = rest.substr(std::min(rest.find_first_not_of(" \t"), rest.size()))).empty()) {
    const auto [end, status] = std::from_chars(rest.data(), rest.data() + rest.size(), numbers.emplace_back());
    if (status != std::errc()) break;
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  }
  if (!name || !rest.empty() || numbers.empty() || numbers.size() > 2) {
    text.fail("a physical group's tag and a name in quotes", printable(line));
  }
  groups_.push_back({numbers.size() == 2 ? numbers.front() : kVolume, std::abs(numbers.back()), std::string(*name)});
}

void GmshGroups::read_entities(GmshScanner& scanner, bool partitioned) {
  if (partitioned) {
    (void)scanner.size("the number of partitions");
    const std::uint64_t ghosts = scanner.size("the number of ghost entities");
    for (std::uint64_t i = 0; i < ghosts; ++i) {
      scanner.skip_integer("a ghost entity's tag");
      scanner.skip_integer("a ghost entity's partition");
    }
  }
  std::uint64_t counts[kVolume + 1];
  for (std::uint64_t& count : counts) count = scanner.size("the number of entities");
  for (int dimension = 0; dimension <= kVolume; ++dimension) {
    for (std::uint64_t i = 0; i < counts[dimension]; ++i) read_entity(scanner, dimension, partitioned);
  }
}

void GmshGroups::read_entity(GmshScanner& scanner, int dimension, bool partitioned) {
  const std::int64_t tag = scanner.signed_integer("an entity's tag");
  Volume volume;
  if (partitioned) {
    scanner.skip_integer("a parent's dimension");
    volume.parent = scanner.signed_integer("a parent's tag");
    const std::uint64_t partitions = scanner.size("the number of partitions");
    for (std::uint64_t i = 0; i < partitions; ++i) scanner.skip_integer("a partition");
  }
  for (int i = 0; i < (dimension == 0 ? kPointReals : kBoxReals); ++i) (void)scanner.any_real("a coordinate");
  const std::uint64_t groups = scanner.size("the number of physical groups");
  for (std::uint64_t i = 0; i < groups; ++i) {
    volume.groups.push_back(std::abs(scanner.signed_integer("a physical group's tag")));
  }
  if (dimension > 0) {
    const std::uint64_t bounds = scanner.size("the number of entities of the boundary");
    for (std::uint64_t i = 0; i < bounds; ++i) scanner.skip_integer("an entity of the boundary");
  }
  if (dimension != kVolume) return;
  sort_unique(volume.groups);
  volumes_[tag] = std::move(volume);
}

void GmshGroups::add_cell(std::int64_t volume, std::int64_t group) {
  cell_volumes_.push_back(volume);
  add_last_cell_to(group);
}

bool GmshGroups::may_take_last_cell(std::int64_t volume, std::int64_t group) const {
  if (cell_volumes_.empty() || volume == 0 || group == 0) return false;
  const std::int64_t last = memberships_.back().group;
  return cell_volumes_.back() == volume && last != 0 && last != std::abs(group);
}

void GmshGroups::add_last_cell_to(std::int64_t group) {
  memberships_.push_back({static_cast<std::uint32_t>(cell_volumes_.size() - 1), std::abs(group)});
}

/// The numbers of the cells' volumes, those of the whole volumes for cells of partitions.
CellNumbers GmshGroups::entities() const {
  CellNumbers entity{"entity", {}};
  for (const std::int64_t tag : cell_volumes_) {
    const auto volume = volumes_.find(tag);
    const bool is_part = volume != volumes_.end() && volume->second.parent != 0;
    entity.of_cells.push_back(static_cast<double>(is_part ? volume->second.parent : tag));
  }
  return entity;
}

GmshGroups::CellsOfTags GmshGroups::cells_of_tags() const {
  SetMembers members(cell_volumes_.size(), "physical groups");
  CellsOfTags cells_of;
  const auto add = [&](std::uint32_t cell, std::int64_t tag) {
    if (tag == 0) return;
    members.count();
    std::vector<std::uint32_t>& cells = cells_of[tag];
    if (cells.empty() || cells.back() != cell) cells.push_back(cell);
  };
  for (const Membership& membership : memberships_) add(membership.cell, membership.group);
  for (std::uint32_t cell = 0; cell < cell_volumes_.size(); ++cell) {
    const auto volume = volumes_.find(cell_volumes_[cell]);
    if (volume == volumes_.end()) continue;
    for (const std::int64_t tag : volume->second.groups) add(cell, tag);
  }
  return cells_of;
}

/// Groups of the same name are one set.
void GmshGroups::add_sets(const CellsOfTags& cells_of, MeshFile& file) const {
  std::map<std::int64_t, std::string> names;
  for (const Group& group : groups_) {
    if (group.dimension == kVolume) names.try_emplace(group.tag, group.name);
  }
  std::map<std::string, std::size_t> set_of;
  for (const auto& [tag, cells] : cells_of) {
    const auto known_name = names.find(tag);
    const std::string name = known_name == names.end() ? std::to_string(tag) : known_name->second;
    const auto [set, is_new] = set_of.try_emplace(name, file.cell_sets.size());
    if (is_new) file.cell_sets.push_back({name, {}});
    std::vector<std::uint32_t>& all = file.cell_sets[set->second].cells;
    all.insert(all.end(), cells.begin(), cells.end());
  }
  for (CellSet& set : file.cell_sets) sort_unique(set.cells);
}

void GmshGroups::finish(MeshFile& file) {
  file.cell_numbers.push_back(entities());
  const CellsOfTags cells_of = cells_of_tags();
  add_sets(cells_of, file);
  std::vector<std::string> left_out;
  for (const Group& group : groups_) {
    if (group.dimension != kVolume || !cells_of.contains(group.tag)) left_out.push_back(printable(group.name));
  }
  if (left_out.empty()) return;
  file.warnings.push_back("physical groups without cells left out: " + echoed_list(left_out, left_out.size()));
}

}  // namespace ccslice
