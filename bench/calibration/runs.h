// The parts of `bench/run calibration`. Each prints its tables and hands back its figures.
#pragma once

#include <absl/status/status.h>

#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/calibration/error_statistics.h"

namespace sixpoint::bench {

inline constexpr double kTouchNoise_um = 1;  // of an artefact that the simulator touches

struct RunOptions {
  int seeds = 400;        // a bias shows to 0.05 of a standard deviation
  int fast_seeds = 1000;  // of the probe, whose run takes less than a millisecond
  bool dense = true;      // scans of 600,000 points; else of an eighth
  int threads = 2;
  std::string plant;  // folder of plant-a
};

struct Figures {
  std::vector<ErrorStatistics> kinds;  // what is pooled over all kinds of calibration
  nlohmann::json values = nlohmann::json::object();
  // The same calibration alone and beside others, or on one and on more threads.
  int compared = 0, with_same_bits = 0;
  void Compare(bool same_bits) {
    ++compared;
    with_same_bits += same_bits;
  }
};

// Ends the run, which means nothing without it.
[[noreturn]] inline void Stop(const std::string& why) {
  std::fprintf(stderr, "bench/run calibration: %s\n", why.c_str());
  std::exit(1);
}
[[noreturn]] inline void Stop(const absl::Status& status) { Stop(std::string(status.message())); }

void RunSensor(const RunOptions& options, Figures* figures);
void RunExtraction(const RunOptions& options, Figures* figures);
void RunAxes(const RunOptions& options, Figures* figures);
void RunProbe(const RunOptions& options, Figures* figures);
void RunCharacterisation(const RunOptions& options, Figures* figures);
void RunPlantA(const RunOptions& options, Figures* figures);

}  // namespace sixpoint::bench
