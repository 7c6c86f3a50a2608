#include "simulator/demo.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "services/runtime/call_scope.h"
#include "services/runtime/credentials.h"
#include "services/runtime/trace.h"
#include "simulator/blade_run.h"
#include "simulator/fixture.h"
#include "simulator/living_fleet.h"
#include "simulator/registry.h"
#include "simulator/report.h"

namespace sixpoint::simulator {
namespace {

constexpr double kPatience_s = 60;     // how long a service may be away
constexpr double kProfilesPerS = 300;  // of the scanner (CONF 3.2)

class Progress {
 public:
  void Say(const std::string& text) {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    const std::lock_guard<std::mutex> lock(mutex_);
    std::printf("[%6.1f s] %s\n", seconds, text.c_str());
    std::fflush(stdout);
  }
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

 private:
  const std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  std::mutex mutex_;
};

std::atomic<bool> signalled{false};

// Until a signal; the same run's machines and part go on.
void GoOnWorking(PlantLink& plant, const MachineDesign& design, const DesignedPart& part,
                 std::vector<BladeRunPlan> plans, double pace_s, const std::function<void(const std::string&)>& say) {
  constexpr std::uint64_t kMounting = 0;  // the first of a run's streams (blade_run.cc)
  for (BladeRunPlan& plan : plans) plan.mounting_seed = Random::StreamSeed(plan.seed, kMounting);
  for (const int number : {SIGINT, SIGTERM}) std::signal(number, [](int) { signalled = true; });
  LivingFleetOptions options;
  options.pace_s = pace_s;
  options.standstill_s = 7 * pace_s;
  KeepWorking(
      plant, design, part, plans, options, [] { return signalled.load(); }, say);
}

// Unlike any earlier run's: blades and scans of every run are new.
std::string RunName() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y%m%dT%H%M%S", &utc);
  return text + ("-" + NewRequestId().substr(0, 4));
}

}  // namespace

int RunDemo(const DemoOptions& options) {
  Progress progress;
  const auto say = [&progress](const std::string& text) { progress.Say(text); };
  const auto fail = [](const std::string& step, const absl::Status& status) {
    std::fprintf(stderr, "demo: %s: %s\n", step.c_str(), status.ToString().c_str());
    return 1;
  };
  const std::string run = RunName();
  const MachineDesign design;
  DesignedPart part = DesignPart({}, design.centre_mm);
  if (!options.station.empty()) part.stations = UsualStations(part);
  say("run " + run + ": " + std::to_string(options.machines) + " machines, plant at " + options.server);
  const auto credentials = runtime::ChannelCredentialsOf(options.identity);
  if (!credentials.ok()) return fail("certificate", credentials.status());
  auto link = PlantLink::Connect(options.server, *credentials, kPatience_s, say);
  if (!link.ok()) return fail("connect to " + options.server, link.status());
  PlantLink& plant = **link;
  auto artefact = RegisterArtefact(plant, "sim-plate", ArtefactGeometry());
  if (!artefact.ok()) return fail("register the artefact", artefact.status());
  auto blade_part = RegisterPart(plant, part.stations.empty() ? "sim-blade" : "sim-blade-in-fixture", part);
  if (!blade_part.ok()) return fail("register the part", blade_part.status());
  say("registered " + *artefact + " and " + *blade_part + " (" + std::to_string(part.mesh.triangles.size()) +
      " triangles)");

  const auto count = static_cast<std::size_t>(options.machines);
  std::vector<BladeRunPlan> plans(count);
  std::vector<BladeRunResult> results(count);
  std::vector<absl::Status> statuses(count);
  std::vector<std::thread> machines;
  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  for (std::size_t i = 0; i < count; ++i) {
    BladeRunPlan& plan = plans[i];
    plan.machine_id = "sim-" + std::to_string(i + 1);
    plan.blade_serial = "SIM-" + run + "-" + std::to_string(i + 1);
    plan.artefact = *artefact;
    plan.part = *blade_part;
    plan.station = options.station;
    plan.scan_prefix = plan.machine_id + "-" + run + "-";
    plan.seed = Random::StreamSeed(options.seed, i);
    plan.airfoil_pitch_mm = options.airfoil_pitch_mm;
    plan.pins_pitch_mm = options.pins_pitch_mm;
    plan.casting_mm = options.casting_mm;
    plan.by_plan = options.by_plan;
    plan.profiles_per_s = options.line_rate ? kProfilesPerS : 0;
    plan.threads = std::max(1, cores / options.machines);
    machines.emplace_back([&, i] {
      const runtime::CallScope trace(std::make_shared<runtime::CallFacts>(runtime::NewTraceparent()));
      statuses[i] = RunBlade(plant, design, part, plans[i], say, &results[i]);
      if (!statuses[i].ok()) say(plans[i].machine_id + "  stopped: " + statuses[i].ToString());
    });
  }
  for (std::thread& machine : machines) machine.join();

  bool good = true;
  nlohmann::json report{{"run", run}, {"seed", options.seed}, {"software_version", plant.software_version()}};
  std::printf("\n");
  for (std::size_t i = 0; i < count; ++i) {
    results[i].machine = "machines/" + plans[i].machine_id;
    results[i].blade = "blades/" + plans[i].blade_serial;
    good = good && statuses[i].ok() && Shortfall(results[i]).empty();
    report["machines"].push_back(ToJson(results[i], statuses[i]));
    if (results[i].correction.groups_size() > 0) std::printf("%s\n", CorrectionTable(results[i]).c_str());
    if (!results[i].holes.empty()) std::printf("%s\n", HoleTable(results[i]).c_str());
  }
  report["ok"] = good;
  report["seconds"] = progress.seconds();
  std::printf("%s\n%s in %.1f s (limits against the truth: pose %g um, holes %g um)\n",
              SummaryTable(results, statuses).c_str(), good ? "All machines did their job" : "NOT DONE",
              progress.seconds(), kPoseLimit_um, kHoleLimit_um);
  std::fflush(stdout);
  if (!options.report_file.empty()) {
    std::ofstream file(options.report_file);
    file << report.dump(2) << '\n';
    if (!file.flush()) return fail("write " + options.report_file, absl::UnknownError("the file cannot be written"));
  }
  if (good && options.keep_working) GoOnWorking(plant, design, part, plans, options.pace_s, say);
  return good ? 0 : 1;
}

}  // namespace sixpoint::simulator
