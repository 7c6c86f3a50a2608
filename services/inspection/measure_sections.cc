#include "services/inspection/measure_sections.h"

#include <utility>

#include "metrology/inspection/plane_points.h"
#include "metrology/parallel/keep_going.h"
#include "metrology/parallel/loops.h"
#include "metrology/sections/throat.h"
#include "refusal/refusal.h"
#include "services/inspection/order_checks.h"

namespace sixpoint::inspection {
namespace {

using metrology::SectionParameter;

constexpr std::size_t kSpanned = 2;  // sections that say together how the blade twists; one more shows how it bows

Eigen::Vector2d InSection(const Eigen::Isometry3d& part_from_section, const Eigen::Vector3d& in_part_mm) {
  return (part_from_section.inverse() * in_part_mm).head<2>();
}

metrology::LeadingHint HintOf(const SectionOrder::Section& section) {
  metrology::LeadingHint hint;
  if (section.leading_mm) hint.near_mm = InSection(section.part_from_section, *section.leading_mm);
  return hint;
}

absl::StatusOr<metrology::PlanePoints> PointsNear(const clients::ScanClient& scans,
                                                  const clients::RegisteredBlade& blade,
                                                  std::vector<metrology::HoleRegion> set_aside,
                                                  const SectionOrder& order, int thread_count,
                                                  const runtime::Caller& caller) {
  metrology::PlanePointsOptions options;
  options.half_width_mm = order.half_width_mm;
  options.threads = thread_count;
  options.keep_going = caller.keep_going;
  options.set_aside = std::move(set_aside);
  std::vector<Eigen::Isometry3d> planes;
  for (const SectionOrder::Section& section : order.sections) planes.push_back(section.part_from_section);
  metrology::PlanePoints points(metrology::PartMapping(*blade.pose, blade.sensor, blade.axes), std::move(planes),
                                std::move(options));
  const absl::Status read =
      clients::ForEachScan(scans, blade, caller, [&](int, const clients::StoredBlocks& scan) -> absl::Status {
        points.Begin(scan.scan);
        for (std::size_t i = 0; i < scan.blocks.size(); ++i) {
          const auto decoded = scan.DecodeOne(i);
          if (!decoded.ok()) return decoded.status();
          if (absl::Status added = points.AddPoints(*decoded); !added.ok()) return added;
        }
        return absl::OkStatus();
      });
  if (!read.ok()) return read;
  return points;
}

absl::Status SetNominal(const metrology::Surface& surface, const SectionOrder::Section& section,
                        SectionFinding* finding) {
  auto nominal = metrology::SurfaceOutline(surface, section.plane, section.near_mm ? &*section.near_mm : nullptr);
  if (!nominal.ok()) return nominal.status();
  finding->nominal = *std::move(nominal);
  const metrology::Outline& outline = finding->nominal.fitted.outline;
  finding->nominal_values = ValuesOf(outline, CamberOf(outline, HintOf(section)));
  return absl::OkStatus();
}

absl::Status Measure(const metrology::Surface& surface, const SectionOrder& order, std::size_t i,
                     const metrology::PlanePoints& points, const metrology::PoseCovariance& pose,
                     SectionFinding* finding) {
  const SectionOrder::Section& section = order.sections[i];
  finding->values.part_from_section = section.part_from_section;
  if (points.in_part_mm(i).empty()) {
    finding->reason = "no point was seen there";
    return absl::OkStatus();
  }
  metrology::OutlineOptions options;
  options.half_width_mm = order.half_width_mm;
  options.surface = &surface;
  options.nominal = &finding->nominal.fitted.outline;
  auto measured = metrology::MeasuredOutline(points.in_part_mm(i), section.plane, options);
  if (absl::IsInvalidArgument(measured.status())) {  // all that was asked for was checked: the points show no outline
    finding->reason = std::string(measured.status().message()).substr(0, 1000);
    return absl::OkStatus();
  }
  if (!measured.ok()) return measured.status();
  finding->measured = *std::move(measured);
  finding->evidence = finding->measured->evidence;
  metrology::UncertaintyOptions uncertainty;
  uncertainty.nominal = options.nominal;
  uncertainty.pose = pose;
  uncertainty.leading = HintOf(section);
  auto values = MeasureSection(*finding->measured, uncertainty);
  if (!values.ok()) return absl::InternalError(std::string(values.status().message()));
  finding->values = *std::move(values);
  return absl::OkStatus();
}

// The sections whose outlines were found, as those kernels take them that look at several.
struct Found {
  std::vector<std::size_t> places;
  std::vector<metrology::MeasuredSection> sections;
  std::vector<metrology::SectionValues> nominal;
};

Found FoundOf(const std::vector<SectionFinding>& findings) {
  Found found;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (!findings[i].measured) continue;
    found.places.push_back(i);
    found.sections.push_back(findings[i].values);
    found.nominal.push_back(findings[i].nominal_values);
  }
  return found;
}

SpanFinding FindingOf(const metrology::SpanValue& span) {
  SpanFinding finding;
  finding.nominal = 0;  // the CAD's own is taken off
  finding.value = span.value;
  finding.expanded = span.expanded;
  if (!span.value) finding.reason = metrology::ReasonOf(span.reason);
  return finding;
}

void SetTwist(const SectionOrder& order, const Found& found, std::vector<SectionFinding>* findings) {
  if (findings->size() < kSpanned) return;
  SpanFinding none;
  none.nominal = 0;
  none.reason = "the section that twist is told from was not measured";
  for (SectionFinding& finding : *findings) finding.twist = none;
  std::size_t reference = 0;
  while (reference < found.places.size() && found.places[reference] != order.reference) ++reference;
  const auto twists = metrology::TwistOf(found.sections, found.nominal, reference);
  if (!twists.ok()) return;
  for (std::size_t k = 0; k < found.places.size(); ++k) (*findings)[found.places[k]].twist = FindingOf((*twists)[k]);
}

void SetBow(const Found& found, std::vector<SectionFinding>* findings) {
  if (findings->size() <= kSpanned) return;
  const auto bows = metrology::BowOf(found.sections, found.nominal);
  SpanFinding none;
  none.nominal = 0;
  none.reason = bows.ok() ? "no outline was found" : std::string(bows.status().message());
  for (SectionFinding& finding : *findings) finding.bow_x = finding.bow_y = none;
  if (!bows.ok()) return;
  // Its ends are the first and the last that were asked for, or it is another bow.
  const bool whole = found.places.front() == 0 && found.places.back() + 1 == findings->size();
  none.reason = "the first or the last section was not measured";
  for (std::size_t k = 0; k < found.places.size(); ++k) {
    SectionFinding& finding = (*findings)[found.places[k]];
    finding.bow_x = whole ? FindingOf((*bows)[k].x) : none;
    finding.bow_y = whole ? FindingOf((*bows)[k].y) : none;
  }
}

SpanFinding ThroatOf(const SectionOrder& order, std::size_t i, const SectionFinding& finding) {
  Eigen::Isometry2d beside = Eigen::Isometry2d::Identity();
  beside.translation() =
      (order.sections[i].part_from_section.linear().transpose() * order.neighbour->offset_mm).head<2>();
  SpanFinding throat;
  const metrology::Outline& drawn = finding.nominal.fitted.outline;
  const auto nominal = metrology::ThroatOf(drawn, drawn, beside);
  if (nominal.ok()) throat.nominal = nominal->width_mm;
  if (!finding.measured) return throat;
  const metrology::FittedOutline& fitted = finding.measured->fitted;
  const auto found = metrology::ThroatOf(fitted.outline, fitted.outline, beside);
  if (!found.ok()) {
    throat.reason = std::string(found.status().message());
  } else if (found->beside_gap) {
    throat.reason = "where the passage is least a gap lies beside it";
  } else {
    throat.value = found->width_mm;
    throat.expanded =
        2 * metrology::ThroatStandardUncertainty(*found, fitted, finding.values.form, fitted, finding.values.form,
                                                 order.neighbour->standard_uncertainty_mm);
  }
  return throat;
}

}  // namespace

