// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/deflate.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <optional>

#include "core/output/adler32.h"
#include "core/output/deflate_block.h"
#include "core/output/huffman.h"

namespace ccslice {
namespace {

constexpr std::size_t kWindowBytes = 32768;
constexpr std::size_t kWindowColours = kWindowBytes / sizeof(Colour);
constexpr std::size_t kBlockUnits = 1 << 17;
constexpr std::size_t kSlackUnits = 8;  // Read beyond the last unit, without effect.
constexpr std::size_t kTrailerBytes = 16;
constexpr std::size_t kLongKey = 8, kShortKey = 4;
constexpr unsigned kHashBits = 12;
constexpr unsigned kPatience = 4;  // After 2^4 places without a match bytes are skipped.
constexpr std::size_t kLongestMatch = DeflateBlock::kLongestMatch;

std::uint32_t load32(const std::uint8_t* at) {
  std::uint32_t word;
  std::memcpy(&word, at, sizeof word);
  return word;
}

std::uint64_t load64(const std::uint8_t* at) {
  std::uint64_t word;
  std::memcpy(&word, at, sizeof word);
  return word;
}

std::size_t short_hash(const std::uint8_t* at) { return load32(at) * 0x9E3779B1u >> (32 - kHashBits); }
std::size_t long_hash(const std::uint8_t* at) { return load64(at) * 0x9E3779B97F4A7C15u >> (64 - kHashBits); }

/// How many of the units from `a` on equal those from `b` on, up to b_end. REQUIRES: kSlackUnits beyond b_end.
std::size_t equal_units(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* b_end) {
  const std::uint8_t* const begin = b;
  for (; b < b_end; a += 8, b += 8) {
    const std::uint64_t difference = load64(a) ^ load64(b);
    if (difference == 0) continue;
    b += std::countr_zero(difference) / 8;
    break;
  }
  return static_cast<std::size_t>(std::min(b, b_end) - begin);
}

/// Counts the separators round a place that only moves on.
class Separators {
 public:
  /// `next`: a separator; all are `row_units` apart.
  Separators(std::size_t row_units, std::size_t next) : row_units_(row_units), next_(next) {}

  void move_to(std::size_t at) {
    at_ = at;
    while (next_ < at_) next_ += row_units_;
  }
  /// Among the `count` units from the place on.
  std::size_t ahead(std::size_t count) const {
    const std::size_t until = next_ - at_;
    return until < count ? 1 + (count - 1 - until) / row_units_ : 0;
  }
  /// Among the `count` units before it.
  std::size_t behind(std::size_t count) const {
    const std::size_t since = row_units_ - (next_ - at_);  // Since the one before it, itself included; 0: none at `at`.
    return since <= count ? 1 + (count - since) / row_units_ : 0;
  }

 private:
  const std::size_t row_units_;
  std::size_t next_;
  std::size_t at_ = 0;
};

}  // namespace

/// Positions count units from the stream's start, plus an offset that puts the tables' zeros out of reach.
struct ZlibStream::State {
  // The last units compressed, which matches may refer to, then those not yet compressed.
  std::vector<std::uint8_t> units;
  std::size_t window = 0, size = 0;
  std::size_t base = 0;  // Position of units[0].
  std::vector<std::uint32_t> long_places, short_places;

  UnitTable table;
  std::size_t row_units = 0;  // 0: units are bytes.
  std::size_t first_row = 0;  // Position of the first separator.
  std::optional<ColourAdler32> colour_adler;
  DeflateBlock block;
  std::vector<std::uint8_t> out;  // Its first `written` bytes are the stream so far.
  std::size_t written = 0;
  BitWriter writer{nullptr};
  std::uint32_t adler = 1;

