#include <chrono>

#include "bench/correction/bare_kernels.h"
#include "bench/correction/need.h"
#include "services/correction/correct.h"
#include "services/correction/inputs.h"

namespace sixpoint::bench {
namespace {

using Clock = std::chrono::steady_clock;

}  // namespace

double BareCorrection_s(const Channels& channels, const correction::v1::CorrectRequest& request) {
  static const clients::BladePeers peers(channels.plant, channels.ingest, channels.calibration, channels.registration);
  runtime::Caller caller;
  caller.deadline = Clock::now() + std::chrono::seconds(60);
  caller.make_context = caller.make_own_context = [] { return runtime::ContextFor(60); };
  const correction::Inputs inputs = Need(correction::FetchInputs(peers, request, caller), "inputs");
  const auto began = Clock::now();
  Need(correction::CorrectBlade(inputs, nullptr), "program");
  return std::chrono::duration<double>(Clock::now() - began).count();
}

}  // namespace sixpoint::bench
