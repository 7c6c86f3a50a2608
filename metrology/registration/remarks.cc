#include "metrology/registration/remarks.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "metrology/registration/direction_words.h"
#include "metrology/registration/merged_views.h"
#include "metrology/registration/mirror_remark.h"
#include "metrology/registration/size_remark.h"

namespace sixpoint::metrology {
namespace {

constexpr double kFreeReachMm = 1;    // of the points that say which directions are free
constexpr double kBlankSpreadMm = 1;  // of a blank's scans, its stock being one (mirror_remark.h)

// Size or hand that the scans do not share with the CAD.
absl::Status RemarkWrongCad(const ScannedBlade& blade, const Eigen::Isometry3d& zero_from_part_nominal,
                            const FitOptions& options, PoseFit* fit) {
  const std::string size = SizeRemark(blade.surface, blade.portions, zero_from_part_nominal);
  if (!size.empty()) {
    AddRemark(size, &fit->evidence);
    return absl::OkStatus();
  }
  const auto mirror = MirrorRemark(blade.surface, blade.portions, zero_from_part_nominal, blade.calibration, options);
  if (mirror.ok()) AddRemark(*mirror, &fit->evidence);
  return mirror.status();
}

}  // namespace

void RemarkWeakness(PoseFit* fit) {
  const FitEvidence& evidence = fit->evidence;
  if (!fit->placed || !(evidence.condition_number > kWeakCondition)) return;
  char text[96];
  std::snprintf(text, sizeof text, "; standard uncertainty %.3g um there, condition number %.3g",
                1e3 * evidence.weakest_standard_uncertainty_mm, evidence.condition_number);
  AddRemark("weakly held: " + DirectionInWords(evidence.weakest_direction, fit->placed->zero_from_part) + text,
            &fit->evidence);
}

absl::Status RemarkFailure(const ScannedBlade& blade, const Eigen::Isometry3d& zero_from_part_nominal,
                           const FitOptions& options, PoseFit* fit) {
  if (fit->outcome == Outcome::kNotConverged && std::isfinite(fit->evidence.residual_sigma_mm)) {
    char text[128];
    std::snprintf(text, sizeof text, "of the points %.3g %% lie on the surface, within a spread of %.3g um",
                  100 * fit->evidence.overlap, 1e3 * fit->evidence.residual_sigma_mm);
    AddRemark(text, &fit->evidence);
  }
  if (fit->outcome == Outcome::kTooLittleOverlap || fit->outcome == Outcome::kNotConverged)
    return RemarkWrongCad(blade, zero_from_part_nominal, options, fit);
  if (fit->outcome != Outcome::kNotDetermined || !(fit->evidence.condition_number >= options.condition_limit))
    return absl::OkStatus();
  const auto free =
      FreeDirectionsInWords(blade.surface, blade.portions, *fit->evidence.stopped_at, kFreeReachMm, options);
  if (!free.ok()) return free.status();
  if (!free->empty()) AddRemark("free: " + *free, &fit->evidence);
  return absl::OkStatus();
}

absl::Status RemarkBlankFailure(const ScannedBlade& blade, const Eigen::Isometry3d& zero_from_part_nominal,
                                const FitOptions& options, PoseFit* fit) {
  FitOptions of_blank = options;
  of_blank.greatest_spread_mm = std::max(options.greatest_spread_mm, kBlankSpreadMm);
  return RemarkWrongCad(blade, zero_from_part_nominal, of_blank, fit);
}

absl::Status RemarkMerge(const ScannedBlade& blade, const FitOptions& options, PoseFit* fit) {
  if (!fit->placed) return absl::OkStatus();
  fit->evidence.merge = MergeTest();
  if (blade.portions.size() < 2) return absl::OkStatus();
  const auto test = TestMerge(blade.surface, blade.portions, *fit, blade.calibration, options);
  if (!test.ok()) return test.status();
  fit->evidence.merge = *test;
  if (!test->beyond) return absl::OkStatus();
  char text[192];
  std::snprintf(
      text, sizeof text,
      "the scans do not agree where they overlap: chi-squared %.3g, want at most %.3g: the rotation centre, an "
      "angle or the sensor is not where its calibration says",
      test->chi_squared, test->limit);
  AddRemark(text, &fit->evidence);
  return absl::OkStatus();
}

void RemarkDisagreement(const Disagreement& disagreement, FitEvidence* evidence) {
  if (!disagreement.beyond) return;
  char text[256];
  std::snprintf(text, sizeof text,
                "stands %.3g um from the best fit of the same scans at the part's (%.1f %.1f %.1f) mm, %.3g times the "
                "standard uncertainty, want at most %g: part and CAD differ in shape",
                1e3 * disagreement.greatest_mm, disagreement.point_mm.x(), disagreement.point_mm.y(),
                disagreement.point_mm.z(), disagreement.ratio, kDisagreementLimit);
  AddRemark(text, evidence);
}

}  // namespace sixpoint::metrology
