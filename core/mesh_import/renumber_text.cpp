// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/renumber_text.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/contains.h"
#include "core/base/count_text.h"
#include "core/base/error.h"
#include "core/base/place_text.h"
#include "core/mesh/offenders.h"

namespace ccslice {
namespace {

enum class Named : std::uint8_t { kVertex, kEdge, kMidNode, kCell };

struct NounInText {
  std::string_view text;
  Named named;
  bool many;
};
constexpr NounInText kNouns[] = {
    {"vertices", Named::kVertex, true},   {"vertex", Named::kVertex, false},    {"cells", Named::kCell, true},
    {"cell", Named::kCell, false},        {"edges", Named::kEdge, true},        {"edge", Named::kEdge, false},
    {"mid-nodes", Named::kMidNode, true}, {"mid-node", Named::kMidNode, false},
};

/// The ids of one thing: two of an edge.
using Thing = std::vector<std::int64_t>;

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

class Renumberer {
 public:
  Renumberer(std::string_view text, const FileNumbers& numbers, const IdsInText& ids, const ControlMesh* mesh)
      : text_(text), numbers_(numbers), ids_(ids), mesh_(mesh), placed_(text.find(") mm") != text.npos) {}

  std::string run() {
    while (at_ < text_.size()) {
      if (!take_quoted() && !take_list()) out_ += text_[at_++];
    }
    return std::move(out_);
  }
  /// Whether anything was found, once it has run.
  bool found() const { return found_; }

 private:
  bool take_quoted();
  bool take_list();
  const NounInText* noun_here() const;
  std::optional<std::int64_t> take_id(std::size_t& at, Named named) const;
  std::optional<Thing> take_thing(std::size_t& at, Named named) const;
  bool is_known(std::int64_t id, Named named) const;
  std::string name_of(const Thing& thing, Named named) const;
  std::optional<Vec3> place_of(const Thing& thing, Named named) const;
  void add_noun(const NounInText& noun, bool many);
  std::string_view more_at(std::size_t at) const;
  void add_place(const Thing& first, const NounInText& noun, bool several);

