// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/abaqus_sets.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/mesh/text_scanner.h"

namespace ccslice {
namespace {

constexpr std::uint64_t kMostRepeats = 256;  // Of every cell, in all sets together.
constexpr std::uint64_t kFewMembers = 1 << 20;

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

/// Whoever repeats all cells in set after set would take memory and time without end.
class Members {
 public:
  explicit Members(std::size_t cells) : most_(kFewMembers + kMostRepeats * cells) {}

  void add(std::uint32_t cell, std::vector<std::uint32_t>& cells) {
    count();
    cells.push_back(cell);
  }
  void count() {
    if (++members_ <= most_) return;
    throw Error(ErrorCode::kMeshTooLarge, "the element sets have more than " + std::to_string(most_) +
                                              " members; leave out those that repeat others");
  }

 private:
  const std::uint64_t most_;
  std::uint64_t members_ = 0;
};

void sort_unique(std::vector<std::uint32_t>& cells) {
  std::ranges::sort(cells);
  const auto repeated = std::ranges::unique(cells);
  cells.erase(repeated.begin(), repeated.end());
}

}  // namespace

std::size_t AbaqusSets::open(const AbaqusScope& scope, std::string_view name) {
  const auto [known, is_new] = index_.try_emplace({scope, abaqus_key(name)}, sets_.size());
  if (is_new) {
    sets_.push_back({std::string(name), {}});
    scopes_.push_back(scope);
  }
  return known->second;
}

void AbaqusSets::add(std::size_t set, std::uint64_t number) {
  std::vector<Member>& members = sets_[set].members;
  const bool goes_on = !members.empty() && members.back().set.empty() && members.back().scope == scopes_[set] &&
                       members.back().numbers.step == 1 && members.back().numbers.last + 1 == number;
  if (goes_on) {
    members.back().numbers.last = number;
  } else {
    members.push_back({scopes_[set], {}, {number, number, 1}});
  }
}

void AbaqusSets::add_entries(std::size_t set, bool generate, AbaqusLines& lines) {
  const std::vector<std::string_view>& entries = lines.entries();
  const auto is_number = [](std::string_view text) { return !text.empty() && text[0] >= '0' && text[0] <= '9'; };
  if (generate) {
    if (entries[0].empty()) return;
    const std::uint64_t first = lines.count(entries[0], "the first element");
    const std::uint64_t last = entries.size() > 1 ? lines.count(entries[1], "the last element") : first;
    const bool has_step = entries.size() > 2 && !entries[2].empty();
    const std::uint64_t step = has_step ? lines.count(entries[2], "a step") : 1;
    sets_[set].members.push_back({scopes_[set], {}, {first, last, std::max<std::uint64_t>(step, 1)}});
    return;
  }
  for (const std::string_view entry : entries) {
    if (entry.empty()) continue;
    if (is_number(entry)) {
      add(set, lines.count(entry, "an element's number"));
      continue;
    }
    const std::string name = abaqus_key(entry);
    const std::size_t point = name.find('.');
    if (index_.contains({scopes_[set], name}) || point == std::string::npos) {
      sets_[set].members.push_back({scopes_[set], name, {}});
      continue;
    }
    const AbaqusScope instance{0, name.substr(0, point)};
    const std::string of_instance = name.substr(point + 1);
    if (is_number(of_instance)) {
      const std::uint64_t number = lines.count(of_instance, "an element's number");
      sets_[set].members.push_back({instance, {}, {number, number, 1}});
    } else {
      sets_[set].members.push_back({instance, of_instance, {}});
    }
  }
}

void AbaqusSets::finish(const std::vector<PlacedElements>& placed, MeshFile& file, std::vector<std::string>& empty) {
  const PlacesByScope places(placed);
  Members members(file.mesh.cell_count());
  std::vector<std::vector<std::uint32_t>> cells(sets_.size());

  const auto add_numbers = [&](const Range& numbers, const PlacedIndex& place, std::vector<std::uint32_t>& found) {
    auto element = std::ranges::lower_bound(place.cells, std::pair(numbers.first, std::uint32_t{0}));
    for (; element != place.cells.end() && element->first <= numbers.last; ++element) {
      if ((element->first - numbers.first) % numbers.step == 0) {
        members.add(element->second, found);
      } else {
        members.count();
      }
    }
  };
  /// Cells of an earlier set, those of one place if it is given.
  const auto add_set = [&](const AbaqusScope& scope, const std::string& name, std::size_t before,
                           const PlacedIndex* place, std::vector<std::uint32_t>& found) {
    const auto known = index_.find({scope, name});
    if (known == index_.end() || known->second >= before) return;
    for (const std::uint32_t cell : cells[known->second]) {
      if (place == nullptr || place->has(cell)) {
        members.add(cell, found);
      } else {
        members.count();
      }
    }
  };

  std::map<std::string, std::vector<std::uint32_t>> cells_of_name;
  std::vector<std::string> order;
  for (std::size_t set = 0; set < sets_.size(); ++set) {
    for (const Member& member : sets_[set].members) {
      const bool own_scope = member.scope == scopes_[set];
      if (!member.set.empty() && own_scope) add_set(member.scope, member.set, set, nullptr, cells[set]);
      if (!member.set.empty() && own_scope) continue;
      for (const PlacedIndex* place : places.of(member.scope)) {
        members.count();
        if (member.set.empty()) {
          add_numbers(member.numbers, *place, cells[set]);
        } else {
          add_set({place->elements.scope.part, {}}, member.set, set, place, cells[set]);
          add_set({0, place->elements.scope.instance}, member.set, set, place, cells[set]);
        }
      }
    }
    sort_unique(cells[set]);
    const std::string key = abaqus_key(sets_[set].name);
    const auto [known, is_new] = cells_of_name.try_emplace(key);
    known->second.insert(known->second.end(), cells[set].begin(), cells[set].end());
    if (is_new) order.push_back(sets_[set].name);
  }
  for (const std::string& name : order) {
    std::vector<std::uint32_t>& found = cells_of_name.at(abaqus_key(name));
    sort_unique(found);
    if (found.empty()) {
      empty.push_back(name);
    } else {
      file.cell_sets.push_back({name, std::move(found)});
    }
  }
}

}  // namespace ccslice
