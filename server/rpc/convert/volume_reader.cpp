// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/volume_reader.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>
#include <zstd.h>

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>

#include "ccslice/v1/volume.pb.h"
#include "core/base/error.h"
#include "server/rpc/convert/block_stream.h"

namespace ccslice::server {
namespace {

using google::protobuf::internal::WireFormatLite;
using google::protobuf::io::CodedInputStream;

constexpr int kMostWindowLog = 23;  // 8 MiB, the most that zstd's levels up to 19 use.

[[noreturn]] void refuse(const std::string& field, const std::string& what) {
  throw Error(ErrorCode::kVolumeInvalid, field.empty() ? what : field + ": " + what, field);
}

[[noreturn]] void not_a_volume() {
  refuse("", "the chunks don't add up to a serialized ccslice.v1.Volume: send all its bytes in order");
}

VolumeSampleType to_sample_type(int type) {
  switch (type) {
    case v1::VOLUME_SAMPLE_TYPE_UINT8: return VolumeSampleType::kUint8;
    case v1::VOLUME_SAMPLE_TYPE_INT16: return VolumeSampleType::kInt16;
    case v1::VOLUME_SAMPLE_TYPE_UINT16: return VolumeSampleType::kUint16;
    case v1::VOLUME_SAMPLE_TYPE_FLOAT32: return VolumeSampleType::kFloat32;
    default: break;
  }
  refuse("sample_type",
         std::to_string(type) + " isn't a type that this server knows; give UINT8, INT16, UINT16 or FLOAT32");
}

/// Unpacks one zstd frame that comes in pieces.
class Unpacker {
 public:
  explicit Unpacker(std::vector<std::byte>& samples) : samples_(samples), context_(ZSTD_createDCtx()) {
    if (!context_) throw std::bad_alloc();
    (void)ZSTD_DCtx_setParameter(context_.get(), ZSTD_d_windowLogMax, kMostWindowLog);
  }

  void add(const void* bytes, std::size_t size, const CancellationToken& cancel) {
    ZSTD_inBuffer in{bytes, size, 0};
    while (in.pos < in.size) {
      cancel.throw_if_cancelled();
      if (is_over_) refuse("samples_zstd", "more than one zstd frame; send all samples in one");
      const std::size_t all = samples_.size();
      ZSTD_outBuffer out{samples_.data(), std::min(all, unpacked_ + kPiece), unpacked_};
      const std::size_t before = in.pos;
      const std::size_t result = ZSTD_decompressStream(context_.get(), &out, &in);
      if (ZSTD_isError(result) != 0) {
        refuse("samples_zstd", std::string("not a zstd frame with a window of at most 8 MiB: ") +
                                   ZSTD_getErrorName(result) + "; zstd's levels up to 19 make one");
      }
      is_over_ = result == 0;
      const bool is_stuck = in.pos == before && out.pos == unpacked_;
      unpacked_ = out.pos;
      if (is_stuck && unpacked_ == all) refuse("samples_zstd", "more samples than the volume has; send those alone");
    }
  }
  void finish() const {
    if (is_over_ && unpacked_ == samples_.size()) return;
    refuse("samples_zstd", "holds " + std::to_string(unpacked_) + " bytes of samples, and the volume has " +
                               std::to_string(samples_.size()) + "; send all of them in one zstd frame");
  }

 private:
  static constexpr std::size_t kPiece = 4 << 20;  // Between looks at the token.

  struct FreeContext {
    void operator()(ZSTD_DCtx* context) const noexcept { ZSTD_freeDCtx(context); }
  };

  std::vector<std::byte>& samples_;
  std::unique_ptr<ZSTD_DCtx, FreeContext> context_;
  std::size_t unpacked_ = 0;
  bool is_over_ = false;
};

class VolumeReader {
 public:
  VolumeReader(const std::vector<std::string>& blocks, const std::function<void(std::uint64_t)>& reserve,
               const CancellationToken& cancel)
      : blocks_(blocks), in_(blocks_.stream()), reserve_(reserve), cancel_(cancel) {}

