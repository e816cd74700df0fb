// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Lattices as functions of three coordinates, each of period 1: they are 0 on a surface that is nearly minimal, and
// divides space in two. With X = 2 pi u and so on:
//
//   gyroid    sin X cos Y + sin Y cos Z + sin Z cos X                                         within [-3/2, 3/2]
//   diamond   sin X sin Y sin Z + sin X cos Y cos Z + cos X sin Y cos Z + cos X cos Y sin Z   within [-sqrt 2, sqrt 2]
//   schwarz   cos X + cos Y + cos Z  (Schwarz's P)                                            within [-3, 3]
//   bcc       2 (cos X cos Y + cos Y cos Z + cos Z cos X) - (cos 2X + cos 2Y + cos 2Z)        within [-5, 3]
//
// The first three are as nTop has them (support.ntop.com, "What equations are used to create the TPMS types?"). The
// last one is Schoen's I-WP [Schoen70], as microgen has it (github.com/3MAH/microgen, `schoenIWP`): it is greatest, 3,
// all along the diagonals of the cubes, which are the struts of the body-centred cubic lattice.
//
// [Schoen70] A. H. Schoen, *Infinite periodic minimal surfaces without self-intersections*, NASA TN D-5541, 1970.

#pragma once

#include "core/base/lanes.h"

namespace ccslice {

Lanes gyroid(Lanes u, Lanes v, Lanes w) noexcept;
Lanes diamond(Lanes u, Lanes v, Lanes w) noexcept;
Lanes schwarz(Lanes u, Lanes v, Lanes w) noexcept;
Lanes bcc(Lanes u, Lanes v, Lanes w) noexcept;

}  // namespace ccslice
