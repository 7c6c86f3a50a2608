// Blades through a running plant until the gate has spoken: clean ones, and ones with which something is wrong. The simulator knows what, and
// where each hole should have been; the plant is told nothing of it. usage: sixpoint-bench-gate SERVER IDENTITY COUNT SEED (IDENTITY: an
// engineer's folder of credentials). Prints a line a case, and {"clean": ..., "clean_released": ..., "faults": ..., "wrong_released": ...,
// "worst_released_um": ...} as its last line.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "services/runtime/credentials.h"
#include "simulator/blade_run.h"
#include "simulator/registry.h"

namespace sixpoint::bench {
namespace {

using simulator::BladeRunPlan;
using simulator::BladeRunResult;

const std::vector<std::string> kFaults = {"foil",     "wrong centre",   "wrong angle", "stale",   "weak",
                                          "one side", "wrong clamping", "swapped",     "casting", "held"};

class Gate {
 public:
  Gate(simulator::PlantLink& plant, std::uint64_t seed) : plant_(plant), seed_(seed) {}

  absl::Status Begin() {
    auto artefact = simulator::RegisterArtefact(plant_, "gate-plate", simulator::ArtefactGeometry());
    if (!artefact.ok()) return artefact.status();
    auto part = simulator::RegisterPart(plant_, "gate-blade", part_);
    if (!part.ok()) return part.status();
    artefact_ = *artefact;
    blade_part_ = *part;
    return absl::OkStatus();
  }

  // The kind of fault, or none. Nothing where the plant refused the case before the gate: no program either.
  absl::Status Run(const std::string& fault, int index, BladeRunResult* result) {
    // A machine for each kind of which something is in its record or its mounting, calibrated once.
    const std::string machine = fault == "stale" ? "gate-stale" : "gate-usual";
    simulator::MachineDesign design;
    if (fault == "stale") design.registration_age_h = 0.5 / 3600;
    BladeRunPlan plan = PlanOf(machine, index);
    simulator::Random random(simulator::Random::StreamSeed(plan.seed, 77));
    const double draw = random.Uniform();
    if (fault.empty()) plan.casting_mm = index / 2 % 2 == 0 ? 0 : 0.004;
    if (fault == "foil") plan.foil_mm = 0.03 + 0.1 * draw;
    if (fault == "wrong centre")
      plan.since_calibration = [&](simulator::MachineTruth* truth) {
        truth->axes.b.point_mm += Eigen::Vector3d(0, draw < 0.5 ? 0.025 : -0.06, 0.04 * draw);
      };
    if (fault == "wrong angle")
      plan.since_calibration = [&](simulator::MachineTruth* truth) {
        truth->axes.b.direction = (truth->axes.b.direction + Eigen::Vector3d(0, (1 + draw) * 1e-3, 0)).normalized();
      };
    if (fault == "stale")
      plan.before_correction = [] {
        std::this_thread::sleep_for(std::chrono::seconds(1));
        return absl::OkStatus();
      };
    // A casting seen from one side only, by best fit: what it errs its own points do not show.
    if (fault == "weak" || fault == "one side") {
      const double b_deg = 60.0 * (index % 6);
      plan.poses_deg = {{0, b_deg}, {0, b_deg + (fault == "weak" ? 15 : 45)}};
      plan.method = registration::v1::METHOD_BEST_FIT;
      plan.casting_mm = 0.05 + 0.05 * draw;
    }
    if (fault == "casting") plan.casting_mm = 0.1 + 0.2 * draw;
    if (fault == "held") {
      plan.free = {registration::v1::FREEDOM_SHIFT_X, registration::v1::FREEDOM_SHIFT_Y,
                   registration::v1::FREEDOM_SHIFT_Z};
      plan.method = registration::v1::METHOD_BEST_FIT;
    }
    if (fault == "wrong clamping" || fault == "swapped")
      plan.before_correction = [this, machine, index, &design, other = fault == "swapped", serial = plan.blade_serial] {
        BladeRunPlan next = PlanOf(machine, index + 5000);
        if (!other) next.blade_serial = serial;
        BladeRunResult registered;
        return RunBlade(
            plant_, design, part_, next, [](const std::string&) {}, &registered);
      };
    return RunBlade(
        plant_, design, part_, plan, [](const std::string&) {}, result);
  }

