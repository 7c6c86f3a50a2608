// One registration's fit, method by method, on what was fetched: pure, between the request and the kernel.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <vector>

#include "metrology/registration/allowance.h"
#include "metrology/registration/disagreement.h"
#include "metrology/registration/registration.h"
#include "sixpoint/registration/v1/registration.pb.h"

namespace sixpoint::registration {

struct Asked {
  v1::Method method = v1::METHOD_BEST_FIT;
  metrology::FitOptions options;
  metrology::AllowanceOptions allowance;
  std::vector<metrology::DatumPoint> datums;  // six-point only
  Eigen::Isometry3d zero_from_part_nominal = Eigen::Isometry3d::Identity();
  bool in_words = true;  // with remarks that cost a pass over the points; a refit for its pose does without
};

struct Fitted {
  metrology::PoseFit fit;
  // What six-point and local by regions are to be compared with: of the same scans, converged as the fit is.
  std::optional<metrology::PoseFit> best_fit;
  std::optional<metrology::AllowanceFit> allowance;
};

// The fit, its remark saying what a person should know: free directions and a weakly held one in words, sizes that do not
// go together, the other hand (of a blank where its stock lets it be seen). Errors as the kernel's.
absl::StatusOr<Fitted> FitAsked(const metrology::Surface& surface, const std::vector<metrology::ScanPortion>& portions,
                                const metrology::MachineCalibration& calibration, const Asked& asked);

// The fit that Fitted::best_fit is.
absl::StatusOr<metrology::PoseFit> FitForComparison(const metrology::Surface& surface,
                                                    const std::vector<metrology::ScanPortion>& portions,
                                                    const metrology::MachineCalibration& calibration,
                                                    const Asked& asked);

// Adds to the fit's remark.
void Remark(const std::string& more, metrology::PoseFit* fit);
// What to say of a disagreement that is beyond what is explained.
std::string InWords(const metrology::Disagreement& disagreement);

}  // namespace sixpoint::registration
