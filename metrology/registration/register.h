// A registration, whatever its method: the pose, what it is compared with, and what a person should know of it.
#pragma once

#include <absl/status/statusor.h>

#include <optional>
#include <vector>

#include "metrology/frames/pose.h"
#include "metrology/registration/allowance.h"
#include "metrology/registration/angle_influence.h"
#include "metrology/registration/disagreement.h"
#include "metrology/registration/remarks.h"
#include "metrology/registration/six_point.h"
#include "metrology/registration/station.h"

namespace sixpoint::metrology {

enum class Method { kBestFit, kLocal, kSixPointPairs, kSixPointNormals, kAllowance };

inline bool IsSixPoint(Method method) { return method == Method::kSixPointPairs || method == Method::kSixPointNormals; }

struct RegistrationTask {
  Method method = Method::kBestFit;
  Eigen::Isometry3d zero_from_part_nominal = NotYet<Eigen::Isometry3d>();
  std::optional<Station> station;  // whose nominal pose that is; the scans without its neighbours' points
  FitOptions options;
  AllowanceOptions allowance;      // kAllowance only
  std::vector<DatumPoint> datums;  // six-point only
};

struct Registered {
  PoseFit fit;
  std::optional<AllowanceFinding> allowance;  // kAllowance only
  std::vector<AngleInfluence> angles;         // of the scans, where they are uncertain
  // Six-point, and local by regions: from the best fit of the same scans. Where a converged fit has none, its remark says why.
  std::optional<Disagreement> disagreement;
};

// The fit's remark names what is wrong or weak: free directions, a weakly held one, sizes that do not go together, the other
// hand, scans that do not agree. Errors as the method's.
absl::StatusOr<Registered> Register(const ScannedBlade& blade, const RegistrationTask& task);

}  // namespace sixpoint::metrology
