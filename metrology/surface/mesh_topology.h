// What the triangles of a mesh say about the body that they bound.
#pragma once

#include "metrology/surface/triangle_mesh.h"

namespace sixpoint::metrology {

// Vertices with equal coordinates become one (tolerance_mm 0: bit for bit; else neighbours on a grid of that size), in
// order of first use; triangles that lose a corner by it are dropped, with their normals and faces.
void WeldVertices(double tolerance_mm, TriangleMesh* mesh);

// Every edge belongs to exactly two triangles, which run along it in opposite senses.
bool IsClosed(const TriangleMesh& mesh);

// Enclosed volume, positive where triangles are counter-clockwise seen from outside. Open borders are capped by fans
// from the border's centroid, so that a tube has a volume too.
double SignedVolume(const TriangleMesh& mesh);

// Turns every triangle and normal over.
void TurnOver(TriangleMesh* mesh);

}  // namespace sixpoint::metrology
