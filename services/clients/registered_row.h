// What every result of a registered blade keeps of its registration, and what the journal is told of it.
#pragma once

#include <string>
#include <vector>

#include "services/runtime/computed_on.h"
#include "services/runtime/resource_name.h"
#include "services/runtime/server.h"
#include "sixpoint/registration/v1/registration.pb.h"
#include "storage/record.h"

namespace sixpoint::clients {

template <typename Row>
void SetRegistered(const registration::v1::Registration& registration, Row* row) {
  row->blade_serial = runtime::LastSegment(registration.blade());
  row->registration_id = runtime::LastSegment(registration.name());
  row->machine_id = runtime::LastSegment(registration.machine());
  row->machine_revision = registration.machine_revision();
  row->part_id = runtime::LastSegment(registration.part());
  row->part_revision = registration.part_revision();
  row->sensor_calibration_id = runtime::LastSegment(registration.sensor_calibration());
  row->rotation_calibration_id = runtime::LastSegment(registration.rotation_calibration());
  for (const std::string& scan : registration.scans()) row->scan_ids.push_back(runtime::LastSegment(scan));
  row->method = registration::v1::Method_Name(registration.method()).substr(std::string("METHOD_").size());
  row->software_version = runtime::SoftwareVersion();
  row->computed_on = runtime::ComputedOn();
}

// also: what it rests on besides, before the scans. Summary and who asked are the caller's.
storage::RecordEntry EntryOf(const std::string& kind, const std::string& name,
                             const registration::v1::Registration& registration,
                             const std::vector<std::string>& also = {});

}  // namespace sixpoint::clients
