// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Sliced layers on standard output, for other programs to take as they are made: a tar archive of the folder that they
// would go to (layer_folder.h), manifest.json last, or the one file of one layer as it is.

#pragma once

#include <cstdio>
#include <string>
#include <string_view>

#include "client/cli/base/messages.h"
#include "client/cli/output/job_journal.h"
#include "client/cli/output/layer_files.h"
#include "client/cli/output/layer_sink.h"

namespace ccslice::cli {

enum class StreamForm {
  kArchive,
  kOneFile,  // Of the one layer and the one plane, or its contours: no archive around it, no manifest, no sheet.
};

class LayerStream : public LayerSink {
 public:
  /// From here on, a reader that goes away is an error and not the program's end.
  LayerStream(std::FILE* stream, StreamForm form, LayerFiles files, JobKey job);

  const client::SliceOutcome& finished() const override { return finished_; }
  void write(const client::Layer& layer) override;
  bool takes_contact_sheet() const override { return form_ == StreamForm::kArchive; }
  std::string write_contact_sheet(const std::string& png) override;
  void finish(const client::SliceOutcome& outcome, const v1::SliceJob& sliced,
              const v1::PlanSlicesResponse& plan) override;
  std::uint64_t written_bytes() const override { return written_bytes_; }

 private:
  void add(const std::string& name, std::string_view bytes);
  void put(std::string_view bytes);
  void flush();

  std::FILE* const stream_;
  const StreamForm form_;
  const LayerFiles files_;
  JobKey job_;
  const client::SliceOutcome finished_;  // Nothing is there before.
  v1::Manifest manifest_;
  std::uint64_t written_bytes_ = 0;
};

}  // namespace ccslice::cli
