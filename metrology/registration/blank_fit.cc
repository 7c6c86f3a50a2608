#include "metrology/registration/blank_fit.h"

#include <string>

#include "metrology/registration/coarse_start.h"
#include "metrology/registration/patch_sums.h"

namespace sixpoint::metrology {
namespace {

// Scan by scan, what lay within the greatest stock.
absl::Status CountScans(const ScannedBlade& blade, const AllowanceOptions& allowance, const FitOptions& options,
                        PoseFit* fit) {
  const auto sums = SumPatches(blade.surface, blade.portions, *fit->evidence.stopped_at,
                               {allowance.greatest_stock_mm, allowance.patch_mm, false}, options);
  if (!sums.ok()) return sums.status();
  std::vector<PortionEvidence>& portions = fit->evidence.portions;
  portions.resize(blade.portions.size());
  for (std::size_t p = 0; p < portions.size(); ++p) {
    portions[p].scan = blade.portions[p].id;
    portions[p].point_count = sums->portions[p].points;
    portions[p].residual_median_mm = sums->portions[p].residual_median_mm;
  }
  for (const Patch& patch : sums->patches) portions[patch.portion].points_used += patch.count;
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<AllowanceFit> FitBlank(const ScannedBlade& blade, const Eigen::Isometry3d& zero_from_part_nominal,
                                      const AllowanceOptions& allowance, const FitOptions& options) {
  Eigen::Isometry3d start = zero_from_part_nominal;
  std::string ambiguous;
  if (options.coarse_start) {
    if (absl::Status status = CheckInputs(blade.portions, start, options); !status.ok()) return status;
    const auto found = FindCoarseStart(blade.surface, blade.portions, start, options);
    if (!found.ok()) return found.status();
    start = found->zero_from_part;
    ambiguous = found->remark;
  }
  auto blank = FitWithAllowance(blade.surface, blade.portions, start, allowance, blade.calibration, options);
  if (!blank.ok()) return blank.status();
  PoseFit& fit = blank->fit;
  if (absl::Status status = CountScans(blade, allowance, options, &fit); !status.ok()) return status;
  if (fit.evidence.overlap < options.least_overlap) {
    fit.Withdraw(Outcome::kTooLittleOverlap,
                 "of the points " + Percent(fit.evidence.overlap) + " lie within the greatest stock; want at least " +
                     Percent(options.least_overlap) + ": another blank, another side or no overlap");
  } else if (!ambiguous.empty() && fit.placed) {
    fit.Withdraw(Outcome::kNotDetermined, ambiguous);
    return blank;
  }
  // A side that was not seen says nothing of the CAD.
  if (fit.placed || fit.outcome == Outcome::kNotDetermined) return blank;
  absl::Status status = RemarkBlankFailure(blade, zero_from_part_nominal, options, &fit);
  if (!status.ok()) return status;
  return blank;
}

}  // namespace sixpoint::metrology
