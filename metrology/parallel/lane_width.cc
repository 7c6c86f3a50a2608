#include "metrology/parallel/lane_width.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <string_view>

namespace sixpoint::metrology {
namespace {

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

std::vector<LaneWidth> LaneWidths() {
  std::vector<LaneWidth> widths{LaneWidth::kFour};
#ifdef __x86_64__
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) widths.push_back(LaneWidth::kEight);
  if (__builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq")) widths.push_back(LaneWidth::kSixteen);
#endif
  return widths;
}

LaneWidth UsedLaneWidth() { return Used(); }
void UseLaneWidth(LaneWidth width) { Used() = width; }

}  // namespace sixpoint::metrology
