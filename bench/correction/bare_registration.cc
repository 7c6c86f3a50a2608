#include <chrono>
#include <utility>
#include <vector>

#include "bench/correction/bare_kernels.h"
#include "bench/correction/need.h"
#include "metrology/registration/register.h"
#include "services/registration/inputs.h"
#include "services/registration/thinned_scans.h"

namespace sixpoint::bench {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kThreads = 2;                     // as the services' --threads
constexpr std::int64_t kPointBudget = 400'000;  // of all scans, as a registration thins them

}  // namespace

struct BareRegistration::Parts {
  explicit Parts(const Channels& channels)
      : fetcher({channels.plant, channels.ingest, channels.calibration}, {}, kThreads),
        scans(channels.ingest, 0, kThreads) {}
  const registration::InputFetcher fetcher;
  const registration::ThinnedScans scans;
};

BareRegistration::BareRegistration(const Channels& channels) : parts_(std::make_unique<const Parts>(channels)) {}
BareRegistration::~BareRegistration() = default;

RegistrationTimes BareRegistration::Run(const registration::v1::RegisterRequest& request) const {
  registration::Caller caller;
  caller.deadline = Clock::now() + std::chrono::seconds(60);
  caller.make_context = caller.make_own_context = [] { return runtime::ContextFor(60); };
  const registration::Inputs inputs = Need(parts_->fetcher.Fetch(request, caller), "inputs");
  registration::ScanThinning thinning;
  thinning.own.target_count = kPointBudget / request.scans_size();
  std::vector<registration::ScanAtHand> at_hand;
  for (const std::string& scan : request.scans())
    at_hand.push_back(Need(parts_->scans.Fetch(scan, false, caller.make_context), "blocks"));
  RegistrationTimes times;
  const auto began = Clock::now();
  for (int i = 0; i < request.scans_size(); ++i)
    Need(parts_->scans.Thin(request.scans(i), std::move(at_hand[static_cast<std::size_t>(i)]), inputs.calibration,
                            thinning, caller.make_context),
         "decoding");
  const auto decoded = Clock::now();
  Need(metrology::Register({*inputs.surface, inputs.portions, inputs.calibration}, inputs.task), "fit");
  times.decode_s = std::chrono::duration<double>(decoded - began).count();
  times.fit_s = std::chrono::duration<double>(Clock::now() - decoded).count();
  return times;
}

}  // namespace sixpoint::bench
