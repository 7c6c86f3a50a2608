#include "metrology/reconstruction/reconstruct_shape.h"

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>

#include "metrology/reconstruction/check_reconstruction.h"
#include "metrology/reconstruction/shape_proof.h"
#include "metrology/reconstruction/shape_words.h"
#include "metrology/reconstruction/stock_cuts.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

constexpr PullWeights kFixedSurface = {1, 0}, kWholeBlank = {1, 1};
constexpr PullWeights kShape = {30, 0};  // beside the cut a slope shows
// From the normals of one round's feet to those of the next: waves are met where they have gone.
constexpr int kFixedRounds = 2, kWholeRounds = 4;
constexpr double kSoftest = 1e-8, kFirmer = 0.1, kFirmest = 0.5e-12;
constexpr double kFarFromKept = 10;  // times the slack that margins cover: no firmness takes so much away
constexpr double kGains = 0.5;       // of the slack: less is left where firmness takes it away
// Free of all limits, fixed surface that is missed by so much more than it may be wants a finer lattice, whatever the limits do.
constexpr double kHopeless = 10;
constexpr int kMostNarrowed = 4, kMostHalves = 3;  // halves: of a way that misses more than where it began
constexpr int kMostLacking = 2;                    // rounds that lack stock between patches, of the quicker way
constexpr double kSlightKink = 2;                  // times what is allowed: more wants a finer lattice
constexpr double kBetter = 0.95;  // of what was lacking: three passes after another that leave more bring no end

// One lattice with what it is asked.
struct Level {
  FreeFormDeformation still;
  LatticeSystem system;
  std::vector<LatticePull> pulls;
};

class Search {
 public:
  Search(const DesignPlaces& design, const std::vector<BlankPatch>& blank, const std::vector<ShapeRegion>& regions,
         std::vector<std::uint8_t> region_of, const ReconstructionOptions& options)
      : regions_(regions), options_(options), problem_(design, blank, regions, std::move(region_of), options) {}

  absl::StatusOr<Reconstruction> Run() {
    problem_.LookAt(nullptr);
    result_.regions = problem_.Findings();
    contradicts_ = !problem_.Contradictions().empty();
    absl::StatusOr<FreeFormDeformation> begun = Slid(kFixedSurface, kFixedRounds, LookFor::kAll);
    if (!begun.ok()) return begun.status();
    begin_ = *std::move(begun);
    problem_.EvenFixed();
    begin_look_ = problem_.look();
    std::vector<double> spacings_mm;
    for (double h = options_.coarsest_spacing_mm; h >= options_.finest_spacing_mm * (1 - 1e-9); h /= 2)
      spacings_mm.push_back(h);
    // What no lattice can do is shown on the finest.
    for (std::size_t k = contradicts_ ? spacings_mm.size() - 1 : 0; k < spacings_mm.size(); ++k) {
      const bool is_last = k + 1 == spacings_mm.size();
      auto level = Prepared(spacings_mm[k]);
      if (!level.ok()) return level.status();
      if (!is_last && IsHopeless(*level)) continue;
      if (is_last && !contradicts_)
        if (absl::Status coarse = CheckCoarseness(*level); !coarse.ok()) return coarse;
      const absl::StatusOr<bool> found = EitherWay(*level, is_last);
      if (!found.ok()) return found.status();
      if (*found) {
        const ShapeTransition transition = problem_.Transition();
        result_.worst_step_mm = transition.step_mm;
        result_.worst_kink_rad = transition.kink_rad;
        if (transition.kink_rad <= options_.kink_rad) return Found();
        if (is_last) return Kinks(transition);
        continue;
      }
      if (is_last && KeepsWhatWasMeasured()) return Found();
      if (is_last && kinked_) return Kinks(*kinked_);
      if (is_last) return NotFound(*level);
    }
    return absl::InternalError("no lattice");
  }

