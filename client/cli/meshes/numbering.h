// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a server says of a mesh, in the numbers of the file that it came from (core/mesh_import/renumber_text.h).
// Servers know a mesh's own numbers only, and so do lists in JSON, which have the file's beside them.

#pragma once

#include <string>

#include "ccslice/v1/mesh.pb.h"
#include "ccslice/v1/plan.pb.h"
#include "client/client_error.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice::cli {

/// The failure, if the server named ids, with what the file calls them.
client::ClientError renumbered(const client::ClientError& error, const FileNumbers& numbers);

/// The plan with warnings that name vertices and cells as the file does. Cells that a warning lists and its message
/// doesn't name are added to that.
v1::PlanSlicesResponse renumbered(v1::PlanSlicesResponse plan, const FileNumbers& numbers);

/// The texts of describe() in the file's numbers.
std::string describe(v1::PlanSlicesResponse plan, const FileNumbers& numbers);
std::string describe(const v1::MeshSummary& mesh, const FileNumbers& numbers);
std::string describe_faults(const v1::MeshSummary& mesh, const FileNumbers& numbers);
std::string describe(const v1::LimitDeviation& deviation, const FileNumbers& numbers);

}  // namespace ccslice::cli
