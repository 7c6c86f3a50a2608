#include "services/registration/fitting.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "metrology/registration/coarse_start.h"
#include "metrology/registration/direction_words.h"
#include "metrology/registration/merged_views.h"
#include "metrology/registration/mirror_remark.h"
#include "metrology/registration/patch_sums.h"
#include "metrology/registration/size_remark.h"
#include "services/registration/validate.h"

namespace sixpoint::registration {
namespace {

using metrology::Outcome;
using metrology::PoseFit;

constexpr double kFreeReachMm = 1;    // of the points that say which directions are free
constexpr double kBlankSpreadMm = 1;  // of a blank's scans, its stock being one (mirror_remark.h)
constexpr double kHeldPart = 1e-12;   // of the greatest variance, below which a direction is held from outside

std::string Percent(double part) { return std::to_string(static_cast<int>(100 * part)) + " %"; }

void RemarkWeakness(PoseFit* fit) {
  const metrology::FitEvidence& evidence = fit->evidence;
  if (fit->outcome != Outcome::kConverged || !(evidence.condition_number > metrology::kWeakCondition)) return;
  char text[96];
  std::snprintf(text, sizeof text, "; standard uncertainty %.3g um there, condition number %.3g",
                1e3 * evidence.weakest_standard_uncertainty_mm, evidence.condition_number);
  Remark("weakly held: " + metrology::DirectionInWords(evidence.weakest_direction, fit->zero_from_part) + text, fit);
}

// Size or hand that the scans do not share with the CAD, in words.
absl::Status RemarkWrongCad(const metrology::Surface& surface, const std::vector<metrology::ScanPortion>& portions,
                            const metrology::MachineCalibration& calibration, const Asked& asked, PoseFit* fit) {
  const std::string size = metrology::SizeRemark(surface, portions, asked.zero_from_part_nominal);
  if (!size.empty()) {
    Remark(size, fit);
    return absl::OkStatus();
  }
  const auto mirror =
      metrology::MirrorRemark(surface, portions, asked.zero_from_part_nominal, calibration, asked.options);
  if (mirror.ok()) Remark(*mirror, fit);
  return mirror.status();
}

// Scans that put the surface at different places where they overlap.
absl::Status RemarkMerge(const metrology::Surface& surface, const std::vector<metrology::ScanPortion>& portions,
                         const metrology::MachineCalibration& calibration, const Asked& asked, PoseFit* fit) {
  if (fit->outcome != Outcome::kConverged || portions.size() < 2) return absl::OkStatus();
  const auto test = metrology::TestMerge(surface, portions, *fit, calibration, asked.options);
  if (!test.ok()) return test.status();
  if (!test->beyond) return absl::OkStatus();
  char text[192];
  std::snprintf(
      text, sizeof text,
      "the scans do not agree where they overlap: chi-squared %.3g, want at most %.3g: the rotation centre, an "
      "angle or the sensor is not where its calibration says",
      test->chi_squared, test->limit);
  Remark(text, fit);
  return absl::OkStatus();
}

// What keeps a fit to the surface from being one, in words.
absl::Status RemarkFailure(const metrology::Surface& surface, const std::vector<metrology::ScanPortion>& portions,
                           const metrology::MachineCalibration& calibration, const Asked& asked, PoseFit* fit) {
  if (fit->outcome == Outcome::kNotConverged) {
    char text[128];
    std::snprintf(text, sizeof text, "of the points %.3g %% lie on the surface, within a spread of %.3g um",
                  100 * fit->evidence.overlap, 1e3 * fit->evidence.residual_sigma_mm);
    Remark(text, fit);
  }
  if (fit->outcome == Outcome::kTooLittleOverlap || fit->outcome == Outcome::kNotConverged)
    return RemarkWrongCad(surface, portions, calibration, asked, fit);
  if (fit->outcome != Outcome::kNotDetermined || fit->evidence.condition_number < asked.options.condition_limit)
    return absl::OkStatus();
  const auto free =
      metrology::FreeDirectionsInWords(surface, portions, fit->zero_from_part, kFreeReachMm, asked.options);
  if (!free.ok()) return free.status();
  if (!free->empty()) Remark("free: " + *free, fit);
  return absl::OkStatus();
}

// Weakest direction and condition, of a fit whose covariance says all there is.
void DescribeByCovariance(const metrology::Surface& surface, PoseFit* fit) {
  metrology::Vector6d scale = metrology::Vector6d::Ones();
  scale.head<3>().setConstant(surface.radius_of_gyration_mm());
  const metrology::Matrix6d scaled = scale.asDiagonal() * fit->noise_covariance.values * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<metrology::Matrix6d> eigen(scaled);
  const double greatest = eigen.eigenvalues()[5];
  if (!(greatest > 0)) return;
  int least = 0;
  while (least < 5 && eigen.eigenvalues()[least] < kHeldPart * greatest) ++least;
  fit->evidence.weakest_direction = eigen.eigenvectors().col(5);
  fit->evidence.weakest_standard_uncertainty_mm = std::sqrt(greatest);
  fit->evidence.condition_number = std::sqrt(greatest / eigen.eigenvalues()[least]);
}

// Scan by scan, what lay within the greatest stock.
absl::Status CountScans(const metrology::Surface& surface, const std::vector<metrology::ScanPortion>& portions,
                        const Asked& asked, PoseFit* fit) {
  const auto sums =
      metrology::SumPatches(surface, portions, fit->zero_from_part,
                            {asked.allowance.greatest_stock_mm, asked.allowance.patch_mm, false}, asked.options);
  if (!sums.ok()) return sums.status();
  fit->evidence.portions.resize(portions.size());
  for (std::size_t p = 0; p < portions.size(); ++p) {
    fit->evidence.portions[p].scan = portions[p].id;
    fit->evidence.portions[p].point_count = sums->portions[p].points;
    fit->evidence.portions[p].residual_median_mm = sums->portions[p].residual_median_mm;
  }
  for (const metrology::Patch& patch : sums->patches) fit->evidence.portions[patch.portion].points_used += patch.count;
  return absl::OkStatus();
}

// The same of a blank, whose stock is no spread of its scans.
absl::Status RemarkWrongBlank(const metrology::Surface& surface, const std::vector<metrology::ScanPortion>& portions,
                              const metrology::MachineCalibration& calibration, const Asked& asked, PoseFit* fit) {
  Asked of_blank = asked;
  of_blank.options.greatest_spread_mm = std::max(asked.options.greatest_spread_mm, kBlankSpreadMm);
  return RemarkWrongCad(surface, portions, calibration, of_blank, fit);
}

absl::StatusOr<Fitted> FitBlank(const metrology::Surface& surface, const std::vector<metrology::ScanPortion>& portions,
                                const metrology::MachineCalibration& calibration, const Asked& asked) {
  Eigen::Isometry3d start = asked.zero_from_part_nominal;
  std::string ambiguous;
  if (asked.options.coarse_start) {
    if (absl::Status status = metrology::CheckInputs(portions, start, asked.options); !status.ok()) return status;
    const auto found = metrology::FindCoarseStart(surface, portions, start, asked.options);
    if (!found.ok()) return found.status();
    start = found->zero_from_part;
    ambiguous = found->remark;
  }
  auto blank = metrology::FitWithAllowance(surface, portions, start, asked.allowance, calibration, asked.options);
  if (!blank.ok()) return blank.status();
  Fitted fitted{blank->fit, std::nullopt, *std::move(blank)};
  PoseFit& fit = fitted.fit;
  DescribeByCovariance(surface, &fit);
  if (absl::Status status = CountScans(surface, portions, asked, &fit); !status.ok()) return status;
  if (fit.evidence.overlap < asked.options.least_overlap) {
    fit.outcome = Outcome::kTooLittleOverlap;
    fit.evidence.remark = "of the points " + Percent(fit.evidence.overlap) +
                          " lie within the greatest stock; want at least " + Percent(asked.options.least_overlap) +
                          ": another blank, another side or no overlap";
    if (absl::Status status = RemarkWrongBlank(surface, portions, calibration, asked, &fit); !status.ok())
      return status;
  } else if (fit.outcome == Outcome::kInfeasible || fit.outcome == Outcome::kNotConverged) {
    if (absl::Status status = RemarkWrongBlank(surface, portions, calibration, asked, &fit); !status.ok())
      return status;
  } else if (!ambiguous.empty() && fit.outcome == Outcome::kConverged) {
    fit.outcome = Outcome::kNotDetermined;
    fit.evidence.remark = ambiguous;
  }
  return fitted;
}

}  // namespace

void Remark(const std::string& more, PoseFit* fit) {
  std::string& remark = fit->evidence.remark;
  if (!more.empty()) remark += (remark.empty() ? "" : "; ") + more;
}

std::string InWords(const metrology::Disagreement& disagreement) {
  char text[256];
  std::snprintf(text, sizeof text,
                "stands %.3g um from the best fit of the same scans at the part's (%.1f %.1f %.1f) mm, %.3g times the "
                "standard uncertainty, want at most %g: part and CAD differ in shape",
                1e3 * disagreement.greatest_mm, disagreement.point_mm.x(), disagreement.point_mm.y(),
                disagreement.point_mm.z(), disagreement.ratio, metrology::kDisagreementLimit);
  return text;
}

absl::StatusOr<PoseFit> FitForComparison(const metrology::Surface& surface,
                                         const std::vector<metrology::ScanPortion>& portions,
                                         const metrology::MachineCalibration& calibration, const Asked& asked) {
  metrology::FitOptions options = asked.options;
  if (!IsSixPoint(asked.method)) options.regions_in.clear();
  return metrology::FitToSurface(surface, portions, asked.zero_from_part_nominal, calibration, options);
}

absl::StatusOr<Fitted> FitAsked(const metrology::Surface& surface, const std::vector<metrology::ScanPortion>& portions,
                                const metrology::MachineCalibration& calibration, const Asked& asked) {
  if (asked.method == v1::METHOD_ALLOWANCE) return FitBlank(surface, portions, calibration, asked);
  auto fit = metrology::FitToSurface(surface, portions, asked.zero_from_part_nominal, calibration, asked.options);
  if (!fit.ok()) return fit.status();
  if (asked.in_words) {
    if (absl::Status status = RemarkFailure(surface, portions, calibration, asked, &*fit); !status.ok()) return status;
    if (absl::Status status = RemarkMerge(surface, portions, calibration, asked, &*fit); !status.ok()) return status;
  }
  Fitted fitted{*std::move(fit), std::nullopt, std::nullopt};
  if (IsSixPoint(asked.method)) {
    const auto variant = asked.method == v1::METHOD_SIX_POINT_NORMALS ? metrology::SixPointVariant::kNormals
                                                                      : metrology::SixPointVariant::kPairs;
    fitted.best_fit = std::move(fitted.fit);
    auto six =
        metrology::FitSixPoints(surface, portions, asked.datums, *fitted.best_fit, variant, calibration, asked.options);
    if (!six.ok()) return six.status();
    fitted.fit = *std::move(six);
  } else if (asked.method == v1::METHOD_LOCAL && !asked.options.regions_in.empty() &&
             fitted.fit.outcome == Outcome::kConverged) {
    auto best_fit = FitForComparison(surface, portions, calibration, asked);
    if (absl::IsCancelled(best_fit.status())) return best_fit.status();
    if (best_fit.ok()) fitted.best_fit = *std::move(best_fit);
  }
  if (fitted.fit.outcome != Outcome::kConverged ||
      (fitted.best_fit.has_value() && fitted.best_fit->outcome != Outcome::kConverged))
    fitted.best_fit.reset();
  RemarkWeakness(&fitted.fit);
  return fitted;
}

}  // namespace sixpoint::registration
