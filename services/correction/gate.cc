#include "services/correction/gate.h"

#include <algorithm>
#include <chrono>

#include "metrology/correction/keep_out.h"
#include "metrology/correction/tool_cylinder.h"
#include "services/correction/model.h"
#include "services/runtime/time_proto.h"

namespace sixpoint::correction {
namespace {

using metrology::GateCheck;
using metrology::GateCheckKind;

// Best fit is what the others are compared with; local by scans of the region alone has no best fit beside it.
bool CanDisagree(const registration::v1::Registration& registration) {
  switch (registration.method()) {
    case registration::v1::METHOD_SIX_POINT:
    case registration::v1::METHOD_SIX_POINT_NORMALS:
      return true;
    default:
      return registration.evidence().has_disagreement();
  }
}

// Directions that were not fitted and of which nobody said how far off they may be.
int HeldWithoutUncertainty(const registration::v1::FitOptions& options) {
  if (options.degrees_of_freedom().empty()) return 0;
  int held = 0;
  for (int direction = registration::v1::FREEDOM_TURN_X; direction <= registration::v1::FREEDOM_SHIFT_Z; ++direction) {
    const auto& free = options.degrees_of_freedom();
    const bool is_free = std::find(free.begin(), free.end(), direction) != free.end();
    const bool is_stated = direction <= registration::v1::FREEDOM_TURN_Z
                               ? options.has_held_turn_standard_uncertainty_deg()
                               : options.has_held_shift_standard_uncertainty_um();
    held += is_free || is_stated ? 0 : 1;
  }
  return held;
}

metrology::RegistrationEvidence EvidenceOf(const registration::v1::Registration& registration,
                                           std::chrono::system_clock::time_point now) {
  const registration::v1::Evidence& in = registration.evidence();
  metrology::RegistrationEvidence out;
  out.has_disagreement = CanDisagree(registration);
  if (in.has_disagreement()) out.disagreement = in.disagreement().ratio();
  // Scans that share no surface say nothing of the calibrations that put them together.
  if (in.has_merge() && in.merge().freedom() > 0) out.merge_chi_squared = in.merge().chi_squared();
  out.merge_limit = in.merge().limit();
  if (in.condition_number() > 0) out.condition_number = in.condition_number();  // 0: not determined
  if (in.has_information_kept()) out.information_kept = in.information_kept();
  out.held_directions = HeldWithoutUncertainty(registration.options());
  out.age_h =
      std::chrono::duration<double, std::ratio<3600>>(now - runtime::MomentOf(registration.recorded_at())).count();
  return out;
}

}  // namespace

absl::StatusOr<std::vector<GateCheck>> Judge(const Inputs& inputs, const Corrected& corrected,
                                             const ReadProgram& program, const std::function<bool()>& keep_going) {
  // What is asked of a hole is asked of each pose of a path.
  std::vector<metrology::NominalHoleGroup> nominal = inputs.groups, approached = inputs.groups;
  std::vector<metrology::CorrectedHoleGroup> judged = corrected.groups;
  for (std::size_t i = 0; i < inputs.paths.size(); ++i) {
    for (auto& pose : NominalPosesOf(inputs.paths[i].nominal)) nominal.push_back(std::move(pose));
    for (auto& pose : CorrectedPosesOf(corrected.paths[i].path)) judged.push_back(std::move(pose));
    for (auto& pose : EndsOf(inputs.paths[i].nominal)) approached.push_back(std::move(pose));
  }
  std::vector<GateCheck> checks = metrology::JudgeHoles(nominal, judged, inputs.limits, inputs.machine_axes.letters);
  for (GateCheck& check : metrology::JudgeRegistration(EvidenceOf(inputs.registration, inputs.now), inputs.limits))
    checks.push_back(std::move(check));
  checks.push_back(metrology::CountAgainst(GateCheckKind::kClamping, inputs.against_clamping));
  if (!inputs.travel.empty())
    checks.push_back(metrology::CheckTravel(judged, program.moves, inputs.travel, program.tip_below_mm));
  if (inputs.surface != nullptr) {
    if (!program.moves.empty()) {
      const metrology::PlacedPart part{*inputs.surface, inputs.pose->zero_from_part, inputs.rotation.axes};
      absl::StatusOr<GateCheck> keep_out =
          metrology::CheckKeepOut(program.moves, program.targets, part, inputs.limits.keep_out_mm, keep_going);
      if (!keep_out.ok()) return keep_out.status();
      checks.push_back(*std::move(keep_out));
    }
    absl::StatusOr<GateCheck> sight =
        metrology::CheckLinesOfSight(approached, *inputs.surface, inputs.limits.keep_out_mm, keep_going);
    if (!sight.ok()) return sight.status();
    checks.push_back(*std::move(sight));
  }
  checks.push_back(metrology::CountAgainst(GateCheckKind::kCutBefore, inputs.cut_before));
  std::vector<std::string> asked;
  if (inputs.registration.sensor_calibration_asked()) asked.push_back(inputs.registration.sensor_calibration());
  checks.push_back(metrology::CountAgainst(GateCheckKind::kSensorCalibration, asked));
  if (inputs.limits.interim_check_mm > 0) {
    std::vector<std::string> missing;
    if (!inputs.checked_in_clamping) {
      const std::string& clamping = inputs.registration.clamping();
      missing.push_back(clamping.empty() ? "a clamping that is not stated" : "clamping " + clamping);
    }
    checks.push_back(metrology::CountAgainst(GateCheckKind::kInterimCheck, missing));
  }
  // Asked only where there is an answer: a blade is no scrap before somebody says so, and a part may have no machining models.
  for (const auto& [kind, against] : {std::pair(GateCheckKind::kScrapped, &inputs.scrapped_by),
                                      std::pair(GateCheckKind::kModelNotNamed, &inputs.models_not_named)}) {
    const auto& then = inputs.checks_of_then;
    const auto is_of_kind = [kind = kind](const GateCheck& of_then) { return of_then.kind == kind; };
    if (!against->empty() || std::any_of(then.begin(), then.end(), is_of_kind))
      checks.push_back(metrology::CountAgainst(kind, *against));
  }
  if (inputs.model.has_value() && inputs.surface != nullptr) {
    GateCheck cylinder{GateCheckKind::kToolCylinder, "", std::nullopt, inputs.limits.keep_out_mm, 0};
    if (!inputs.groups.empty()) {
      absl::StatusOr<GateCheck> of_holes = metrology::CheckToolCylinders(
          ToolsOf(inputs.electrodes, inputs.groups), *inputs.surface, inputs.limits.keep_out_mm, keep_going);
      if (!of_holes.ok()) return of_holes.status();
      cylinder = *std::move(of_holes);
    }
    if (absl::Status looked = LookAtPaths(inputs, corrected.paths, keep_going, &cylinder); !looked.ok()) return looked;
    checks.push_back(std::move(cylinder));
  }
  std::vector<std::pair<std::string, double>> gouge_um;
  for (const ModelPath& path : inputs.paths)
    if (path.adaptation.has_value()) gouge_um.emplace_back(path.nominal.name, path.adaptation->gouge_um);
  if (!gouge_um.empty()) checks.push_back(metrology::JudgeShapeGouge(gouge_um));
  for (GateCheck& check : checks)
    for (const GateCheck& of_then : inputs.checks_of_then)
      if (of_then.kind == check.kind) check = of_then;
  return checks;
}

}  // namespace sixpoint::correction