 private:
  // A lattice with what is pulled about the shape that was looked at.
  absl::StatusOr<Level> LevelOf(double spacing_mm, const PullWeights& weights) const {
    const ControlLattice lattice = problem_.LatticeOf(spacing_mm);
    std::vector<std::uint8_t> covered = problem_.CoveredOf(lattice);
    auto still = FreeFormDeformation::Still(lattice, covered);
    if (!still.ok()) return Under("options.", still.status());
    Level level{*std::move(still), LatticeSystem(lattice, std::move(covered)), {}};
    level.system.AddEnergy(options_.stiffness_mm2, options_.decay_mm);
    level.pulls = problem_.Pulls(level.still, weights);
    level.system.AddPulls(level.pulls);
    if (!level.system.Factor()) return absl::InternalError("the lattice's matrix is not positive definite");
    return level;
  }

  // What walls ask for that may slide along themselves, from the shape that was looked at. They say how far they have gone along their normals; how
  // far along themselves is what all of them agree with: a design's waves go with it. Looked at in the end.
  absl::StatusOr<FreeFormDeformation> Slid(const PullWeights& weights, int rounds, LookFor look_for) {
    std::optional<FreeFormDeformation> found;
    ControlDisplacements begin_mm = begin_ ? begin_->controls_mm() : ControlDisplacements();
    for (int round = 0; round < rounds; ++round) {
      const auto level = LevelOf(options_.coarsest_spacing_mm, weights);
      if (!level.ok()) return level.status();
      auto slid = FreeFormDeformation::Make(
          level->still.lattice(), level->system.Slid(level->pulls, begin_mm, options_.threads), level->still.covered());
      if (!slid.ok()) return slid.status();
      found = *std::move(slid);
      begin_mm = found->controls_mm();
      problem_.LookAt(&*found, look_for);
    }
    return *std::move(found);
  }

  // Whether stock is lacking between the patches that all have it; what lacks is a patch then.
  absl::StatusOr<bool> LacksBetween() {
    if (!guessed_) {
      guessed_ = true;
      ShapeLook now = problem_.look();
      problem_.TakeUp(begin_look_);
      const auto blank_as = Slid(kWholeBlank, kWholeRounds, LookFor::kFeet);
      if (!blank_as.ok()) return blank_as.status();
      problem_.GuessBetween(*blank_as);
      problem_.TakeUp(std::move(now));
    }
    return problem_.TakeLacking(*deformation_) > 0;
  }

  absl::StatusOr<Level> Prepared(double spacing_mm) {
    if (result_.level_count > 0) problem_.LookAt(&*begin_);
    absl::StatusOr<Level> level = LevelOf(spacing_mm, kShape);
    if (!level.ok()) return level.status();
    ++result_.level_count;
    result_.spacing_mm = spacing_mm;
    result_.control_count = static_cast<std::size_t>(level->system.size());
    return level;
  }

  bool IsHopeless(const Level& level) const { return FreeMiss_mm(level) > kHopeless * options_.fixed_within_mm; }

  // Of fixed surface, by the shape that no limit holds.
  double FreeMiss_mm(const Level& level) const {
    const auto limits = problem_.Limits(level.still, options_.margin_mm);
    const ControlDisplacements free_mm = level.system.Moved(Eigen::MatrixXd::Zero(level.system.size(), 3));
    return WorstMiss_mm(limits, MissesOf(level.still.lattice(), free_mm, limits, options_.threads), LimitKind::kFixed);
  }

  // Firmer as long as that takes the slack away: what is possible costs bounded pushes. What is not is left as it misses least; its firmest pushes are
  // kept, for they prove most.
  absl::StatusOr<LimitedLattice> Firmly(const Level& level, const std::vector<LimitPush>& held, bool is_last) {
    SlackRule rule;
    const double enough_mm = kFarFromKept * Bearable_mm();
    if (!is_last) rule.enough_mm = enough_mm;
    absl::StatusOr<LimitedLattice> found = absl::InternalError("no firmness");
    std::vector<LimitPush> begin = held;
    for (double firmness = kSoftest; firmness >= kFirmest; firmness *= kFirmer) {
      rule.compliance.fill(firmness);
      auto solved = SolveLimited(level.system, limits_, rule, begin, options_.threads, options_.keep_going);
      if (!solved.ok()) return solved;
      firmest_ = solved->pushes;
      const double slack_mm = solved->slack_mm[0];
      const bool gains = !found.ok() || slack_mm < kGains * found->slack_mm[0];
      if (gains) found = *std::move(solved);
      // What contradicts itself at one place pushes without end.
      if (!gains || contradicts_ || slack_mm <= options_.threshold_mm / 4 || slack_mm > enough_mm) break;
      begin = firmest_;
    }
    return found;
  }

