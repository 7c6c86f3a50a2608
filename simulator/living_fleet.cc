#include "simulator/living_fleet.h"

#include <chrono>
#include <cstdio>
#include <memory>
#include <thread>

#include "services/runtime/call_scope.h"
#include "services/runtime/trace.h"
#include "simulator/random.h"

namespace sixpoint::simulator {
namespace {

using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr int kBladesOfCalibration = 8, kTroubleEvery = 6, kFirstTrouble = 2;
constexpr double kDriftOfBlade_um = 0.2, kKnock_um = 90, kBadCasting_mm = 0.3;
// Coarse: a whole blade is some seconds of a processor, and the plant is looked at meanwhile.
constexpr double kAirfoilPitch_mm = 0.4, kPinsPitch_mm = 0.15;

// Warmth moves the scanner's bracket along its longest side; a knock moves it at once.
std::function<void(MachineTruth*)> Moved(const Turn& turn) {
  return [turn](MachineTruth* truth) {
    truth->t_sm_mm.z() += 1e-3 * kDriftOfBlade_um * turn.blades_since_calibration;
    if (turn.incident == Incident::kKnockedScanner) truth->t_sm_mm += 1e-3 * kKnock_um * Eigen::Vector3d(0.6, 0.8, 0);
  };
}

class Worker {
 public:
  Worker(PlantLink& plant, const MachineDesign& design, const DesignedPart& part, const LivingFleetOptions& options,
         const std::function<bool()>& stopped, const std::function<void(const std::string&)>& say)
      : plant_(plant), design_(design), part_(part), options_(options), stopped_(stopped), say_(say) {}

  void Work(int machine, int machine_count, const BladeRunPlan& first) const {
    Rest(options_.pace_s * machine / machine_count);
    auto answered = Clock::now();
    for (int blade = 0; !stopped_() && (options_.blade_count == 0 || blade < options_.blade_count); ++blade) {
      const auto begun = Clock::now();
      const Turn turn = TurnOf(machine, blade);
      const absl::Status done = Machine(blade, turn, first);
      if (!absl::IsUnavailable(done)) answered = Clock::now();
      if (Clock::now() - answered > Seconds(options_.patience_s)) return;
      const double rest_s = turn.incident == Incident::kCrash ? options_.standstill_s : options_.pace_s;
      Rest(rest_s - Seconds(Clock::now() - begun).count());
    }
  }

 private:
  absl::Status Machine(int blade, const Turn& turn, const BladeRunPlan& first) const {
    BladeRunPlan plan = first;
    plan.blade_serial = first.blade_serial + "-" + std::to_string(blade + 2);
    plan.scan_prefix = first.scan_prefix + std::to_string(blade + 2) + "-";
    plan.seed = Random::StreamSeed(first.seed, 1000 + static_cast<std::uint64_t>(blade));
    plan.airfoil_pitch_mm = kAirfoilPitch_mm;
    plan.pins_pitch_mm = kPinsPitch_mm;
    plan.threads = 1;
    plan.calibrate = turn.calibrate;
    plan.since_calibration = Moved(turn);
    if (turn.incident == Incident::kBadCasting) {
      plan.casting_mm = kBadCasting_mm;
      plan.stop_at_correction = true;  // it waits for a person
    }
    if (turn.incident == Incident::kCrash)
      plan.before_correction = [] { return absl::AbortedError("the machine stopped: its control lost an axis"); };
    const runtime::CallScope trace(std::make_shared<runtime::CallFacts>(runtime::NewTraceparent()));
    BladeRunResult result;
    const absl::Status done = RunBlade(
        plant_, design_, part_, plan, [](const std::string&) {}, &result);
    say_(plan.machine_id + "  " + plan.blade_serial + ": " +
         (!done.ok()                ? std::string(done.message())
          : plan.stop_at_correction ? "a casting out of bounds"
                                    : inspection::v1::Verdict_Name(result.inspection.verdict()).substr(8)));
    return done;
  }

  void Rest(double seconds) const {
    const auto end = Clock::now() + Seconds(seconds);
    while (!stopped_() && Clock::now() < end) std::this_thread::sleep_for(std::chrono::milliseconds(200));
  }

  PlantLink& plant_;
  const MachineDesign& design_;
  const DesignedPart& part_;
  const LivingFleetOptions& options_;
  const std::function<bool()>& stopped_;
  const std::function<void(const std::string&)>& say_;
};

}  // namespace

Turn TurnOf(int machine, int blade) {
  Turn turn;
  turn.blades_since_calibration = (blade + 1) % kBladesOfCalibration;
  turn.calibrate = turn.blades_since_calibration == 0;
  if ((blade + machine) % kTroubleEvery != kFirstTrouble) return turn;
  constexpr Incident kTroubles[] = {Incident::kBadCasting, Incident::kKnockedScanner, Incident::kCrash};
  turn.incident = kTroubles[((blade + machine) / kTroubleEvery + machine) % 3];
  return turn;
}

void KeepWorking(PlantLink& plant, const MachineDesign& design, const DesignedPart& part,
                 const std::vector<BladeRunPlan>& plans, const LivingFleetOptions& options,
                 const std::function<bool()>& stopped, const std::function<void(const std::string&)>& say) {
  const Worker worker(plant, design, part, options, stopped, say);
  std::vector<std::thread> machines;
  for (std::size_t i = 0; i < plans.size(); ++i)
    machines.emplace_back([&, i] { worker.Work(static_cast<int>(i), static_cast<int>(plans.size()), plans[i]); });
  for (std::thread& machine : machines) machine.join();
}

}  // namespace sixpoint::simulator
