// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <utility>

#include "client/attempts.h"
#include "client/call.h"
#include "client/client.h"
#include "client/surface_assembler.h"

namespace ccslice::client {

Surface Client::tessellate(const v1::TessellateBoundaryRequest& request, const CallOptions& call) {
  return with_retries(call, {request.mesh_id()}, [&](const Endpoint& at) {
    Call one(call, at, request.mesh_id());
    SurfaceAssembler surface;
    const auto reader = at.stub->TessellateBoundary(&one.context(), request);
    v1::TessellateBoundaryResponse message;
    try {
      while (reader->Read(&message)) surface.add(message);
    } catch (...) {
      one.context().TryCancel();
      reader->Finish();
      throw;
    }
    one.check(reader->Finish());
    return std::move(surface).finish();
  });
}

}  // namespace ccslice::client
