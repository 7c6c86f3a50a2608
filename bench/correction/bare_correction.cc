#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "bench/correction/bare_kernels.h"
#include "services/correction/correct.h"
#include "services/correction/inputs.h"

namespace sixpoint::bench {
namespace {

using Clock = std::chrono::steady_clock;

template <typename Value>
Value Need(absl::StatusOr<Value> value, const char* what) {
  if (value.ok()) return *std::move(value);
  std::fprintf(stderr, "bare correction: %s: %s\n", what, value.status().ToString().c_str());
  std::exit(2);
}

}  // namespace

double BareCorrection_s(const Channels& channels, const correction::v1::CorrectRequest& request) {
  static const correction::Peers peers(channels.plant, channels.calibration, channels.registration);
  runtime::Caller caller;
  caller.deadline = Clock::now() + std::chrono::seconds(60);
  caller.make_context = caller.make_own_context = [] { return runtime::ContextFor(60); };
  const correction::Inputs inputs = Need(correction::FetchInputs(peers, request, caller), "inputs");
  const auto began = Clock::now();
  Need(correction::CorrectBlade(inputs, nullptr), "program");
  return std::chrono::duration<double>(Clock::now() - began).count();
}

}  // namespace sixpoint::bench
