// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/link_groups.h"

#include <utility>

#include "core/base/contains.h"

namespace ccslice {
namespace {

class LinkGrouper {
 public:
  explicit LinkGrouper(std::span<const LinkTriangle> link) : link_(link) {}

  LinkGroups best() {
    constexpr std::uint32_t kMostTried = 16;
    LinkGroups best;
    for (std::uint32_t first = 0; first < link_.size() && first < kMostTried; ++first) {
      LinkGroups grouping = group_from(first);
      if (first == 0 || std::pair(grouping.cuts, grouping.count) < std::pair(best.cuts, best.count)) {
        best = std::move(grouping);
      }
      if (best.cuts == 0) break;
    }
    return best;
  }

 private:
  LinkGroups group_from(std::uint32_t first);
  void grow(std::uint32_t first, LinkGroups& grouping);
  bool fits(std::uint32_t triangle, const LinkGroups& grouping, std::uint32_t group) const;

  std::span<const LinkTriangle> link_;
  std::vector<std::uint32_t> vertices_;  // Of the link, in the group that grows.
};

bool LinkGrouper::fits(std::uint32_t triangle, const LinkGroups& grouping, std::uint32_t group) const {
  int shared = 0;
  std::uint32_t opposite = kNone;
  for (const LinkEdge& edge : link_[triangle].edges) {
    if (edge.beyond == kNone || grouping.groups[edge.beyond] != group) continue;
    ++shared;
    opposite = edge.opposite;
  }
  return shared > 1 || (shared == 1 && !contains(vertices_, opposite));
}

void LinkGrouper::grow(std::uint32_t first, LinkGroups& grouping) {
  const std::uint32_t group = grouping.count++;
  std::vector<std::uint32_t> members;
  vertices_.clear();
  const auto add = [&](std::uint32_t triangle) {
    grouping.groups[triangle] = group;
    members.push_back(triangle);
    for (const LinkEdge& edge : link_[triangle].edges) {
      if (!contains(vertices_, edge.opposite)) vertices_.push_back(edge.opposite);
    }
  };
  add(first);
  for (bool grown = true; grown;) {
    grown = false;
    for (std::size_t i = 0; i < members.size(); ++i) {
      for (const LinkEdge& edge : link_[members[i]].edges) {
        if (edge.beyond == kNone || grouping.groups[edge.beyond] != kNone) continue;
        if (!fits(edge.beyond, grouping, group)) continue;
        add(edge.beyond);
        grown = true;
      }
    }
  }
}

LinkGroups LinkGrouper::group_from(std::uint32_t first) {
  LinkGroups grouping;
  grouping.groups.assign(link_.size(), kNone);
  grow(first, grouping);
  for (std::uint32_t triangle = 0; triangle < link_.size(); ++triangle) {
    if (grouping.groups[triangle] == kNone) grow(triangle, grouping);
  }
  for (std::uint32_t triangle = 0; triangle < link_.size(); ++triangle) {
    for (const LinkEdge& edge : link_[triangle].edges) {
      if (edge.beyond == kNone || edge.beyond < triangle) continue;
      grouping.cuts += grouping.groups[edge.beyond] != grouping.groups[triangle];
    }
  }
  return grouping;
}

}  // namespace

LinkGroups group_link(std::span<const LinkTriangle> link) { return LinkGrouper(link).best(); }

LinkGroups fans_of_link(std::span<const LinkTriangle> link) {
  LinkGroups fans;
  fans.groups.assign(link.size(), kNone);
  std::vector<std::uint32_t> walk;
  for (std::uint32_t first = 0; first < link.size(); ++first) {
    if (fans.groups[first] != kNone) continue;
    walk.assign(1, first);
    fans.groups[first] = fans.count;
    while (!walk.empty()) {
      const std::uint32_t at = walk.back();
      walk.pop_back();
      for (const LinkEdge& edge : link[at].edges) {
        if (edge.beyond == kNone || fans.groups[edge.beyond] != kNone) continue;
        fans.groups[edge.beyond] = fans.count;
        walk.push_back(edge.beyond);
      }
    }
    ++fans.count;
  }
  return fans;
}

}  // namespace ccslice
