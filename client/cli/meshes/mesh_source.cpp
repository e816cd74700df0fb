// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/meshes/mesh_source.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

#include "client/cli/base/console.h"
#include "client/cli/base/option_group.h"
#include "client/cli/base/text_values.h"
#include "client/cli/meshes/ccmesh.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/cli/session/preparation_display.h"
#include "core/base/contains.h"
#include "core/base/echo.h"
#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/base/utf8.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/check_arrays.h"
#include "core/mesh/validate.h"
#include "core/mesh_authoring/grade.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/cell_averages.h"
#include "core/mesh_import/cell_numbers.h"
#include "core/mesh_import/channels.h"
#include "core/mesh_import/collapsed_cells.h"
#include "core/mesh_import/join_points.h"
#include "core/mesh_import/mesh_file.h"
#include "core/mesh_import/renumber_text.h"

namespace ccslice::cli {
namespace {

void check_channel_names(const ControlMesh& mesh) {
  for (const std::string& name : mesh.channel_names) {
    if (!is_utf8(name)) throw Error(ErrorCode::kMeshBadChannel, "a channel name is not UTF-8", "channel_names");
  }
}

/// Numbers of cells that become a channel.
struct CellMeans {
  std::string name;
  MeanOver over = MeanOver::kAllCells;
};

/// What NAME=average and NAME=by-region say.
std::vector<CellMeans> parse_cell_data(const MeshOptions& options) {
  std::vector<CellMeans> all;
  for (const std::string& text : options.cell_data) {
    const std::size_t sign = text.rfind('=');
    const std::string how = sign == std::string::npos ? "" : text.substr(sign + 1);
    if (sign == 0 || (how != "average" && how != "by-region")) {
      throw UsageError("--cell-data takes NAME=average or NAME=by-region, not '" + text + "'");
    }
    const bool by_region = how == "by-region";
    if (by_region && options.regions_from.empty()) {
      throw UsageError("--cell-data " + text + " goes with --regions-from, which makes the regions");
    }
    all.push_back({text.substr(0, sign), by_region ? MeanOver::kEachRegion : MeanOver::kAllCells});
  }
  return all;
}

/// Makes channels as they are asked for, and says which numbers of cells are left out.
void take_cell_numbers(const std::string& regions_from, const std::vector<CellMeans>& averaged, MeshFile& file) {
  for (const CellMeans& means : averaged) average_cell_numbers(means.name, means.over, file);
  if (regions_from.empty() && !file.cell_sets.empty()) {
    file.warnings.push_back(
        "sets of cells left out: " + echoed_names(file.cell_sets, '\'') +
        "; --regions-from NAME,NAME makes regions of those that it names, and '--regions-from sets' of all");
  }
  if (regions_from.empty() && file.cell_materials.size() > 1) {
    file.warnings.push_back("materials of cells left out: " + echoed_names(file.cell_materials, '\'') +
                            "; --regions-from materials makes regions of them");
  }
  for (const CellNumbers& numbers : file.cell_numbers) {
    const bool varies = std::ranges::adjacent_find(numbers.of_cells, std::not_equal_to<>()) != numbers.of_cells.end();
    const bool whole = std::ranges::all_of(numbers.of_cells, [](double n) { return exact_integer(n).has_value(); });
    if (!varies || numbers.name == regions_from) continue;
    if (std::ranges::find(averaged, numbers.name, &CellMeans::name) != averaged.end()) continue;
    const std::string name = echoed(numbers.name);
    file.warnings.push_back("the cells' '" + name + "' left out; " +
                            (whole ? "--regions-from " + name + " makes regions of it"
                                   : "--cell-data " + name + "=average makes a channel of it"));
  }
}

MeshFile read_any(const std::string& bytes, const FileOrigin& origin) {
  if (mesh_file_kind(bytes) != MeshFileKind::kUnknown) return read_mesh_unresolved(bytes, {}, origin);
  return {from_proto(parse_ccmesh(bytes)), {}};
}

/// Runs `action` on the mesh; its errors speak of vertices and cells in the file's numbers.
template <typename Action>
auto in_file_numbers(const FileNumbers& numbers, const ControlMesh& mesh, const Action& action) {
  try {
    return action();
  } catch (const Error& error) {
    if (error.ids().empty()) throw;
    throw Error(error.code(), renumber_text(error.what(), numbers, {error.ids(), error.ids()}, &mesh), error.field(),
                error.ids());
  }
}

/// What the options say, read before the file is.
struct Changes {
  std::vector<Grade> grades;
  Sizing sizing;
  std::optional<FittedVertices> fit;
  std::vector<CellMeans> averaged;
};

Changes parse_changes(const MeshOptions& options) {
  Changes changes;
  try {
    for (const std::string& text : options.grades) changes.grades.push_back(parse_grade(text));
  } catch (const Error& error) {
    throw UsageError(error.what());
  }
  changes.sizing = parse_sizing(options.size);
  changes.fit = parse_meaning(options.meaning);
  changes.averaged = parse_cell_data(options);
  check_merge_options(options.merge);
  return changes;
}

/// How deep a grade by distance really goes.
std::string depth_note(const Grade& grade, double deepest_mm) {
  const std::string name = "--grade " + grade.channel + "=distance ";
  if (deepest_mm == 0) {
    return name + "is " + show_number(grade.first) + " all over: every vertex lies on the boundary; refine the mesh";
  }
  const std::string deepest = show_number(deepest_mm) + " mm, where the deepest vertex lies";
  const double depth = grade.depth_mm.value_or(deepest_mm);
  if (deepest_mm == depth) return name + "reaches " + show_number(grade.last) + " at a depth of " + deepest;
  if (deepest_mm > depth) {
    return name + "reaches " + show_number(grade.last) + " at a depth of " + show_number(depth) +
           " mm and keeps it down to " + deepest;
  }
  return name + "ends at a depth of " + deepest + ", with " +
         show_number(std::lerp(grade.first, grade.last, deepest_mm / depth)) + " instead of " + show_number(grade.last);
}

void refuse_second_fit(const MeshOptions& options) {
  if (!options.meaning.any()) return;
  throw UsageError("the control points of " + options.mesh +
                   " are fitted already: say what it means with the mesh that they were fitted to");
}

/// By how much --size is about to scale a part whose limit is about as large as its mesh.
double size_factor(const Sizing& sizing, const Vec3& scale, const ControlMesh& mesh) {
  if (!sizing.side_mm) return 1;
  Box3 box;
  for (const Vec3& position : mesh.positions) box.extend(position);
  const Vec3 sides = box.sizes().cwiseProduct(scale.cwiseAbs());
  const double side = sizing.axis ? sides[*sizing.axis] : sides.maxCoeff();
  return side > 0 ? *sizing.side_mm / side : 1;
}

/// The fitted mesh beside the one that is meant, if control points are fitted, or were before and are to be graded.
std::optional<FittedMesh> fit(const MeshOptions& options, const Changes& changes, LoadedMesh& loaded, bool quiet) {
  ControlMesh& mesh = loaded.mesh;
  constexpr std::size_t kManyVertices = 20'000;
  const bool fits = changes.fit || options.meaning.part;
  if (fits && mesh.vertex_count() >= kManyVertices && !quiet) {
    print_note("fitting control points to " + show_count(mesh.vertex_count()) + " vertices");
  }
  if (options.meaning.part) {
    const Vec3 scale = size_factor(changes.sizing, options.scale, mesh) * options.scale;
    return fit_part(options.meaning, scale, mesh, quiet, loaded.warnings);
  }
  if (changes.fit) {
    FittedMesh fitted(mesh, *changes.fit, quiet);
    refuse_rounded_edges(options.meaning, fitted);
    return fitted;
  }
  if (mesh.interpolating && !changes.grades.empty()) return FittedMesh(mesh, quiet);
  return std::nullopt;
}

/// Adds channels to a mesh that --scale is to scale further: their lengths are those of the printed size. Mirrored
/// parts keep their grades, as they keep their other materials, so places are those of the part before it is mirrored.
void add_grades(const std::vector<Grade>& grades, const Vec3& scale, const Vec3& unmirrored, ControlMesh& mesh,
                std::vector<std::string>& notes) {
  if (grades.empty()) return;
  std::vector<Vec3> unscaled;  // If that isn't what they are.
  if (scale != Vec3::Ones()) {
    for_each_place(mesh, [&](Vec3& place) {
      unscaled.push_back(place);
      place = (place + unmirrored).cwiseProduct(scale.cwiseAbs());
    });
  }
  for (const Grade& grade : grades) {
    const double deepest_mm = apply_grade(grade, mesh);
    if (grade.field == GradeField::kDistance) notes.push_back(depth_note(grade, deepest_mm));
  }
  if (unscaled.empty()) return;
  auto place_before = unscaled.begin();
  for_each_place(mesh, [&](Vec3& place) { place = *place_before++; });
}

/// Lists of vertices count those that the file has, so what they say is done before points are joined. Fitted control
/// points have no values of their own: those of a list are for the vertices that they were fitted to.
void take_lists(const MeshOptions& options, const Changes& changes, MeshFile& file) {
  if (file.mesh.interpolating) return;
  sharpen_listed(options.meaning.sharp, file.mesh);
  for (const Grade& grade : changes.grades) {
    if (grade.field == GradeField::kFile) apply_grade(grade, file.mesh);
  }
}

std::vector<Grade> grades_left(const Changes& changes, const ControlMesh& mesh) {
  std::vector<Grade> left = changes.grades;
  if (!mesh.interpolating) std::erase_if(left, [](const Grade& grade) { return grade.field == GradeField::kFile; });
  return left;
}

/// Channels of grades come after all others, in the order of the options.
void order_channels(const std::vector<Grade>& grades, ControlMesh& mesh) {
  const std::size_t channels = mesh.channel_count();
  std::vector<std::size_t> order(channels);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t channel) {
    const auto grade = std::ranges::find(grades, mesh.channel_names[channel], &Grade::channel);
    return grade == grades.end() ? 0 : 1 + (grade - grades.begin());
  });
  if (std::ranges::is_sorted(order)) return;
  const std::vector<std::string> names = mesh.channel_names;
  for (std::size_t c = 0; c < channels; ++c) mesh.channel_names[c] = names[order[c]];
  for (std::vector<float>* values : {&mesh.channel_values, &mesh.region_values, &mesh.mid_nodes.values}) {
    const std::vector<float> before = *values;
    for (std::size_t i = 0; i < before.size(); ++i) (*values)[i] = before[i - i % channels + order[i % channels]];
  }
}

