#include "services/runtime/trace.h"

#include <algorithm>
#include <cstdio>
#include <random>

namespace sixpoint::runtime {
namespace {

bool IsHex(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

}  // namespace

std::string NewTraceparent() {
  thread_local std::random_device random;
  char text[64];
  std::snprintf(text, sizeof text, "00-%08x%08x%08x%08x-%08x%08x-01", random(), random(), random(), random() | 1u,
                random(), random() | 1u);
  return text;
}

std::string TraceIdOf(std::string_view traceparent) {
  const bool well_formed = traceparent.size() == 55 && traceparent.substr(0, 3) == "00-" && traceparent[35] == '-' &&
                           traceparent[52] == '-' && IsHex(traceparent.substr(3, 32)) &&
                           IsHex(traceparent.substr(36, 16)) && IsHex(traceparent.substr(53, 2)) &&
                           traceparent.substr(3, 32).find_first_not_of('0') != std::string_view::npos;
  return well_formed ? std::string(traceparent.substr(3, 32)) : std::string();
}

std::string SpanIdOf(std::string_view traceparent) {
  return TraceIdOf(traceparent).empty() ? std::string() : std::string(traceparent.substr(36, 16));
}

std::string ChildOf(std::string_view traceparent) {
  const std::string fresh = NewTraceparent();
  if (TraceIdOf(traceparent).empty()) return fresh;
  return std::string(traceparent.substr(0, 36)) + SpanIdOf(fresh) + std::string(traceparent.substr(52));
}

bool IsSampled(std::string_view traceparent) {
  if (TraceIdOf(traceparent).empty()) return false;
  const char last = traceparent[54];
  return ((last <= '9' ? last - '0' : last - 'a' + 10) & 1) != 0;
}

}  // namespace sixpoint::runtime
