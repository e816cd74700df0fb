// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The shapes that hostile meshes start from, in cells of about 10 mm, without channels.

#pragma once

#include <string>

#include "core/mesh/control_mesh.h"
#include "tests/oracle/hostile/hostile_random.h"

namespace ccslice::oracle {

struct HostileShape {
  ControlMesh mesh;
  std::string name;
  bool bends = false;  // Bends and twists become it.
  bool coarse = true;  // Of few cells, so that it may be refined.
};

HostileShape make_hostile_shape(HostileRandom& random);

}  // namespace ccslice::oracle
