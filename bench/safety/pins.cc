// Rows of pins in eight worlds: as they should stand, a casting proud beside them, loose, in holes wider than drawn, with and without
// a statement of their diameter and play, and some of another diameter than stated. What the inspection says of the holes is held
// against where they are.
// usage: sixpoint-bench-pins ROWS SEED, rows of each diameter and pitch in each world. The last line is one JSON object.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tests/metrology/inspection/pin_rows.h"

namespace sixpoint::bench {
namespace {

using metrology::PinRow;
using metrology::PinTally;

struct World {
  std::string name;
  std::function<void(PinRow*)> make;
};

const std::vector<World> kWorlds = {
    {"as they should", [](PinRow*) {}},
    {"proud casting", [](PinRow* row) { row->proud_mm = 0.25; }},
    {"calibrated", [](PinRow* row) { row->calibrated = true; }},
    {"loose", [](PinRow* row) { row->play_share = 0.25; }},
    {"loose, calibrated", [](PinRow* row) { row->play_share = 0.25, row->calibrated = true; }},
    {"wider than drawn", [](PinRow* row) { row->oversize_share = 0.2; }},
    {"the same, calibrated",
     [](PinRow* row) { row->oversize_share = 0.2, row->play_share = 0.02, row->calibrated = true, row->depth_mm = 2; }},
    {"calibrated, some others", [](PinRow* row) { row->calibrated = true, row->stranger_share = 0.2; }}};

absl::StatusOr<PinTally> Measure(const World& world, int rows, std::uint64_t seed) {
  PinTally all;
  for (const double diameter_mm : {0.1, 0.2, 0.3, 0.4, 0.5}) {
    PinTally tally;
    for (const double pitch : {2.0, 2.5, 3.0})
      for (int i = 0; i < rows; ++i) {
        std::mt19937_64 random(seed++);
        PinRow row;
        row.hole_diameter_mm = diameter_mm;
        row.pitch_over_diameter = pitch;
        world.make(&row);
        const metrology::StandingPins standing = metrology::PutPins(row, &random);
        const auto findings = metrology::InspectRow(row, standing, &random);
        if (!findings.ok()) return findings.status();
        tally.Add(metrology::JudgeRow(standing, *findings));
      }
    std::printf("%-24s d %.1f mm: %5d of %5d measured, %5.1f %% within U, %4d others, %d wrong\n", world.name.c_str(),
                diameter_mm, tally.measured, tally.standing, 100.0 * tally.inside / std::max(1, tally.measured),
                tally.strange, tally.wrong);
    std::fflush(stdout);
    all.Add(tally);
  }
  for (std::size_t i = 0; i < all.claims.size() && i < 5; ++i) std::printf("WRONG %s\n", all.claims[i].c_str());
  return all;
}

}  // namespace
}  // namespace sixpoint::bench

int main(int count, char** words) {
  using namespace sixpoint::bench;
  const int rows = count > 1 ? std::atoi(words[1]) : 10;
  const auto seed = static_cast<std::uint64_t>(count > 2 ? std::atoll(words[2]) : 1);
  nlohmann::json counts = {{"standing", 0}, {"measured", 0}, {"wrong", 0}};
  double least_percent = 100;
  for (std::size_t i = 0; i < kWorlds.size(); ++i) {
    const auto tally = Measure(kWorlds[i], rows, 1'000'000 * (seed * kWorlds.size() + i));
    if (!tally.ok()) {
      std::fprintf(stderr, "%s\n", std::string(tally.status().message()).c_str());
      return 2;
    }
    counts["standing"] = counts["standing"].get<int>() + tally->standing;
    counts["measured"] = counts["measured"].get<int>() + tally->measured;
    counts["wrong"] = counts["wrong"].get<int>() + tally->wrong;
    least_percent = std::min(least_percent, 100.0 * tally->measured / std::max(1, tally->standing));
  }
  counts["least_measured_percent"] = least_percent;
  std::printf("%s\n", counts.dump().c_str());
  return 0;
}
