// What is planted in a seeded plant, drawn from one number: pure, so that whoever checks a bench or a page against it can ask again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "storage/database.h"

namespace sixpoint::seed {

struct Options {
  std::uint64_t seed = 1;
  int blade_count = 100000;
  int machine_count = 20;
  int month_count = 12;
};

// Everything that is seeded says so by its name, and by the software that wrote it.
inline constexpr char kSoftwareVersion[] = "0.1.0+seed";
inline constexpr char kNamePrefix[] = "SEED-";
inline constexpr int kPartCount = 4;

struct Hole {
  std::string group, name;
  double start_x_mm = 0, start_y_mm = 0;
};

struct Machine {
  std::string id;
  double drift_um_per_month =
      0;                    // of the scanner against its machine, from a third of the history on; 0: it stands still
  bool is_expired = false;  // its newest calibrations are over
};

enum class Casting { kGood, kThick, kTwisted };

struct Blade {
  std::string serial;
  int machine = 0, part = 0, month = 0;
  storage::Instant scanned_at;
  Casting casting = Casting::kGood;
  double off_um = 0;  // how far the drift since the last calibration moves every hole
};

// What one hole of a blade is found to be.
struct HoleValue {
  bool is_measured = true;
  double position_error_um = 0, position_uncertainty_um = 0;
  double inclination_error_deg = 0, inclination_uncertainty_deg = 0;
};

class Plan {
 public:
  // The history ends now, by the database's clock.
  Plan(const Options& options, storage::Instant now);

  const Options& options() const { return options_; }
  const std::vector<Machine>& machines() const { return machines_; }
  std::string ArtefactId() const { return prefix_ + "A1"; }
  std::string PartId(int part) const { return prefix_ + "P" + std::to_string(part + 1); }
  const std::vector<Hole>& HolesOf(int part) const { return holes_[static_cast<std::size_t>(part)]; }
  storage::Instant MonthBegins(int month) const;
  // What the scanner has drifted by, in um along X, since the history began.
  double DriftedBy(int machine, storage::Instant at) const;

  // In the order of time; the same for the same seed, whoever asks and when.
  Blade BladeOf(int index) const;
  std::vector<HoleValue> ValuesOf(int index, const Blade& blade) const;

  // Sensor calibrations that are withdrawn once the blades are there: machine and month.
  struct Withdrawal {
    int machine = 0, month = 0;
  };
  const std::vector<Withdrawal>& withdrawals() const { return withdrawals_; }
  // Of what rests on a withdrawn one, whether it is judged again.
  bool IsRejudged(int index) const;

 private:
  const Options options_;
  const storage::Instant now_;
  const std::string prefix_;
  std::vector<Machine> machines_;
  std::vector<std::vector<Hole>> holes_;
  std::vector<Withdrawal> withdrawals_;
};

}  // namespace sixpoint::seed
