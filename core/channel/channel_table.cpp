// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/channel/channel_table.h"

#include <algorithm>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/find_named.h"

namespace ccslice {
namespace {

void require_among(const std::vector<ChannelRange>& ranges, const std::string& name, const std::string& field) {
  (void)find_named(ranges, name, ErrorCode::kChannelUnknown, "the mesh has no channel", "it", field);
}

}  // namespace

ChannelTable::ChannelTable(const std::vector<ChannelRange>& of_solid, const ChannelSources& sources)
    : ranges_(of_solid), of_solid_(of_solid.size()), sources_(sources) {
  for (const auto& source : sources) ranges_.push_back(source->range());
}

std::optional<Channel> ChannelTable::find(std::string_view name) const {
  const auto found = std::ranges::find(ranges_, name, &ChannelRange::name);
  if (found == ranges_.end()) return std::nullopt;
  const auto index = static_cast<std::size_t>(found - ranges_.begin());
  if (index < of_solid_) return Channel{*found, static_cast<std::uint32_t>(index), nullptr};
  return Channel{*found, std::nullopt, sources_[index - of_solid_].get()};
}

void ChannelTable::require(const std::string& name, const std::string& field) const {
  require_among(ranges_, name, field);
}

void ChannelTable::validate_sources() const {
  std::vector<ChannelRange> before(ranges_.begin(), ranges_.begin() + static_cast<std::ptrdiff_t>(of_solid_));
  for (std::size_t i = 0; i < sources_.size(); ++i) {
    const std::string field = "fields[" + std::to_string(i) + "]";
    const std::string& name = sources_[i]->range().name;
    if (std::ranges::find(before, name, &ChannelRange::name) != before.end()) {
      throw Error(ErrorCode::kChannelRepeated,
                  field + ": there is a channel '" + echoed(name) + "' already; give it another name", field);
    }
    for (const std::string& input : sources_[i]->inputs()) require_among(before, input, field);
    before.push_back(sources_[i]->range());
  }
}

}  // namespace ccslice