/// Sharpens, fits, sizes and grades the mesh, which is checked again afterwards. `checked`: the same mesh as validate()
/// left it. Grades come last, as their lengths are those of the result.
void change(const MeshOptions& options, const Changes& changes, bool quiet, const NearOrigin& near,
            const ControlMesh& checked, LoadedMesh& loaded) {
  const std::size_t notes_before = loaded.warnings.size();
  const std::vector<Grade> grades = grades_left(changes, loaded.mesh);
  if (loaded.mesh.interpolating) refuse_second_fit(options);
  if (sharpen_by_angle(options.meaning.sharp, checked, loaded.mesh, loaded.warnings)) {
    loaded.warnings.push_back("cells at sharp reentrant edges often fold in the limit; `ccslice upload` says where");
  }
  std::optional<FittedMesh> pair = fit(options, changes, loaded, quiet);
  ControlMesh& meant = pair ? pair->meant() : loaded.mesh;
  PlaceOfMesh place;
  if (changes.sizing.places()) {
    place = find_place(options.size, changes.sizing, options.scale, near, pair ? pair->fitted() : loaded.mesh,
                       loaded.warnings);
    pair ? pair->place(place.similarity) : place.similarity.apply(loaded.mesh);
  }
  add_grades(grades, options.scale, place.unmirrored, meant, loaded.warnings);
  if (pair) loaded.mesh = pair->finish(options.scale, loaded.warnings);
  order_channels(changes.grades, loaded.mesh);
  check_channel_names(loaded.mesh);
  for (std::string& note : std::span(loaded.warnings).subspan(notes_before)) note = renumber_text(note, loaded.numbers);
}

