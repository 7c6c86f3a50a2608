// What a measuring plan rests on, fetched.
#include "services/clients/references.h"
#include "services/registration/inputs.h"
#include "services/registration/measuring_plan.h"
#include "services/runtime/errors.h"

namespace sixpoint::registration {

using runtime::NotKnown;

absl::StatusOr<PlanInputs> InputFetcher::FetchForPlan(const v1::PlanMeasurementRequest& request,
                                                      const runtime::Caller& caller) const {
  PlanInputs inputs;
  auto machine = plant_.GetMachine(request.machine(), 0, caller.make_context());
  if (!machine.ok()) return NotKnown("machine", request.machine(), machine.status());
  inputs.machine = *std::move(machine);
  if (absl::Status status = clients::CheckLineScanner(inputs.machine); !status.ok()) return status;
  auto part = plant_.GetPart(request.part(), 0, caller.make_context());
  if (!part.ok()) return NotKnown("part", request.part(), part.status());
  inputs.part = *std::move(part);
  auto sensor = calibrations_.SensorInForce(request.machine(), caller.make_context());
  if (!sensor.ok()) return sensor.status();
  inputs.sensor = *std::move(sensor);
  // A machine may have had a snapshot sensor before.
  if (absl::Status status = clients::CalibrationClient::CheckMaps("profiles", inputs.sensor, {}); !status.ok())
    return status;
  // Where it hangs otherwise, neither the beam nor the housing is where a plan has them.
  if (absl::Status status = clients::CalibrationClient::CheckNotMoved("machine", inputs.sensor, {}); !status.ok())
    return status;
  auto rotation = calibrations_.RotationInForce(request.machine(), caller.make_context());
  if (!rotation.ok()) return rotation.status();
  inputs.rotation = *std::move(rotation);
  auto surface = plant_.GetSurface(inputs.part, caller.make_context(), caller.keep_going);
  if (!surface.ok()) return surface.status();
  inputs.surface = *std::move(surface);
  return inputs;
}

}  // namespace sixpoint::registration
