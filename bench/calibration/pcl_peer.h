// What one would do with PCL alone: a plane by consensus, a circle by consensus at one depth of each cone, and a rigid fit
// of their centres.
#pragma once

#include <optional>
#include <vector>

#include "metrology/calibration/artefact.h"
#include "metrology/scanner/line_scanner.h"

namespace sixpoint::bench {

// PCL has no search for the artefact: it is told where each cone is, by the calibration `near`.
std::optional<metrology::SensorPose> PclPlaneAndCircles(const std::vector<metrology::LineScan>& scans,
                                                        const metrology::Artefact& artefact,
                                                        const metrology::ArtefactTouch& touch,
                                                        const metrology::SensorPose& near,
                                                        const Eigen::Isometry3d& machine_from_artefact);

}  // namespace sixpoint::bench
