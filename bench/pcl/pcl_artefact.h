// The search for the artefact as one would do it with PCL: planes by consensus, holes by Euclidean clusters of what lies
// below, cones by consensus of circles, and the record's pattern laid on their centres.
#pragma once

#include <absl/status/statusor.h>

#include <vector>

#include "metrology/calibration/feature_search.h"
#include "metrology/calibration/hole_search.h"
#include "metrology/calibration/plane_search.h"

namespace sixpoint::bench {

// As metrology::FindArtefact has them.
inline constexpr std::size_t kArtefactSampleCount = 150'000, kMostArtefactFaces = 8;

enum class Consensus { kRansac, kMsac, kMlesac, kLmeds };

// As metrology::FlatFaces.
std::vector<metrology::Plane> PclFlatFaces(const metrology::Points& sample, double band_mm, std::size_t most,
                                           Consensus consensus);

enum class HoleCentres { kOfClusters, kOfCircles };

// As metrology::HolesBelow.
std::vector<metrology::Recess> PclHolesBelow(const std::vector<metrology::FacePoint>& seen,
                                             const metrology::Artefact& artefact, HoleCentres centres);

// As metrology::FindArtefact.
absl::StatusOr<metrology::ArtefactSighting> PclFindArtefact(const metrology::LineScan& scan,
                                                            const metrology::Artefact& artefact, HoleCentres centres);

}  // namespace sixpoint::bench
