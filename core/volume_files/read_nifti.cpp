// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume_files/read_nifti.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "core/mesh_import/byte_order.h"
#include "core/volume_files/raw_samples.h"
#include "core/volume_files/unzip.h"

namespace ccslice {
namespace {

using Kind = RawFormat::Kind;

constexpr std::size_t kHeaderBytes = 348, kNifti2HeaderBytes = 540;
// Offsets of the header's fields.
constexpr std::size_t kDim = 40, kDatatype = 70, kPixdim = 76, kVoxOffset = 108, kSclSlope = 112, kSclInter = 116,
                      kXyztUnits = 123, kQformCode = 252, kSformCode = 254, kQuatern = 256, kQoffset = 268, kSrow = 280,
                      kMagic = 344;

std::optional<bool> byte_order(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes) return std::nullopt;
  if (little_endian(bytes.substr(0, 4)) == kHeaderBytes) return false;
  if (big_endian(bytes.substr(0, 4)) == kHeaderBytes) return true;
  return std::nullopt;
}

class NiftiHeader {
 public:
  NiftiHeader(std::string_view bytes, bool big_endian) : bytes_(bytes), big_endian_(big_endian) {}

  int integer(std::size_t at) const {
    return static_cast<std::int16_t>(number_in_bytes(bytes_.substr(at, 2), big_endian_));
  }
  double real(std::size_t at) const {
    return std::bit_cast<float>(static_cast<std::uint32_t>(number_in_bytes(bytes_.substr(at, 4), big_endian_)));
  }
  int byte(std::size_t at) const { return static_cast<std::uint8_t>(bytes_[at]); }

 private:
  std::string_view bytes_;
  bool big_endian_;
};

/// Numbers of each component, and how many components there are.
std::pair<RawFormat, std::uint32_t> nifti_format(int datatype) {
  switch (datatype) {
    case 2: return {{Kind::kUnsigned, 1}, 1};
    case 4: return {{Kind::kSigned, 2}, 1};
    case 8: return {{Kind::kSigned, 4}, 1};
    case 16: return {{Kind::kFloat, 4}, 1};
    case 64: return {{Kind::kFloat, 8}, 1};
    case 128: return {{Kind::kUnsigned, 1}, 3};  // RGB.
    case 256: return {{Kind::kSigned, 1}, 1};
    case 512: return {{Kind::kUnsigned, 2}, 1};
    case 768: return {{Kind::kUnsigned, 4}, 1};
    case 1024: return {{Kind::kSigned, 8}, 1};
    case 1280: return {{Kind::kUnsigned, 8}, 1};
    case 2304: return {{Kind::kUnsigned, 1}, 4};  // RGBA.
    default: break;
  }
  throw Error(ErrorCode::kFileUnsupported,
              "datatype " + std::to_string(datatype) + " isn't read; save the volume as whole numbers or floats");
}

/// mm of a unit of length.
double unit_mm(int xyzt_units) {
  constexpr int kSpace = 7;
  switch (xyzt_units & kSpace) {
    case 1: return 1000;
    case 3: return 0.001;
    default: return 1;
  }
}

/// The rotation of the unit quaternion (a, b, c, d), whose first number follows from the others.
Mat3 rotation_of(double b, double c, double d) {
  const double rest = 1 - (b * b + c * c + d * d);
  if (rest < 1e-7) {
    const double length = std::sqrt(b * b + c * c + d * d);
    return Eigen::Quaterniond(0, b / length, c / length, d / length).toRotationMatrix();
  }
  return Eigen::Quaterniond(std::sqrt(rest), b, c, d).toRotationMatrix();
}

void set_place(const NiftiHeader& header, const std::array<double, 3>& spacing, VolumeFile& file) {
  Placement place = Placement::Identity();
  bool is_ras = true;
  if (header.integer(kSformCode) > 0) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) {
        place.matrix()(row, column) =
            header.real(kSrow + 16 * static_cast<std::size_t>(row) + 4 * static_cast<std::size_t>(column));
      }
    }
  } else {
    is_ras = header.integer(kQformCode) > 0;
    if (is_ras) {
      place.linear() = rotation_of(header.real(kQuatern), header.real(kQuatern + 4), header.real(kQuatern + 8));
      place.translation() = Vec3(header.real(kQoffset), header.real(kQoffset + 4), header.real(kQoffset + 8));
      if (header.real(kPixdim) < 0) place.linear().col(2) *= -1;  // qfac
    }
    for (int axis = 0; axis < 3; ++axis) place.linear().col(axis) *= spacing[static_cast<std::size_t>(axis)];
  }
  if (!place.matrix().allFinite()) throw Error(ErrorCode::kFileSyntax, "the place of the samples isn't finite");
  if (is_ras) place = Eigen::Scaling(-1.0, -1.0, 1.0) * place;
  file.mm_of_index = Eigen::Scaling(unit_mm(header.byte(kXyztUnits))) * place;
  file.is_lps = is_ras;
}

}  // namespace

