// sixpoint-bench-foils: the published example in kind (docs/methods/correction.md). A foil of 0.05 to 0.6 mm lies under one corner of the blade's seat;
// the whole way through a running plant: calibrated, scanned, positioned by six points, corrected. Where each corrected hole begins, and where it
// would have begun without correction, by the true axes and the true pose. Prints one JSON object.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>

#include "metrology/frames/angles.h"
#include "services/runtime/credentials.h"
#include "simulator/blade_run.h"
#include "simulator/registry.h"

namespace sixpoint::bench {
namespace {

using namespace simulator;
using Eigen::Vector3d;

constexpr double kFoils_mm[] = {0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6};
constexpr double kHoleDiameter_mm = 0.1;  // the least of the published holes
constexpr double kSeat_mm[2] = {36, 45};  // 0.6 mm under its corner turn the blade by 0.95 and 0.76 deg, as published
constexpr double kShank_mm = 15;          // from the seat to the root
using metrology::kRadPerDeg;

// The corner across from the foil stays where it is.
Eigen::Isometry3d OnFoil(const DesignedPart& part, double foil_mm) {
  const Vector3d root = part.zero_from_part_nominal.translation();
  const Vector3d corner = root + Vector3d(-kShank_mm - kSeat_mm[0], -kSeat_mm[1] / 2, -20);
  return Eigen::Translation3d(corner) * Eigen::AngleAxisd(-std::atan(foil_mm / kSeat_mm[0]), Vector3d::UnitY()) *
         Eigen::AngleAxisd(std::atan(foil_mm / kSeat_mm[1]), Vector3d::UnitX()) * Eigen::Translation3d(-corner) *
         part.zero_from_part_nominal;
}

// How far each hole would be begun from where it is, were the nominal program cut: the least and the greatest.
std::pair<double, double> Uncorrected_um(const DesignedPart& part, const MachineDesign& design,
                                         const Eigen::Isometry3d& zero_from_part) {
  double least = std::numeric_limits<double>::infinity(), greatest = 0;
  for (const DesignedHoleGroup& group : part.hole_groups) {
    const Eigen::Isometry3d machine_from_nominal =
        MachineFromPartNominal(part, design, group.a_nominal_deg, group.b_nominal_deg);
    const Eigen::Isometry3d machine_from_zero = machine_from_nominal * part.zero_from_part_nominal.inverse();
    for (const DesignedHole& hole : group.holes) {
      // Across the drilling direction: deeper or less deep it is the same hole.
      const Vector3d off = machine_from_zero * zero_from_part * hole.start_mm - machine_from_nominal * hole.start_mm;
      least = std::min(least, 1e3 * off.head<2>().norm());
      greatest = std::max(greatest, 1e3 * off.head<2>().norm());
    }
  }
  return {least, greatest};
}

int Fail(const std::string& step, const absl::Status& status) {
  std::fprintf(stderr, "sixpoint-bench-foils: %s: %s\n", step.c_str(), status.ToString().c_str());
  return 2;
}

}  // namespace

int Main(int argc, char** argv) {
  CLI::App app("Foils under a blade");
  std::string server, identity;
  double pitch_mm = 0.2;
  app.add_option("--server", server)->required();
  app.add_option("--identity", identity)->required();
  app.add_option("--pitch-mm", pitch_mm)->check(CLI::Range(0.02, 1.0));
  CLI11_PARSE(app, argc, argv);
  const auto credentials = runtime::ChannelCredentialsOf(identity);
  if (!credentials.ok()) return Fail("certificate", credentials.status());
  const auto link = PlantLink::Connect(server, *credentials, 30, [](const std::string&) {});
  if (!link.ok()) return Fail("connect", link.status());
  const MachineDesign design;
  std::vector<HoleGroupDesign> groups = UsualHoleGroups();
  for (HoleGroupDesign& group : groups) group.diameter_mm = kHoleDiameter_mm;
  const DesignedPart part = DesignPart({}, design.centre_mm, 24, groups);
  const std::string run = std::to_string(::getpid());
  const auto artefact = RegisterArtefact(**link, "foil-plate-" + run, ArtefactGeometry());
  if (!artefact.ok()) return Fail("artefact", artefact.status());
  const auto registered = RegisterPart(**link, "foil-blade-" + run, part);
  if (!registered.ok()) return Fail("part", registered.status());

  double worst_um = 0, least_uncorrected_um = std::numeric_limits<double>::infinity();
  bool released = true;
  std::printf("%8s %8s %8s %16s %16s %14s\n", "foil mm", "A deg", "B deg", "uncorrected um", "to um", "corrected um");
  int number = 0;
  for (const double foil_mm : kFoils_mm) {
    BladeRunPlan plan;
    plan.machine_id = "foil-" + run;
    plan.blade_serial = "FOIL-" + run + "-" + std::to_string(++number);
    plan.artefact = *artefact;
    plan.part = *registered;
    plan.scan_prefix = "foil-" + run + "-" + std::to_string(number) + "-";
    plan.seed = 7100 + static_cast<std::uint64_t>(number);
    plan.mounting_seed = 71;
    plan.calibrate = number == 1;
    plan.airfoil_pitch_mm = pitch_mm;
    plan.only_six_point = true;
    plan.stop_at_correction = true;
    plan.threads = 2;
    plan.zero_from_part = OnFoil(part, foil_mm);
    BladeRunResult result;
    const absl::Status done = RunBlade(
        **link, design, part, plan, [](const std::string&) {}, &result);
    if (!done.ok()) return Fail("foil of " + std::to_string(foil_mm) + " mm", done);
    const auto [least_um, greatest_um] = Uncorrected_um(part, design, *plan.zero_from_part);
    std::printf("%8.2f %8.4f %8.4f %16.1f %16.1f %14.2f\n", foil_mm, std::atan(foil_mm / kSeat_mm[0]) / kRadPerDeg,
                std::atan(foil_mm / kSeat_mm[1]) / kRadPerDeg, least_um, greatest_um, result.correction_error_um);
    worst_um = std::max(worst_um, result.correction_error_um);
    least_uncorrected_um = std::min(least_uncorrected_um, least_um);
    released = released && result.correction.state() == correction::v1::CORRECTION_STATE_RELEASED;
  }
  std::printf("%s\n",
              nlohmann::json{{"foil_worst_error_um", worst_um},
                             {"foil_least_uncorrected_over_radius", least_uncorrected_um / (500 * kHoleDiameter_mm)},
                             {"foil_released", released ? 1 : 0}}
                  .dump()
                  .c_str());
  return 0;
}

}  // namespace sixpoint::bench

int main(int argc, char** argv) { return sixpoint::bench::Main(argc, argv); }
