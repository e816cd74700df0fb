// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/abaqus_sets.h"

#include <algorithm>
#include <deque>
#include <set>
#include <string>
#include <utility>

#include "core/mesh_import/set_members.h"
#include "core/mesh_import/text_scanner.h"

namespace ccslice {
namespace {

/// A part's elements in the mesh, by their numbers.
struct PlacedIndex {
  const PlacedElements& elements;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> cells;

  explicit PlacedIndex(const PlacedElements& placed) : elements(placed) {
    std::uint32_t cell = placed.first_cell;
    for (const std::uint64_t number : placed.numbers) cells.emplace_back(number, cell++);
    std::ranges::sort(cells);
  }
  bool has(std::uint32_t cell) const {
    return cell >= elements.first_cell && cell - elements.first_cell < elements.numbers.size();
  }
};

/// The places of a scope: of a part, or of an instance.
class PlacesByScope {
 public:
  explicit PlacesByScope(const std::vector<PlacedElements>& placed) : places_(placed.begin(), placed.end()) {
    for (const PlacedIndex& place : places_) {
      if (place.cells.empty()) continue;
      const AbaqusScope& scope = place.elements.scope;
      of_scope_[{scope.part, {}}].push_back(&place);
      if (!scope.instance.empty()) of_scope_[{0, scope.instance}].push_back(&place);
    }
  }
  const std::vector<const PlacedIndex*>& of(const AbaqusScope& scope) const {
    static const std::vector<const PlacedIndex*> kNone;
    const auto found = of_scope_.find(scope);
    return found == of_scope_.end() ? kNone : found->second;
  }

 private:
  std::vector<PlacedIndex> places_;
  std::map<AbaqusScope, std::vector<const PlacedIndex*>> of_scope_;
};

}  // namespace

/// Finds the cells of the sets: first their own elements; then every set hands its cells on to those that name it, as
/// long as one of them grows.
class AbaqusSets::Resolver {
 public:
  Resolver(const AbaqusSets& sets, const std::vector<PlacedElements>& placed, std::size_t cell_count)
      : sets_(sets), places_(placed), members_(cell_count, "element sets"), found_(sets.sets_.size()) {
    for (std::size_t member = 0; member < sets.members_.size(); ++member) {
      sets.members_[member].set.empty() ? add_numbers(sets.members_[member]) : add_uses(member);
    }
    for (std::size_t set = 0; set < found_.size(); ++set) enqueue(set);
    while (!queue_.empty()) {
      const std::size_t set = queue_.front();
      queue_.pop_front();
      hand_on(set);
    }
  }

  const std::vector<std::uint32_t>& cells(std::size_t set) const { return found_[set].cells; }
  const std::set<std::string>& unknown() const { return unknown_; }

 private:
  struct Use {
    std::size_t by;            // The set that names this one.
    const PlacedIndex* place;  // Only the cells of this place, unless it is null.
  };
  struct Found {
    std::vector<std::uint32_t> cells;
    std::size_t handed_on = 0;  // So many cells, all that there were.
    std::vector<Use> uses;
    bool queued = false;
  };

  void add_numbers(const Member& member) {
    const Range& numbers = member.numbers;
    for (const PlacedIndex* place : places_.of(member.scope)) {
      members_.count();
      auto element = std::ranges::lower_bound(place->cells, std::pair(numbers.first, std::uint32_t{0}));
      for (; element != place->cells.end() && element->first <= numbers.last; ++element) {
        if ((element->first - numbers.first) % numbers.step == 0) {
          members_.add(element->second, found_[member.of].cells);
        } else {
          members_.count();
        }
      }
    }
  }

  /// The member names a set of its own scope, or of the part of an instance.
  void add_uses(std::size_t number) {
    const Member& member = sets_.members_[number];
    const std::string& instance = member.scope.instance;
    bool known = add_use(number, member.scope, nullptr);
    if (!instance.empty()) {
      for (const PlacedIndex* place : places_.of(member.scope)) {
        members_.count();
        known |= add_use(number, {place->elements.scope.part, {}}, place);
      }
    }
    if (!known) unknown_.insert(instance.empty() ? member.set : instance + "." + member.set);
  }

  /// Whether there is a set of that scope, which must have come before the member unless that is a section.
  bool add_use(std::size_t number, const AbaqusScope& scope, const PlacedIndex* place) {
    const Member& member = sets_.members_[number];
    const auto known = sets_.index_.find({scope, member.set, false});
    if (known == sets_.index_.end()) return false;
    const bool is_section = sets_.sets_[member.of].kind == Kind::kMaterial;
    if (!is_section && sets_.sets_[known->second].first_member > number) return false;
    if (known->second != member.of) found_[known->second].uses.push_back({member.of, place});
    return true;
  }

  void enqueue(std::size_t set) {
    if (!found_[set].queued) queue_.push_back(set);
    found_[set].queued = true;
  }

  void hand_on(std::size_t set) {
    Found& from = found_[set];
    from.queued = false;
    sort_unique(from.cells);
    if (from.cells.size() == from.handed_on) return;
    from.handed_on = from.cells.size();
    for (const Use& use : from.uses) {
      for (const std::uint32_t cell : from.cells) {
        if (use.place == nullptr || use.place->has(cell)) {
          members_.add(cell, found_[use.by].cells);
        } else {
          members_.count();
        }
      }
      enqueue(use.by);
    }
  }

