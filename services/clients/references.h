// What has to be said for the equipment before anything is measured by it.
#pragma once

#include <absl/status/status.h>

#include <chrono>
#include <string>

#include "sixpoint/ingest/v1/scan.pb.h"
#include "sixpoint/plant/v1/machine.pb.h"
#include "sixpoint/plant/v1/reference.pb.h"

namespace sixpoint::clients {

// FAILED_PRECONDITION (REFERENCE_EXPIRED) where there is one and `at`, when it was measured, is not before its end. field: whose it is.
absl::Status CheckCertificate(const std::string& field, bool given, const plant::v1::Certificate& certificate,
                              std::chrono::system_clock::time_point at);
// The same of the machine's touch probe.
absl::Status CheckTouchProbe(const plant::v1::Machine& machine, std::chrono::system_clock::time_point at);
// As the record has it of the rotary joint of that letter; 0: it has none.
double PositioningFigure_deg(const plant::v1::Machine& machine, const std::string& letter);
// FAILED_PRECONDITION (SENSOR_UNSUITABLE) of a machine whose sensor is of the other kind.
absl::Status CheckLineScanner(const plant::v1::Machine& machine);
absl::Status CheckSnapshotSensor(const plant::v1::Machine& machine);
// INVALID_ARGUMENT where the scan is a snapshot, which what is asked for knows nothing of.
absl::Status CheckProfiles(const std::string& field, const ingest::v1::Scan& scan);
// "PROFILES" or "SNAPSHOT".
std::string CloudText(const ingest::v1::ScanHeader& scan);

}  // namespace sixpoint::clients
