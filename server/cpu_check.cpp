// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Everything else is compiled for x86-64-v3, so that all servers give the same bytes. On a processor that lacks it the
// program would die of an illegal instruction somewhere, so this says so first: it runs before all static initializers
// of the program and is itself compiled for any x86-64.

#include <cpuid.h>
#include <unistd.h>

#include <cstring>

namespace {

void say(const char* text) {
  if (write(STDERR_FILENO, text, std::strlen(text)) < 0) _exit(70);
}

struct Feature {
  const char* name;
  bool there;
};

__attribute__((constructor(101))) void check_cpu() {
  __builtin_cpu_init();
  // Clang 14 has no name for "x86-64-v3" and for three of its features. What isn't asked for comes with AVX2, which
  // counts only if the system saves its registers.
  unsigned a = 0, b = 0, basic = 0, extended = 0, d = 0;
  if (__get_cpuid(1, &a, &b, &basic, &d) == 0) basic = 0;
  if (__get_cpuid(0x80000001, &a, &b, &extended, &d) == 0) extended = 0;
  const Feature features[] = {{" avx2", __builtin_cpu_supports("avx2") != 0},
                              {" bmi", __builtin_cpu_supports("bmi") != 0},
                              {" bmi2", __builtin_cpu_supports("bmi2") != 0},
                              {" f16c", (basic & bit_F16C) != 0},
                              {" fma", __builtin_cpu_supports("fma") != 0},
                              {" lzcnt", (extended & bit_LZCNT) != 0},
                              {" movbe", (basic & bit_MOVBE) != 0}};
  bool complete = true;
  for (const Feature& feature : features) complete &= feature.there;
  if (complete) return;
  say("ccsliced: this processor isn't an x86-64-v3 (Intel Haswell, AMD Excavator, or later); use another machine. "
      "Missing:");
  for (const Feature& feature : features) {
    if (!feature.there) say(feature.name);
  }
  say("\n");
  _exit(70);
}

}  // namespace