bool is_nifti(std::string_view bytes) noexcept {
  return bytes.size() >= 8 &&
         (byte_order(bytes).has_value() || little_endian(bytes.substr(0, 4)) == kNifti2HeaderBytes ||
          big_endian(bytes.substr(0, 4)) == kNifti2HeaderBytes);
}

VolumeFile read_nifti(std::string_view packed) {
  std::string unpacked;
  std::string_view bytes = packed;
  if (is_gzip(packed)) {
    unpacked = unzip(packed, kHeaderBytes, "the header");
    bytes = unpacked;
  }
  const std::optional<bool> order = byte_order(bytes);
  if (!order) {
    throw Error(ErrorCode::kFileUnsupported, "not a NIfTI-1 file; save a NIfTI-2 file as NIfTI-1, or as .nrrd or .mha");
  }
  const NiftiHeader header(bytes, *order);
  if (bytes.substr(kMagic, 3) != "n+1") {
    throw Error(ErrorCode::kFileUnsupported, "samples aren't in the same file; save the volume as one .nii");
  }
  VolumeFile file;
  const int axes = header.integer(kDim);
  if (axes < 1 || axes > 7) throw Error(ErrorCode::kFileSyntax, "dim[0] is " + std::to_string(axes) + ", not 1 to 7");
  std::uint64_t images = 1;
  for (int axis = 1; axis <= axes; ++axis) {
    const int samples = header.integer(kDim + 2 * static_cast<std::size_t>(axis));
    if (samples < 1) throw Error(ErrorCode::kFileSyntax, "dim[" + std::to_string(axis) + "] isn't positive");
    if (axis <= 3) file.shape.samples[static_cast<std::size_t>(axis) - 1] = static_cast<std::uint32_t>(samples);
    if (axis > 3) images = std::min<std::uint64_t>(images * static_cast<std::uint64_t>(samples), 1 << 20);
  }
  auto [format, components] = nifti_format(header.integer(kDatatype));
  if (images > 1 && components > 1) {
    throw Error(ErrorCode::kFileUnsupported, "colours at several times; save those of one time");
  }
  file.shape.channels = static_cast<std::uint32_t>(images) * components;
  format.big_endian = *order;
  std::array<double, 3> spacing{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    spacing[axis] = std::abs(header.real(kPixdim + 4 * (axis + 1)));
    if (spacing[axis] == 0) spacing[axis] = 1;
  }
  set_place(header, spacing, file);
  const double slope = header.real(kSclSlope), intercept = header.real(kSclInter);
  if (slope != 0 && std::isfinite(slope) && std::isfinite(intercept) && components == 1) {
    file.slope = slope;
    file.intercept = intercept;
  }
  const double offset = header.real(kVoxOffset);
  if (!(offset >= kHeaderBytes && offset < 1e9))
    throw Error(ErrorCode::kFileSyntax, "vox_offset isn't behind the header");
  const auto first = static_cast<std::uint64_t>(offset);
  const std::uint64_t wanted = raw_bytes(file.shape, format);
  if (is_gzip(packed)) {
    unpacked = unzip(packed, first + wanted, "the samples");
    bytes = unpacked;
  }
  if (bytes.size() < first + wanted) {
    throw Error(ErrorCode::kFileSyntax, std::to_string(bytes.size()) + " bytes, and the header promises " +
                                            std::to_string(first + wanted) + "; the file was cut off");
  }
  take_samples(bytes.substr(first, wanted), format, {.channels_last = images > 1}, file);
  return file;
}

}  // namespace ccslice