  Volume read() {
    while (const std::uint32_t tag = in_.ReadTag()) read_field(tag);
    if (!in_.ConsumedEntireMessage()) not_a_volume();
    if (!has_samples_) refuse("samples_zstd", "none; send the samples, as one zstd frame");
    return Volume(shape_, std::move(samples_), cancel_);
  }

 private:
  void read_field(std::uint32_t tag) {
    const int field = WireFormatLite::GetTagFieldNumber(tag);
    if (has_samples_) refuse("samples_zstd", "comes before other fields, or twice; send it last");
    switch (field) {
      case v1::Volume::kSamplesIFieldNumber: shape_.samples[0] = read_number(tag); return;
      case v1::Volume::kSamplesJFieldNumber: shape_.samples[1] = read_number(tag); return;
      case v1::Volume::kSamplesKFieldNumber: shape_.samples[2] = read_number(tag); return;
      case v1::Volume::kSampleTypeFieldNumber: type_ = static_cast<int>(read_number(tag)); return;
      case v1::Volume::kChannelsFieldNumber: shape_.channels = std::max(1u, read_number(tag)); return;
      case v1::Volume::kSamplesZstdFieldNumber: return read_samples(tag);
      default: break;
    }
    refuse("", "field " + std::to_string(field) +
                   " isn't one of a volume that this server knows: use a newer server, "
                   "or leave it out");
  }

  static void require_wire_type(std::uint32_t tag, WireFormatLite::WireType type) {
    if (WireFormatLite::GetTagWireType(tag) != type) not_a_volume();
  }

  std::uint32_t read_number(std::uint32_t tag) {
    require_wire_type(tag, WireFormatLite::WIRETYPE_VARINT);
    std::uint32_t number = 0;
    if (!in_.ReadVarint32(&number)) not_a_volume();
    return number;
  }

  void read_samples(std::uint32_t tag) {
    require_wire_type(tag, WireFormatLite::WIRETYPE_LENGTH_DELIMITED);
    std::uint32_t left = 0;
    if (!in_.ReadVarint32(&left)) not_a_volume();
    shape_.type = to_sample_type(type_);
    const std::uint64_t bytes = shape_.bytes();
    reserve_(bytes);
    samples_.resize(bytes);
    Unpacker unpacker(samples_);
    while (left > 0) {
      const void* piece = nullptr;
      int size = 0;
      if (!in_.GetDirectBufferPointer(&piece, &size) || size <= 0) not_a_volume();
      const auto used = std::min(left, static_cast<std::uint32_t>(size));
      unpacker.add(piece, used, cancel_);
      in_.Skip(static_cast<int>(used));
      left -= used;
    }
    unpacker.finish();
    has_samples_ = true;
  }

  BlockStream blocks_;
  CodedInputStream in_;
  const std::function<void(std::uint64_t)>& reserve_;
  const CancellationToken& cancel_;
  VolumeShape shape_{.samples = {0, 0, 0}};
  int type_ = v1::VOLUME_SAMPLE_TYPE_UNSPECIFIED;
  std::vector<std::byte> samples_;
  bool has_samples_ = false;
};

}  // namespace

bool holds_volume(const std::vector<std::string>& blocks) {
  BlockStream stream(blocks);
  CodedInputStream in(stream.stream());
  return WireFormatLite::GetTagFieldNumber(in.ReadTag()) >= v1::Volume::kSamplesIFieldNumber;
}

Volume read_volume(const std::vector<std::string>& blocks, const std::function<void(std::uint64_t)>& reserve,
                   const CancellationToken& cancel) {
  cancel.throw_if_cancelled();
  return VolumeReader(blocks, reserve, cancel).read();
}

}  // namespace ccslice::server
