#include "cli/section_document.h"

#include "cli/document.h"
#include "services/runtime/geometry_proto.h"

namespace sixpoint::cli {
namespace {

constexpr std::size_t kMostSections = 32;

void ReadPlane(const Field& plane, inspection::v1::SectionPlane* out) {
  plane.OnlyKeys(
      {"section", "origin_in_part_mm", "normal_in_part", "reference_in_part", "leading_in_part_mm", "near_in_part_mm"});
  out->set_section(plane.At("section").Text());
  runtime::ToProto(plane.At("origin_in_part_mm").Vector3(), out->mutable_origin_in_part_mm());
  if (const auto normal = plane.Find("normal_in_part"))
    runtime::ToProto(normal->DirectionOfAnyLength(), out->mutable_normal_in_part());
  if (const auto reference = plane.Find("reference_in_part"))
    runtime::ToProto(reference->DirectionOfAnyLength(), out->mutable_reference_in_part());
  if (const auto point = plane.Find("leading_in_part_mm"))
    runtime::ToProto(point->Vector3(), out->mutable_leading_in_part_mm());
  if (const auto point = plane.Find("near_in_part_mm"))
    runtime::ToProto(point->Vector3(), out->mutable_near_in_part_mm());
}

}  // namespace

absl::Status ReadSectionDocument(const std::string& path, inspection::v1::MeasureSectionsRequest* request) {
  const auto document = LoadDocument(path);
  if (!document.ok()) return document.status();
  Problems problems(true);
  const Field root(&*document, path, &problems);
  root.OnlyKeys({"sections", "neighbour"});
  for (const Field& plane : root.At("sections").Items(1, kMostSections)) ReadPlane(plane, request->add_sections());
  if (const auto neighbour = root.Find("neighbour")) {
    neighbour->OnlyKeys({"offset_in_part_mm", "standard_uncertainty_um"});
    runtime::ToProto(neighbour->At("offset_in_part_mm").Vector3(),
                     request->mutable_neighbour()->mutable_offset_in_part_mm());
    request->mutable_neighbour()->set_standard_uncertainty_um(neighbour->At("standard_uncertainty_um").Number());
  }
  return problems.ToStatus();
}

}  // namespace sixpoint::cli
