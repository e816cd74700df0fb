// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The server's figures, as Prometheus reads them. docs/operating.md explains each.

#pragma once

#include <string>

#include "server/rpc/calls/service_state.h"

namespace ccslice::server {

/// All figures in Prometheus' text format.
[[nodiscard]] std::string metrics_page(ServiceState& state, std::size_t connections);

}  // namespace ccslice::server
