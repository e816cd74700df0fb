// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_files/read_vtu.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/mesh/validate.h"
#include "core/mesh_files/vtk_cells.h"
#include "core/mesh_files/vtu_cells.h"
#include "core/mesh_files/vtu_document.h"
#include "core/mesh_import/cell_numbers.h"
#include "core/mesh_import/channels.h"
#include "core/mesh_import/find_file.h"
#include "core/mesh_import/used_vertices.h"

namespace ccslice {
namespace {

class VtuReader {
 public:
  VtuReader(std::string_view bytes, const MeshLimits& limits, const FileOrigin& origin)
      : bytes_(bytes), limits_(limits), origin_(origin) {}

  MeshFile read();

 private:
  void read_partition(const VtuDocument& partition);
  std::filesystem::path path_of(const VtuDocument& partition, pugi::xml_node piece, const NamedFiles& files) const;
  void read_pieces(const VtuDocument& document);
  void read_piece(pugi::xml_node piece);
  void read_points(pugi::xml_node piece, std::uint64_t count);
  void read_cells(pugi::xml_node piece, std::uint64_t count);
  void read_point_data(pugi::xml_node piece);
  void read_weights(pugi::xml_node data);
  void read_channels(pugi::xml_node array, const std::string& name);
  void read_cell_data(pugi::xml_node piece, std::uint64_t count);
  bool read_cell_numbers(pugi::xml_node array, std::uint64_t count);
  std::optional<std::size_t> place_of_numbers(const std::string& name, std::size_t components);
  void drop_partial_channels();
  void drop_partial_numbers();
  void read_number_names();
  std::optional<std::int64_t> read_named_number(pugi::xml_node array);
  void warn();