 private:
  BladeRunPlan PlanOf(const std::string& machine, int index) {
    BladeRunPlan plan;
    plan.machine_id = machine;
    plan.blade_serial = "GATE-" + std::to_string(seed_) + "-" + std::to_string(index);
    plan.artefact = artefact_;
    plan.part = blade_part_;
    plan.scan_prefix = machine + "-" + std::to_string(seed_) + "-" + std::to_string(index) + "-";
    plan.seed = simulator::Random::StreamSeed(seed_, static_cast<std::uint64_t>(index));
    plan.mounting_seed = seed_;
    plan.calibrate = !calibrated_[machine];
    calibrated_[machine] = true;
    plan.only_six_point = plan.stop_at_correction = true;
    plan.airfoil_pitch_mm = 0.5;
    plan.threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
    return plan;
  }

  simulator::PlantLink& plant_;
  const std::uint64_t seed_;
  const simulator::DesignedPart part_ = simulator::DesignPart({}, simulator::MachineDesign().centre_mm);
  std::string artefact_, blade_part_;
  std::map<std::string, bool> calibrated_;
};

int Main(const std::string& server, const std::string& identity, int count, std::uint64_t seed) {
  const auto credentials = runtime::ChannelCredentialsOf(identity);
  if (!credentials.ok()) return std::fprintf(stderr, "%s\n", credentials.status().ToString().c_str()), 2;
  auto plant = simulator::PlantLink::Connect(server, *credentials, 60, [](const std::string&) {});
  if (!plant.ok()) return std::fprintf(stderr, "%s\n", plant.status().ToString().c_str()), 2;
  Gate gate(**plant, seed);
  if (absl::Status begun = gate.Begin(); !begun.ok()) return std::fprintf(stderr, "%s\n", begun.ToString().c_str()), 2;
  std::map<std::string, std::pair<int, int>> released;  // of each kind, those released and all
  double worst_um = 0;
  int index = 0;
  for (int i = 0; i < 2 * count; ++i) {
    const std::string fault = i % 2 == 0 ? "" : kFaults[static_cast<std::size_t>(i / 2) % kFaults.size()];
    BladeRunResult result;
    const absl::Status status = gate.Run(fault, ++index, &result);
    // What the plant itself would not take is no fault of the bench's machine: the network, a scan.
    if (!status.ok() && !absl::IsFailedPrecondition(status) && !absl::IsInvalidArgument(status))
      return std::fprintf(stderr, "%s: %s\n", fault.c_str(), status.ToString().c_str()), 2;
    const bool left = status.ok() && result.correction.state() == correction::v1::CORRECTION_STATE_RELEASED;
    auto& of_kind = released[fault];
    of_kind.first += left;
    ++of_kind.second;
    if (left) worst_um = std::max(worst_um, result.correction_error_um);
    std::string why = status.ok() ? "" : std::string(status.message()).substr(0, 100);
    for (const std::string& reason : result.correction.release_reasons()) why += (why.empty() ? "" : "; ") + reason;
    std::printf("%4d %-15s %-8s %8.2f um  %s\n", index, fault.empty() ? "clean" : fault.c_str(),
                left ? "RELEASED" : "waits", result.correction_error_um, why.c_str());
    std::fflush(stdout);
  }
  int faults = 0, wrong = 0;
  for (const auto& [kind, counts] : released) {
    std::printf("%-15s %d of %d released\n", kind.empty() ? "clean" : kind.c_str(), counts.first, counts.second);
    if (kind.empty()) continue;
    wrong += counts.first;
    faults += counts.second;
  }
  std::printf("%s\n", nlohmann::json{{"clean", released[""].second},
                                     {"clean_released", released[""].first},
                                     {"faults", faults},
                                     {"wrong_released", wrong},
                                     {"worst_released_um", worst_um}}
                          .dump()
                          .c_str());
  return 0;
}

}  // namespace
}  // namespace sixpoint::bench

int main(int argc, char** argv) {
  if (argc != 5) return std::fprintf(stderr, "usage: sixpoint-bench-gate SERVER IDENTITY COUNT SEED\n"), 2;
  return sixpoint::bench::Main(argv[1], argv[2], std::atoi(argv[3]), static_cast<std::uint64_t>(std::atoll(argv[4])));
}