  std::string_view text_;
  const FileNumbers& numbers_;
  const IdsInText& ids_;
  const ControlMesh* mesh_;
  bool placed_;
  std::size_t at_ = 0;
  bool found_ = false;
  std::string out_;
};

/// What stands in quotation marks is somebody's own, such as a channel called 'cell 3'. Apostrophes follow letters.
bool Renumberer::take_quoted() {
  if (text_[at_] != '\'' || (at_ > 0 && is_word(text_[at_ - 1]))) return false;
  std::size_t end = at_ + 1;
  const auto closes = [&](std::size_t at) {
    return text_[at] == '\'' && (at + 1 == text_.size() || !is_word(text_[at + 1]));
  };
  while (end < text_.size() && !closes(end)) ++end;
  if (end == text_.size()) return false;
  out_ += text_.substr(at_, end + 1 - at_);
  at_ = end + 1;
  return true;
}

const NounInText* Renumberer::noun_here() const {
  if (at_ > 0 && is_word(text_[at_ - 1])) return nullptr;
  const std::string_view rest = text_.substr(at_);
  for (const NounInText& noun : kNouns) {
    const std::size_t end = noun.text.size();
    if (rest.starts_with(noun.text) && rest.size() > end + 1 && rest[end] == ' ' && is_digit(rest[end + 1])) {
      return &noun;
    }
  }
  return nullptr;
}

bool Renumberer::is_known(std::int64_t id, Named named) const {
  if (named == Named::kMidNode) {
    return static_cast<std::uint64_t>(id) < numbers_.mid_nodes.size() &&
           (mesh_ == nullptr || static_cast<std::uint64_t>(id) < mesh_->mid_nodes.positions.size());
  }
  const auto& listed = named == Named::kCell ? ids_.cells : ids_.vertices;
  if (listed && std::ranges::find(*listed, id) == listed->end()) return false;
  const auto& numbers = named == Named::kCell ? numbers_.cells : numbers_.vertices;
  if (!numbers.empty() && static_cast<std::uint64_t>(id) >= numbers.size()) return false;
  if (mesh_ == nullptr) return true;
  return static_cast<std::uint64_t>(id) < (named == Named::kCell ? mesh_->cell_count() : mesh_->vertex_count());
}

std::optional<std::int64_t> Renumberer::take_id(std::size_t& at, Named named) const {
  std::int64_t id = 0;
  const auto [end, error] = std::from_chars(text_.data() + at, text_.data() + text_.size(), id);
  if (error != std::errc() || id < 0 || !is_known(id, named)) return std::nullopt;
  at = static_cast<std::size_t>(end - text_.data());
  return id;
}

/// Moves `at` past it. Numbers such as 0.5 and 12% are none, nor is the 5 of "and 5 more".
std::optional<Thing> Renumberer::take_thing(std::size_t& at, Named named) const {
  std::size_t next = at;
  if (next >= text_.size() || !is_digit(text_[next])) return std::nullopt;
  Thing thing;
  for (bool more = true; more;) {
    const std::optional<std::int64_t> id = take_id(next, named);
    if (!id) return std::nullopt;
    thing.push_back(*id);
    more = named == Named::kEdge && thing.size() == 1;
    if (!more) break;
    if (next + 1 >= text_.size() || text_[next] != '-' || !is_digit(text_[next + 1])) return std::nullopt;
    ++next;
  }
  const std::string_view rest = text_.substr(next);
  const bool goes_on = !rest.empty() && (is_word(rest[0]) || rest[0] == '%' || rest[0] == '-');
  const bool fraction = rest.size() > 1 && rest[0] == '.' && is_digit(rest[1]);
  if (goes_on || fraction || rest.starts_with(" more")) return std::nullopt;
  at = next;
  return thing;
}

std::string Renumberer::name_of(const Thing& thing, Named named) const {
  if (named == Named::kCell) return std::to_string(file_cell(numbers_, static_cast<std::size_t>(thing[0])));
  if (named == Named::kMidNode) return std::to_string(numbers_.mid_nodes[static_cast<std::size_t>(thing[0])]);
  std::string name = std::to_string(file_vertex(numbers_, static_cast<std::size_t>(thing[0])));
  if (thing.size() > 1) name += "-" + std::to_string(file_vertex(numbers_, static_cast<std::size_t>(thing[1])));
  return name;
}

std::optional<Vec3> Renumberer::place_of(const Thing& thing, Named named) const {
  if (mesh_ == nullptr) return std::nullopt;
  const auto finite = [](const Vec3& place) { return place.allFinite() ? std::optional(place) : std::nullopt; };
  if (named == Named::kMidNode) return finite(mesh_->mid_nodes.positions[static_cast<std::size_t>(thing[0])]);
  std::vector<std::uint32_t> vertices(thing.begin(), thing.end());
  if (named == Named::kCell) {
    std::size_t begin = 0;
    for (std::int64_t cell = 0; cell < thing[0]; ++cell) {
      begin += static_cast<std::size_t>(corner_count(mesh_->cell_kinds[static_cast<std::size_t>(cell)]));
    }
    const auto kind = mesh_->cell_kinds[static_cast<std::size_t>(thing[0])];
    const auto count = static_cast<std::size_t>(corner_count(kind));
    if (begin + count > mesh_->cell_vertices.size()) return std::nullopt;
    const auto corners = std::span(mesh_->cell_vertices).subspan(begin, count);
    vertices.assign(corners.begin(), corners.end());
  }
  Vec3 middle = Vec3::Zero();
  for (const std::uint32_t v : vertices) {
    if (v >= mesh_->vertex_count()) return std::nullopt;
    middle += mesh_->positions[v] / static_cast<double>(vertices.size());
  }
  return finite(middle);
}

/// "control cell" becomes "element".
void Renumberer::add_noun(const NounInText& noun, bool many) {
  if (noun.named == Named::kEdge) {
    out_ += many ? "edges" : "edge";
    return;
  }
  constexpr std::string_view kControl = "control ";
  if (noun.named == Named::kCell && !numbers_.cells.empty() && out_.ends_with(kControl)) {
    out_.resize(out_.size() - kControl.size());
  }
  const std::string& name = noun.named == Named::kCell ? numbers_.cell_noun : numbers_.vertex_noun;
  out_ += many ? plural_of(name) : name;
}

void Renumberer::add_place(const Thing& first, const NounInText& noun, bool several) {
  const std::optional<Vec3> place = placed_ ? std::nullopt : place_of(first, noun.named);
  if (!place) return;
  placed_ = true;
  out_ += (several ? ", the first at " : " at ") + place_in_mm(*place);
  if (several && at_ < text_.size() && text_[at_] == ' ') out_ += ',';
}

/// "and 5 more", behind a list.
std::string_view Renumberer::more_at(std::size_t at) const {
  constexpr std::string_view kAnd = " and ", kMore = " more";
  if (!text_.substr(at).starts_with(kAnd)) return {};
  std::size_t next = at + kAnd.size();
  while (next < text_.size() && is_digit(text_[next])) ++next;
  if (next == at + kAnd.size() || !text_.substr(next).starts_with(kMore)) return {};
  return text_.substr(at, next + kMore.size() - at);
}

bool Renumberer::take_list() {
  const NounInText* noun = noun_here();
  if (noun == nullptr) return false;
  std::size_t at = at_ + noun->text.size() + 1;
  const std::optional<Thing> first = take_thing(at, noun->named);
  if (!first) return false;
  found_ = true;
  std::vector<std::string> names = {name_of(*first, noun->named)};
  std::string list = names.front();
  bool repeats = false;
  for (bool more = noun->many; more;) {
    more = false;
    for (const std::string_view separator : {", ", " and "}) {
      std::size_t next = at + separator.size();
      if (!text_.substr(at).starts_with(separator)) continue;
      const std::optional<Thing> thing = take_thing(next, noun->named);
      if (!thing) continue;
      at = next;
      more = true;
      std::string name = name_of(*thing, noun->named);
      repeats = repeats || contains(names, name);
      if (contains(names, name)) continue;
      list.append(separator).append(name);
      names.push_back(std::move(name));
    }
  }
  const std::string_view more = more_at(at);
  const bool several = names.size() > 1 || !more.empty();
  add_noun(*noun, noun->many && (several || !repeats));
  out_.append(" ").append(list).append(more);
  at_ = at + more.size();
  add_place(*first, *noun, several);
  return true;
}

}  // namespace

std::string renumber_text(std::string_view text, const FileNumbers& numbers, const IdsInText& ids,
                          const ControlMesh* mesh) {
  return Renumberer(text, numbers, ids, mesh).run();
}

bool names_any(std::string_view text, const IdsInText& ids) {
  const FileNumbers none;
  Renumberer renumberer(text, none, ids, nullptr);
  renumberer.run();
  return renumberer.found();
}

std::uint64_t file_vertex(const FileNumbers& numbers, std::size_t vertex) {
  return vertex < numbers.vertices.size() ? numbers.vertices[vertex] : vertex;
}

std::uint64_t file_cell(const FileNumbers& numbers, std::size_t cell) {
  return cell < numbers.cells.size() ? numbers.cells[cell] : cell;
}

std::string place_in_mm(const Vec3& place) {
  constexpr int kDigits = 6;
  constexpr double kRounding = 1e-9;
  const double rounding = kRounding * place.cwiseAbs().maxCoeff();
  return place_text(place.unaryExpr([=](double x) { return std::abs(x) <= rounding ? 0 : x; }), kDigits);
}

void check_cell_vertices(const MeshFile& file) {
  const ControlMesh& mesh = file.mesh;
  std::vector<std::int64_t> cells;
  std::size_t corner = 0, total = 0;
  for (std::size_t cell = 0; cell < mesh.cell_count(); ++cell) {
    const auto corners = static_cast<std::size_t>(corner_count(mesh.cell_kinds[cell]));
    const auto begin = mesh.cell_vertices.begin() + static_cast<std::ptrdiff_t>(corner);
    const bool bad = std::any_of(begin, begin + static_cast<std::ptrdiff_t>(corners),
                                 [&](std::uint32_t vertex) { return vertex >= mesh.vertex_count(); });
    if (bad && total++ < kMaxEchoItems) cells.push_back(static_cast<std::int64_t>(cell));
    corner += corners;
  }
  if (total == 0) return;
  throw Error(ErrorCode::kMeshIndexOutOfRange,
              "the file has " + std::to_string(mesh.vertex_count()) + " vertices, and others are named in " +
                  renumber_text(named_ids(kCells, cells, total), file.numbers),
              "cells", cells);
}

}  // namespace ccslice
