// The parts of `bench/run registration`. Each prints its table and hands back its figures.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "bench/registration/our_fit.h"

namespace sixpoint::bench {

constexpr double kNoiseMm = 2e-3;
constexpr double kTipNormal = 0.9;  // along the span: greater ones are the tip's

struct RunOptions {
  int seeds = 10;
  int noise_draws = 200;
  // Of the parts over many seeds; --share times as many.
  int disagreement_draws = 60;  // on true blades
  int power_draws = 12;         // of each shape error
  int trap_draws = 50;
  int coarse_draws = 30;
  int weakness_draws = 10;
  int overlap_draws = 20;
  int allowance_draws = 50;
  std::size_t points = 1'000'000;
  std::size_t memory_points = 10'000'000;
  int threads = 2;
  bool full_peers = false;  // peers get every point of every case, not of C alone
  std::string shared;       // folder of the cases' generator; may be absent
};

struct Figures {
  nlohmann::json values = nlohmann::json::object();
  int failures = 0;  // what makes the figures void: a check that failed, a fit that did not converge
};

void RunGenerator(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);
void RunCases(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);
void RunThreads(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);
void RunNoise(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);
void RunDistances(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);
void RunMemory(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);
void RunDisagreement(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);
void RunTrap(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);
void RunCoarse(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);
void RunWeakness(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);
void RunOverlap(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);
void RunAllowance(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);
void RunPeers(const PreparedBlade& prepared, const RunOptions& options, Figures* figures);

}  // namespace sixpoint::bench
