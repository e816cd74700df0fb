// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Volumes from files: what --volume says, and what a job's file names.

#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "ccslice/v1/job.pb.h"
#include "client/cli/session/session.h"
#include "client/mesh_bytes.h"
#include "core/volume_files/volume_file.h"

namespace ccslice::cli {

/// Files that were read for a command, each once, and packed for the upload.
class LoadedVolumes {
 public:
  struct File {
    std::string path;
    bool axes_are_xyz = false;
    VolumeFile said;  // Without its samples.
    std::shared_ptr<const client::MeshBytes> bytes;
  };

  /// Throws Error{4xx, kVolumeInvalid}.
  const File& read(const std::string& path, bool axes_are_xyz);
  void note(const std::string& note);

  const std::vector<std::unique_ptr<File>>& files() const { return files_; }
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  std::vector<std::unique_ptr<File>> files_;
  std::vector<std::string> notes_;
};

/// A field by "[world:]NAME=FILE[:OPTION...]". Reads the file. Throws UsageError, Error{4xx, kVolumeInvalid}.
v1::Field parse_volume(std::string_view text, LoadedVolumes& loaded);

/// Reads the volumes that fields of a job in `job_file` name by paths, as meshes are, and puts their ids there. Files
/// say the place and the slope of those whose job doesn't. `options`: of --volume, which say where the files are that
/// fields of these names name by ids. Throws as above.
void load_volumes_of_job(const std::string& job_file, const std::vector<std::string>& options, v1::SliceJob& job,
                         LoadedVolumes& loaded);

/// Uploads those that the server of this mesh lacks, after what is to be said of them.
void put_volumes_on_server(Session& session, const std::string& mesh_id, const LoadedVolumes& loaded);

}  // namespace ccslice::cli
