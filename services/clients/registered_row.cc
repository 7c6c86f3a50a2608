#include "services/clients/registered_row.h"

namespace sixpoint::clients {

storage::RecordEntry EntryOf(const std::string& kind, const std::string& name,
                             const registration::v1::Registration& registration, const std::vector<std::string>& also) {
  const std::string machine = runtime::LastSegment(registration.machine()),
                    part = runtime::LastSegment(registration.part());
  storage::RecordEntry entry;
  entry.kind = kind;
  entry.name = name;
  entry.inputs = {registration.name(), runtime::RevisedName("machines", machine, registration.machine_revision()),
                  runtime::RevisedName("parts", part, registration.part_revision()), registration.sensor_calibration(),
                  registration.rotation_calibration()};
  for (const registration::v1::ScanAngle& angle : registration.angles())  // each name is kept once
    if (!angle.characterisation().empty()) entry.inputs.push_back(angle.characterisation());
  entry.inputs.insert(entry.inputs.end(), also.begin(), also.end());
  entry.inputs.insert(entry.inputs.end(), registration.scans().begin(), registration.scans().end());
  entry.blade = runtime::LastSegment(registration.blade());
  entry.machine = machine;
  entry.method = registration::v1::Method_Name(registration.method());
  entry.software_version = runtime::SoftwareVersion();
  return entry;
}

}  // namespace sixpoint::clients
