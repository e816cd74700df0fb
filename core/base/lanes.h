// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Four doubles or eight floats worked on at once, a lane each.

#pragma once

#include <immintrin.h>

#include <algorithm>
#include <cstddef>
#include <cstring>

namespace ccslice {

inline constexpr std::size_t kLanes = 4;

/// Four doubles in one register; the compiler knows + - * / on them.
using Lanes = double __attribute__((vector_size(8 * kLanes)));

inline Lanes load_unaligned(const double* p) noexcept {
  Lanes lanes;
  std::memcpy(&lanes, p, sizeof lanes);
  return lanes;
}
inline void store_unaligned(Lanes lanes, double* p) noexcept { std::memcpy(p, &lanes, sizeof lanes); }

/// a * b + c. Fused on purpose: one instruction, one rounding, on every machine that runs this build.
inline Lanes multiply_add(Lanes a, Lanes b, Lanes c) noexcept { return _mm256_fmadd_pd(a, b, c); }
inline Lanes multiply_add(Lanes a, double b, Lanes c) noexcept { return _mm256_fmadd_pd(a, _mm256_set1_pd(b), c); }

inline Lanes round_up(Lanes lanes) noexcept { return _mm256_ceil_pd(lanes); }

inline Lanes lesser(Lanes a, Lanes b) noexcept { return _mm256_min_pd(a, b); }
inline Lanes greater(Lanes a, Lanes b) noexcept { return _mm256_max_pd(a, b); }

inline Lanes absolute(Lanes lanes) noexcept { return lanes < 0 ? -lanes : lanes; }

inline Lanes square_root(Lanes lanes) noexcept { return _mm256_sqrt_pd(lanes); }

/// Bit k: lane k of a comparison holds.
template <typename Comparison>
unsigned lanes_of(Comparison holds) noexcept {
  return static_cast<unsigned>(_mm256_movemask_pd(reinterpret_cast<Lanes>(holds)));
}

/// Eight floats in one register, where a proof needs no more.
inline constexpr std::size_t kFloatLanes = 8;
using FloatLanes = float __attribute__((vector_size(4 * kFloatLanes)));

inline FloatLanes multiply_add(FloatLanes a, FloatLanes b, FloatLanes c) noexcept { return _mm256_fmadd_ps(a, b, c); }
inline FloatLanes multiply_add(FloatLanes a, float b, FloatLanes c) noexcept {
  return _mm256_fmadd_ps(a, _mm256_set1_ps(b), c);
}
inline FloatLanes lesser(FloatLanes a, FloatLanes b) noexcept { return _mm256_min_ps(a, b); }
inline FloatLanes greater(FloatLanes a, FloatLanes b) noexcept { return _mm256_max_ps(a, b); }
inline FloatLanes absolute(FloatLanes lanes) noexcept { return _mm256_andnot_ps(_mm256_set1_ps(-0.0F), lanes); }

/// Bit k: lane k of a comparison of floats holds.
template <typename Comparison>
unsigned float_lanes_of(Comparison holds) noexcept {
  return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<FloatLanes>(holds)));
}

/// Four floats in half a register.
using HalfLanes = float __attribute__((vector_size(4 * kLanes)));

/// Bit k: lane k of a comparison of such holds.
template <typename Comparison>
unsigned half_lanes_of(Comparison holds) noexcept {
  return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<HalfLanes>(holds)));
}

inline double largest(Lanes lanes) noexcept {
  return std::max(std::max(lanes[0], lanes[1]), std::max(lanes[2], lanes[3]));
}

inline double sum(Lanes lanes) noexcept { return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]); }

}  // namespace ccslice
