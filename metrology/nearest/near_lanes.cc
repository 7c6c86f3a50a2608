#include "metrology/nearest/near_lanes.h"

#include "metrology/parallel/vectors.h"

// tests/metrology/parallel/check_packed_lanes looks at what came out.

namespace sixpoint::metrology {
namespace {

// To [0, 1].
template <typename Floats>
SIXPOINT_INLINE void Clamp(Floats* at) {
  const Floats zero{}, one = zero + 1.f;
  *at = *at > zero ? *at : zero;
  *at = *at < one ? *at : one;
}

// To the plane where the foot is inside, else to the nearest edge.
template <typename Width>
SIXPOINT_INLINE void MeasureLanes(const TriangleShape& t, float ax, float ay, float az, std::uint32_t candidate,
                                  std::size_t count, NearLanes* lanes, LaneBlock* squared) {
  using Floats = typename Width::Floats;
  using Indices = typename Width::Indices;
  const float ex = t.cx - t.bx, ey = t.cy - t.by, ez = t.cz - t.bz;
  const float per_bb = 1 / (t.bx * t.bx + t.by * t.by + t.bz * t.bz), per_ee = 1 / (ex * ex + ey * ey + ez * ez);
  const float per_cc = 1 / (t.cx * t.cx + t.cy * t.cy + t.cz * t.cz);
  // How far along an edge: products with these.
  const float bx = t.bx * per_bb, by = t.by * per_bb, bz = t.bz * per_bb;
  const float cx = t.cx * per_cc, cy = t.cy * per_cc, cz = t.cz * per_cc;
  const float fx = ex * per_ee, fy = ey * per_ee, fz = ez * per_ee;
  for (std::size_t i = 0; i < count; i += Width::kFloats) {
    const Floats px = *reinterpret_cast<const Floats*>(&lanes->x[i]) - ax;
    const Floats py = *reinterpret_cast<const Floats*>(&lanes->y[i]) - ay;
    const Floats pz = *reinterpret_cast<const Floats*>(&lanes->z[i]) - az;
    const Floats qx = px - t.bx, qy = py - t.by, qz = pz - t.bz;
    Floats b = px * bx + py * by + pz * bz, c = px * cx + py * cy + pz * cz, e = qx * fx + qy * fy + qz * fz;
    Clamp(&b);
    Clamp(&c);
    Clamp(&e);
    const Floats b1 = px - b * t.bx, b2 = py - b * t.by, b3 = pz - b * t.bz;
    const Floats c1 = px - c * t.cx, c2 = py - c * t.cy, c3 = pz - c * t.cz;
    const Floats e1 = qx - e * ex, e2 = qy - e * ey, e3 = qz - e * ez;
    const Floats to_b = b1 * b1 + b2 * b2 + b3 * b3, to_c = c1 * c1 + c2 * c2 + c3 * c3;
    const Floats to_e = e1 * e1 + e2 * e2 + e3 * e3;
    Floats to_edge = to_b < to_c ? to_b : to_c;
    to_edge = to_e < to_edge ? to_e : to_edge;
    const Floats v = px * t.vx + py * t.vy + pz * t.vz, w = px * t.wx + py * t.wy + pz * t.wz;
    const Floats height = px * t.nx + py * t.ny + pz * t.nz;
    const Floats lower = v < w ? v : w, third = 1.f - v - w;
    const Floats inside = lower < third ? lower : third, zero{};
    const Floats d = inside >= zero ? height * height : to_edge;
    *reinterpret_cast<Floats*>(&squared[i / NearLanes::kMultiple].at[i % NearLanes::kMultiple]) = d;
    Floats& least = *reinterpret_cast<Floats*>(&lanes->least[i]);
    Floats& second = *reinterpret_cast<Floats*>(&lanes->second[i]);
    Indices& nearest = *reinterpret_cast<Indices*>(&lanes->nearest[i]);
    const Floats greater = d > least ? d : least;
    second = greater < second ? greater : second;
    nearest = d < least ? Indices{} + candidate : nearest;
    least = d < least ? d : least;
  }
}

void MeasureFour(const TriangleShape& t, float ax, float ay, float az, std::uint32_t candidate, std::size_t count,
                 NearLanes* lanes, LaneBlock* squared) {
  MeasureLanes<Four>(t, ax, ay, az, candidate, count, lanes, squared);
}
SIXPOINT_EIGHT void MeasureEight(const TriangleShape& t, float ax, float ay, float az, std::uint32_t candidate,
                                 std::size_t count, NearLanes* lanes, LaneBlock* squared) {
  MeasureLanes<Eight>(t, ax, ay, az, candidate, count, lanes, squared);
}
SIXPOINT_SIXTEEN void MeasureSixteen(const TriangleShape& t, float ax, float ay, float az, std::uint32_t candidate,
                                     std::size_t count, NearLanes* lanes, LaneBlock* squared) {
  MeasureLanes<Sixteen>(t, ax, ay, az, candidate, count, lanes, squared);
}

}  // namespace

MeasureTriangle MeasureOf(LaneWidth width) { return OfWidth(width, MeasureFour, MeasureEight, MeasureSixteen); }

}  // namespace sixpoint::metrology
