// A made-up vane: its surface with deviations, holes, sections, and all that a report tells of it.
#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "report/deviation_picture.h"
#include "report/first_article.h"
#include "report/report.h"

namespace sixpoint::report {

// Of a section at a height: half-way around from the leading edge over the back to it again; part frame.
inline OutlinePoint VanePoint(double turn, double height_mm) {
  const double size = 34 - 0.06 * height_mm, twist = 0.35 + 0.006 * height_mm;
  const auto at = [&](double t) -> std::pair<double, double> {
    const double angle = 2 * M_PI * t, along = 0.5 * (1 + std::cos(angle));  // 1 at the leading edge
    const double thick = 0.6 * (0.2969 * std::sqrt(1 - along) - 0.126 * (1 - along) - 0.3516 * std::pow(1 - along, 2) +
                                0.2843 * std::pow(1 - along, 3) - 0.1015 * std::pow(1 - along, 4)) +
                         0.012;
    const double camber = 0.5 * along * (1 - along), side = std::sin(angle) >= 0 ? 1 : -1;
    const double x = size * (along - 0.5), y = size * (camber + side * thick - 0.06);
    return {x * std::cos(twist) - y * std::sin(twist), x * std::sin(twist) + y * std::cos(twist)};
  };
  const auto [x, y] = at(turn);
  const auto [x0, y0] = at(turn - 1e-3);
  const auto [x1, y1] = at(turn + 1e-3);
  const double length = std::hypot(x1 - x0, y1 - y0);
  return {x, y, (y1 - y0) / length, -(x1 - x0) / length, 0};
}

inline double VaneDeviation_um(double turn, double height_mm) {
  return 22 * std::sin(2 * M_PI * turn + 0.05 * height_mm) +
         45 * std::exp(-std::pow((turn - 0.22) / 0.05, 2) - std::pow((height_mm - 62) / 9, 2)) -
         12 * std::cos(0.08 * height_mm);
}

// around * up * 2 triangles.
inline DeviationSurface VaneSurface(int around, int up) {
  DeviationSurface surface;
  for (int j = 0; j <= up; ++j)
    for (int i = 0; i < around; ++i) {
      const double height = 90.0 * j / up;
      const OutlinePoint p = VanePoint(static_cast<double>(i) / around, height);
      surface.vertices_mm.push_back(
          {static_cast<float>(p.x_mm), static_cast<float>(p.y_mm), static_cast<float>(height)});
    }
  for (int j = 0; j < up; ++j)
    for (int i = 0; i < around; ++i) {
      const auto at = [&](int a, int b) { return static_cast<std::uint32_t>(b * around + a % around); };
      const double turn = (i + 0.5) / around, height = 90.0 * (j + 0.5) / up;
      const bool hidden = height < 12 && turn > 0.55 && turn < 0.8;
      for (const auto& triangle : {std::array<std::uint32_t, 3>{at(i, j), at(i + 1, j), at(i + 1, j + 1)},
                                   std::array<std::uint32_t, 3>{at(i, j), at(i + 1, j + 1), at(i, j + 1)}}) {
        surface.triangles.push_back(triangle);
        surface.deviations_um.push_back(hidden ? std::numeric_limits<float>::quiet_NaN()
                                               : static_cast<float>(VaneDeviation_um(turn, height)));
      }
    }
  return surface;
}

inline Section VaneSection(const std::string& name, double height_mm) {
  Section section;
  section.name = name;
  section.height_mm = height_mm;
  section.fit_state = "best fit of the section in its plane";
  constexpr int kCount = 240;
  OutlinePiece nominal, first, second;
  nominal.closed = true;
  for (int i = 0; i < kCount; ++i) {
    const double turn = static_cast<double>(i) / kCount;
    OutlinePoint p = VanePoint(turn, height_mm);
    nominal.points.push_back(p);
    p.deviation_mm = VaneDeviation_um(turn, height_mm) / 1000;
    p.x_mm += p.deviation_mm * p.normal_x;
    p.y_mm += p.deviation_mm * p.normal_y;
    if (turn < 0.6) first.points.push_back(p);
    if (turn > 0.68) second.points.push_back(p);
  }
  section.outlines.nominal = {nominal};
  section.outlines.measured = {first, second};
  section.outlines.lower_mm = -0.05;
  section.outlines.upper_mm = 0.05;
  const OutlinePoint leading = VanePoint(0, height_mm), trailing = VanePoint(0.5, height_mm);
  const OutlinePoint back = VanePoint(0.17, height_mm), front = VanePoint(0.83, height_mm);
  section.outlines.chord_mm = {{{leading.x_mm, leading.y_mm}, {trailing.x_mm, trailing.y_mm}}};
  section.outlines.greatest_circle = PlaneCircle{(back.x_mm + front.x_mm) / 2, (back.y_mm + front.y_mm) / 2,
                                                 std::hypot(back.x_mm - front.x_mm, back.y_mm - front.y_mm) / 2};
  section.outlines.leading_circle =
      PlaneCircle{leading.x_mm - 1.4 * leading.normal_x, leading.y_mm - 1.4 * leading.normal_y, 1.4};
  const auto parameter = [](const char* id, const char* unit, double nominal_value, double tolerance, double value,
                            double u, Verdict verdict) {
    Characteristic c;
    c.id = id, c.unit = unit, c.nominal = nominal_value, c.lower = nominal_value - tolerance,
    c.upper = nominal_value + tolerance;
    c.value = value, c.expanded_uncertainty = u, c.verdict = verdict;
    return c;
  };
  section.parameters = {parameter("chord NOSE_TAIL", "mm", 33.412, 0.15, 33.4387, 0.0092, Verdict::kConform),
                        parameter("stagger NOSE_TAIL", "deg", 31.25, 0.2, 31.318, 0.021, Verdict::kConform),
                        parameter("thickness INSCRIBED", "mm", 6.204, 0.06, 6.2588, 0.0071, Verdict::kUndecidable),
                        parameter("leading radius", "mm", 1.4, 0.12, 1.4216, 0.0155, Verdict::kConform)};
  section.parameters[0].others = {{"CMM Acme Nine, serial number 17", 33.4361, 0.0041},
                                  {"after best fit", 33.4401, {}}};
  Characteristic trailing_radius;
  trailing_radius.id = "trailing radius";
  trailing_radius.unit = "mm";
  trailing_radius.nominal = 0.62;
  trailing_radius.lower = 0.52, trailing_radius.upper = 0.72;
  trailing_radius.reason = "a gap within the part that the algorithm uses";
  section.parameters.push_back(trailing_radius);
  return section;
}

inline std::vector<Hole> VaneHoles() {
  std::vector<Hole> holes;
  for (int i = 0; i < 9; ++i) {
    const OutlinePoint p = VanePoint(0.04, 12 + 8.0 * i);
    Hole hole;
    hole.id = "G1/H" + std::to_string(i + 1);
    hole.nominal_mm = {p.x_mm, p.y_mm + (i % 2 ? 1.8 : -1.8), 12 + 8.0 * i};
    hole.position_limit_mm = 0.1;
    hole.inclination_limit_deg = 1;
    if (i == 6) {
      hole.reason = "no pin stands in it";
    } else {
      hole.displacement_mm = {0.012 * std::sin(i), 0.02 * std::cos(2 * i), 0.018 * i - 0.05 + (i == 8 ? 0.04 : 0)};
      hole.position_expanded_uncertainty_mm = 0.0064;
      hole.inclination_deg = 0.12 + 0.05 * i;
      hole.inclination_expanded_uncertainty_deg = 0.09;
      hole.verdict = i == 8 ? Verdict::kNotConform : i == 7 ? Verdict::kUndecidable : Verdict::kConform;
      if (i == 7) hole.reason = "its position is nearer to the limit than U";
    }
    holes.push_back(hole);
  }
  return holes;
}

inline Traceability VaneTraceability() {
  Traceability t;
  t.results = {"inspections/0198a3c0-0000-7000-8000-000000000001"};
  t.registrations = {"registrations/0198a3c0-0000-7000-8000-000000000abc"};
  t.method = "SIX_POINT";
  t.fit_state = "six datum points A1 to C1";
  t.machine = "mill-1, revision 7";
  t.sensor = "LS-25, serial 4711";
  t.requested_by = "users/jane via services/inspection";
  t.software = {{"sixpoint", "0.1.0"}, {"schema", "V0061"}};
  const auto day = [](int days) { return Time(std::chrono::seconds(1795000000 + 86400LL * days)); };
  t.calibrations = {
      {"calibrations/0198a3c0-0000-7000-8000-0000000000c1", "sensor to machine", "IN_FORCE", day(-20), day(160)},
      {"calibrations/0198a3c0-0000-7000-8000-0000000000c2", "rotary axes", "IN_FORCE", day(-18), std::nullopt}};
  for (int i = 0; i < 4; ++i) {
    ScanUsed scan{"scans/0198a3c0-0000-7000-8000-00000000005" + std::to_string(i),
                  std::string(64, static_cast<char>('a' + i)), day(0), 1234567 + i};
    t.scans.push_back(scan);
  }
  t.budgets = {{"G1/H9/position",
                "mm",
                {{"scanner's noise", 0.0008, 410.0},
                 {"sensor calibration", 0.0017, 38.0},
                 {"rotary axes", 0.0021, 24.0},
                 {"thermal expansion", 0.0011, std::nullopt}},
                0.0064}};
  return t;
}

inline Report VaneReport(int around = 240, int up = 160) {
  Report report;
  report.title = "Inspection report";
  report.plant = "Plant A, Turbine Components";
  report.serial = "SN-0002";
  report.part = "vane-4711";
  report.part_revision = "3";
  report.drawing = "DWG-4711-02";
  report.drawing_revision = "C";
  report.work_order = "WO-2026-1180";
  report.operation = "0020";
  report.measured_at = Time(std::chrono::seconds(1795000000));
  report.verdict = Verdict::kNotConform;
  report.decision_rule = "ISO 14253-1: conform where the value is inside its limits by more than U (95 %)";
  report.holes = VaneHoles();
  CharacteristicGroup holes{"Holes", "six datum points A1 to C1", {}};
  for (const Hole& hole : report.holes) {
    Characteristic c;
    c.id = hole.id + "/position", c.requirement = "\u2316 \u2300 0.2 | A | B | C", c.unit = "mm", c.nominal = 0,
    c.upper = 0.1;
    if (hole.id == "G1/H9") c.designator = "KEY";
    if (hole.displacement_mm) {
      const auto& d = *hole.displacement_mm;
      c.value = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
      c.expanded_uncertainty = 0.0064;
    }
    c.verdict = hole.verdict, c.reason = hole.reason;
    holes.characteristics.push_back(c);
  }
  Characteristic profile;
  profile.id = "12.1 profile of the airfoil", profile.requirement = "\u2313 0.1 | A | B | C",
  profile.designator = "MAJOR";
  profile.unit = "mm", profile.nominal = 0, profile.lower = -0.05, profile.upper = 0.05, profile.value = 0.0548;
  profile.expanded_uncertainty = 0.0041, profile.verdict = Verdict::kNotConform;
  report.groups = {holes, {"Profile", "form and location: six datum points A1 to C1", {profile}}};
  report.regions = {
      {"whole", "", 5120.4, 4881.7, RegionDeviation::Values{-1.3, 17.8, -31.2, -0.9, 29.4, -33.6, 54.8, 4.1}, ""},
      {"leading edge", "", 412.0, 412.0,
       RegionDeviation::Values{4.2, 12.1, -11.0, 3.8, 22.7, -14.2, 25.0, std::nullopt}, ""},
      {"root fillet", "", 214.9, 0, std::nullopt, "the clamp hides it"}};
  report.sections = {VaneSection("Section AA", 20), VaneSection("Section BB", 60)};
  PictureOptions options;
  options.scale_um = 50, options.band_um = 10;
  report.deviation_pictures.push_back(DrawDeviation(VaneSurface(around, up), options).value());
  report.deviation_pictures.front().title = "after best fit";
  report.deviation_pictures.push_back(report.deviation_pictures.front());
  report.deviation_pictures.back().title = "after six points";
  report.pictures_left_out = 3;
  report.traceability = VaneTraceability();
  return report;
}

inline FirstArticle VaneFirstArticle() {
  FirstArticle f;
  f.part_number = "vane-4711", f.part_name = "Vane, stage 2", f.serial_number = "SN-0002",
  f.fair_identifier = "FAIR-2026-018";
  f.form1.part_revision = "3", f.form1.drawing_number = "DWG-4711-02", f.form1.drawing_revision = "C";
  f.form1.organization_name = "Plant A, Turbine Components", f.form1.purchase_order = "PO-88123";
  f.form1.verified = {"J. Doe", Time(std::chrono::seconds(1795100000))};
  f.form2.materials = {{"Nickel alloy casting", "AMS 5391", "", "Foundry B", "Yes", "CoC-5521"},
                       {"Fluorescent penetrant inspection", "ASTM E1417", "", "Lab C", "NA", "CoC-5530"}};
  f.form3 = {};
  int number = 0;
  const Report report = VaneReport(24, 12);
  for (const CharacteristicGroup& group : report.groups)
    for (const Characteristic& c : group.characteristics) {
      FirstArticle::Line line;
      line.number = std::to_string(++number);
      line.reference_location = "sheet 1, zone C" + std::to_string(number);
      line.characteristic = c;
      f.form3.push_back(line);
    }
  f.form3.back().nonconformance = "NC-2026-044";
  f.date = Time(std::chrono::seconds(1795000000));
  return f;
}

}  // namespace sixpoint::report
