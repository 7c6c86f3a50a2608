// PCL's filters, clusters and cylinders on our points.
#pragma once

#include <optional>

#include "metrology/inspection/pin.h"

namespace sixpoint::bench {

// PCL prints a line for every draw that it throws away.
void QuietPcl();

// Centres of mass of the points in each cell; one measured point of each cell; any of them.
metrology::Points PclVoxelGrid(const metrology::Points& points_mm, double cell_mm);
metrology::Points PclUniformSampling(const metrology::Points& points_mm, double cell_mm);
metrology::Points PclRandomSample(const metrology::Points& points_mm, std::size_t count);

// Those whose mean distance to 20 neighbours is at most the mean of all and `sigmas` standard deviations.
metrology::Points PclWithoutOutliers(const metrology::Points& points_mm, double sigmas);

// The largest set whose neighbours are no farther apart than this.
metrology::Points PclLargestCluster(const metrology::Points& points_mm, double gap_mm);

// Where the axis of a cylinder by consensus meets the nominal surface.
std::optional<Eigen::Vector3d> PclCylinderStart(const metrology::NominalPin& nominal,
                                                const metrology::Points& points_mm);

}  // namespace sixpoint::bench
