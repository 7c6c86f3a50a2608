// The point laser probe's part of storage/calibrations.h.
#pragma once

#include "storage/calibrations.h"

namespace sixpoint::storage {

absl::Status InsertProbe(Transaction& transaction, const std::string& calibration_id, const ProbeCalibrationRow& probe);
// Without residuals and checks, into the rows of these ids.
absl::Status ReadProbes(Transaction& transaction, const std::vector<std::string>& calibration_ids,
                        std::vector<CalibrationRow>* calibrations);
absl::Status ReadProbeResiduals(Transaction& transaction, const std::string& calibration_id,
                                ProbeCalibrationRow* probe);

}  // namespace sixpoint::storage