absl::StatusOr<std::vector<SectionFinding>> MeasureSections(const clients::ScanClient& scans,
                                                            const clients::RegisteredBlade& blade,
                                                            std::vector<metrology::HoleRegion> set_aside,
                                                            const SectionOrder& order, int thread_count,
                                                            const runtime::Caller& caller) {
  std::vector<SectionFinding> findings(order.sections.size());
  std::vector<absl::Status> done(findings.size());
  metrology::KeepGoing keep_going(caller.keep_going);
  const auto each = [&](const auto& work) -> absl::Status {
    metrology::ForEach(findings.size(), thread_count, [&](std::size_t i) {
      done[i] = keep_going() ? work(i) : absl::CancelledError("sections: the caller is gone or its time is over");
    });
    for (std::size_t i = 0; i < done.size(); ++i)
      if (!done[i].ok()) return Under(At("sections", static_cast<int>(i)) + ".", done[i]);
    return absl::OkStatus();
  };
  // First of the CAD: what cannot be meant is refused before a scan is read.
  absl::Status status =
      each([&](std::size_t i) { return SetNominal(*blade.surface, order.sections[i], &findings[i]); });
  if (!status.ok()) return status;
  const auto points = PointsNear(scans, blade, std::move(set_aside), order, thread_count, caller);
  if (!points.ok()) return points.status();
  const metrology::PoseCovariance pose = points->Covariance();
  status = each([&](std::size_t i) { return Measure(*blade.surface, order, i, *points, pose, &findings[i]); });
  if (!status.ok()) return status;
  const Found found = FoundOf(findings);
  SetTwist(order, found, &findings);
  SetBow(found, &findings);
  for (std::size_t i = 0; order.neighbour && i < findings.size(); ++i)
    findings[i].throat = ThroatOf(order, i, findings[i]);
  for (SectionFinding& finding : findings)
    for (std::optional<SpanFinding>* one : {&finding.twist, &finding.bow_x, &finding.bow_y, &finding.throat})
      if (*one && !finding.measured) (*one)->reason = "no outline was found";
  return findings;
}

}  // namespace sixpoint::inspection
