// The work of PlanMeasurement: the kernel's task from what a request and the records say, and its plan as a message. Pure.
#pragma once

#include <absl/status/statusor.h>

#include <functional>
#include <memory>

#include "metrology/measuring_plan/scan_program.h"
#include "services/clients/calibrations.h"
#include "sixpoint/plant/v1/plant.pb.h"
#include "sixpoint/registration/v1/measuring_plan.pb.h"

namespace sixpoint::registration {

struct PlanInputs {
  plant::v1::Machine machine;
  plant::v1::Part part;
  std::shared_ptr<const metrology::Surface> surface;
  clients::FetchedSensorCalibration sensor;
  clients::FetchedRotationCalibration rotation;
};

// Names, and whether numbers are finite and within what the contract takes.
absl::Status CheckPlanRequest(const v1::PlanMeasurementRequest& request);

// INVALID_ARGUMENT, OUT_OF_RANGE, CANCELLED as MakeMeasuringPlan. FAILED_PRECONDITION: six points asked of a part that has none (SIX_POINTS_MISSING), a
// machine whose joints make no chain (KINEMATICS_UNSUITABLE).
absl::StatusOr<v1::MeasuringPlan> PlanOf(const v1::PlanMeasurementRequest& request, const PlanInputs& inputs,
                                         int threads, const std::function<bool()>& keep_going);

}  // namespace sixpoint::registration
