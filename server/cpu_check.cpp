// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Everything else is compiled for x86-64-v3, so that all servers give the same bytes. On a processor that lacks it the
// program would die of an illegal instruction somewhere, so this says so first: it runs before all static initializers
// of the program and is itself compiled for any x86-64.

#include <unistd.h>

#include <cstring>

namespace {

void say(const char* text) {
  if (write(STDERR_FILENO, text, std::strlen(text)) < 0) _exit(70);
}

/// Says the feature's name if the processor lacks it.
void say_unless(int supported, const char* name) {
  if (supported == 0) say(name);
}

__attribute__((constructor(101))) void check_cpu() {
  __builtin_cpu_init();
  if (__builtin_cpu_supports("x86-64-v3")) return;
  say("ccsliced: this processor isn't an x86-64-v3 (Intel Haswell, AMD Excavator, or later); use another machine. "
      "Missing:");
  say_unless(__builtin_cpu_supports("avx2"), " avx2");
  say_unless(__builtin_cpu_supports("bmi"), " bmi");
  say_unless(__builtin_cpu_supports("bmi2"), " bmi2");
  say_unless(__builtin_cpu_supports("f16c"), " f16c");
  say_unless(__builtin_cpu_supports("fma"), " fma");
  say_unless(__builtin_cpu_supports("lzcnt"), " lzcnt");
  say_unless(__builtin_cpu_supports("movbe"), " movbe");
  say("\n");
  _exit(70);
}

}  // namespace
