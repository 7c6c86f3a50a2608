#include "seed/plan.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "simulator/random.h"

namespace sixpoint::seed {
namespace {

using simulator::Random;

// Streams of the seed: what is drawn for one thing says nothing of another.
constexpr std::uint64_t kMachineStream = 1, kBladeStream = 1ull << 32, kHoleStream = 2ull << 32,
                        kRejudgeStream = 3ull << 32;

constexpr std::chrono::hours kMonth{30 * 24};
// One casting in so many is bad; one hole in so many has no pin; one blade in so many of a withdrawn calibration's is judged again.
constexpr int kBadCastingOneIn = 200, kNoPinOneIn = 5000, kRejudgedOneIn = 4;
// Every so manieth machine drifts, and every so manieth was not calibrated lately.
constexpr int kDriftingOneIn = 7, kExpiredOneIn = 10;
// Of a start, along each axis; a thick casting's beyond its tolerance.
constexpr double kStartSigma_um = 6, kThick_um = 75;

std::string Padded(int value, int digits) {
  char text[16];
  std::snprintf(text, sizeof text, "%0*d", digits, value);
  return text;
}

std::uint64_t Below(Random* random, int one_in) { return random->Next() % static_cast<std::uint64_t>(one_in); }

}  // namespace

Plan::Plan(const Options& options, storage::Instant now)
    : options_(options), now_(now), prefix_(kNamePrefix + std::to_string(options.seed) + "-") {
  for (int m = 0; m < options_.machine_count; ++m) {
    Random random(Random::StreamSeed(options_.seed, kMachineStream + static_cast<std::uint64_t>(m)));
    Machine& machine = machines_.emplace_back();
    machine.id = prefix_ + "M" + Padded(m + 1, 3);
    if (m % kDriftingOneIn == 2) machine.drift_um_per_month = random.Uniform(8, 14);
    machine.is_expired = m % kExpiredOneIn == 4;
  }
  for (int part = 0; part < kPartCount; ++part) {
    std::vector<Hole>& holes = holes_.emplace_back();
    for (int g = 0; g < 2; ++g)
      for (int h = 0; h < 2 + part; ++h)
        holes.push_back({"G" + std::to_string(g + 1), "H" + std::to_string(h + 1), 4.0 * h, 30.0 * g - 15});
  }
  // Of machines that do not drift, so that each thing planted is found by its own sign.
  for (int m = 0; m < options_.machine_count && withdrawals_.size() < 3; m += 5)
    withdrawals_.push_back({m, (options_.month_count * (1 + static_cast<int>(withdrawals_.size()))) / 4});
}

storage::Instant Plan::MonthBegins(int month) const { return now_ - kMonth * (options_.month_count - month); }

double Plan::DriftedBy(int machine, storage::Instant at) const {
  const std::chrono::duration<double> since = at - MonthBegins(options_.month_count / 3);
  const double months = since / std::chrono::duration<double>(kMonth);
  return std::max(0.0, months) * machines_[static_cast<std::size_t>(machine)].drift_um_per_month;
}

Blade Plan::BladeOf(int index) const {
  Random random(Random::StreamSeed(options_.seed, kBladeStream + static_cast<std::uint64_t>(index)));
  Blade blade;
  blade.serial = prefix_ + Padded(index, 8);
  blade.machine = static_cast<int>(random.Next() % static_cast<std::uint64_t>(options_.machine_count));
  blade.part = static_cast<int>(random.Next() % kPartCount);
  const double share = (index + random.Uniform()) / options_.blade_count;
  const storage::Instant begin = MonthBegins(0);
  blade.scanned_at = begin + std::chrono::duration_cast<storage::Instant::duration>(share * (now_ - begin));
  blade.month = std::min(options_.month_count - 1, static_cast<int>(share * options_.month_count));
  if (Below(&random, kBadCastingOneIn) == 0)
    blade.casting = random.Next() % 2 == 0 ? Casting::kThick : Casting::kTwisted;
  blade.off_um = DriftedBy(blade.machine, blade.scanned_at) - DriftedBy(blade.machine, MonthBegins(blade.month));
  return blade;
}

std::vector<HoleValue> Plan::ValuesOf(int index, const Blade& blade) const {
  Random random(Random::StreamSeed(options_.seed, kHoleStream + static_cast<std::uint64_t>(index)));
  std::vector<HoleValue> values;
  for (std::size_t i = 0; i < HolesOf(blade.part).size(); ++i) {
    HoleValue& value = values.emplace_back();
    value.is_measured = Below(&random, kNoPinOneIn) != 0;
    const double thick_um = blade.casting == Casting::kThick ? kThick_um : 0;
    value.position_error_um =
        std::hypot(blade.off_um + thick_um + kStartSigma_um * random.Gaussian(), kStartSigma_um * random.Gaussian());
    value.position_uncertainty_um = random.Uniform(8, 10);
    value.inclination_error_deg = std::abs(0.08 * random.Gaussian());
    value.inclination_uncertainty_deg = random.Uniform(0.08, 0.12);
  }
  return values;
}

bool Plan::IsRejudged(int index) const {
  Random random(Random::StreamSeed(options_.seed, kRejudgeStream + static_cast<std::uint64_t>(index)));
  return Below(&random, kRejudgedOneIn) == 0;
}

}  // namespace sixpoint::seed