/// The option that helps, if one does and the message names none itself.
const char* remedy_of(const Error& error, const MeshOptions& options) {
  const ErrorCode code = error.code();
  if (std::string_view(error.what()).find("--") != std::string_view::npos) return "";
  if (code == ErrorCode::kMeshBadCellRegion) return options.regions_from.empty() ? "" : " (--regions-from)";
  if (code == ErrorCode::kMeshInvertedCell) return " (--allow-folds)";
  if (code == ErrorCode::kMeshNotInterpolable) {
    return options.meaning.fit == "boundary" ? "" : " (--fit=boundary)";
  }
  if (code != ErrorCode::kMeshCoordinateOutOfRange) return "";
  return " (--units says what unit the file is in, --size what size the part becomes; --center and --on-bed move it to "
         "the origin)";
}

void refuse_broken_id(const std::string& mesh) {
  std::error_code ignored;
  if (!mesh.starts_with("sha256:") || std::filesystem::exists(mesh, ignored)) return;
  throw Error(ErrorCode::kFileUnreadable,
              mesh + " is no file, and no mesh's id: those have 64 hexadecimal digits in lower case behind sha256:");
}

/// CLI11 reads -1 as the largest number that there is.
std::string is_size(const std::string& text) {
  return text.find('-') == std::string::npos ? "" : "takes bytes, or a size such as 512MiB, not '" + text + "'";
}

