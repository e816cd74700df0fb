// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The core's errors name fields of its SliceJob; clients know those of the contract's, and where in the request the job
// is.

#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {

/// Where SliceRange and PlanSlices have their job, and previews of layers theirs.
inline constexpr const char* kJobPath = "job";
inline constexpr const char* kLayerJobPath = "plane.layer.job";

/// The path in the request of a field of the core's job. What a preview shows is beside its job.
inline std::string path_of_field(const std::string& job_path, const std::string& field) {
  using Row =
      std::pair<std::string_view, std::string_view>;  // Names of the core and of the contract, where they differ.
  constexpr std::array<Row, 3> kMoved = {{{"contour_tolerance_mm", "tolerances.contour_mm"},
                                          {"channel_tolerance", "tolerances.channel"},
                                          {"contours_by_cell_region", "contours.by_cell_region"}}};
  if (field.starts_with("content")) return field;
  const std::size_t end = std::min(field.find('.'), field.size());
  const auto* const row = std::ranges::find(kMoved, std::string_view(field).substr(0, end), &Row::first);
  return job_path + "." + (row == kMoved.end() ? field : std::string(row->second) + field.substr(end));
}

/// What `body` returns. Errors that it throws name `field_of(field)` in place of their field, as their messages do if
/// they begin with it, and have `behind` behind their messages.
template <typename FieldOf, typename Body>
auto with_fields(const FieldOf& field_of, const std::string& behind, const Body& body) {
  const auto message_of = [&](const auto& error) {
    const std::string message = error.what();
    const bool names_field = message.starts_with(error.field());
    return (names_field ? field_of(error.field()) + message.substr(error.field().size()) : message) + behind;
  };
  try {
    return body();
  } catch (const Error& error) {
    if (error.field().empty()) throw;
    throw Error(error.code(), message_of(error), field_of(error.field()), error.ids());
  } catch (const ServiceError& error) {
    if (error.field().empty()) throw;
    throw ServiceError(error.code(), message_of(error), field_of(error.field()), error.mesh_id());
  }
}

/// The same of errors of the job at `path`, which then name "job.planes[2]" instead of "planes[2]".
template <typename Body>
auto at_job(const std::string& path, const Body& body) {
  return with_fields([&](const std::string& field) { return path_of_field(path, field); }, "", body);
}

}  // namespace ccslice::server