  // By this pass's limits, to first order about the one before, and by what counts on of earlier ones as long as all can be kept.
  absl::StatusOr<LimitedLattice> Pass(const Level& level, const std::vector<LimitPush>& held, bool is_last,
                                      StockCuts* cuts) {
    limits_ = problem_.Limits(level.still, options_.margin_mm);
    const std::size_t own_count = limits_.size();
    cuts->TakeTurned(limits_);
    cuts->AppendTo(&limits_);
    auto solved = Firmly(level, held, is_last);
    limits_.resize(own_count);
    if (solved.ok() && !cuts->empty() && solved->slack_mm[0] > Bearable_mm()) {
      cuts->Clear();
      solved = Firmly(level, held, is_last);
    }
    if (solved.ok()) solved->pushes = cuts->Owned(solved->pushes, own_count);
    return solved;
  }

  // Quickest with all that passes learn kept from the first one on. Where that finds no way, though the first one had a shape: kept once it is needed.
  absl::StatusOr<bool> EitherWay(const Level& level, bool is_last) {
    absl::StatusOr<bool> found = Passes(level, is_last, StockCuts(true));
    if (!found.ok() || *found || contradicts_ || first_.slack_mm[0] > Bearable_mm()) return found;
    problem_.DropGuesses();
    guessed_ = false;
    problem_.LookAt(&*begin_);
    return Passes(level, is_last, StockCuts(false));
  }

  // True where all is kept.
  absl::StatusOr<bool> Passes(const Level& level, bool is_last, StockCuts cuts) {
    const double bearable_mm = Bearable_mm();
    std::vector<LimitPush> held;
    double last_mm = std::numeric_limits<double>::infinity();
    ControlDisplacements last_controls_mm;
    int worse_count = 0, lacking_count = 0;
    for (int pass = 0; pass < options_.most_passes; ++pass) {
      auto solved = Pass(level, held, is_last, &cuts);
      if (!solved.ok()) return solved.status();
      ++result_.pass_count;
      held = solved->pushes;
      if (pass == 0) first_ = *solved, first_.pushes = firmest_;
      const bool is_missed = solved->slack_mm[0] > bearable_mm;
      if (!is_last && is_missed) return false;
      if (absl::Status moved = Move(level, solved->controls_mm); !moved.ok()) return moved;
      pushes_ = held;
      if (misses_.Most() > last_mm)
        cuts.TakeMissed(problem_.Limits(level.still, options_.margin_mm), *deformation_, options_.margin_mm);
      // First order ended before: half of the way has more of what it promised.
      for (int half = 0; half < kMostHalves && pass > 0 && misses_.Most() > last_mm; ++half) {
        const ControlDisplacements half_mm = (last_controls_mm + deformation_->controls_mm()) / 2;
        if (absl::Status moved = Move(level, half_mm); !moved.ok()) return moved;
      }
      last_controls_mm = deformation_->controls_mm();
      const double most_mm = misses_.Most();
      if (most_mm <= options_.threshold_mm) {
        const absl::StatusOr<bool> lacks = LacksBetween();
        if (!lacks.ok()) return lacks;
        if (*lacks && !measured_)
          measured_ = Kept{*deformation_, limits_, pushes_, result_.spacing_mm, result_.control_count};
        if (!*lacks && IsKeptEverywhere() && !(is_last && Narrowed())) return true;
        if (*lacks && cuts.from_start() && ++lacking_count > kMostLacking) return false;
        last_mm = std::numeric_limits<double>::infinity();
        worse_count = 0;
        continue;
      }
      // Of places that contradict themselves no pass makes more.
      if (is_missed && contradicts_) return false;
      worse_count = most_mm > kBetter * last_mm ? worse_count + 1 : 0;
      if (worse_count == 3) return false;
      last_mm = most_mm;
    }
    return false;
  }

