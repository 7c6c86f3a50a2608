// `bench/run inspection --pins`: what is stated of holes against where they are, in the model's world and in harsher ones. The last line is
// one JSON object.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/goals.h"
#include "tests/metrology/inspection/hole_worlds.h"

namespace sixpoint::bench {
namespace {

using namespace metrology;

constexpr int kSeeds = 1000;

std::vector<Goal> Goals() {
  constexpr auto kInFull = Goal::Counts::kInFull;
  constexpr auto kNone = std::nullopt;
  return {
      {"pins", "model_low_percent", "model's world: least share of a value's 95 % intervals that hold, %", 93, kNone,
       kInFull},
      {"pins", "model_unmeasured_percent", "model's world: holes not measured, %", kNone, 0, Goal::Counts::kAlways},
      {"pins", "model_u_over_rms_high", "model's world, tight: greatest U over root mean square error", kNone, 4,
       kInFull},
      {"pins", "pitch_u_over_independent", "model's world: U of a pitch over that of independent holes", kNone, 0.2,
       kInFull},
      {"pins", "harsh_low_percent", "harsh worlds: least share of a value's 95 % intervals that hold, %", 80, kNone,
       kInFull},
  };
}

std::vector<HoleWorld> ModelWorlds() {
  HoleWorld tight{"tight pins"}, loose{"loose pins"}, bores{"bores"};
  loose.play_mm = 0.02;
  bores.bores = true;
  return {tight, loose, bores};
}

std::vector<HoleWorld> HarshWorlds() {
  HoleWorld pins{"harsh pins"};
  pins.outliers = 0.03;
  pins.heavy_mm = 6e-3;
  pins.chips = true;
  pins.casting_mm = 0.2;
  pins.pitch_mm = 1.1;
  pins.waver_mm = 2e-3;
  HoleWorld one_side = pins;
  one_side.name = "harsh, half round";
  one_side.one_side = true;
  HoleWorld bent{"bent pins"};
  bent.bend_mm = 0.01;
  HoleWorld bores{"harsh bores"};
  bores.bores = true;
  bores.outliers = 0.03;
  bores.heavy_mm = 6e-3;
  bores.chips = true;
  bores.waver_mm = 3e-3;
  HoleWorld floors = bores;
  floors.name = "bores to floors";
  floors.floor = true;
  return {pins, one_side, bent, bores, floors};
}

struct Summary {
  double low_percent = 100, ratio_high = 0, unmeasured_percent = 0;
};
Summary Print(const HoleWorld& world, const WorldTally& tally) {
  std::printf("\n%s: %d of %d holes measured\n%-20s %6s %8s %10s %10s %8s\n", world.name.c_str(), tally.measured,
              tally.holes, "(um, mrad, 1e-3)", "n", "held %", "rms", "U", "U / rms");
  Summary summary;
  for (const auto& [name, value] : tally.values) {
    const double ratio = value.rms() > 0 ? value.expanded() / value.rms() : 0;
    std::printf("%-20s %6d %8.1f %10.3f %10.3f %8.2f\n", name.c_str(), value.count, value.held_percent(),
                1e3 * value.rms(), 1e3 * value.expanded(), ratio);
    summary.low_percent = std::min(summary.low_percent, value.held_percent());
    summary.ratio_high = std::max(summary.ratio_high, ratio);
  }
  if (!tally.why.empty()) std::printf("last not measured: %s\n", tally.why.c_str());
  std::fflush(stdout);
  summary.unmeasured_percent = 100.0 * (tally.holes - tally.measured) / std::max(1, tally.holes);
  return summary;
}

int Run(int seeds) {
  nlohmann::json figures = nlohmann::json::object();
  double model_low = 100, model_unmeasured = 0, harsh_low = 100, harsh_unmeasured = 0;
  for (const HoleWorld& world : ModelWorlds()) {
    const WorldTally tally = RunHoleWorld(world, seeds);
    const Summary summary = Print(world, tally);
    model_low = std::min(model_low, summary.low_percent);
    model_unmeasured = std::max(model_unmeasured, summary.unmeasured_percent);
    if (world.bores || world.play_mm > 0) continue;
    figures["model_u_over_rms_high"] = summary.ratio_high;
    figures["pitch_u_over_independent"] = tally.values.at("pitch").expanded() / tally.independent_pitch.expanded();
  }
  for (const HoleWorld& world : HarshWorlds()) {
    const Summary summary = Print(world, RunHoleWorld(world, seeds));
    harsh_low = std::min(harsh_low, summary.low_percent);
    harsh_unmeasured = std::max(harsh_unmeasured, summary.unmeasured_percent);
  }
  figures["model_low_percent"] = model_low;
  figures["model_unmeasured_percent"] = model_unmeasured;
  figures["harsh_low_percent"] = harsh_low;
  figures["harsh_unmeasured_percent"] = harsh_unmeasured;
  const int missed = PrintGoals(Goals(), {{"pins"}, seeds >= kSeeds, true}, figures);
  figures["missed"] = missed;
  std::printf("%s\n", nlohmann::json({{"bench", "inspection"}, {"figures", figures}}).dump().c_str());
  return missed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace sixpoint::bench

int main(int argc, char** argv) {
  int seeds = sixpoint::bench::kSeeds;
  const bool asked = argc == 3 && std::strcmp(argv[1], "--seeds") == 0;
  if (asked) seeds = std::atoi(argv[2]);
  if ((argc != 1 && !asked) || seeds < 1) {
    std::fprintf(stderr, "usage: bench/run inspection --pins [--seeds N]\n");
    return 2;
  }
  return sixpoint::bench::Run(seeds);
}
