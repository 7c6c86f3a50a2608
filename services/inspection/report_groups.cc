#include "services/inspection/report_groups.h"

#include <algorithm>
#include <utility>

#include "services/inspection/profile_ends.h"
#include "services/inspection/report_words.h"
#include "services/inspection/stored_verdict.h"

namespace sixpoint::inspection {
namespace {

using report::Verdict;

void Add(const std::string& name, const std::string& fit_state, const std::string& rule,
         report::Characteristic characteristic, CharacteristicGroups* groups) {
  auto group = std::find_if(groups->begin(), groups->end(), [&](const report::CharacteristicGroup& one) {
    return one.name == name && one.fit_state == fit_state && one.rule == rule;
  });
  if (group == groups->end()) group = groups->insert(groups->end(), {name, fit_state, {}, rule});
  group->characteristics.push_back(std::move(characteristic));
}

// Of what is not measured no number is told, whatever was seen of it.
void SetValue(bool has_value, double value, bool has_uncertainty, double expanded_uncertainty,
              report::Characteristic* out) {
  if (!has_value || (out->judged && out->verdict == Verdict::kNotMeasured)) return;
  out->value = value;
  if (has_uncertainty) out->expanded_uncertainty = expanded_uncertainty;
}

report::Characteristic PositionOf(const v1::HoleResult& hole, const std::string& name) {
  report::Characteristic position;
  position.id = name + "/position";
  position.unit = "mm";
  position.nominal = 0;
  position.upper = hole.position_tolerance_mm();
  position.verdict = FileVerdictOf(hole.position_verdict());
  position.reason = hole.reason();
  SetValue(hole.has_position_error_mm(), hole.position_error_mm(), hole.has_position_expanded_uncertainty_um(),
           hole.position_expanded_uncertainty_um() / 1e3, &position);
  return position;
}

report::Characteristic InclinationOf(const v1::HoleResult& hole, const std::string& name) {
  report::Characteristic inclination;
  inclination.id = name + "/inclination";
  inclination.unit = "deg";
  inclination.nominal = 0;
  inclination.upper = hole.inclination_tolerance_deg();
  inclination.verdict = FileVerdictOf(hole.inclination_verdict());
  inclination.reason = hole.reason();
  SetValue(hole.has_inclination_error_deg(), hole.inclination_error_deg(),
           hole.has_inclination_expanded_uncertainty_deg(), hole.inclination_expanded_uncertainty_deg(), &inclination);
  return inclination;
}

report::Characteristic DiameterOf(const v1::HoleResult& hole, const std::string& name) {
  report::Characteristic diameter;
  diameter.id = name + "/diameter";
  diameter.unit = "mm";
  diameter.judged = false;
  diameter.reason = hole.diameter_reason();
  SetValue(hole.has_diameter(), hole.diameter().diameter_mm(), true, hole.diameter().expanded_uncertainty_um() / 1e3,
           &diameter);
  return diameter;
}

report::Characteristic PitchOf(const v1::HolePitch& of) {
  report::Characteristic pitch;
  pitch.id = of.group() + "/" + of.from() + " to " + of.to();
  pitch.unit = "mm";
  pitch.judged = false;
  pitch.nominal = of.nominal_pitch_mm();
  pitch.reason = of.reason();
  SetValue(of.has_pitch_mm(), of.pitch_mm(), of.has_expanded_uncertainty_um(), of.expanded_uncertainty_um() / 1e3,
           &pitch);
  return pitch;
}

report::Characteristic ProfileOf(const v1::ProfileFinding& finding) {
  const v1::ProfileTolerance& tolerance = finding.tolerance();
  report::Characteristic profile;
  profile.id = tolerance.characteristic();
  profile.requirement = std::string(tolerance.zone() == v1::PROFILE_ZONE_FORM ? "form of " : "form and location of ") +
                        (tolerance.region().empty() ? "the surface" : tolerance.region());
  profile.unit = "mm";
  profile.nominal = 0;
  profile.lower = tolerance.lower_mm();
  profile.upper = tolerance.upper_mm();
  profile.verdict = FileVerdictOf(finding.verdict());
  profile.reason = finding.reason();
  const bool is_high = UpperEndIsWorse({tolerance.lower_mm(), tolerance.upper_mm()}, finding.lowest().mean_um() / 1e3,
                                       finding.highest().mean_um() / 1e3);
  const v1::PatchDeviation& worst = is_high ? finding.highest() : finding.lowest();
  SetValue(finding.has_lowest() && finding.has_highest(), worst.mean_um() / 1e3, true,
           worst.expanded_uncertainty_um() / 1e3, &profile);
  return profile;
}

std::string PlaceOf(const plant::v1::Characteristic& drawn) {
  if (!drawn.hole_group().empty()) return "Holes " + drawn.hole_group();
  if (!drawn.section().empty()) return "Section " + drawn.section();
  if (!drawn.region().empty()) return "Region " + drawn.region();
  return "Surface";
}

// An instrument by its name; a result of ours by how the part was positioned there.
std::string SourceOf(const v1::OtherValue& other, const std::vector<v1::Measurement>& measurements) {
  for (const v1::Measurement& measurement : measurements)
    if (measurement.name() == other.result()) return NameOf(measurement.instrument());
  const std::string state = FitStateOf(other.method());
  return state.empty() ? other.result() : "after " + state + ", " + other.result();
}

report::Characteristic WithOthers(report::Characteristic characteristic, const v1::CharacteristicFinding& finding,
                                  const std::vector<v1::Measurement>& measurements) {
  for (const v1::OtherValue& of : finding.others()) {
    report::OtherValue& other = characteristic.others.emplace_back();
    other.source = SourceOf(of, measurements);
    other.value = of.value();
    if (of.has_expanded_uncertainty()) other.expanded_uncertainty = of.expanded_uncertainty();
  }
  return characteristic;
}

}  // namespace

void AddGroupsOf(const v1::Inspection& inspection, CharacteristicGroups* groups) {
  const std::string state = FitStateOf(inspection.positioning().method());
  for (const v1::HoleResult& hole : inspection.holes()) {
    const std::string name = hole.group() + "/" + hole.hole();
    Add("Holes", state, inspection.decision_rule(), PositionOf(hole, name), groups);
    Add("Holes", state, inspection.decision_rule(), InclinationOf(hole, name), groups);
  }
  for (const v1::HoleResult& hole : inspection.holes())
    if (hole.has_diameter() || !hole.diameter_reason().empty())
      Add("Diameters of holes", "", "", DiameterOf(hole, hole.group() + "/" + hole.hole()), groups);
  for (const v1::HolePitch& pitch : inspection.pitches()) Add("Pitches of holes", "", "", PitchOf(pitch), groups);
}

void AddGroupsOf(const v1::DeviationMap& map, CharacteristicGroups* groups) {
  for (const v1::ProfileFinding& finding : map.profiles()) {
    const v1::ProfileTolerance& tolerance = finding.tolerance();
    const bool is_form = tolerance.zone() == v1::PROFILE_ZONE_FORM;
    Add("Profiles", is_form ? "a fit of its own" : FitStateOf(map.method()),
        tolerance.has_decision_rule() ? RuleText(tolerance.decision_rule()) : map.decision_rule(), ProfileOf(finding),
        groups);
  }
}

std::string NameOf(const v1::Instrument& instrument) {
  return v1::InstrumentKind_Name(instrument.kind()).substr(std::string("INSTRUMENT_KIND_").size()) + " " +
         instrument.manufacturer() + " " + instrument.model() + ", serial number " + instrument.serial_number();
}

CharacteristicGroups GroupsOf(const v1::Assessment& assessment, const plant::v1::Drawing& drawing,
                              const std::vector<v1::Measurement>& measurements) {
  CharacteristicGroups groups;
  const Balloons balloons = BalloonsOf(drawing);
  const std::string general = RuleText(drawing.decision_rule());
  for (const v1::CharacteristicFinding& finding : assessment.findings()) {
    const auto found = balloons.find(finding.characteristic());
    const plant::v1::Characteristic* drawn = found == balloons.end() ? nullptr : found->second;
    const std::string rule = RuleText(finding.decision_rule());
    Add(drawn != nullptr ? PlaceOf(*drawn) : "Not in the drawing",
        drawn != nullptr ? FitStateOf(drawing, *drawn, finding.method()) : FitStateOf(finding.method()),
        rule == general ? "" : rule, WithOthers(CharacteristicOf(finding, drawn), finding, measurements), &groups);
  }
  return groups;
}

Balloons BalloonsOf(const plant::v1::Drawing& drawing) {
  Balloons balloons;
  for (const plant::v1::Characteristic& drawn : drawing.characteristics())
    balloons.emplace(drawn.characteristic(), &drawn);
  return balloons;
}

report::Characteristic CharacteristicOf(const v1::CharacteristicFinding& finding,
                                        const plant::v1::Characteristic* drawn) {
  report::Characteristic out;
  out.id =
      finding.characteristic() + (finding.feature().empty() ? "" : " " + finding.feature()) + ": " + finding.name();
  if (drawn != nullptr) {
    out.requirement = drawn->requirement();
    out.designator = DesignatorOf(*drawn);
  }
  out.unit = UnitOf(finding.unit());
  if (finding.has_nominal()) out.nominal = finding.nominal();
  if (finding.has_lower_limit()) out.lower = finding.lower_limit();
  if (finding.has_upper_limit()) out.upper = finding.upper_limit();
  out.verdict = FileVerdictOf(finding.verdict());
  out.reason = finding.reason();
  if (finding.cure() == v1::CURE_POSSIBLE) out.reason = Joined(out.reason, "a correction can bring it within");
  if (finding.cure() == v1::CURE_NONE) out.reason = Joined(out.reason, "no correction can bring it within");
  if (finding.cure() == v1::CURE_UNKNOWN) out.reason = Joined(out.reason, "not known whether a correction cures it");
  SetValue(finding.has_value(), finding.value(), finding.has_expanded_uncertainty(), finding.expanded_uncertainty(),
           &out);
  return out;
}

}  // namespace sixpoint::inspection
