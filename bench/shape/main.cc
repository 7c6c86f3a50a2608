// sixpoint-bench-shape: random blanks of plant-a's vane that lack up to 0.969 mm of stock at their edges, each reconstructed or proven not to be
// possible, judged by surfaces made anew and by Ipopt on a grid; and how quick it is from a million points. Prints one JSON object.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "bench/goals.h"
#include "bench/shape/blade_blanks.h"
#include "bench/shape/ipopt_peer.h"
#include "bench/shape/judged_shape.h"
#include "bench/shape/machined_blank.h"
#include "metrology/reconstruction/shape_problem.h"

namespace sixpoint::bench {
namespace {

using Eigen::Vector3d;
using metrology::DesignPlaces;
using metrology::Reconstruction;
using metrology::RegionKind;
using metrology::ShapeOutcome;
using nlohmann::json;

constexpr int kThreads = 2;
constexpr double kNoise_mm = 2e-3;  // of a point
constexpr double kPeerLattice_mm = 4, kPeerGrid_mm = 2;
constexpr double kPeerLongest_s = 150;
constexpr double kSmallestSlack_mm = 1e-3;  // that Ipopt tells from none

template <typename Work>
double Seconds(const Work& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// The same programme of a blank's piece by both: the edge that lacks most, where what is possible is decided, on a grid as dense as the lattice allows.
struct PieceAnswers {
  double our_slack_mm = 0, our_s = 0;
  std::optional<PeerAnswer> peer;
  std::size_t controls = 0, rows = 0;
};

// The least slack that all limits need together: firmer until it is none, or firmness takes no more away.
void AskOurselves(const metrology::FreeFormDeformation& still, const std::vector<metrology::DisplacementLimit>& limits,
                  const metrology::ReconstructionOptions& options, PieceAnswers* answers) {
  answers->our_s = Seconds([&] {
    metrology::LatticeSystem system(still.lattice(), still.covered());
    system.AddEnergy(options.stiffness_mm2, options.decay_mm);
    if (!system.Factor()) return;
    answers->controls = static_cast<std::size_t>(system.size());
    metrology::SlackRule rule;
    std::vector<metrology::LimitPush> held;
    for (double firmness = 1e-8; firmness > 1e-13; firmness /= 10) {
      rule.compliance.fill(firmness);
      const auto solved = SolveLimited(system, limits, rule, held, 1, nullptr);
      if (!solved.ok()) return;
      const bool gains = held.empty() || solved->slack_mm[0] < 0.5 * answers->our_slack_mm;
      answers->our_slack_mm = held.empty() ? solved->slack_mm[0] : std::min(answers->our_slack_mm, solved->slack_mm[0]);
      held = solved->pushes;
      if (!gains || solved->slack_mm[0] < kSmallestSlack_mm / 20) return;
    }
  });
}

std::optional<PieceAnswers> AskPeer(const Vane& vane, const BladeCase& blade) {
  DesignPlaces piece = vane.peer;
  piece.places.clear();
  for (const metrology::DesignPlace& place : vane.peer.places)
    if ((place.point_mm.array() > blade.piece_low_mm.array()).all() &&
        (place.point_mm.array() < blade.piece_high_mm.array()).all())
      piece.places.push_back(place);
  std::mt19937_64 none(1);
  const auto blank = testing::Measured(testing::BlankPoints(*vane.surface, piece.places, blade.blank), 0, false, &none);
  metrology::ReconstructionOptions options = BladeOptions();
  options.patch_mm = kPeerGrid_mm;
  const auto region_of = AssignRegions(piece, blade.regions);
  if (!region_of.ok()) return std::nullopt;
  metrology::ShapeProblem problem(piece, blank, blade.regions, *region_of, options);
  problem.LookAt(nullptr);
  const auto lattice = problem.LatticeOf(kPeerLattice_mm);
  const auto still = metrology::FreeFormDeformation::Still(lattice, problem.CoveredOf(lattice));
  auto limits = problem.Limits(*still, 0);
  limits.erase(
      std::remove_if(limits.begin(), limits.end(),
                     [](const auto& limit) { return std::isinf(limit.least_mm) && std::isinf(limit.most_mm); }),
      limits.end());
  PieceAnswers answers;
  for (const auto& limit : limits) answers.rows += std::isfinite(limit.least_mm) + std::isfinite(limit.most_mm);
  AskOurselves(*still, limits, options, &answers);
  answers.peer = SolveByIpopt(*still, limits, options.stiffness_mm2, options.decay_mm, kPeerLongest_s);
  return answers;
}

struct Tally {
  int solved = 0, proven = 0, other = 0, agreed = 0, disagreed = 0, unanswered = 0;
  JudgedShape worst;
  double least_relaxation_mm = 1e9, widest_gap_mm = 0;
  int peer_possible = 0, peer_impossible = 0;
  std::vector<double> blanks_s, ours_s, peers_s;
  int machined = 0, not_machined = 0;
  MachinedRange stiff, first, second;  // of all that were machined
};

void RunMachining(const Vane& vane, const BladeCase& blade, const Reconstruction& made, std::uint64_t seed,
                  Tally* tally) {
  const auto found = MachineBlank(*vane.surface, vane.places, vane.patches, blade, made, seed, kThreads);
  if (!found.ok()) {
    ++tally->not_machined;
    std::printf("; not machined: %s", std::string(found.status().message()).c_str());
    return;
  }
  ++tally->machined;
  tally->stiff.Add(found->stiff);
  tally->first.Add(found->first);
  tally->second.Add(found->second);
  std::printf(
      "; %.2f mm machined at most, the template leaves %.1f um, %.1f to %.1f um left where the mill is stiff; %.1f to "
      "%.1f, then %.1f to %.1f",
      found->most_removed_mm, found->by_template_um, found->stiff.least_um, found->stiff.greatest_um,
      found->first.least_um, found->first.greatest_um, found->second.least_um, found->second.greatest_um);
}

// A piece that is impossible proves the blank to be so; a blank that is possible has pieces that are.
void TellPeer(const std::optional<PieceAnswers>& answers, bool possible, Tally* tally) {
  if (!answers || !answers->peer) {
    ++tally->unanswered;
    std::printf("; Ipopt gave up");
    return;
  }
  const PeerAnswer& peer = *answers->peer;
  const bool alike = std::abs(peer.slack_mm - answers->our_slack_mm) < kSmallestSlack_mm;
  const bool fits = !possible || peer.slack_mm < kSmallestSlack_mm;
  ++(alike && fits ? tally->agreed : tally->disagreed);
  ++(peer.slack_mm < kSmallestSlack_mm ? tally->peer_possible : tally->peer_impossible);
  tally->ours_s.push_back(answers->our_s);
  tally->peers_s.push_back(peer.seconds);
  std::printf("; piece of %zu controls, %zu rows: slack %.2f um in %.2f s, Ipopt %.2f um in %.1f s, %d steps",
              answers->controls, answers->rows, 1e3 * answers->our_slack_mm, answers->our_s, 1e3 * peer.slack_mm,
              peer.seconds, peer.iterations);
}

void RunCase(const Vane& vane, std::uint64_t seed, bool ask_peer, int machined, Tally* tally) {
  const BladeCase blade = RandomCase(*vane.surface, seed);
  std::mt19937_64 random(seed);
  const auto blank = testing::Measured(testing::BlankPoints(*vane.surface, vane.patches.places, blade.blank),
                                       kPatchNoise_mm, seed % 2 == 1, &random);
  absl::StatusOr<Reconstruction> made = absl::InternalError("");
  const double ours_s = Seconds([&] { made = ReconstructShape(vane.places, blank, blade.regions, BladeOptions()); });
  std::printf("%2d: lacks %.3f, band %.3f: ", static_cast<int>(seed), blade.lacking_mm, blade.regions[2].lower_mm);
  if (!made.ok()) {
    ++tally->other;
    std::printf("%s (%.2f s)\n", std::string(made.status().message()).c_str(), ours_s);
    return;
  }
  bool possible = false;
  if (made->outcome == ShapeOutcome::kReconstructed) {
    possible = true;
    ++tally->solved;
    tally->blanks_s.push_back(ours_s);
    const JudgedShape judged = Judge(vane, blade, *made);
    std::printf(
        "solved, %.2f s, %g mm, %d passes, %zu controls; allowance %.2f, between %.2f, band %.2f, fixed %.2f, "
        "step %.2f um (of the truth %.2f), kink %.3f deg",
        ours_s, made->spacing_mm, made->pass_count, made->control_count, 1e3 * judged.allowance_mm,
        1e3 * judged.between_mm, 1e3 * judged.beyond_band_mm, 1e3 * judged.fixed_mm, 1e3 * judged.step_mm,
        1e3 * judged.true_step_mm, judged.kink_rad * 57.29578);
    tally->worst.Take(judged);
    if (tally->machined < machined) RunMachining(vane, blade, *made, seed, tally);
  } else if (made->outcome == ShapeOutcome::kInfeasible) {
    ++tally->proven;
    const auto& proof = *made->proof;
    std::printf("proven, %.2f s, %s%zu places", ours_s, proof.of_any_shape ? "of any shape, " : "",
                proof.conflicts.size());
    {
      const auto& worst = proof.conflicts[0];
      std::printf(" (%s at %.2f %.2f %.2f looking to %.2f %.2f %.2f)", blade.regions[worst.region].name.c_str(),
                  worst.place_mm.x(), worst.place_mm.y(), worst.place_mm.z(), worst.normal.x(), worst.normal.y(),
                  worst.normal.z());
    }
    if (proof.stock) {
      std::printf(", stock %.1f to %.1f um", 1e3 * proof.stock->at_least_mm, 1e3 * proof.stock->at_most_mm);
      tally->least_relaxation_mm = std::min(tally->least_relaxation_mm, proof.stock->at_least_mm);
      tally->widest_gap_mm = std::max(tally->widest_gap_mm, proof.stock->at_most_mm - proof.stock->at_least_mm);
    }
    if (proof.tolerance)
      std::printf(", tolerance %.1f to %.1f um", 1e3 * proof.tolerance->at_least_mm, 1e3 * proof.tolerance->at_most_mm);
  } else {
    ++tally->other;
    std::printf("%s", made->remark.c_str());
  }
  if (ask_peer && made->outcome != ShapeOutcome::kNotDetermined) {
    TellPeer(AskPeer(vane, blade), possible, tally);
  }
  std::printf("\n");
  std::fflush(stdout);
}

// A cloud, evenly over the blank, line by line; with the direction in which its surface looks.
void Cloud(const Vane& vane, const BladeCase& blade, std::size_t count, metrology::Points* points,
           metrology::Points* outward) {
  const auto known = testing::BlankPoints(*vane.surface, vane.judged.places, blade.blank);
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, kNoise_mm);
  std::uniform_real_distribution<double> unit(-0.5, 0.5);
  for (std::size_t i = 0; i < count; ++i) {
    const testing::BlankPoint& about = known[i * known.size() / count];
    const Vector3d one = about.normal.unitOrthogonal(), other = about.normal.cross(one);
    const auto on =
        vane.surface->Closest(about.place_mm + vane.judged.spacing_mm * (unit(random) * one + unit(random) * other));
    points->push_back(blade.blank(on.point_mm, on.normal) + noise(random) * about.outward);
    outward->push_back(about.outward);
  }
}

void FromPoints(const Vane& vane, std::size_t count, json* figures) {
  std::uint64_t seed = 0;
  BladeCase blade = RandomCase(*vane.surface, seed);
  while (blade.lacking_mm < 0.8 || blade.regions[2].lower_mm > -1.2) blade = RandomCase(*vane.surface, ++seed);
  metrology::Points points, outward;
  Cloud(vane, blade, count, &points, &outward);
  vane.surface->PrepareNear(kThreads);
  const auto patches = metrology::SurfacePatches::Make(*vane.surface, BladeOptions().patch_mm);
  std::vector<double> pass_s, gather_s, made_s;
  std::string said = "failed";
  for (int run = 0; run < 3; ++run) {
    std::vector<double> distances_mm;
    pass_s.push_back(Seconds([&] { vane.surface->SignedDistances(points, 1.5, kThreads, &distances_mm); }));
    absl::StatusOr<std::vector<metrology::BlankPatch>> blank = absl::InternalError("");
    gather_s.push_back(Seconds([&] {
      blank = GatherBlank(*vane.surface, *patches, points, outward, {kThreads, 1.5, 8});
    }));
    if (!blank.ok()) return;
    absl::StatusOr<Reconstruction> made = absl::InternalError("");
    made_s.push_back(Seconds([&] { made = ReconstructShape(vane.places, *blank, blade.regions, BladeOptions()); }));
    said = !made.ok()                                      ? std::string(made.status().message())
           : made->outcome == ShapeOutcome::kReconstructed ? "solved"
                                                           : made->remark;
  }
  for (auto* times : {&pass_s, &gather_s, &made_s}) std::sort(times->begin(), times->end());
  const double passes = (gather_s[1] + made_s[1]) / pass_s[1];
  std::printf("%zu points, case %d: %s; distances %.3f s, patches %.3f s, shape %.3f s (medians of 3): %.1f passes\n",
              count, static_cast<int>(seed), said.c_str(), pass_s[1], gather_s[1], made_s[1], passes);
  (*figures)["reconstruct_over_distance_passes"] = passes;
  (*figures)["reconstruct_s"] = gather_s[1] + made_s[1];
  (*figures)["distance_pass_s"] = pass_s[1];
}

double MedianOf(std::vector<double> values) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

std::vector<Goal> Goals() {
  constexpr auto kAlways = Goal::Counts::kAlways;
  constexpr auto kInFull = Goal::Counts::kInFull;
  constexpr auto kNone = std::nullopt;
  return {{"cases", "edge_allowance_min_um", "least stock beyond the allowance, where it was measured, um", -0.5, kNone,
           kAlways},
          {"cases", "edge_allowance_between_min_um", "the same, between its patches, um", -0.5, kNone, kAlways},
          {"cases", "tolerance_exceeded_um", "beyond a profile band, um", kNone, 0, kAlways},
          {"cases", "fixed_moved_um", "fixed surface off the blank, um", kNone, 5, kAlways},
          {"cases", "transition_step_um", "step beside machined regions, of the patches' means, um", kNone, 2, kAlways},
          {"cases", "transition_true_step_um", "the same, of the truth at places of no patch, um", kNone, 2, kAlways},
          {"cases", "transition_kink_deg", "kink there, deg", kNone, 0.1, kAlways},
          {"cases", "neither_solved_nor_proven", "blanks neither solved nor proven", kNone, 0, kAlways},
          {"peer", "peer_disagrees", "blanks of which Ipopt says otherwise", kNone, 0, kAlways},
          {"peer", "times_faster_than_peer", "times faster than Ipopt", 10, kNone, kInFull},
          {"machined", "machined_least_um", "machined by a mill that gives way, after two passes: least, um", -42,
           kNone, kAlways},
          {"machined", "machined_greatest_um", "and greatest above the shape, um", kNone, 72, kAlways},
          {"machined", "machined_stiff_least_um", "by one that does not, after one: least, um", -10, kNone, kAlways},
          {"machined", "machined_stiff_greatest_um", "and greatest, um", kNone, 10, kAlways},
          {"machining", "not_machined", "shapes whose path was refused", kNone, 0, kAlways},
          {"points", "reconstruct_over_distance_passes", "from a million points, in passes of distances", kNone, 20,
           kInFull}};
}

int Main(int argc, char** argv) {
  CLI::App app("Shapes that blanks contain");
  std::string shared = "../shared";
  int blanks = 50, peers = 50, machined = 10, first = 0;
  std::size_t count = 1'000'000;
  app.add_option("--shared", shared);
  app.add_option("--blanks", blanks);
  app.add_option("--first", first);
  app.add_option("--peers", peers, "Of how many of them Ipopt is asked");
  app.add_option("--machined", machined, "How many that were solved are machined and scanned");
  app.add_option("--points", count);
  CLI11_PARSE(app, argc, argv);
  Vane vane;
  vane.surface = LoadVane(shared + "/data/plant-a/cad.step");
  if (vane.surface == nullptr) {
    std::printf("SKIPPED: no plant-a under %s\n{\"bench\": \"shape\", \"figures\": {}}\n", shared.c_str());
    return 0;
  }
  vane.places = *SampleDesign(vane.surface, 0.3, kThreads);
  vane.patches = *SampleDesign(vane.surface, BladeOptions().patch_mm, kThreads);
  vane.judged = *SampleDesign(vane.surface, 0.26, kThreads);
  vane.peer = *SampleDesign(vane.surface, kPeerGrid_mm, kThreads);
  Tally tally;
  for (int i = first; i < first + blanks; ++i)
    RunCase(vane, static_cast<std::uint64_t>(i), i - first < peers, machined, &tally);
  json figures;
  figures["edge_allowance_min_um"] = 1e3 * tally.worst.allowance_mm;
  figures["edge_allowance_between_min_um"] = 1e3 * tally.worst.between_mm;
  figures["tolerance_exceeded_um"] = 1e3 * tally.worst.beyond_band_mm;
  figures["fixed_moved_um"] = 1e3 * tally.worst.fixed_mm;
  figures["transition_true_step_um"] = 1e3 * tally.worst.true_step_mm;
  figures["transition_step_um"] = 1e3 * tally.worst.step_mm;
  figures["transition_kink_deg"] = tally.worst.kink_rad * 57.29578;
  figures["solved"] = tally.solved;
  figures["proven"] = tally.proven;
  figures["neither_solved_nor_proven"] = tally.other;
  figures["peer_agrees"] = tally.agreed;
  figures["peer_disagrees"] = tally.disagreed;
  figures["peer_gave_up"] = tally.unanswered;
  figures["reconstruct_blank_s"] = MedianOf(tally.blanks_s);
  figures["peer_possible"] = tally.peer_possible;
  figures["peer_impossible"] = tally.peer_impossible;
  figures["peer_s"] = MedianOf(tally.peers_s);
  if (!tally.ours_s.empty() && !tally.peers_s.empty())
    figures["times_faster_than_peer"] = MedianOf(tally.peers_s) / MedianOf(tally.ours_s);
  figures["not_machined"] = tally.not_machined;
  if (tally.machined > 0) {
    figures["machined_stiff_least_um"] = tally.stiff.least_um;
    figures["machined_stiff_greatest_um"] = tally.stiff.greatest_um;
    figures["machined_first_least_um"] = tally.first.least_um;
    figures["machined_first_greatest_um"] = tally.first.greatest_um;
    figures["machined_least_um"] = tally.second.least_um;
    figures["machined_greatest_um"] = tally.second.greatest_um;
  }
  if (count > 0) FromPoints(vane, count, &figures);
  GoalRun run;
  run.parts = {"cases", "machining"};
  if (peers > 0) run.parts.push_back("peer");
  if (tally.machined > 0) run.parts.push_back("machined");
  if (count > 0) run.parts.push_back("points");
  run.full = blanks >= 50 && count >= 1'000'000;
  const int missed = PrintGoals(Goals(), run, figures);
  std::printf("%s\n", json({{"bench", "shape"}, {"figures", figures}}).dump().c_str());
  return missed > 0 ? 1 : 0;
}

}  // namespace
}  // namespace sixpoint::bench

int main(int argc, char** argv) { return sixpoint::bench::Main(argc, argv); }
