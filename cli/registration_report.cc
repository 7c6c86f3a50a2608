// One registration as an engineer reads it: where the part is, how well that is known, and what speaks against it.
#include <array>
#include <cmath>

#include "cli/number_format.h"
#include "cli/output.h"
#include "cli/reports.h"
#include "services/runtime/units.h"

namespace sixpoint::cli {
namespace {

using registration::v1::Evidence;
using registration::v1::Registration;

std::string Vector(const geometry::v1::Direction& d) {
  return Fixed(d.x(), 3) + ", " + Fixed(d.y(), 3) + ", " + Fixed(d.z(), 3);
}

// The pose by its matrix, and its standard uncertainty along and about the machine's axes.
std::string PoseText(const Registration& registration) {
  if (!registration.has_zero_from_part() || registration.zero_from_part().rotation_size() != 9) return "";
  const auto& pose = registration.zero_from_part();
  const geometry::v1::Point& t = pose.translation_mm();
  const std::array<double, 3> translation = {t.x_mm(), t.y_mm(), t.z_mm()};
  Table rows({"zero_from_part", ">", ">", ">mm"});
  for (int r = 0; r < 3; ++r)
    rows.AddRow({Fixed(pose.rotation(3 * r), 9), Fixed(pose.rotation(3 * r + 1), 9), Fixed(pose.rotation(3 * r + 2), 9),
                 Fixed(translation[static_cast<std::size_t>(r)], 6)});
  std::string text = rows.ToText();
  if (registration.covariance().values_size() != 36 || registration.noise_covariance().values_size() != 36) return text;
  const auto sigma = [](const geometry::v1::PoseCovariance& covariance, int k) {
    return std::sqrt(std::max(0.0, covariance.values(7 * k)));
  };
  Table sigmas({"standard uncertainty", ">shift um", ">of it noise", ">turn deg", ">of it noise"});
  for (int k = 0; k < 3; ++k)
    sigmas.AddRow({std::string("machine ") + "XYZ"[k], FixedOrTiny(1e3 * sigma(registration.covariance(), 3 + k), 3),
                   FixedOrTiny(1e3 * sigma(registration.noise_covariance(), 3 + k), 3),
                   FixedOrTiny(runtime::kDegPerRad * sigma(registration.covariance(), k), 6),
                   FixedOrTiny(runtime::kDegPerRad * sigma(registration.noise_covariance(), k), 6)});
  return text + sigmas.ToText() + "about " + PointText(registration.covariance().reference_mm(), 3) + " mm\n";
}

std::string AgreementsText(const Evidence& evidence) {
  Table table({"scan", "and", ">patches", ">differ by um", ">expected um", ">ratio"});
  for (const auto& in : evidence.agreements())
    table.AddRow({IdText(in.scan()), IdText(in.other_scan()), Grouped(in.patch_count()),
                  Fixed(in.difference_rms_um(), 3), Fixed(in.expected_rms_um(), 3),
                  in.expected_rms_um() > 0 ? Fixed(in.difference_rms_um() / in.expected_rms_um(), 2) : "-"});
  return table.empty() ? "" : table.ToText();
}

std::string RegionsText(const Evidence& evidence) {
  Table table({"region about, part mm", ">points", ">mean um", ">used %"});
  for (const auto& in : evidence.regions())
    table.AddRow({PointText(in.centre_mm(), 1), Grouped(in.point_count()), Fixed(in.mean_um(), 2),
                  Fixed(100 * in.used_part(), 0)});
  return table.empty() ? "" : table.ToText();
}

std::string AllowanceText(const Evidence& evidence) {
  if (!evidence.has_allowance()) return "";
  const auto& allowance = evidence.allowance();
  std::string text = "least stock " + Fixed(allowance.least_stock_mm(), 4) + " mm";
  if (allowance.lacking_mm() > 0) text += ", " + Fixed(allowance.lacking_mm(), 4) + " mm are lacking";
  text += "\n";
  Table table({"held at, part mm", "normal", ">stock mm", ">standard uncertainty um", ">share %"});
  for (const auto& in : allowance.holding())
    table.AddRow({PointText(in.point_mm(), 3), Vector(in.normal()), Fixed(in.stock_mm(), 4),
                  FixedOrTiny(in.standard_uncertainty_um(), 2), Fixed(100 * in.share(), 1)});
  if (!table.empty()) text += table.ToText();
  Table sides({"side", ">area mm2", ">seen %", "not seen about, part mm"});
  for (const auto& side : allowance.sides())
    sides.AddRow({Vector(side.direction()), Fixed(side.area_mm2(), 1), Fixed(100 * side.seen_part(), 0),
                  side.has_unseen_about_mm() ? PointText(side.unseen_about_mm(), 1) : "-"});
  return sides.empty() ? text : text + sides.ToText();
}

std::string DisagreementText(const Evidence& evidence) {
  if (!evidence.has_disagreement()) return "";
  const auto& in = evidence.disagreement();
  return std::string(in.beyond() ? "DISAGREES with" : "agrees with") +
         " the best fit of the same scans: " + Fixed(in.greatest_um(), 2) + " um at the part's " +
         PointText(in.point_mm(), 1) + " mm, standard uncertainty " + FixedOrTiny(in.standard_uncertainty_um(), 3) +
         " um, ratio " + Fixed(in.ratio(), 1) + "\n";
}

}  // namespace

std::string RegistrationText(const Registration& registration) {
  const Evidence& evidence = registration.evidence();
  Table summary = RegistrationTable();
  AddRegistrationRow(IdText(registration.blade()), MethodText(registration.method()), registration, &summary);
  std::string text = registration.name() + " with " + registration.sensor_calibration() + " and " +
                     registration.rotation_calibration() + "\n" + summary.ToText();
  if (!evidence.remark().empty()) text += "remark: " + evidence.remark() + "\n";
  if (!evidence.weakest_direction_in_words().empty())
    text += "weakest direction: " + evidence.weakest_direction_in_words() + ", standard uncertainty " +
            FixedOrTiny(evidence.weakest_standard_uncertainty_um(), 3) + " um\n";
  if (evidence.has_noise_sigma_um())
    text += "noise " + FixedOrTiny(evidence.noise_sigma_um(), 3) + " um a point, casting and CAD " +
            FixedOrTiny(evidence.model_sigma_um(), 3) + " um a patch\n";
  if (evidence.has_surface_part()) text += "seen: " + Fixed(100 * evidence.surface_part(), 0) + " % of the surface\n";
  text += DisagreementText(evidence) + AllowanceText(evidence);
  Table scans({"scan", ">points", ">used", ">median um"});
  for (const auto& in : evidence.scans())
    scans.AddRow({IdText(in.scan()), Grouped(in.point_count()), Grouped(in.points_used()),
                  FixedOrNone(in.residual_median_um(), 2)});
  if (!scans.empty()) text += scans.ToText();
  text += AgreementsText(evidence) + RegionsText(evidence);
  Table datums({"datum", ">distance um", ">standard uncertainty um", ">points"});
  for (const auto& datum : evidence.datums())
    datums.AddRow({datum.datum(), Fixed(datum.distance_um(), 2), Fixed(datum.standard_uncertainty_um(), 3),
                   Grouped(datum.point_count())});
  if (!datums.empty()) text += datums.ToText();
  Table angles({"axis", ">commanded deg", ">reached deg", ">standard uncertainty deg", ">half reversal deg", "by"});
  for (const auto& angle : registration.angles())
    angles.AddRow({angle.axis(), Fixed(angle.commanded_deg(), 4), Fixed(angle.reached_deg(), 6),
                   Fixed(angle.standard_uncertainty_deg(), 6), Fixed(angle.half_reversal_deg(), 6),
                   angle.characterisation().empty() ? "no table" : angle.characterisation()});
  if (!angles.empty()) text += angles.ToText();
  return text + PoseText(registration);
}

}  // namespace sixpoint::cli
