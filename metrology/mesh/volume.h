// The volume, area and middle that a mesh encloses or has.
#pragma once

#include <vector>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

// Enclosed volume in mm3, positive where triangles are counter-clockwise seen from outside. Open borders are capped by fans
// from the border's centroid, so that a tube has a volume too. 0 for no triangles.
double SignedVolume(const TriangleMesh& mesh);

// The same of triangles that are known to leave no border, about a point near them: far from it digits are lost.
double SignedVolumeOfClosed(const Points& vertices_mm, const std::vector<TriangleCorners>& triangles,
                            const Eigen::Vector3d& about_mm);

// Of the triangles, by area. Not finite where none has an area.
struct SurfaceMoments {
  double area_mm2 = 0;
  Eigen::Vector3d centroid_mm = Eigen::Vector3d::Zero();
  double radius_of_gyration_mm = 0;  // root mean square distance from the centroid
};
SurfaceMoments MomentsOf(const Points& vertices_mm, const std::vector<TriangleCorners>& triangles);

}  // namespace sixpoint::metrology