  absl::Status Move(const Level& level, ControlDisplacements controls_mm) {
    auto moved = FreeFormDeformation::Make(level.still.lattice(), std::move(controls_mm), level.still.covered());
    if (!moved.ok()) return moved.status();
    deformation_ = *std::move(moved);
    problem_.LookAt(&*deformation_, LookFor::kMissed);
    misses_ = problem_.Misses();
    return absl::OkStatus();
  }

  // Of what was not looked at lately too.
  bool IsKeptEverywhere() {
    problem_.LookAt(&*deformation_);
    misses_ = problem_.Misses();
    return misses_.Most() <= options_.threshold_mm;
  }

  // Slack that margins and the threshold cover.
  double Bearable_mm() const { return options_.margin_mm / 2 + options_.threshold_mm; }

  // On the last lattice: where the transition kinks slightly, more is asked of it.
  bool Narrowed() {
    const ShapeTransition transition = problem_.Transition();
    if (transition.kink_rad > kSlightKink * options_.kink_rad || narrowed_count_ == kMostNarrowed ||
        !problem_.NarrowAtKinks(options_.kink_rad))
      return false;
    ++narrowed_count_;
    kinked_ = transition;
    return true;
  }

  // In bounded work, before any pass: whether the lattice can follow fixed surface at all.
  absl::Status CheckCoarseness(const Level& level) const {
    if (FreeMiss_mm(level) <= options_.fixed_within_mm) return absl::OkStatus();
    const double enough_mm = Bearable_mm();
    const auto coarse = CoarsenessOf(problem_, level.system, problem_.Limits(level.still, 0), enough_mm, options_);
    if (!coarse.ok()) return coarse.status();
    if (!(coarse->missed_mm > enough_mm)) return absl::OkStatus();
    return TooCoarse(RegionMissedText(regions_[coarse->place.region], "at least ", coarse->missed_mm));
  }

  absl::Status Kinks(const ShapeTransition& transition) const { return TooCoarse(KinkText(regions_, transition)); }
  absl::Status TooCoarse(const std::string& what) const { return TooCoarseAt(result_.spacing_mm, what); }

  // Whether a shape that was found keeps all that was measured, though not what was guessed between the patches: a guess forbids no shape, but is told.
  bool KeepsWhatWasMeasured() {
    if (!measured_) return false;
    problem_.DropGuesses();
    problem_.LookAt(&measured_->deformation);
    const ShapeTransition transition = problem_.Transition();
    if (problem_.Misses().Most() > options_.threshold_mm || transition.kink_rad > options_.kink_rad) return false;
    deformation_ = std::move(measured_->deformation);
    limits_ = std::move(measured_->limits);
    pushes_ = std::move(measured_->pushes);
    result_.spacing_mm = measured_->spacing_mm;
    result_.control_count = measured_->control_count;
    result_.worst_step_mm = transition.step_mm;
    result_.worst_kink_rad = transition.kink_rad;
    result_.remark = "all that was measured is kept; between its patches the blank may lack stock";
    return true;
  }

  absl::StatusOr<Reconstruction> Found() {
    result_.regions = problem_.Findings();
    double all = 0;
    for (const LimitPush& push : pushes_) all += push.force;
    for (const LimitPush& push : pushes_) {
      result_.holding.push_back(problem_.PlaceOf(push.limit, push.most, limits_));
      result_.holding.back().share = push.force / all;
    }
    std::stable_sort(result_.holding.begin(), result_.holding.end(),
                     [](const HoldingPlace& one, const HoldingPlace& other) { return one.share > other.share; });
    const std::string unseen = UnseenText(regions_, result_.regions, options_.least_seen_part);
    if (!unseen.empty()) {
      result_.outcome = ShapeOutcome::kNotDetermined;
      result_.remark = unseen;
      return result_;
    }
    result_.outcome = ShapeOutcome::kReconstructed;
    result_.deformation = std::move(deformation_);
    return result_;
  }

