// Finds the artefact in a raw cloud from its record alone: no starting pose, no marked region.
#pragma once

#include <absl/status/statusor.h>

#include <Eigen/Geometry>
#include <string>

#include "metrology/calibration/artefact.h"
#include "metrology/frames/pose.h"
#include "metrology/scanner/line_scanner.h"

namespace sixpoint::metrology {

// Where the artefact lies in one scan, to about 0.1 mm and 1 deg: a start for the fits. The sensor frame is sheared
// (docs/methods/sensor_calibration.md, finding the artefact), so this is rigid only up to the sensor's mounting angles.
struct ArtefactSighting {
  Eigen::Isometry3d sensor_from_artefact = NotYet<Eigen::Isometry3d>();
  int matched_features = 0;
  double upper_face_fraction = 0;  // of all points of the scan
};

// Works on an even sample of the scan: the dominant plane by consensus, holes as connected regions below it, and the
// pose in which most of them stand where the record has a feature of their kind. Any turn in the plane, tilts up to
// 30 deg, missing returns and stray points. FAILED_PRECONDITION naming what was not found: the plate, cones, an
// unambiguous pose. Deterministic.
absl::StatusOr<ArtefactSighting> FindArtefact(const LineScan& scan, const Artefact& artefact);

}  // namespace sixpoint::metrology
