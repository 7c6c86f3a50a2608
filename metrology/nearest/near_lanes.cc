#include "metrology/nearest/near_lanes.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <string_view>

// Vectors by name: left to itself the compiler may not turn comparisons into masks, and makes scalar code of such a loop for
// every processor without AVX-512. tests/metrology/nearest/check_packed_lanes looks at what came out.

namespace sixpoint::metrology {
namespace {

struct Four {
  static constexpr std::size_t kLanes = 4;
  typedef float Floats __attribute__((vector_size(16), may_alias));
  typedef std::uint32_t Indices __attribute__((vector_size(16), may_alias));
};
struct Eight {
  static constexpr std::size_t kLanes = 8;
  typedef float Floats __attribute__((vector_size(32), may_alias));
  typedef std::uint32_t Indices __attribute__((vector_size(32), may_alias));
};
struct Sixteen {
  static constexpr std::size_t kLanes = 16;
  typedef float Floats __attribute__((vector_size(64), may_alias));
  typedef std::uint32_t Indices __attribute__((vector_size(64), may_alias));
};

#define SIXPOINT_INLINE inline __attribute__((always_inline))

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
  for (std::size_t i = 0; i < count; i += Width::kLanes) {
    const Floats px = *reinterpret_cast<const Floats*>(&lanes->x[i]) - ax;
    const Floats py = *reinterpret_cast<const Floats*>(&lanes->y[i]) - ay;
    const Floats pz = *reinterpret_cast<const Floats*>(&lanes->z[i]) - az;
    const Floats qx = px - t.bx, qy = py - t.by, qz = pz - t.bz;
    Floats b = (px * t.bx + py * t.by + pz * t.bz) * per_bb;
    Floats c = (px * t.cx + py * t.cy + pz * t.cz) * per_cc;
    Floats e = (qx * ex + qy * ey + qz * ez) * per_ee;
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
#ifdef __x86_64__
__attribute__((target("avx2"))) void MeasureEight(const TriangleShape& t, float ax, float ay, float az,
                                                  std::uint32_t candidate, std::size_t count, NearLanes* lanes,
                                                  LaneBlock* squared) {
  MeasureLanes<Eight>(t, ax, ay, az, candidate, count, lanes, squared);
}
__attribute__((target("avx512f,avx512vl,avx512dq"))) void MeasureSixteen(const TriangleShape& t, float ax, float ay,
                                                                         float az, std::uint32_t candidate,
                                                                         std::size_t count, NearLanes* lanes,
                                                                         LaneBlock* squared) {
  MeasureLanes<Sixteen>(t, ax, ay, az, candidate, count, lanes, squared);
}
#endif

// $SIXPOINT_LANES, 4, 8 or 16, where this processor has as many: to show that a lesser one computes the same.
LaneWidth WidthAtStart() {
  const std::vector<LaneWidth> widths = LaneWidths();
  const char* const asked = std::getenv("SIXPOINT_LANES");
  if (asked == nullptr) return widths.back();
  const std::string_view lanes(asked);
  const LaneWidth wanted = lanes == "4" ? LaneWidth::kFour : lanes == "8" ? LaneWidth::kEight : LaneWidth::kSixteen;
  return std::find(widths.begin(), widths.end(), wanted) == widths.end() ? widths.back() : wanted;
}

std::atomic<LaneWidth>& Used() {
  static std::atomic<LaneWidth> used = WidthAtStart();
  return used;
}

}  // namespace

MeasureTriangle MeasureOf(LaneWidth width) {
#ifdef __x86_64__
  if (width == LaneWidth::kSixteen) return MeasureSixteen;
  if (width == LaneWidth::kEight) return MeasureEight;
#endif
  (void)width;
  return MeasureFour;
}

std::vector<LaneWidth> LaneWidths() {
  std::vector<LaneWidth> widths{LaneWidth::kFour};
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2")) widths.push_back(LaneWidth::kEight);
  if (__builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")) widths.push_back(LaneWidth::kSixteen);
#endif
  return widths;
}

LaneWidth UsedLaneWidth() { return Used(); }
void UseLaneWidth(LaneWidth width) { Used() = width; }

}  // namespace sixpoint::metrology
