// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The server's figures, as Prometheus reads them. docs/operating.md explains each.

#pragma once

#include <cstddef>
#include <string>

#include "server/rpc/calls/service_state.h"
#include "server/service/network/certificates.h"

namespace ccslice::server {

/// What the server knows besides.
struct NetworkFigures {
  std::size_t connections = 0;
  CertificateEnds ends{};
};

/// All figures in Prometheus' text format.
[[nodiscard]] std::string metrics_page(ServiceState& state, const NetworkFigures& network);

}  // namespace ccslice::server