bool changes_mesh(const MeshOptions& options, const Changes& changes) {
  return !changes.grades.empty() || options.meaning.any() || changes.sizing.changes() ||
         !options.regions_from.empty() || !changes.averaged.empty() || !options.leave_out.empty();
}

/// A mesh with sharp edges can't be taken as meshed, which a part may come to.
void refuse_sharp_meshes(const MeshOptions& options, const ControlMesh& mesh) {
  const bool may_be_meshed = options.meaning.as_meshed || options.meaning.part || mesh.as_meshed;
  if (may_be_meshed && mesh.interpolating) refuse_second_fit(options);
  if (mesh.as_meshed && (options.meaning.sharp.any() || !options.meaning.fit.empty())) {
    throw UsageError(options.mesh + " is taken as meshed: leave out --sharp-... and --fit");
  }
  if (!may_be_meshed || (mesh.sharp_edges.empty() && mesh.sharp_vertices.empty())) return;
  throw UsageError(options.mesh +
                   " has sharp edges or vertices of its own: give --as-meshed and --part with the mesh "
                   "that has none");
}

/// Makes of a file's points what the options say. Says whether points were joined.
bool merge_and_mark(const MeshOptions& options, const Changes& changes, bool is_contract, MeshFile& file) {
  check_channel_names(file.mesh);
  file.mesh.allow_folds = file.mesh.allow_folds || options.allow_folds;
  // Precision and digits are the file's.
  const SamePlace same{changes.sizing.mm_per_unit * same_place_mm(file.mesh),
                       changes.sizing.mm_per_unit * last_digit_mm(file.mesh)};
  apply_units(changes.sizing, file.mesh);
  refuse_sharp_meshes(options, file.mesh);
  // A .ccmesh says itself how it is taken, and a part may turn out to be taken as meshed.
  if (!file.mesh.as_meshed) take_as(options.meaning.as_meshed || options.meaning.part, file.mesh, file.warnings);
  if (file.mesh.mid_nodes.empty()) file.numbers.mid_nodes.clear();
  if (is_contract) {  // Readers check what they read, and places may still be brought near.
    MeshLimits limits;
    limits.max_abs_coordinate_mm = std::numeric_limits<double>::infinity();
    check_arrays(file.mesh, limits, {});
  }
  for (const std::string& channel : options.leave_out) leave_out_channel(channel, file.mesh);
  if (!options.regions_from.empty()) make_cell_regions(options.regions_from, file);
  take_lists(options, changes, file);
  return merge_points(options.merge, is_contract, same, file);
}

/// Checks the mesh, splits it where it touches itself, and changes it as the options say. Says whether it was split.
bool check_and_change(const MeshOptions& options, const Changes& changes, bool quiet, LoadedMesh& loaded) {
  const NearOrigin near = bring_near(changes.sizing, loaded.mesh);
  ControlMesh checked = loaded.mesh;
  bool was_split = false;
  ConnectedMesh connected =
      validate_split(options.merge, checked, loaded.mesh, loaded.numbers, loaded.warnings, was_split);
  if (changes_mesh(options, changes)) {
    change(options, changes, quiet, near, checked, loaded);
    checked = loaded.mesh;
    connected = validate_and_connect(checked, {}, {});
  }
  if (has_several_regions(checked)) (void)split_cell_regions(checked, connected.complex);  // It may refuse them.
  loaded.report = std::move(connected.report);
  return was_split;
}

