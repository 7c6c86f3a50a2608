#include "cli/deviation_document.h"

#include "cli/document.h"
#include "cli/drawing_document.h"
#include "cli/region_document.h"
#include "services/runtime/geometry_proto.h"

namespace sixpoint::cli {
namespace {

constexpr std::size_t kMostDeviationItems = 64;

void ReadProfile(const Field& profile, inspection::v1::ProfileTolerance* out) {
  profile.OnlyKeys({"characteristic", "region", "zone", "lower_mm", "upper_mm", "least_coverage", "decision_rule"});
  out->set_characteristic(profile.At("characteristic").Text());
  if (const auto region = profile.Find("region")) out->set_region(region->Text());
  out->set_zone(profile.At("zone").Choice({"form", "form-and-location"}) == "form"
                    ? inspection::v1::PROFILE_ZONE_FORM
                    : inspection::v1::PROFILE_ZONE_FORM_AND_LOCATION);
  out->set_lower_mm(profile.At("lower_mm").Number());
  out->set_upper_mm(profile.At("upper_mm").Number());
  if (const auto coverage = profile.Find("least_coverage")) out->set_least_coverage(coverage->Number(0, 1));
  if (const auto rule = profile.Find("decision_rule")) ReadDecisionRule(*rule, out->mutable_decision_rule());
}

}  // namespace

absl::Status ReadDeviationDocument(const std::string& path, inspection::v1::MapDeviationRequest* request) {
  const auto document = LoadDocument(path);
  if (!document.ok()) return document.status();
  Problems problems(true);
  const Field root(&*document, path, &problems);
  root.OnlyKeys({"regions", "profiles"});
  if (const auto regions = root.Find("regions"))
    for (const Field& region : regions->Items(1, kMostDeviationItems)) ReadRegion(region, request->add_regions());
  if (const auto profiles = root.Find("profiles"))
    for (const Field& profile : profiles->Items(1, kMostDeviationItems)) ReadProfile(profile, request->add_profiles());
  if (!root.Find("regions") && !root.Find("profiles")) root.Refuse("`regions`, `profiles` or both");
  return problems.ToStatus();
}

}  // namespace sixpoint::cli
