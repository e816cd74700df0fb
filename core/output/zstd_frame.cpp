// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/zstd_frame.h"

#define ZSTD_STATIC_LINKING_ONLY  // For ZSTD_c_literalCompressionMode.
#include <zstd.h>

#include <algorithm>
#include <new>
#include <string>

#include "core/base/error.h"
#include "core/output/polling.h"

namespace ccslice {
namespace {

constexpr int kLevel = 1;

std::size_t checked(std::size_t zstd_result) {
  if (ZSTD_isError(zstd_result)) {
    throw Error(ErrorCode::kInternal, std::string("zstd failed: ") + ZSTD_getErrorName(zstd_result));
  }
  return zstd_result;
}

}  // namespace

void ZstdEncoder::FreeContext::operator()(ZSTD_CCtx_s* context) const { ZSTD_freeCCtx(context); }

std::vector<std::uint8_t> ZstdEncoder::frame(std::span<const std::uint8_t> bytes, const CancellationToken& cancel,
                                             MatchSearch search) {
  if (!context_) context_.reset(ZSTD_createCCtx());
  if (!context_) throw std::bad_alloc();
  checked(ZSTD_CCtx_reset(context_.get(), ZSTD_reset_session_and_parameters));
  checked(ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_compressionLevel, kLevel));
  if (search == MatchSearch::kNone) {
    // The longest steps between places where matches are looked for. They switch off the coding of literals, too.
    checked(ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_targetLength, ZSTD_TARGETLENGTH_MAX));
    checked(ZSTD_CCtx_setParameter(context_.get(), ZSTD_c_literalCompressionMode, ZSTD_ps_enable));
  }
  checked(ZSTD_CCtx_setPledgedSrcSize(context_.get(), bytes.size()));
  scratch_.resize(std::max(scratch_.size(), ZSTD_compressBound(bytes.size())));
  ZSTD_outBuffer out{scratch_.data(), scratch_.size(), 0};
  for (std::size_t begin = 0; begin < bytes.size();) {
    cancel.throw_if_cancelled();
    const std::size_t piece = std::min(bytes.size() - begin, kBytesPerPoll);
    ZSTD_inBuffer in{bytes.data() + begin, piece, 0};
    begin += piece;
    const ZSTD_EndDirective directive = begin == bytes.size() ? ZSTD_e_end : ZSTD_e_continue;
    const std::size_t left = checked(ZSTD_compressStream2(context_.get(), &out, &in, directive));
    if (in.pos != in.size || (directive == ZSTD_e_end && left != 0)) {
      throw Error(ErrorCode::kInternal, "zstd wrote more than its bound");
    }
  }
  return {scratch_.begin(), scratch_.begin() + static_cast<std::ptrdiff_t>(out.pos)};
}

}  // namespace ccslice
