// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Materials, maps and halftoning: messages <-> values of the core. Pure. Names become numbers; whether values make
// sense is for the core to say.

#pragma once

#include <string>

#include "ccslice/v1/material.pb.h"
#include "core/limit/limit_solid.h"
#include "core/printing/printing.h"

namespace ccslice::server {

/// What is printed, with defaults filled in. Throws Error{kChannelUnknown, kMaterialUnknown, kMaterialMapInvalid (no
/// kind), kEnumValueUnknown}.
Printing to_printing(const v1::Printing& message, const SolidSummary& solid);

/// The number of a material, from 1. Throws Error{kMaterialUnknown}.
std::uint32_t to_material(const std::string& name, const Printing& printing, const std::string& field);

v1::Printing to_message(const Printing& value, const SolidSummary& solid);

}  // namespace ccslice::server