  const std::string_view bytes_;
  const VtuDocument* document_ = nullptr;  // The one that is being read.
  const MeshLimits& limits_;
  const FileOrigin& origin_;
  MeshFile file_;
  UnfitNumbers unfit_;
  std::uint64_t pieces_ = 0, cells_ = 0, ghosts_ = 0;
  bool is_partition_ = false;
  std::vector<float> weights_;              // Of rational Bezier cells, by point, or none.
  std::uint32_t first_point_ = 0;           // Of the piece.
  std::vector<std::uint32_t> piece_cells_;  // Which of the piece's cells are the mesh's last ones.
  std::vector<NamedChannel> channels_;
  std::vector<std::string> left_out_;  // A sentence each, once.
  VtkCellAppender appender_{file_};
};

MeshFile VtuReader::read() {
  const VtuDocument document(bytes_);
  is_partition_ = document.is_partition();
  if (is_partition_) {
    read_partition(document);
  } else {
    read_pieces(document);
  }
  document_ = &document;
  if (pieces_ == 0) throw Error(ErrorCode::kMeshEmpty, "the file has no Piece with points; " + kNeedsVolumeCells);
  if (file_.mesh.cell_kinds.empty()) {
    throw Error(ErrorCode::kMeshEmpty, "the file has no hexahedra, tetrahedra or wedges; " + kNeedsVolumeCells);
  }
  read_number_names();
  append_file_channels(std::move(channels_), limits_, file_);
  if (!weights_.empty()) weights_.resize(file_.mesh.vertex_count(), 1);
  appender_.finish_bezier_cells(weights_);
  appender_.warn();
  leave_out_unused_vertices({}, document.place(), file_);
  warn();
  return std::move(file_);
}

/// Says which piece a failure is of.
void VtuReader::read_partition(const VtuDocument& partition) {
  const NamedFiles files(origin_);
  std::uint64_t room = origin_.max_bytes - std::min<std::uint64_t>(origin_.max_bytes, bytes_.size());
  for (const pugi::xml_node piece : partition.grid().children("Piece")) {
    const std::filesystem::path path = path_of(partition, piece, files);
    try {
      const std::string bytes = read_file_bytes(path.string(), room);
      room -= bytes.size();
      const VtuDocument document(bytes);
      if (document.is_partition()) {
        throw Error(ErrorCode::kFileUnsupported, "it names other files, and should be a .vtu; write the file anew");
      }
      read_pieces(document);
    } catch (const Error& error) {
      throw Error(error.code(), "piece " + in_quotes(printable(path.filename().string())) + ": " + error.what(),
                  error.field(), error.ids());
    }
  }
}

std::filesystem::path VtuReader::path_of(const VtuDocument& partition, pugi::xml_node piece,
                                         const NamedFiles& files) const {
  const std::string name = piece.attribute("Source").value(), shown = in_quotes(printable(name));
  if (name.empty()) partition.fail(piece, ErrorCode::kFileSyntax, "the Piece has no Source; write the file anew");
  if (origin_.path.empty()) {
    partition.fail(piece, ErrorCode::kFileUnsupported,
                   "the file names its pieces, such as " + shown +
                       ", which can't be told from its bytes alone: merge them into one .vtu, as ParaView does when it "
                       "saves a data set");
  }
  const NamedFiles::Found found = files.find(std::filesystem::path(origin_.path).parent_path(), name);
  if (found.files.size() == 1) return found.files.front();
  const std::string beside = " the folder of " + printable(origin_.path);
  if (found.is_outside) {
    partition.fail(piece, ErrorCode::kFileUnreadable,
                   "piece " + shown + " is outside of" + beside +
                       ": allow the folder that it is in (--allow-includes), or put all pieces beside this file");
  }
  partition.fail(piece, ErrorCode::kFileUnreadable,
                 (found.files.empty() ? "there is no file " + shown
                                      : std::to_string(found.files.size()) + " files are called " + shown +
                                            " but for the case of letters") +
                     " in" + beside + ", which names it: put all pieces there");
}

void VtuReader::read_pieces(const VtuDocument& document) {
  document_ = &document;
  for (const pugi::xml_node piece : document.grid().children("Piece")) {
    if (document.count(piece, "NumberOfPoints", limits_.max_vertices - file_.mesh.vertex_count()) > 0) {
      read_piece(piece);
    }
  }
  // No cell beyond the file uses its points.
  if (!unfit_.empty()) std::exchange(unfit_, {}).throw_if_used(used_nodes(file_), file_.numbers, document.place());
}

void VtuReader::read_piece(pugi::xml_node piece) {
  const std::uint64_t points =
      document_->count(piece, "NumberOfPoints", limits_.max_vertices - file_.mesh.vertex_count());
  const std::uint64_t cells = document_->count(piece, "NumberOfCells", limits_.max_cells - cells_);
  cells_ += cells;
  read_points(piece, points);
  read_cells(piece, cells);
  read_point_data(piece);
  read_cell_data(piece, cells);
  ++pieces_;
  drop_partial_channels();
  drop_partial_numbers();
}

void VtuReader::read_points(pugi::xml_node piece, std::uint64_t count) {
  const pugi::xml_node array = document_->require(document_->require(piece, "Points"), "DataArray");
  if (document_->count(array, "NumberOfComponents", 3, 1) != 3) {
    document_->fail(array, ErrorCode::kFileSyntax, "points need 3 components (NumberOfComponents)");
  }
  VtuNumbers numbers = document_->open(array, 3 * count);
  std::vector<Vec3>& positions = file_.mesh.positions;
  first_point_ = static_cast<std::uint32_t>(positions.size());
  for (std::uint64_t i = 0; i < count; ++i) {
    positions.push_back(unfit_.position(numbers.values(), positions.size(), numbers.text()));
    file_.numbers.vertices.push_back(positions.size() - 1);
  }
  numbers.require_end();
}

void VtuReader::read_cells(pugi::xml_node piece, std::uint64_t count) {
  piece_cells_.clear();
  if (count == 0) return;
  VtkCells cells = read_vtu_cells(*document_, piece, count, file_.mesh.vertex_count() - first_point_, limits_);
  for (std::uint32_t& point : cells.connectivity) point += first_point_;
  if (cells.faces) {
    for (std::uint32_t& point : cells.faces->points) point += first_point_;
  }
  cells.first_number = cells_ - count;
  ghosts_ += static_cast<std::uint64_t>(std::ranges::count(cells.ghosts, true));
  piece_cells_ = appender_.append(cells, document_->place());
}

void VtuReader::read_point_data(pugi::xml_node piece) {
  const pugi::xml_node data = piece.child("PointData");
  constexpr const char* kNoChannels[] = {"Normals", "Tensors", "TCoords", "GlobalIds", "PedigreeIds", kRationalWeights};
  std::set<std::string> no_channels = {kVtkGhosts};
  for (const char* attribute : kNoChannels) no_channels.insert(data.attribute(attribute).value());
  read_weights(data);
  std::set<std::string> read;
  for (const pugi::xml_node array : data.children()) {
    if (array.type() != pugi::node_element) continue;
    const std::string name = array.attribute("Name").value();
    const bool numbers = VtkScanner::block_value_bytes(array.attribute("type").value()) > 0;
    if (!numbers || no_channels.contains(name)) {
      left_out_.push_back("point data '" + printable(name) + "' left out");
    } else if (read.insert(name).second) {
      read_channels(array, name);
    } else {
      left_out_.push_back("point data '" + printable(name) + "' comes twice in a piece: the first is read");
    }
  }
}

void VtuReader::read_weights(pugi::xml_node data) {
  const pugi::xml_attribute name = data.attribute(kRationalWeights);
  const pugi::xml_node array =
      data.find_child_by_attribute("DataArray", "Name", name ? name.value() : kRationalWeights);
  if (!array) return;
  document_->count(array, "NumberOfComponents", 1, 1);
  VtuNumbers numbers = document_->open(array, file_.mesh.vertex_count() - first_point_);
  weights_.resize(first_point_, 1);
  while (weights_.size() < file_.mesh.vertex_count()) {
    weights_.push_back(static_cast<float>(numbers.values().any_real("a weight")));
  }
  numbers.require_end();
}

void VtuReader::read_channels(pugi::xml_node array, const std::string& name) {
  const std::uint64_t components = document_->count(array, "NumberOfComponents", limits_.max_channels, 1);
  std::vector<NamedChannel*> channels;
  const std::vector<NamedChannel> opened = open_channels(name, components);
  if (pieces_ == 0 && channels_.size() + components > limits_.max_channels) {
    document_->fail(array, ErrorCode::kMeshTooLarge,
                    "point data '" + printable(name) + "' makes more than " + std::to_string(limits_.max_channels) +
                        " channels; save fewer arrays");
  }
  const std::size_t known = channels_.size();
  if (pieces_ == 0) channels_.insert(channels_.end(), opened.begin(), opened.end());
  for (const NamedChannel& channel : opened) {
    const auto begin = channels_.begin() + static_cast<std::ptrdiff_t>(pieces_ == 0 ? known : 0);
    const auto found =
        std::find_if(begin, channels_.end(), [&](const NamedChannel& other) { return other.name == channel.name; });
    if (found == channels_.end() || found->values.size() == file_.mesh.vertex_count()) {
      left_out_.push_back("point data '" + printable(name) + "' left out: not every piece has it once");
      return;
    }
    channels.push_back(&*found);
  }
  VtuNumbers numbers = document_->open(array, components * (file_.mesh.vertex_count() - first_point_));
  for (std::uint32_t vertex = first_point_; vertex < file_.mesh.vertex_count(); ++vertex) {
    for (NamedChannel* channel : channels) {
      channel->values.push_back(unfit_.value(numbers.values().any_real("a value"), vertex, "a value", numbers.text()));
    }
  }
  numbers.require_end();
}

/// A name that comes again isn't read again: a small file that repeats a large array would take hours.
void VtuReader::read_cell_data(pugi::xml_node piece, std::uint64_t count) {
  std::set<std::string> read;
  for (const pugi::xml_node array : piece.child("CellData").children()) {
    const std::string name = array.attribute("Name").value();
    if (array.type() != pugi::node_element || name == kVtkGhosts) continue;
    if (!read.insert(name).second) {
      left_out_.push_back("cell data '" + printable(name) + "' comes twice in a piece: the first is read");
    } else if (!read_cell_numbers(array, count)) {
      left_out_.push_back("cell data '" + printable(name) + "' left out");
    }
  }
}

/// False if the array has no numbers for each cell, or not every piece has it.
bool VtuReader::read_cell_numbers(pugi::xml_node array, std::uint64_t count) {
  const bool numeric = VtkScanner::block_value_bytes(array.attribute("type").value()) > 0;
  const std::size_t components = array.attribute("NumberOfComponents").as_uint(1);
  if (!numeric || components == 0 || components > kMostCellNumbers) return false;
  const std::optional<std::size_t> first = place_of_numbers(array.attribute("Name").value(), components);
  if (!first) return false;
  std::vector<double> values;
  VtuNumbers numbers = document_->open(array, count * components);
  for (std::uint64_t i = 0; i < count * components; ++i) values.push_back(numbers.values().any_real("a value"));
  numbers.require_end();
  for (std::size_t i = 0; i < components; ++i) {
    std::vector<double>& of_cells = file_.cell_numbers[*first + i].of_cells;
    for (const std::uint32_t cell : piece_cells_) of_cells.push_back(values[cell * components + i]);
  }
  return true;
}

/// Where the array's components stand among the cell numbers, all pieces before having had them; new ones in the first.
std::optional<std::size_t> VtuReader::place_of_numbers(const std::string& name, std::size_t components) {
  std::vector<CellNumbers>& all = file_.cell_numbers;
  const auto found = std::ranges::find(all, component_name(name, components, 0), &CellNumbers::name);
  const auto first = static_cast<std::size_t>(found - all.begin());
  if (found == all.end()) {
    if (pieces_ > 0 || components > kMostCellNumbers - all.size()) return std::nullopt;
    for (std::size_t i = 0; i < components; ++i) all.push_back({component_name(name, components, i), {}});
    return first;
  }
  const std::size_t before = file_.mesh.cell_count() - piece_cells_.size();
  for (std::size_t i = 0; i < components; ++i) {
    const bool fits = first + i < all.size() && all[first + i].name == component_name(name, components, i) &&
                      all[first + i].of_cells.size() == before;
    if (!fits) return std::nullopt;
  }
  return first;
}

/// Numbers that this piece hasn't.
void VtuReader::drop_partial_numbers() {
  std::erase_if(file_.cell_numbers, [&](const CellNumbers& numbers) {
    if (numbers.of_cells.size() == file_.mesh.cell_count()) return false;
    left_out_.push_back("cell data '" + printable(numbers.name) + "' left out");
    return true;
  });
}

/// Nothing where no whole number can be read, which is no reason to refuse the mesh.
std::optional<std::int64_t> VtuReader::read_named_number(pugi::xml_node array) {
  try {
    VtuNumbers values = document_->open(array, 1);
    const double number = values.values().any_real("a number with a name");
    values.require_end();
    return exact_integer(number);
  } catch (const Error& error) {
    left_out_.push_back("field data '" + printable(array.attribute("Name").value()) + "' left out: " + error.what());
    return std::nullopt;
  }
}

/// Field data "ARRAY:NAME" of one number say what a number of the cell data ARRAY is called, as ccslice writes it.
/// Names that aren't one for each number are of something else.
void VtuReader::read_number_names() {
  for (CellNumbers& numbers : file_.cell_numbers) {
    std::set<std::string> used;
    bool fits = true;
    for (const pugi::xml_node array : document_->grid().child("FieldData").children("DataArray")) {
      const std::string_view name = array.attribute("Name").value();
      if (!name.starts_with(numbers.name) || name.substr(numbers.name.size(), 1) != ":") continue;
      const bool is_number = VtkScanner::block_value_bytes(array.attribute("type").value()) > 0 &&
                             array.attribute("NumberOfTuples").as_ullong() == 1 &&
                             array.attribute("NumberOfComponents").as_uint(1) == 1;
      if (!is_number) continue;
      const std::optional<std::int64_t> number = read_named_number(array);
      const std::string own(name.substr(numbers.name.size() + 1));
      fits = fits && number && !own.empty() && used.insert(own).second &&
             numbers.number_names.emplace(*number, own).second;
    }
    fits = fits && std::ranges::all_of(numbers.of_cells, [&](double value) {
             const std::optional<std::int64_t> number = exact_integer(value);
             return number && numbers.number_names.contains(*number);
           });
    if (!fits) numbers.number_names.clear();
  }
}

/// Channels that this piece hasn't.
void VtuReader::drop_partial_channels() {
  std::erase_if(channels_, [&](const NamedChannel& channel) {
    if (channel.values.size() == file_.mesh.vertex_count()) return false;
    left_out_.push_back("point data '" + printable(channel.name) + "' left out: not every piece has it once");
    return true;
  });
}

void VtuReader::warn() {
  if (ghosts_ > 0) {
    const std::string lone =
        pieces_ > 1 || is_partition_
            ? ""
            : ", and this is one piece only: give the .pvtu that names all, or merge all into one .vtu";
    file_.warnings.push_back(std::to_string(ghosts_) + " ghost cells left out: other pieces have them" + lone);
  }
  std::set<std::string> said;
  for (const std::string& sentence : left_out_) {
    if (said.insert(sentence).second) file_.warnings.push_back(sentence);
  }
}

}  // namespace

MeshFile read_vtu(std::string_view bytes, const MeshLimits& limits, const FileOrigin& origin) {
  return VtuReader(bytes, limits, origin).read();
}

}  // namespace ccslice
