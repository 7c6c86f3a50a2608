// STEP and IGES to triangles, through OpenCASCADE.
//
// OpenCASCADE crashes, loops and exhausts memory on hostile files: servers run this in sixpoint-cad-worker only
// (services/plant/cad_worker.h), never in their own process.
#pragma once

#include <absl/status/statusor.h>

#include <string>

#include "metrology/mesh/triangle_mesh.h"

namespace sixpoint::metrology {

enum class CadFormat { kStep, kIges };

struct TessellationOptions {
  double chordal_error_um = 0.5;
  // A part that needs more triangles than this is meshed at twice the error, and again up to the greatest.
  int greatest_triangle_count = 1'500'000;
  double greatest_chordal_error_um = 4;
  // Which solid of a file that has several is the part: by name, or by number from 1 on (bodies.h). Empty: the only one.
  std::string solid = {};
};

// Millimetres whatever the file's unit; the file's own coordinates, however far from their origin. Faces are numbered
// in the file's order. Normals are those of the true surface at each corner, outward: solids by their enclosed volume,
// shells open at the ends (a blade's airfoil alone) by the volume of their capped tube.
// chordal_error_um is measured on the result: the greatest distance of the true surface at each triangle's centroid and
// edge midpoints (in the face's parameters) from the triangles there, and of the true edge curves from their chords.
// An empty path is the standard input, for a process that may open no file.
// Edges more than 10 um off their faces are put onto them, and what that leaves is told (TriangleMesh::face_gaps_mm).
// INVALID_ARGUMENT: nothing readable, no faces, several solids and none asked for, extent below 0.1 mm or above 10 m, non-finite numbers,
// too many triangles, edges more than 0.1 mm off their faces, edges that more than two faces share, faces turned against each other.
absl::StatusOr<TriangleMesh> TessellateCad(CadFormat format, const std::string& path,
                                           const TessellationOptions& options);

}  // namespace sixpoint::metrology