/// Cells that lie in each other, or on one side of a face, are a fault of the mesh only once their points are joined.
template <typename Action>
bool after_merging(bool joined, const Action& action) {
  try {
    return action();
  } catch (const Error& error) {
    const bool by_topology =
        error.code() == ErrorCode::kMeshNonManifoldFace || error.code() == ErrorCode::kMeshSharedFaces ||
        error.code() == ErrorCode::kMeshInvertedCell || error.code() == ErrorCode::kMeshValenceTooHigh;
    if (!joined || !by_topology) throw;
    throw Error(error.code(), error.what() + std::string(" (points in one place were joined: --no-merge)"),
                error.field(), error.ids());
  }
}

LoadedMesh load(const MeshOptions& options, const Changes& changes, bool quiet) {
  refuse_broken_id(options.mesh);
  std::string bytes = read_file_bytes(options.mesh, options.max_file_bytes);
  const bool contract = mesh_file_kind(bytes) == MeshFileKind::kUnknown;
  MeshFile file = read_any(bytes, {options.mesh, options.allow_includes, options.max_file_bytes});
  const bool allows_folds = file.mesh.allow_folds;
  const bool leaves_nodes_out = !file.mesh.as_meshed && !file.mesh.mid_nodes.empty();
  const bool joined =
      in_file_numbers(file.numbers, file.mesh, [&] { return merge_and_mark(options, changes, contract, file); });
  if (!contract) resolve_collapsed_cells(file);  // Its errors are in the file's numbers.
  in_file_numbers(file.numbers, file.mesh, [&] { take_cell_numbers(options.regions_from, changes.averaged, file); });
  LoadedMesh loaded;
  loaded.mesh = std::move(file.mesh);
  loaded.numbers = std::move(file.numbers);
  loaded.warnings = std::move(file.warnings);
  const bool was_split = in_file_numbers(loaded.numbers, loaded.mesh, [&] {
    return after_merging(joined, [&] { return check_and_change(options, changes, quiet, loaded); });
  });
  loaded.parts = count_parts(loaded.mesh);
  warn_of_size(options.size, options.scale, loaded.mesh, loaded.warnings);
  // A .ccmesh that is taken as it is keeps its bytes, and so its id.
  const bool as_it_is = contract && !is_json(bytes) && !changes_mesh(options, changes) && !joined && !was_split &&
                        !leaves_nodes_out && loaded.mesh.allow_folds == allows_folds;
  loaded.bytes = std::make_shared<const client::MeshBytes>(
      as_it_is ? client::MeshBytes::from_serialized(std::move(bytes)) : client::MeshBytes(to_proto(loaded.mesh)));
  return loaded;
}

}  // namespace

