// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/job_parts.h"

#include <algorithm>
#include <limits>
#include <list>
#include <optional>
#include <string_view>
#include <unordered_set>
#include <utility>

#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/channel/channel_table.h"
#include "core/job/validate_job.h"
#include "core/limit/support.h"
#include "core/output/encode.h"
#include "core/output/pack_indices.h"
#include "server/rpc/convert/convert.h"
#include "server/rpc/convert/convert_fields.h"
#include "server/rpc/convert/convert_printing.h"
#include "server/rpc/convert/job_field.h"
#include "server/rpc/convert/printer.h"
#include "server/service/meshes/mesh_id.h"

namespace ccslice::server {
namespace {

constexpr std::size_t kMaxPartNameBytes = 64;
constexpr int kMaxParts = 256;  // Each may have maps of its own, which take memory.

int placements_of(const v1::Part& part) { return std::max(1, part.placements_size()); }

void require_count(const v1::SliceJob& job) {
  if (job.parts().empty()) {
    throw Error(ErrorCode::kPartsMissing, "parts: none; give the job a part, with the id of its mesh", "parts");
  }
  if (job.parts_size() > kMaxParts) {
    throw Error(ErrorCode::kTooManyParts,
                "parts: " + std::to_string(job.parts_size()) + " are more than the " + std::to_string(kMaxParts) +
                    " of a job; give copies of a mesh as placements of one part",
                "parts");
  }
  std::size_t count = 0;
  for (const v1::Part& part : job.parts()) count += static_cast<std::size_t>(placements_of(part));
  if (count <= kMaxPlacedParts) return;
  throw Error(ErrorCode::kTooManyParts,
              "parts: " + std::to_string(count) + " in all, counting each placement, are more than the " +
                  std::to_string(kMaxPlacedParts) +
                  " of a job; slice some of them in a job of their own, on the same "
                  "grid",
              "parts");
}

void require_names(const v1::SliceJob& job) {
  const auto refuse = [](int part, const std::string& what) {
    const std::string field = path_of_part(part) + ".name";
    throw Error(ErrorCode::kPartNameInvalid, field + ": " + what, field);
  };
  std::unordered_set<std::string_view> known;
  for (int p = 0; p < job.parts_size(); ++p) {
    const std::string& name = job.parts(p).name();
    if (name.size() > kMaxPartNameBytes) {
      refuse(p, "longer than " + std::to_string(kMaxPartNameBytes) + " bytes; give it a shorter one");
    }
    if (job.parts_size() == 1) return;
    if (name.empty()) refuse(p, "none, and the job has several parts; name each");
    if (!known.insert(name).second) refuse(p, "'" + echoed(name) + "' is another part's, too; give each its own");
  }
}

/// The names of a field of the core's job, and where the contract has them.
using Renamed = std::vector<std::pair<std::string, std::string>>;

/// The same as with_fields(), of fields that begin with one of the names.
template <typename Body>
auto renaming(const Renamed& names, const std::string& behind, const Body& body) {
  const auto field_of = [&](const std::string& field) {
    const auto name = std::ranges::find_if(names, [&](const auto& each) { return field.starts_with(each.first); });
    return name == names.end() ? field : name->second + field.substr(name->first.size());
  };
  return with_fields(field_of, behind, body);
}

/// For messages.
std::string name_of(const v1::SliceJob& job, const PartPlace& place) {
  const v1::Part& part = job.parts(place.part);
  const std::string name = part.name().empty() ? "part" : part.name();
  return part.placements_size() < 2 ? name : name + ", copy " + std::to_string(place.placement + 1);
}

/// What is behind the message of an error of one of several parts.
std::string naming(const v1::SliceJob& job, int part) {
  return job.parts_size() == 1 ? "" : " (part '" + echoed(job.parts(part).name()) + "')";
}

/// The planes with what follows from all parts together: the channels that no name is given for, and how cell regions
/// are stored.
google::protobuf::RepeatedPtrField<v1::PlaneSpec> planes_of_all(const v1::SliceJob& message, const PlacedParts& parts) {
  const v1::SampleType region_type = to_message(smallest_index_type(cell_region_names(parts).size()));
  auto planes = message.planes();
  for (v1::PlaneSpec& plane : planes) {
    if (plane.has_channels() && plane.channels().names().empty()) {
      for (const ChannelRange& channel : parts.front().solid->summary().channels) {
        plane.mutable_channels()->add_names(channel.name);
      }
    }
    if (plane.has_cell_regions() && plane.sample_type() == v1::SAMPLE_TYPE_UNSPECIFIED) {
      plane.set_sample_type(region_type);
    }
  }
  return planes;
}

/// What cell regions of several parts are too many for.
void require_region_numbers(const PlacedParts& parts) {
  const std::size_t count = cell_region_names(parts).size();
  const SliceJob& job = parts.front().job;
  constexpr std::size_t kMost = 255;
  if (count > kMost && (job.contours_by_cell_region || shows_cell_regions(job))) {
    throw Error(ErrorCode::kTooManyParts,
                "parts: their meshes have cell regions of " + std::to_string(count) + " names, more than " +
                    std::to_string(kMost) + "; slice some of them in a job of their own",
                "parts");
  }
  for (std::size_t i = 0; i < job.planes.size(); ++i) {
    if (job.planes[i].content != PlaneContent::kCellRegions) continue;
    const auto obstacle = index_encoding_obstacle(job.planes[i].sample_type, job.planes[i].encoding, count);
    if (!obstacle) continue;
    const std::string field = "planes[" + std::to_string(i) + "].sample_type";
    throw Error(ErrorCode::kEncodingUnsupported,
                field + ": the parts have " + std::to_string(count) + " cell regions; " + std::string(*obstacle),
                field);
  }
}

/// The printing of a part: the job's, but for the maps and the seed of its own.
Printing printing_of(const v1::SliceJob& message, int part, const LimitSolid& solid, const ChannelSources& sources) {
  const v1::Part& own = message.parts(part);
  v1::Printing printing = message.printing();
  Renamed names;
  if (own.has_map()) {
    *printing.mutable_map() = own.map();
    names.emplace_back("printing.map", path_of_part(part) + ".map");
  }
  if (!own.cell_region_maps().empty() || own.has_map()) {
    *printing.mutable_cell_region_maps() = own.cell_region_maps();
    names.emplace_back("printing.cell_region_maps", path_of_part(part) + ".cell_region_maps");
  }
  if (own.has_halftone_seed()) printing.mutable_halftone()->set_seed(own.halftone_seed());
  return renaming(names, "", [&] {
    Printing read = to_printing(printing, solid.summary());
    if (!names.empty()) validate_printing(read, solid.summary(), sources);
    return read;
  });
}

SliceJob job_of_part(const v1::SliceJob& message, int part, const LimitSolid& solid, ChannelSources sources,
                     const google::protobuf::RepeatedPtrField<v1::PlaneSpec>& planes) {
  SliceJob job;
  job.sources = std::move(sources);
  if (!message.cut().empty()) job.cut = message.cut();
  if (message.has_printing()) job.printing = printing_of(message, part, solid, job.sources);
  job.planes = to_planes(planes, solid.summary(), job.printing);
  job.order = to_order(message.layout());
  job.contours = message.has_contours();
  job.contours_by_cell_region = message.contours().by_cell_region();
  const v1::Tolerances& tolerances = message.tolerances();
  if (tolerances.has_contour_mm()) job.contour_tolerance_mm = tolerances.contour_mm();
  if (tolerances.has_channel()) job.channel_tolerance = tolerances.channel();
  job.prove_channels = tolerances.prove_channels();
  job.refuses_overlaps = message.overlaps() == v1::PART_OVERLAPS_REFUSE;
  job.snap_copies = message.snap();
  return job;
}

/// Integer samples of several parts stand for the same values: what all of them have.
void share_ranges(PlacedParts& parts) {
  for (std::size_t p = 0; p < parts.front().job.planes.size(); ++p) {
    const PlaneSpec& plane = parts.front().job.planes[p];
    if (plane.content != PlaneContent::kChannel || plane.range || plane.sample_type == SampleType::kFloat32) continue;
    ValueRange all{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    for (const PlacedPart& part : parts) {
      if (part.is_copy) continue;
      const ChannelRange range = ChannelTable(part.solid->summary().channels, part.job.sources).at(plane.channel).range;
      all = {std::min(all.min, range.min), std::max(all.max, range.max)};
    }
    if (!(all.min < all.max)) continue;  // The same constant in all: 0.
    for (PlacedPart& part : parts) part.job.planes[p].range = all;
  }
}

void require_known_overlaps(const v1::SliceJob& message) {
  if (v1::PartOverlaps_IsValid(message.overlaps())) return;
  throw Error(ErrorCode::kEnumValueUnknown,
              "overlaps: " + std::to_string(static_cast<int>(message.overlaps())) +
                  " isn't a way that this server knows; ask for BY_PRIORITY or REFUSE",
              "overlaps");
}

/// What all copies of a part take, about: each has planes and maps of its own.
std::uint64_t copied_bytes_of(const v1::SliceJob& message, int part) {
  constexpr std::uint64_t kCopy = 4 << 10;
  const std::uint64_t maps = message.printing().ByteSizeLong() + message.parts(part).map().ByteSizeLong();
  std::uint64_t bytes = kCopy + 2 * maps;
  for (const v1::CellRegionMap& own : message.parts(part).cell_region_maps()) bytes += 2 * own.ByteSizeLong();
  return bytes * static_cast<std::uint64_t>(placements_of(message.parts(part)));
}

void require_copied_bytes(std::uint64_t bytes) {
  constexpr std::uint64_t kMost = 64 << 20;
  if (bytes <= kMost) return;
  throw Error(ErrorCode::kTooManyParts,
              "parts: their material maps, once for each copy, take more than 64 MiB; give fewer copies or shorter "
              "maps",
              "parts");
}

/// Boxes of placed parts. Those of copies that differ by where they lie are moved: finding one takes time.
class PlacedBoxes {
 public:
  Box3 operator()(const PlacedPart& part, const CancellationToken& cancel) {
    const Placement& placement = part.job.placement;
    if (part.solid != solid_ || !lie_alike(placement, placement_)) {
      solid_ = part.solid;
      placement_ = placement;
      box_ = bounding_box(*part.solid, placement, cancel);
    }
    const Vec3 moved = placement.translation() - placement_.translation();
    return Box3(box_.min() + moved, box_.max() + moved);
  }

 private:
  std::shared_ptr<const LimitSolid> solid_;
  Placement placement_ = Placement::Identity();
  Box3 box_;
};

/// Sources of parts. Those of one mesh share them, unless they lie otherwise and that makes a difference.
class SourcesOfJob {
 public:
  SourcesOfJob(const Fields& fields, const Volumes& volumes, const Box3& box)
      : fields_(fields), volumes_(volumes), box_(box), depend_on_placement_(server::depend_on_placement(fields)) {}

  bool depend_on_placement() const { return depend_on_placement_; }
  const ChannelSources& find(const std::shared_ptr<const LimitSolid>& solid, const Placement& placement) {
    const auto is_it = [&](const Made& made) {
      return made.solid == solid && (!depend_on_placement_ || lie_alike(made.placement, placement));
    };
    const auto known = std::ranges::find_if(made_, is_it);
    if (known != made_.end()) return known->sources;
    if (depend_on_placement_ && made_.size() == kMostPlacements) {
      throw Error(ErrorCode::kTooManyParts,
                  "parts: fields read distances, of more than " + std::to_string(kMostPlacements) +
                      " meshes and ways to turn or size them; slice some parts in a job of their own",
                  "parts");
    }
    return made_.emplace_back(Made{solid, placement, to_sources(fields_, volumes_, solid, placement.linear(), box_)})
        .sources;
  }

 private:
  static constexpr std::size_t kMostPlacements = 64;
  struct Made {
    std::shared_ptr<const LimitSolid> solid;
    Placement placement;
    ChannelSources sources;
  };

  const Fields& fields_;
  const Volumes& volumes_;
  Box3 box_;
  bool depend_on_placement_;
  std::list<Made> made_;
};

/// Copies are snapped before there is a grid, whose place may follow from theirs.
SnappedCopies snap_to_grid(const v1::SliceJob& message, const SliceLimits& limits, PlacedParts& parts) {
  const VoxelPitch pitch = grid_request_of(message).pitch;
  validate_pitch(pitch, limits);
  return snap_copies(parts, pitch);
}

PlacedParts to_parts_of_job(const v1::SliceJob& message, std::span<const std::shared_ptr<const LimitSolid>> solids,
                            const SliceLimits& limits, const CancellationToken& cancel, SnappedCopies* snapped,
                            const Volumes& volumes) {
  require_known_overlaps(message);
  PlacedParts parts;
  std::vector<std::size_t> first_of;  // By part: its first copy.
  PlacedBoxes boxes;
  Box3 box;
  for (const PartPlace& place : part_places(message)) {
    const auto& [p, k] = place;
    const auto& solid = solids[static_cast<std::size_t>(p)];
    if (k == 0) first_of.push_back(parts.size());
    PlacedPart& part = parts.emplace_back();
    part.name = name_of(message, place);
    part.solid = solid;
    part.priority = message.parts(p).priority();
    part.is_copy = k > 0;
    if (message.parts(p).placements().empty()) continue;
    const Renamed names = {{"placement", path_of_part(p) + ".placements[" + std::to_string(k) + "]"}};
    part.job.placement = renaming(names, naming(message, p), [&] {
      return to_placement(message.parts(p).placements(k), solid->summary().bounding_box, limits);
    });
  }
  if (message.snap()) {
    const SnappedCopies moved = snap_to_grid(message, limits, parts);
    if (snapped != nullptr) *snapped = moved;
  }
  for (const PlacedPart& part : parts) box.extend(boxes(part, cancel));
  const Grid grid = to_grid(message, box, limits);
  std::optional<VoxelBox> region;
  if (message.has_region()) region = to_region(message.region(), grid);
  const auto planes = planes_of_all(message, parts);
  SourcesOfJob sources(message.fields(), volumes, box);
  std::vector<SliceJob> jobs(static_cast<std::size_t>(message.parts_size()));
  std::uint64_t copied_bytes = 0;
  check_parts(message, [&](int p) {
    cancel.throw_if_cancelled();
    const LimitSolid& solid = *solids[static_cast<std::size_t>(p)];
    renaming({}, naming(message, p), [&] {
      const Placement& placement = parts[first_of[static_cast<std::size_t>(p)]].job.placement;
      SliceJob& job = jobs[static_cast<std::size_t>(p)] =
          job_of_part(message, p, solid, sources.find(solids[static_cast<std::size_t>(p)], placement), planes);
      job.grid = grid;
      job.region = region;
      validate_job(solid, job, limits);
    });
    copied_bytes += copied_bytes_of(message, p);
    require_copied_bytes(copied_bytes);
  });
  std::size_t made = 0;
  for (int p = 0; p < message.parts_size(); ++p) {
    const SliceJob& job = jobs[static_cast<std::size_t>(p)];
    for (int k = 0; k < placements_of(message.parts(p)); ++k) {
      SliceJob& placed = parts[made++].job;
      const Placement placement = placed.placement;
      placed = job;
      placed.placement = placement;
      if (k > 0 && sources.depend_on_placement()) {
        placed.sources = sources.find(solids[static_cast<std::size_t>(p)], placement);
      }
    }
  }
  if (parts.size() > 1) share_ranges(parts);
  return parts;
}

}  // namespace

std::vector<std::string> mesh_ids_of(const v1::SliceJob& job, const std::string& path) {
  at_job(path, [&] {
    require_count(job);
    require_names(job);
  });
  std::vector<std::string> ids;
  for (int p = 0; p < job.parts_size(); ++p) {
    ids.push_back(job.parts(p).mesh_id());
    require_mesh_id(ids.back(), path + "." + path_of_part(p) + ".mesh_id");
  }
  for (const std::string& id : volume_ids_of(job.fields(), path + ".")) ids.push_back(id);
  return ids;
}

void check_parts(const v1::SliceJob& job, const std::function<void(int part)>& check) {
  std::optional<Error> first;
  std::vector<std::string> lacking;
  for (int p = 0; p < job.parts_size(); ++p) {
    try {
      check(p);
    } catch (const Error& error) {
      const bool is_unknown = error.code() == ErrorCode::kChannelUnknown;
      if (!first && (!is_unknown || job.parts_size() == 1)) throw;
      if (!first) first = error;
      if (is_unknown && error.field() == first->field()) lacking.push_back("'" + echoed(job.parts(p).name()) + "'");
    }
  }
  if (!first) return;
  throw Error(first->code(),
              std::string(first->what()) + "; parts that lack it: " + echoed_list(lacking, lacking.size()),
              first->field());
}

std::vector<PartPlace> part_places(const v1::SliceJob& job) {
  std::vector<PartPlace> places;
  for (int p = 0; p < job.parts_size(); ++p) {
    for (int k = 0; k < placements_of(job.parts(p)); ++k) places.push_back({p, k});
  }
  return places;
}

PlacedParts to_placed_parts(const v1::SliceJob& message, const std::string& path,
                            std::span<const std::shared_ptr<const LimitSolid>> solids, const SliceLimits& limits,
                            const CancellationToken& cancel, SnappedCopies* snapped, const Volumes& volumes) {
  return at_job(path, [&] {
    PlacedParts parts = to_parts_of_job(message, solids, limits, cancel, snapped, volumes);
    if (parts.size() > 1) require_region_numbers(parts);
    return parts;
  });
}

v1::Printing printing_with_defaults(const v1::SliceJob& message, const PlacedParts& parts) {
  v1::Printing printing = to_message(*parts.front().job.printing, parts.front().solid->summary());
  const v1::Part& first = message.parts(0);
  printing.mutable_halftone()->set_seed(message.printing().halftone().seed());
  for (int m = 0; m < printing.materials_size(); ++m) {
    printing.mutable_materials(m)->set_density_g_per_cm3(message.printing().materials(m).density_g_per_cm3());
  }
  if (!first.has_map() && first.cell_region_maps().empty()) return printing;
  printing.clear_map();
  if (message.printing().has_map()) *printing.mutable_map() = message.printing().map();
  *printing.mutable_cell_region_maps() = message.printing().cell_region_maps();
  return printing;
}

}  // namespace ccslice::server