  void start();
  void forget_units();
  void make_room(std::size_t bytes);
  void compress_block(bool last);
  void write_equal_rows(std::uint64_t rows, const UnitBytes& unit, std::uint64_t rest);
  void add_to_checksum();
  void match_bytes();
  void match_colours();
  void remember(std::size_t at);
};

ZlibStream::ZlibStream() : state_(std::make_unique<State>()) {}
ZlibStream::~ZlibStream() = default;
ZlibStream::ZlibStream(ZlibStream&&) noexcept = default;
ZlibStream& ZlibStream::operator=(ZlibStream&&) noexcept = default;

void ZlibStream::State::forget_units() {
  long_places.assign(std::size_t{1} << kHashBits, 0);
  short_places.assign(std::size_t{1} << kHashBits, 0);
  window = size = 0;
}

void ZlibStream::State::start() {
  units.resize(kWindowBytes + kBlockUnits + kSlackUnits);
  forget_units();
  first_row = base = kWindowBytes + 1;
  adler = 1;
  out.resize(std::max<std::size_t>(out.size(), 2));
  out[0] = 0x78;
  out[1] = 0x01;
  writer = BitWriter(nullptr);
  written = 2;
}

void ZlibStream::start_bytes() {
  state_->row_units = 0;
  for (std::size_t unit = 0; unit < 256; ++unit) {
    state_->table[unit] = {{static_cast<std::uint8_t>(unit)}, 1};
  }
  state_->start();
}

void ZlibStream::start_colours(std::span<const Colour> palette, std::size_t row_units) {
  state_->row_units = row_units;
  state_->table.fill({{}, 1});
  for (std::size_t unit = 0; unit < palette.size(); ++unit) state_->table[unit] = {palette[unit], 4};
  state_->colour_adler.emplace(palette);
  state_->start();
}

void ZlibStream::append(std::span<const std::uint8_t> units) {
  State& state = *state_;
  while (!units.empty()) {
    if (state.size == state.window + kBlockUnits) state.compress_block(false);
    const std::size_t count = std::min(units.size(), state.window + kBlockUnits - state.size);
    std::memcpy(state.units.data() + state.size, units.data(), count);
    state.size += count;
    units = units.subspan(count);
  }
}

void ZlibStream::append_equal_rows(std::uint64_t rows, std::size_t row_units, std::uint8_t unit) {
  State& state = *state_;
  if (state.size > state.window) state.compress_block(false);
  constexpr std::uint8_t kZero[] = {0};
  const UnitBytes& bytes = state.table[unit];
  const std::span<const std::uint8_t> unit_bytes = std::span(bytes.bytes).first(bytes.count);
  if (std::ranges::all_of(unit_bytes, [](std::uint8_t byte) { return byte == 0; })) {
    // The rows are one run.
    const std::uint64_t count = rows * (1 + bytes.count * (row_units - 1));
    state.write_equal_rows(1, {{0}, 1}, count - 2);
    state.adler = adler32_of_repeats(state.adler, kZero, count);
  } else {
    state.write_equal_rows(rows, bytes, bytes.count * (row_units - 2));
    for (std::uint64_t row = 0; row < rows; ++row) {
      state.adler = adler32_of_bytes(state.adler, kZero);
      state.adler = adler32_of_repeats(state.adler, unit_bytes, row_units - 1);
    }
  }
  state.base += state.size + rows * row_units;
  state.forget_units();
}

std::vector<std::uint8_t> ZlibStream::finish() {
  State& state = *state_;
  state.compress_block(true);
  state.writer.align();
  for (int shift = 24; shift >= 0; shift -= 8) state.writer.put(state.adler >> shift & 0xff, 8);
  state.writer.align();
  return {state.out.data(), state.writer.at()};
}

void ZlibStream::State::add_to_checksum() {
  std::span<const std::uint8_t> fresh(units.data() + window, size - window);
  if (row_units == 0) {
    adler = adler32_of_bytes(adler, fresh);
    return;
  }
  constexpr std::uint8_t kFilterByte[] = {0};
  std::size_t in_row = (base + window - first_row) % row_units;
  while (!fresh.empty()) {
    if (in_row == 0) {
      adler = adler32_of_bytes(adler, kFilterByte);
      fresh = fresh.subspan(1);
      in_row = 1;
    }
    const std::size_t count = std::min(fresh.size(), row_units - in_row);
    adler = (*colour_adler)(adler, fresh.first(count));
    fresh = fresh.subspan(count);
    in_row = 0;
  }
}

/// For so many bytes more, and what ends the stream.
void ZlibStream::State::make_room(std::size_t bytes) {
  const std::size_t room = written + bytes + kTrailerBytes;
  if (out.size() < room) out.resize(2 * room);
  writer.move_to(out.data() + written);
}

/// A block of its own. Each row is a zero, `unit`, and `rest` bytes that repeat it: matches of 258 bytes at its own
/// distance, whose codes have one bit each for the length and the distance if there are many, then what is left.
void ZlibStream::State::write_equal_rows(std::uint64_t rows, const UnitBytes& unit, std::uint64_t rest) {
  constexpr unsigned kLongest = 285, kShortestMatch = 3, kBitsTogether = 48;
  const std::uint64_t matches = rest / kLongestMatch;
  const auto left = static_cast<unsigned>(rest % kLongestMatch);
  const bool is_matched = left >= kShortestMatch;
  const SymbolAndExtra last = length_symbol(is_matched ? left : kShortestMatch);
  std::array<std::uint32_t, 286> literal_counts{};
  std::array<std::uint32_t, 30> distance_counts{};
  literal_counts[0] = literal_counts[kEndOfBlock] = 1;
  for (std::size_t k = 0; k < unit.count; ++k) ++literal_counts[unit.bytes[k]];
  const auto byte_left = [&](unsigned k) { return unit.bytes[(rest - left + k) % unit.count]; };
  for (unsigned k = 0; !is_matched && k < left; ++k) ++literal_counts[byte_left(k)];
  if (is_matched) ++literal_counts[last.symbol];
  literal_counts[kLongest] += static_cast<std::uint32_t>(std::min<std::uint64_t>(matches, kBlockUnits));
  distance_counts[unit.count - 1u] = 1;
  std::array<HuffmanCode, 286> literals{};
  std::array<HuffmanCode, 30> distances{};
  make_huffman_codes(literal_counts, kLongestCode, literals);
  make_huffman_codes(distance_counts, kLongestCode, distances);
  const HuffmanCode distance = distances[unit.count - 1u];
  const auto put = [&](std::uint64_t bits, unsigned count) {
    writer.put(bits, count);
    writer.flush();
  };
  const unsigned match_bits = literals[kLongest].length + distance.length;
  const std::uint64_t match = literals[kLongest].bits | std::uint64_t{distance.bits} << literals[kLongest].length;
  const unsigned together = matches > 0 ? kBitsTogether / match_bits : 1;
  std::uint64_t many = 0;  // `together` matches.
  for (unsigned k = 0; k < together; ++k) many |= match << k * match_bits;
  constexpr std::uint64_t kMostBitsOfOthers = 8 * kLongestCode + 5;  // Two literals more, five at the end, and a match.
  const std::uint64_t row_bits = matches * match_bits + kMostBitsOfOthers + (unit.count + left % 3) * kLongestCode;
  make_room(static_cast<std::size_t>(rows * row_bits / 8) + DeflateBlock::largest(0));
  DynamicBlockHead(literals, distances).write(false, writer);
  for (std::uint64_t row = 0; row < rows; ++row) {
    put(literals[0].bits, literals[0].length);
    for (std::size_t k = 0; k < unit.count; ++k) put(literals[unit.bytes[k]].bits, literals[unit.bytes[k]].length);
    std::uint64_t to_do = matches;
    for (; to_do >= together; to_do -= together) put(many, together * match_bits);
    for (; to_do > 0; --to_do) put(match, match_bits);
    if (is_matched) {
      put(literals[last.symbol].bits, literals[last.symbol].length);
      put(last.value, last.bits);
      put(distance.bits, distance.length);
    } else {
      for (unsigned k = 0; k < left; ++k) {
        const HuffmanCode& code = literals[byte_left(k)];
        put(code.bits, code.length);
      }
    }
  }
  put(literals[kEndOfBlock].bits, literals[kEndOfBlock].length);
  written = static_cast<std::size_t>(writer.at() - out.data());
}

void ZlibStream::State::compress_block(bool last) {
  if (row_units == 0) {
    match_bytes();
  } else {
    match_colours();
  }
  add_to_checksum();
  const std::size_t unit_bytes = row_units == 0 ? 1 : sizeof(Colour);
  make_room(DeflateBlock::largest(unit_bytes * (size - window)));
  block.write({units.data() + window, size - window}, table, last, writer);
  written = static_cast<std::size_t>(writer.at() - out.data());
  const std::size_t kept = std::min(size, kWindowBytes);
  std::memmove(units.data(), units.data() + size - kept, kept);
  base += size - kept;
  window = size = kept;
}

void ZlibStream::State::match_bytes() {
  const std::uint8_t* const unit = units.data();
  std::uint32_t* const places = long_places.data();
  const std::size_t origin = base, end = size;
  std::size_t at = window, literals_begin = window, misses = 0;
  while (at + kLongKey <= end) {
    std::uint32_t& place = places[long_hash(unit + at)];
    const std::size_t distance = origin + at - place;
    place = static_cast<std::uint32_t>(origin + at);
    if (distance > kWindowBytes || load64(unit + at) != load64(unit + at - distance)) {
      at += 1 + (misses++ >> kPatience);
      continue;
    }
    const std::size_t length = equal_units(unit + at - distance, unit + at, unit + std::min(end, at + kLongestMatch));
    block.add(at - literals_begin, length, length, distance);
    at += length;
    // The match's end is entered so that a long run goes on at the shortest distance.
    if (at + kLongKey <= end) places[long_hash(unit + at - 1)] = static_cast<std::uint32_t>(origin + at - 1);
    literals_begin = at;
    misses = 0;
  }
  block.add(end - literals_begin);
}

void ZlibStream::State::remember(std::size_t at) {
  const auto position = static_cast<std::uint32_t>(base + at);
  short_places[short_hash(units.data() + at)] = position;
  long_places[long_hash(units.data() + at)] = position;
}

void ZlibStream::State::match_colours() {
  const std::uint8_t* const unit = units.data();
  Separators separators(row_units, window + (row_units - (base + window - first_row) % row_units) % row_units);
  std::size_t at = window, literals_begin = window;
  while (at + kLongKey <= size) {
    std::size_t distance = base + at - long_places[long_hash(unit + at)];
    if (distance > kWindowColours || load64(unit + at) != load64(unit + at - distance)) {
      distance = base + at - short_places[short_hash(unit + at)];
    }
    remember(at);
    if (distance > kWindowColours || load32(unit + at) != load32(unit + at - distance)) {
      ++at;
      continue;
    }
    const std::size_t count =
        equal_units(unit + at - distance, unit + at, unit + std::min(size, at + kLongestMatch / 4));
    separators.move_to(at);
    block.add(at - literals_begin, count, 4 * count - 3 * separators.ahead(count),
              4 * distance - 3 * separators.behind(distance));
    // Within a run of one unit all places begin alike, and the last one is what is remembered.
    const std::size_t alike = distance == 1 && count >= kLongKey + 4 ? (count - kLongKey) / 4 * 4 : 4;
    for (std::size_t inner = at + alike; inner < at + count && inner + kLongKey <= size; inner += 4) remember(inner);
    at += count;
    if (at + kLongKey <= size) remember(at - 1);
    literals_begin = at;
  }
  block.add(size - literals_begin);
}

}  // namespace ccslice
