// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/output/grabcad.h"

#include <algorithm>
#include <vector>

#include "client/cli/base/text_values.h"
#include "client/cli/options/resins.h"
#include "core/base/echo.h"

namespace ccslice::cli {
namespace {

void refuse(const std::string& option, const std::string& instead) {
  throw UsageError("--format grabcad writes one picture of materials for each layer; leave out " + option + instead);
}

}  // namespace

void fit_to_grabcad(LayoutOptions& layout, PlaneOptions& planes) {
  if (planes.occupancy) refuse("--occupancy", "");
  if (!planes.channels.empty()) refuse("--channel", ", or slice them into another folder");
  if (planes.all_channels) refuse("--all-channels", ", or slice them into another folder");
  if (planes.cell_regions) refuse("--cell-regions", "; --map region:... prints them");
  if (planes.masks) refuse("--masks", "");
  if (planes.encoding == "auto") planes.encoding = "png-rgba";
  if (planes.encoding != "png-rgba") refuse("--encoding " + planes.encoding, ": it takes RGBA pictures only");
  if (layout.row_order.empty()) layout.row_order = "descending";
}

void require_grabcad_materials(const v1::Printing* printing) {
  if (printing == nullptr) {
    throw UsageError(
        "--format grabcad prints materials: name them with --material NAME=#RRGGBB, or with --material NAME "
        "for one of " +
        resin_names());
  }
  const auto printed =
      static_cast<std::size_t>(std::ranges::count(printing->materials(), false, &v1::PrintMaterial::leaves_empty));
  if (printed > kMostGrabcadMaterials) {
    throw UsageError("GrabCAD takes at most " + std::to_string(kMostGrabcadMaterials) +
                     " materials, and --material "
                     "names " +
                     std::to_string(printed));
  }
  const std::uint32_t background = printing->has_background_rgba() ? printing->background_rgba() : 0xff;
  for (const v1::PrintMaterial& material : printing->materials()) {
    if (material.leaves_empty()) {
      if (material.rgba() == background || material.rgba() == kGrabcadVoid) continue;
      throw UsageError("GrabCAD takes void in the background's colour or as #00000000; write --material void");
    }
    if ((material.rgba() & 0xff) == 0xff) continue;
    throw UsageError("GrabCAD takes opaque colours only; write --material " + echoed(material.name()) +
                     "=#RRGGBB, without a fourth byte, or with ff there");
  }
  if (printing->has_background_rgba() && (printing->background_rgba() & 0xff) != 0xff) {
    throw UsageError("GrabCAD takes opaque colours only; write --background #RRGGBB, or leave it out for black");
  }
}

void require_grabcad_job(const v1::SliceJob& job) {
  const bool pictures = job.planes_size() == 1 && job.planes(0).has_materials() &&
                        job.planes(0).encoding() == v1::PLANE_ENCODING_PNG_RGBA && !job.has_contours();
  if (!pictures || job.layout().row_order() != v1::ROW_ORDER_DESCENDING_Y) {
    throw UsageError(
        "--format grabcad: the job isn't one for GrabCAD: one plane of materials as PLANE_ENCODING_PNG_RGBA, no "
        "contours, "
        "ROW_ORDER_DESCENDING_Y; --format grabcad with --write-job writes such a job");
  }
  require_grabcad_materials(job.has_printing() ? &job.printing() : nullptr);
}

std::string unknown_resins(const v1::Printing& printing) {
  std::vector<std::string> names;
  for (const v1::PrintMaterial& material : printing.materials()) {
    if (!resin_colour(material.name()) && !material.leaves_empty())
      names.push_back("'" + echoed(material.name()) + "'");
  }
  if (names.empty()) return {};
  return "no resins of GrabCAD's are known by the names " + echoed_list(names, names.size()) +
         "; it will ask which ones to print (known: " + resin_names() + ")";
}

LayerNames grabcad_names(std::uint32_t first_layer) { return {.plain = true, .number_0 = first_layer}; }

}  // namespace ccslice::cli
