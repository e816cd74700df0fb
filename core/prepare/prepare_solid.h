// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// From a control mesh to a prepared solid: validates, refines where necessary, classifies, and indexes the cells.

#pragma once

#include <memory>

#include "core/limit/limit_solid.h"
#include "core/mesh/control_mesh.h"
#include "core/prepare/prepare_options.h"

namespace ccslice {

/// Throws Error (1xx, kCancelled).
[[nodiscard]] std::shared_ptr<const LimitSolid> prepare_solid(ControlMesh mesh, const PrepareOptions& options = {});

}  // namespace ccslice
