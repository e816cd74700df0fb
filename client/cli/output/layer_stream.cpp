// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/layer_stream.h"

#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>
#include <vector>

#include "client/cli/base/message_json.h"
#include "client/cli/output/manifest.h"
#include "client/cli/output/tar.h"
#include "client/mesh_bytes.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

[[noreturn]] void fail() {
  throw Error(ErrorCode::kFileUnwritable, std::string("cannot write to standard output: ") + std::strerror(errno));
}

}  // namespace

LayerStream::LayerStream(std::FILE* stream, StreamForm form, LayerFiles files, JobKey job)
    : stream_(stream), form_(form), files_(std::move(files)), job_(std::move(job)) {
  std::signal(SIGPIPE, SIG_IGN);
}

void LayerStream::put(std::string_view bytes) {
  if (std::fwrite(bytes.data(), 1, bytes.size(), stream_) != bytes.size()) fail();
  written_bytes_ += bytes.size();
}

void LayerStream::flush() {
  if (std::fflush(stream_) != 0) fail();
}

void LayerStream::add(const std::string& name, std::string_view bytes) {
  const bool archive = form_ == StreamForm::kArchive;
  if (archive) put(tar_header(name, bytes.size()));
  put(bytes);
  if (archive) put(tar_padding(bytes.size()));
  flush();
}

void LayerStream::write(const client::Layer& layer) {
  const std::vector<LayerFile> files = files_.of(layer);
  for (const LayerFile& file : files) add(file.name, file.bytes);
  *manifest_.add_layers() = files_.manifest_entry(layer, files);
}

std::string LayerStream::write_contact_sheet(const std::string& png) {
  add(kContactSheet, png);
  if (job_.share) job_.share->contact_sheet = client::sha256_of(png);
  return kContactSheet;
}

void LayerStream::finish(const client::SliceOutcome& outcome, const v1::SliceJob& sliced,
                         const v1::PlanSlicesResponse& plan) {
  if (form_ == StreamForm::kOneFile) return;
  complete_manifest(outcome, sliced, plan, job_, manifest_);
  add(kManifest, json_of(manifest_) + "\n");
  put(tar_end());
  flush();
}

}  // namespace ccslice::cli
