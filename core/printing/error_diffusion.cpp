// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/error_diffusion.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "core/printing/voxel_hash.h"

namespace ccslice {
namespace {

using Lanes8 = float __attribute__((vector_size(4 * kMaxPrintMaterials)));
static_assert(kMaxPrintMaterials == 8, "a vector of errors is one register");

constexpr float kAhead = 7.0f / 16, kBehindBelow = 3.0f / 16, kBelow = 5.0f / 16, kAheadBelow = 1.0f / 16;
constexpr float kNoise = 0.4f;    // Width of the perturbation, of a fraction's range.
constexpr float kAbsent = 1e-4f;  // Materials of smaller fractions are never chosen, whatever the errors are.
constexpr float kNever = 1e30f;
constexpr std::int64_t kCarryReach = 16;  // Columns that the error at a run's end may pass to the next run.

// Errors from outside: a sequence in steps of g^-1, of g^-2 from row to row and of g^-3 from layer to layer, g the root
// of g^4 = g + 1, fills its range evenly along all of them (M. Roberts, The unreasonable effectiveness of
// quasirandom sequences, 2018). In units of 2^-32, as are the offset of errors from the row's voxel before and that of
// one material's from another's.
constexpr std::uint32_t kStepX = 0xd1b54a33, kFromRowOffset = 0x68e31da4, kMaterialOffset = 0x9e3779b9;

// The sequence that places minor materials steps by these along a row, from row to row and from layer to layer, in
// units of 2^-32. Of millions of random triples that show no stripes in a layer (the sequence's waves that are longer
// than voxels of the material are apart are weak), at pitches from 0.025 to 0.1 mm and fractions from 0.002 to 0.2,
// these keep counts in boxes of 1 mm closest to what they should be.
constexpr std::uint32_t kMinorStepX = 0xbba2cfcf, kMinorStepY = 0x95518479, kMinorStepZ = 0x2de6910f;

Lanes8 multiply_add(float a, Lanes8 b, Lanes8 c) noexcept { return _mm256_fmadd_ps(_mm256_set1_ps(a), b, c); }

/// The largest lane, in all lanes.
Lanes8 largest(Lanes8 v) noexcept {
  v = _mm256_max_ps(v, _mm256_permute2f128_ps(v, v, 1));
  v = _mm256_max_ps(v, _mm256_permute_ps(v, 0b01001110));
  return _mm256_max_ps(v, _mm256_permute_ps(v, 0b10110001));
}

/// The lanes of 32 random bits: uniform in [0, width), or so.
Lanes8 random_lanes(std::uint32_t bits, float width) noexcept {
  const __m256i factors =
      _mm256_setr_epi32(0x2c1b3c6d, 0x297a2d39, 0x1b56c4e9, 0x21f0aaad, 0x735a2d97, 0x3c6ef373, 0x165667b1, 0x27d4eb2f);
  const __m256i mixed = _mm256_mullo_epi32(_mm256_set1_epi32(static_cast<std::int32_t>(bits | 1)), factors);
  return _mm256_cvtepi32_ps(_mm256_srli_epi32(mixed, 9)) * (width * 0x1p-23f);
}

/// Mean errors inside, of n materials whose fractions are f: (a (S - n r) + b (1 - n f) + c (r - f S)) / n, where r is
/// the root of f and S the sum of all roots. They add up to 0 whatever the coefficients are, which come from 140
/// measured mixes: errors of two materials are met to 0.002, of more to 0.005 (rms).
struct MeanError {
  float a, b, c;
  float of(float fraction, float root, float roots, float materials) const noexcept {
    return a * (roots / materials - root) + b * (1 / materials - fraction) + c * (root - fraction * roots) / materials;
  }
};
constexpr MeanError kMeanOfTwo = {4.867f, -4.362f, 3.684f}, kMeanOfMany = {-0.383f, 0.846f, -0.522f};

/// How far made-up errors spread, of root = (f (1 - f))^(1/4): tried until first rows had their fractions.
float error_width(float root) noexcept { return std::max(0.55f, root * (0.78f + 0.66f * root)); }

/// From -1/2 to 1/2.
float even(std::uint32_t bits) noexcept { return static_cast<float>(static_cast<std::int32_t>(bits)) * 0x1p-32f; }

/// Errors for two materials, the first one's, that come from outside.
float start_error(std::uint32_t bits, float fraction) noexcept {
  if (fraction < kAbsent || fraction > 1 - kAbsent) return 0;
  const float root = std::sqrt(fraction), roots = root + std::sqrt(1 - fraction);
  return error_width(std::sqrt(std::sqrt(fraction * (1 - fraction)))) * even(bits) +
         kMeanOfTwo.of(fraction, root, roots, 2);
}

/// Errors for many materials that come from outside. They add up to 0, and there are none for materials that are
/// absent.
Lanes8 start_errors(std::uint32_t bits, const Lanes8& fractions) noexcept {
  const Lanes8 root = _mm256_sqrt_ps(fractions);
  const Lanes8 width_root = _mm256_sqrt_ps(_mm256_sqrt_ps(fractions * (1 - fractions)));
  Lanes8 errors{}, squares{};
  float present = 0, sum = 0, sum_of_squares = 0, roots = 0;
  for (std::size_t m = 0; m < kMaxPrintMaterials; ++m) {
    if (fractions[m] < kAbsent) continue;
    const float width = error_width(width_root[m]);
    errors[m] = width * even(bits + kMaterialOffset * static_cast<std::uint32_t>(m));
    squares[m] = width * width;
    present += 1;
    sum += errors[m];
    sum_of_squares += squares[m];
    roots += root[m];
  }
  if (present < 2) return Lanes8{};
  const float widening = std::sqrt(present / (present - 1));  // For what is taken off so that they add up to 0.
  for (std::size_t m = 0; m < kMaxPrintMaterials; ++m) {
    if (fractions[m] < kAbsent) continue;
    errors[m] = widening * (errors[m] - sum * squares[m] / sum_of_squares) +
                kMeanOfMany.of(fractions[m], root[m], roots, present);
  }
  return errors;
}

bool is_minor(float fraction) noexcept { return (fraction >= kAbsent) & (fraction < kMinorFraction); }

/// Whether a material is a minor one in some voxel of [begin, end).
bool has_minor(std::size_t materials, std::uint32_t begin, std::uint32_t end, const Fractions& fractions) noexcept {
  std::int32_t minor = 0;
  for (std::size_t m = 0; m < materials; ++m) {
    for (std::uint32_t k = begin; k < end; ++k) minor |= is_minor(fractions[m][k]) ? 1 : 0;
  }
  return minor != 0;
}

/// Fractions voxel by voxel.
using VoxelFractions = std::array<Lanes8, kMixBlock>;

/// The fractions that minor materials leave of a block.
struct Rest {
  Fractions fractions;                     // All of a voxel's material if it was given to a minor one.
  std::array<std::int32_t, kMixBlock> of;  // The material of a voxel that errors have nothing to choose for, or else 0.
};

/// Gives voxels to minor materials where the sequence, which is at `bits` in voxel 0, is below their fractions. The
/// compiler vectorizes these loops over the block.
void place_minor(std::size_t materials, std::uint32_t bits, const Fractions& fractions, Rest& rest) noexcept {
  MixRow at, minor{}, scale;
  std::array<std::int32_t, kMixBlock> taken{}, others{}, last{}, last_minor{};
  for (std::uint32_t k = 0; k < kMixBlock; ++k) {
    at[k] = static_cast<float>(static_cast<std::int32_t>((bits + kMinorStepX * k) >> 8)) * 0x1p-24f;
  }
  for (std::size_t m = 0; m < materials; ++m) {
    const auto number = static_cast<std::int32_t>(m + 1);
    for (std::size_t k = 0; k < kMixBlock; ++k) {
      const float fraction = fractions[m][k], more = minor[k] + (is_minor(fraction) ? fraction : 0);
      taken[k] = (at[k] >= minor[k]) & (at[k] < more) ? number : taken[k];
      others[k] += fraction >= kMinorFraction ? 1 : 0;
      last[k] = fraction >= kMinorFraction ? number : last[k];
      last_minor[k] = is_minor(fraction) ? number : last_minor[k];
      minor[k] = more;
    }
  }
  for (std::size_t k = 0; k < kMixBlock; ++k) {
    // The fractions may sum to a bit less than 1 if all are minor.
    last[k] = others[k] == 0 ? last_minor[k] : last[k];
    scale[k] = 1 / std::max(1 - minor[k], kMinorFraction);
    rest.of[k] = minor[k] == 0 || others[k] > 1 ? 0 : taken[k] == 0 ? last[k] : taken[k];
  }
  for (std::size_t m = 0; m < materials; ++m) {
    const auto number = static_cast<std::int32_t>(m + 1);
    for (std::size_t k = 0; k < kMixBlock; ++k) {
      const float left = is_minor(fractions[m][k]) ? 0 : fractions[m][k] * scale[k];
      rest.fractions[m][k] = taken[k] == 0 ? left : taken[k] == number ? 1 : 0;
    }
  }
}

void gather(const Fractions& fractions, std::size_t materials, VoxelFractions& voxels) noexcept {
  for (std::size_t k = 0; k < kMixBlock; ++k) {
    for (std::size_t m = 0; m < kMaxPrintMaterials; ++m) voxels[k][m] = m < materials ? fractions[m][k] : 0;
  }
}

}  // namespace

std::uint32_t ErrorDiffusion::minor_phase(std::uint64_t seed, std::uint32_t y, std::uint32_t z) noexcept {
  return static_cast<std::uint32_t>(mix64(mix64(seed))) + kMinorStepY * y + kMinorStepZ * z;
}

void ErrorDiffusion::start_layer(std::uint32_t width) {
  const std::size_t columns = std::size_t{width} + 2;
  if (materials_ <= 2) {
    here_.assign(columns, 0);
    below_.assign(columns, 0);
  } else {
    many_here_.assign(columns, Errors{});
    many_below_.assign(columns, Errors{});
  }
  inside_here_.assign(columns, 0);
  inside_above_.assign(columns, 0);
  next_ = kNowhere;
}

void ErrorDiffusion::start_row(std::uint32_t rows, bool reverse, const RowNumbers& numbers) {
  here_.swap(below_);
  many_here_.swap(many_below_);
  inside_here_.swap(inside_above_);
  std::fill(below_.begin(), below_.end(), 0.0f);
  std::fill(many_below_.begin(), many_below_.end(), Errors{});
  std::fill(inside_here_.begin(), inside_here_.end(), std::uint8_t{0});
  if (rows > 1) {
    std::fill(here_.begin(), here_.end(), 0.0f);
    std::fill(many_here_.begin(), many_here_.end(), Errors{});
    std::fill(inside_above_.begin(), inside_above_.end(), std::uint8_t{0});
    next_ = kNowhere;
  }
  reverse_ = reverse;
  numbers_ = numbers;
}

void ErrorDiffusion::choose(std::uint32_t first, std::uint32_t begin, std::uint32_t end, const Fractions& fractions,
                            std::uint8_t* out) noexcept {
  if (materials_ == 1) {
    std::fill(out + begin, out + end, std::uint8_t{1});
    return;
  }
  if (has_minor(materials_, begin, end, fractions)) {
    choose_with_minor(first, begin, end, fractions, out);
  } else {
    carry(first, begin, end, fractions, out);
  }
}

void ErrorDiffusion::choose_with_minor(std::uint32_t first, std::uint32_t begin, std::uint32_t end,
                                       const Fractions& fractions, std::uint8_t* out) noexcept {
  Rest rest;
  place_minor(materials_, numbers_.minor + kMinorStepX * first, fractions, rest);
  // In the row's direction, what lies between voxels that errors have nothing to choose for.
  const std::uint32_t voxels = end - begin;
  const auto at = [&](std::uint32_t i) { return reverse_ ? end - 1 - i : begin + i; };
  for (std::uint32_t i = 0; i < voxels; ++i) {
    const std::uint32_t start = i;
    while (i < voxels && rest.of[at(i)] == 0) ++i;
    if (i > start) {
      carry(first, std::min(at(start), at(i - 1)), std::max(at(start), at(i - 1)) + 1, rest.fractions, out);
    }
    if (i < voxels) out[at(i)] = static_cast<std::uint8_t>(rest.of[at(i)]);
  }
}

void ErrorDiffusion::carry(std::uint32_t first, std::uint32_t begin, std::uint32_t end, const Fractions& fractions,
                           std::uint8_t* out) noexcept {
  const Run run{first, reverse_ ? end - 1 : begin, end - begin, reverse_ ? -1 : 1};
  if (materials_ == 2) {
    choose_of_two(run, fractions, out);
  } else {
    choose_of_many(run, fractions, out);
  }
  next_ = std::int64_t{first} + run.start + std::int64_t{run.step} * run.length;
}

/// What a voxel would get of errors of the row above, of 1, from voxels outside. That row went the other way: what it
/// left behind comes from behind.
float ErrorDiffusion::share_from_outside(const Run& run, std::uint32_t k) const noexcept {
  const std::uint8_t* above = &inside_above_[std::size_t{run.first} + k + 1];
  return (above[-run.step] == 0 ? kBehindBelow : 0) + (above[0] == 0 ? kBelow : 0) +
         (above[run.step] == 0 ? kAheadBelow : 0);
}

/// Calls from_row(k, bits) if the first voxel's error from the row comes from outside, and from_above(k, bits, share)
/// for voxels of whose errors from above a share does; the bits are what such errors are made of.
template <typename FromRow, typename FromAbove>
void ErrorDiffusion::start_run(const Run& run, const FromRow& from_row, const FromAbove& from_above) noexcept {
  const auto bits = [&](std::uint32_t k) { return numbers_.phase + kStepX * (run.first + k); };
  if (std::abs(next_ - (std::int64_t{run.first} + run.start)) > kCarryReach) {
    from_row(run.start, bits(run.start) + kFromRowOffset);
  }
  const std::uint32_t begin = run.step > 0 ? run.start : run.start + 1 - run.length, end = begin + run.length;
  std::memset(&inside_here_[std::size_t{run.first} + begin + 1], 1, run.length);
  // Where all voxels above are inside, none of the errors from there is missing.
  if (std::memchr(&inside_above_[std::size_t{run.first} + begin], 0, run.length + 2) == nullptr) return;
  for (std::uint32_t k = begin; k < end; ++k) {
    const float share = share_from_outside(run, k);
    if (share > 0) from_above(k, bits(k), share);
  }
}

void ErrorDiffusion::choose_of_two(const Run& run, const Fractions& fractions, std::uint8_t* out) noexcept {
  // The second material's sum is 1 less the first one's, so the first is taken from 1/2 on. Noise moves this threshold
  // and not the error. A material that is absent is never taken, whatever its error.
  MixRow threshold;
  for (std::uint32_t k = 0; k < kMixBlock; ++k) {
    const float random = 0.5f + kNoise * (random_unit(numbers_.key, run.first + k) - 0.5f);
    threshold[k] = fractions[0][k] < kAbsent ? kNever : fractions[1][k] < kAbsent ? -kNever : random;
  }
  start_run(
      run, [&](std::uint32_t k, std::uint32_t bits) { error_ = start_error(bits, fractions[0][k]); },
      [&](std::uint32_t k, std::uint32_t bits, float share) {
        here_[run.first + k + 1] += share * start_error(bits, fractions[0][k]);
      });
  std::uint32_t k = run.start;
  const float* here = &here_[run.first + k + 1];
  float* below = &below_[run.first + k + 1];
  float error = error_, last = 0,
        before = 0;  // Errors of the voxel before, and of it and the one before that in this block.
  for (std::uint32_t left = run.length; left > 0; --left, k += run.step, here += run.step, below += run.step) {
    const float sum = fractions[0][k] + *here + kAhead * error;
    const bool taken = sum >= threshold[k];
    error = sum - (taken ? 1.0f : 0.0f);
    out[k] = taken ? 1 : 2;
    // The voxel below the one before gets from it, from the one before that, and from this one: all at once. At the end
    // two voxels wait for what is left.
    below[-run.step] += kAheadBelow * before + kBelow * last + kBehindBelow * error;
    before = last;
    last = error;
  }
  below[-run.step] += kAheadBelow * before + kBelow * last;
  below[0] += kAheadBelow * last;
  error_ = error;
}

void ErrorDiffusion::choose_of_many(const Run& run, const Fractions& fractions, std::uint8_t* out) noexcept {
  VoxelFractions mixed;
  gather(fractions, materials_, mixed);
  start_run(
      run, [&](std::uint32_t k, std::uint32_t bits) { many_error_ = start_errors(bits, mixed[k]); },
      [&](std::uint32_t k, std::uint32_t bits, float share) {
        many_here_[run.first + k + 1] += share * start_errors(bits, mixed[k]);
      });
  const __m256 one = _mm256_set1_ps(1), absent = _mm256_set1_ps(kAbsent), never = _mm256_set1_ps(-kNever);
  std::uint32_t k = run.start;
  const Errors* here = &many_here_[run.first + k + 1];
  Errors* below = &many_below_[run.first + k + 1];
  Errors error = many_error_, last{}, before{};
  for (std::uint32_t left = run.length; left > 0; --left, k += run.step, here += run.step, below += run.step) {
    const Errors known = mixed[k] + *here;
    const __m256 barred = _mm256_and_ps(_mm256_cmp_ps(mixed[k], absent, _CMP_LT_OQ), never);
    const Errors noise = random_lanes(random_bits(numbers_.key, run.first + k), kNoise);
    // Noise perturbs what is judged, not what is handed on.
    const Errors judged = multiply_add(kAhead, error, known + noise + barred);
    __m256 taken = _mm256_cmp_ps(judged, largest(judged), _CMP_EQ_OQ);
    auto lanes = static_cast<std::uint32_t>(_mm256_movemask_ps(taken));
    if ((lanes & (lanes - 1)) != 0) [[unlikely]] {  // A tie: the first of them.
      lanes &= ~lanes + 1;
      Errors first{};
      first[std::countr_zero(lanes) % kMaxPrintMaterials] = 1;
      taken = _mm256_cmp_ps(first, one, _CMP_EQ_OQ);
    }
    out[k] = static_cast<std::uint8_t>(std::countr_zero(lanes) + 1);
    error = multiply_add(kAhead, error, known) - _mm256_and_ps(taken, one);
    below[-run.step] += kAheadBelow * before + kBelow * last + kBehindBelow * error;
    before = last;
    last = error;
  }
  below[-run.step] += kAheadBelow * before + kBelow * last;
  below[0] += kAheadBelow * last;
  many_error_ = error;
}

}  // namespace ccslice
