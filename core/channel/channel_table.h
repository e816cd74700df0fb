// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The channels of a part by name, which is how jobs refer to them: the solid's own, then those of the job's sources.

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/channel/channel_source.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

struct Channel {
  ChannelRange range;
  std::optional<std::uint32_t> of_solid;  // Its number there. Nothing: it is the source's.
  const ChannelSource* source = nullptr;  // Null: it is the solid's.
};

class ChannelTable {
 public:
  /// `sources` outlive this.
  explicit ChannelTable(const std::vector<ChannelRange>& of_solid, const ChannelSources& sources = {});

  /// Nothing if there is none of that name.
  std::optional<Channel> find(std::string_view name) const;
  /// REQUIRES: there is one of that name.
  Channel at(std::string_view name) const { return *find(name); }
  /// Throws Error{kChannelUnknown} of this field: what there is, and what may be meant.
  void require(const std::string& name, const std::string& field) const;
  /// Throws Error{kChannelRepeated, kChannelUnknown} of fields "fields[i]" where sources have the name of another
  /// channel, or read one that doesn't come before them.
  void validate_sources() const;

 private:
  std::vector<ChannelRange> ranges_;
  std::size_t of_solid_;
  std::span<const std::shared_ptr<const ChannelSource>> sources_;
};

}  // namespace ccslice
