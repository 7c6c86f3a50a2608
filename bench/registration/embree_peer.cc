#include "bench/registration/embree_peer.h"

#include <embree3/rtcore.h>

#include <limits>

#include "bench/registration/our_fit.h"
#include "metrology/parallel/loops.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector3f;

struct Query {
  const std::vector<Vector3f>* vertices;
  const std::vector<std::array<std::uint32_t, 3>>* triangles;
  Vector3f point;
  float distance;
  unsigned triangle;
};

// Ericson, Real-Time Collision Detection, 5.1.5.
Vector3f ClosestOnTriangle(const Vector3f& p, const Vector3f& a, const Vector3f& b, const Vector3f& c) {
  const Vector3f ab = b - a, ac = c - a, ap = p - a;
  const float d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vector3f bp = p - b;
  const float d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const float vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + d1 / (d1 - d3) * ab;
  const Vector3f cp = p - c;
  const float d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const float vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + d2 / (d2 - d6) * ac;
  const float va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (d4 - d3) / ((d4 - d3) + (d5 - d6)) * (c - b);
  const float scale = 1 / (va + vb + vc);
  return a + vb * scale * ab + vc * scale * ac;
}

bool Visit(RTCPointQueryFunctionArguments* arguments) {
  auto* query = static_cast<Query*>(arguments->userPtr);
  const auto& t = (*query->triangles)[arguments->primID];
  const auto& v = *query->vertices;
  const float distance = (query->point - ClosestOnTriangle(query->point, v[t[0]], v[t[1]], v[t[2]])).norm();
  if (distance >= query->distance) return false;
  query->distance = arguments->query->radius = distance;
  query->triangle = arguments->primID;
  return true;
}

}  // namespace

std::vector<float> EmbreeDistances(const Blade& blade, const metrology::Points& part_mm, float limit_mm, int threads,
                                   double* seconds) {
  std::vector<Vector3f> vertices;
  for (const Eigen::Vector3d& vertex : blade.mesh.vertices_mm) vertices.push_back(vertex.cast<float>());
  RTCDevice device = rtcNewDevice(nullptr);
  RTCScene scene = rtcNewScene(device);
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* corners = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                              3 * sizeof(float), vertices.size()));
  for (const Vector3f& vertex : vertices) corners = std::copy(vertex.data(), vertex.data() + 3, corners);
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                                 3 * sizeof(unsigned), blade.mesh.triangles.size()));
  for (const auto& t : blade.mesh.triangles) indices = std::copy(t.begin(), t.end(), indices);
  rtcSetGeometryPointQueryFunction(geometry, Visit);
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene);

  std::vector<float> distances(part_mm.size(), std::numeric_limits<float>::quiet_NaN());
  const auto run = [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vector3f point = part_mm[i].cast<float>();
      Query query{&vertices, &blade.mesh.triangles, point, limit_mm, RTC_INVALID_GEOMETRY_ID};
      RTCPointQuery sphere;
      sphere.x = point.x();
      sphere.y = point.y();
      sphere.z = point.z();
      sphere.time = 0;
      sphere.radius = limit_mm;
      RTCPointQueryContext context;
      rtcInitPointQueryContext(&context);
      rtcPointQuery(scene, &sphere, &context, nullptr, &query);
      if (query.triangle == RTC_INVALID_GEOMETRY_ID) continue;
      const Vector3f& corner = vertices[blade.mesh.triangles[query.triangle][0]];
      const bool outside = (point - corner).dot(blade.normals[query.triangle].cast<float>()) >= 0;
      distances[i] = outside ? query.distance : -query.distance;
    }
  };
  const double begin = Seconds();
  metrology::InParts(part_mm.size(), threads, [&](std::size_t from, std::size_t to, std::size_t) { run(from, to); });
  *seconds = Seconds() - begin;
  rtcReleaseScene(scene);
  rtcReleaseDevice(device);
  return distances;
}

}  // namespace sixpoint::bench