void add_mesh_options(CLI::App& command, MeshOptions& options, bool required, bool files_only) {
  const std::string files =
      "A Gmsh .msh, Abaqus .inp, Exodus .e, MEDIT .mesh, VTK .vtk, .vtu or .pvtu, OpenVolumeMesh .ovm, .ccmesh or its "
      ".json "
      "file";
  command.add_option("MESH", options.mesh, files + (files_only ? "" : ", or the id of an uploaded mesh (sha256:...)"))
      ->required(required);
  const OptionGroup group(command, "Mesh");
  command
      .add_option(
          "--grade", options.grades,
          "Add a material channel: NAME=x|y|z[:A..B] along an axis, NAME=radial[:x|y|z][:A..B][:@X,Y,Z] away from "
          "an axis or a point, NAME=distance[:A..B][:DEPTH] from the boundary inwards, NAME=file:PATH one value for "
          "each vertex that cells use, as the file lists them. Lengths are mm of the printed size. May be repeated")
      ->allow_extra_args(false);
  command.add_option(
      "--regions-from", options.regions_from,
      "Make cell regions, with sharp interfaces between them, of a number that the file has for each cell: "
      "the name of an array of cell data in .vtk and .vtu, of a property of cells in .ovm, 'reference' in MEDIT "
      ".mesh, 'entity' in Gmsh .msh, 'block' in Exodus; or of sets of cells, NAME,NAME,... or 'sets' for all: "
      "element sets in Abaqus .inp, physical groups in Gmsh .msh, element blocks in Exodus; or of 'materials', "
      "which sections give to element sets in .inp");
  command
      .add_option(
          "--cell-data", options.cell_data,
          "Make a material channel of a number that the file has for each cell (NAME.0, NAME.1, ... are the components "
          "of vectors): NAME=average gives each vertex the mean of its cells, weighted by their volumes; "
          "NAME=by-region the mean of its cells in each region of --regions-from, so that the channel jumps across "
          "interfaces. May be repeated")
      ->allow_extra_args(false);
  command
      .add_option(
          "--leave-out", options.leave_out,
          "Leave out a material channel of the file, or all components NAME.0, NAME.1, ... of an array, such as "
          "numbers of a partition, which differ at common points. May be repeated")
      ->allow_extra_args(false);
  add_size_options(command, options.size);
  add_merge_options(command, options.merge);
  add_meaning_options(command, options.meaning);
  command.add_flag("--allow-folds", options.allow_folds,
                   "Accept inverted cells with a warning instead of refusing them");
  command.add_option(
      "--allow-includes", options.allow_includes,
      "A folder that a file may name others in, besides its own folder and those below it: Abaqus includes, and "
      "the pieces of a .pvtu");
  command
      .add_option("--max-file-bytes", options.max_file_bytes,
                  "Refuse files that are larger, with those that they include: bytes, or a size such as 512MiB")
      ->transform(CLI::AsSizeValue(false))
      ->transform(CLI::Validator(is_size, ""))
      ->default_str("8GiB");
}

LoadedMesh load_mesh(const MeshOptions& options, bool quiet) {
  const Changes changes = parse_changes(options);
  try {
    return load(options, changes, quiet);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kFileUnreadable) throw;
    throw Error(error.code(), options.mesh + ": " + error.what() + remedy_of(error, options), error.field(),
                error.ids());
  }
}

void print_notes(const Session& session, const LoadedMesh& mesh) {
  if (session.quiet()) return;
  for (const std::string& warning : mesh.warnings) print_note("note: " + warning);
}

bool change_mesh(const MeshOptions& options) {
  return !options.grades.empty() || options.meaning.any() || options.size.any() || options.allow_folds ||
         !options.regions_from.empty() || !options.cell_data.empty() || !options.leave_out.empty() ||
         options.merge.any();
}

bool names_mesh_id(const MeshOptions& options) {
  if (!client::is_mesh_id(options.mesh)) return false;
  if (change_mesh(options)) {
    throw UsageError(
        "--units, --size, --center, --on-bed, --grade, --merge-points, --no-merge, --no-split, --as-meshed, --part, "
        "--sharp-..., --fit, --smooth, --regions-from, --cell-data, --leave-out and --allow-folds change a mesh "
        "file; " +
        options.mesh + " is on the server already");
  }
  return true;
}

client::UploadOutcome upload(Session& session, const LoadedMesh& mesh) {
  session.set_file(mesh.numbers, mesh.warnings);
  print_notes(session, mesh);
  client::Client& client = session.client();
  PreparationDisplay preparing(session.quiet());
  std::optional<Progress> sending;  // Again, if another server gets the mesh.
  const auto report = [&](std::uint64_t sent, std::uint64_t total) {
    if (!sending) {
      preparing.restart();
      sending.emplace("uploading", "bytes", total, session.quiet());
    }
    sending->update(sent);
    if (sent < total) return;
    sending.reset();
    constexpr std::size_t kManyCells = 2000;
    if (mesh.mesh.cell_count() >= kManyCells && !session.quiet()) {
      print_note("the server prepares " + show_count(mesh.mesh.cell_count()) + " cells");
    }
  };
  client::UploadOutcome outcome = client.ensure_uploaded(
      mesh.bytes, report, session.call(), [&](const v1::GetPreparationResponse& answer) { preparing.update(answer); });
  preparing.finish();
  return outcome;
}

std::string ensure_on_server(Session& session, MeshOptions options, const PlacementOptions& placement) {
  if (names_mesh_id(options)) return options.mesh;
  options.scale = parse_scale(placement);
  const LoadedMesh mesh = load_mesh(options, session.quiet());
  upload(session, mesh);
  return mesh.bytes->id();
}

}  // namespace ccslice::cli