  absl::StatusOr<Reconstruction> NotFound(const Level& level) {
    if (deformation_) {
      problem_.LookAt(&*deformation_);
      result_.regions = problem_.Findings();
    }
    const ShapeMisses misses = misses_;
    problem_.DropGuesses();
    problem_.LookAt(nullptr);
    result_.proof = ProveAtPlaces(problem_, level.still);
    if (!result_.proof) problem_.LookAt(&*begin_);
    const std::vector<DisplacementLimit> limits = problem_.Limits(level.still, 0);
    if (!result_.proof) {
      const absl::StatusOr<Coarseness> coarse =
          CoarsenessOf(problem_, level.system, limits, std::numeric_limits<double>::infinity(), options_);
      if (!coarse.ok()) return coarse.status();
      if (coarse->missed_mm > options_.threshold_mm)
        return TooCoarse(RegionMissedText(regions_[coarse->place.region], "", coarse->missed_mm));
      result_.proof = ProveOnLattice(problem_, level.still, limits, first_.pushes);
    }
    if (result_.proof) {
      const absl::Status cured = FindCures(problem_, level.system, limits, options_, &*result_.proof);
      if (!cured.ok()) return cured;
      result_.outcome = ShapeOutcome::kInfeasible;
      result_.remark = result_.proof->of_any_shape
                           ? "the blank does not contain the part within its tolerance, whatever its shape"
                           : "no shape of this lattice is contained within tolerance; a finer one may have one";
      return result_;
    }
    const std::string what = MissedText(regions_, misses);
    // Where no place contradicts itself, cells that are small enough have a shape.
    if (first_.slack_mm[0] > Bearable_mm()) return TooCoarse(what);
    result_.outcome = ShapeOutcome::kNotDetermined;
    result_.remark = "neither a shape nor a proof was found: " + what;
    return result_;
  }

  const std::vector<ShapeRegion>& regions_;
  const ReconstructionOptions& options_;
  ShapeProblem problem_;
  Reconstruction result_;
  std::optional<FreeFormDeformation> begin_;        // what the fixed surface alone asks for, on the coarsest lattice
  ShapeLook begin_look_;                            // beside it
  std::optional<FreeFormDeformation> deformation_;  // of the last pass
  std::vector<DisplacementLimit> limits_;
  struct Kept {
    FreeFormDeformation deformation;
    std::vector<DisplacementLimit> limits;
    std::vector<LimitPush> pushes;
    double spacing_mm;
    std::size_t control_count;
  };
  std::optional<Kept> measured_;           // by what was measured alone
  std::optional<ShapeTransition> kinked_;  // before it was asked for more
  int narrowed_count_ = 0;
  bool guessed_ = false, contradicts_ = false;  // how the blank stands between its patches; at single places
  LimitedLattice first_;
  std::vector<LimitPush> pushes_, firmest_;
  ShapeMisses misses_;
};

}  // namespace

absl::StatusOr<Reconstruction> ReconstructShape(const DesignPlaces& design, const std::vector<BlankPatch>& blank,
                                                const std::vector<ShapeRegion>& regions,
                                                const ReconstructionOptions& options) {
  Refusals refusals;
  refusals.Add(CheckRegions(regions)).Add(CheckOptions(options)).Add(CheckBlank(blank));
  if (design.surface == nullptr || design.places.empty()) refusals.Add(Refuse("design", "no place", "SampleDesign's"));
  if (!refusals.status().ok()) return refusals.status();
  auto region_of = AssignRegions(design, regions);
  if (!region_of.ok()) return region_of.status();
  return Search(design, blank, regions, *std::move(region_of), options).Run();
}

}  // namespace sixpoint::metrology
