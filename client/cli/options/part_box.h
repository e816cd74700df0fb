// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How large a placed part is.

#pragma once

#include <string>

#include "ccslice/v1/geometry.pb.h"
#include "client/cli/session/session.h"

namespace ccslice::cli {

/// The bounding box of a mesh's limit volume once it is placed, world mm, from the server.
v1::Box3 part_box(Session& session, const std::string& mesh_id, const v1::Placement& placement);

}  // namespace ccslice::cli
