#include "metrology/measuring_plan/scanner_view.h"

#include <Eigen/Dense>
#include <cmath>

#include "metrology/frames/angles.h"
#include "refusal/message_text.h"
#include "refusal/refusal.h"

namespace sixpoint::metrology {
namespace {

// Of the encoder's direction along the laser plane's normal. A scanner that is mounted turned by more scans along its own line.
constexpr double kLeastCrossing = 0.5;

}  // namespace

absl::StatusOr<ScannerView> ScannerView::Make(const SensorPose& sensor, const ScannerOptics& optics, double margin_mm) {
  Refusals refusals;
  if (!(optics.mid_range_mm > 0 && std::isfinite(optics.mid_range_mm)))
    refusals.Add(Refuse("sensor.mid_range_mm", optics.mid_range_mm, "> 0"));
  if (!(optics.range_mm > 0 && optics.range_mm < 2 * optics.mid_range_mm))
    refusals.Add(Refuse("sensor.range_mm", optics.range_mm, "> 0 and less than twice mid_range_mm"));
  if (!(optics.line_angle_rad > 0 && optics.line_angle_rad < kPi))
    refusals.Add(Refuse("sensor.line_angle_deg", optics.line_angle_rad * kDegPerRad, "> 0 and < 180"));
  if (!(margin_mm >= 0)) refusals.Add(Refuse("margin_mm", margin_mm, "0 or more"));
  if (!sensor.t_sm_mm.allFinite() || !sensor.rotation.allFinite())
    refusals.Add(Refuse("sensor_calibration", "not finite", "a pose"));
  if (absl::Status status = refusals.status(); !status.ok()) return status;

  ScannerView view;
  view.rotation_ = sensor.rotation;
  view.t_sm_mm_ = sensor.t_sm_mm;
  view.optics_ = optics;
  view.margin_mm_ = margin_mm;
  if (!(view.HalfRange_mm() > 0 && view.HalfWidthAt_mm(view.HalfRange_mm()) > 0))
    return Refuse("margin_mm", margin_mm,
                  "less than half of the measuring field, which is " + Rounded(optics.range_mm) + " mm deep and " +
                      Rounded(2 * (optics.mid_range_mm - optics.range_mm / 2) * std::tan(optics.line_angle_rad / 2)) +
                      " mm wide at its near end");
  if (std::abs(sensor.rotation.col(0).x()) < kLeastCrossing)
    return Refuse("sensor_calibration",
                  "a laser plane " + Rounded(std::asin(std::abs(sensor.rotation.col(0).x())) * kDegPerRad) +
                      " deg from machine X",
                  "one that the encoder, along machine X, crosses by 30 deg or more");
  view.machine_from_reading_.col(0) = Eigen::Vector3d::UnitX();
  view.machine_from_reading_.rightCols<2>() = sensor.rotation.rightCols<2>();
  view.reading_from_machine_ = view.machine_from_reading_.inverse();
  return view;
}

bool ScannerView::Reads(double y_mm, double z_mm) const {
  return std::abs(z_mm) <= HalfRange_mm() && std::abs(y_mm) <= HalfWidthAt_mm(z_mm);
}

double ScannerView::HalfWidthAt_mm(double z_mm) const {
  return (optics_.mid_range_mm - z_mm) * std::tan(optics_.line_angle_rad / 2) - margin_mm_;
}

}  // namespace sixpoint::metrology
