// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/formula/lattices.h"

#include "core/formula/elementary.h"

namespace ccslice {

Lanes gyroid(Lanes u, Lanes v, Lanes w) noexcept {
  const SineCosine x = sine_cosine_of_turns(u), y = sine_cosine_of_turns(v), z = sine_cosine_of_turns(w);
  return x.sine * y.cosine + y.sine * z.cosine + z.sine * x.cosine;
}

Lanes diamond(Lanes u, Lanes v, Lanes w) noexcept {
  const SineCosine x = sine_cosine_of_turns(u), y = sine_cosine_of_turns(v), z = sine_cosine_of_turns(w);
  // sin X cos(Y - Z) + cos X sin(Y + Z)
  return x.sine * (y.sine * z.sine + y.cosine * z.cosine) + x.cosine * (y.sine * z.cosine + y.cosine * z.sine);
}

Lanes schwarz(Lanes u, Lanes v, Lanes w) noexcept {
  return sine_cosine_of_turns(u).cosine + sine_cosine_of_turns(v).cosine + sine_cosine_of_turns(w).cosine;
}

Lanes bcc(Lanes u, Lanes v, Lanes w) noexcept {
  const Lanes x = sine_cosine_of_turns(u).cosine, y = sine_cosine_of_turns(v).cosine,
              z = sine_cosine_of_turns(w).cosine;
  // cos 2X = 2 cos X cos X - 1
  return 2.0 * (x * y + y * z + z * x) - (2.0 * (x * x + y * y + z * z) - 3.0);
}

}  // namespace ccslice
