// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Warnings of plans.

#pragma once

#include <string>

#include "ccslice/v1/plan.pb.h"

namespace ccslice::server {

inline v1::PlanWarning& add_warning(v1::PlanSlicesResponse& plan, v1::PlanWarningKind kind,
                                    const std::string& message) {
  v1::PlanWarning& warning = *plan.add_warnings();
  warning.set_kind(kind);
  warning.set_message(message);
  return warning;
}

}  // namespace ccslice::server