  const AbaqusSets& sets_;
  const PlacesByScope places_;
  SetMembers members_;
  std::vector<Found> found_;  // By set.
  std::deque<std::size_t> queue_;
  std::set<std::string> unknown_;
};

std::size_t AbaqusSets::open(const AbaqusScope& scope, std::string_view name) { return open(scope, name, Kind::kSet); }

std::size_t AbaqusSets::open_internal(const AbaqusScope& scope, std::string_view name) {
  return open(scope, name, Kind::kInternal);
}

std::size_t AbaqusSets::open(const AbaqusScope& scope, std::string_view name, Kind kind) {
  const auto [known, is_new] = index_.try_emplace({scope, abaqus_key(name), kind == Kind::kMaterial}, sets_.size());
  if (is_new) sets_.push_back({std::string(name), scope, members_.size(), kind});
  return known->second;
}

void AbaqusSets::add_section(const AbaqusScope& scope, std::string_view set, std::string_view material) {
  members_.push_back({open(scope, material, Kind::kMaterial), scope, abaqus_key(set), {}});
}

void AbaqusSets::add(std::size_t set, std::uint64_t number) { add_number(set, sets_[set].scope, number); }

void AbaqusSets::add_instance(std::size_t set, std::string_view instance) {
  constexpr std::uint64_t kMostNumber = std::uint64_t{1} << 63;
  members_.push_back({set, {0, abaqus_key(instance)}, {}, {0, kMostNumber, 1}});
}

/// Numbers that follow each other are one member.
void AbaqusSets::add_number(std::size_t set, const AbaqusScope& scope, std::uint64_t number) {
  if (!members_.empty()) {
    Member& last = members_.back();
    const bool goes_on = last.of == set && last.set.empty() && last.scope == scope && last.numbers.step == 1 &&
                         last.numbers.last + 1 == number;
    if (goes_on) {
      last.numbers.last = number;
      return;
    }
  }
  members_.push_back({set, scope, {}, {number, number, 1}});
}

void AbaqusSets::add_entries(std::size_t set, const AbaqusScope& members, bool generate, AbaqusLines& lines) {
  const std::vector<std::string_view>& entries = lines.entries();
  const auto is_number = [](std::string_view text) { return !text.empty() && text[0] >= '0' && text[0] <= '9'; };
  const auto add_one = [&](const AbaqusScope& scope, std::string_view entry) {
    add_number(set, scope, lines.count(entry, "an element's number"));
  };
  if (generate) {
    if (entries[0].empty()) return;
    const std::uint64_t first = lines.count(entries[0], "the first element");
    const std::uint64_t last = entries.size() > 1 ? lines.count(entries[1], "the last element") : first;
    const bool has_step = entries.size() > 2 && !entries[2].empty();
    const std::uint64_t step = has_step ? lines.count(entries[2], "a step") : 1;
    members_.push_back({set, members, {}, {first, last, std::max<std::uint64_t>(step, 1)}});
    return;
  }
  for (const std::string_view entry : entries) {
    if (entry.empty()) continue;
    if (is_number(entry)) {
      add_one(members, entry);
      continue;
    }
    const std::string name = abaqus_key(entry);
    const std::size_t point = name.find('.');
    if (index_.contains({members, name, false}) || point == std::string::npos) {
      members_.push_back({set, members, name, {}});
      continue;
    }
    const AbaqusScope instance{0, name.substr(0, point)};
    const std::string of_instance = name.substr(point + 1);
    if (is_number(of_instance)) {
      add_one(instance, of_instance);
    } else {
      members_.push_back({set, instance, of_instance, {}});
    }
  }
}

AbaqusSets::LeftOut AbaqusSets::finish(const std::vector<PlacedElements>& placed, MeshFile& file) {
  const Resolver resolver(*this, placed, file.mesh.cell_count());
  LeftOut left_out{{}, {resolver.unknown().begin(), resolver.unknown().end()}};
  for (const Kind kind : {Kind::kSet, Kind::kMaterial}) {
    std::vector<CellSet> named;  // In the order of their names' first openings.
    std::map<std::string, std::size_t> index;
    for (std::size_t set = 0; set < sets_.size(); ++set) {
      if (sets_[set].kind != kind) continue;
      const auto [known, is_new] = index.try_emplace(abaqus_key(sets_[set].name), named.size());
      if (is_new) named.push_back({sets_[set].name, {}});
      const std::vector<std::uint32_t>& cells = resolver.cells(set);
      std::vector<std::uint32_t>& all = named[known->second].cells;
      all.insert(all.end(), cells.begin(), cells.end());
    }
    for (CellSet& set : named) {
      sort_unique(set.cells);
      if (!set.cells.empty()) {
        (kind == Kind::kSet ? file.cell_sets : file.cell_materials).push_back(std::move(set));
      } else if (kind == Kind::kSet) {
        left_out.empty.push_back(std::move(set.name));
      }
    }
  }
  return left_out;
}

}  // namespace ccslice
